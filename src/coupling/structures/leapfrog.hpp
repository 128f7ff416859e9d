/// Blocks at a structure in explicit steps: where those that are pressed go, and strain rates. The state
/// holds velocities of full steps, as everywhere; within the step those of half steps (leapfrog.cpp).
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// The blocks that something hard touches, or pressed on in the last step.
void find_pressed(const IslandContext& in, Step& step);

/// From the velocities of full steps to those of the half steps before, and from those of the half steps
/// after back.
void to_half_steps(const IslandContext& in, Step& step, double h);

void to_full_steps(const IslandContext& in, Step& step, double h);

/// A contact spring of a block that strains, beside a structure in explicit steps. A bed's columns know where
/// the block lies.
bool goes_by_its_row(const IslandContext& in, const Touch& t);

}  // namespace talus::coupling

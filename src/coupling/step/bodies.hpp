/// The bodies of a step: their free flow, and where the contacts are linearised.
#pragma once
#include <algorithm>
#include <span>

#include "contact/tolerances.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Speed below which a block counts as at rest, in a step of length h [m/s].
inline double rest_speed(const dda::Model& model, double h) {
  return contact::tolerances().rest_fall * model.gravity.norm() * h;
}

/// True if no point of the blocks moves faster than `still` [m/s].
inline bool all_slow(const dda::Model& model, const dda::State& state, std::span<const int> blocks,
                     double still) {
  return std::all_of(blocks.begin(), blocks.end(), [&](int b) {
    const auto k = static_cast<std::size_t>(b);
    return state.v[k].norm() +
               model.blocks[k].shape->radius * (state.w[k].norm() + state.eps_rate[k].norm()) <=
           still;
  });
}

/// Bound on the way of the farthest point of a block between two of its poses [m].
inline double farthest_way(const dda::Model& model, int block, const Pose& from, const Pose& to) {
  return (to.c - from.c).norm() +
         model.blocks[static_cast<std::size_t>(block)].shape->radius * (to.F - from.F).norm();
}

/// Free flow of all bodies over h, from the present state; h = 0: for an impulse of no duration, or a
/// correction of positions. `frozen_strain`: no block strains in it.
void begin_step(const IslandContext& in, Step& step, double h, bool frozen_strain);

/// Keeps the state of the bodies, and brings it back.
void save_bodies(const IslandContext& in, Step& step);

void restore_bodies(const IslandContext& in, Step& step);

/// Whether the state of all bodies is made of numbers.
bool finite_bodies(const IslandContext& in, const Step& step);

/// Of the bodies with one of their velocities, in the masses of the problem [J].
double kinetic_energy(const Step& step, Vec12 Body::*velocity);

/// Contacts of a block at rest are linearised where it is: what can stand is then found to stand, however
/// long the step.
void linearise_resting(const IslandContext& in, Step& step, double h);

/// Blocks that the impulses just applied from the start of the step strain: they go by x + h v^+, and so must
/// their strains, or the stress that the solution met were another than that of the strain reached; where the
/// step does not resolve their vibration the difference is energy made. True if one did not yet.
bool strain_from_start(Step& step);

/// The contacts of a body are linearised about its pose `ref`, of that orientation, at the end of the step.
void linearise_about_end(Body& b, const Quat& q_end);

/// No point of its blocks is faster against their mean motion, at structures against these: what moves along
/// with all others is no motion of the contacts among them [m/s].
double fastest_among(const IslandContext& in, const Step& step);

/// Takes the step back.
void reject_step(const IslandContext& in, Step& step, IslandReport& report);

}  // namespace talus::coupling

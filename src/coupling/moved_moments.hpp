/// What spins give back when a projection moves blocks apart while they move on: m d x v of angular momentum would come out of nothing.
#pragma once
#include <span>
#include <vector>

#include "core/types.hpp"

namespace talus::coupling {

/// A body that a projection moved.
struct MovedBody {
  double mass = 0;      // [kg]
  double inertia = 0;   // trace [kg m^2]
  Vec3 way = Vec3::Zero();        // of its centroid [m]
  Vec3 velocity = Vec3::Zero();   // [m/s]
};

/// A row of the projection between two of them: `impulse` moved b, its opposite moved a [kg m].
struct MovedPair {
  int a = 0, b = 0;
  Vec3 impulse = Vec3::Zero();
};

/// Angular momentum that each body gains by its way, to be taken from its spin [kg m^2/s]. Between two bodies
///
///   sum m d x v = p n x (v_b - v_a),   d = -+ p n / m
///
/// shared by their inertias; what is fixed takes up any. Jammed bodies balance impulses of any size that move nothing: one between two others of unlike velocities would be
/// turned by them without bound. Where an impulse is larger than all that was moved, each body answers for its own way instead,
///
///   m d x (v - <v>)
///
/// with the mean velocity of all: of bodies that nothing fixed holds the same sum, since what moves apart leaves the centre of mass where it was. Either is the same for every
/// observer.
std::vector<Vec3> moved_moments(std::span<const MovedBody> bodies, std::span<const MovedPair> pairs);

}  // namespace talus::coupling

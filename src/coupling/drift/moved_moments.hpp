/// What a projection of positions owes to the momenta of the bodies that it moves.
///
/// It moves bodies by the least ways, whatever their masses (docs/theory/contact.md, Drift). Of a cluster,
/// the bodies joined by contacts that push, which nothing fixed holds, the centre of mass would move by <d>
/// and the angular momentum would grow by sum m d x v. The ways become
///
///   d - <d>,    <d> = sum m d / sum m
///
/// and each body's spin gives back m d x (v - <v>), which sums to what is gained, the same for every
/// observer. What is fixed takes up any momentum. A structure that nothing supports does not, nor can it be
/// moved: of a cluster at one the ways stay and the spins give back m d x v, so that the momenta about the
/// origin of the scene are what they were.
#pragma once
#include <span>
#include <vector>

#include "core/types.hpp"

namespace talus::coupling {

/// A body that a projection moved.
struct MovedBody {
  double mass = 0;               // [kg]
  bool held = false;             // at fixed points
  Vec3 way = Vec3::Zero();       // of its centroid [m]
  Vec3 velocity = Vec3::Zero();  // [m/s]
};

/// Two bodies that a contact pushed apart; a: none is fixed, or a structure that nothing supports.
struct MovedPair {
  static constexpr int fixed = -1, free_structure = -2;
  int a = fixed, b = 0;
};

/// Takes <d> from the ways; angular momentum that each body has gained by its way, to be taken from its spin
/// [kg m^2/s].
std::vector<Vec3> keep_momenta(std::span<MovedBody> bodies, std::span<const MovedPair> pairs);

}  // namespace talus::coupling

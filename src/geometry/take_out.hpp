/// A body that is taken out of the ground: the ground keeps a hollow of its shape.
///
///   mass = body and ground,   ground' = ground without body
///
/// Both are bounded by the same triangles where they touch, corner for corner, and so are the blocks that are
/// cut from the mass: points are exact up to there (exact_complex.hpp). Where slip surface and ground
/// coincide there is no mass; where the mass only touches itself in an edge it is two pieces.
#pragma once
#include <memory>
#include <vector>

#include "contact/geometry/surface.hpp"
#include "core/error.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {

class CellComplex;

struct TakenOut {
  std::shared_ptr<const CellComplex> mass;  // its pieces, for cutting (CutSpec::mass)
  TriangleSurface ground;                   // what is left, its hollow of material `bed`
  std::vector<char> hollow;                 // of a triangle of the ground: belongs to the hollow
  std::vector<Problem> warnings;            // of pieces that stay
};

/// `ground`: solid below; it must face up where the body is. The body is what lies above the slip surface,
/// within the region; of the two one may be null. Where the slip surface is the ground itself, or lies above
/// it, it takes nothing out. `region`: closed, outward. Pieces of less than `least_volume` [m^3] stay in the
/// ground. Throws InputError where the ground or the slip surface overhangs, or nothing of the body lies in
/// the ground.
TakenOut take_out(const TriangleSurface& ground, const TriangleSurface* slip, const Mesh* region, int bed,
                  double least_volume = 0);

}  // namespace talus::geometry

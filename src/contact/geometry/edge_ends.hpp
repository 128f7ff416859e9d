/// Where a convex edge of a body goes on beyond its end.
///
/// A body is locally a union of convex pieces, and what a convex piece does not have is no corner of contact.
/// Of the wedge W of a convex edge, between the planes of its two faces, the edge ends at its vertex only if
/// the body does not contain W beyond: a floor's lip that runs into a wall goes on inside it, and the vertex
/// where it meets the wall is a corner of neither.
#pragma once
#include <span>

#include "core/types.hpp"

namespace talus::contact {

/// A triangle at a vertex: its outward unit normal and the unit directions of its two sides there,
/// counter-clockwise seen from outside.
struct Sector {
  Vec3 n, p, q;
};

/// True if the body with these triangles about a vertex contains the wedge of the edge that leaves the vertex
/// along d, extended to -d. `left`, `right`: outward normals of the edge's faces (of a rim the same twice,
/// whose wedge is its plane).
bool goes_on(std::span<const Sector> around, const Vec3& d, const Vec3& left, const Vec3& right);

}  // namespace talus::contact

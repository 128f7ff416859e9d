/// One node of a skin against the faces of another: what structures touch each other by.
#pragma once
#include <vector>

#include "contact/detection/detect.hpp"

namespace talus::contact {

/// Cosine between a skin's direction at a node and the normal of a face that it may lie on, at most: a cube's
/// corner (averaged normals) faces each of the three planes it can lie on by -0.58.
inline constexpr double node_faces = -0.3;

/// Finds the face of `index` that lies nearest to x, within `margin` on either side, under x, and facing it
/// (`outward`: the skin's direction at the node, unit; zero: whichever way it looks). Fills point_a (on the
/// face), point_b = x, normal, gap and face_a; key and area are the caller's. False if there is none: edges
/// of the two skins that cross are not looked for.
bool node_surface(const SurfaceIndex& index, const Vec3& x, const Vec3& outward, double margin,
                  ContactPoint& out);

/// Vertices of one skin that lie within `reach` of the box about another, ascending; of focused ones only
/// what they follow.
void nodes_near(const SurfaceIndex& nodes, const SurfaceIndex& faces, double reach,
                std::vector<int>& vertices);

/// Area of a skin's faces that belongs to one of its nodes, as a vector along their normals: a quarter of
/// each face [m^2].
Vec3 tributary_area(const SurfaceIndex& index, int vertex);

}  // namespace talus::contact

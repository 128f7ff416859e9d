/// What of a body's surface belongs to one of its corners, seen along the normal of the ground.
///
/// Every face is shared among its corners by the lines from its middle to the middles of its edges. A
/// corner's cell is its share of the faces that look at the ground:
///
///   A = sum over them of the areas across n,   z = n . (x - x_corner) >= 0: height of a point above the
///   corner
///
/// so that the cells of all corners together are the area of the body across n, however finely it is meshed.
/// A cell presses from where its corner touches on. What hangs down beside its corner comes late; the heights
/// of what rises are taken so much less that the mean depth of the whole is right once it is in.
///
/// symbol   meaning                              unit    shape
/// n        out of the ground, towards the body          3, body axes
/// A        area of the cell across n            m^2
///
/// All of a body that does not strain: rock strains by too little to matter here.
#pragma once
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/geometry/polyhedron.hpp"
#include "contact/laws/corner_area.hpp"

namespace talus::contact {

struct CornerCell {
  double area = 0;
  std::vector<CornerArea::Triangle> triangles;  // none: all of it is as high as the corner
};

/// No area where no face of the corner looks at the ground. `divided`: beside points between corners.
CornerCell corner_cell(const Polyhedron& body, int corner, const Vec3& n, bool divided);

/// Points of a body's surface by which it presses on terrain that gives way by areas: its corners, and the
/// middles of the edges of triangles that are longer than its radius. Their depth is the distance to the
/// ground's surface, their normal the way there. Beside points between them the cells of corners are thirds
/// of the quarters that large triangles are divided into.
///
/// Appends those within `margin` of the ground above it or in it, down to the radius.
void surface_points(const SurfaceIndex& terrain, const Polyhedron& body, const Pose& pose, double margin,
                    std::vector<ContactPoint>& out);

/// Whether a contact is one of them, and its cell.
bool is_surface_point(FeatureKey key);
CornerCell cell_of_point(const Polyhedron& body, FeatureKey key, const Vec3& n);

}  // namespace talus::contact

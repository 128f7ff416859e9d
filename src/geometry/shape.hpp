/// Blocks by name: the paper's shapes, the field's (EOTA), and random rocks.
///
/// kind             size gives                   made of
/// box              full extents                 8 corners
/// tetrahedron      full extents of its box      corners (1,1,1), (1,-1,-1), (-1,1,-1), (-1,-1,1) of it, in
///                                               halves of the extents; regular if the extents
///                                               are equal
/// dodecahedron     full extents                 regular if the extents are equal (20 corners)
/// icosahedron      full extents                 regular if the extents are equal (12 corners)
/// sphere           full extents, or diameter    `longitudes` meridians x `latitudes` circles, equally
///                                               spaced, and two poles
/// EOTA111, EOTA221 full extents a, b, c         (+-a/2, +-b/4, +-c/4), (+-a/4, +-b/2, +-c/4),
///                                               (+-a/4, +-b/4, +-c/2): V = 17/24 a b c; with volume or mass
///                                               alone a:b:c is 1:1:1 or 2:2:1
/// convex           -                            hull of `vertices`
/// file             -                            closed mesh
/// random-convex    full extents (or `aspect`)   hull of random points on a sphere; `seed`
/// random-concave   full extents (or `aspect`)   star-shaped rock with dents; `seed`
///
/// `volume`, or `mass` with a density, then scales the shape equally in all directions (about its centroid).
/// The polyhedron is returned in body axes about its volume centroid; `shift` is the centroid in the axes of
/// the input, so that input = body + shift: a mesh file used without a position keeps its world coordinates
/// by position = shift.
///
/// The same spec gives the same polyhedron on every machine: the random numbers are our own.
#pragma once
#include <string>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "core/types.hpp"

namespace talus::geometry {

struct ShapeSpec {
  std::string kind = "box";
  Vec3 size = Vec3::Zero();           // full extents along the body axes [m]; zero: not given
  double diameter = 0;                // sphere [m]
  int longitudes = 0, latitudes = 0;  // sphere; 0: 12 and 5
  std::vector<Vec3> vertices;         // convex [m]
  std::string file;                   // absolute path
  double volume = 0;                  // [m^3]; > 0 scales the shape
  double mass = 0;                    // [kg]; > 0 scales the shape
  double density = 0;                 // [kg/m^3]; needed with mass
  unsigned seed = 0;                  // random rocks
  Vec3 aspect = Vec3::Ones();         // random rocks: proportions of the extents
};

struct Shape {
  Polyhedron body;            // body axes, about the centroid
  Vec3 shift = Vec3::Zero();  // centroid in the axes of the input [m]
  double volume = 0;          // [m^3]
};

/// Throws InputError (key: the name of the field at fault).
Shape make_shape_with_shift(const ShapeSpec& spec);
inline Polyhedron make_shape(const ShapeSpec& spec) { return make_shape_with_shift(spec).body; }

/// The kinds, for messages and documentation.
const std::vector<std::string>& shape_kinds();

}  // namespace talus::geometry

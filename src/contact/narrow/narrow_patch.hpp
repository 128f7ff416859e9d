/// The part of a body that may touch: triangles, true convex edges and vertices in world axes about a local
/// origin. Internal to src/contact.
#pragma once
#include <span>
#include <vector>

#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_math.hpp"

namespace talus::contact::narrow {

class NearTriangles;

struct Patch {
  struct Triangle {
    int id;    // reported as face_a / face_b
    int face;  // key; equal for coplanar neighbours
    Vec3 a, b, c, n;
    bool sharp[3];  // side k is a convex edge or a rim
    bool rim[3];    // side k ends the surface
    bool tip[3];    // corner k ends a convex edge or a rim, be it a side of other triangles
    double level;   // n . a
  };
  struct Edge {
    int id;
    int v0, v1;
    int left_face, right_face;  // keys, -1 on a rim
    Vec3 a, b;
    Vec3 left, right;  // outward normals of the two faces (a rim: the same twice)
    Vec3 into_left,
        into_right;  // in-plane unit directions from the edge into the faces (a rim: the same twice)
    bool on_at_a = false, on_at_b = false;  // there the edge goes on beyond its end (edge_ends.hpp)
  };
  struct Vertex {
    int id;
    Vec3 x;
    int first, count;       // into directions: unit vectors along the true edges at it
    int first_face, faces;  // into face_normals
    bool straight = false;  // of a skin that bends, within a straight ridge, whose crossings say it all but
                            // of faces
  };
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;
  std::vector<Vec3> directions, face_normals;
  void clear() {
    triangles.clear(), edges.clear(), vertices.clear(), directions.clear(), face_normals.clear();
  }
};

/// A part of space that two bodies share: a box, and along one more direction n . x from low to high.
struct Common {
  Box3 box;
  Vec3 n = Vec3::UnitX();
  double low, high;
  bool contains(const Vec3& x) const {
    const double h = n.dot(x);
    return h >= low && h <= high && box.contains(x);
  }
};

/// Everything of a posed polyhedron that reaches into it.
void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, const Common& common, Patch& patch);
/// Everything of a posed polyhedron that is nearer to a surface than `reach`, or behind it. The surface is
/// all there is of it in the box about the polyhedron grown by `reach`: where nothing of it is within a ball,
/// the ball lies before it if its middle does. `facing`: those of its triangles behind whose planes the
/// polyhedron may be, up to `reach`.
void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, const NearTriangles& surface,
            std::span<const int> facing, double margin, double touch, Patch& patch);
/// Everything of a surface near `box`, which is relative to `origin`. `viewpoint` picks the side of a
/// two-sided surface.
void gather(const SurfaceIndex::Impl& s, const Vec3& origin, const Box3& box, Patch& patch);

}  // namespace talus::contact::narrow

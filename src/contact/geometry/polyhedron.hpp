/// Boundary of a closed polyhedron, convex or concave, in body axes about its centroid.
///
///   world vertex  x_v = c + F X_v,   F = R (I + eps)
///
/// symbol  meaning                                      unit  shape
/// X       vertex positions in body axes                m     V x 3
/// F       deformation gradient of the block            1     3 x 3
///
/// Faces are planar polygons (coplanar triangles already merged), counter-clockwise seen from outside.
#pragma once
#include <array>
#include <vector>

#include "contact/geometry/bvh_tree.hpp"
#include "core/types.hpp"

namespace talus {

struct Polyhedron {
  std::vector<Vec3> vertices;      // V
  std::vector<int> face_offset;    // F + 1, into face_vertices
  std::vector<int> face_vertices;  // vertex ids of all faces, outer loop only (faces with holes are split)
  std::vector<std::array<int, 3>> triangles;  // T, triangulation of the faces, outward
  std::vector<int> triangle_face;             // T, the face each triangle belongs to
  struct Edge {
    int v0, v1;       // ordered as in face_left's loop
    int left, right;  // the two faces
    double sine;      // > 0 convex edge, < 0 reentrant, sin of the angle between the outward normals
    bool on_at_v0 = false, on_at_v1 = false;  // there a convex edge goes on beyond its end (edge_ends.hpp)
    bool operator==(const Edge&) const = default;
  };
  std::vector<Edge> edges;          // E, only true edges (no edge between coplanar faces)
  std::vector<Vec3> face_normals;   // F, outward unit, body axes
  std::vector<int> face_joint_set;  // F, index of the joint set that made it, -1 otherwise; may be empty
  // Derived by make_polyhedron for the contact search.
  std::vector<int>
      face_edges;  // parallel to face_vertices: the true edge from this vertex to the next, or -1
  std::vector<int> vertex_edge_offset;             // V + 1, into vertex_edges
  std::vector<int> vertex_edges;                   // true edges at each vertex
  std::vector<std::array<int, 3>> triangle_edges;  // T, the true edge along each side, or -1
  /// Boxes about the triangles in body axes. Derived from them, so that it is equal where they are.
  struct TriangleTree : contact::BoxTree {
    bool operator==(const TriangleTree&) const { return true; }
  } tree;
  std::vector<int> axis_faces;     // one face per distinct normal direction (opposite faces share one entry)
  std::vector<int> axis_opposite;  // the opposite parallel face of that entry, -1 if none
  std::vector<int> axis_edges;     // one edge per distinct edge direction
  bool convex = false;
  double radius = 0;    // largest |X|                       [m]
  double inradius = 0;  // smallest distance centroid-face, of a concave one at least volume over surface (a
                        // plate's half thickness) [m]
  int faces() const { return static_cast<int>(face_offset.size()) - 1; }
  bool operator==(const Polyhedron&) const = default;
};

/// The pose of a polyhedron: what the contact search sees of a block.
struct Pose {
  Vec3 c = Vec3::Zero();      // centroid [m]
  Mat3 F = Mat3::Identity();  // R (I + eps)
  Vec3 world(const Vec3& X) const { return c + F * X; }
};

/// Builds faces, edges, normals and flags from a closed triangulation; merges coplanar neighbours (angle
/// below `coplanar_sine`, or opposite vertices in plane to round-off). Does not move vertices; drops those
/// that no triangle uses. Throws InputError naming the edge if the surface is open, badly oriented (also:
/// inside out) or self-touching (an edge used by other than two triangles).
Polyhedron make_polyhedron(std::vector<Vec3> vertices, const std::vector<std::array<int, 3>>& triangles,
                           double coplanar_sine = 1e-9);

}  // namespace talus

/// What a SurfaceIndex keeps. Internal to src/contact.
#pragma once
#include <vector>

#include "contact/bvh_tree.hpp"
#include "contact/detect.hpp"

namespace talus::contact {

struct SurfaceIndex::Impl {
  TriangleSurface surface;
  BoxTree tree;
  std::vector<Vec3> normal;            // T, outward unit; zero for a triangle without area
  std::vector<int> twin;               // 3 T, opposite half-edge, -1 on the rim
  std::vector<int> vertex_offset;      // V + 1, into vertex_triangle
  std::vector<int> vertex_triangle;    // triangles at each vertex
  std::vector<int> group;              // T, key of the face: first triangle of the coplanar patch; quadrilateral or triangle once moved

  Box3 triangle_box(int t) const {
    const auto& v = surface.triangles[t];
    const Vec3 &a = surface.vertices[v[0]], &b = surface.vertices[v[1]], &c = surface.vertices[v[2]];
    return Box3(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
  }
  void adopt(const TriangleSurface& from);   // throws InputError for vertex numbers out of range
  void compute_normals();
  void connect();
  void group_coplanar();
};

}  // namespace talus::contact

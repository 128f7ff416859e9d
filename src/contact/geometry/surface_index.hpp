/// What a SurfaceIndex keeps. Internal to src/contact.
#pragma once
#include <memory>
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/geometry/bvh_tree.hpp"

namespace talus::contact {

struct SurfaceIndex::Impl {
  TriangleSurface surface;
  BoxTree tree;
  std::vector<Vec3> normal;          // T, outward unit; zero for a triangle without area
  std::vector<int> twin;             // 3 T, opposite half-edge, -1 on the rim
  std::vector<int> vertex_offset;    // V + 1, into vertex_triangle
  std::vector<int> vertex_triangle;  // triangles at each vertex
  std::vector<int> group;  // T, key of the face: first triangle of the coplanar patch; quadrilateral or
                           // triangle once moved

  bool fans() const {
    return !surface.nodes.empty() && surface.triangles.size() % 4 == 0;
  }  // a skin's triangles: each face's four follow each other
  Box3 triangle_box(int t) const {
    const auto& v = surface.triangles[t];
    const Vec3 &a = surface.vertices[v[0]], &b = surface.vertices[v[1]], &c = surface.vertices[v[2]];
    return Box3(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
  }
  void adopt(const TriangleSurface& from);  // throws InputError for vertex numbers out of range
  void group_faces();
  void compute_normals();
  void compute_normal(int t);
  void connect();
  void group_coplanar();

  // surface_focus.cpp: only some triangles are kept up to date
  struct Focus {
    std::vector<Box3> boxes;
    std::vector<int> triangles, vertices;  // ascending
    BoxTree all;                           // the tree of all triangles, as it was
    bool chosen = false;                   // what lies in the boxes now
    bool new_topology = false;  // since the tree of all was built: twins and triangles at vertices are only
                                // those of `triangles`
  };
  std::unique_ptr<Focus> focus;  // null: all are
  void choose();
  void follow(const TriangleSurface& from);
  void connect(const std::vector<int>& triangles);
};

}  // namespace talus::contact

/// A block beside the skin of a structure: where its corners are, and which triangles of the skin are near
/// enough to matter. Internal to src/contact.
///
/// symbol     meaning                                                         unit   shape
/// corner     corners of the block in the world                               m      vertices
/// normal     outward, of the block's faces                                   1      faces
/// triangles  of the skin, near the block, ascending                          -      near
#pragma once
#include <span>
#include <vector>

#include "contact/geometry/surface_index.hpp"

namespace talus::contact {

class SkinNear {
 public:
  /// `reach`: gap up to which contacts are listed [m].
  SkinNear(const SurfaceIndex& surface, const Polyhedron& body, const Pose& pose, double reach);

  /// Triangles of one face of the block.
  std::span<const std::size_t> triangles_of(int face) const;
  double face_area(int face) const;
  /// Inward distance of x from one side of a triangle of the block's face, seen along it [m].
  double inside(std::size_t triangle, const Vec3& x, int side) const;
  /// True if a face of the block lies over x, seen along it.
  bool covers(int face, const Vec3& x) const;

  /// Of triangle t of the skin: coordinates of x over it, the point of it below x, one length [m].
  Vec3 barycentric(int t, const Vec3& x) const;
  Vec3 on_triangle(int t, const Vec3& x) const;
  double gap(int t, const Vec3& x) const;       ///< from its plane, outward [m]
  double distance(int t, const Vec3& x) const;  ///< from the nearest of its points [m]
  /// Whether x lies before the nearest of the triangles rather than behind it; where several have the nearest
  /// point in common, the one from whose plane x is farthest decides: along an edge the outside lies before
  /// both faces, or the inside behind both.
  bool outside(const Vec3& x) const;
  double size(int t) const;

  const SurfaceIndex::Impl& skin;
  const SurfaceIndex& index;
  const Polyhedron& block;
  double margin;
  double deepest;  // overlap that is still read as contact: a convex block less than its height, so that it
                   // is never one through a plate [m]
  std::vector<Vec3> corner, normal;
  std::vector<int> triangles;
  std::vector<Vec3> triangle_normal;

 private:
  void order_triangles();

  std::vector<Vec3> into_;  // per side of a triangle of the block, in its plane, inward
  std::vector<std::size_t> first_,
      by_face_;  // faces + 1; triangles of the block, those of a face beside each other
};

}  // namespace talus::contact

/// Distances from the triangles of a patch. Internal to src/contact.
#pragma once
#include <vector>

#include "contact/narrow/narrow_patch.hpp"

namespace talus::contact::narrow {

/// Where x projects on a triangle: -1 outside, 0 inside, 1 within `touch` of a convex side, or at a corner in
/// which a convex edge ends.
int inside(const Patch::Triangle& t, const Vec3& x, double touch);

Vec3 closest_on_triangle(const Patch::Triangle& t, const Vec3& x, bool& interior);

/// Nearest point of a surface to x, and the sum of the normals of the triangles that share it.
struct Nearest {
  double distance = infinity;
  Vec3 foot, pseudo = Vec3::Zero();

  void visit(const Patch::Triangle& t, const Vec3& x, double touch);
};

/// About a triangle: its centroid and how far it reaches from there.
struct Ball {
  Vec3 centre;
  double radius;
};

/// The triangles of a patch with balls about them, and about each eight that follow each other, which lie
/// beside each other for the most part. The patch stays as it is.
class NearTriangles {
 public:
  void set(const Patch& patch);
  const Patch& patch() const { return *patch_; }
  const std::vector<Ball>& balls() const { return balls_; }
  /// Distance of x from the surface if x lies before it beyond doubt, else 0.
  double ahead(const Vec3& x, double touch) const;

 private:
  struct Bunch {
    Ball ball;
    std::size_t first, last;
  };
  const Patch* patch_ = nullptr;
  std::vector<Ball> balls_;
  std::vector<Bunch> bunches_;
};

}  // namespace talus::contact::narrow

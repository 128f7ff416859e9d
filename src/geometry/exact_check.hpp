/// Independent check of a state: do interiors intersect? Shares no code with the contact search, so that it
/// can judge it.
///
///   overlap along n:    o(n) = max_A n . x - min_B n . x
///   depth of a pair:    d = min_n o(n) / |n|    over face normals and edge x edge of two convex bodies
///
/// symbol  meaning                                                           unit
/// o(n)    overlap of the projections on n, B lying ahead of A               m |n|
/// d       least translation that separates the bodies; <= 0: apart          m
///
/// Any direction n with o(n) <= tol |n| proves that the bodies are apart up to tol, however n was found. That
/// inequality is decided by floating point with a bound on its error, and by rational arithmetic (CGAL) where
/// the bound does not decide. So "apart" is a proof for the world vertices as rounded to double.
///
/// Concave bodies are divided into convex pieces along their own faces; the deepest pair of pieces counts,
/// and every vertex's depth under the other body's surface. For them d is a lower bound of the depth: what is
/// reported does intersect.
#pragma once
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "contact/geometry/surface.hpp"
#include "core/types.hpp"

namespace talus::geometry {

struct Overlap {
  bool intersect = false;         // deeper than the tolerance
  double depth = 0;               // [m]; negative: a lower bound of the gap
  Vec3 direction = Vec3::Zero();  // unit: moving the second body by depth along it separates them
};

/// Convex pieces of a polyhedron in its body axes, made once and used for many poses.
class CheckedBody {
 public:
  explicit CheckedBody(const Polyhedron& body);
  struct Piece {
    std::vector<Vec3> vertices;
    std::vector<std::array<int, 3>> faces;  // three corners of each face, outward
    std::vector<std::array<int, 2>> edges;
  };
  const std::vector<Piece>& pieces() const { return pieces_; }
  const Polyhedron& body() const { return body_; }

 private:
  Polyhedron body_;
  std::vector<Piece> pieces_;
};

/// `tolerance` in metres: penetration up to it is not reported as intersection.
Overlap deepest_intersection(const CheckedBody& a, const Pose& pose_a, const CheckedBody& b,
                             const Pose& pose_b, double tolerance);
Overlap deepest_intersection(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b,
                             double tolerance);

/// Terrain or a surface, indexed for checks of many bodies.
class CheckedSurface {
 public:
  explicit CheckedSurface(const TriangleSurface& surface);
  ~CheckedSurface();
  CheckedSurface(CheckedSurface&&) noexcept;
  CheckedSurface& operator=(CheckedSurface&&) noexcept;

  /// The deepest crossing of a triangle with the body. A body wholly on the solid side (see `solid_at`) has
  /// its whole height as depth.
  Overlap crossing(const CheckedBody& body, const Pose& pose, double tolerance) const;
  /// True if the point lies on the solid side: an odd number of triangles straight above it. Never for
  /// sheets.
  bool solid_at(const Vec3& point) const;
  /// True if some triangle lies straight above or below.
  bool covers(double x, double y) const;
  int triangles() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Depth of the lowest point of the body below a plane [m]; negative: above it.
double depth_below_plane(const Polyhedron& body, const Pose& pose, const Plane& plane);

/// All intersections of a state.
struct Finding {
  enum class With { body, surface, plane };
  With with = With::body;
  int a = 0, b = 0;  // body a; body, surface or plane b
  double depth = 0;  // [m]
};
std::vector<Finding> find_intersections(const std::vector<const CheckedBody*>& bodies,
                                        const std::vector<Pose>& poses,
                                        const std::vector<const CheckedSurface*>& surfaces,
                                        const std::vector<Plane>& planes, double tolerance);

}  // namespace talus::geometry

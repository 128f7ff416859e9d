/// Contact search: which points of which bodies are close, with normal, gap and tributary area.
///
/// gap > 0 is open; the normal points out of the first body (A) towards the second (B). `point_a` and `point_b` are the
/// two nearest material points at the search pose, gap = n . (point_b - point_a).
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "contact/polyhedron.hpp"
#include "contact/surface.hpp"

namespace talus::contact {

/// Features in contact, the same value while the same pair of features touches: key of warm starts, slip history.
using FeatureKey = std::uint64_t;

struct ContactPoint {
  Vec3 point_a;   // on body A, world [m]
  Vec3 point_b;   // on body B, world [m]
  Vec3 normal;    // unit, out of A
  double gap;     // [m]
  double area;    // tributary area [m^2]; 0 for isolated vertex or edge contacts
  FeatureKey key;
  int face_a = -1;   // polygon or triangle of A, -1 if an edge or vertex
  int face_b = -1;
};

/// Contacts of block A against block B with gap <= margin, appended to `out`; returns the number added.
/// Convex pairs: separating axis of least penetration; face-face clipped to a polygon of at most eight points whose areas
/// sum to the clipped area; crossing edges one point. Concave polyhedra: local features filtered by normal cones, exact, no
/// convex decomposition.
int block_block(const Polyhedron& A, const Pose& pose_a, const Polyhedron& B, const Pose& pose_b, double margin,
                std::vector<ContactPoint>& out);

/// Block B against an unbounded plane (body A is the plane, the normal is the plane's).
int plane_block(const Plane& plane, const Polyhedron& B, const Pose& pose_b, double margin, std::vector<ContactPoint>& out);

/// Search structure over a triangulated surface: BVH, coplanar neighbours merged so that no internal edge is ever hit,
/// convex edges and vertices known. Fixed topology; `refit` after the vertices moved.
class SurfaceIndex {
 public:
  explicit SurfaceIndex(const TriangleSurface& surface);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;
  void refit(const TriangleSurface& surface);
  const TriangleSurface& surface() const;
  Box3 bounds() const;
  /// True if any triangle's box overlaps `box`.
  bool overlaps(const Box3& box) const;
  /// Height of the surface's uppermost point above (x, y); NaN outside. For terrain.
  double height(double x, double y) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Block B against a surface (body A is the surface). `face_a` is the triangle. Contact point_a lies on that triangle.
int surface_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out);

/// Rigid or affine motion of a pose over a step: pose(s) for s in [0, 1], chord-linear in c and exact in rotation for a
/// constant rotation vector.
struct Motion {
  Pose start;
  Vec3 displacement = Vec3::Zero();      // of the centroid over the step [m]
  Vec3 half_gravity_step = Vec3::Zero(); // c(s) = c + s d + (s^2 - s) q: the parabola's bulge, g h^2 / 2 [m]
  Vec3 rotation = Vec3::Zero();          // rotation vector over the step, world axes [rad]
  Pose at(double s) const;
};

/// First s in [0, 1] at which the gap falls to `tolerance` while approaching, by conservative advancement on the true
/// motion (rotation included); 1 + something if never. Bodies that start within tolerance are skipped only while separating.
double time_of_impact(const Polyhedron& A, const Motion& motion_a, const Polyhedron& B, const Motion& motion_b, double tolerance);
double time_of_impact(const Plane& plane, const Polyhedron& B, const Motion& motion_b, double tolerance);
double time_of_impact(const SurfaceIndex& index, const Polyhedron& B, const Motion& motion_b, double tolerance);

/// Broad phase: all overlapping pairs (i < j) of boxes, sorted lexicographically. Deterministic.
void overlapping_pairs(std::span<const Box3> boxes, std::vector<std::pair<int, int>>& pairs);

/// World box of a posed polyhedron, grown by margin.
Box3 bounds(const Polyhedron& p, const Pose& pose, double margin = 0);
/// World box swept by a motion, grown by margin.
Box3 swept_bounds(const Polyhedron& p, const Motion& motion, double margin = 0);

}  // namespace talus::contact

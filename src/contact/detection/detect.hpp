/// Contact search: which points of which bodies are close, with normal, gap and tributary area.
///
/// gap > 0 is open; the normal points out of the first body (A) towards the second (B). `point_a` and
/// `point_b` are the two nearest material points at the search pose, gap = n . (point_b - point_a).
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "contact/geometry/surface.hpp"

namespace talus::contact {

/// Features in contact, the same value while the same pair of features touches: key of warm starts, slip
/// history.
using FeatureKey = std::uint64_t;

/// What kind of features meet; the top four bits of a FeatureKey.
enum class Form : std::uint64_t {
  vertex_face = 1,
  face_vertex,
  edge_edge,
  vertex_vertex,
  vertex_edge,
  edge_vertex,
  skin_face,      // a face of a structure's boundary surface and a vertex, by area
  skin_corner,    // a block's corner at such a surface
  elastic_bed,    // parts of a face of an elastic foundation,
  crushing_bed,   // of a crushable layer,
  crater,         // and what is crushed of it
  surface_point,  // geometry/corner_cell.hpp
  handed_over = 15
};

/// The first of all keys of that form.
constexpr FeatureKey first_key(Form form) { return static_cast<FeatureKey>(form) << 60; }
inline FeatureKey make_key(Form form, int a, int b) {
  return first_key(form) | ((static_cast<FeatureKey>(a) & 0x3fffffffu) << 30) |
         (static_cast<FeatureKey>(b) & 0x3fffffffu);
}
constexpr Form form_of(FeatureKey key) { return static_cast<Form>(key >> 60); }
/// The a and b that a key was made of.
inline std::pair<int, int> features_of(FeatureKey key) {
  return {static_cast<int>((key >> 30) & 0x3fffffffu), static_cast<int>(key & 0x3fffffffu)};
}

struct ContactPoint {
  Vec3 point_a;  // on body A, world [m]
  Vec3 point_b;  // on body B, world [m]
  Vec3 normal;   // unit, out of A
  double gap;    // [m]
  double area;   // tributary area [m^2]; 0 for isolated vertex or edge contacts
  FeatureKey key;
  int face_a = -1;  // polygon or triangle of A, -1 if an edge or vertex
  int face_b = -1;
};

/// The corner of A or of B that touches a face, an edge or a corner of the other, by the contact's key; -1:
/// none.
struct PressedCorner {
  int of_a = -1, of_b = -1;
};
PressedCorner pressed_corner(FeatureKey key);

/// Contacts of block A against block B with gap <= margin, appended to `out`; returns the number added.
/// Convex pairs: separating axis of least penetration; face-face clipped to a polygon of at most eight points
/// whose areas sum to the clipped area; crossing edges one point, and with it the clipped area where they
/// belong to faces within 5 degrees of parallel. Concave polyhedra: local features filtered by normal cones,
/// exact, no convex decomposition.
///
/// Separated diagonally (vertex-vertex, vertex-edge, edge-edge): the gap is the true distance, the normal its
/// direction, nearly parallel edges give the two ends of their overlap. Touching within 1e-9 of the smaller
/// radius: the normal of the face axis whose clipped area is largest, faces of A before faces of B before
/// edges, lower index first; no memory of earlier calls. Faces within 1.15 degrees of parallel press on their
/// area, other contacts have area 0. A pair of boxes that share no more than an edge or a vertex has
/// zero-area contacts with a face normal.
int block_block(const Polyhedron& A, const Pose& pose_a, const Polyhedron& B, const Pose& pose_b,
                double margin, std::vector<ContactPoint>& out);

/// Block B against an unbounded plane (body A is the plane, the normal is the plane's).
int plane_block(const Plane& plane, const Polyhedron& B, const Pose& pose_b, double margin,
                std::vector<ContactPoint>& out);

/// Search structure over a triangulated surface: BVH, coplanar neighbours merged so that no internal edge is
/// ever hit, convex edges and vertices known. Fixed topology; `refit` after the vertices moved.
class SurfaceIndex {
 public:
  explicit SurfaceIndex(const TriangleSurface& surface);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;
  /// Follows a surface that moved, and one of another topology (its revision grew).
  void refit(const TriangleSurface& surface);
  /// From now on refit() follows only what lies within the boxes and two rings of faces around it, and
  /// nothing else is found: for a skin of which little is near any block.
  void focus(const TriangleSurface& surface, std::vector<Box3> boxes);
  /// All of the surface again, as it is now.
  void unfocus(const TriangleSurface& surface);
  const TriangleSurface& surface() const;
  /// Of all triangles; while focused, as they were before.
  Box3 bounds() const;
  /// True if any triangle's box overlaps `box`.
  bool overlaps(const Box3& box) const;
  /// Height of the surface's uppermost point above (x, y); NaN outside. For terrain.
  double height(double x, double y) const;
  /// The triangle nearest to a point on (or next to) the surface; of several the one that faces most along
  /// `n`, then the one that lies `inwards` of the point, then the lowest index.
  int triangle_at(const Vec3& x, const Vec3& n = Vec3::Zero(), const Vec3& inwards = Vec3::Zero()) const;
  /// True if x, on this triangle, lies on the border to another material.
  bool between_materials(int triangle, const Vec3& x) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Block B against a surface (body A is the surface). `face_a` is the triangle. Contact point_a lies on that
/// triangle.
int surface_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out);

/// Rigid or affine motion of a pose over a step: pose(s) for s in [0, 1], chord-linear in c and exact in
/// rotation for a constant rotation vector.
struct Motion {
  Pose start;
  Vec3 displacement = Vec3::Zero();       // of the centroid over the step [m]
  Vec3 half_gravity_step = Vec3::Zero();  // c(s) = c + s d + (s^2 - s) q: the parabola's bulge, g h^2 / 2 [m]
  Vec3 rotation = Vec3::Zero();           // rotation vector over the step, world axes [rad]
  Pose at(double s) const;
};

/// First s in [0, 1] at which the gap falls to `tolerance`, by conservative advancement on the true motion
/// (rotation and parabola included); 2 if never. No crossing is ever stepped over, whatever the speed, spin
/// or thickness.
///
/// The rule, with g(s) the signed gap (distance, or minus the least overlap) and g_0 = g(0):
///   g_0 >  tolerance   the first s with g(s) <= tolerance; the gap found lies in [0.9, 1] tolerance
///   g_0 <= tolerance   the pair is in contact already, and contact is not an event:
///                      the first s at which it is pressed
///                      deeper, g(s) <= min(0, g_0) - 10 tolerance (found within 0.1 tolerance below).
///                      Separating, resting, sliding and rolling pairs therefore give 2.
/// For a surface and for concave bodies g is taken over all triangles (pieces). In contact, a triangle not
/// touched at the start counts as g_0 = 0, or as deep as the block is pressed into triangles within 45
/// degrees of it (a compliant block slides onto the next triangle at the depth it has); so a wall met while
/// sliding is found ten tolerances late. Note that Motion's centroid follows the chord: a pivoting block dips
/// below its pivot by about r |rotation|^2 / 8 between the ends of the step, and that is reported like any
/// other overlap.
double time_of_impact(const Polyhedron& A, const Motion& motion_a, const Polyhedron& B,
                      const Motion& motion_b, double tolerance);
double time_of_impact(const Plane& plane, const Polyhedron& B, const Motion& motion_b, double tolerance);
double time_of_impact(const SurfaceIndex& index, const Polyhedron& B, const Motion& motion_b,
                      double tolerance);

/// Broad phase: all overlapping pairs (i < j) of boxes, sorted lexicographically. Deterministic.
void overlapping_pairs(std::span<const Box3> boxes, std::vector<std::pair<int, int>>& pairs);

/// World box of a posed polyhedron, grown by margin.
Box3 bounds(const Polyhedron& p, const Pose& pose, double margin = 0);
/// World box swept by a motion, grown by margin.
Box3 swept_bounds(const Polyhedron& p, const Motion& motion, double margin = 0);

}  // namespace talus::contact

/// Contact points of two convex polyhedra along an axis: faces clipped against each other, crossed edges,
/// closest features. Internal to src/contact.
#pragma once
#include "contact/narrow/narrow_axes.hpp"
#include "contact/narrow/narrow_gjk.hpp"

namespace talus::contact::narrow {

/// Memory that one pair after the other uses.
struct ManifoldScratch {
  std::vector<ClipVertex> polygon, clipped;
  std::vector<double> weight, gaps;
  std::vector<ContactPoint> best_points;
};

struct HullPair {
  ManifoldScratch& s;
  const Hull &A, &B;
  double margin;
  double touch;  // below this two things touch [m]
};

/// Contacts on face f of R along its normal; true if a point realises `least_gap`, the gap of this axis. The
/// points go to `points`, relative to the local origin. `area` receives the clipped area.
bool face_manifold(const HullPair& pair, bool reference_is_a, int f, std::vector<ContactPoint>& points,
                   double& area);

/// Among the face axes that tie with the best one, the manifold of largest area (first A's faces, then B's).
/// True if it holds a point at the gap of its axis.
bool tied_faces(const HullPair& pair, double gap, std::vector<ContactPoint>& points);

/// Crossing edges of faces close to parallel: the crossing as it is, and the rest of the clipped area, which
/// is about to touch.
bool nearly_flat(const HullPair& pair, const Axis& of_a, const Axis& of_b, const EdgeAxis& edge,
                 std::vector<ContactPoint>& points);

/// True if the edges of the axis cross within what the axis leaves apart.
bool crossing(const HullPair& pair, const EdgeAxis& axis);
void emit_edges(const HullPair& pair, const EdgeAxis& axis, std::vector<ContactPoint>& points);

/// Separated, nothing flat about it: the closest points, or the two ends of the overlap of parallel edges.
void emit_closest(const HullPair& pair, const Separation& sep, std::vector<ContactPoint>& points);

}  // namespace talus::contact::narrow

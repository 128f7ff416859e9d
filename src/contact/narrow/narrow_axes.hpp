/// Separating axes of two convex polyhedra: face normals and cross products of edges. Internal to
/// src/contact.
///
///   gap(n) = min n . x_B - max n . x_A,   largest over the axes: the distance where it is positive,
///                                         less the least overlap where not
#pragma once
#include <limits>

#include "contact/narrow/narrow_math.hpp"

namespace talus::contact::narrow {

struct Axis {
  double gap = -std::numeric_limits<double>::infinity();
  int face = -1;
};

struct EdgeAxis {
  double gap = -std::numeric_limits<double>::infinity();
  Vec3 normal;  // out of A
  int edge_a = -1, edge_b = -1;
};

inline Vec3 edge_vector(const Hull& h, int e) {
  return h.vertex(h.p->edges[e].v1) - h.vertex(h.p->edges[e].v0);
}

/// The best face axis of R against Q; writes the gap of every face into R. Stops at the first gap above
/// `stop`.
Axis best_face(Hull& R, const Hull& Q, double stop, double touch);

/// Edge-edge axes by distinct directions (small polyhedra).
EdgeAxis best_edges_small(const Hull& A, const Hull& B, double stop);

/// Edge-edge axes of large hulls: only edges in the overlap of the boxes, only pairs that form a face of B -
/// A (arcs that cross on the Gauss map).
EdgeAxis best_edges_large(const Hull& A, const Hull& B, double grow);

/// The best of all face and edge axes: largest gap (negative: least overlap).
struct SignedAxis {
  double gap;
  Vec3 normal;  // out of A
};
SignedAxis signed_axis(Hull& a, Hull& b);

}  // namespace talus::contact::narrow

/// Contacts by pairs of local features, see narrow_local.hpp. Internal to src/contact.
#pragma once
#include <limits>

#include "contact/narrow/narrow_patch.hpp"

namespace talus::contact::narrow {

constexpr double crossed_overlap = 0.1;  // overlap of crossed edges, and of a vertex beside a nearer face,
                                         // that is still looked for, over the deepest of all

/// The whole of a closed body, of which a patch is the part near another.
struct Whole {
  const Polyhedron& p;
  Vec3 centre;
  Mat3 F;
  bool holds(const Vec3& x) const;  // x is inside
};

/// Two bodies that may touch.
struct Search {
  const Patch &A, &B;
  double margin, touch;
  double depth;  // deepest overlap that is still read as contact [m]
  const Whole *whole_a = nullptr,
              *whole_b = nullptr;  // of closed bodies, so that inside and outside can be told
  const Common* common = nullptr;  // of closed bodies: what can touch, or lies in the other, lies in it
  const SurfaceIndex::Impl* surface = nullptr;  // of which A is a part, about `origin`
  Vec3 origin = Vec3::Zero();
  bool closed() const { return whole_a != nullptr; }
  /// True if it can be told of any place whether it lies in A, and in B: of closed bodies and ground, not of
  /// a skin that bends.
  bool told() const { return closed() || (surface != nullptr && surface->surface.nodes.empty()); }
};

/// Least height along n that an edge of the vertex reaches, per length: negative where it falls.
inline double falling(const Patch& p, const Patch::Vertex& v, const Vec3& n) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = v.first; i < v.first + v.count; ++i) least = std::min(least, n.dot(p.directions[i]));
  return least;
}

/// The contact of a vertex at x with `foot` on the other body, of which `first` tells whether it is A; n from
/// it to the vertex. Its key is still to be set.
inline ContactPoint vertex_contact(bool first, const Vec3& foot, const Vec3& x, const Vec3& n, double gap) {
  ContactPoint c;
  c.point_a = first ? foot : x;
  c.point_b = first ? x : foot;
  c.normal = first ? n : Vec3(-n);
  c.gap = gap;
  c.area = 0;
  return c;
}

/// True if x is inside body A (`first`) or B, more than so deep.
bool inside_by(const Search& s, bool first, const Vec3& x, double depth);

/// True if x is inside body A (`first`) or B, or on its surface. Of a skin that bends it is not known.
bool in_body(const Search& s, bool first, const Vec3& x);

/// Vertices of V against triangles of T. `first` tells whether the triangles belong to body A.
void vertex_face(const Search& s, const Patch& T, const Patch& V, bool first, std::vector<ContactPoint>& out);

void edge_edge(const Search& s, std::vector<ContactPoint>& out);

/// Vertices of V near convex edges of E, separated. `first`: the edges belong to body A.
void vertex_edge(const Search& s, const Patch& E, const Patch& V, bool first, std::vector<ContactPoint>& out);

void vertex_vertex(const Search& s, std::vector<ContactPoint>& out);

/// Face-face areas: for each face of B, the overlap with all near-parallel triangles of A within the margin.
void press_areas(const Search& s, const Polyhedron& b, std::vector<ContactPoint>& points);

}  // namespace talus::contact::narrow

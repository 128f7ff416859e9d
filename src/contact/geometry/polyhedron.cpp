#include "contact/geometry/polyhedron.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "contact/geometry/edge_ends.hpp"
#include "contact/tolerances.hpp"
#include "core/reject.hpp"

namespace talus {
namespace {

using Triangle = std::array<int, 3>;

/// Half-edges of a triangulation, opposite pairs found by sorting. Half-edge 3 t + k runs from corner k to k
/// + 1.
struct HalfEdges {
  std::vector<int> twin;
  static int next(int h) { return h - h % 3 + (h + 1) % 3; }
};

HalfEdges pair_half_edges(const std::vector<Triangle>& triangles) {
  struct Entry {
    int lo, hi, h;
    bool forward;
  };
  std::vector<Entry> list;
  list.reserve(3 * triangles.size());
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      list.push_back({std::min(a, b), std::max(a, b), 3 * t + k, a < b});
    }
  std::sort(list.begin(), list.end(), [](const Entry& l, const Entry& r) {
    return std::tie(l.lo, l.hi, l.h) < std::tie(r.lo, r.hi, r.h);
  });
  HalfEdges he;
  he.twin.assign(list.size(), -1);
  for (std::size_t i = 0; i < list.size();) {
    std::size_t j = i;
    while (j < list.size() && list[j].lo == list[i].lo && list[j].hi == list[i].hi) ++j;
    const std::string key = fmt::format("mesh edge {}-{}", list[i].lo, list[i].hi);
    if (j - i == 1)
      reject(key, "1 triangle",
             "every edge must be shared by exactly two triangles (the surface is open here)",
             "close the surface");
    if (j - i > 2)
      reject(key, fmt::format("{} triangles", j - i),
             "every edge must be shared by exactly two triangles (the surface touches itself here)",
             "separate the parts or merge duplicate triangles");
    if (list[i].forward == list[i + 1].forward)
      reject(key, "run through twice in the same direction",
             "neighbouring triangles must be oriented alike (counter-clockwise seen from outside)",
             "flip one of the triangles at this edge");
    he.twin[list[i].h] = list[i + 1].h;
    he.twin[list[i + 1].h] = list[i].h;
    i = j;
  }
  return he;
}

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// Ordered boundary loop of a set of triangles (half-edges whose twin lies outside the set), empty if it is
/// not one simple loop.
std::vector<int> simple_loop(const std::vector<int>& members, const std::vector<int>& region, int id,
                             const std::vector<Triangle>& triangles, const HalfEdges& he) {
  std::map<int, int> from;  // start vertex -> half-edge
  for (const int t : members)
    for (int k = 0; k < 3; ++k) {
      const int h = 3 * t + k;
      if (region[he.twin[h] / 3] == id) continue;
      if (!from.emplace(triangles[t][k], h).second) return {};
    }
  std::vector<int> loop;
  if (from.empty()) return {};
  int h = from.begin()->second;
  do {
    loop.push_back(h);
    const int end = triangles[h / 3][(h % 3 + 1) % 3];
    const auto it = from.find(end);
    if (it == from.end() || loop.size() > from.size()) return {};
    h = it->second;
  } while (h != loop.front());
  return loop.size() == from.size() ? loop : std::vector<int>{};
}

double distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {  // of the origin
  const Vec3 n = (b - a).cross(c - a);
  const double nn = n.squaredNorm();
  if (nn > 0 && n.dot((b - a).cross(-a)) >= 0 && n.dot((c - b).cross(-b)) >= 0 &&
      n.dot((a - c).cross(-c)) >= 0)
    return std::abs(n.dot(a)) / std::sqrt(nn);
  const auto segment = [](const Vec3& p, const Vec3& q) {
    const Vec3 d = q - p;
    const double dd = d.squaredNorm();
    const double t = dd > 0 ? std::clamp(-p.dot(d) / dd, 0.0, 1.0) : 0.0;
    return (p + t * d).norm();
  };
  return std::min({segment(a, b), segment(b, c), segment(c, a)});
}

/// Builds a polyhedron step by step; each step fills its part of the result.
class Builder {
 public:
  Builder(const std::vector<Vec3>& vertices, const std::vector<Triangle>& input, double coplanar_sine)
      : coplanar_sine_(coplanar_sine) {
    check_triangles(static_cast<int>(vertices.size()), input);
    he_ = pair_half_edges(input);  // errors name the caller's vertex numbers
    number_vertices(vertices, input);
    measure();
  }

  Builder(const Builder&) = delete;

  Polyhedron build() {
    merge_coplanar();
    make_faces();
    make_edges();
    make_vertex_edges();
    p_.convex = is_convex();
    if (!p_.convex) find_ends();
    p_.inradius = half_thickness();
    choose_axes();
    make_tree();
    return std::move(p_);
  }

 private:
  /// Smallest distance centroid-face; the centroid of a concave body may lie next to a face, or outside:
  /// there at least volume over surface.
  double half_thickness() const {
    double least = p_.radius, volume = 0, area = 0;
    for (const auto& t : T) {
      least = std::min(least, distance_to_triangle(X[t[0]], X[t[1]], X[t[2]]));
      const Vec3 twice = (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]);
      volume += X[t[0]].dot(twice) / 6;
      area += 0.5 * twice.norm();
    }
    return p_.convex ? least : std::max(least, volume / area);
  }

  static void check_triangles(int given, const std::vector<Triangle>& input) {
    if (input.size() < 4)
      reject("mesh", fmt::format("{} triangles", input.size()), "a polyhedron needs at least four triangles",
             "give a closed surface");
    for (int t = 0; t < static_cast<int>(input.size()); ++t) {
      for (const int v : input[t])
        if (v < 0 || v >= given)
          reject(fmt::format("mesh triangle {}", t), fmt::format("vertex {}", v),
                 fmt::format("vertex numbers must lie in 0..{}", given - 1), "correct the triangle");
      if (input[t][0] == input[t][1] || input[t][1] == input[t][2] || input[t][2] == input[t][0])
        reject(fmt::format("mesh triangle {}", t),
               fmt::format("{} {} {}", input[t][0], input[t][1], input[t][2]),
               "a triangle must have three different vertices", "remove the triangle");
    }
  }

  /// Vertices that no triangle uses are left out.
  void number_vertices(const std::vector<Vec3>& vertices, const std::vector<Triangle>& input) {
    std::vector<int> renumber(vertices.size(), -1);
    for (const auto& t : input)
      for (const int v : t) renumber[v] = 0;
    int used = 0;
    for (int v = 0; v < static_cast<int>(vertices.size()); ++v)
      if (renumber[v] == 0) {
        if (!vertices[v].allFinite())
          reject(fmt::format("mesh vertex {}", v), "not finite", "coordinates must be finite",
                 "correct the vertex");
        renumber[v] = used++;
        X.push_back(vertices[v]);
      }
    T = input;
    for (auto& t : T)
      for (int& v : t) v = renumber[v];
  }

  void measure() {
    Box3 box;
    for (const auto& x : X) {
      box.extend(x);
      p_.radius = std::max(p_.radius, x.norm());
    }
    size_ = box.diagonal().norm();
    const Vec3 middle = box.center();
    double volume = 0;
    area_.resize(T.size());
    for (std::size_t t = 0; t < T.size(); ++t) {
      area_[t] = (X[T[t][1]] - X[T[t][0]]).cross(X[T[t][2]] - X[T[t][0]]);
      volume += area_[t].dot(X[T[t][0]] - middle) / 6;
    }
    if (volume < 0)
      reject("mesh", fmt::format("volume {:.3g} m^3", volume),
             "triangles must be counter-clockwise seen from outside", "reverse every triangle");
  }

  /// Corner at which the longest side of a triangle starts, and its length.
  std::pair<int, double> longest_side(int t) const {
    int best = 0;
    double length = -1;
    for (int k = 0; k < 3; ++k) {
      const double l = (X[T[t][(k + 1) % 3]] - X[T[t][k]]).squaredNorm();
      if (l > length) length = l, best = k;
    }
    return {best, std::sqrt(length)};
  }

  bool coplanar(int t, int corner, int other) const {
    const double round_off = 1e-13 * size_;
    const Vec3 n = area_[t].normalized(), m = area_[other].normalized();
    if (n.dot(m) <= 0) return false;
    const int h = 3 * t + corner;
    const int ha = HalfEdges::next(HalfEdges::next(h)), hb = HalfEdges::next(HalfEdges::next(he_.twin[h]));
    const Vec3 &e = X[T[t][corner]], &a = X[T[ha / 3][ha % 3]], &b = X[T[hb / 3][hb % 3]];
    return n.cross(m).norm() < coplanar_sine_ || std::abs(n.dot(b - e)) <= round_off ||
           std::abs(m.dot(a - e)) <= round_off;
  }

  /// Groups of coplanar neighbours, keyed by their first triangle. A sliver has no normal of its own: it
  /// joins the neighbour across its longest side.
  void merge_coplanar() {
    const double round_off = 1e-13 * size_;
    const int count = static_cast<int>(T.size());
    std::vector<int> parent(T.size());
    std::iota(parent.begin(), parent.end(), 0);
    for (int t = 0; t < count; ++t) {
      const auto [k, length] = longest_side(t);
      if (area_[t].norm() <= round_off * length)
        parent[find_root(parent, t)] = find_root(parent, he_.twin[3 * t + k] / 3);
      for (int c = 0; c < 3; ++c) {
        const int other = he_.twin[3 * t + c] / 3;
        if (other >= t && coplanar(t, c, other)) parent[find_root(parent, t)] = find_root(parent, other);
      }
    }
    std::map<int, int> first;
    group_.resize(T.size());
    for (int t = 0; t < count; ++t) {
      group_[t] = first.emplace(find_root(parent, t), t).first->second;
      members_[group_[t]].push_back(t);
    }
  }

  /// One polygon per group; a group with holes or pinched corners is grown into several simple discs.
  void make_faces() {
    auto& region = p_.triangle_face;
    region.assign(T.size(), -1);
    for (const auto& [id, triangles] : members_) {
      const int face = static_cast<int>(loops_.size());
      for (const int t : triangles) region[t] = face;
      auto loop = simple_loop(triangles, region, face, T, he_);
      if (!loop.empty()) {
        add_face(triangles, std::move(loop));
        continue;
      }
      for (const int t : triangles) region[t] = -1;
      for (const int seed : triangles)
        if (region[seed] < 0) grow_disc(seed);
    }
  }

  void add_face(const std::vector<int>& triangles, std::vector<int> loop) {
    Vec3 n = Vec3::Zero();
    for (const int t : triangles) n += area_[t];
    p_.face_normals.push_back(n.normalized());
    loops_.push_back(std::move(loop));
  }

  /// A simple disc of triangles of the seed's group that no face has yet. It stays one by a triangle at one
  /// of its sides whose third corner is new to it, and by one at two of its sides; one at three would close
  /// it.
  void grow_disc(int seed) {
    auto& region = p_.triangle_face;
    const int face = static_cast<int>(loops_.size());
    std::vector<int> grown{seed};
    std::set<int> corners(T[seed].begin(), T[seed].end());
    region[seed] = face;
    for (std::size_t i = 0; i < grown.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        const int t = he_.twin[3 * grown[i] + k] / 3;
        if (group_[t] != group_[seed] || region[t] >= 0) continue;
        int sides = 0, third = 0;
        for (int c = 0; c < 3; ++c)
          if (region[he_.twin[3 * t + c] / 3] == face) ++sides, third = T[t][(c + 2) % 3];
        if (sides == 3 || (sides == 1 && corners.contains(third))) continue;
        region[t] = face;
        grown.push_back(t);
        corners.insert(third);
      }
    add_face(grown, simple_loop(grown, region, face, T, he_));
  }

  /// Faces as loops of vertices and edges; edges between groups alone.
  void make_edges() {
    const auto& region = p_.triangle_face;
    std::vector<int> edge_of(he_.twin.size(), -1);  // half-edge 3 t + k
    p_.face_offset.push_back(0);
    for (int f = 0; f < static_cast<int>(loops_.size()); ++f) {
      for (const int h : loops_[f]) {
        p_.face_vertices.push_back(T[h / 3][h % 3]);
        const int twin = he_.twin[h];
        if (edge_of[h] < 0 && group_[twin / 3] != group_[h / 3]) {
          Polyhedron::Edge e{T[h / 3][h % 3], T[h / 3][(h % 3 + 1) % 3], f, region[twin / 3], 0};
          const Vec3 along = (X[e.v1] - X[e.v0]).normalized();
          e.sine = std::clamp(p_.face_normals[e.left].cross(p_.face_normals[e.right]).dot(along), -1.0, 1.0);
          edge_of[h] = edge_of[twin] = static_cast<int>(p_.edges.size());
          p_.edges.push_back(e);
        }
        p_.face_edges.push_back(edge_of[h]);
      }
      p_.face_offset.push_back(static_cast<int>(p_.face_vertices.size()));
    }
    for (std::size_t t = 0; t < T.size(); ++t)
      p_.triangle_edges.push_back({edge_of[3 * t], edge_of[3 * t + 1], edge_of[3 * t + 2]});
  }

  void make_tree() {
    p_.tree.build(static_cast<int>(T.size()), [&](int t) {
      Box3 box;
      for (const int v : T[t]) box.extend(X[v]);
      return box;
    });
  }

  void make_vertex_edges() {
    auto& offset = p_.vertex_edge_offset;
    offset.assign(X.size() + 1, 0);
    for (const auto& e : p_.edges) ++offset[e.v0 + 1], ++offset[e.v1 + 1];
    std::partial_sum(offset.begin(), offset.end(), offset.begin());
    p_.vertex_edges.resize(2 * p_.edges.size());
    std::vector<int> at(offset.begin(), offset.end() - 1);
    for (int e = 0; e < static_cast<int>(p_.edges.size()); ++e) {
      p_.vertex_edges[at[p_.edges[e].v0]++] = e;
      p_.vertex_edges[at[p_.edges[e].v1]++] = e;
    }
  }

  /// Affine motions keep what lies in a plane, on a line or inside: the body's edges go on for good.
  void find_ends() {
    std::vector<std::vector<contact::Sector>> around(X.size());
    for (std::size_t t = 0; t < T.size(); ++t)
      for (int k = 0; k < 3; ++k) {
        const Vec3& x = X[T[t][k]];
        around[T[t][k]].push_back({p_.face_normals[p_.triangle_face[t]],
                                   (X[T[t][(k + 1) % 3]] - x).normalized(),
                                   (X[T[t][(k + 2) % 3]] - x).normalized()});
      }
    for (Polyhedron::Edge& e : p_.edges) {
      if (e.sine <= 0) continue;
      const Vec3 d = (X[e.v1] - X[e.v0]).normalized(), &l = p_.face_normals[e.left],
                 &r = p_.face_normals[e.right];
      e.on_at_v0 = contact::goes_on(around[e.v0], d, l, r);
      e.on_at_v1 = contact::goes_on(around[e.v1], -d, l, r);
    }
  }

  /// Every vertex behind every face (several components and self-overlap fail here).
  bool is_convex() const {
    for (std::size_t f = 0; f < p_.face_normals.size(); ++f) {
      const double d = p_.face_normals[f].dot(X[p_.face_vertices[p_.face_offset[f]]]);
      for (const auto& x : X)
        if (p_.face_normals[f].dot(x) > d + contact::tolerances().flush * size_) return false;
    }
    return true;
  }

  /// Directions for separating axes: one of each pair of opposite faces, one of parallel edges; none where
  /// they are too many to pay.
  void choose_axes() {
    constexpr double same = 1e-10;
    constexpr std::size_t most_faces = 64, most_edges = 128;
    const int faces = static_cast<int>(loops_.size());
    if (loops_.size() <= most_faces) {
      std::vector<char> done(faces, 0);
      for (int f = 0; f < faces; ++f) {
        if (done[f]) continue;
        int opposite = -1;
        for (int g = f + 1; g < faces && opposite < 0; ++g)
          if (!done[g] && (p_.face_normals[f] + p_.face_normals[g]).norm() < same) opposite = g;
        if (opposite >= 0) done[opposite] = 1;
        p_.axis_faces.push_back(f);
        p_.axis_opposite.push_back(opposite);
      }
    }
    if (p_.edges.size() > most_edges) return;
    const auto direction = [&](int e) { return Vec3((X[p_.edges[e].v1] - X[p_.edges[e].v0]).normalized()); };
    for (int e = 0; e < static_cast<int>(p_.edges.size()); ++e) {
      const Vec3 d = direction(e);
      const bool known = std::any_of(p_.axis_edges.begin(), p_.axis_edges.end(),
                                     [&](int k) { return d.cross(direction(k)).norm() < same; });
      if (!known) p_.axis_edges.push_back(e);
    }
  }

  Polyhedron p_;
  std::vector<Vec3>& X = p_.vertices;
  std::vector<Triangle>& T = p_.triangles;
  double coplanar_sine_, size_ = 0;
  HalfEdges he_;
  std::vector<Vec3> area_;                   // twice the area vectors
  std::vector<int> group_;                   // of a triangle: the first triangle of its coplanar group
  std::map<int, std::vector<int>> members_;  // of a group; the order does not depend on unions
  std::vector<std::vector<int>> loops_;      // half-edges around each face
};

}  // namespace

Polyhedron make_polyhedron(std::vector<Vec3> vertices, const std::vector<Triangle>& input,
                           double coplanar_sine) {
  return Builder(vertices, input, coplanar_sine).build();
}

}  // namespace talus

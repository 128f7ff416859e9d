#include "contact/polyhedron.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.hpp"

namespace talus {
namespace {

using Triangle = std::array<int, 3>;

[[noreturn]] void bad(const std::string& key, const std::string& value, const std::string& rule,
                      const std::string& remedy) {
  Problem p;
  p.key = key;
  p.value = value;
  p.rule = rule;
  p.remedy = remedy;
  throw InputError(std::move(p));
}

/// Half-edges of a triangulation, opposite pairs found by sorting. Half-edge 3 t + k runs from corner k to k + 1.
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
      bad(key, "1 triangle", "every edge must be shared by exactly two triangles (the surface is open here)",
          "close the surface");
    if (j - i > 2)
      bad(key, fmt::format("{} triangles", j - i),
          "every edge must be shared by exactly two triangles (the surface touches itself here)",
          "separate the parts or merge duplicate triangles");
    if (list[i].forward == list[i + 1].forward)
      bad(key, "run through twice in the same direction",
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

/// Ordered boundary loop of a set of triangles (half-edges whose twin lies outside the set), empty if it is not one
/// simple loop.
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
  if (nn > 0 && n.dot((b - a).cross(-a)) >= 0 && n.dot((c - b).cross(-b)) >= 0 && n.dot((a - c).cross(-c)) >= 0)
    return std::abs(n.dot(a)) / std::sqrt(nn);
  const auto segment = [](const Vec3& p, const Vec3& q) {
    const Vec3 d = q - p;
    const double dd = d.squaredNorm();
    const double t = dd > 0 ? std::clamp(-p.dot(d) / dd, 0.0, 1.0) : 0.0;
    return (p + t * d).norm();
  };
  return std::min({segment(a, b), segment(b, c), segment(c, a)});
}

}  // namespace

Polyhedron make_polyhedron(std::vector<Vec3> vertices, const std::vector<Triangle>& input, double coplanar_sine) {
  Polyhedron p;
  const int given = static_cast<int>(vertices.size());
  if (input.size() < 4)
    bad("mesh", fmt::format("{} triangles", input.size()), "a polyhedron needs at least four triangles",
        "give a closed surface");
  std::vector<int> renumber(given, -1);
  for (int t = 0; t < static_cast<int>(input.size()); ++t) {
    for (const int v : input[t])
      if (v < 0 || v >= given)
        bad(fmt::format("mesh triangle {}", t), fmt::format("vertex {}", v),
            fmt::format("vertex numbers must lie in 0..{}", given - 1), "correct the triangle");
    if (input[t][0] == input[t][1] || input[t][1] == input[t][2] || input[t][2] == input[t][0])
      bad(fmt::format("mesh triangle {}", t), fmt::format("{} {} {}", input[t][0], input[t][1], input[t][2]),
          "a triangle must have three different vertices", "remove the triangle");
    for (const int v : input[t]) renumber[v] = 0;
  }
  const HalfEdges he = pair_half_edges(input);  // errors name the caller's vertex numbers
  int used = 0;
  for (int v = 0; v < given; ++v)
    if (renumber[v] == 0) {
      if (!vertices[v].allFinite())
        bad(fmt::format("mesh vertex {}", v), "not finite", "coordinates must be finite", "correct the vertex");
      renumber[v] = used++;
      p.vertices.push_back(vertices[v]);
    }
  p.triangles = input;
  for (auto& t : p.triangles)
    for (int& v : t) v = renumber[v];
  const auto& X = p.vertices;
  const auto& T = p.triangles;
  const int triangle_count = static_cast<int>(T.size());

  double volume = 0;
  Box3 box;
  for (const auto& x : X) {
    box.extend(x);
    p.radius = std::max(p.radius, x.norm());
  }
  const double size = box.diagonal().norm();
  const Vec3 middle = box.center();
  std::vector<Vec3> area(T.size());  // twice the area vector
  for (int t = 0; t < triangle_count; ++t) {
    area[t] = (X[T[t][1]] - X[T[t][0]]).cross(X[T[t][2]] - X[T[t][0]]);
    volume += area[t].dot(X[T[t][0]] - middle) / 6;
  }
  if (volume < 0)
    bad("mesh", fmt::format("volume {:.3g} m^3", volume), "triangles must be counter-clockwise seen from outside",
        "reverse every triangle");

  // Merge coplanar neighbours. A sliver has no normal of its own: it joins the neighbour across its longest side.
  const double round_off = 1e-13 * size;
  std::vector<int> parent(T.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto longest = [&](int t) {
    int best = 0;
    double length = -1;
    for (int k = 0; k < 3; ++k) {
      const double l = (X[T[t][(k + 1) % 3]] - X[T[t][k]]).squaredNorm();
      if (l > length) length = l, best = k;
    }
    return std::pair{best, std::sqrt(length)};
  };
  for (int t = 0; t < triangle_count; ++t) {
    const auto [k, length] = longest(t);
    if (area[t].norm() <= round_off * length) parent[find_root(parent, t)] = find_root(parent, he.twin[3 * t + k] / 3);
    for (int c = 0; c < 3; ++c) {
      const int other = he.twin[3 * t + c] / 3;
      if (other < t) continue;
      const Vec3 n = area[t].normalized(), m = area[other].normalized();
      if (n.dot(m) <= 0) continue;
      const int ha = HalfEdges::next(HalfEdges::next(3 * t + c)), hb = HalfEdges::next(HalfEdges::next(he.twin[3 * t + c]));
      const Vec3 &e = X[T[t][c]], &a = X[T[ha / 3][ha % 3]], &b = X[T[hb / 3][hb % 3]];
      const bool in_plane = std::abs(n.dot(b - e)) <= round_off || std::abs(m.dot(a - e)) <= round_off;
      if (n.cross(m).norm() < coplanar_sine || in_plane) parent[find_root(parent, t)] = find_root(parent, other);
    }
  }
  std::vector<int> group(T.size());
  std::map<int, std::vector<int>> members;  // keyed by the group's first triangle: order does not depend on unions
  {
    std::map<int, int> first;
    for (int t = 0; t < triangle_count; ++t) {
      const int root = find_root(parent, t);
      group[t] = first.emplace(root, t).first->second;
      members[group[t]].push_back(t);
    }
  }

  // One polygon per group; a group with holes or pinched corners is grown into several simple discs.
  std::vector<int> region(T.size(), -1);
  std::vector<std::vector<int>> loops;
  const auto add_face = [&](const std::vector<int>& tris, std::vector<int> loop) {
    Vec3 n = Vec3::Zero();
    for (const int t : tris) n += area[t];
    p.face_normals.push_back(n.normalized());
    loops.push_back(std::move(loop));
  };
  for (const auto& [id, tris] : members) {
    const int face = static_cast<int>(loops.size());
    for (const int t : tris) region[t] = face;
    auto loop = simple_loop(tris, region, face, T, he);
    if (!loop.empty()) {
      add_face(tris, std::move(loop));
      continue;
    }
    for (const int t : tris) region[t] = -1;
    for (const int seed : tris) {
      if (region[seed] >= 0) continue;
      const int part = static_cast<int>(loops.size());
      std::vector<int> grown{seed}, best_loop;
      region[seed] = part;
      best_loop = simple_loop(grown, region, part, T, he);
      for (std::size_t i = 0; i < grown.size(); ++i)
        for (int k = 0; k < 3; ++k) {
          const int t = he.twin[3 * grown[i] + k] / 3;
          if (group[t] != id || region[t] >= 0) continue;
          region[t] = part;
          grown.push_back(t);
          auto trial = simple_loop(grown, region, part, T, he);
          if (trial.empty()) {
            region[t] = -1;
            grown.pop_back();
          } else {
            best_loop = std::move(trial);
          }
        }
      add_face(grown, std::move(best_loop));
    }
  }
  p.triangle_face = region;
  const int face_count = static_cast<int>(loops.size());

  std::vector<int> edge_of(he.twin.size(), -1);
  p.face_offset.push_back(0);
  double worst_sine = 1;
  for (int f = 0; f < face_count; ++f) {
    for (const int h : loops[f]) {
      p.face_vertices.push_back(T[h / 3][h % 3]);
      const int twin = he.twin[h];
      if (edge_of[h] < 0 && group[twin / 3] != group[h / 3]) {
        Polyhedron::Edge e{T[h / 3][h % 3], T[h / 3][(h % 3 + 1) % 3], f, region[twin / 3], 0};
        const Vec3 along = (X[e.v1] - X[e.v0]).normalized();
        e.sine = std::clamp(p.face_normals[e.left].cross(p.face_normals[e.right]).dot(along), -1.0, 1.0);
        worst_sine = std::min(worst_sine, e.sine);
        edge_of[h] = edge_of[twin] = static_cast<int>(p.edges.size());
        p.edges.push_back(e);
      }
      p.face_edges.push_back(edge_of[h]);
    }
    p.face_offset.push_back(static_cast<int>(p.face_vertices.size()));
  }

  p.vertex_edge_offset.assign(X.size() + 1, 0);
  for (const auto& e : p.edges) ++p.vertex_edge_offset[e.v0 + 1], ++p.vertex_edge_offset[e.v1 + 1];
  std::partial_sum(p.vertex_edge_offset.begin(), p.vertex_edge_offset.end(), p.vertex_edge_offset.begin());
  p.vertex_edges.resize(2 * p.edges.size());
  {
    std::vector<int> at(p.vertex_edge_offset.begin(), p.vertex_edge_offset.end() - 1);
    for (int e = 0; e < static_cast<int>(p.edges.size()); ++e) {
      p.vertex_edges[at[p.edges[e].v0]++] = e;
      p.vertex_edges[at[p.edges[e].v1]++] = e;
    }
  }

  // Convex: no reentrant edge, and every vertex behind every face (several components or self-overlap fail here).
  p.convex = worst_sine > -1e-8;
  for (int f = 0; f < face_count && p.convex; ++f) {
    const double d = p.face_normals[f].dot(X[p.face_vertices[p.face_offset[f]]]);
    for (const auto& x : X)
      if (p.face_normals[f].dot(x) > d + 1e-8 * size) {
        p.convex = false;
        break;
      }
  }

  p.inradius = p.radius;
  for (const auto& t : T) p.inradius = std::min(p.inradius, distance_to_triangle(X[t[0]], X[t[1]], X[t[2]]));

  constexpr double same = 1e-10;
  if (face_count <= 64) {
    std::vector<char> done(face_count, 0);
    for (int f = 0; f < face_count; ++f) {
      if (done[f]) continue;
      int opposite = -1;
      for (int g = f + 1; g < face_count && opposite < 0; ++g)
        if (!done[g] && (p.face_normals[f] + p.face_normals[g]).norm() < same) opposite = g;
      if (opposite >= 0) done[opposite] = 1;
      p.axis_faces.push_back(f);
      p.axis_opposite.push_back(opposite);
    }
  }
  if (p.edges.size() <= 128) {
    for (int e = 0; e < static_cast<int>(p.edges.size()); ++e) {
      const Vec3 d = (X[p.edges[e].v1] - X[p.edges[e].v0]).normalized();
      const bool known = std::any_of(p.axis_edges.begin(), p.axis_edges.end(), [&](int k) {
        return d.cross((X[p.edges[k].v1] - X[p.edges[k].v0]).normalized()).norm() < same;
      });
      if (!known) p.axis_edges.push_back(e);
    }
  }
  return p;
}

}  // namespace talus

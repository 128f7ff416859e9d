#include "contact/narrow_patch.hpp"

#include <algorithm>
#include <array>

#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

bool boxes_meet(const Vec3& lo, const Vec3& hi, const Box3& box) {
  return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
}

/// A polyhedron in its pose, of which a patch takes what may touch.
class Posed {
 public:
  Posed(const Polyhedron& p, const Vec3& centre, const Mat3& F) : p_(p), cofactor_(cofactor(F)) {
    x.clear();
    for (const auto& X : p.vertices) x.push_back(centre + F * X);
    normal_.assign(p.face_normals.size(), Vec3::Zero());
  }

  /// The triangles, edges and vertices of which `in` says so, given their corners.
  template <class In>
  void take(const In& in, Patch& patch);

  thread_local static std::vector<Vec3> x;  // corners

 private:
  /// Outward unit normal of a face, found when it is first asked for: most faces of a scan never are.
  const Vec3& normal(int face) {
    Vec3& n = normal_[static_cast<std::size_t>(face)];
    if (n.isZero(0)) n = (cofactor_ * p_.face_normals[static_cast<std::size_t>(face)]).normalized();
    return n;
  }

  const Polyhedron& p_;
  Mat3 cofactor_;
  thread_local static std::vector<Vec3> normal_;
};

thread_local std::vector<Vec3> Posed::x;
thread_local std::vector<Vec3> Posed::normal_;

template <class In>
void Posed::take(const In& in, Patch& patch) {
  patch.clear();
  for (std::size_t t = 0; t < p_.triangles.size(); ++t) {
    const auto& v = p_.triangles[t];
    if (!in(std::span<const int>(v))) continue;
    Patch::Triangle q;
    q.id = q.face = p_.triangle_face[t];
    q.a = x[v[0]], q.b = x[v[1]], q.c = x[v[2]];
    q.n = normal(q.face);
    q.level = q.n.dot(q.a);
    for (int k = 0; k < 3; ++k) {
      q.sharp[k] = q.rim[k] = false;
      const int v0 = v[k], v1 = v[(k + 1) % 3];
      for (int i = p_.vertex_edge_offset[v0]; i < p_.vertex_edge_offset[v0 + 1]; ++i) {
        const auto& e = p_.edges[p_.vertex_edges[i]];
        if ((e.v0 == v0 && e.v1 == v1) || (e.v0 == v1 && e.v1 == v0)) q.sharp[k] = e.sine > 0;
      }
    }
    patch.triangles.push_back(q);
  }
  for (int i = 0; i < static_cast<int>(p_.edges.size()); ++i) {
    const auto& e = p_.edges[i];
    if (e.sine <= 0 || !in(std::array{e.v0, e.v1})) continue;
    const Vec3 &a = x[e.v0], &b = x[e.v1];
    const Vec3 d = (b - a).normalized();
    const Vec3 l = normal(e.left), r = normal(e.right);
    patch.edges.push_back({i, e.v0, e.v1, e.left, e.right, a, b, l, r, l.cross(d), -r.cross(d)});
  }
  for (int v = 0; v < static_cast<int>(x.size()); ++v) {
    if (!in(std::array{v}) || p_.vertex_edge_offset[v] == p_.vertex_edge_offset[v + 1]) continue;
    Patch::Vertex q{
        v, x[v], static_cast<int>(patch.directions.size()), 0, static_cast<int>(patch.face_normals.size()),
        0};
    bool convex = false;
    for (int i = p_.vertex_edge_offset[v]; i < p_.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = p_.edges[p_.vertex_edges[i]];
      convex |= e.sine > 0;
      patch.directions.push_back((x[e.v0 == v ? e.v1 : e.v0] - x[v]).normalized());
      ++q.count;
      patch.face_normals.push_back(normal(e.left));
      patch.face_normals.push_back(normal(e.right));
      q.faces += 2;
    }
    if (convex) patch.vertices.push_back(q);
  }
}

}  // namespace

void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, const Box3& box, Patch& patch) {
  Posed posed(p, centre, F);
  posed.take(
      [&](std::span<const int> corners) {
        Box3 own;
        for (const int v : corners) own.extend(posed.x[v]);
        return boxes_meet(own.min(), own.max(), box);
      },
      patch);
}

void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, std::span<const Plane> planes,
            double margin, Patch& patch) {
  Posed posed(p, centre, F);
  thread_local std::vector<char> reaches;
  reaches.clear();
  for (const Vec3& x : posed.x)
    reaches.push_back(std::any_of(planes.begin(), planes.end(), [&](const Plane& plane) {
      return plane.n.dot(x) - plane.level <= margin;
    }));
  posed.take(
      [&](std::span<const int> corners) {
        return std::any_of(corners.begin(), corners.end(), [&](int v) { return reaches[v] != 0; });
      },
      patch);
}

void gather(const SurfaceIndex::Impl& s, const Vec3& origin, const Box3& box, Patch& patch) {
  patch.clear();
  thread_local std::vector<int> ids;
  ids.clear();
  const Box3 world(Vec3(box.min() + origin), Vec3(box.max() + origin));
  const auto& T = s.surface.triangles;
  const auto& X = s.surface.vertices;
  // A large terrain lies in memory, not in the cache: what a stage reads is asked for during the one before.
  const auto announce = [&](int t) {
    __builtin_prefetch(&T[t]);
    __builtin_prefetch(&s.normal[t]);
    __builtin_prefetch(&s.twin[3 * t]);
  };
  s.tree.traverse_ahead([&](const Vec3& lo, const Vec3& hi) { return boxes_meet(lo, hi, world); }, announce,
                        [&](int t) {
                          const auto b = s.triangle_box(t);
                          if (boxes_meet(b.min(), b.max(), world)) ids.push_back(t);
                        });
  if (ids.empty()) return;
  std::sort(ids.begin(), ids.end());
  for (const int t : ids) {
    __builtin_prefetch(&s.group[t]);
    for (const int v : T[t]) __builtin_prefetch(&s.vertex_offset[v]);
    for (int k = 0; k < 3; ++k)
      if (const int w = s.twin[3 * t + k]; w >= 0) announce(w / 3), __builtin_prefetch(&s.group[w / 3]);
  }
  const bool two_sided = s.surface.two_sided;
  // A two-sided sheet shows each triangle's side that faces the local origin (the block's centroid).
  const auto flipped = [&](int t) { return two_sided && s.normal[t].dot(origin - X[T[t][0]]) < 0; };
  const auto normal = [&](int t) -> Vec3 { return flipped(t) ? Vec3(-s.normal[t]) : s.normal[t]; };
  // Of side h: 0 flat or reentrant, 1 convex, 2 rim.
  const auto side_kind = [&](int h) {
    const int w = s.twin[h];
    if (w < 0) return 2;
    const int t = h / 3, u = w / 3;
    if (flipped(t) != flipped(u)) return 2;
    const Vec3 d = (X[T[t][(h % 3 + 1) % 3]] - X[T[t][h % 3]]).normalized();
    const double sine = s.normal[t].cross(s.normal[u]).dot(d);
    return (flipped(t) ? -sine : sine) > tolerances().true_edge ? 1 : 0;
  };
  thread_local std::vector<int> corners;
  corners.clear();
  for (const int t : ids) {
    if (s.normal[t].isZero()) continue;
    const auto& v = T[t];
    const bool flip = flipped(t);
    Patch::Triangle q;
    q.id = t;
    q.face = s.group[t];
    q.a = X[v[0]] - origin, q.b = X[v[flip ? 2 : 1]] - origin, q.c = X[v[flip ? 1 : 2]] - origin;
    q.n = normal(t);
    q.level = q.n.dot(q.a);
    for (int k = 0; k < 3; ++k) {
      const int h = 3 * t + k;
      const int kind = side_kind(h);
      q.sharp[flip ? 2 - k : k] = kind > 0;
      q.rim[flip ? 2 - k : k] = s.twin[h] < 0;
      if (kind > 0 && (kind == 2 || h < s.twin[h])) {
        const int w = s.twin[h];
        const Vec3 a = X[v[k]] - origin, b = X[v[(k + 1) % 3]] - origin;
        if (boxes_meet(a.cwiseMin(b), a.cwiseMax(b), box)) {
          const Vec3 d = (b - a).normalized();
          const Vec3 inl = s.normal[t].cross(d);  // into the left triangle whatever side is shown
          if (kind == 2)
            patch.edges.push_back({h, v[k], v[(k + 1) % 3], q.face, -1, a, b, q.n, q.n, inl, inl});
          else
            patch.edges.push_back({h, v[k], v[(k + 1) % 3], q.face, s.group[w / 3], a, b, q.n, normal(w / 3),
                                   inl, -s.normal[w / 3].cross(d)});
        }
      } else if (kind == 1) {
        // The twin's triangle adds it, unless its box misses.
        if (!std::binary_search(ids.begin(), ids.end(), s.twin[h] / 3)) {
          const int w = s.twin[h], k2 = w % 3;
          const auto& u = T[w / 3];
          const Vec3 a = X[u[k2]] - origin, b = X[u[(k2 + 1) % 3]] - origin;
          if (boxes_meet(a.cwiseMin(b), a.cwiseMax(b), box)) {
            const Vec3 d = (b - a).normalized();
            patch.edges.push_back({w, u[k2], u[(k2 + 1) % 3], s.group[w / 3], q.face, a, b, normal(w / 3),
                                   q.n, s.normal[w / 3].cross(d), -s.normal[t].cross(d)});
          }
        }
      }
      if (kind > 0) {
        corners.push_back(v[k]);
        corners.push_back(v[(k + 1) % 3]);
      }
    }
    patch.triangles.push_back(q);
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (const int v : corners) __builtin_prefetch(&s.vertex_triangle[s.vertex_offset[v]]);
  for (const int v : corners)
    for (int i = s.vertex_offset[v]; i < s.vertex_offset[v + 1]; ++i) announce(s.vertex_triangle[i]);
  for (const int v : corners) {
    const Vec3 x = X[v] - origin;
    if (!box.contains(x)) continue;
    Patch::Vertex q{
        v, x, static_cast<int>(patch.directions.size()), 0, static_cast<int>(patch.face_normals.size()), 0};
    int convex = 0;
    for (int i = s.vertex_offset[v]; i < s.vertex_offset[v + 1]; ++i) {
      const int t = s.vertex_triangle[i];
      patch.face_normals.push_back(normal(t));
      ++q.faces;
      for (int k = 0; k < 3; ++k) {
        const int v0 = T[t][k], v1 = T[t][(k + 1) % 3];
        if (v0 != v && v1 != v) continue;
        const int h = 3 * t + k, w = s.twin[h];
        if (w >= 0 && v1 == v) continue;  // its twin starts here
        // All true edges bound the cone, reentrant ones too.
        const Vec3 d = (X[v0 == v ? v1 : v0] - X[v]).normalized();
        const bool flat = w >= 0 && flipped(t) == flipped(w / 3) &&
                          s.normal[t].cross(s.normal[w / 3]).norm() <= tolerances().true_edge;
        if (flat) continue;
        convex += side_kind(h) > 0;
        patch.directions.push_back(d);
        ++q.count;
      }
    }
    // On a straight ridge the crossings of the ridge say it all.
    const bool straight =
        q.count == 2 && patch.directions[q.first].dot(patch.directions[q.first + 1]) < 0 &&
        patch.directions[q.first].cross(patch.directions[q.first + 1]).norm() <= tolerances().true_edge;
    if (convex >= 2 && !straight) patch.vertices.push_back(q);
  }
}

}  // namespace talus::contact::narrow

#include "contact/narrow/narrow_patch.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "contact/geometry/edge_ends.hpp"
#include "contact/narrow/narrow_near.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

bool boxes_meet(const Vec3& lo, const Vec3& hi, const Box3& box) {
  return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
}

/// A polyhedron in its pose, of which a patch takes what may touch.
class Posed {
 public:
  Posed(const Polyhedron& p, const Vec3& centre, const Mat3& F)
      : p_(p),
        centre_(centre),
        F_(F),
        spread_(F.cwiseAbs()),
        cofactor_(cofactor(F)),
        stretch_(stretch_bound(F)) {}

  /// The triangles, edges and vertices of which `in` says so: `in.box(middle, half, radius)` whether anything
  /// may be that lies within a box and within a ball about its middle, `in(corners, x)` decides.
  template <class In>
  void take(const In& in, Patch& patch);

 private:
  struct Scratch {
    std::vector<int> triangles, corners, edges;  // of the patch
    std::vector<Vec3> x;                         // of corners
    std::vector<Vec3> normal;                    // of faces,
    std::vector<int> placed, known;              // the call in which they were found
    std::vector<int> corner_of, edge_of;         // the call whose patch they are in
    int call = 0;
  };
  static thread_local Scratch scratch;

  template <class In>
  void find(const In& in) const;
  /// Outward unit normal of a face, found when it is first asked for.
  const Vec3& normal(int face) const {
    const auto f = static_cast<std::size_t>(face);
    if (scratch.known[f] != scratch.call) {
      scratch.known[f] = scratch.call;
      scratch.normal[f] = (cofactor_ * p_.face_normals[f]).normalized();
    }
    return scratch.normal[f];
  }
  Vec3 place(int v) const { return centre_ + F_ * p_.vertices[v]; }
  /// True if a convex edge ends at the vertex, be it to go on beyond.
  bool ends_convex_edge(int v) const {
    for (int i = p_.vertex_edge_offset[v]; i < p_.vertex_edge_offset[v + 1]; ++i)
      if (p_.edges[p_.vertex_edges[i]].sine > 0) return true;
    return false;
  }
  /// True if one does that does not go on.
  bool is_corner(int v) const {
    for (int i = p_.vertex_edge_offset[v]; i < p_.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = p_.edges[p_.vertex_edges[i]];
      if (e.sine > 0 && !(e.v0 == v ? e.on_at_v0 : e.on_at_v1)) return true;
    }
    return false;
  }

  const Polyhedron& p_;
  const Vec3& centre_;
  const Mat3 &F_, spread_, cofactor_;
  const double stretch_;
};

thread_local Posed::Scratch Posed::scratch;

/// The triangles, and the edges and corners of these, in ascending order.
template <class In>
void Posed::find(const In& in) const {
  auto& [triangles, corners, edges, x, normal, placed, known, corner_of, edge_of, call] = scratch;
  triangles.clear(), corners.clear(), edges.clear();
  if (const std::size_t n = p_.vertices.size(); x.size() < n)
    x.resize(n), placed.resize(n, 0), corner_of.resize(n, 0);
  if (edge_of.size() < p_.edges.size()) edge_of.resize(p_.edges.size(), 0);
  if (normal.size() < p_.face_normals.size())
    normal.resize(p_.face_normals.size()), known.resize(p_.face_normals.size(), 0);
  ++call;
  p_.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        const Vec3 middle = centre_ + F_ * (0.5 * (lo + hi)), half = spread_ * (0.5 * (hi - lo));
        return in.box(middle, half, 0.5 * stretch_ * (hi - lo).norm());
      },
      [&](int t) {
        for (const int v : p_.triangles[t])
          if (std::exchange(placed[v], call) != call) x[v] = place(v);
        if (in(p_.triangles[t], x)) triangles.push_back(t);
        return true;
      });
  for (const int t : triangles) {
    for (const int v : p_.triangles[t])
      if (std::exchange(corner_of[v], call) != call) corners.push_back(v);
    for (const int e : p_.triangle_edges[t])
      if (e >= 0 && p_.edges[e].sine > 0 && std::exchange(edge_of[e], call) != call) edges.push_back(e);
  }
  for (std::vector<int>* list : {&triangles, &corners, &edges}) std::sort(list->begin(), list->end());
}

template <class In>
void Posed::take(const In& in, Patch& patch) {
  patch.clear();
  find(in);
  const std::vector<Vec3>& x = scratch.x;
  for (const int t : scratch.triangles) {
    const auto& v = p_.triangles[t];
    Patch::Triangle q;
    q.id = q.face = p_.triangle_face[t];
    q.a = x[v[0]], q.b = x[v[1]], q.c = x[v[2]];
    q.n = normal(q.face);
    q.level = q.n.dot(q.a);
    for (int k = 0; k < 3; ++k) {
      const int e = p_.triangle_edges[t][k];
      q.sharp[k] = e >= 0 && p_.edges[e].sine > 0;
      q.rim[k] = false;
      q.tip[k] = ends_convex_edge(v[k]);
    }
    patch.triangles.push_back(q);
  }
  for (const int i : scratch.edges) {
    const auto& e = p_.edges[i];
    if (!in(std::array{e.v0, e.v1}, x)) continue;
    const Vec3 &a = x[e.v0], &b = x[e.v1];
    const Vec3 d = (b - a).normalized();
    const Vec3 l = normal(e.left), r = normal(e.right);
    patch.edges.push_back(
        {i, e.v0, e.v1, e.left, e.right, a, b, l, r, l.cross(d), -r.cross(d), e.on_at_v0, e.on_at_v1});
  }
  for (const int v : scratch.corners) {
    if (!is_corner(v) || !in(std::array{v}, x)) continue;
    Patch::Vertex q{
        v, x[v], static_cast<int>(patch.directions.size()), 0, static_cast<int>(patch.face_normals.size()),
        0};
    for (int i = p_.vertex_edge_offset[v]; i < p_.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = p_.edges[p_.vertex_edges[i]];
      patch.directions.push_back((place(e.v0 == v ? e.v1 : e.v0) - x[v]).normalized());
      ++q.count;
      patch.face_normals.push_back(normal(e.left));
      patch.face_normals.push_back(normal(e.right));
      q.faces += 2;
    }
    patch.vertices.push_back(q);
  }
}

/// What reaches into what two bodies share.
struct InCommon {
  const Common& common;
  const Vec3 spread = common.n.cwiseAbs();

  bool box(const Vec3& middle, const Vec3& half, double) const {
    const double h = common.n.dot(middle), of_n = spread.dot(half);
    return h + of_n >= common.low && h - of_n <= common.high &&
           boxes_meet(middle - half, middle + half, common.box);
  }
  bool operator()(std::span<const int> corners, const std::vector<Vec3>& x) const {
    Box3 own;
    double low = infinity, high = -infinity;
    for (const int v : corners) {
      own.extend(x[v]);
      const double h = common.n.dot(x[v]);
      low = std::min(low, h), high = std::max(high, h);
    }
    return high >= common.low && low <= common.high && boxes_meet(own.min(), own.max(), common.box);
  }
};

/// What is within `reach` of a surface, or behind it. What has no part near any of its triangles lies wholly
/// on one side.
struct AtSurface {
  const NearTriangles& surface;
  std::span<const int> facing;  // of its triangles
  double reach, touch;

  bool box(const Vec3& middle, const Vec3& half, double radius) const {
    return reaches(middle, radius, [&](const Vec3& n) { return n.cwiseAbs().dot(half); });
  }
  bool operator()(std::span<const int> corners, const std::vector<Vec3>& x) const {
    Vec3 middle = Vec3::Zero();
    for (const int v : corners) middle += x[v] / static_cast<double>(corners.size());
    double radius = 0;
    for (const int v : corners) radius = std::max(radius, (x[v] - middle).norm());
    return reaches(middle, radius, [&](const Vec3& n) {
      double most = 0;
      for (const int v : corners) most = std::max(most, n.dot(middle - x[v]));
      return most;
    });
  }
  /// Of what lies in a ball and reaches below its middle by below(n) along n.
  template <class Below>
  bool reaches(const Vec3& middle, double radius, Below&& below) const {
    bool behind = false, interior;
    for (const int k : facing) {
      const Patch::Triangle& t = surface.patch().triangles[k];
      const double h = t.n.dot(middle) - t.level;
      behind = behind || h <= reach;
      const Ball& ball = surface.balls()[k];
      const double near = radius + reach, nearest = near + ball.radius;
      if (std::abs(h) <= near && (middle - ball.centre).squaredNorm() <= nearest * nearest &&
          h - below(t.n) <= reach && (middle - closest_on_triangle(t, middle, interior)).norm() <= near)
        return true;
    }
    return behind && surface.ahead(middle, touch) == 0;
  }
};

}  // namespace

void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, const Common& common, Patch& patch) {
  const InCommon in{common};
  Posed(p, centre, F).take(in, patch);
}

void gather(const Polyhedron& p, const Vec3& centre, const Mat3& F, const NearTriangles& surface,
            std::span<const int> facing, double margin, double touch, Patch& patch) {
  const AtSurface in{surface, facing, margin + touch, touch};
  Posed(p, centre, F).take(in, patch);
}

namespace {

/// A surface as a block's centroid sees it: of a two-sided sheet each triangle's side that faces it.
struct View {
  const SurfaceIndex::Impl& s;
  const Vec3& origin;

  Vec3 place(int v) const { return s.surface.vertices[v] - origin; }
  const std::array<int, 3>& corners(int t) const { return s.surface.triangles[t]; }
  bool flipped(int t) const {
    return s.surface.two_sided && s.normal[t].dot(origin - s.surface.vertices[corners(t)[0]]) < 0;
  }
  Vec3 normal(int t) const { return flipped(t) ? Vec3(-s.normal[t]) : s.normal[t]; }
  /// Of side h: 0 flat or reentrant, 1 convex, 2 rim.
  int side_kind(int h) const {
    const int w = s.twin[h];
    if (w < 0) return 2;
    const int t = h / 3, u = w / 3;
    if (flipped(t) != flipped(u)) return 2;
    const auto& X = s.surface.vertices;
    const Vec3 d = (X[corners(t)[(h % 3 + 1) % 3]] - X[corners(t)[h % 3]]).normalized();
    const double sine = s.normal[t].cross(s.normal[u]).dot(d);
    return (flipped(t) ? -sine : sine) > tolerances().true_edge ? 1 : 0;
  }
  /// A large terrain lies in memory, not in the cache: what a stage reads is asked for during the one before.
  void announce(int t) const {
    __builtin_prefetch(&s.surface.triangles[t]);
    __builtin_prefetch(&s.normal[t]);
    __builtin_prefetch(&s.twin[3 * t]);
  }
};

/// Triangles whose boxes meet the box (world), in ascending order.
void find_triangles(const View& view, const Box3& world, std::vector<int>& ids) {
  const SurfaceIndex::Impl& s = view.s;
  ids.clear();
  s.tree.traverse_ahead([&](const Vec3& lo, const Vec3& hi) { return boxes_meet(lo, hi, world); },
                        [&](int t) { view.announce(t); },
                        [&](int t) {
                          const auto b = s.triangle_box(t);
                          if (boxes_meet(b.min(), b.max(), world)) ids.push_back(t);
                        });
  std::sort(ids.begin(), ids.end());
  for (const int t : ids) {
    __builtin_prefetch(&s.group[t]);
    for (const int v : view.corners(t)) __builtin_prefetch(&s.vertex_offset[v]);
    for (int k = 0; k < 3; ++k)
      if (const int w = s.twin[3 * t + k]; w >= 0) view.announce(w / 3), __builtin_prefetch(&s.group[w / 3]);
  }
}

/// Of a skin that bends: its nodes are pressed one by one, so that no edge goes on beyond its own. Where a
/// ridge is straight at a vertex its crossings say it all but of faces.
void find_straight(const View& view, int v, Patch& patch, Patch::Vertex& q) {
  const SurfaceIndex::Impl& s = view.s;
  const auto& X = s.surface.vertices;
  q.straight =
      q.count == 2 && patch.directions[q.first].dot(patch.directions[q.first + 1]) < 0 &&
      patch.directions[q.first].cross(patch.directions[q.first + 1]).norm() <= tolerances().true_edge;
  // Two opposite edges bound no cone: its faces do.
  for (int i = s.vertex_offset[v]; q.straight && i < s.vertex_offset[v + 1]; ++i, ++q.count) {
    const auto& t = s.surface.triangles[s.vertex_triangle[i]];
    patch.directions.push_back(((X[t[0]] + X[t[1]] + X[t[2]]) / 3 - X[v]).normalized());
  }
}

/// The edge along side h, where it meets the box.
void add_edge(const View& view, int h, bool rim, const Box3& box, Patch& patch) {
  const SurfaceIndex::Impl& s = view.s;
  const int t = h / 3, k = h % 3, u = s.twin[h] / 3, v0 = view.corners(t)[k],
            v1 = view.corners(t)[(k + 1) % 3];
  const Vec3 a = view.place(v0), b = view.place(v1);
  if (!boxes_meet(a.cwiseMin(b), a.cwiseMax(b), box)) return;
  const Vec3 d = (b - a).normalized(), n = view.normal(t);
  const Vec3 left = s.normal[t].cross(d);  // into the left triangle whatever side is shown
  if (rim)
    patch.edges.push_back({h, v0, v1, s.group[t], -1, a, b, n, n, left, left});
  else
    patch.edges.push_back(
        {h, v0, v1, s.group[t], s.group[u], a, b, n, view.normal(u), left, -s.normal[u].cross(d)});
}

void add_triangle(const View& view, int t, const std::vector<int>& ids, const Box3& box, Patch& patch,
                  std::vector<int>& corners) {
  const SurfaceIndex::Impl& s = view.s;
  const auto& v = view.corners(t);
  const bool flip = view.flipped(t);
  Patch::Triangle q;
  q.id = t;
  q.face = s.group[t];
  q.a = view.place(v[0]), q.b = view.place(v[flip ? 2 : 1]), q.c = view.place(v[flip ? 1 : 2]);
  q.n = view.normal(t);
  q.level = q.n.dot(q.a);
  for (int k = 0; k < 3; ++k) {
    const int h = 3 * t + k, kind = view.side_kind(h), w = s.twin[h];
    q.sharp[flip ? 2 - k : k] = kind > 0;
    q.rim[flip ? 2 - k : k] = w < 0;
    if (kind == 0) continue;
    if (kind == 2 || h < w)
      add_edge(view, h, kind == 2, box, patch);
    else if (!std::binary_search(ids.begin(), ids.end(), w / 3))
      add_edge(view, w, false, box, patch);  // else the twin's triangle adds it
    corners.push_back(v[k]);
    corners.push_back(v[(k + 1) % 3]);
  }
  patch.triangles.push_back(q);
}

void add_corner(const View& view, int v, Patch& patch) {
  const SurfaceIndex::Impl& s = view.s;
  const auto& X = s.surface.vertices;
  Patch::Vertex q{v,
                  view.place(v),
                  static_cast<int>(patch.directions.size()),
                  0,
                  static_cast<int>(patch.face_normals.size()),
                  0};
  int convex = 0;
  for (int i = s.vertex_offset[v]; i < s.vertex_offset[v + 1]; ++i) {
    const int t = s.vertex_triangle[i];
    patch.face_normals.push_back(view.normal(t));
    ++q.faces;
    for (int k = 0; k < 3; ++k) {
      const int v0 = view.corners(t)[k], v1 = view.corners(t)[(k + 1) % 3];
      if (v0 != v && v1 != v) continue;
      const int h = 3 * t + k, w = s.twin[h];
      if (w >= 0 && v1 == v) continue;  // its twin starts here
      // All true edges bound the cone, reentrant ones too.
      const Vec3 d = (X[v0 == v ? v1 : v0] - X[v]).normalized();
      const bool flat = w >= 0 && view.flipped(t) == view.flipped(w / 3) &&
                        s.normal[t].cross(s.normal[w / 3]).norm() <= tolerances().true_edge;
      if (flat) continue;
      convex += view.side_kind(h) > 0;
      patch.directions.push_back(d);
      ++q.count;
    }
  }
  if (convex == 0) return;
  if (!s.surface.nodes.empty()) find_straight(view, v, patch, q);
  patch.vertices.push_back(q);
}

/// The triangles about a vertex.
void sectors_at(const SurfaceIndex::Impl& s, int v, std::vector<Sector>& around) {
  around.clear();
  const auto& X = s.surface.vertices;
  for (int i = s.vertex_offset[v]; i < s.vertex_offset[v + 1]; ++i) {
    const int t = s.vertex_triangle[i];
    const auto& c = s.surface.triangles[t];
    const int k = c[0] == v ? 0 : c[1] == v ? 1 : 2;
    if (!s.normal[t].isZero())
      around.push_back(
          {s.normal[t], (X[c[(k + 1) % 3]] - X[v]).normalized(), (X[c[(k + 2) % 3]] - X[v]).normalized()});
  }
}

/// Which edges go on beyond their ends, and the vertices in the box at which one ends.
void find_ends(const View& view, const Box3& box, Patch& patch, std::vector<int>& corners) {
  thread_local std::vector<Sector> around;
  corners.clear();
  for (Patch::Edge& e : patch.edges)
    for (const bool at_a : {true, false}) {
      const int v = at_a ? e.v0 : e.v1;
      const Vec3 &x = at_a ? e.a : e.b, &other = at_a ? e.b : e.a;
      if (!box.contains(x)) continue;
      sectors_at(view.s, v, around);
      const bool on = !view.s.surface.two_sided && goes_on(around, (other - x).normalized(), e.left, e.right);
      (at_a ? e.on_at_a : e.on_at_b) = on;
      if (!on) corners.push_back(v);
    }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
}

}  // namespace

void gather(const SurfaceIndex::Impl& s, const Vec3& origin, const Box3& box, Patch& patch) {
  thread_local std::vector<int> ids, corners;
  const View view{s, origin};
  patch.clear();
  find_triangles(view, Box3(Vec3(box.min() + origin), Vec3(box.max() + origin)), ids);
  corners.clear();
  for (const int t : ids)
    if (!s.normal[t].isZero()) add_triangle(view, t, ids, box, patch, corners);
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (Patch::Triangle& q : patch.triangles)
    for (int k = 0; k < 3; ++k)
      q.tip[k] = std::binary_search(corners.begin(), corners.end(),
                                    view.corners(q.id)[view.flipped(q.id) ? (3 - k) % 3 : k]);
  for (const int v : corners) __builtin_prefetch(&s.vertex_triangle[s.vertex_offset[v]]);
  for (const int v : corners)
    for (int i = s.vertex_offset[v]; i < s.vertex_offset[v + 1]; ++i) view.announce(s.vertex_triangle[i]);
  if (s.surface.nodes.empty()) find_ends(view, box, patch, corners);
  for (const int v : corners)
    if (box.contains(view.place(v))) add_corner(view, v, patch);
}

}  // namespace talus::contact::narrow

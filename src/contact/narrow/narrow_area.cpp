/// Areas on which faces press, shared among the contact points on them.
#include "contact/narrow/narrow_features.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

struct AreaScratch {
  std::vector<ClipVertex> polygon, clipped;
  std::vector<int> chosen;
  std::vector<const Patch::Triangle*> triangles;  // of B, those of a face together
  std::vector<std::pair<int, int>> pressed;       // face of B, contact point on it
  std::vector<double> angle;
};
thread_local AreaScratch area_scratch;

/// Area of triangle t clipped by the convex polygon / triangle q, both within `lean` of opposed.
double clipped_area(AreaScratch& w, const Patch::Triangle& t, const Patch::Triangle& q) {
  w.polygon.clear();
  w.polygon.push_back({t.a, 0, 0});
  w.polygon.push_back({t.b, 0, 0});
  w.polygon.push_back({t.c, 0, 0});
  const Vec3* p[3] = {&q.a, &q.b, &q.c};
  for (int k = 0; k < 3 && !w.polygon.empty(); ++k) {
    const Vec3 m = (*p[(k + 1) % 3] - *p[k]).cross(q.n);
    clip_half_space(w.polygon, *p[k], m, 0.0, 0, w.clipped);
    w.polygon.swap(w.clipped);
  }
  if (w.polygon.size() < 3) return 0;
  return std::max(0.0, polygon_area(w.polygon, t.n, [](const ClipVertex& v) -> const Vec3& { return v.x; }));
}

/// Distributes the area on which face `face` of B presses over the contact points on it, so that the weights
/// sum to the area and, for the hull of the points, keep the centroid.
void assign_area(AreaScratch& w, const std::vector<int>& which, const Vec3& n, double area,
                 std::vector<ContactPoint>& points) {
  if (which.empty() || area <= 0) return;
  if (which.size() < 3) {
    for (const int i : which) points[i].area += area / static_cast<double>(which.size());
    return;
  }
  // Convex hull in the plane (monotone chain).
  const Vec3 u = n.unitOrthogonal(), v = n.cross(u);
  const auto px = [&](int i) { return u.dot(points[i].point_b); };
  const auto py = [&](int i) { return v.dot(points[i].point_b); };
  thread_local std::vector<int> order, hull;
  order = which;
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const double xi = px(i), xj = px(j);
    if (xi != xj) return xi < xj;
    const double yi = py(i), yj = py(j);
    return yi != yj ? yi < yj : i < j;
  });
  const auto turn = [&](int i, int j, int k) {
    return (px(j) - px(i)) * (py(k) - py(i)) - (py(j) - py(i)) * (px(k) - px(i));
  };
  hull.clear();
  const double flat = 1e-12 * area;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const int i : order) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), i) <= flat) hull.pop_back();
      hull.push_back(i);
    }
    hull.pop_back();
    std::reverse(order.begin(), order.end());
  }
  const std::size_t m = hull.size();
  w.angle.assign(m, 0.0);
  double cx = 0, cy = 0, twice = 0;
  for (std::size_t k = 1; k + 1 < m; ++k) {
    const double a = turn(hull[0], hull[k], hull[k + 1]);
    twice += a;
    cx += a * (px(hull[0]) + px(hull[k]) + px(hull[k + 1])) / 3;
    cy += a * (py(hull[0]) + py(hull[k]) + py(hull[k + 1])) / 3;
  }
  if (twice <= 0) {
    for (const int i : which) points[i].area += area / static_cast<double>(which.size());
    return;
  }
  cx /= twice, cy /= twice;
  double sum = 0;
  for (std::size_t k = 0; k < m; ++k) {
    const std::size_t l = (k + 1) % m;
    const double a =
        0.5 * std::abs((px(hull[k]) - cx) * (py(hull[l]) - cy) - (py(hull[k]) - cy) * (px(hull[l]) - cx));
    w.angle[k] += a / 2, w.angle[l] += a / 2;
    sum += a;
  }
  for (std::size_t k = 0; k < m; ++k) points[hull[k]].area += w.angle[k] * area / sum;
}

}  // namespace

void press_areas(const Search& s, const Polyhedron& b, std::vector<ContactPoint>& points) {
  AreaScratch& w = area_scratch;
  const auto opposed = [](const Vec3& n, const Vec3& m) {
    return n.dot(m) <= -tolerances().parallel_cosine();
  };
  w.triangles.clear();
  for (const Patch::Triangle& t : s.B.triangles) w.triangles.push_back(&t);
  std::sort(w.triangles.begin(), w.triangles.end(), [](const Patch::Triangle* t, const Patch::Triangle* u) {
    return t->face != u->face ? t->face < u->face : t < u;
  });
  const auto first_of = [&w](int face) {
    return std::lower_bound(w.triangles.begin(), w.triangles.end(), face,
                            [](const Patch::Triangle* t, int f) { return t->face < f; });
  };
  const auto end = w.triangles.end();
  // Of the thousands of faces of a scan few lie flat on anything: those that a contact is on.
  w.pressed.clear();
  for (int k = 0; k < static_cast<int>(points.size()); ++k) {
    const auto note = [&](int face) {
      const auto t = first_of(face);
      if (t != end && (*t)->face == face && opposed(points[k].normal, (*t)->n))
        w.pressed.emplace_back(face, k);
    };
    const int feature = features_of(points[k].key).second;
    switch (form_of(points[k].key)) {
      case Form::vertex_face: note(feature); break;
      case Form::edge_edge: note(b.edges[feature].left), note(b.edges[feature].right); break;
      case Form::face_vertex:
        for (int i = b.vertex_edge_offset[feature]; i < b.vertex_edge_offset[feature + 1]; ++i)
          note(b.edges[b.vertex_edges[i]].left), note(b.edges[b.vertex_edges[i]].right);
        break;
      default: break;
    }
  }
  std::sort(w.pressed.begin(), w.pressed.end());
  w.pressed.erase(std::unique(w.pressed.begin(), w.pressed.end()), w.pressed.end());
  for (std::size_t i = 0; i < w.pressed.size();) {
    const int face = w.pressed[i].first;
    double deepest = infinity;
    w.chosen.clear();
    for (; i < w.pressed.size() && w.pressed[i].first == face; ++i) {
      w.chosen.push_back(w.pressed[i].second);
      deepest = std::min(deepest, points[w.chosen.back()].gap);
    }
    const auto first = first_of(face);
    const Vec3& n = (*first)->n;
    double area = 0;
    for (const auto& t : s.A.triangles)
      for (auto i_q = first; i_q != end && (*i_q)->face == face && opposed(t.n, n); ++i_q) {
        const Patch::Triangle& q = **i_q;
        const double h0 = t.n.dot(q.a) - t.level, h1 = t.n.dot(q.b) - t.level, h2 = t.n.dot(q.c) - t.level;
        if (std::min({h0, h1, h2}) <= s.margin && std::max({h0, h1, h2}) >= deepest - s.touch)
          area += clipped_area(w, t, q);
      }
    if (area <= 0) continue;
    assign_area(w, w.chosen, n, area, points);
    for (const int k : w.chosen) points[k].face_b = face;
  }
}

}  // namespace talus::contact::narrow

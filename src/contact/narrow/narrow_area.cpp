/// Areas on which faces press, shared among the contact points on them.
#include "contact/narrow/narrow_features.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

struct AreaScratch {
  std::vector<ClipVertex> polygon, clipped;
  std::vector<int> chosen;
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
  thread_local std::vector<int> seen;
  seen.clear();
  // Blocks cut from natural ground have thousands of faces, many of them nearly parallel.
  thread_local std::vector<std::vector<int>> of_face;
  if (of_face.size() < b.face_normals.size()) of_face.resize(b.face_normals.size());
  for (std::size_t i = 0; i < s.B.triangles.size(); ++i)
    of_face[static_cast<std::size_t>(s.B.triangles[i].face)].clear();
  for (std::size_t i = 0; i < s.B.triangles.size(); ++i)
    of_face[static_cast<std::size_t>(s.B.triangles[i].face)].push_back(static_cast<int>(i));
  for (std::size_t i = 0; i < s.B.triangles.size(); ++i) {
    const int face = s.B.triangles[i].face;
    const Vec3 n = s.B.triangles[i].n;
    // Of the faces of a scan few lie flat on anything: that is asked first.
    const auto opposed = [&n](const ContactPoint& c) {
      return c.normal.dot(n) <= -tolerances().parallel_cosine();
    };
    if (std::none_of(points.begin(), points.end(), opposed)) continue;
    if (std::find(seen.begin(), seen.end(), face) != seen.end()) continue;
    seen.push_back(face);
    w.chosen.clear();
    const int first = b.face_offset[face], last = b.face_offset[face + 1];
    for (int k = 0; k < static_cast<int>(points.size()); ++k) {
      const auto& c = points[k];
      if (!opposed(c)) continue;
      const Form form = form_of(c.key);
      const int feature = features_of(c.key).second;
      bool on = false;
      if (form == Form::vertex_face)
        on = feature == face;
      else if (form == Form::face_vertex)
        on = std::find(b.face_vertices.begin() + first, b.face_vertices.begin() + last, feature) !=
             b.face_vertices.begin() + last;
      else if (form == Form::edge_edge)
        on = b.edges[feature].left == face || b.edges[feature].right == face;
      if (on) w.chosen.push_back(k);
    }
    if (w.chosen.empty()) continue;
    double deepest = infinity;
    for (const int k : w.chosen) deepest = std::min(deepest, points[k].gap);
    double area = 0;
    for (const auto& t : s.A.triangles) {
      if (t.n.dot(n) > -tolerances().parallel_cosine()) continue;
      for (const int i_q : of_face[static_cast<std::size_t>(face)]) {
        const auto& q = s.B.triangles[static_cast<std::size_t>(i_q)];
        const double h0 = t.n.dot(q.a) - t.level, h1 = t.n.dot(q.b) - t.level, h2 = t.n.dot(q.c) - t.level;
        if (std::min({h0, h1, h2}) > s.margin || std::max({h0, h1, h2}) < deepest - s.touch) continue;
        area += clipped_area(w, t, q);
      }
    }
    if (area <= 0) continue;
    assign_area(w, w.chosen, n, area, points);
    for (const int k : w.chosen) points[k].face_b = face;
  }
}

}  // namespace talus::contact::narrow

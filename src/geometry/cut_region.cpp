// The region as cells: itself, or divided along the faces of a body (binary space partition).
#include <algorithm>
#include <cmath>

#include "geometry/cut_internal.hpp"

namespace talus::geometry::cutting {
namespace {

struct Fragment {
  std::vector<Vec3> polygon;  // the part of a region face within a cell
  int plane;
};

double area_of(const std::vector<Vec3>& p) {
  Vec3 a = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < p.size(); ++k) a += (p[k] - p[0]).cross(p[k + 1] - p[0]);
  return 0.5 * a.norm();
}

/// Splits a convex polygon; a part within the snapping distance of the plane is dropped.
void divide(const Fragment& f, const CellComplex::CutPlane& p, double snap, std::vector<Fragment>& plus,
            std::vector<Fragment>& minus) {
  std::vector<double> s;
  for (const Vec3& v : f.polygon) s.push_back(p.normal.dot(v) - p.offset);
  const double hi = *std::max_element(s.begin(), s.end()), lo = *std::min_element(s.begin(), s.end());
  if (hi <= snap && lo >= -snap) return;  // on the plane: this cut has made it
  if (lo >= -snap) return void(plus.push_back(f));
  if (hi <= snap) return void(minus.push_back(f));
  Fragment a{{}, f.plane}, b{{}, f.plane};
  for (std::size_t k = 0; k < s.size(); ++k) {
    const std::size_t next = (k + 1) % s.size();
    if (s[k] >= -snap) a.polygon.push_back(f.polygon[k]);
    if (s[k] <= snap) b.polygon.push_back(f.polygon[k]);
    if ((s[k] > snap && s[next] < -snap) || (s[k] < -snap && s[next] > snap)) {
      const Vec3 m = f.polygon[k] + (s[k] / (s[k] - s[next])) * (f.polygon[next] - f.polygon[k]);
      a.polygon.push_back(m);
      b.polygon.push_back(m);
    }
  }
  const auto keep = [&](Fragment& g, std::vector<Fragment>& to) {
    if (g.polygon.size() >= 3 && area_of(g.polygon) > snap * snap) to.push_back(std::move(g));
  };
  keep(a, plus);
  keep(b, minus);
}

/// How often the surface winds around a point: 1 inside, 0 outside (sum of solid angles over 4 pi).
double winding(const Polyhedron& region, const Vec3& x) {
  double sum = 0;
  for (const auto& t : region.triangles)
    sum += solid_angle(region.vertices[t[0]] - x, region.vertices[t[1]] - x, region.vertices[t[2]] - x);
  return sum / (4 * 3.14159265358979323846);
}

/// A plane of the complex for each face; faces apart in one plane share it.
std::vector<int> planes_of(CellComplex& complex, const Polyhedron& region) {
  std::vector<int> plane_of(region.faces());
  const int first = static_cast<int>(complex.planes().size());
  for (int f = 0; f < region.faces(); ++f) {
    const Vec3& n = region.face_normals[f];
    double offset = 0;
    const int begin = region.face_offset[f], end = region.face_offset[f + 1];
    for (int k = begin; k < end; ++k)
      offset += n.dot(region.vertices[region.face_vertices[k]]) / (end - begin);
    int found = -1;
    for (int p = first; p < static_cast<int>(complex.planes().size()) && found < 0; ++p) {
      const auto& q = complex.planes()[p];
      for (const double sign : {1.0, -1.0})
        if ((q.normal - sign * n).norm() < 1e-10 && std::abs(q.offset - sign * offset) < complex.snap())
          found = p;
    }
    plane_of[f] = found >= 0 ? found : complex.add_plane(n, offset);
  }
  return plane_of;
}

}  // namespace

double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

void add_region(CellComplex& complex, const Polyhedron& region) {
  const std::vector<int> plane_of = planes_of(complex, region);
  std::vector<std::vector<int>> loops;
  std::vector<int> planes;
  for (const Vec3& v : region.vertices) complex.add_vertex(v);
  if (region.convex) {
    for (int f = 0; f < region.faces(); ++f)
      loops.emplace_back(region.face_vertices.begin() + region.face_offset[f],
                         region.face_vertices.begin() + region.face_offset[f + 1]);
    planes = plane_of;
  } else {
    for (std::size_t t = 0; t < region.triangles.size(); ++t) {
      loops.emplace_back(region.triangles[t].begin(), region.triangles[t].end());
      planes.push_back(plane_of[region.triangle_face[t]]);
    }
  }
  complex.separate(complex.add_cell(loops, planes, mark_surface));
}

void add_convex_parts(CellComplex& complex, const Polyhedron& region) {
  if (region.convex) return add_region(complex, region);

  Box3 box;
  for (const Vec3& v : region.vertices) box.extend(v);
  const double margin = 0.1 * box.diagonal().norm();
  box.min().array() -= margin;
  box.max().array() += margin;
  std::vector<int> planes;
  for (int i = 0; i < 8; ++i)
    complex.add_vertex({i & 1 ? box.max().x() : box.min().x(), i & 2 ? box.max().y() : box.min().y(),
                        i & 4 ? box.max().z() : box.min().z()});
  for (int k = 0; k < 3; ++k) {
    planes.push_back(complex.add_plane(-Vec3::Unit(k), -box.min()[k]));
    planes.push_back(complex.add_plane(Vec3::Unit(k), box.max()[k]));
  }
  const int cell =
      complex.add_cell({{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}},
                       planes, mark_surface);

  for (const int outside : divide_by(complex, {cell}, region).outside) complex.remove_cell(outside);
  for (auto& f : complex.faces())
    if (f.cell[1] < 0) f.mark = mark_surface;
}

Parts divide_by(CellComplex& complex, const std::vector<int>& cells, const Polyhedron& body) {
  const std::vector<int> plane_of = planes_of(complex, body);
  std::vector<Fragment> all;
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    const auto& c = body.triangles[t];
    all.push_back(
        {{body.vertices[c[0]], body.vertices[c[1]], body.vertices[c[2]]}, plane_of[body.triangle_face[t]]});
  }
  Parts parts;
  std::vector<std::pair<int, std::vector<Fragment>>> work;
  for (const int cell : cells) work.emplace_back(cell, all);
  while (!work.empty()) {
    auto [cell, fragments] = std::move(work.back());
    work.pop_back();
    while (!fragments.empty()) {
      // The largest fragment's plane: few cuts for what they take away.
      const auto best = std::max_element(
          fragments.begin(), fragments.end(),
          [](const Fragment& a, const Fragment& b) { return area_of(a.polygon) < area_of(b.polygon); });
      const int plane = best->plane;
      const CellComplex::Split split = complex.split_cell(cell, plane, mark_division);
      std::vector<Fragment> plus, minus;
      for (const Fragment& f : fragments)
        if (f.plane != plane) divide(f, complex.planes()[plane], complex.snap(), plus, minus);
      if (!split.crossed()) {  // its fragments in that plane lie on the border
        fragments = split.side < 0 ? std::move(minus) : std::move(plus);
        if (split.side == 0) fragments.insert(fragments.end(), minus.begin(), minus.end());
        continue;
      }
      for (const int part : split.minus) work.emplace_back(part, minus);
      for (std::size_t k = 1; k < split.plus.size(); ++k) work.emplace_back(split.plus[k], plus);
      fragments = std::move(plus);
    }
    // No face of the body is left within its convex hull: the middle of its vertices lies where it does.
    Vec3 middle = Vec3::Zero();
    int n = 0;
    for (int f : complex.cells()[cell].faces)
      for (int v : complex.faces()[f].loop) middle += complex.vertices()[v], ++n;
    (winding(body, middle / n) > 0.5 ? parts.inside : parts.outside).push_back(cell);
  }
  return parts;
}

}  // namespace talus::geometry::cutting

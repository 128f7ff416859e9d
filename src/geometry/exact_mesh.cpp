// Convex hulls, self-intersections and repair of meshes. One of the few files that pay for CGAL's headers.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "geometry/mesh.hpp"

namespace talus::geometry {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

Mesh from_cgal(const SurfaceMesh& sm) {
  Mesh mesh;
  std::vector<int> number(sm.num_vertices() + sm.number_of_removed_vertices(), -1);
  for (auto v : sm.vertices()) {
    number[v.idx()] = static_cast<int>(mesh.vertices.size());
    mesh.vertices.emplace_back(sm.point(v).x(), sm.point(v).y(), sm.point(v).z());
  }
  for (auto f : sm.faces()) {
    std::array<int, 3> t{};
    int k = 0;
    for (auto v : sm.vertices_around_face(sm.halfedge(f)))
      if (k < 3) t[k++] = number[v.idx()];
    mesh.triangles.push_back(t);
  }
  return mesh;
}

}  // namespace

std::vector<std::pair<int, int>> self_intersections(const Mesh& mesh) {
  SurfaceMesh sm;
  std::vector<SurfaceMesh::Vertex_index> v;
  for (const Vec3& p : mesh.vertices) v.push_back(sm.add_vertex(Point(p.x(), p.y(), p.z())));
  for (const auto& t : mesh.triangles)
    if (sm.add_face(v[t[0]], v[t[1]], v[t[2]]) == SurfaceMesh::null_face()) {
      // A vertex where two fans of faces meet cannot be held in the half-edge structure: the surface touches
      // itself.
      return {{static_cast<int>(&t - mesh.triangles.data()), static_cast<int>(&t - mesh.triangles.data())}};
    }
  std::vector<std::pair<SurfaceMesh::Face_index, SurfaceMesh::Face_index>> found;
  PMP::self_intersections(sm, std::back_inserter(found));
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [a, b] : found) pairs.emplace_back(std::min<int>(a, b), std::max<int>(a, b));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

Mesh convex_hull(const std::vector<Vec3>& points) {
  std::vector<Point> p;
  for (const Vec3& q : points) {
    if (!q.allFinite()) throw InputError(Problem{.key = "vertices", .rule = "coordinates must be finite"});
    p.emplace_back(q.x(), q.y(), q.z());
  }
  SurfaceMesh sm;
  if (p.size() >= 4) CGAL::convex_hull_3(p.begin(), p.end(), sm);
  Mesh hull = from_cgal(sm);
  const Box3 box = hull.bounds();
  if (hull.triangles.size() < 4 ||
      !(signed_volume(hull.vertices, hull.triangles) > 1e-12 * std::pow(box.diagonal().norm(), 3)))
    throw InputError(Problem{.key = "vertices",
                             .value = fmt::format("{} points", points.size()),
                             .rule = "must span a volume (four points at least, not in one plane)",
                             .remedy = "give the corners of a body"});

  // The hull is unique, but its faces come in an order, and coplanar ones in a triangulation, that depend on
  // addresses in memory. Corners in the order of the input, faces as fans from their first corner, faces
  // sorted: the same always.
  std::vector<int> id(hull.vertices.size());
  for (std::size_t v = 0; v < id.size(); ++v)
    id[v] = static_cast<int>(std::find(points.begin(), points.end(), hull.vertices[v]) - points.begin());
  std::map<std::pair<int, int>, int> left;  // directed edge -> triangle
  std::vector<std::array<int, 3>> triangles = hull.triangles;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int& v : triangles[t]) v = id[v];
    for (int k = 0; k < 3; ++k) left[{triangles[t][k], triangles[t][(k + 1) % 3]}] = static_cast<int>(t);
  }
  std::vector<int> root(triangles.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int t) {
    while (root[t] != t) t = root[t] = root[root[t]];
    return t;
  };
  for (const auto& [edge, t] : left) {
    const int other = left.at({edge.second, edge.first});
    for (int v : triangles[other])
      if (v != edge.first && v != edge.second &&
          CGAL::coplanar(p[triangles[t][0]], p[triangles[t][1]], p[triangles[t][2]], p[v]))
        root[std::max(find(t), find(other))] = std::min(find(t), find(other));
  }
  std::map<int, std::map<int, int>> loops;  // face -> corner -> next corner
  for (const auto& [edge, t] : left)
    if (find(t) != find(left.at({edge.second, edge.first}))) loops[find(t)][edge.first] = edge.second;
  Mesh mesh;
  for (auto& [face, next] : loops) {
    std::vector<int> loop{next.begin()->first};
    for (int v = next.begin()->second; v != loop[0]; v = next.at(v)) loop.push_back(v);
    for (std::size_t k = 0; k < loop.size() && loop.size() > 3;) {  // a point within an edge is no corner
      const std::size_t n = loop.size();
      if (CGAL::collinear(p[loop[(k + n - 1) % n]], p[loop[k]], p[loop[(k + 1) % n]]))
        loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(k));
      else
        ++k;
    }
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    for (std::size_t k = 1; k + 1 < loop.size(); ++k)
      mesh.triangles.push_back({loop[0], loop[k], loop[k + 1]});
  }
  std::sort(mesh.triangles.begin(), mesh.triangles.end());
  std::vector<int> number(points.size(), -1);
  for (const auto& t : mesh.triangles)
    for (int v : t) number[v] = 0;
  for (std::size_t v = 0; v < points.size(); ++v)
    if (number[v] == 0) {
      number[v] = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(points[v]);
    }
  for (auto& t : mesh.triangles)
    for (int& v : t) v = number[v];
  return mesh;
}

namespace {

/// `mesh` is the input with vertices welded, for what fails after.
Mesh repaired(const Mesh& input, Mesh& mesh, RepairReport& report, double weld_tolerance) {
  mesh.group.clear();
  mesh.group_names.clear();
  const double size = mesh.bounds().diagonal().norm();
  report.vertices_welded = weld(mesh, weld_tolerance >= 0 ? weld_tolerance : 1e-9 * size);

  std::vector<Point> points;
  for (const Vec3& q : mesh.vertices) points.emplace_back(q.x(), q.y(), q.z());
  std::vector<std::vector<std::size_t>> soup;
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    if ((b - a).cross(c - a).norm() <= 2e-15 * size * size) continue;
    soup.push_back(
        {static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]), static_cast<std::size_t>(t[2])});
  }
  PMP::repair_polygon_soup(points, soup);
  report.triangles_dropped = static_cast<int>(input.triangles.size() - soup.size());
  const auto before = soup;
  PMP::orient_polygon_soup(points, soup);
  const auto cyclic = [](std::vector<std::size_t> t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  for (std::size_t t = 0; t < std::min(soup.size(), before.size()); ++t)
    report.triangles_turned += cyclic(soup[t]) != cyclic(before[t]);
  if (!PMP::is_polygon_soup_a_polygon_mesh(soup)) {
    report.remaining.push_back({.key = "mesh",
                                .rule = "faces cannot be oriented consistently",
                                .remedy = "remove inner walls and repeated faces"});
    return mesh;
  }
  SurfaceMesh sm;
  PMP::polygon_soup_to_polygon_mesh(points, soup, sm);
  std::vector<SurfaceMesh::Halfedge_index> borders;
  std::vector<bool> seen(sm.number_of_halfedges(), false);
  for (auto h : sm.halfedges())
    if (sm.is_border(h) && !seen[h.idx()]) {
      borders.push_back(h);
      for (auto g : CGAL::halfedges_around_face(h, sm)) seen[g.idx()] = true;
    }
  for (auto h : borders) {
    std::vector<SurfaceMesh::Face_index> patch;
    PMP::triangulate_hole(sm, h, std::back_inserter(patch));
    if (!patch.empty()) ++report.holes_filled;
    report.triangles_added += static_cast<int>(patch.size());
  }
  Mesh out = from_cgal(sm);
  // By the volume, not by an extreme vertex: a surface that encloses nothing has no vertex that shows it.
  if (CGAL::is_closed(sm) && signed_volume(out.vertices, out.triangles) < 0) {
    for (auto& t : out.triangles) std::swap(t[1], t[2]);
    report.turned_inside_out = true;
  }
  report.remaining = closed_mesh_problems(out, "");
  return out;
}

}  // namespace

Mesh repair(const Mesh& input, RepairReport& report, double weld_tolerance) {
  report = {};
  Mesh mesh = input;
  try {
    return repaired(input, mesh, report, weld_tolerance);
  } catch (const CGAL::Failure_exception&) {  // a condition of an algorithm that this surface does not meet
    report.remaining = closed_mesh_problems(mesh, "", false);
    report.remaining.push_back(
        {.key = "mesh",
         .rule = "its faces form no surface that can be repaired",
         .remedy =
             "remove faces that lie on each other and parts that touch in an edge alone, then repair it"});
    return mesh;
  }
}

}  // namespace talus::geometry

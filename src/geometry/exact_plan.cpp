#include "geometry/exact_plan.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <numeric>
#include <utility>

namespace talus::geometry {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel,
                                               CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Point = Kernel::Point_2;

std::optional<std::pair<int, int>> first_crossing(const std::vector<Point>& p,
                                                  const std::vector<std::pair<int, int>>& edges) {
  const auto apart = [&](int a, int b, int c, int d) {  // c and d on different sides of a - b, strictly
    return CGAL::orientation(p[a], p[b], p[c]) * CGAL::orientation(p[a], p[b], p[d]) == CGAL::NEGATIVE;
  };
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t j = i + 1; j < edges.size(); ++j) {
      const auto [a, b] = edges[i];
      const auto [c, d] = edges[j];
      if (apart(a, b, c, d) && apart(c, d, a, b)) return std::pair{static_cast<int>(i), static_cast<int>(j)};
    }
  return std::pair{0, -1};
}

}  // namespace

PlanTriangulation constrained_delaunay(const std::vector<Vec3>& points,
                                       const std::vector<std::pair<int, int>>& edges) {
  PlanTriangulation out;
  std::vector<Point> plan;
  plan.reserve(points.size());
  for (const Vec3& p : points) plan.emplace_back(p.x(), p.y());
  Triangulation mesh;
  std::vector<Triangulation::Vertex_handle> vertex(points.size());
  out.same.assign(points.size(), -1);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  using Traits = CGAL::Spatial_sort_traits_adapter_2<Kernel, CGAL::Pointer_property_map<Point>::const_type>;
  CGAL::spatial_sort(order.begin(), order.end(), Traits(CGAL::make_property_map(std::as_const(plan))));
  Triangulation::Face_handle near;
  for (const std::size_t i : order) {
    const std::size_t before = mesh.number_of_vertices();
    vertex[i] = mesh.insert(plan[i], near);
    near = vertex[i]->face();
    const bool is_new = mesh.number_of_vertices() > before;
    if (is_new || static_cast<int>(i) < vertex[i]->info()) vertex[i]->info() = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < points.size(); ++i) out.same[i] = vertex[i]->info();
  try {
    for (const auto& [a, b] : edges)
      if (vertex[a] != vertex[b]) mesh.insert_constraint(vertex[a], vertex[b]);
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    out.crossing = first_crossing(plan, edges);
    return out;
  }
  for (auto f = mesh.finite_faces_begin(); f != mesh.finite_faces_end(); ++f)
    out.triangles.push_back({f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()});
  return out;
}

}  // namespace talus::geometry

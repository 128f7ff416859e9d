// Bodies taken out of the ground. One of the few files that pay for CGAL's headers.
#include "geometry/take_out.hpp"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "core/disjoint_sets.hpp"

namespace talus::geometry {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
// Exact points from the first operation to the last: what lies on an edge stays on it.
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;
using Face = SurfaceMesh::Face_index;

// Where a face comes from: a triangle of the ground (its number), or
constexpr int of_body = -1, of_walls = -2;  // walls and floor that make a solid of the ground

InputError error(std::string key, std::string value, std::string rule, std::string remedy) {
  return InputError(Problem{.key = std::move(key),
                            .value = std::move(value),
                            .rule = std::move(rule),
                            .remedy = std::move(remedy)});
}

SurfaceMesh::Property_map<Face, int> origins(SurfaceMesh& sm) {
  return sm.add_property_map<Face, int>("f:origin", of_body).first;
}

/// Keeps the origins of faces that are divided or copied.
struct OriginVisitor : PMP::Corefinement::Default_visitor<SurfaceMesh> {
  int divided = of_body;
  void before_subface_creations(Face f, SurfaceMesh& sm) { divided = origins(sm)[f]; }
  void after_subface_created(Face f, SurfaceMesh& sm) { origins(sm)[f] = divided; }
  void after_face_copy(Face from, const SurfaceMesh& source, Face to, SurfaceMesh& target) {
    origins(target)[to] = source.property_map<Face, int>("f:origin").first[from];
  }
};

Point point(const Vec3& x) { return {x.x(), x.y(), x.z()}; }
Vec3 place(const SurfaceMesh& sm, SurfaceMesh::Vertex_index v) {
  const Point& p = sm.point(v);
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

/// Numbers of a surface's triangles whose boxes in plan meet the limits.
std::vector<int> within(const TriangleSurface& s, const Eigen::AlignedBox2d& limits) {
  std::vector<int> found;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    Eigen::AlignedBox2d own;
    for (const int v : s.triangles[t])
      own.extend(Eigen::Vector2d(s.vertices[static_cast<std::size_t>(v)].head<2>()));
    if (own.intersects(limits)) found.push_back(static_cast<int>(t));
  }
  return found;
}

/// Throws if one of these triangles does not face up.
void expect_facing_up(const TriangleSurface& s, const std::vector<int>& triangles, const std::string& key,
                      const std::string& what) {
  for (const int t : triangles) {
    const auto& v = s.triangles[static_cast<std::size_t>(t)];
    const Vec3 &a = s.vertices[static_cast<std::size_t>(v[0])],
               &b = s.vertices[static_cast<std::size_t>(v[1])],
               &c = s.vertices[static_cast<std::size_t>(v[2])];
    if ((b - a).cross(c - a).z() > 0) continue;
    const Vec3 m = (a + b + c) / 3;
    throw error(key, fmt::format("({:.6g}, {:.6g}, {:.6g})", m.x(), m.y(), m.z()),
                what + " overhangs or is vertical there, so that what lies above it is not known",
                "give the body as a closed mesh (region) beside ground that faces up there");
  }
}

/// These triangles and their copy at the height z below all of them, with walls between, as a closed body
/// with the triangles on top; their numbers are the origins.
SurfaceMesh down_to(const TriangleSurface& s, const std::vector<int>& triangles, double z,
                    const std::string& key) {
  // A corner where two fans of triangles meet is one vertex for each.
  std::map<std::pair<int, int>, std::size_t> side;  // directed edge -> triangle
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& v = s.triangles[static_cast<std::size_t>(triangles[i])];
      if (!side.emplace(std::pair(v[k], v[(k + 1) % 3]), 3 * i + k).second) {
        const Vec3& x = s.vertices[static_cast<std::size_t>(v[k])];
        throw error(
            key, fmt::format("({:.6g}, {:.6g}, {:.6g})", x.x(), x.y(), x.z()),
            "more than two of its triangles meet in an edge there, where a rock mass is cut out of it",
            "repair it (talus convert --repair)");
      }
    }
  DisjointSets fans(static_cast<int>(3 * triangles.size()));
  const auto next = [](std::size_t h) { return h - h % 3 + (h + 1) % 3; };
  for (const auto& [edge, h] : side)
    if (const auto twin = side.find({edge.second, edge.first}); twin != side.end()) {
      fans.join(static_cast<int>(h), static_cast<int>(next(twin->second)));
      fans.join(static_cast<int>(next(h)), static_cast<int>(twin->second));
    }
  SurfaceMesh sm;
  auto origin = origins(sm);
  std::map<int, std::pair<SurfaceMesh::Vertex_index, SurfaceMesh::Vertex_index>> vertices;
  const auto vertex = [&](std::size_t corner) {
    const int fan = fans.root(static_cast<int>(corner));
    const auto [at, added] = vertices.try_emplace(fan);
    if (added) {
      const int v = s.triangles[static_cast<std::size_t>(triangles[corner / 3])][corner % 3];
      const Vec3& x = s.vertices[static_cast<std::size_t>(v)];
      at->second = {sm.add_vertex(point(x)), sm.add_vertex(Point(x.x(), x.y(), z))};
    }
    return at->second;
  };
  const auto add = [&](auto a, auto b, auto c, int from) { origin[sm.add_face(a, b, c)] = from; };
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto a = vertex(3 * i), b = vertex(3 * i + 1), c = vertex(3 * i + 2);
    add(a.first, b.first, c.first, triangles[i]);
    add(a.second, c.second, b.second, of_walls);
  }
  for (const auto& [edge, h] : side)
    if (!side.contains({edge.second, edge.first})) {
      const auto a = vertex(h), b = vertex(next(h));
      add(b.first, a.first, a.second, of_walls);
      add(b.first, a.second, b.second, of_walls);
    }
  return sm;
}

SurfaceMesh body_of(const Mesh& mesh) {
  SurfaceMesh sm;
  origins(sm);
  std::vector<SurfaceMesh::Vertex_index> v;
  for (const Vec3& x : mesh.vertices) v.push_back(sm.add_vertex(point(x)));
  for (const auto& t : mesh.triangles)
    if (sm.add_face(v[static_cast<std::size_t>(t[0])], v[static_cast<std::size_t>(t[1])],
                    v[static_cast<std::size_t>(t[2])]) == SurfaceMesh::null_face())
      throw error("rock_mass.region", "", "its surface touches itself",
                  "give a region whose surface is one skin");
  return sm;
}

Mesh mesh_of(const SurfaceMesh& sm) {
  Mesh mesh;
  std::vector<int> number(sm.num_vertices() + sm.number_of_removed_vertices(), -1);
  for (const auto f : sm.faces()) {
    std::array<int, 3> t{};
    std::size_t k = 0;
    for (const auto v : sm.vertices_around_face(sm.halfedge(f))) {
      int& n = number[v.idx()];
      if (n < 0) {
        n = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(place(sm, v));
      }
      t[k++] = n;
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

/// Intersection and, if asked for, a without b.
void divide(SurfaceMesh& a, SurfaceMesh& b, SurfaceMesh& both, SurfaceMesh* rest) {
  origins(both);
  std::array<boost::optional<SurfaceMesh*>, 4> out;
  out[PMP::Corefinement::INTERSECTION] = &both;
  if (rest != nullptr) origins(*rest), out[PMP::Corefinement::TM1_MINUS_TM2] = rest;
  const auto refused = [](const std::string& why) {
    return error(
        "rock_mass", "", "it cannot be cut out of the ground: " + why,
        "move the region or the slip surface a little (a millimetre), so that they do not just touch "
        "the ground");
  };
  try {
    const auto done =
        PMP::corefine_and_compute_boolean_operations(a, b, out, CGAL::parameters::visitor(OriginVisitor()));
    if (!done[PMP::Corefinement::INTERSECTION] ||
        (rest != nullptr && !done[PMP::Corefinement::TM1_MINUS_TM2]))
      throw refused("what is left would touch itself in an edge");
  } catch (const CGAL::Failure_exception&) { throw refused("the surfaces cross or touch themselves"); }
}

/// The body above a slip surface, up to over all of the ground.
SurfaceMesh above_slip_surface(const TriangleSurface& slip, const TriangleSurface& ground) {
  double top = -std::numeric_limits<double>::infinity();
  for (const TriangleSurface* of : {&ground, &slip})
    for (const Vec3& x : of->vertices) top = std::max(top, x.z());
  std::vector<int> used(slip.triangles.size());
  std::iota(used.begin(), used.end(), 0);
  expect_facing_up(slip, used, "rock_mass.slip_surface", "the slip surface");
  // The body above it is what a surface that is mirrored in height has below it, mirrored back.
  TriangleSurface mirrored;
  mirrored.vertices = slip.vertices;
  for (Vec3& x : mirrored.vertices) x.z() = -x.z();
  mirrored.triangles = slip.triangles;
  SurfaceMesh body = down_to(mirrored, used, -(top + 1), "rock_mass.slip_surface");
  for (const auto v : body.vertices()) {
    const Point& p = body.point(v);
    body.point(v) = Point(p.x(), p.y(), -p.z());
  }
  PMP::reverse_face_orientations(body);
  auto origin = origins(body);
  for (const Face f : body.faces()) origin[f] = of_body;
  return body;
}

}  // namespace

TakenOut take_out(const TriangleSurface& ground, const TriangleSurface* slip, const Mesh* region, int bed) {
  SurfaceMesh tool = slip != nullptr ? above_slip_surface(*slip, ground) : body_of(*region);
  if (slip != nullptr && region != nullptr) {
    SurfaceMesh second = body_of(*region), both;
    divide(tool, second, both, nullptr);
    tool = std::move(both);
    if (tool.number_of_faces() == 0)
      throw error("rock_mass.slip_surface", "", "nothing of the region lies above it",
                  "give region or box, and the slip surface, in scene coordinates");
  }
  Box3 box;
  for (const auto v : tool.vertices()) box.extend(place(tool, v));
  const std::vector<int> near =
      within(ground, {Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>())});
  const auto nothing = [&] {
    return error("rock_mass",
                 fmt::format("x {:.6g} to {:.6g}, y {:.6g} to {:.6g}, z {:.6g} to {:.6g}", box.min().x(),
                             box.max().x(), box.min().y(), box.max().y(), box.min().z(), box.max().z()),
                 "lies nowhere below the terrain, out of which it is to be cut",
                 "give it in scene coordinates: map coordinates less site.origin");
  };
  if (near.empty()) throw nothing();
  expect_facing_up(ground, near, "site.terrain", "the terrain");
  double low = box.min().z();
  for (const int t : near)
    for (const int v : ground.triangles[static_cast<std::size_t>(t)])
      low = std::min(low, ground.vertices[static_cast<std::size_t>(v)].z());
  SurfaceMesh solid = down_to(ground, near, low - box.diagonal().norm(), "site.terrain"), mass, rest;
  divide(solid, tool, mass, &rest);
  if (mass.number_of_faces() == 0) throw nothing();

  TakenOut out{.mass = mesh_of(mass), .ground = {}};
  out.ground = ground;
  out.ground.triangles.clear();
  const auto material = [&](std::size_t t) {
    return ground.material.empty() ? ground.default_material : ground.material[t];
  };
  out.ground.material.clear();
  std::vector<char> replaced(ground.triangles.size(), 0);
  for (const int t : near) replaced[static_cast<std::size_t>(t)] = 1;
  for (std::size_t t = 0; t < ground.triangles.size(); ++t)
    if (!replaced[t]) {
      out.ground.triangles.push_back(ground.triangles[t]);
      out.ground.material.push_back(material(t));
    }
  std::map<std::array<double, 3>, int> number;  // by place: what was there keeps its vertices
  for (const int t : near)
    for (const int v : ground.triangles[static_cast<std::size_t>(t)]) {
      const Vec3& x = ground.vertices[static_cast<std::size_t>(v)];
      number.try_emplace({x.x(), x.y(), x.z()}, v);
    }
  const auto origin = origins(rest);
  for (const Face f : rest.faces()) {
    if (origin[f] == of_walls) continue;
    std::array<int, 3> t{};
    std::size_t k = 0;
    for (const auto v : rest.vertices_around_face(rest.halfedge(f))) {
      const Vec3 x = place(rest, v);
      const auto [at, added] =
          number.try_emplace({x.x(), x.y(), x.z()}, static_cast<int>(out.ground.vertices.size()));
      if (added) out.ground.vertices.push_back(x);
      t[k++] = at->second;
    }
    out.ground.triangles.push_back(t);
    out.ground.material.push_back(origin[f] == of_body ? bed : material(static_cast<std::size_t>(origin[f])));
  }
  ++out.ground.revision;
  return out;
}

}  // namespace talus::geometry

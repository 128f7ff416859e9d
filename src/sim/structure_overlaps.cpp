// Structures start clear of each other and, where nothing holds them, of the ground: a node that is built
// inside its partner meets none of its faces, and would go through.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "contact/geometry/surface_near.hpp"
#include "contact/structures/node_surface.hpp"
#include "coupling/ground/ground.hpp"
#include "coupling/touch/touch.hpp"
#include "sim/world.hpp"

namespace talus::sim {

namespace {

constexpr double touching =
    1e-6;  // depth over the edge of a face that is none: coordinates of mesh files are rounded

/// The surface of a structure where it was built, before any load.
struct Built {
  explicit Built(const StructureSkin& skin) : surface(skin.surface()) {
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
      const TriangleSurface::NodeWeights& w = surface.nodes[v];
      surface.vertices[v].setZero();
      for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
        surface.vertices[v] += w.weight[i] * skin.node_built(w.node[i]);
    }
    edge = coupling::face_edge(surface);
    normals.assign(surface.vertices.size(), Vec3::Zero());
    for (const auto& t : surface.triangles) {
      const auto at = [&](int i) -> const Vec3& {
        return surface.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])];
      };
      const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0));
      for (const int v : t) normals[static_cast<std::size_t>(v)] += normal;
    }
    for (Vec3& n : normals) n.normalize();
    for (const Vec3& x : surface.vertices) bounds.extend(x);
  }
  /// A vertex, moved into the body by so little that what merely touches lies outside of its partner.
  Vec3 within(std::size_t v) const { return surface.vertices[v] - touching * edge * normals[v]; }

  TriangleSurface surface;
  std::vector<Vec3> normals;  // at vertices, outward unit
  Box3 bounds;
  double edge = 0;  // of its faces [m]
};

struct Overlap {
  double depth = 0;  // [m]
  Vec3 at = Vec3::Zero();
};

/// Takes the deepest vertex of one surface that lies inside the other.
void deepest_inside(const Built& of, const Built& other, Overlap& most) {
  const contact::SurfaceIndex index(other.surface);
  for (std::size_t v = 0; v < of.surface.vertices.size(); ++v) {
    const Vec3& x = of.surface.vertices[v];
    contact::ContactPoint face;
    if (!other.bounds.contains(x) || !contact::encloses(index, of.within(v)) ||
        !contact::node_surface(index, of.within(v), Vec3::Zero(), other.bounds.diagonal().norm(), face))
      continue;
    if (-face.gap > most.depth) most = {-face.gap, x};
  }
}

Problem problem_of(const World& world, int structure, std::string rule, std::string remedy) {
  const StructureSpec& spec = world.scene.structures[static_cast<std::size_t>(structure)];
  Problem p;
  p.file = world.scene.file;
  p.key = fmt::format("structure.{}.{}", spec.name, spec.kind == "column" ? "base" : "position");
  p.rule = std::move(rule), p.remedy = std::move(remedy);
  return p;
}

}  // namespace

std::vector<Problem> structure_overlaps(const World& world) {
  std::vector<Problem> problems;
  const coupling::Environment& env = world.system->environment();
  const auto name = [&](int q) { return world.scene.structures[static_cast<std::size_t>(q)].name; };
  const auto skin = [&](int q) -> const StructureSkin& {
    return env.structures[static_cast<std::size_t>(q)].structure->skin();
  };
  for (const auto& [a, b] : env.touching_structures) {
    const Built first(skin(a)), second(skin(b));
    if (!first.bounds.intersects(second.bounds)) continue;
    Overlap most;
    deepest_inside(second, first, most);
    deepest_inside(first, second, most);
    if (most.depth == 0) continue;
    problems.push_back(
        problem_of(world, std::max(a, b),
                   fmt::format("it overlaps structure {} about ({:.6g}, {:.6g}, {:.6g}) at the start",
                               name(std::min(a, b)), most.at.x(), most.at.y(), most.at.z()),
                   "move them apart; touching is allowed. Parts of one body belong into one mesh"));
  }
  for (int q = 0; q < static_cast<int>(env.structures.size()); ++q) {
    const coupling::StructurePart& part = env.structures[static_cast<std::size_t>(q)];
    if (part.grounds.empty() || !world.scene.structures[static_cast<std::size_t>(q)].supports.empty())
      continue;
    const Built built(skin(q));
    for (const int k : part.grounds) {
      const coupling::Ground& ground = env.grounds[static_cast<std::size_t>(k)];
      Overlap most{touching * built.edge, Vec3::Zero()};
      bool in = false;
      for (const Vec3& x : built.surface.vertices)
        if (const double depth = coupling::depth_in(env, ground, x, built.bounds.diagonal().norm());
            depth > most.depth)
          most = {depth, x}, in = true;
      if (!in) continue;
      problems.push_back(problem_of(
          world, q,
          fmt::format(
              "nothing holds it, and it overlaps {} by {:.6g} m at ({:.6g}, {:.6g}, {:.6g}) at the start: it "
              "would sink through there",
              coupling::name_of(world.system->model(), ground), most.depth, most.at.x(), most.at.y(),
              most.at.z()),
          "move it out; touching is allowed. What stands in the ground needs supports"));
    }
  }
  return problems;
}

}  // namespace talus::sim

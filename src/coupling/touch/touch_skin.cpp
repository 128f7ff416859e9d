// Points on a structure's skin in terms of its nodes, and the touches of one skin with another.
#include <algorithm>
#include <array>
#include <cmath>

#include "contact/structures/node_surface.hpp"
#include "coupling/ground/ground.hpp"
#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {
namespace {

/// The face's mean plane goes with its nodes: what a bed's columns stand on.
SurfaceWeights plane_weights(const TriangleSurface& surface, int triangle, const Vec3& x) {
  const auto first = static_cast<std::size_t>(triangle - triangle % 4);
  std::array<const TriangleSurface::NodeWeights*, 4>
      nodes{};  // of the corners; one that hangs between larger faces goes with those
  Vec3 corner[4], centre = Vec3::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    const auto v = static_cast<std::size_t>(surface.triangles[first + k][0]);
    corner[k] = surface.vertices[v];
    nodes[k] = &surface.nodes[v];
    centre += 0.25 * corner[k];
  }
  // x in the plane of the diagonals: centre + a d + b e
  const Vec3 d = corner[2] - corner[0], e = corner[3] - corner[1], n = d.cross(e);
  const double a = n.dot((x - centre).cross(e)) / n.squaredNorm(),
               b = n.dot(d.cross(x - centre)) / n.squaredNorm();
  SurfaceWeights w;
  const std::array<double, 4> share{0.25 - a, 0.25 - b, 0.25 + a, 0.25 + b};
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t j = 0; j < static_cast<std::size_t>(nodes[k]->count); ++j) {
      const auto end = w.node.begin() + w.count, found = std::find(w.node.begin(), end, nodes[k]->node[j]);
      if (found == end)
        *end = nodes[k]->node[j],
        w.weight[static_cast<std::size_t>(w.count++)] = share[k] * nodes[k]->weight[j];
      else
        w.weight[static_cast<std::size_t>(found - w.node.begin())] += share[k] * nodes[k]->weight[j];
    }
  return w;
}

}  // namespace

/// x on the triangle by its corners. What lies beside it by more than round-off keeps its negative part:
/// forces there have their moment.
SurfaceWeights surface_weights(const TriangleSurface& surface, int triangle, const Vec3& x) {
  constexpr double round_off = 1e-13;
  const auto& t = surface.triangles[static_cast<std::size_t>(triangle)];
  const Vec3& a = surface.vertices[static_cast<std::size_t>(t[0])];
  const Vec3& b = surface.vertices[static_cast<std::size_t>(t[1])];
  const Vec3& c = surface.vertices[static_cast<std::size_t>(t[2])];
  const Vec3 n = (b - a).cross(c - a);
  const double area_sq = n.squaredNorm();
  Vec3 l(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x)));
  l /= area_sq;
  if (l.minCoeff() > -round_off) l = l.cwiseMax(0.0);
  l /= l.sum();
  SurfaceWeights w;
  for (int i = 0; i < 3; ++i) {
    const auto& nodes = surface.nodes[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])];
    for (int j = 0; j < nodes.count; ++j) {
      const int node = nodes.node[static_cast<std::size_t>(j)];
      const double weight = l[i] * nodes.weight[static_cast<std::size_t>(j)];
      auto* end = w.node.begin() + w.count;
      auto* found = std::find(w.node.begin(), end, node);
      if (found == end) {
        *end = node;
        w.weight[static_cast<std::size_t>(w.count++)] = weight;
      } else {
        w.weight[static_cast<std::size_t>(found - w.node.begin())] += weight;
      }
    }
  }
  return w;
}

std::array<Vec3, 12> weight_gradients(const TriangleSurface& surface, int triangle, const SurfaceWeights& w) {
  const auto& t = surface.triangles[static_cast<std::size_t>(triangle)];
  const auto corner = [&](std::size_t k) -> const Vec3& {
    return surface.vertices[static_cast<std::size_t>(t[k % 3])];
  };
  const Vec3 n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  std::array<Vec3, 12> gradients;
  gradients.fill(Vec3::Zero());
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 of_corner = n.cross(corner(k + 2) - corner(k + 1)) / n.squaredNorm();
    const auto& nodes = surface.nodes[static_cast<std::size_t>(t[k])];
    for (int j = 0; j < nodes.count; ++j) {
      const auto* found =
          std::find(w.node.begin(), w.node.begin() + w.count, nodes.node[static_cast<std::size_t>(j)]);
      gradients[static_cast<std::size_t>(found - w.node.begin())] +=
          nodes.weight[static_cast<std::size_t>(j)] * of_corner;
    }
  }
  return gradients;
}

SurfaceWeights skin_weights(const Touch& t, const TriangleSurface& surface, const Vec3& x) {
  return t.normal_law.bed ? plane_weights(surface, t.at.face_a, x) : surface_weights(surface, t.at.face_a, x);
}

double face_edge(const TriangleSurface& skin, int triangle) {
  const auto& t = skin.triangles[static_cast<std::size_t>(triangle)];
  const Vec3& a = skin.vertices[static_cast<std::size_t>(t[0])];
  return std::sqrt(2 * (skin.vertices[static_cast<std::size_t>(t[1])] - a)
                           .cross(skin.vertices[static_cast<std::size_t>(t[2])] - a)
                           .norm());
}

double face_edge(const TriangleSurface& skin) {
  double edge = 0;
  for (int t = 0; t < static_cast<int>(skin.triangles.size()); t += 4)
    edge = std::max(edge, face_edge(skin, t));
  return edge;
}

void find_surface_touches(const Environment& env, const SurfacePair& pair, double reach,
                          const ContactHistory& history, std::vector<Touch>& out) {
  const bool structure = pair.a.kind == Partner::Kind::structure;
  const StructurePart* part_a = structure ? &env.structures[static_cast<std::size_t>(pair.a.index)] : nullptr;
  const Ground* ground = structure ? nullptr : &ground_of(env, pair.a);
  const StructurePart& part_b = env.structures[static_cast<std::size_t>(pair.b)];
  const TriangleSurface& skin = part_b.index->surface();
  thread_local std::vector<int> near;
  if (structure)
    contact::nodes_near(*part_b.index, *part_a->index, reach, near);
  else
    nodes_near(env, *ground, *part_b.index, reach, near);
  for (const int vertex : near) {
    const auto v = static_cast<std::size_t>(vertex);
    const Vec3 tributary = contact::tributary_area(*part_b.index, vertex);
    Touch t;
    t.b_node = skin.nodes[v].node[0];
    if (structure
            ? !contact::node_surface(*part_a->index, skin.vertices[v], tributary.normalized(), reach, t.at)
            : !node_ground(env, *ground, *part_b.structure, t.b_node, skin.vertices[v],
                           tributary.normalized(), reach, t.at))
      continue;
    t.a = pair.a;
    t.b = -1;
    t.b_structure = pair.b;
    // Of an edge or corner node only what faces the partner.
    t.at.area = std::max(0.0, -t.at.normal.dot(tributary));
    t.at.key = static_cast<contact::FeatureKey>(t.b_node);
    t.law =
        &env.laws(structure ? part_a->material : ground_material(env, *ground, t.at.face_a), part_b.material);
    const ContactMemory* last = recall(history[static_cast<std::size_t>(pair.b)], pair.a.id(), t);
    const double share = t.law->stiffness == ContactLaw::Stiffness::per_area ? t.at.area : 1.0;
    double cell = part_b.structure->skin().young() * std::sqrt(tributary.norm());
    if (structure)
      cell = std::min(part_a->structure->skin().young() * face_edge(part_a->index->surface(), t.at.face_a),
                      cell);
    const double mass = part_b.structure->skin().node_mass(t.b_node);
    t.approach = t.at.normal.dot(part_b.structure->skin().node_velocity(t.b_node) -
                                 (structure ? partner_velocity({}, env, t) : Vec3(Vec3::Zero())));
    if (!gives_less_than_cell(*t.law, t.law->normal_stiffness * share, cell))
      set_spring(t, {mass, 0, std::sqrt(tributary.norm())}, {t.at.area, {}},
                 last != nullptr ? last->crushed : 0.0);
    hold_on(t, last, false);
    if (t.stiffness > 0 && t.law->damping_ratio > 0)
      t.dashpot = 2 * t.law->damping_ratio * std::sqrt(t.stiffness * mass);
    out.push_back(t);
  }
}

}  // namespace talus::coupling

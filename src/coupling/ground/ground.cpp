#include "coupling/ground/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "contact/geometry/surface_near.hpp"
#include "contact/structures/node_surface.hpp"
#include "contact/tolerances.hpp"
#include "coupling/touch/touch.hpp"
#include "dda/kinematics.hpp"

namespace talus::coupling {
namespace {

const Plane& plane_of(const Environment& env, const Ground& ground) {
  return env.planes[static_cast<std::size_t>(ground.partner.index)];
}

/// The nearest point of the ground, outside within `margin`; inside a plane however deep.
bool nearest(const Environment& env, const Ground& ground, const Vec3& x, const Vec3& outward, double margin,
             contact::ContactPoint& out) {
  if (ground.faces) return contact::node_surface(*ground.faces, x, outward, margin, out);
  const Plane& plane = plane_of(env, ground);
  const double gap = plane.normal.dot(x - plane.point);
  if (gap > margin || (!outward.isZero(0) && plane.normal.dot(outward) > contact::node_faces)) return false;
  out.gap = gap;
  out.normal = plane.normal;
  out.point_b = x;
  out.point_a = x - gap * plane.normal;
  out.face_a = out.face_b = -1;
  return true;
}

/// Whether a node that is at x, found at `at`, was built into the ground.
bool founded(const Environment& env, const Ground& ground, const Vec3& built, const contact::ContactPoint& at,
             double margin) {
  contact::ContactPoint before;
  return nearest(env, ground, built, -at.normal, 2 * margin + (built - at.point_b).norm(), before) &&
         before.gap < -contact::tolerances().overlap_none * margin;
}

}  // namespace

std::vector<Ground> grounds_of(const Environment& env, const dda::Model& model, const dda::State& state) {
  std::vector<Ground> grounds;
  for (std::size_t k = 0; k < env.planes.size(); ++k)
    grounds.push_back({{Partner::Kind::plane, static_cast<int>(k)}, nullptr});
  if (env.terrain) grounds.push_back({{Partner::Kind::terrain, 0}, env.terrain});
  for (std::size_t k = 0; k < model.blocks.size(); ++k) {
    if (model.blocks[k].ndof() > 0) continue;
    const Polyhedron& shape = *model.blocks[k].shape;
    const Pose pose = dda::pose(state, static_cast<int>(k));
    TriangleSurface faces;
    for (const Vec3& x : shape.vertices) faces.vertices.emplace_back(pose.c + pose.F * x);
    faces.triangles = shape.triangles;
    faces.default_material = model.blocks[k].material;
    grounds.push_back(
        {{Partner::Kind::block, static_cast<int>(k)}, std::make_shared<const contact::SurfaceIndex>(faces)});
  }
  return grounds;
}

const Ground& ground_of(const Environment& env, const Partner& partner) {
  return *std::ranges::find(env.grounds, partner, &Ground::partner);
}

int ground_material(const Environment& env, const Ground& ground, int face) {
  if (!ground.faces) return plane_of(env, ground).material;
  const TriangleSurface& s = ground.faces->surface();
  return face >= 0 && !s.material.empty() ? s.material[static_cast<std::size_t>(face)] : s.default_material;
}

std::string name_of(const dda::Model& model, const Ground& ground) {
  switch (ground.partner.kind) {
    case Partner::Kind::plane: return fmt::format("plane {}", ground.partner.index + 1);
    case Partner::Kind::terrain: return "the terrain";
    default: break;
  }
  return "the fixed block " + model.blocks[static_cast<std::size_t>(ground.partner.index)].name;
}

double depth_in(const Environment& env, const Ground& ground, const Vec3& x, double most) {
  contact::ContactPoint at;
  if (ground.partner.kind == Partner::Kind::block && !contact::encloses(*ground.faces, x)) return 0;
  return nearest(env, ground, x, Vec3::Zero(), most, at) ? std::max(0.0, -at.gap) : 0.0;
}

bool reaches(const Environment& env, const Ground& ground, const Box3& box) {
  if (ground.faces) return ground.faces->overlaps(box);
  const Plane& plane = plane_of(env, ground);
  return plane.normal.dot(box.center() - plane.point) <= plane.normal.cwiseAbs().dot(0.5 * box.sizes());
}

void nodes_near(const Environment& env, const Ground& ground, const contact::SurfaceIndex& nodes,
                double reach, std::vector<int>& vertices) {
  if (ground.faces) return contact::nodes_near(nodes, *ground.faces, reach, vertices);
  const TriangleSurface& skin = nodes.surface();
  const Plane& plane = plane_of(env, ground);
  constexpr double far = std::numeric_limits<double>::infinity();
  contact::near_vertices(nodes, Box3(Vec3::Constant(-far), Vec3::Constant(far)), vertices);
  std::erase_if(vertices, [&](int v) {
    return skin.nodes[static_cast<std::size_t>(v)].count != 1 ||
           plane.normal.dot(skin.vertices[static_cast<std::size_t>(v)] - plane.point) > reach;
  });
}

bool node_ground(const Environment& env, const Ground& ground, const Structure& structure, int node,
                 const Vec3& x, const Vec3& outward, double margin, contact::ContactPoint& out) {
  return nearest(env, ground, x, outward, margin, out) && std::isfinite(structure.skin().node_mass(node)) &&
         !founded(env, ground, structure.skin().node_built(node), out, margin);
}

bool may_come_to(const Environment& env, const Ground& ground, const Structure& structure, double reach) {
  const TriangleSurface& skin = structure.skin().surface();
  if (skin.triangles.empty()) return false;
  const double edge = face_edge(skin, 0), margin = std::max(reach, 0.5 * edge);  // what has sunk in stays
  reach += contact::tolerances().structure_near * edge;                          // and what rests there
  Box3 box;
  for (const Vec3& x : skin.vertices) box.extend(x);
  box.min().array() -= margin;
  box.max().array() += margin;
  if (!reaches(env, ground, box)) return false;
  for (std::size_t v = 0; v < skin.vertices.size(); ++v) {
    if (skin.nodes[v].count != 1) continue;
    const int node = skin.nodes[v].node[0];
    const Vec3& x = skin.vertices[v];
    const Box3 here(x.array() - margin, x.array() + margin);
    if (!reaches(env, ground, here) || !std::isfinite(structure.skin().node_mass(node))) continue;
    if (contact::ContactPoint at; nearest(env, ground, x, Vec3::Zero(), margin, at) && at.gap <= reach &&
                                  !founded(env, ground, structure.skin().node_built(node), at, margin))
      return true;
  }
  return false;
}

}  // namespace talus::coupling

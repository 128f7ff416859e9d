// Nothing may overlap at the start by more than 1e-9 of the block size; no block lies inside a structure, no
// structure in a block.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "contact/narrow/narrow_math.hpp"
#include "coupling/touch/touch.hpp"
#include "geometry/cut.hpp"
#include "geometry/free_path.hpp"
#include "sim/rock_mass.hpp"
#include "sim/world.hpp"

namespace talus::sim {

namespace {

constexpr double touching = 1e-9;  // overlap over the block's size that is none

/// To the next millimetre, so that what is read off is enough.
double round_up(double x) { return std::ceil(1e3 * x + 1e-6) / 1e3; }

/// How far the face of a structure's surface that a touch lies on has moved from where the scene has it [m].
double displaced(const World& world, int structure, int triangle) {
  const std::vector<double>& moved = world.displaced[static_cast<std::size_t>(structure)];
  if (moved.empty()) return 0;
  const TriangleSurface& skin =
      world.system->environment().structures[static_cast<std::size_t>(structure)].index->surface();
  double most = 0;
  for (const int v : skin.triangles[static_cast<std::size_t>(triangle)]) {
    const TriangleSurface::NodeWeights& nodes = skin.nodes[static_cast<std::size_t>(v)];
    for (int i = 0; i < nodes.count; ++i)
      most = std::max(most, moved[static_cast<std::size_t>(nodes.node[static_cast<std::size_t>(i)])]);
  }
  return most;
}

/// The deepest corner, or the middle, of what of a triangle lies in a convex block, clipped by its faces; a
/// depth of 0 if nothing does [m]. Axes of the block.
double deepest_part(const Polyhedron& block, const std::array<Vec3, 3>& triangle, Vec3& at) {
  std::vector<contact::narrow::ClipVertex> part, kept;
  for (const Vec3& x : triangle) part.push_back({x, 0, 0});
  const auto on = [&](std::size_t face) -> const Vec3& {
    return block.vertices[static_cast<std::size_t>(
        block.face_vertices[static_cast<std::size_t>(block.face_offset[face])])];
  };
  for (std::size_t face = 0; face < block.face_normals.size() && !part.empty(); ++face) {
    contact::narrow::clip_half_space(part, on(face), block.face_normals[face], 0, 0, kept);
    part.swap(kept);
  }
  Vec3 middle = Vec3::Zero();
  for (const auto& v : part) middle += v.x / static_cast<double>(part.size());
  if (!part.empty()) part.push_back({middle, 0, 0});
  double deepest = 0;
  for (const auto& v : part) {
    double depth = std::numeric_limits<double>::infinity();
    for (std::size_t face = 0; face < block.face_normals.size(); ++face)
      depth = std::min(depth, block.face_normals[face].dot(on(face) - v.x));
    if (depth > deepest) deepest = depth, at = v.x;
  }
  return deepest;
}

/// Of a convex block that a structure's surface passes through, edges across edges included, which touch by
/// no corner: how deep, and where. As far as the surface has moved from where it was built it may [m].
double passes_through(const World& world, int structure, int block, double allowed, Vec3& where) {
  const Polyhedron& shape = *world.system->model().blocks[static_cast<std::size_t>(block)].shape;
  if (!shape.convex) return 0;
  const Pose pose = dda::pose(world.system->state().blocks, block);
  const Box3 box = contact::bounds(shape, pose, 0);
  const Mat3 inverse = pose.F.inverse();
  const TriangleSurface& skin =
      world.system->environment().structures[static_cast<std::size_t>(structure)].index->surface();
  double deepest = 0;
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    std::array<Vec3, 3> corner;
    Box3 about;
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = skin.vertices[static_cast<std::size_t>(skin.triangles[t][k])];
      about.extend(corner[k]);
      corner[k] = inverse * (corner[k] - pose.c);
    }
    if (!about.intersects(box)) continue;
    Vec3 at;
    const double depth = deepest_part(shape, corner, at);
    if (depth > deepest && depth > allowed + displaced(world, structure, static_cast<int>(t)))
      deepest = depth, where = pose.c + pose.F * at;
  }
  return deepest;
}

/// How far a touch has the block moved upwards until it is none [m]; 0 where the partner does not bear it.
double raise_of(const coupling::Touch& t) {
  constexpr double steepest = 0.05;  // n_z: along a face steeper than that a block is moved aside
  return t.at.normal.z() > steepest ? (t.offset - t.at.gap) / t.at.normal.z() : 0.0;
}

/// Blocks cut from the rock mass that reach into the ground: one fault of its region, not one of each.
struct Buried {
  int blocks = 0;
  double deepest = 0;  // [m]
  std::string name;    // of the deepest
  Vec3 where = Vec3::Zero();

  void add(const std::string& block, double depth, const Vec3& at) {
    if (++blocks == 1 || depth > deepest) deepest = depth, name = block, where = at;
  }
  Problem problem(const scene::Scene& scene) const {
    return {
        .file = scene.file,
        .key = "rock_mass",
        .value = {},
        .rule = fmt::format("{} of its blocks overlap the ground at the start, {} the most, by {:.6g} m at "
                            "({:.6g}, {:.6g}, {:.6g})",
                            blocks, name, deepest, where.x(), where.y(), where.z()),
        .remedy = scene.rock_mass->from_terrain
                      ? "shift the slip surface, or the origins of the joint sets, by a centimetre"
                  : scene.site && scene.site->given()
                      ? "from_terrain = true cuts the region out of the terrain; else end it at the ground"
                      : "end the region at the ground"};
  }
};

/// Blocks that one structure's surface has moved into.
struct MovedInto {
  int blocks = 0;
  double deepest = 0;  // [m]
  std::string first;
};

}  // namespace

std::vector<Problem> initial_overlaps(World& world, const coupling::KnownPairs& known) {
  coupling::CoupledSystem& system = *world.system;
  std::vector<Problem> problems;
  const dda::Model& model = system.model();
  const coupling::SystemState& state = system.state();
  const int n = static_cast<int>(model.blocks.size());
  std::vector<Box3> boxes;
  for (int i = 0; i < n; ++i)
    boxes.push_back(
        contact::bounds(*model.blocks[static_cast<std::size_t>(i)].shape, dda::pose(state.blocks, i), 0));
  std::vector<std::pair<int, int>> pairs;
  contact::overlapping_pairs(boxes, pairs);
  std::vector<coupling::CandidatePair> candidates;
  using Kind = coupling::Partner::Kind;
  for (const auto& [i, j] : pairs) {
    const bool moves_i = model.blocks[static_cast<std::size_t>(i)].ndof() > 0,
               moves_j = model.blocks[static_cast<std::size_t>(j)].ndof() > 0;
    if (moves_i || moves_j) candidates.push_back({{Kind::block, moves_j ? i : j}, moves_j ? j : i});
  }
  const coupling::Environment& env = system.environment();
  for (int i = 0; i < n; ++i) {
    if (model.blocks[static_cast<std::size_t>(i)].ndof() == 0) continue;
    for (std::size_t q = 0; q < env.planes.size(); ++q)
      candidates.push_back({{Kind::plane, static_cast<int>(q)}, i});
    if (env.terrain && env.terrain->overlaps(boxes[static_cast<std::size_t>(i)]))
      candidates.push_back({{Kind::terrain, 0}, i});
    for (std::size_t q = 0; q < env.structures.size(); ++q)
      if (boxes[static_cast<std::size_t>(i)].intersects(env.structures[q].index->bounds()))
        candidates.push_back({{Kind::structure, static_cast<int>(q)}, i});
  }
  const bool offsets =
      world.scene.simulation.method == scene::Simulation::Method::talus;  // the other keeps none
  std::vector<MovedInto> moved_into(env.structures.size());
  Buried buried;
  std::vector<coupling::Touch> touches;
  for (const coupling::CandidatePair& c : candidates) {
    if (known && known(c)) continue;
    touches.clear();
    coupling::find_touches(model, state.blocks, env, c, 0, state.contacts, touches);
    double deepest = 0, raise = 0;
    Vec3 where = Vec3::Zero(), away = Vec3::Zero();
    const dda::Model::Block& b = model.blocks[static_cast<std::size_t>(c.b)];
    const bool of_mass = is_cut_from_mass(world.scene, b.name);
    // Faces of a block cut out of the terrain are the terrain's own, but for what makes a plane of several.
    const bool in_hollow =
        c.a.kind == Kind::terrain && world.scene.rock_mass && world.scene.rock_mass->from_terrain && of_mass;
    const double allowed = (in_hollow ? geometry::one_plane : touching) * 2 * b.shape->radius;
    if (in_hollow && offsets) start_touching(system, c, touches);
    bool moved_in = offsets && c.a.kind == Kind::structure;
    for (const coupling::Touch& t : touches) {
      const double depth = t.offset - t.at.gap;
      moved_in =
          moved_in && (depth <= allowed || depth <= allowed + displaced(world, c.a.index, t.at.face_a));
      raise = std::max(raise, raise_of(t));
      if (depth > deepest) {
        deepest = depth;
        where = t.at.point_b;
        away = deepest * t.at.normal.unaryExpr([](double n) { return std::abs(n) < 1e-6 ? 0.0 : n; });
      }
    }
    bool inside = false;
    if (c.a.kind == Kind::structure && touches.empty()) {
      inside =
          geometry::one_inside_other(*b.shape, dda::pose(state.blocks, c.b),
                                     env.structures[static_cast<std::size_t>(c.a.index)].index->surface());
      where = state.blocks.c[static_cast<std::size_t>(c.b)];
    }
    if (!inside && deepest <= allowed && c.a.kind == Kind::structure) {
      deepest = passes_through(world, c.a.index, c.b, allowed, where);
      moved_in = false;
    }
    if (!inside && deepest <= allowed) continue;
    if (!inside && moved_in) {
      start_touching(system, c, touches);
      MovedInto& m = moved_into[static_cast<std::size_t>(c.a.index)];
      if (m.blocks++ == 0) m.first = b.name;
      m.deepest = std::max(m.deepest, deepest);
      continue;
    }
    const bool ground = c.a.kind == Kind::terrain || c.a.kind == Kind::plane;
    if (ground && of_mass) {
      buried.add(b.name, deepest, where);
      continue;
    }
    std::string other;
    switch (c.a.kind) {
      case Kind::block: other = "block " + model.blocks[static_cast<std::size_t>(c.a.index)].name; break;
      case Kind::plane: other = fmt::format("plane {}", c.a.index + 1); break;
      case Kind::terrain: other = "the terrain"; break;
      case Kind::structure:
        other = "structure " + world.scene.structures[static_cast<std::size_t>(c.a.index)].name;
        break;
    }
    Problem p;
    const Vec3& at = state.blocks.c[static_cast<std::size_t>(c.b)];
    p.file = world.scene.file;
    p.key = fmt::format("block.{}.position", b.name);
    p.value = fmt::format("[{:g}, {:g}, {:g}]", at.x(), at.y(), at.z());
    p.rule = fmt::format("it overlaps {} by {:.6g} m at ({:.6g}, {:.6g}, {:.6g}) at the start", other,
                         deepest, where.x(), where.y(), where.z());
    if (inside) p.rule = fmt::format("it and {} lie one inside the other at the start", other);
    if (inside)
      p.remedy = "move it out";
    else if (ground && raise > 0)
      p.remedy = fmt::format(
          "raise it by {:.3g} m or more, to z = {:.6g}; touching (up to 1e-9 of its size) is allowed",
          round_up(raise), at.z() + round_up(raise));
    else
      p.remedy = away.isZero() ? "move it out"
                               : fmt::format(
                                     "move it by [{:.3g}, {:.3g}, {:.3g}] m or farther; touching (up to 1e-9 "
                                     "of its size) is allowed",
                                     away.x(), away.y(), away.z());
    problems.push_back(std::move(p));
  }
  if (buried.blocks > 0) problems.push_back(buried.problem(world.scene));
  for (std::size_t q = 0; q < moved_into.size(); ++q)
    if (const MovedInto& m = moved_into[q]; m.blocks > 0)
      world.report(fmt::format(
          "structure {}: {} moved its surface into {} by up to {:.3g} m; they touch at the start",
          world.scene.structures[q].name, known ? "the run before" : "gravity preload",
          m.blocks == 1 ? "block " + m.first : fmt::format("{} blocks, {} among them,", m.blocks, m.first),
          m.deepest));
  return problems;
}

double raise_above_ground(const World& world, int block, const Pose& pose) {
  using Kind = coupling::Partner::Kind;
  const coupling::CoupledSystem& system = *world.system;
  const coupling::Environment& env = system.environment();
  const dda::Model& model = system.model();
  const auto k = static_cast<std::size_t>(block);
  dda::State state = system.state().blocks;
  state.c[k] = pose.c;
  state.q[k] = Quat(pose.F);
  state.eps[k].setZero();
  const coupling::ContactHistory nothing_before(state.c.size());
  constexpr int most = 20;  // a raised block may meet another face of terrain
  for (int pass = 0; pass < most; ++pass) {
    const Box3 box = contact::bounds(*model.blocks[k].shape, dda::pose(state, block), 0);
    std::vector<coupling::CandidatePair> grounds;
    for (std::size_t q = 0; q < env.planes.size(); ++q)
      grounds.push_back({{Kind::plane, static_cast<int>(q)}, block});
    if (env.terrain && env.terrain->overlaps(box)) grounds.push_back({{Kind::terrain, 0}, block});
    for (int other = 0; other < state.size(); ++other)
      if (model.blocks[static_cast<std::size_t>(other)].ndof() == 0 &&
          box.intersects(contact::bounds(*model.blocks[static_cast<std::size_t>(other)].shape,
                                         dda::pose(state, other), 0)))
        grounds.push_back({{Kind::block, other}, block});
    std::vector<coupling::Touch> touches;
    for (const coupling::CandidatePair& pair : grounds)
      coupling::find_touches(model, state, env, pair, 0, nothing_before, touches);
    double raise = 0;
    for (const coupling::Touch& t : touches) raise = std::max(raise, raise_of(t));
    if (raise <= touching * model.blocks[k].shape->radius) break;
    state.c[k].z() += raise;
  }
  return state.c[k].z() - pose.c.z();
}

}  // namespace talus::sim

#include "coupling/touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "contact/impact_damping.hpp"
#include "contact/node_surface.hpp"
#include "contact/skin_block.hpp"
#include "coupling/touch_bed.hpp"

namespace talus::coupling {

Mat3 contact_frame(const Vec3& n) {
  // The axis least aligned with n gives the first tangent; the choice depends on n alone.
  int k = 0;
  n.cwiseAbs().minCoeff(&k);
  Vec3 e = Vec3::Zero();
  e[k] = 1;
  Mat3 f;
  f.col(0) = n;
  f.col(1) = n.cross(e).normalized();
  f.col(2) = n.cross(f.col(1));
  return f;
}

Vec3 point_velocity(const dda::State& s, int block, const Vec3& x) {
  const auto k = static_cast<std::size_t>(block);
  Vec3 v = s.v[k] + s.w[k].cross(x - s.c[k]);
  if (!s.eps_rate[k].isZero(0)) {
    const Mat3 r = s.rotation(block);
    const Vec3 X = dda::pose(s, block).F.inverse() * (x - s.c[k]);
    v += r * (dda::strain_tensor(s.eps_rate[k]) * X);
  }
  return v;
}

SurfaceWeights surface_weights(const TriangleSurface& surface, int triangle, const Vec3& x) {
  const auto& t = surface.triangles[static_cast<std::size_t>(triangle)];
  const Vec3& a = surface.vertices[static_cast<std::size_t>(t[0])];
  const Vec3& b = surface.vertices[static_cast<std::size_t>(t[1])];
  const Vec3& c = surface.vertices[static_cast<std::size_t>(t[2])];
  const Vec3 n = (b - a).cross(c - a);
  const double area_sq = n.squaredNorm();
  Vec3 l(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x)));
  l /= area_sq;
  l = l.cwiseMax(0.0);
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

double Touch::bond() const {
  if (!glued || broken) return 0;
  const double tension = law->tension + bond_tension, cohesion = law->cohesion + bond_cohesion;
  return at.area * (law->friction > 0 ? std::min(tension, cohesion / law->friction) : tension);
}

Vec3 partner_velocity(const dda::State& s, const Environment& env, const Partner& a, const contact::ContactPoint& at) {
  if (a.kind == Partner::Kind::block) return point_velocity(s, a.index, at.point_a);
  if (a.kind == Partner::Kind::structure) {
    const StructurePart& part = env.structures[static_cast<std::size_t>(a.index)];
    if (part.fixed_surface) return Vec3::Zero();
    const SurfaceWeights w = surface_weights(part.index->surface(), at.face_a, at.point_a);
    Vec3 v = Vec3::Zero();
    for (int i = 0; i < w.count; ++i)
      v += w.weight[static_cast<std::size_t>(i)] * part.structure->node_velocity(w.node[static_cast<std::size_t>(i)]);
    return v;
  }
  return Vec3::Zero();
}

namespace {

int material_of(const dda::Model& m, const Environment& env, const Partner& a, int face) {
  switch (a.kind) {
    case Partner::Kind::block: return m.blocks[static_cast<std::size_t>(a.index)].material;
    case Partner::Kind::plane: return env.planes[static_cast<std::size_t>(a.index)].material;
    case Partner::Kind::terrain: {
      const TriangleSurface& s = env.terrain->surface();
      if (face >= 0 && !s.material.empty()) return s.material[static_cast<std::size_t>(face)];
      return s.default_material;
    }
    case Partner::Kind::structure: return env.structures[static_cast<std::size_t>(a.index)].material;
  }
  return 0;
}

void take_over(const ContactMemory& memory, Touch& t) {
  t.warm = memory.force;
  t.shear = memory.shear - t.at.normal * t.at.normal.dot(memory.shear);
  t.stored = memory.normal_energy + memory.shear_energy;
  t.broken = memory.broken;
  t.glued = memory.glued;
  t.persistent = !memory.force.isZero(0);
}

/// A new contact of a pair that is glued elsewhere is part of the bond: it holds as well.
bool glued_elsewhere(const std::vector<ContactMemory>& memory, std::uint64_t partner) {
  return std::any_of(memory.begin(), memory.end(), [&](const ContactMemory& m) { return m.partner == partner && m.glued; });
}

/// What the contact remembers, null: it is new.
const ContactMemory* recall(const std::vector<ContactMemory>& memory, std::uint64_t partner, Touch& t) {
  const auto found = std::lower_bound(memory.begin(), memory.end(), std::pair(partner, t.at.key),
                                      [](const ContactMemory& c, const std::pair<std::uint64_t, std::uint64_t>& key) {
                                        return c.partner != key.first ? c.partner < key.first : c.feature < key.second;
                                      });
  if (found == memory.end() || found->partner != partner || found->feature != t.at.key) return nullptr;
  take_over(*found, t);
  return &*found;
}

/// A spring at a structure goes on where it was, whatever became of its point: where the place of a contact on the skin jumps (a node that
/// comes to be covered, a stiffness that changes with the place in the cell), the energy stored stays. A new one that is inside already
/// starts unloaded. `grows`: its area grows from nothing, so that nothing jumps.
void hold_on(Touch& t, const ContactMemory* last, bool grows) {
  if (t.stiffness == 0 || t.law->kind == ContactLaw::Kind::crushing || t.law->kind == ContactLaw::Kind::table) return;
  double indentation = std::max(0.0, -t.at.gap);
  if (last != nullptr && last->indentation > 0) {
    const bool point = t.at.area == 0 && t.law->kind == ContactLaw::Kind::linear;
    indentation = last->indentation * (point ? std::sqrt(last->stiffness / t.stiffness) : 1.0);
  } else if (!grows) {
    indentation = 0;
  }
  if (indentation == 0 && t.at.gap >= 0) return;
  t.offset += -indentation - t.at.gap;
  t.at.gap = -indentation;
}

/// What a trilinear cell gives under a force at one point of its face beyond what the continuum does: a node of the face
/// 1.60/(E h), its centre 0.54/(E h), in between by the sum of the squared weights (1 and 1/4) [m/N].
double cell_compliance(const StructurePart& part, const contact::ContactPoint& at) {
  if (part.fixed_surface || at.face_a < 0) return 0;
  const TriangleSurface& s = part.index->surface();
  const SurfaceWeights w = surface_weights(s, at.face_a, at.point_a);
  double squares = 0;
  for (int i = 0; i < w.count; ++i) squares += w.weight[static_cast<std::size_t>(i)] * w.weight[static_cast<std::size_t>(i)];
  return (0.54 + (squares - 0.25) / 0.75 * (1.60 - 0.54)) / (part.structure->young() * face_edge(s, at.face_a));
}

/// A pair that was born overlapping and has not parted since: what lies inside is hard contact from where it is, so that nothing is pushed
/// apart and no spring starts loaded.
void spare_newborn(std::span<Touch> touches, const std::vector<ContactMemory>& memory, std::uint64_t partner) {
  const auto found = std::find_if(memory.begin(), memory.end(), [&](const ContactMemory& m) { return m.partner == partner && m.feature == born_inside; });
  if (found == memory.end()) return;
  for (Touch& t : touches) {
    if (t.at.gap >= 0) continue;
    t.offset = -t.at.gap;
    t.at.gap = 0;
    t.stiffness = t.shear_stiffness = t.dashpot = 0;
  }
}

/// Springs of a block at a structure go on from the last step, also under another name: a feature that has just appeared inside takes over
/// from the nearest one within `reach` that has just vanished.
void go_on(std::span<Touch> touches, std::vector<const ContactMemory*>& last, const std::vector<ContactMemory>& memory, std::uint64_t partner, double reach) {
  std::vector<const ContactMemory*> lost;
  bool flat_before = false;   // a face lay on the skin in the last step
  for (const ContactMemory& m : memory) {
    if (m.partner != partner) continue;
    flat_before = flat_before || (m.feature >> 60) == 7;
    if (m.indentation > 0 && std::find(last.begin(), last.end(), &m) == last.end()) lost.push_back(&m);
  }
  for (std::size_t i = 0; i < touches.size(); ++i) {
    Touch& t = touches[i];
    if (last[i] == nullptr && t.at.gap < 0 && !lost.empty()) {
      const auto nearest = std::min_element(lost.begin(), lost.end(), [&](const ContactMemory* a, const ContactMemory* b) {
        return (a->place - t.at.point_a).squaredNorm() < (b->place - t.at.point_a).squaredNorm();
      });
      if (((*nearest)->place - t.at.point_a).norm() < reach) {
        last[i] = *nearest;
        take_over(**nearest, t);
        lost.erase(nearest);
      }
    }
    hold_on(t, last[i], t.at.area > 0 && flat_before && t.law->stiffness == ContactLaw::Stiffness::per_area);
  }
}

/// Joint of the rock mass that a block-block contact lies on, -1 if none.
int joint_of(const dda::Model& m, const CandidatePair& pair, const contact::ContactPoint& p) {
  const auto of = [](const Polyhedron& shape, int face) {
    if (face < 0 || shape.face_joint_set.empty()) return -1;
    return shape.face_joint_set[static_cast<std::size_t>(face)];
  };
  const int a = of(*m.blocks[static_cast<std::size_t>(pair.a.index)].shape, p.face_a);
  const int b = of(*m.blocks[static_cast<std::size_t>(pair.b)].shape, p.face_b);
  if (a >= 0 && b >= 0 && a != b) return -1;   // they no longer lie on the joint that parted them
  return a >= 0 ? a : b;
}

const Bond* find_bond(const Environment& env, const CandidatePair& pair, int joint) {
  const int a = std::min(pair.a.index, pair.b), b = std::max(pair.a.index, pair.b);
  const auto key = std::array<int, 3>{a, b, joint};
  const auto at = std::lower_bound(env.bonds.begin(), env.bonds.end(), key, [](const Bond& x, const std::array<int, 3>& k) {
    return std::array<int, 3>{x.a, x.b, x.joint} < k;
  });
  return at != env.bonds.end() && at->a == a && at->b == b && at->joint == joint ? &*at : nullptr;
}

/// Mass that a contact of the pair stops: the two blocks in series, the one if its partner is held or a structure [kg].
double mass_in_series(const dda::Model& m, const Touch& t) {
  const double mass = m.blocks[static_cast<std::size_t>(t.b)].mass;
  if (t.a.kind != Partner::Kind::block || m.blocks[static_cast<std::size_t>(t.a.index)].ndof() == 0) return mass;
  const double other = m.blocks[static_cast<std::size_t>(t.a.index)].mass;
  return mass * other / (mass + other);
}

/// Damping ratio of a spring: as given; at a deformable structure, where a contact lasts and is no impulse, the one that gives the
/// restitution asked for.
double damping_ratio(const ContactLaw& law, bool lasts) {
  if (law.damping_ratio > 0 || !lasts || !law.restitution) return law.damping_ratio;
  return contact::damping_ratio_for(*law.restitution);
}

/// `damping_ratio` is that of the pair moving along its normal, whatever the number of points: c_i = 2 zeta k_i sqrt(m / sum k), the sum
/// over the points closed with it.
void share_dashpots(const dda::Model& m, const CandidatePair& pair, bool lasts, std::span<Touch> touches) {
  const ContactLaw* law = nullptr;
  double ratio = 0, stiffness = 0;
  bool weighed = false;
  const dda::Model::Block& block = m.blocks[static_cast<std::size_t>(pair.b)];
  const double closed = 1e-6 * block.shape->radius;
  for (Touch& t : touches) {
    if (t.stiffness == 0) continue;
    if (t.law != law) law = t.law, ratio = damping_ratio(*law, lasts);
    if (ratio == 0) continue;
    if (!weighed) {
      for (const Touch& other : touches)
        if (other.at.gap <= closed) stiffness += other.stiffness;
      weighed = true;
    }
    t.dashpot = 2 * ratio * t.stiffness * std::sqrt(mass_in_series(m, t) / (stiffness + (t.at.gap <= closed ? 0 : t.stiffness)));
  }
}

/// Springs and law of a contact point. `crushed`: indentation lost for good in earlier steps [m].
void set_spring(Touch& t, const dda::Model& m, double crushed, bool moving_skin) {
  const ContactLaw& law = *t.law;
  const bool curved = law.kind == ContactLaw::Kind::hertz || law.kind == ContactLaw::Kind::table;
  if (law.stiffness == ContactLaw::Stiffness::hard && !curved) return;
  // An isolated vertex or edge has no tributary area: it takes that of a tenth of the block's inradius.
  const double inradius = m.blocks[static_cast<std::size_t>(t.b)].shape->inradius;
  const double area = t.at.area > 0 ? t.at.area : 0.01 * inradius * inradius;
  const double share = law.stiffness == ContactLaw::Stiffness::per_area ? area : 1;
  const double mass = mass_in_series(m, t);
  t.normal_law.law = &law;
  t.normal_law.stiffness = curved ? law.normal_stiffness : law.normal_stiffness * share;
  t.normal_law.limit = law.crushing_pressure * area;
  t.normal_law.crushed = crushed;
  t.shear_stiffness = law.shear_stiffness * share;
  switch (law.kind) {
    case ContactLaw::Kind::crushing: t.stiffness = t.normal_law.stiffness; break;
    case ContactLaw::Kind::linear:
      t.stiffness = t.normal_law.stiffness;
      if (law.stiffness == ContactLaw::Stiffness::per_area && t.at.area == 0 && !moving_skin) {
        // A corner's area grows with the square of its depth, as a right-angled corner's cut does. The deepest that this approach and the weight reach:
        t.normal_law.growth = law.normal_stiffness;
        const double now = std::max(0.0, -t.at.gap), energy = t.normal_law.work(now) + 0.5 * mass * t.approach * t.approach;
        const double rest = std::min(mass * m.gravity.norm() / t.stiffness, std::cbrt(mass * m.gravity.norm() / t.normal_law.growth));
        t.stiffness = t.normal_law.slope(std::max(rest, t.normal_law.depth_of(energy)));
      }
      break;
    case ContactLaw::Kind::hertz: {
      // The deepest that this approach and the weight reach: 2/5 k x^(5/2) = m v^2 / 2, k x^(3/2) = m g.
      const double k = t.normal_law.stiffness;
      const double impact = std::pow(1.25 * mass * t.approach * t.approach / k, 0.4), rest = std::pow(mass * m.gravity.norm() / k, 2.0 / 3.0);
      t.stiffness = t.normal_law.slope(std::max({impact, rest, -t.at.gap, 1e-12 * inradius}));
      break;
    }
    case ContactLaw::Kind::table:
      for (std::size_t i = 1; i < law.table.size(); ++i)
        t.stiffness = std::max(t.stiffness, t.normal_law.slope(0.5 * (law.table[i - 1].first + law.table[i].first)));
      break;
  }
}

/// A loaded spring keeps the stiffness it had where its area shrinks (a face that tilts to a corner) or where it took over what others held: a softer
/// one would hold its energy only at an indentation that nothing has made.
void keep_stiffness(Touch& t, const ContactMemory& last) {
  if (t.stiffness == 0 || !(last.normal_energy > 0) || last.stiffness <= t.normal_law.stiffness * (1 + 1e-12)) return;
  const double grown = last.stiffness / t.normal_law.stiffness;
  t.normal_law.stiffness = last.stiffness;
  t.normal_law.growth = last.growth;
  t.normal_law.limit *= grown;
  t.stiffness = std::max(t.stiffness, last.stiffness + 3 * last.growth * last.indentation * last.indentation);
  if (t.law->kind == ContactLaw::Kind::hertz) t.stiffness *= grown;
  if (t.law->stiffness == ContactLaw::Stiffness::per_area && last.growth == 0) t.shear_stiffness *= grown;
}

/// Takes a compliance that the touched cell has of its own off a linear or Hertz's spring, at most half of the spring's.
void relieve(Touch& t, double compliance) {
  if (t.law->kind == ContactLaw::Kind::hertz) t.normal_law.relief = compliance;
  if (t.law->kind != ContactLaw::Kind::linear) return;
  t.stiffness /= 1 - std::min(compliance * t.stiffness, 0.5);
  t.normal_law.stiffness = t.stiffness;
}

/// What the touches of a bed need of the state.
void finish_bed(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair, const std::vector<ContactMemory>& memory, std::span<Touch> touches) {
  for (Touch& t : touches) t.approach = t.at.normal.dot(point_velocity(s, pair.b, t.at.point_b) - partner_velocity(s, env, pair.a, t.at));
  spare_newborn(touches, memory, pair.a.id());
  share_dashpots(m, pair, true, touches);
}

}  // namespace

bool presses_on_bed(const dda::Model& m, const Environment& env, const CandidatePair& pair) {
  if (pair.a.kind != Partner::Kind::structure) return false;
  const StructurePart& part = env.structures[static_cast<std::size_t>(pair.a.index)];
  return !part.fixed_surface && is_bed(env.laws(part.material, m.blocks[static_cast<std::size_t>(pair.b)].material));
}

void find_points(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair, double margin, std::vector<FoundPoint>& out) {
  thread_local std::vector<contact::ContactPoint> points;
  points.clear();
  const Polyhedron& shape_b = *m.blocks[static_cast<std::size_t>(pair.b)].shape;
  const Pose pose_b = dda::pose(s, pair.b);
  const auto of_a = static_cast<std::size_t>(pair.a.index);
  // Edges and vertices of a surface name no triangle: nodes and materials are those of the triangle that holds the point.
  const contact::SurfaceIndex* index = nullptr;
  switch (pair.a.kind) {
    case Partner::Kind::block: contact::block_block(*m.blocks[of_a].shape, dda::pose(s, pair.a.index), shape_b, pose_b, margin, points); break;
    case Partner::Kind::plane: contact::plane_block(env.planes[of_a], shape_b, pose_b, margin, points); break;
    case Partner::Kind::terrain:
      contact::surface_block(*env.terrain, shape_b, pose_b, margin, points);
      if (!env.terrain->surface().material.empty()) index = env.terrain.get();
      break;
    case Partner::Kind::structure:
      index = env.structures[of_a].index.get();
      if (env.structures[of_a].fixed_surface) contact::surface_block(*index, shape_b, pose_b, margin, points);
      else contact::skin_block(*index, shape_b, pose_b, margin, points);
      break;
  }
  for (const contact::ContactPoint& p : points) {
    FoundPoint& found = out.emplace_back(FoundPoint{p, index != nullptr && p.face_a < 0});
    if (found.on_edge) found.at.face_a = index->triangle_at(p.point_a);
  }
}

void make_touches(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair, std::span<const FoundPoint> points,
                  const ContactHistory& history, std::vector<Touch>& out) {
  const std::size_t first = out.size();
  const auto kb = static_cast<std::size_t>(pair.b);
  const Polyhedron& shape_b = *m.blocks[kb].shape;
  const bool at_skin = pair.a.kind == Partner::Kind::structure && !env.structures[static_cast<std::size_t>(pair.a.index)].fixed_surface;
  const std::vector<ContactMemory>& memory = history[kb];
  const std::uint64_t partner = pair.a.id();
  std::vector<const ContactMemory*> last_of;
  for (const FoundPoint& found : points) {
    const contact::ContactPoint& p = found.at;
    Touch t;
    t.on_edge = found.on_edge;
    t.a = pair.a;
    t.b = pair.b;
    t.at = p;
    t.law = &env.laws(material_of(m, env, pair.a, p.face_a), m.blocks[kb].material);
    if (pair.a.kind == Partner::Kind::block && (!env.joint_laws.empty() || !env.bonds.empty())) {
      const int joint = joint_of(m, pair, p);
      if (joint >= 0 && joint < static_cast<int>(env.joint_laws.size()) && env.joint_laws[static_cast<std::size_t>(joint)])
        t.law = &*env.joint_laws[static_cast<std::size_t>(joint)];
      if (const Bond* bond = joint >= 0 ? find_bond(env, pair, joint) : nullptr) {
        t.bond_cohesion = bond->cohesion;
        t.bond_tension = bond->tension;
      }
    }
    t.rolls = t.law->rolling_resistance > 0 && !at_skin;   // a solid's nodes take no couple
    const ContactMemory* last = recall(memory, partner, t);
    if (last == nullptr) t.glued = glued_elsewhere(memory, partner);
    if (pair.a.kind == Partner::Kind::structure) t.glued = !t.broken;   // a skin's nodes come and go
    t.approach = p.normal.dot(point_velocity(s, pair.b, p.point_b) - partner_velocity(s, env, pair.a, p));
    set_spring(t, m, last != nullptr ? last->crushed : 0.0, at_skin);
    if (last != nullptr && !at_skin && !t.glued) keep_stiffness(t, *last);   // a bond's strength goes with the area, and so does its spring
    if (pair.a.kind == Partner::Kind::structure && t.stiffness > 0 && p.area == 0) relieve(t, cell_compliance(env.structures[static_cast<std::size_t>(pair.a.index)], p));
    out.push_back(t);
    last_of.push_back(last);
  }
  spare_newborn(std::span(out).subspan(first), memory, partner);
  if (at_skin)
    go_on(std::span(out).subspan(first), last_of, memory, partner, 0.1 * shape_b.radius);
  share_dashpots(m, pair, at_skin, std::span(out).subspan(first));
}

void find_touches(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair,
                  double margin, const ContactHistory& history, std::vector<Touch>& out) {
  if (presses_on_bed(m, env, pair)) {
    const std::size_t first = out.size();
    const auto kb = static_cast<std::size_t>(pair.b);
    const StructurePart& part = env.structures[static_cast<std::size_t>(pair.a.index)];
    find_bed(part.index->surface(), *part.index, pair, env.laws(part.material, m.blocks[kb].material), *m.blocks[kb].shape, dda::pose(s, pair.b), margin, history[kb], out);
    finish_bed(m, s, env, pair, history[kb], std::span(out).subspan(first));
    return;
  }
  thread_local std::vector<FoundPoint> points;
  points.clear();
  find_points(m, s, env, pair, margin, points);
  make_touches(m, s, env, pair, points, history, out);
}

double face_edge(const TriangleSurface& skin, int triangle) {
  const auto& t = skin.triangles[static_cast<std::size_t>(triangle)];
  const Vec3& a = skin.vertices[static_cast<std::size_t>(t[0])];
  return std::sqrt(2 * (skin.vertices[static_cast<std::size_t>(t[1])] - a).cross(skin.vertices[static_cast<std::size_t>(t[2])] - a).norm());
}

double face_edge(const TriangleSurface& skin) {
  double edge = 0;
  for (int t = 0; t < static_cast<int>(skin.triangles.size()); t += 4) edge = std::max(edge, face_edge(skin, t));
  return edge;
}

void find_surface_touches(const Environment& env, const SurfacePair& pair, double reach, const ContactHistory& history, std::vector<Touch>& out) {
  const StructurePart &part_a = env.structures[static_cast<std::size_t>(pair.a)], &part_b = env.structures[static_cast<std::size_t>(pair.b)];
  const TriangleSurface& skin = part_b.index->surface();
  Box3 near = part_a.index->bounds();
  near.min().array() -= reach;
  near.max().array() += reach;
  // Tributary area of every node of the skin as a vector, half of each of its triangles (times 4).
  std::vector<Vec3> weighted(skin.vertices.size(), Vec3::Zero());
  for (const auto& t : skin.triangles) {
    const Vec3& a = skin.vertices[static_cast<std::size_t>(t[0])];
    const Vec3 twice = (skin.vertices[static_cast<std::size_t>(t[1])] - a).cross(skin.vertices[static_cast<std::size_t>(t[2])] - a);
    for (int k = 0; k < 2; ++k) weighted[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])] += twice;   // the third is the centre of the face
  }
  const Partner partner{Partner::Kind::structure, pair.a};
  for (std::size_t v = 0; v < skin.vertices.size(); ++v) {
    if (skin.nodes[v].count != 1 || !near.contains(skin.vertices[v])) continue;
    Touch t;
    if (!contact::node_surface(*part_a.index, skin.vertices[v], weighted[v].normalized(), reach, t.at)) continue;
    t.a = partner;
    t.b = -1;
    t.b_structure = pair.b;
    t.b_node = skin.nodes[v].node[0];
    // Of an edge or corner node only what faces the partner.
    t.at.area = 0.25 * std::max(0.0, -t.at.normal.dot(weighted[v]));
    t.at.key = static_cast<contact::FeatureKey>(t.b_node);
    t.law = &env.laws(part_a.material, part_b.material);
    const ContactMemory* last = recall(history[static_cast<std::size_t>(pair.b)], partner.id(), t);
    if (t.law->stiffness != ContactLaw::Stiffness::hard) {
      const double share = t.law->stiffness == ContactLaw::Stiffness::per_area ? t.at.area : 1.0;
      t.stiffness = t.law->normal_stiffness * share;
      t.shear_stiffness = t.law->shear_stiffness * share;
    }
    t.normal_law.law = t.law;
    t.normal_law.stiffness = t.stiffness;
    t.normal_law.limit = t.law->crushing_pressure * t.at.area;
    t.normal_law.crushed = last != nullptr ? last->crushed : 0.0;
    hold_on(t, last, false);
    if (t.stiffness > 0 && t.law->damping_ratio > 0) t.dashpot = 2 * t.law->damping_ratio * std::sqrt(t.stiffness * part_b.structure->node_mass(t.b_node));
    t.approach = t.at.normal.dot(part_b.structure->node_velocity(t.b_node) - partner_velocity({}, env, partner, t.at));
    out.push_back(t);
  }
}

}  // namespace talus::coupling

#include "coupling/touch/touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "contact/skin/skin_bed.hpp"
#include "contact/skin/skin_block.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/springs/half_steps.hpp"
#include "coupling/touch/touch_bed.hpp"
#include "coupling/touch/touch_spring.hpp"

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

double Touch::bond() const {
  return law->friction > 0 ? std::min(tension(), cohesion() / law->friction) : tension();
}

Vec3 partner_velocity(const dda::State& s, const Environment& env, const Touch& t) {
  const Partner& a = t.a;
  if (a.kind == Partner::Kind::block) return point_velocity(s, a.index, t.at.point_a);
  if (a.kind == Partner::Kind::structure) {
    const StructurePart& part = env.structures[static_cast<std::size_t>(a.index)];
    if (part.fixed_surface) return Vec3::Zero();
    const SurfaceWeights w = skin_weights(t, part.index->surface(), t.at.point_a);
    Vec3 v = Vec3::Zero();
    for (int i = 0; i < w.count; ++i)
      v += w.weight[static_cast<std::size_t>(i)] *
           part.structure->skin().node_velocity(w.node[static_cast<std::size_t>(i)]);
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
      if (face >= 0 && static_cast<std::size_t>(face) < s.material.size())
        return s.material[static_cast<std::size_t>(face)];
      return s.default_material;
    }
    case Partner::Kind::structure: return env.structures[static_cast<std::size_t>(a.index)].material;
  }
  return 0;
}

bool glued_elsewhere(const std::vector<ContactMemory>& memory, std::uint64_t partner) {
  return std::any_of(memory.begin(), memory.end(),
                     [&](const ContactMemory& m) { return m.partner == partner && m.glued; });
}

/// A new contact of a pair that is or was bonded is none of the bonds, which have all of the face's area.
bool beside_bonds(const std::vector<ContactMemory>& memory, std::uint64_t partner) {
  return std::any_of(memory.begin(), memory.end(), [&](const ContactMemory& m) {
    return m.partner == partner && (m.broken || (m.glued && m.bonded.area > 0));
  });
}

/// On a structure nodes come and go: one is bonded where what was known nearest still holds, and has not
/// parted (`near` [m]).
bool glued_nearby(const std::vector<ContactMemory>& memory, std::uint64_t partner,
                  const contact::ContactPoint& p, double near) {
  if (p.gap > near) return false;
  const ContactMemory* nearest = nullptr;
  const auto distance = [&](const ContactMemory& m) { return (m.place - p.point_a).squaredNorm(); };
  for (const ContactMemory& m : memory)
    if (m.partner == partner && (m.glued || m.broken) &&
        (nearest == nullptr || distance(m) < distance(*nearest)))
      nearest = &m;
  return nearest != nullptr && nearest->glued;
}

/// A pair that was born overlapping and has not parted since: what lies inside is hard contact from where it
/// is, so that nothing is pushed apart and no spring starts loaded.
void spare_newborn(std::span<Touch> touches, const std::vector<ContactMemory>& memory,
                   std::uint64_t partner) {
  const auto found = std::find_if(memory.begin(), memory.end(), [&](const ContactMemory& m) {
    return m.partner == partner && m.feature == born_inside;
  });
  if (found == memory.end()) return;
  for (Touch& t : touches) {
    if (t.at.gap >= 0) continue;
    t.offset = -t.at.gap;
    t.at.gap = 0;
    t.stiffness = t.shear_stiffness = t.dashpot = 0;
  }
}

/// Whether a spring at a skin whose feature is found no more presses on from where it was, and where (`at`):
/// loaded, with no other of the pair that presses much the same way to leave it to, on a face that is still
/// there, below the block or next to it.
bool presses_on(const StructurePart& part, const ContactMemory& m, std::uint64_t partner,
                std::span<const Touch> touches, const Polyhedron& block, const Pose& pose, FoundPoint& at) {
  constexpr double near_enough = 0.5;  // cosine between normals, as leave_to_others() has it
  constexpr double near = 0.25;        // of the edge of a face: one that is farther is gone
  if (m.partner != partner || !(m.normal_energy > 0) || m.feature == born_inside) return false;
  for (const Touch& t : touches)
    if (t.goes_on_from == m.feature || t.at.key == m.feature ||
        (t.stiffness > 0 && t.at.gap < 0 && t.at.normal.dot(m.normal) > near_enough))
      return false;
  const TriangleSurface& skin = part.index->surface();
  const int face = part.index->triangle_at(m.place);
  if (face < 0) return false;
  Vec3 x = m.place;
  const int triangle = contact::triangle_of_face(skin, 4 * (face / 4), x);
  const double reach = near * face_edge(skin, triangle);
  if ((x - m.place).norm() > reach) return false;
  if (block.convex) {
    const Mat3 to_world = pose.F.inverse().transpose();
    for (std::size_t f = 0; f < block.face_normals.size(); ++f) {
      const Vec3 on_face = pose.world(block.vertices[static_cast<std::size_t>(
          block.face_vertices[static_cast<std::size_t>(block.face_offset[f])])]);
      if ((to_world * block.face_normals[f]).normalized().dot(x - on_face) >
          std::min(m.indentation, reach) + 1e-3 * block.radius)
        return false;
    }
  }
  at = {.at = {.point_a = x,
               .point_b = x - m.indentation * m.normal,
               .normal = m.normal,
               .gap = -m.indentation,
               .area = 0,
               .key = m.feature,
               .face_a = triangle},
        .on_edge = true};
  return true;
}

/// Joint of the rock mass that a block-block contact lies on, -1 if none.
int joint_of(const dda::Model& m, const CandidatePair& pair, const contact::ContactPoint& p) {
  const auto of = [](const Polyhedron& shape, int face) {
    if (face < 0 || static_cast<std::size_t>(face) >= shape.face_joint_set.size()) return -1;
    return shape.face_joint_set[static_cast<std::size_t>(face)];
  };
  const int a = of(*m.blocks[static_cast<std::size_t>(pair.a.index)].shape, p.face_a);
  const int b = of(*m.blocks[static_cast<std::size_t>(pair.b)].shape, p.face_b);
  if (a >= 0 && b >= 0 && a != b) return -1;  // they no longer lie on the joint that parted them
  return a >= 0 ? a : b;
}

const Bond* find_bond(const Environment& env, const CandidatePair& pair, int joint) {
  const int a = std::min(pair.a.index, pair.b), b = std::max(pair.a.index, pair.b);
  const auto key = std::array<int, 3>{a, b, joint};
  const auto at = std::lower_bound(env.bonds.begin(), env.bonds.end(), key,
                                   [](const Bond& x, const std::array<int, 3>& k) {
                                     return std::array<int, 3>{x.a, x.b, x.joint} < k;
                                   });
  return at != env.bonds.end() && at->a == a && at->b == b && at->joint == joint ? &*at : nullptr;
}

/// True if a corner of A touches B.
bool presses_corner_of_a(const Touch& t) {
  return t.a.kind == Partner::Kind::block && contact::pressed_corner(t.at.key).of_a >= 0;
}

/// What of the surface a contact presses by: a flat face by its share, a corner by its cell seen along
/// `normal`, in the axes of the block whose corner it is. On planes a face that lies flat is a part of such
/// cells, but where it is bonded. Of edges across each other it is that of a right-angled corner that sinks
/// into a plane, three times the square of the depth.
contact::CornerCell cell_of(const dda::Model& m, const Touch& t, const Vec3& normal) {
  if (t.at.area > 0 && (t.a.kind != Partner::Kind::plane || t.glued)) return {t.at.area, {}};
  const auto shape_of = [&](int block) -> const Polyhedron& {
    return *m.blocks[static_cast<std::size_t>(block)].shape;
  };
  const contact::PressedCorner pressed = contact::pressed_corner(t.at.key);
  if (contact::is_surface_point(t.at.key)) return contact::cell_of_point(shape_of(t.b), t.at.key, normal);
  contact::CornerCell cell;
  if (pressed.of_b >= 0)
    cell = contact::corner_cell(shape_of(t.b), pressed.of_b, normal, false);
  else if (presses_corner_of_a(t))
    cell = contact::corner_cell(shape_of(t.a.index), pressed.of_a, normal, false);
  if (cell.area > 0) return cell;
  const double r = shape_of(t.b).inradius;
  return {3 * r * r, {{3 * r * r, {0, r, r}}}};
}

/// The spring of a contact that presses by areas. One that goes on loaded keeps the cell that it had where
/// the one that it has now would hold less at the indentation that it has.
void set_area_spring(Touch& t, const dda::Model& m, const dda::State& s, const ContactMemory* last,
                     double crushed) {
  const bool of_a = presses_corner_of_a(t);
  const Vec3 normal = s.q[static_cast<std::size_t>(of_a ? t.a.index : t.b)].conjugate() *
                      (of_a ? Vec3(-t.at.normal) : t.at.normal);
  const auto set = [&](const Vec3& seen_along) {
    t.corner_normal = seen_along;
    const contact::CornerCell cell = cell_of(m, t, seen_along);
    set_spring(t, stopped(m, t), cell, crushed);
    return cell.area;
  };
  double area = set(normal);
  constexpr double more =
      1e-2;  // part of what it holds by which another cell has to hold more: not round-off's
  const bool goes_on = last != nullptr && last->normal_energy > 0 && !last->corner_normal.isZero(0);
  if (goes_on && t.normal_law.stored(last->indentation) <= last->end_energy * (1 + more))
    area = set(last->corner_normal);
  if (contact::is_surface_point(t.at.key)) t.at.area = area * t.normal_law.part(-t.at.gap);  // cohesion's
}

/// At a node of a skin that moves points without an area have that of a tenth of the block's inradius.
contact::CornerCell at_node(const Polyhedron& block, const contact::ContactPoint& at) {
  return {at.area > 0 ? at.area : 0.01 * block.inradius * block.inradius, {}};
}

/// What the touches of a bed need of the state.
void finish_bed(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair,
                const std::vector<ContactMemory>& memory, std::span<Touch> touches) {
  for (Touch& t : touches)
    t.approach = t.at.normal.dot(point_velocity(s, pair.b, t.at.point_b) - partner_velocity(s, env, t));
  spare_newborn(touches, memory, pair.a.id());
  share_dashpots(m, pair, true, touches);
  share_width(touches);
}

}  // namespace

bool presses_on_bed(const dda::Model& m, const Environment& env, const CandidatePair& pair) {
  if (pair.a.kind != Partner::Kind::structure) return false;
  const StructurePart& part = env.structures[static_cast<std::size_t>(pair.a.index)];
  return !part.fixed_surface &&
         is_bed(env.laws(part.material, m.blocks[static_cast<std::size_t>(pair.b)].material));
}

namespace {

/// x on the plane of a triangle.
Vec3 in_plane(const TriangleSurface& surface, int triangle, const Vec3& x) {
  const auto& t = surface.triangles[static_cast<std::size_t>(triangle)];
  const auto corner = [&](std::size_t k) -> const Vec3& {
    return surface.vertices[static_cast<std::size_t>(t[k])];
  };
  const Vec3 n = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
  return x - n.dot(x - corner(0)) * n;
}

}  // namespace

void find_points(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair,
                 double margin, std::vector<FoundPoint>& out) {
  thread_local std::vector<contact::ContactPoint> points;
  points.clear();
  const Polyhedron& shape_b = *m.blocks[static_cast<std::size_t>(pair.b)].shape;
  const Pose pose_b = dda::pose(s, pair.b);
  const auto of_a = static_cast<std::size_t>(pair.a.index);
  // Edges and vertices of a surface name no triangle: nodes and materials are those of the triangle that
  // holds the point.
  const contact::SurfaceIndex* index = nullptr;
  switch (pair.a.kind) {
    case Partner::Kind::block:
      contact::block_block(*m.blocks[of_a].shape, dda::pose(s, pair.a.index), shape_b, pose_b, margin,
                           points);
      break;
    case Partner::Kind::plane: contact::plane_block(env.planes[of_a], shape_b, pose_b, margin, points); break;
    case Partner::Kind::terrain:
      contact::surface_block(*env.terrain, shape_b, pose_b, margin, points);
      if (!env.terrain->surface().two_sided &&
          std::any_of(env.laws.law.begin(), env.laws.law.end(), presses_by_area))
        contact::surface_points(*env.terrain, shape_b, pose_b, margin, points);
      if (!env.terrain->surface().material.empty()) index = env.terrain.get();
      break;
    case Partner::Kind::structure:
      index = env.structures[of_a].index.get();
      if (env.structures[of_a].fixed_surface)
        contact::surface_block(*index, shape_b, pose_b, margin, points);
      else
        contact::skin_block(*index, shape_b, pose_b, margin, points);
      break;
  }
  for (const contact::ContactPoint& p : points) {
    FoundPoint& found = out.emplace_back(FoundPoint{p, index != nullptr && p.face_a < 0});
    // A block that ends where a material does stands on the one under it.
    if (found.on_edge || (index != nullptr && index->between_materials(p.face_a, p.point_a))) {
      found.at.face_a = index->triangle_at(p.point_a, p.normal, pose_b.c - p.point_a);
      // The force on the block acts where the triangle's corners take it: the edge may lie beside its plane
      // by what tells two places apart.
      found.at.point_a = in_plane(index->surface(), found.at.face_a, p.point_a);
    }
  }
}

BondedAt bonded_here(const dda::State& s, const Touch& t) {
  const Pose a = t.a.kind == Partner::Kind::block ? dda::pose(s, t.a.index) : Pose{}, b = dda::pose(s, t.b);
  return {a.F.inverse() * (t.at.point_a - a.c),
          b.F.inverse() * (t.at.point_b - b.c),
          a.F.transpose() * t.at.normal,
          t.at.area,
          t.at.face_a,
          t.at.face_b};
}

contact::ContactPoint bonded_point(const dda::State& s, const CandidatePair& pair, const ContactMemory& m) {
  const Pose a = pair.a.kind == Partner::Kind::block ? dda::pose(s, pair.a.index) : Pose{};
  contact::ContactPoint p;
  p.key = m.feature;
  p.normal = (a.F.inverse().transpose() * m.bonded.normal).normalized();
  p.point_a = a.world(m.bonded.point_a);
  p.point_b = dda::pose(s, pair.b).world(m.bonded.point_b);
  p.gap = p.normal.dot(p.point_b - p.point_a);
  p.area = m.bonded.area;
  p.face_a = m.bonded.face_a;
  p.face_b = m.bonded.face_b;
  return p;
}

void make_touches(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair,
                  std::span<const FoundPoint> points, const ContactHistory& history,
                  std::vector<Touch>& out) {
  const std::size_t first = out.size();
  const auto kb = static_cast<std::size_t>(pair.b), of_a = static_cast<std::size_t>(pair.a.index);
  const Polyhedron& shape_b = *m.blocks[kb].shape;
  const bool at_skin = pair.a.kind == Partner::Kind::structure && !env.structures[of_a].fixed_surface;
  const std::vector<ContactMemory>& memory = history[kb];
  const std::uint64_t partner = pair.a.id();
  const auto bonded_at_known = [&](const ContactMemory& c) {
    return c.partner == partner && c.glued && c.bonded.area > 0;
  };
  const bool at_structure = pair.a.kind == Partner::Kind::structure;
  const bool bonded =
      at_structure &&
      glued_elsewhere(memory,
                      partner);  // the bond is hard, and so are its ruins until it has given way everywhere
  const bool by_surface = pair.a.kind == Partner::Kind::terrain && !env.terrain->surface().two_sided &&
                          !glued_elsewhere(memory, partner);
  std::vector<const ContactMemory*> last_of;
  double lasted = 0;  // the leapfrog's step before, 0: none [s]
  for (const ContactMemory& c : memory)
    if (at_skin && c.partner == partner) lasted = std::max(lasted, c.lasted);
  const BeforeFullStep before(m, s, pair.b, lasted);
  const auto take = [&](const FoundPoint& found) {
    const contact::ContactPoint& p = found.at;
    const ContactLaw& law = env.laws_at(pair.a)(material_of(m, env, pair.a, p.face_a), m.blocks[kb].material);
    // On ground that gives way by areas a block presses by its own surface, by what of the ground there lies
    // against it no matter; what is bonded by the faces that are bonded.
    if (pair.a.kind == Partner::Kind::terrain &&
        contact::is_surface_point(p.key) != (by_surface && presses_by_area(law)))
      return;
    Touch& t = out.emplace_back();
    t.on_edge = found.on_edge;
    t.a = pair.a;
    t.b = pair.b;
    t.at = p;
    t.law = &law;
    if (pair.a.kind == Partner::Kind::block && (!env.joint_laws.empty() || !env.bonds.empty())) {
      const int joint = joint_of(m, pair, p);
      if (joint >= 0 && joint < static_cast<int>(env.joint_laws.size()) &&
          env.joint_laws[static_cast<std::size_t>(joint)])
        t.law = &*env.joint_laws[static_cast<std::size_t>(joint)];
      if (const Bond* bond = joint >= 0 ? find_bond(env, pair, joint) : nullptr) {
        t.bond_cohesion = bond->cohesion;
        t.bond_tension = bond->tension;
      }
    }
    t.rolls = (t.law->rolling_resistance > 0 || t.law->drilling_resistance > 0) &&
              !at_skin;  // a solid's nodes take no couple
    const ContactMemory* last = recall(memory, partner, t);
    if (last == nullptr && at_skin) t.glued = bonded && glued_nearby(memory, partner, p, bond_gap(shape_b));
    if (last == nullptr && !at_skin) t.broken = beside_bonds(memory, partner);
    t.approach = p.normal.dot(point_velocity(s, pair.b, p.point_b) - partner_velocity(s, env, t));
    if (before.strains())
      t.sooner = p.normal.dot(point_velocity(s, pair.b, p.point_a) + before(p.point_a) -
                              partner_velocity(s, env, t)) -
                 t.approach;
    const bool hard = bonded || (at_skin && p.face_a >= 0 &&
                                 within_cell(*t.law, env.structures[of_a].structure->skin().young(),
                                             face_edge(env.structures[of_a].index->surface(), p.face_a)));
    const double crushed = last != nullptr ? last->crushed : 0.0;
    if (!hard && presses_by_area(law) && !at_skin)
      set_area_spring(t, m, s, last, crushed);
    else if (!hard)
      set_spring(t, stopped(m, t), at_node(shape_b, p), crushed);
    if (!hard && t.law->sprung() && t.stiffness == 0) return out.pop_back();  // of no area: it holds nothing
    if (last != nullptr && !at_skin && !t.glued)
      keep_stiffness(t, *last);  // a bond's strength goes with the area, and so does its spring
    if (at_skin && t.stiffness > 0 && p.area == 0) relieve(t, env.structures[of_a]);
    if (at_skin) last_of.push_back(last);
  };
  for (const ContactMemory& c : memory)
    if (bonded_at_known(c)) take({bonded_point(s, pair, c), false});
  const std::size_t bonds = out.size() - first;
  // What a search finds within half the width of a bond's share of the face is the bond.
  for (const FoundPoint& found : points)
    if (std::none_of(out.begin() + static_cast<std::ptrdiff_t>(first),
                     out.begin() + static_cast<std::ptrdiff_t>(first + bonds), [&](const Touch& t) {
                       return t.at.key == found.at.key ||
                              (t.at.point_b - found.at.point_b).squaredNorm() < 0.25 * t.bonded.area;
                     }))
      take(found);
  spare_newborn(std::span(out).subspan(first), memory, partner);
  if (at_skin) {
    go_on(std::span(out).subspan(first), last_of, memory, partner, 0.1 * shape_b.radius);
    const ContactLaw& law = env.laws(env.structures[of_a].material, m.blocks[kb].material);
    FoundPoint pressed;
    for (const ContactMemory& c : memory)
      if (!law.crushes() && !is_bed(law) &&
          presses_on(env.structures[of_a], c, partner, std::span(out).subspan(first), shape_b,
                     dda::pose(s, pair.b), pressed)) {
        take(pressed);
        hold_on(out.back(), last_of.back(), false);
      }
  }
  share_dashpots(m, pair, at_skin, std::span(out).subspan(first));
  share_width(std::span(out).subspan(first));
}

void find_touches(const dda::Model& m, const dda::State& s, const Environment& env, const CandidatePair& pair,
                  double margin, const ContactHistory& history, std::vector<Touch>& out, const Tilts& tilts) {
  if (presses_on_bed(m, env, pair) &&
      !glued_elsewhere(history[static_cast<std::size_t>(pair.b)], pair.a.id())) {
    const std::size_t first = out.size();
    const auto kb = static_cast<std::size_t>(pair.b);
    const StructurePart& part = env.structures[static_cast<std::size_t>(pair.a.index)];
    find_bed(part.index->surface(), *part.index, pair, env.laws(part.material, m.blocks[kb].material),
             *m.blocks[kb].shape, dda::pose(s, pair.b), margin, history[kb], tilts, out);
    finish_bed(m, s, env, pair, history[kb], std::span(out).subspan(first));
    return;
  }
  thread_local std::vector<FoundPoint> points;
  points.clear();
  find_points(m, s, env, pair, margin, points);
  make_touches(m, s, env, pair, points, history, out);
}

}  // namespace talus::coupling

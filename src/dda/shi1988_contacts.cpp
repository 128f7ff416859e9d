#include "dda/shi1988_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace talus::dda::shi1988 {
namespace {

using Status = Shi1988Contact;

auto pair_order(const Shi1988Contact& c) { return std::tuple(c.partner, c.a, c.b); }
auto full_order(const Shi1988Contact& c) { return std::tuple(c.partner, c.a, c.b, c.key); }

Vec3 tangential(const Vec3& v, const Vec3& n) { return v - n * n.dot(v); }

/// Carries a tangential vector over to a turned normal, keeping its length.
Vec3 turned(const Vec3& v, const Vec3& n) {
  const double length = v.norm();
  if (length == 0) return Vec3::Zero();
  const Vec3 t = tangential(v, n);
  const double now = t.norm();
  return now > 0 ? Vec3(t * (length / now)) : Vec3::Zero();
}

Vec3 surface_velocity(const TriangleSurface& s, int triangle, const Vec3& x) {
  if (s.velocities.empty() || triangle < 0) return Vec3::Zero();
  const auto& t = s.triangles[static_cast<std::size_t>(triangle)];
  const auto at = [&](const std::vector<Vec3>& v, int k) {
    return v[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
  };
  const Vec3 p = at(s.vertices, 0), u = at(s.vertices, 1) - p, v = at(s.vertices, 2) - p, w = x - p;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v),
               det = uu * vv - uv * uv;
  if (!(det > 0)) return at(s.velocities, 0);
  const double b = (vv * wu - uv * wv) / det, c = (uu * wv - uv * wu) / det;
  return (1 - b - c) * at(s.velocities, 0) + b * at(s.velocities, 1) + c * at(s.velocities, 2);
}

int surface_material(const TriangleSurface& s, int triangle) {
  if (s.material.empty() || triangle < 0) return s.default_material;
  return s.material[static_cast<std::size_t>(triangle)];
}

void inherit(WorkingContact& c, const Shi1988Contact& old) {
  c.status0 = old.status;
  c.record.bonded = old.bonded;
  c.shear0 = old.status == Status::locked ? turned(old.shear, c.record.normal) : Vec3::Zero();
  c.slip0 = turned(old.slip, c.record.normal);
}

}  // namespace

std::pair<double, double> elasticity(const Shi1988Settings& settings, const Model::Block& b) {
  if (b.young > 0) return {b.young, b.poisson};
  return {settings.rigid_young, settings.rigid_poisson};
}

double default_penalty(const Shi1988Settings& settings, double young_a, double young_b) {
  if (settings.penalty > 0) return settings.penalty;
  return 10 * std::min(young_a, young_b);
}

void WorkingContact::reset() {
  status = status0;
  reference = shear0;
  slip = slip0;
  lagged_normal = std::max(0.0, -kn * gap0);
  used = {};
  gap = gap0;
  step_shear.setZero();
}

Vec3 WorkingContact::relative_displacement(const std::vector<Vec12>& D, double h) const {
  Vec3 u = -h * partner_velocity;
  if (dof_b >= 0) u += Tb * D[static_cast<std::size_t>(dof_b)];
  if (dof_a >= 0) u -= Ta * D[static_cast<std::size_t>(dof_a)];
  return u;
}

Vec3 WorkingContact::force() const {
  const Vec3& n = record.normal;
  switch (used.status) {
    case Status::locked: return -kn * gap * n - ks * (used.reference + step_shear);
    case Status::sliding: return -kn * gap * n - friction * used.lagged_normal * used.slip;
    default: return Vec3::Zero();
  }
}

void ContactList::build(const Surroundings& s, const State& state, const Shi1988State& history,
                        const Shi1988Settings& settings, double margin) {
  list.clear();
  const int n = state.size();
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  std::vector<Pose> poses(at(n));
  std::vector<Box3> boxes(at(n));
  for (int i = 0; i < n; ++i) {
    poses[at(i)] = Shi1988::pose(state, history, i);
    boxes[at(i)] = contact::bounds(*s.model.blocks[at(i)].shape, poses[at(i)], 0.5 * margin);
  }
  std::vector<contact::ContactPoint> points;

  const auto add = [&](Shi1988Contact::Partner partner, int a, int b) {
    const Model::Block& block_b = s.model.blocks[at(b)];
    for (const auto& p : points) {
      WorkingContact c;
      c.record.partner = partner;
      c.record.a = a;
      c.record.b = b;
      c.record.key = p.key;
      c.record.face_a = p.face_a;
      c.record.point = p.point_b;
      c.record.normal = p.normal;
      c.record.area = p.area;
      c.gap0 = p.gap;

      const auto [young_b, poisson_b] = elasticity(settings, block_b);
      double young_a = young_b;
      int material_a = 0;
      double size = block_b.shape->inradius;
      if (partner == Shi1988Contact::block) {
        const Model::Block& block_a = s.model.blocks[at(a)];
        material_a = block_a.material;
        young_a = elasticity(settings, block_a).first;
        size = std::min(size, block_a.shape->inradius);
        if (!block_a.fixed) {
          c.dof_a = a;
          c.Ta = transformation(p.point_a - poses[at(a)].c);
        }
      } else if (partner == Shi1988Contact::plane) {
        material_a = s.planes[at(a)].material;
      } else {
        const TriangleSurface& surface = s.surfaces[at(a)]->surface();
        material_a = surface_material(surface, p.face_a);
        c.partner_velocity = surface_velocity(surface, p.face_a, p.point_a);
      }
      if (!block_b.fixed) {
        c.dof_b = b;
        c.Tb = transformation(p.point_b - poses[at(b)].c);
      }
      const ContactLaw& law = s.laws(material_a, block_b.material);
      c.friction = law.friction;
      c.cohesion = law.cohesion * p.area;
      c.tension = law.tension * p.area;
      if (law.stiffness == ContactLaw::Stiffness::hard) {
        c.kn = default_penalty(settings, young_a, young_b);
        c.ks = c.kn / settings.shear_ratio;
      } else {
        c.kn = law.normal_stiffness;
        c.ks = law.shear_stiffness > 0 ? law.shear_stiffness : law.normal_stiffness / settings.shear_ratio;
        if (law.stiffness == ContactLaw::Stiffness::per_area) {
          const double least = 0.01 * size * size;  // a lone vertex or edge has no area of its own
          c.kn *= std::max(p.area, least);
          c.ks *= std::max(p.area, least);
        }
      }
      list.push_back(c);
    }
    points.clear();
  };

  std::vector<std::pair<int, int>> pairs;
  contact::overlapping_pairs(boxes, pairs);
  for (const auto& [i, j] : pairs) {
    const auto& A = s.model.blocks[at(i)];
    const auto& B = s.model.blocks[at(j)];
    if (A.fixed && B.fixed) continue;
    contact::block_block(*A.shape, poses[at(i)], *B.shape, poses[at(j)], margin, points);
    add(Shi1988Contact::block, i, j);
  }
  for (int i = 0; i < n; ++i) {
    const auto& B = s.model.blocks[at(i)];
    if (B.fixed) continue;
    for (std::size_t p = 0; p < s.planes.size(); ++p) {
      contact::plane_block(s.planes[p], *B.shape, poses[at(i)], margin, points);
      add(Shi1988Contact::plane, static_cast<int>(p), i);
    }
    Box3 box = boxes[at(i)];
    box.min().array() -= 0.5 * margin;
    box.max().array() += 0.5 * margin;
    for (std::size_t p = 0; p < s.surfaces.size(); ++p) {
      if (!s.surfaces[p]->overlaps(box)) continue;
      contact::surface_block(*s.surfaces[p], *B.shape, poses[at(i)], margin, points);
      add(Shi1988Contact::surface, static_cast<int>(p), i);
    }
  }
  std::stable_sort(list.begin(), list.end(), [](const WorkingContact& x, const WorkingContact& y) {
    return full_order(x.record) < full_order(y.record);
  });

  // Inheritance, pair by pair: first by features, then the nearest point left over (a vertex that slid from
  // one triangle to the next, a face polygon whose corner passed from one block's edge to the other's).
  const auto& old = history.contacts;
  std::vector<char> taken(old.size(), 0);
  std::size_t begin_old = 0;
  for (std::size_t begin = 0; begin < list.size();) {
    std::size_t end = begin;
    while (end < list.size() && pair_order(list[end].record) == pair_order(list[begin].record)) ++end;
    while (begin_old < old.size() && pair_order(old[begin_old]) < pair_order(list[begin].record)) ++begin_old;
    std::size_t end_old = begin_old;
    while (end_old < old.size() && pair_order(old[end_old]) == pair_order(list[begin].record)) ++end_old;

    std::vector<char> done(end - begin, 0);
    bool all_bonded = end_old > begin_old;
    for (std::size_t o = begin_old; o < end_old; ++o) all_bonded = all_bonded && old[o].bonded;
    for (std::size_t k = begin; k < end; ++k)
      for (std::size_t o = begin_old; o < end_old; ++o)
        if (!taken[o] && old[o].key == list[k].record.key) {
          inherit(list[k], old[o]);
          taken[o] = done[k - begin] = 1;
          break;
        }
    for (std::size_t k = begin; k < end; ++k) {
      if (done[k - begin]) continue;
      const Model::Block& b = s.model.blocks[at(list[k].record.b)];
      double best = std::pow(margin + 1e-6 * b.shape->radius, 2);
      std::size_t found = end_old;
      for (std::size_t o = begin_old; o < end_old; ++o) {
        if (taken[o] || old[o].normal.dot(list[k].record.normal) < 0.95) continue;
        const double d = (old[o].point - list[k].record.point).squaredNorm();
        if (d < best) best = d, found = o;
      }
      if (found < end_old) {
        inherit(list[k], old[found]);
        taken[found] = 1;
        continue;
      }
      // New: locked where it already overlaps. Joints present from the very start may be bonded.
      const double touching = 1e-6 * b.shape->radius;
      const bool strong = list[k].cohesion > 0 || list[k].tension > 0;
      list[k].record.bonded = strong && list[k].gap0 <= touching && (history.steps == 0 || all_bonded);
      list[k].status0 = list[k].gap0 < 0 || list[k].record.bonded ? Status::locked : Status::open;
    }
    begin = end;
  }
  for (WorkingContact& c : list) {
    if (!c.record.bonded) c.cohesion = c.tension = 0;
    const bool closed = c.status0 != Status::open;
    const double d = closed ? c.gap0 : std::min(0.0, c.gap0);
    c.energy0_shear = 0.5 * c.ks * c.shear0.squaredNorm();
    c.energy0 = 0.5 * c.kn * d * d + c.energy0_shear;
    c.reset();
  }
}

std::vector<std::pair<int, int>> ContactList::number_pairs() {
  std::vector<std::pair<int, int>> pairs;
  for (WorkingContact& c : list) {
    c.pair = -1;
    if (c.dof_a < 0 || c.dof_b < 0) continue;
    const std::pair<int, int> p{c.dof_a,
                                c.dof_b};  // sorted: block partners come first, in order of (a, b), a < b
    if (pairs.empty() || pairs.back() != p) pairs.push_back(p);
    c.pair = static_cast<int>(pairs.size()) - 1;
  }
  return pairs;
}

void assemble(const WorkingContact& c, double h, BlockSystem& system) {
  if (c.status == Status::open) return;
  const Vec3& n = c.record.normal;
  const Mat3 nn = n * n.transpose();
  Mat3 k = c.kn * nn;
  Vec3 f = -c.kn * c.gap0 * n;  // on B
  if (c.status == Status::locked) {
    k += c.ks * (Mat3::Identity() - nn);
    f -= c.ks * c.reference;
  } else {
    f -= c.friction * c.lagged_normal * c.slip;
  }
  f += k * (h * c.partner_velocity);  // a moving partner: u_a is known
  Mat12x3 kb;
  if (c.dof_b >= 0) {
    const auto b = static_cast<std::size_t>(c.dof_b);
    kb.noalias() = c.Tb.transpose() * k;
    system.diagonal[b].noalias() += kb * c.Tb;
    system.rhs[b].noalias() += c.Tb.transpose() * f;
  }
  if (c.dof_a >= 0) {
    const auto a = static_cast<std::size_t>(c.dof_a);
    Mat12x3 ka;
    ka.noalias() = c.Ta.transpose() * k;
    system.diagonal[a].noalias() += ka * c.Ta;
    system.rhs[a].noalias() -= c.Ta.transpose() * f;
    if (c.pair >= 0) system.coupling[static_cast<std::size_t>(c.pair)].noalias() -= ka * c.Tb;
  }
}

StatusChange update_status(WorkingContact& c, const std::vector<Vec12>& D, double h, double tolerance,
                           bool relock_loaded) {
  const Vec3& n = c.record.normal;
  const Vec3 u = c.relative_displacement(D, h);
  c.used = {c.status, c.reference, c.slip, c.lagged_normal};
  c.gap = c.gap0 + n.dot(u);
  c.step_shear = tangential(u, n);

  const int before = c.status;
  int now = before;
  const double normal = std::max(0.0, -c.kn * c.gap);  // F_n
  const double strength = normal * c.friction + c.cohesion;
  if (before == Status::open) {
    if (c.gap < 0) {
      // Shear counts from the moment of touch, s of the step.
      const double s = c.gap0 > 0 ? c.gap0 / (c.gap0 - c.gap) : 0.0;
      c.reference = -s * c.step_shear;
      const Vec3 trial = (1 - s) * c.step_shear;
      now = c.ks * trial.norm() <= strength ? Status::locked : Status::sliding;
      if (now == Status::sliding) c.slip = trial.normalized();
    }
  } else if (c.kn * c.gap > c.tension || (c.gap >= 0 && c.tension == 0)) {
    now = Status::open;
  } else if (before == Status::locked) {
    const Vec3 shear = c.reference + c.step_shear;
    if (c.ks * shear.norm() > strength) {
      now = Status::sliding;
      c.slip = shear.normalized();
    }
  } else if (c.step_shear.dot(c.slip) < -tolerance) {
    now = Status::locked;  // turned round: the spring starts at the beginning of the step
    c.reference = relock_loaded ? Vec3(strength / c.ks * c.slip) : Vec3(Vec3::Zero());
  } else if (const double length = c.step_shear.norm(); length > tolerance) {
    c.slip = c.step_shear / length;
  }
  c.status = now;
  c.lagged_normal = normal;
  StatusChange change;
  change.opened_or_closed = (before == Status::open) != (now == Status::open);
  change.locked_or_slid = !change.opened_or_closed && before != now;
  return change;
}

}  // namespace talus::dda::shi1988

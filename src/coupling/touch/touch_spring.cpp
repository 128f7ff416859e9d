#include "coupling/touch/touch_spring.hpp"

#include <algorithm>
#include <cmath>

#include "contact/laws/impact_damping.hpp"
#include "contact/tolerances.hpp"
#include "core/bisect.hpp"

namespace talus::coupling {
namespace {

void take_over(const ContactMemory& memory, Touch& t) {
  t.warm = memory.force;
  const auto in_plane = [&](const Vec3& x) { return Vec3(x - t.at.normal * t.at.normal.dot(x)); };
  t.shear = in_plane(memory.shear);
  t.shear_way = in_plane(memory.shear_way);
  t.stored = memory.normal_energy + memory.shear_energy;
  t.sheared = memory.shear_energy;
  t.lasted = memory.lasted;
  t.goes_on_from = memory.feature;
  t.broken = memory.broken;
  t.glued = memory.glued;
  t.bonded = memory.bonded;
  t.persistent = !memory.force.isZero(0);
}

/// What cells (fem::AssumedStrain) give below a force at one point of the skin, times E h, at the centre of a
/// face and at a node: half-space of cubes, Poisson's ratio 0.2; at 0 to 0.4 it is 0.59 to 0.52 and 1.81
/// to 1.78.
constexpr double given_at_centre = 0.58, given_at_node = 1.85;

/// That of a point of the face, in between by the sum of the squared weights (1/4 and 1) [m/N].
double cell_compliance(const StructurePart& part, const contact::ContactPoint& at) {
  if (part.fixed_surface || at.face_a < 0) return 0;
  const TriangleSurface& s = part.index->surface();
  const SurfaceWeights w = surface_weights(s, at.face_a, at.point_a);
  double squares = 0;
  for (int i = 0; i < w.count; ++i)
    squares += w.weight[static_cast<std::size_t>(i)] * w.weight[static_cast<std::size_t>(i)];
  return (given_at_centre + (squares - 0.25) / 0.75 * (given_at_node - given_at_centre)) /
         (part.structure->skin().young() * face_edge(s, at.face_a));
}

/// The indentation about x at which Hertz's law holds that energy of a half step, of which the step before
/// left `sunk` [m].
double depth_that_holds(const Touch& t, double x, double sunk, double energy) {
  double low = 0.8 * x, high = 1.25 * x;
  const auto held = [&](double d) {
    return 0.5 * (t.normal_law.stored(std::max(0.0, d - sunk)) + t.normal_law.stored(d));
  };
  if (!(x > 0) || held(low) > energy || held(high) < energy) return x;
  return bisect(low, high, [&](double d) { return !(held(d) > energy); }).first;
}

/// Damping ratio of a spring: as given; at a deformable structure, where a contact lasts and is no impulse,
/// the one that gives the restitution asked for.
double damping_ratio(const ContactLaw& law, bool lasts) {
  if (law.damping_ratio > 0 || !lasts || !law.restitution) return law.damping_ratio;
  return contact::damping_ratio_for(*law.restitution);
}

}  // namespace

double mass_in_series(const dda::Model& m, const Touch& t) {
  const double mass = m.blocks[static_cast<std::size_t>(t.b)].mass;
  if (t.a.kind != Partner::Kind::block || m.blocks[static_cast<std::size_t>(t.a.index)].ndof() == 0)
    return mass;
  const double other = m.blocks[static_cast<std::size_t>(t.a.index)].mass;
  return mass * other / (mass + other);
}

bool presses_by_area(const ContactLaw& law) {
  return (law.stiffness == ContactLaw::Stiffness::per_area && !law.curved()) || law.crushes();
}

const ContactMemory* recall(const std::vector<ContactMemory>& memory, std::uint64_t partner, Touch& t) {
  const auto found =
      std::lower_bound(memory.begin(), memory.end(), std::pair(partner, t.at.key),
                       [](const ContactMemory& c, const std::pair<std::uint64_t, std::uint64_t>& key) {
                         return c.partner != key.first ? c.partner < key.first : c.feature < key.second;
                       });
  if (found == memory.end() || found->partner != partner || found->feature != t.at.key) return nullptr;
  take_over(*found, t);
  return &*found;
}

void hold_on(Touch& t, const ContactMemory* last, bool grows) {
  if (t.stiffness == 0 || t.law->crushes()) return;
  double indentation = std::max(0.0, -t.at.gap);
  if (last != nullptr && last->indentation > 0) {
    const bool point = t.at.area == 0 && t.law->kind == ContactLaw::Kind::linear;
    indentation = last->indentation * (point ? std::sqrt(last->stiffness / t.stiffness) : 1.0);
    if (t.normal_law.relief > 0 && last->lasted > 0)
      indentation =
          depth_that_holds(t, indentation, -last->lasted * (t.approach + t.sooner), last->normal_energy);
  } else if (!grows) {
    indentation = 0;
  }
  if (indentation == 0 && t.at.gap >= 0) return;
  t.offset += -indentation - t.at.gap;
  t.at.gap = -indentation;
}

void go_on(std::span<Touch> touches, std::vector<const ContactMemory*>& last,
           const std::vector<ContactMemory>& memory, std::uint64_t partner, double reach) {
  std::vector<const ContactMemory*> lost;
  bool flat_before = false;  // a face lay on the skin in the last step
  for (const ContactMemory& m : memory) {
    if (m.partner != partner) continue;
    flat_before = flat_before || contact::form_of(m.feature) == contact::Form::skin_face;
    if (m.indentation > 0 && std::find(last.begin(), last.end(), &m) == last.end()) lost.push_back(&m);
  }
  for (std::size_t i = 0; i < touches.size(); ++i) {
    Touch& t = touches[i];
    if (last[i] == nullptr && t.at.gap < 0 && !lost.empty()) {
      const auto nearest =
          std::min_element(lost.begin(), lost.end(), [&](const ContactMemory* a, const ContactMemory* b) {
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

void share_dashpots(const dda::Model& m, const CandidatePair& pair, bool lasts, std::span<Touch> touches) {
  const ContactLaw* law = nullptr;
  double ratio = 0, stiffness = 0;
  bool weighed = false;
  const dda::Model::Block& block = m.blocks[static_cast<std::size_t>(pair.b)];
  const double closed = contact::tolerances().bonded_gap * block.shape->radius;
  for (Touch& t : touches) {
    if (t.stiffness == 0) continue;
    if (t.law != law) law = t.law, ratio = damping_ratio(*law, lasts);
    if (ratio == 0) continue;
    if (!weighed) {
      for (const Touch& other : touches)
        if (other.at.gap <= closed) stiffness += other.stiffness;
      weighed = true;
    }
    t.dashpot = 2 * ratio * t.stiffness *
                std::sqrt(mass_in_series(m, t) / (stiffness + (t.at.gap <= closed ? 0 : t.stiffness)));
  }
}

Stopped stopped(const dda::Model& m, const Touch& t) {
  const double mass = mass_in_series(m, t);
  return {mass, mass * m.gravity.norm(), m.blocks[static_cast<std::size_t>(t.b)].shape->inradius};
}

void set_spring(Touch& t, const Stopped& by, const contact::CornerCell& cell, double crushed) {
  const ContactLaw& law = *t.law;
  if (!law.sprung()) return;
  const double area = cell.area;
  const double share = law.stiffness == ContactLaw::Stiffness::per_area ? area : 1;
  t.normal_law.law = &law;
  t.normal_law.stiffness = law.kind == ContactLaw::Kind::table ? 1.0
                           : law.curved()                      ? law.normal_stiffness
                                                               : law.normal_stiffness * share;
  t.normal_law.limit = law.crushing_pressure * area;
  t.normal_law.crushed = crushed;
  t.shear_stiffness = law.shear_stiffness * share;
  if (cell.triangles.empty() || !presses_by_area(law)) t.corner_normal.setZero();
  if (!cell.triangles.empty() && presses_by_area(law))
    t.normal_law.corner = std::make_shared<const contact::CornerArea>(cell.triangles);
  t.stiffness = t.normal_law.stiffest(0.5 * by.mass * t.approach * t.approach, by.weight,
                                      std::max(-t.at.gap, by.least_depth()));
}

bool gives_less_than_cell(const ContactLaw& law, double stiffness, double cell) {
  const bool lossless = law.damping_ratio == 0 && !law.restitution;
  return law.kind == ContactLaw::Kind::linear && stiffness > 0 && lossless &&
         given_at_centre * stiffness >= cell;
}

bool within_cell(const ContactLaw& law, double young, double edge) {
  return law.stiffness == ContactLaw::Stiffness::per_contact &&
         gives_less_than_cell(law, law.normal_stiffness, young * edge);
}

void keep_stiffness(Touch& t, const ContactMemory& last) {
  contact::NormalLaw& law = t.normal_law;
  if (t.stiffness == 0 || !(last.normal_energy > 0) ||
      law.stored(last.indentation) >= last.end_energy * (1 - contact::tolerances().same_stiffness))
    return;
  const double grown = last.stiffness / law.stiffness;
  if (last.corner_normal.isZero(0) && law.corner) {  // a face that has tilted
    law.corner.reset();
    t.corner_normal.setZero();
    t.stiffness = law.stiffness;
  }
  law.stiffness = last.stiffness;
  law.limit *= grown;
  t.stiffness *= grown;
  if (t.law->stiffness == ContactLaw::Stiffness::per_area) t.shear_stiffness *= grown;
}

void relieve(Touch& t, const StructurePart& part) {
  const double compliance = cell_compliance(part, t.at);
  const bool linear = t.law->kind == ContactLaw::Kind::linear, hertz = t.law->kind == ContactLaw::Kind::hertz;
  if (!linear && !hertz) return;
  t.stiffness /= 1 - std::min(compliance * t.stiffness, 0.5);
  (linear ? t.normal_law.stiffness : t.normal_law.relief) = linear ? t.stiffness : compliance;
}

double mean_force(const Touch& t, double& derivative) {
  const double x0 = -t.at.gap, x1 = t.indentation;
  const bool closes =
      x0 < 0 && x1 > 0 && !t.pulls() && !t.normal_law.bed && t.law->kind == ContactLaw::Kind::linear;
  if (!closes) return t.normal_law.mean_force(x0, x1, derivative);
  const double mean = t.normal_law.work(x1) / (x1 - x0);
  derivative = (t.normal_law.force(x1) - mean) / (x1 - x0);
  return mean;
}

}  // namespace talus::coupling

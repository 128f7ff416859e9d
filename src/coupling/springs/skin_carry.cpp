#include "coupling/springs/skin_carry.hpp"

#include <algorithm>
#include <cmath>

#include "core/bisect.hpp"
#include "coupling/touch/touch_bed.hpp"

namespace talus::coupling {
namespace {

constexpr double most_skin_growth = 4;  // of an indentation or elongation
constexpr double near_enough_on_skin =
    0.5;  // cosine between the normals of what vanished and what takes over

struct Heir {
  Touch* touch;
  double deep;    // indentation at the start of the step [m]
  double sunk;    // of which in the step before [m]
  double energy;  // of the normal spring as a half step has it [J]

  double energy_at(double s) const {
    return 0.5 *
           (touch->normal_law.stored(std::max(0.0, s * deep - sunk)) + touch->normal_law.stored(s * deep));
  }
};

/// s in [1, most_skin_growth] by which indentations are to grow to hold `more`.
double growth_for(const std::vector<Heir>& heirs, double more) {
  const auto gained = [&](double s) {
    double sum = 0;
    for (const Heir& h : heirs) sum += h.energy_at(s) - h.energy;
    return sum;
  };
  if (gained(most_skin_growth) <= more) return most_skin_growth;
  return bisect(1, most_skin_growth, [&](double s) { return !(gained(s) > more); }).first;
}

void deepen(std::vector<Heir>& heirs, double more) {
  const double s = growth_for(heirs, more);
  for (Heir& h : heirs) {
    Touch& t = *h.touch;
    t.stored += h.energy_at(s) - h.energy;
    t.offset -= (s - 1) * h.deep;
    t.at.gap = -s * h.deep;
  }
}

void stretch(const std::vector<Heir>& heirs, double more) {
  double held = 0;
  for (const Heir& h : heirs) held += h.touch->sheared;
  if (!(held > 0)) return;
  const double by = std::min(most_skin_growth * most_skin_growth, 1 + more / held);
  for (const Heir& h : heirs) {
    Touch& t = *h.touch;
    t.shear *= std::sqrt(by);
    t.shear_way *= std::sqrt(by);
    t.stored += (by - 1) * t.sheared;
    t.sheared *= by;
  }
}

}  // namespace

void leave_to_others(std::uint64_t partner, std::span<Touch> touches,
                     const std::vector<ContactMemory>& memory,
                     const std::function<double(const Touch&)>& before) {
  thread_local std::vector<const ContactMemory*> lost;
  lost.clear();
  for (const ContactMemory& m : memory)
    if (m.partner == partner && m.feature != born_inside && !is_crater(m) &&
        m.normal_energy + m.shear_energy > 0 &&
        std::none_of(touches.begin(), touches.end(),
                     [&](const Touch& t) { return t.goes_on_from == m.feature; }))
      lost.push_back(&m);
  if (lost.empty()) return;
  thread_local std::vector<Heir> heirs;
  heirs.clear();
  const auto alike = [](const Touch& t) {
    return std::any_of(lost.begin(), lost.end(), [&](const ContactMemory* m) {
      return m->normal.dot(t.at.normal) > near_enough_on_skin;
    });
  };
  for (Touch& t : touches) {
    const bool springs_back = t.stiffness > 0 && !t.law->crushes();
    if (!springs_back || !(t.at.gap < 0) || !alike(t)) continue;
    Heir& heir = heirs.emplace_back(Heir{&t, -t.at.gap, -before(t) * (t.approach + t.sooner), 0});
    heir.energy = heir.energy_at(1);
  }
  double normal = 0, shear = 0;
  for (const ContactMemory* m : lost) {
    if (std::none_of(heirs.begin(), heirs.end(),
                     [&](const Heir& h) { return m->normal.dot(h.touch->at.normal) > near_enough_on_skin; }))
      continue;
    normal += m->normal_energy;
    shear += m->shear_energy;
  }
  if (normal > 0) deepen(heirs, normal);
  if (shear > 0) stretch(heirs, shear);
}

}  // namespace talus::coupling

// What contact springs hold at the end of a step.
#include "coupling/springs/spring_energy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/rows/bonds.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {

double normal_energy_at_end(const Step& step, const Touch& t) {
  if (t.indentation < 0 && t.pulls())
    return spring_bond_gives_way(step, t) ? 0 : pull_energy(t, t.indentation);
  const double end =
      t.normal_law.stored(std::max(0.0, t.indentation));  // also while a dashpot holds it back from pressing
  // A leapfrog's energy is that of the half step: the mean of both ends.
  if (t.mode == Mode::spring_secant) return 0.5 * (t.normal_law.stored(-t.at.gap) + end);
  return end;
}

double spring_energy_at_end(const Step& step, const Touch& t, double h) {
  return normal_energy_at_end(step, t) + shear_energy_at_end(step, t, h);
}

double shear_energy_at_end(const Step& step, const Touch& t, double h) {
  if (t.shear_stiffness == 0) return 0;
  const Vec3 end = shear_at_end(step, t, h);
  if (!t.shears_by_half) return 0.5 * t.shear_stiffness * end.squaredNorm();
  return 0.25 * t.shear_stiffness * (end.squaredNorm() + (end - shear_way(step, t, h)).squaredNorm());
}

Vec3 shear_way(const Step& step, const Touch& t, double h) {
  if (!t.shears_by_half || t.impulse.isZero(0)) return Vec3::Zero();
  return shear_at_end(step, t, h) - t.shear;
}

Vec3 shear_at_end(const Step& step, const Touch& t, double h) {
  // Mean (or end) force over the step names the elongation; sliding shortens it to what friction holds.
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const Vec3 force = t.frame.col(1) * c.impulse[1] + t.frame.col(2) * c.impulse[2];
  const Vec3 held = -force / ((t.shears_by_half ? step.between_half_steps(t, h) : h) * t.shear_stiffness);
  const bool slides = at_coulomb_bound(c, c.impulse);
  if (t.shears_by_half) return slides ? held : Vec3(2 * held - (t.shear - t.shear_way));
  if (t.mode != Mode::spring_mean) return held;
  const Vec3 end = 2 * held - t.shear;
  if (!slides) return end;
  // The mean of a force that follows friction's limit is the limit's mean; at the end it is the limit's end.
  const double longest =
      (c.friction * std::max(0.0, t.normal_law.force(t.indentation)) + c.cohesion / h) / t.shear_stiffness;
  if (!(c.impulse[0] > 0) || end.dot(held) <= 0) return Vec3::Zero();
  return end * std::min(1.0, longest / end.norm());
}

double freed_shear(const IslandContext& in, const Touch& t) {
  if (!t.normal_law.bed) return 0;
  const std::vector<ContactMemory>& memory = in.history[static_cast<std::size_t>(t.b)];
  const auto last =
      std::lower_bound(memory.begin(), memory.end(), std::pair(t.a.id(), t.at.key),
                       [](const ContactMemory& m, const std::pair<std::uint64_t, std::uint64_t>& key) {
                         return std::pair(m.partner, m.feature) < key;
                       });
  if (last == memory.end() || last->partner != t.a.id() || last->feature != t.at.key) return 0;
  return std::max(0.0, t.of_part * last->shear_energy - 0.5 * t.shear_stiffness * t.shear.squaredNorm());
}

double crushed_ahead(const Touch& t) {
  return (t.mode == Mode::spring_secant ? 0.5 : 1.0) * t.normal_law.crushing(t.indentation);
}

}  // namespace talus::coupling

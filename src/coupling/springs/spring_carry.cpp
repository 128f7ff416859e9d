#include "coupling/springs/spring_carry.hpp"
#include "contact/tolerances.hpp"
#include "core/bisect.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace talus::coupling {
namespace {

constexpr double most_growth = 4;    // of an indentation where springs grow softer
constexpr double alike = 0.95;       // cosine between normals of features that may stand for each other
constexpr double near_enough = 0.5;  // the same, of those that may take over what others held
constexpr double most_stiffening = 100;
constexpr double round_off = 1e-13;

struct Spring {
  Touch* touch;
  const ContactMemory* last;  // null: it has appeared
  double depth;               // indentation [m]
  bool crushes() const { return touch->law->crushes(); }
  /// Indentation where those of all are scaled by s; what crushes goes no deeper than it is, or yields.
  double scaled(double s) const {
    const contact::NormalLaw& law = touch->normal_law;
    return crushes() ? std::clamp(s * depth, depth, std::max(depth, law.crushed + law.limit / law.stiffness))
                     : s * std::max(0.0, depth);
  }
  /// What it has then crushed for good: where it is new, or has become another, all of its depth but for what
  /// it holds.
  double crushed_at(double s) const {
    const contact::NormalLaw& law = touch->normal_law;
    return crushes() ? std::max(law.crushed, depth - std::min(s, 1.0) * (depth - law.crushed_after(depth)))
                     : law.crushed;
  }
  double stored_at(double s) const {
    if (!crushes() || !(depth > 0)) return touch->normal_law.stored(scaled(s));
    contact::NormalLaw law = touch->normal_law;
    law.crushed = crushed_at(s);
    return law.stored(scaled(s));
  }
  double pulling() const { return depth < 0 && touch->pulls() ? pull_energy(*touch, depth) : 0; }
  double stored() const { return depth < 0 ? pulling() : touch->normal_law.stored(depth); }
};

/// s in [0, most_growth] at which indentations times s hold `energy` where they hold `now`: closed for a
/// power law, else by bisection.
double scale_to(const std::vector<Spring*>& springs, double energy, double now) {
  if (!(energy > 0) || !(now > 0)) return 0;
  const double n = springs.front()->touch->law->exponent();
  const bool power = n > 0 && std::all_of(springs.begin(), springs.end(), [&](const Spring* p) {
                       return p->touch->law->exponent() == n && !p->crushes() && !p->touch->normal_law.corner;
                     });
  if (power) return std::min(most_growth, std::pow(energy / now, 1 / (n + 1)));
  const auto too_much = [&](double s) {
    double sum = 0;
    for (const Spring* p : springs) sum += p->stored_at(s);
    return sum > energy;
  };
  return bisect(0, most_growth, std::not_fn(too_much)).first;
}

const ContactMemory* nearest_alike(const std::vector<const ContactMemory*>& list, const Touch& t) {
  const ContactMemory* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const ContactMemory* m : list) {
    const double d = (m->place - t.at.point_a).squaredNorm();
    if (d < least && m->normal.dot(t.at.normal) > alike) nearest = m, least = d;
  }
  return nearest;
}

/// True of a loaded spring that presses much the same way as one that vanished loaded, and is no bond's,
/// which is as stiff as its area.
bool inherits(const Spring& p, const std::vector<const ContactMemory*>& lost) {
  return p.touch->law->exponent() > 0 && !p.crushes() && p.depth > 0 && !p.touch->pulls() &&
         std::any_of(lost.begin(), lost.end(), [&](const ContactMemory* m) {
           return m->normal_energy > 0 && m->normal.dot(p.touch->at.normal) > near_enough;
         });
}

/// What vanished without a successor that could hold its energy leaves it to the loaded springs that press
/// much the same way: first to those that are indented by less than the blocks have come into each other
/// there, down to that. The rest.
double deepen(std::vector<Spring>& springs, const std::vector<const ContactMemory*>& lost, double energy) {
  const auto taken = [&](double part, bool take) {
    double sum = 0;
    for (Spring& p : springs) {
      const double way = -p.touch->at.gap - p.depth;
      if (!(way > 0) || !inherits(p, lost)) continue;
      const double before = p.stored(), depth = p.depth;
      p.depth += part * way;
      sum += p.stored() - before;
      if (!take) p.depth = depth;
    }
    return sum;
  };
  if (const double most = taken(1, false); most <= energy) return energy - taken(1, true);
  const double part = bisect(0, 1, [&](double at) { return !(taken(at, false) > energy); }).first;
  return energy - taken(part, true);
}

/// Then all of these grow stiffer, until they open.
bool stiffen(const std::vector<Spring>& springs, const std::vector<const ContactMemory*>& lost,
             double energy) {
  double held = 0;
  for (const Spring& p : springs) held += inherits(p, lost) ? p.stored() : 0.0;
  const double by = 1 + energy / held;
  if (!(by <= most_stiffening)) return false;
  for (const Spring& p : springs) {
    if (!inherits(p, lost)) continue;
    p.touch->normal_law.stiffness *= by;
    p.touch->stiffness *= by;
  }
  return true;
}

/// What the springs of `from` held goes free, in all `energy`.
void set_free(const CandidatePair& pair, const std::vector<const ContactMemory*>& from, double energy,
              std::vector<LooseSpring>& loose) {
  double held = 0;
  for (const ContactMemory* m : from) held += m->normal_energy;
  for (const ContactMemory* m : from)
    if (m->normal_energy > 0)
      loose.push_back({pair.a, pair.b, m->place, m->normal, energy * m->normal_energy / held});
}

/// Shear: an elongation that goes on, turned into the new plane of contact, within the energy there was.
void carry_shear(const std::vector<Spring>& springs, const std::vector<const ContactMemory*>& all) {
  double budget = 0, need = 0;
  for (const ContactMemory* m : all) budget += m->shear_energy;
  for (const Spring& p : springs) {
    Touch& t = *p.touch;
    if (p.last == nullptr && (t.at.gap < 0 || t.pulls()))
      if (const ContactMemory* m = nearest_alike(all, t))
        t.shear = m->shear - t.at.normal * t.at.normal.dot(m->shear);
    need += 0.5 * t.shear_stiffness * t.shear.squaredNorm();
  }
  if (need <= budget * (1 + round_off)) return;
  for (const Spring& p : springs) p.touch->shear *= std::sqrt(budget / need);
}

}  // namespace

void carry_springs(const CandidatePair& pair, std::span<Touch> touches,
                   const std::vector<ContactMemory>& memory, bool half_steps,
                   std::vector<LooseSpring>& loose) {
  thread_local std::vector<Spring> springs;
  thread_local std::vector<const ContactMemory*> all, lost,
      given;  // of this pair; of features that vanished; whose energy is given anew
  springs.clear(), all.clear();
  for (Touch& t : touches)
    if (t.stiffness > 0) springs.push_back({&t, nullptr, 0});
  const std::uint64_t partner = pair.a.id();
  for (const ContactMemory& m : memory)
    if (m.partner == partner && m.feature != born_inside) all.push_back(&m);
  if (springs.empty() &&
      std::none_of(all.begin(), all.end(), [](const ContactMemory* m) { return m->normal_energy > 0; }))
    return;  // hard, as most are
  lost = all;
  for (Spring& p : springs) {
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const ContactMemory* m) { return m->feature == p.touch->at.key; });
    if (found == all.end()) continue;
    p.last = *found;
    std::erase(lost, *found);
  }
  // Indented by so little of the gap that the geometry finds, it touches by the round-off of the time at
  // which the step ended.
  constexpr double opened = 1e-3;
  // What stays keeps its indentation; what changed its stiffness or appeared takes what the pair has left of
  // its energy.
  const auto held = [&](const ContactMemory& m) { return half_steps ? m.end_energy : m.normal_energy; };
  double budget = 0, need = 0, pulling = 0;
  for (const ContactMemory* m : lost) budget += held(*m);
  given = lost;
  thread_local std::vector<Spring*> changed;
  changed.clear();
  for (Spring& p : springs) {
    Touch& t = *p.touch;
    if (p.last != nullptr && p.last->corner_normal == t.corner_normal &&
        std::abs(p.last->stiffness - t.normal_law.stiffness) <=
            contact::tolerances().same_stiffness * t.normal_law.stiffness) {
      const double last = p.last->indentation;
      p.depth = t.pulls() || (last > 0 && last > opened * t.at.gap) ? last : std::min(0.0, -t.at.gap);
      continue;
    }
    const ContactMemory* model = p.last != nullptr ? p.last : t.at.gap < 0 ? nearest_alike(all, t) : nullptr;
    p.depth = -t.at.gap - (model != nullptr ? model->offset : 0.0);
    if (p.last != nullptr) budget += held(*p.last), given.push_back(p.last);
    // A spring that pulls is stretched as the geometry says: what parts as one bond is met anew at other
    // features only.
    if (p.depth < 0)
      pulling += p.pulling();
    else
      need += p.stored();
    changed.push_back(&p);
  }
  budget = std::max(0.0, budget - pulling);
  const double s = scale_to(changed, budget, need);
  double left = budget;
  for (Spring* p : changed) left -= p->stored_at(s);
  for (Spring* p : changed) {
    if (!(p->depth > 0)) {
      p->depth = std::min(0.0, -p->touch->at.gap);
      continue;
    }
    p->touch->normal_law.crushed = p->crushed_at(s);
    p->depth = p->scaled(s);
  }
  const double none = contact::tolerances().same_stiffness * budget;
  if (left > none) left = deepen(springs, lost, left);
  for (const Spring& p : springs) {
    Touch& t = *p.touch;
    t.offset = -p.depth - t.at.gap;
    t.at.gap = -p.depth;
  }
  if (left > none && !stiffen(springs, lost, left)) set_free(pair, given, left, loose);
  carry_shear(springs, all);
  for (const Spring& p : springs) {
    const bool stays =
        half_steps && p.last != nullptr && std::find(given.begin(), given.end(), p.last) == given.end();
    p.touch->stored = (stays ? p.last->normal_energy : p.stored()) +
                      0.5 * p.touch->shear_stiffness * p.touch->shear.squaredNorm();
  }
}

}  // namespace talus::coupling

// Bonds: what touches at the start under a law with tension, or across a rock bridge, holds until it is torn
// or sheared off. What meets later does not stick.
#include <algorithm>

#include "contact/tolerances.hpp"
#include "coupling/system/system.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

void CoupledSystem::glue(const KnownPairs& known) {
  env_.bond_stretch = 0;
  const bool tension =
      std::any_of(env_.laws.law.begin(), env_.laws.law.end(),
                  [](const ContactLaw& law) { return law.tension > 0; }) ||
      std::any_of(env_.joint_laws.begin(), env_.joint_laws.end(),
                  [](const std::optional<ContactLaw>& law) { return law && law->tension > 0; });
  if (!tension && env_.bonds.empty()) return;
  const IslandPlan at_start = planner_.plan(0);
  std::vector<Touch> touches;
  for (const Island& island : at_start.islands)
    for (const CandidatePair& pair : island.pairs) {
      touches.clear();
      const Polyhedron& shape = *model_.blocks[static_cast<std::size_t>(pair.b)].shape;
      const bool at_skin = pair.a.kind == Partner::Kind::structure &&
                           !env_.structures[static_cast<std::size_t>(pair.a.index)].fixed_surface;
      std::vector<FoundPoint> points;  // of a bed as well: bonds on a structure are hard
      find_points(model_, state_.blocks, env_, pair,
                  at_skin ? bond_gap(shape) : contact::tolerances().bonded_gap * shape.radius, points);
      make_touches(model_, state_.blocks, env_, pair, points, state_.contacts, touches);
      auto& list = state_.contacts[static_cast<std::size_t>(pair.b)];
      const bool as_it_was = known && known(pair);
      for (Touch& t : touches) {
        t.glued = t.glued || !as_it_was;
        if (t.bonded.area == 0 && !at_skin) t.bonded = bonded_here(state_.blocks, t);
        if (!(t.bond() > 0 || t.bond_cohesion > 0)) continue;
        if (t.pulls()) env_.bond_stretch = std::max(env_.bond_stretch, 2 * t.bond() / t.normal_law.stiffness);
        if (as_it_was) continue;
        const auto remembered = std::find_if(list.begin(), list.end(), [&](const ContactMemory& m) {
          return m.partner == pair.a.id() && m.feature == t.at.key;
        });
        if (remembered != list.end()) continue;
        ContactMemory memory;
        memory.partner = pair.a.id();
        memory.feature = t.at.key;
        memory.place = t.at.point_a;
        memory.normal = t.at.normal;
        memory.glued = true;
        memory.bonded = t.bonded;
        list.push_back(memory);
      }
      std::sort(list.begin(), list.end(), [](const ContactMemory& x, const ContactMemory& y) {
        return std::pair(x.partner, x.feature) < std::pair(y.partner, y.feature);
      });
    }
}

}  // namespace talus::coupling

// Impulses of no duration on structures, as the rows that a report has of them.
#include "coupling/events/structure_impacts.hpp"

#include <algorithm>

#include "contact/tolerances.hpp"

namespace talus::coupling {
namespace {
constexpr double shortest = 0.1;  // mean force of an impulse: of a macro step, or of the fixed step
}  // namespace

Arrival arrival_of(const dda::Model& model, const Step& step, int block) {
  const auto body = std::ranges::find(step.bodies, block, &Body::block);
  if (body == step.bodies.end()) return {};
  const dda::BlockState& s = step.saved[static_cast<std::size_t>(body - step.bodies.begin())];
  const dda::BlockEnergy e = dda::energy(model.blocks[static_cast<std::size_t>(block)], model.gravity, s);
  return {.known = true,
          .velocity = s.v,
          .spin = s.w,
          .translational = e.translational,
          .rotational = e.rotational + e.straining};
}

void StructureImpacts::note(const dda::Model& model, const Step& step, double time) {
  for (const Touch& t : step.touches)
    if (t.row >= 0 && t.a.kind == Partner::Kind::structure && !t.impulse.isZero(0)) {
      StructureContact row;
      row.time = time;
      row.block = t.b;
      row.structure = t.a.index;
      row.point = t.at.point_a;
      row.normal = t.at.normal;
      row.force = -(t.frame * t.impulse);
      row.area = t.at.area;
      row.arrival = arrival_of(model, step, t.b);
      pending_.push_back(row);
    }
}

void StructureImpacts::report(const Environment& env, double t_end, double start, double duration,
                              double usual_step, std::vector<StructureContact>& rows) {
  const double least = shortest * std::min(usual_step, duration), gone = t_end - start;
  const bool last = duration - gone <= contact::tolerances().same_instant * duration;
  std::erase_if(pending_, [&](StructureContact& row) {
    const StructurePart& part = env.structures[static_cast<std::size_t>(row.structure)];
    if (part.one_way) {
      row.dt = std::min(part.structure->critical_step(), duration);
      row.time = std::min(row.time + row.dt, start + duration);
      row.force /= row.dt;
      rows.push_back(row);
      return true;
    }
    const double since = t_end - row.time;
    if (since < least && !last) return false;
    row.time = t_end;
    row.dt = std::max(since, std::min(least, gone));
    row.force /= row.dt;
    rows.push_back(row);
    return true;
  });
}

}  // namespace talus::coupling

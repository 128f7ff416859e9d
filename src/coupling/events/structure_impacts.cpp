// Impulses of no duration on structures, as the rows that a report has of them.
#include "coupling/events/structure_impacts.hpp"

#include <algorithm>

#include "contact/tolerances.hpp"

namespace talus::coupling {
namespace {
constexpr double shortest = 0.1;  // mean force of an impulse: of a macro step, or of the fixed step
}  // namespace

void StructureImpacts::note(const Step& step, double time) {
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

/// The correction of positions after a step is a correction of drift, or the step is not taken (theory:
/// docs/theory/contact.md, (5)).
#pragma once
#include <vector>

#include "coupling/events/structure_impacts.hpp"

namespace talus::coupling {

class DriftGuard {
 public:
  DriftGuard(const IslandContext& in, Step& step, IslandReport& report, StructureImpacts& impacts);
  /// With the touches at the start of the step.
  void begin_step();
  /// Before a step is taken: all that this changes.
  void keep();
  /// All is as at the start of the step.
  void revert();
  /// Whether the correction went farther than the motion in the step explains.
  bool beyond_motion(double h);
  /// The block that then went farthest beyond it, its way, and what is explained of it [m].
  struct Worst {
    int block = 0;
    double way = 0, explained = 0;
  };
  const Worst& worst() const { return worst_; }
  /// Energy that the step just taken made, and dissipation that it undid, its correction of positions
  /// included.
  void account_gains();

 private:
  struct Before {
    Ledger ledger;
    Counters counters;
    AuditSums audit;
    std::size_t rows = 0, works = 0, segments = 0;   // of the report
    std::vector<StructureContact> impacts;           // not reported yet
    std::vector<std::vector<ContactMemory>> memory;  // per body
    std::vector<Pose> poses;                         // per body, at the end of the step before the correction
    double overlaps = 0;                             // of all pairs at the start of the step [m]
  };

  const IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  StructureImpacts& impacts_;
  Before before_;
  Worst worst_;
};

}  // namespace talus::coupling

/// Motion and works of the steps that rows fall into, largest speeds and energies of all, and how far blocks
/// went: read off, no step depends on them.
#pragma once
#include <span>
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

class MotionRecord {
 public:
  MotionRecord(const IslandContext& in, const Step& step, IslandReport& report);
  /// Of a macro step. `rows`: ascending times that the motion is wanted at [s].
  void begin(std::span<const double> rows);
  /// Before the step from t0 to t1 is committed: its start, after impulses of no duration.
  void begin_step(double t0, double t1);
  /// After the corrections at its end.
  void end_step();
  /// Whatever a block was struck by, the partners that were looked for are those that it can meet within what
  /// it was expected to go, turning included.
  void measure_way(double from, double to, std::span<contact::Motion> made);

 private:
  /// The peaks as far as the blocks of `states`.
  void add_peaks(std::span<const dda::BlockState> states);

  const IslandContext& in_;
  const Step& step_;
  IslandReport& report_;
  std::span<const double> rows_;
  std::vector<dda::BlockState> began_;   // of the bodies, as the macro step began
  std::vector<dda::BlockState> starts_;  // and as the step at hand did
  bool recorded_ = false;                // rows fall into the step at hand
};

}  // namespace talus::coupling

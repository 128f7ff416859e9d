/// The progress line of a run, on a terminal; into a log a whole line twice a minute: t, dt, contacts,
/// iterations, energy residual, time left.
#pragma once
#include <chrono>
#include <string>

#include "sim/frame.hpp"

namespace talus::app {

class ProgressLine {
 public:
  ProgressLine();
  /// Writes at most ten times a second, so that it costs nothing beside the run.
  void show(double time, double duration, const sim::RunCounters& counters, double residual);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_ = false, shown_ = false;
  Clock::time_point start_, last_;
  double first_time_ = -1;
};

/// Progress of the build of a world: the plan of large structures at once, what is being solved
/// once that takes longer than a moment. Other reports are not for who waits.
class BuildProgress {
 public:
  void show(const std::string& report);

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace talus::app

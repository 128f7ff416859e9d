/// The progress line of an ensemble, on a terminal; into a log a whole line twice a minute: members done,
/// failed, time left.
#pragma once
#include <chrono>

#include "ensemble/progress.hpp"

namespace talus::app {

class EnsembleProgress {
 public:
  /// `what` there are so many of, e.g. "member".
  explicit EnsembleProgress(const char* what = "member");
  void show(const ensemble::Progress& progress);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  const char* what_;
  bool terminal_ = false, shown_ = false;
  Clock::time_point start_, last_;
  long first_ = -1;
};

}  // namespace talus::app

#include "app/ensemble_progress.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "app/tell.hpp"

namespace talus::app {

EnsembleProgress::EnsembleProgress(const char* what)
    : what_(what),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      last_(terminal_ ? start_ - std::chrono::hours(1) : start_) {}

void EnsembleProgress::show(const ensemble::Progress& progress) {
  const auto [done, asked, failed] = progress;
  if (first_ < 0) first_ = done - 1;
  const auto now = Clock::now();
  if (now - last_ < (terminal_ ? std::chrono::milliseconds(100) : std::chrono::seconds(30))) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const long seconds =
      std::lround(static_cast<double>(asked - done) / static_cast<double>(done - first_) * elapsed);
  tell("{}{} {} of {}  failed {}  left {}:{:02d}:{:02d}{}", terminal_ ? "\r\033[K" : "", what_, done, asked,
       failed, seconds / 3600, seconds / 60 % 60, seconds % 60, terminal_ ? "" : "\n");
  std::fflush(stderr);
  shown_ = terminal_;
}

void EnsembleProgress::clear() {
  if (shown_) tell("\r\033[K");
  shown_ = false;
}

}  // namespace talus::app

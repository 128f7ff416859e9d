#include "app/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <ctime>
#include <string_view>

#include "app/tell.hpp"

namespace talus::app {

ProgressLine::ProgressLine()
    : terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      last_(terminal_ ? start_ - std::chrono::hours(1) : start_) {}

void ProgressLine::show(double time, double duration, const sim::RunCounters& counters, double residual) {
  if (first_time_ < 0) first_time_ = time;
  const auto now = Clock::now();
  if (now - last_ < (terminal_ ? std::chrono::milliseconds(100) : std::chrono::seconds(30))) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::string left = "-";
  if (time > first_time_ && elapsed > 0.5) {
    const long seconds = static_cast<long>((duration - time) / (time - first_time_) * elapsed + 0.5);
    left = seconds >= 3600 ? fmt::format("{}:{:02d}:{:02d}", seconds / 3600, seconds / 60 % 60, seconds % 60)
                           : fmt::format("{}:{:02d}", seconds / 60, seconds % 60);
  }
  tell("{}t {:.4g} of {:.4g} s  dt {:.2g}  contacts {}  iterations {}  energy residual {:.1e}  left {}{}",
       terminal_ ? "\r\033[K" : "", time, duration, counters.dt, counters.contacts,
       counters.newton + counters.sweeps, residual, left, terminal_ ? "" : "\n");
  std::fflush(stderr);
  shown_ = terminal_;
}

void ProgressLine::clear() {
  if (shown_) tell("\r\033[K");
  shown_ = false;
}

void BuildProgress::show(const std::string& report) {
  constexpr std::string_view plan = "plan: ", progress = "progress: ";
  constexpr double moment =
      1;  // of the processor [s]: on a crowded machine small structures stay as quiet as elsewhere
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (report.starts_with(plan))
    tell("{}\n", report.substr(plan.size()));
  else if (report.starts_with(progress) && static_cast<double>(std::clock()) / CLOCKS_PER_SEC > moment)
    tell("{:.0f} s: {}\n", elapsed, report.substr(progress.size()));
  std::fflush(stderr);
}

}  // namespace talus::app

/// A run beside one that is stopped on its way, saved, and resumed from what was saved.
#pragma once
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <memory>
#include <string>

#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace talus::test {

/// Keeps the last row; stops the run at a row or a step from `stop_at` on [s].
class LastRow : public sim::Sink {
 public:
  explicit LastRow(double stop_at = std::numeric_limits<double>::infinity()) : stop_at_(stop_at) {}
  void history(const sim::HistoryRow& row) override {
    last = row;
    if (row.time >= stop_at_) stop = stop_code;
  }
  void progress(double time, double, const sim::RunCounters&, double) override {
    if (time >= stop_at_) stop = stop_code;
  }
  sim::HistoryRow last;
  std::atomic<int> stop = 0;

 private:
  static constexpr int stop_code = 15;  // SIGTERM
  double stop_at_;
};

/// Last rows of the whole run and of the resumed one, and the run that was stopped.
struct Resumed {
  sim::HistoryRow whole, resumed;
  std::unique_ptr<sim::Simulation> stopped;
};

inline Resumed run_and_resume(const std::string& scene, double stop_at) {
  const auto simulation = [&] {
    return std::make_unique<sim::Simulation>(scene::read_scene_text(scene, "/test.toml"));
  };
  Resumed out;
  LastRow one, broken(stop_at), two;
  EXPECT_EQ(simulation()->run(one).exit_code, 0);
  out.stopped = simulation();
  EXPECT_EQ(out.stopped->run(broken, &broken.stop).status, "interrupted");
  const auto second = simulation();
  second->restore(out.stopped->save());
  EXPECT_GE(second->time(), stop_at);
  EXPECT_EQ(second->run(two).exit_code, 0);
  out.whole = one.last;
  out.resumed = two.last;
  return out;
}

}  // namespace talus::test

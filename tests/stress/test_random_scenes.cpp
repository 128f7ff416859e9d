// Random scenes run to their end without intersection (1e-9 of the radius, or what springs give), with a
// ledger that closes and without gain of energy, both to the accuracy of the step.
//
// TALUS_STRESS_SEEDS="100:400" runs those seeds in place of the cheap ones; TALUS_STRESS_SHOW=1 prints a line
// for each, and its scene where it fell short.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "dda/state.hpp"
#include "geometry/exact_check.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"
#include "stress/random_scene.hpp"

namespace talus::stress {
namespace {

constexpr double accuracy = 1e-3;  // the scenes' own: the default
constexpr double patience = 20;    // [s] of CPU; most of these scenes take less than one

class Rows : public sim::Sink {
 public:
  void history(const sim::HistoryRow& row) override { rows.push_back(row); }
  std::vector<sim::HistoryRow> rows;
};

double cpu_now() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Sets `stop` unless it ends in time.
class Watch {
 public:
  explicit Watch(std::atomic<int>& stop)
      : thread_([this, &stop, end = cpu_now() + patience] {
          std::unique_lock lock(mutex_);
          while (!done_.wait_for(lock, std::chrono::milliseconds(100), [this] { return ended_; }))
            if (cpu_now() > end) stop = 2;
        }) {}
  ~Watch() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    done_.notify_one();
    thread_.join();
  }

 private:
  std::mutex mutex_;
  std::condition_variable done_;
  bool ended_ = false;
  std::thread thread_;
};

struct Measures {
  double depth = 0;      // deepest intersection by the exact checker beyond what springs take [m]
  double growth = 0;     // largest growth of energy between rows over the energy in motion
  double growth_at = 0;  // [s]
  double residual = 0;   // of the ledger over the energy in motion
  bool finite = true;
};

Pose pose(const sim::HistoryRow& r, std::size_t k) {
  Pose p;
  p.c = r.position[k];
  p.F = Quat(r.orientation[k][0], r.orientation[k][1], r.orientation[k][2], r.orientation[k][3])
            .toRotationMatrix() *
        (Mat3::Identity() + dda::strain_tensor(r.strain[k]));
  return p;
}

/// What hard contact leaves [m]: positions are led back to a part of the sizes of those in contact, whatever
/// smaller blocks there are elsewhere.
double left_inside(const sim::RunHeader& header, const geometry::Finding& f) {
  const double a = header.blocks[static_cast<std::size_t>(f.a)].shape.radius;
  return 1e-9 * (f.with == geometry::Finding::With::body
                     ? std::min(a, header.blocks[static_cast<std::size_t>(f.b)].shape.radius)
                     : a);
}

Measures measure(const sim::RunHeader& header, const std::vector<sim::HistoryRow>& rows, double tolerance) {
  Measures m;
  std::vector<geometry::CheckedBody> bodies;
  for (const auto& b : header.blocks) bodies.emplace_back(b.shape);
  std::vector<const geometry::CheckedBody*> list;
  for (const auto& b : bodies) list.push_back(&b);
  std::vector<geometry::CheckedSurface> ground;
  if (!header.terrain.triangles.empty()) ground.emplace_back(header.terrain);
  std::vector<const geometry::CheckedSurface*> surfaces;
  for (const auto& s : ground) surfaces.push_back(&s);
  double in_motion = 0, before = 0;
  for (const sim::HistoryRow& r : rows)
    in_motion =
        std::max({in_motion, r.ledger.kinetic, std::abs(r.ledger.potential - rows.front().ledger.potential)});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const sim::HistoryRow& r = rows[i];
    const double energy = r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
    if (i > 0 && energy - before > m.growth * in_motion)
      m.growth = (energy - before) / in_motion, m.growth_at = r.time;
    before = energy;
    m.residual = std::max(m.residual, std::abs(r.ledger.residual) / in_motion);
    std::vector<Pose> poses;
    for (std::size_t k = 0; k < r.position.size(); ++k) {
      poses.push_back(pose(r, k));
      m.finite = m.finite && poses.back().c.allFinite() && poses.back().F.allFinite() &&
                 r.velocity[k].allFinite() && r.spin[k].allFinite();
    }
    if (!m.finite) break;
    if (i % 2 == 1) continue;
    for (const geometry::Finding& f :
         geometry::find_intersections(list, poses, surfaces, header.planes, tolerance)) {
      const bool both_held = f.with == geometry::Finding::With::body &&
                             header.blocks[static_cast<std::size_t>(f.a)].fixed &&
                             header.blocks[static_cast<std::size_t>(f.b)].fixed;
      const bool held_on_plane =
          f.with == geometry::Finding::With::plane && header.blocks[static_cast<std::size_t>(f.a)].fixed;
      if (!both_held && !held_on_plane && f.depth > std::max(left_inside(header, f), tolerance))
        m.depth = std::max(m.depth, f.depth);
    }
  }
  return m;
}

/// What springs may give: the weight of all blocks and the stop of the fastest on one point.
double allowed_depth(const RandomScene& scene, const sim::RunHeader& header,
                     const std::vector<sim::HistoryRow>& rows) {
  if (scene.stiffness == 0) return 1e-9 * scene.smallest;
  double mass = 0, kinetic = 0;
  for (const auto& b : header.blocks) mass += b.fixed ? 0 : b.mass;
  for (const sim::HistoryRow& r : rows) kinetic = std::max(kinetic, r.ledger.kinetic);
  const double k = scene.stiffness;
  const double area =
      scene.text.find("Pa/m") == std::string::npos ? 1 : 1e-4 * scene.thinnest * scene.thinnest;
  return 1.05 * (mass * 9.81 / (k * area) + std::sqrt(2 * kinetic / (k * area)));
}

/// Cheap ones of the first hundred; what falls short among those is told in
/// docs/results/verification-stability.md.
std::vector<int> seeds() {
  std::vector<int> list{1,  4,  7,  8,  9,  11, 12, 13, 17, 18, 19, 20, 25, 26, 28, 35, 37,
                        40, 41, 43, 47, 52, 57, 58, 60, 63, 65, 68, 72, 79, 89, 95, 99};
  int first = 0, last = 0;
  if (const char* range = std::getenv("TALUS_STRESS_SEEDS");
      range != nullptr && std::sscanf(range, "%d:%d", &first, &last) == 2) {
    list.clear();
    for (int seed = first; seed < last; ++seed) list.push_back(seed);
  }
  return list;
}

class RandomScenes : public testing::TestWithParam<int> {};

TEST_P(RandomScenes, RunToTheirEnd) {
  const RandomScene scene = random_scene(static_cast<std::uint64_t>(GetParam()));
  sim::Simulation simulation(scene::read_scene_text(scene.text, "/random.toml"));
  Rows sink;
  std::atomic<int> stop{0};
  sim::RunResult result;
  {
    const Watch watch(stop);
    result = simulation.run(sink, &stop);
  }
  const double allowed = allowed_depth(scene, simulation.header(), sink.rows);
  const Measures m = measure(simulation.header(), sink.rows, allowed);
  const bool good =
      result.exit_code == 0 && m.finite && m.depth == 0 && m.growth <= accuracy && m.residual <= accuracy;
  if (std::getenv("TALUS_STRESS_SHOW") != nullptr) {
    const sim::RunCounters& n = result.counters;
    fmt::print(
        "{} {}: exit {} cpu {:.2f} t {:.3f} steps {} rejected {} d {} e {} depth {:.1e}/{:.1e} growth {:.1e} "
        "at {:.2f} residual {:.1e} asleep {} {}{}\n",
        good ? "good " : "SHORT", scene.summary, result.exit_code, n.cpu_seconds, simulation.time(), n.steps,
        n.rejected, n.halved, n.convex, m.depth, allowed, m.growth, m.growth_at, m.residual,
        n.sleeping_blocks, m.finite ? "" : "not finite ", result.message);
    if (!good) fmt::print("{}", scene.text);
    std::fflush(stdout);
  }
  EXPECT_EQ(result.exit_code, 0) << scene.summary << ": " << result.message;
  EXPECT_TRUE(m.finite) << scene.summary;
  EXPECT_EQ(m.depth, 0) << scene.summary;
  EXPECT_LE(m.growth, accuracy) << scene.summary;
  EXPECT_LE(m.residual, accuracy) << scene.summary;
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomScenes, testing::ValuesIn(seeds()));

}  // namespace
}  // namespace talus::stress

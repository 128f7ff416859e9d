// A run that a signal ends goes on from there as if nothing had been: at whatever moment of a step the signal
// came. What was computed since the start of the stretch is thrown away, or complete. A signal is raised here
// at an allocation of memory, of which every step makes many: the same one gives the same moment, which no
// clock would. The program is one of its own, since its `new` is.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "scene/scene.hpp"
#include "sim/simulation.hpp"
#include "verify/scene_text.hpp"

namespace {
std::atomic<long> allocations = 0;
std::atomic<long> raise_at = -1;  // none if negative
std::atomic<int> stop = 0;

void* allocate(std::size_t size, std::size_t alignment) {
  if (allocations.fetch_add(1) == raise_at.load()) stop = 15;
  void* const p = alignment > 0
                      ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                      : std::malloc(size > 0 ? size : 1);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
}  // namespace

void* operator new(std::size_t size) { return allocate(size, 0); }
void* operator new[](std::size_t size) { return allocate(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace talus::verify {
namespace {

constexpr int rows = 8;

/// Of a run: what is allocated by its rows, its last row, the state it was ended at.
class Kept : public sim::Sink {
 public:
  void history(const sim::HistoryRow& row) override {
    if (count < rows) by_row[count++] = allocations.load();
    last = row;
  }
  void checkpoint(const sim::Checkpoint& c) override { state = c; }
  long by_row[rows] = {};
  int count = 0;
  sim::HistoryRow last;
  std::optional<sim::Checkpoint> state;
};

/// A cube that turns as it falls on the ground: within a few rows it strikes with corners and edges.
std::string falling() {
  SceneText s(Method::by_accuracy(1e-3), 0.35, Vec3(0, 0, -9.81), "sleeping = false\n");
  s.history(0.05).material("rock", 2600).interface("rock", "ground", 0.5).plane(Vec3::UnitZ());
  s.box("A", Vec3(1, 1, 1), Vec3(0, 0, 0.95), spin(Vec3(0.3, 2, 0.2)) + velocity(Vec3(0.5, 0, -1)));
  return s.str();
}

/// The run of the scene, with a stop at that allocation (none if negative), and what is left of it where it
/// was ended.
sim::HistoryRow run_to_the_end(const scene::Scene& scene, long at, bool& interrupted) {
  Kept first;
  sim::Simulation one(scene);
  stop = 0;
  allocations = 0;
  raise_at = at;
  const sim::RunResult r = one.run(first, &stop);
  raise_at = -1;
  stop = 0;
  interrupted = r.status == "interrupted";
  if (!interrupted) return first.last;
  Kept rest;
  sim::Simulation two(scene);
  two.restore(*first.state);
  EXPECT_EQ(two.run(rest, &stop).exit_code, 0);
  return rest.last;
}

TEST(Interrupted, WithinWhateverStepItGoesOnToTheSameBits) {
  const scene::Scene scene = scene::read_scene_text(falling(), "/test.toml");
  Kept whole;
  {
    sim::Simulation unbroken(scene);
    allocations = 0;
    ASSERT_EQ(unbroken.run(whole, &stop).exit_code, 0);
  }
  ASSERT_EQ(whole.count, rows);
  constexpr int moments = 200;
  int ended = 0, others = 0;
  for (int k = 0; k < moments; ++k) {
    const long from = whole.by_row[0], to = whole.by_row[rows - 1];
    const long at = from + (to - from) * k / moments;
    bool interrupted = false;
    const sim::HistoryRow end = run_to_the_end(scene, at, interrupted);
    ended += interrupted;
    others += end.position != whole.last.position || end.velocity != whole.last.velocity ||
              end.orientation != whole.last.orientation || end.spin != whole.last.spin;
  }
  EXPECT_GT(ended, moments / 2);
  EXPECT_EQ(others, 0) << "of " << moments;
}

}  // namespace
}  // namespace talus::verify

// What is recorded never changes the motion: the same scene at any history and field interval has the same
// bits wherever rows are at a common time; rows evaluate the step's own formula.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "scene/scene.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double g = 9.81;

class Recorded : public sim::Sink {
 public:
  void history(const sim::HistoryRow& row) override { rows.push_back(row); }
  void field(double time, std::span<const Pose> poses, std::span<const Structure::Fields>) override {
    frames[time].assign(poses.begin(), poses.end());
  }
  void checkpoint(const sim::Checkpoint& state) override {
    if (!kept) kept = state, rows_before = rows.size();
  }
  std::vector<sim::HistoryRow> rows;
  std::map<double, std::vector<Pose>> frames;
  std::optional<sim::Checkpoint> kept;  // the first
  std::size_t rows_before = 0;
};

struct Intervals {
  double history, field;  // [s]; 0: start and end alone
};

std::string with(const std::string& scene, Intervals every, const std::string& more = {}) {
  std::string text = scene;
  const std::string head = "[output]\n";
  const std::size_t from = text.find(head), to = text.find('\n', text.find("history_interval", from)) + 1;
  const auto line = [&](const char* key, double dt) {
    return dt > 0 ? fmt::format("{} = {:.17g}\n", key, dt) : fmt::format("{} = 100\n", key);
  };
  text.replace(from, to - from,
               head + line("interval", every.field) + line("history_interval", every.history) + more);
  return text;
}

Recorded run(const std::string& text) {
  Recorded r;
  sim::Simulation simulation(scene::read_scene_text(text, "/test.toml"));
  EXPECT_EQ(simulation.run(r).exit_code, 0);
  return r;
}

void expect_equal(const sim::HistoryRow& a, const sim::HistoryRow& b) {
  ASSERT_EQ(a.time, b.time);
  EXPECT_EQ(a.position, b.position) << "t = " << a.time;
  EXPECT_EQ(a.velocity, b.velocity) << "t = " << a.time;
  EXPECT_EQ(a.spin, b.spin) << "t = " << a.time;
  EXPECT_EQ(a.orientation, b.orientation) << "t = " << a.time;
  EXPECT_EQ(a.strain, b.strain) << "t = " << a.time;
  EXPECT_EQ(a.kinetic_translational, b.kinetic_translational) << "t = " << a.time;
  EXPECT_EQ(a.kinetic_rotational, b.kinetic_rotational) << "t = " << a.time;
  const sim::LedgerRow &l = a.ledger, &m = b.ledger;
  for (const auto& [x, y] :
       {std::pair(l.kinetic, m.kinetic), std::pair(l.potential, m.potential), std::pair(l.strain, m.strain),
        std::pair(l.contact, m.contact), std::pair(l.friction_work, m.friction_work),
        std::pair(l.damping_work, m.damping_work), std::pair(l.algorithmic, m.algorithmic),
        std::pair(l.residual, m.residual), std::pair(l.yield_work, m.yield_work),
        std::pair(l.ploughing_work, m.ploughing_work), std::pair(l.vegetation_work, m.vegetation_work)})
    EXPECT_EQ(x, y) << "t = " << a.time;
  EXPECT_EQ(l.linear_momentum, m.linear_momentum);
  EXPECT_EQ(l.angular_momentum, m.angular_momentum);
}

/// Rows at common times; how many there are.
int compare(const Recorded& fine, const Recorded& coarse) {
  int common = 0;
  for (const sim::HistoryRow& row : coarse.rows) {
    const auto same = std::lower_bound(fine.rows.begin(), fine.rows.end(), row.time,
                                       [](const sim::HistoryRow& r, double t) { return r.time < t; });
    if (same == fine.rows.end() || same->time != row.time) continue;
    ++common;
    expect_equal(*same, row);
    if (::testing::Test::HasFailure()) return common;
  }
  for (const auto& [time, poses] : coarse.frames) {
    const auto same = fine.frames.find(time);
    if (same == fine.frames.end()) continue;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(same->second[i].c, poses[i].c);
      EXPECT_EQ(same->second[i].F, poses[i].F);
    }
  }
  return common;
}

double worst_residual(const Recorded& r) {
  double worst = 0, peak = 0;
  for (const sim::HistoryRow& row : r.rows)
    worst = std::max(worst, std::abs(row.ledger.residual)), peak = std::max(peak, row.ledger.kinetic);
  return worst / peak;
}

/// What was reached between rows is told in the last of them.
void expect_equal_peaks(const sim::HistoryRow& a, const sim::HistoryRow& b) {
  ASSERT_EQ(a.peaks.size(), a.position.size());
  ASSERT_EQ(b.peaks.size(), a.peaks.size());
  EXPECT_EQ(a.kinetic_peak, b.kinetic_peak);
  for (std::size_t i = 0; i < a.peaks.size(); ++i) {
    EXPECT_EQ(a.peaks[i].speed, b.peaks[i].speed);
    EXPECT_EQ(a.peaks[i].spin, b.peaks[i].spin);
    EXPECT_EQ(a.peaks[i].kinetic, b.peaks[i].kinetic);
  }
}

/// All intervals against the finest; the greatest residual of a row over the greatest kinetic energy.
double same_at_any_interval(const std::string& scene) {
  const Recorded fine = run(with(scene, {1e-4, 1e-3}));
  EXPECT_GT(fine.rows.size(), 100u);
  for (const Intervals& every : {Intervals{1e-3, 1e-2}, Intervals{0.01, 0.05}, Intervals{0.1, 0.1},
                                 Intervals{0.07, 0.013}, Intervals{0, 0}}) {
    const Recorded coarse = run(with(scene, every));
    expect_equal_peaks(fine.rows.back(), coarse.rows.back());
    EXPECT_GE(compare(fine, coarse), every.history > 0 ? static_cast<int>(coarse.rows.size()) : 2)
        << "every " << every.history << " s";
    if (::testing::Test::HasFailure()) break;
  }
  return worst_residual(fine);
}

std::string bouncing() {
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"\nrestitution = 0.6")
      .plane(Vec3::UnitZ());
  return s.box("B", Vec3(1, 0.8, 0.6), Vec3(0, 0, 1.3), spin(Vec3(0.3, 1, 0.2)) + velocity(Vec3(1, 0, 0)))
      .str();
}

std::string sliding_onto_rough() {
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.material("rock", 2600)
      .material("smooth", 2600)
      .material("rough", 2600)
      .interface("rock", "smooth", 0.2)
      .interface("rock", "rough", 0.6)
      .interface("smooth", "rough", 0.5);
  s.box("F1", Vec3(4, 4, 1), Vec3(0, 0, -0.5), "fixed = true\n", "smooth")
      .box("F2", Vec3(4, 4, 1), Vec3(4, 0, -0.5), "fixed = true\n", "rough");
  return s.box("B", Vec3(0.2, 0.2, 0.1), Vec3(0.4, 0.3, 0.05), velocity(Vec3(4, 0, 0))).str();
}

std::string two_blocks_meet() {
  SceneText s(Method::by_accuracy(1e-3), 0.6, Vec3::Zero());
  s.material("rock", 2600).interface("rock", "rock", 0.3, "normal_stiffness = \"hard\"\nrestitution = 0.5");
  s.box("A", Vec3(1, 1, 1), Vec3(0, 0, 0), velocity(Vec3(2, 0, 0)) + spin(Vec3(0.1, 0.4, 1)));
  return s.box("B", Vec3(1, 1, 1), Vec3(1.7, 0.2, 0.1), velocity(Vec3(-1, 0, 0))).str();
}

std::string pile(double duration) {
  SceneText s(Method::by_accuracy(1e-3), duration);
  s.material("rock", 2600)
      .interface("rock", "rock", 0.5)
      .interface("rock", "ground", 0.5)
      .plane(Vec3::UnitZ());
  for (int i = 0; i < 20; ++i)
    s.box(fmt::format("B{}", i), Vec3(1, 1, 1),
          Vec3(1.1 * (i % 2) + 0.1 * (i / 4), 1.1 * (i / 2 % 2), 0.6 + 1.1 * (i / 4)),
          spin(0.1 * Vec3(i % 3 - 1, i % 5 - 2, i % 2)));
  return s.str();
}

/// Every law of the ground that has a memory or an energy of its own: a layer that yields, hardens, ends and
/// is ploughed, friction that grows with the way slid, growth.
std::string on_soft_ground(bool ground_laws = true) {
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.material("rock", 2600).interface("rock", "rock", 0.5);
  s.interface("rock", "ground", 0.3,
              ground_laws ? "normal_stiffness = \"50 MPa/m\"\ncontact_law = { kind = \"crushing\", pressure "
                            "= \"0.2 MPa\", gradient = \"2 MPa/m\", thickness = \"0.08 m\", ploughing = \"50 "
                            "kPa\", ploughing_density = 1000 }\n"
                            "slip_friction = { most = 1.2, length = \"0.5 m\", recovery = \"5 1/s\" "
                            "}\nvegetation = { height = \"2 m\", drag = 300 }"
                          : "normal_stiffness = \"50 MPa/m\"");
  s.plane(Vec3(std::sin(0.5), 0, std::cos(0.5)));
  for (int i = 0; i < 3; ++i)
    s.box(fmt::format("B{}", i), Vec3(1, 0.8, 0.6), Vec3(1.4 * i, 1.5 * i, 1.1 - 0.76 * i),
          velocity(Vec3(3, 0.2, -2)) + spin(Vec3(0.3, 1, 0.2)));
  return s.str();
}

TEST(Output, BouncingBlock) { EXPECT_LT(same_at_any_interval(bouncing()), 1e-3); }
TEST(Output, SpeedAtAnImpactBetweenRows) {
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"\nrestitution = 0")
      .plane(Vec3::UnitZ());
  s.box("B", Vec3(1, 1, 1), Vec3(0, 0, 1.7), spin(Vec3::Zero()));
  const sim::HistoryRow last = run(with(s.str(), {0, 0})).rows.back();
  EXPECT_LT(last.velocity[0].norm(), 1e-9);
  EXPECT_NEAR(last.peaks[0].speed, std::sqrt(2 * g * 1.2), 1e-9);
  EXPECT_NEAR(last.peaks[0].kinetic / (2600 * g * 1.2), 1, 1e-9);
  EXPECT_NEAR(last.kinetic_peak / (2600 * g * 1.2), 1, 1e-9);
}
TEST(Output, SlidingOntoRoughGround) { EXPECT_LT(same_at_any_interval(sliding_onto_rough()), 1e-3); }
TEST(Output, TwoBlocksThatMeet) { EXPECT_LT(same_at_any_interval(two_blocks_meet()), 1e-3); }
TEST(Output, PileOfTwenty) { EXPECT_LT(same_at_any_interval(pile(0.4)), 1e-3); }

TEST(Output, SoftGround) {
  EXPECT_LT(same_at_any_interval(on_soft_ground()), 1e-3);
  const sim::LedgerRow laws = run(on_soft_ground()).rows.back().ledger,
                       none = run(on_soft_ground(false)).rows.back().ledger;
  for (const double work : {laws.yield_work, laws.ploughing_work, laws.vegetation_work, laws.friction_work})
    EXPECT_GT(work, 0.005 * 3 * 0.5 * 1248 * 13);  // each takes its part of the kinetic energy
  EXPECT_EQ(none.yield_work + none.ploughing_work + none.vegetation_work, 0);
}
TEST(Output, FixedStepThatIsNoPartOfTheInterval) {
  SceneText s(Method::fixed_step(7e-3), 0.5);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"\nrestitution = 0.6")
      .plane(Vec3::UnitZ());
  same_at_any_interval(s.box("B", Vec3(1, 0.8, 0.6), Vec3(0, 0, 0.9), spin(Vec3(0.3, 1, 0.2))).str());
}

TEST(Output, TwoThreadsSameRows) {
  std::string two = pile(0.2);
  two.replace(two.find("threads = 1"), 11, "threads = 2");
  compare(run(with(two, {1e-3, 0})), run(with(pile(0.2), {1e-3, 0})));
}

/// The paper's scheme has a fixed step of its own.
TEST(Output, SchemeOf1988) {
  SceneText s(Method::paper(3e-4), 0.2);
  s.material("rock", 2600, "young = \"1 GPa\"\npoisson = 0.2")
      .material("ground", 2600)
      .interface("rock", "ground", 0.5)
      .plane(Vec3::UnitZ());
  EXPECT_LT(same_at_any_interval(s.box("B", Vec3(1, 1, 1), Vec3(0, 0, 0.52),
                                       velocity(Vec3(1, 0, -0.5)) + spin(Vec3(0.1, 0.3, 0)))
                                     .str()),
            2e-2);
}

/// A stop and a restart between rows: the same rows.
TEST(Output, RestartBetweenRows) {
  for (const Intervals& every : {Intervals{3e-3, 0.05}, Intervals{0.13, 0.31}}) {
    const std::string text = with(pile(0.5), every, "checkpoint_steps = 3\n");
    const Recorded whole = run(text);
    ASSERT_TRUE(whole.kept.has_value());
    sim::Simulation again(scene::read_scene_text(text, "/test.toml"));
    again.restore(*whole.kept);
    Recorded rest;
    ASSERT_EQ(again.run(rest).exit_code, 0);
    ASSERT_EQ(rest.rows.size() + whole.rows_before, whole.rows.size());
    EXPECT_EQ(compare(whole, rest), static_cast<int>(rest.rows.size()));
  }
}

/// What the ground remembers (craters, ways slid) goes into a checkpoint: stopped at any of them, in contact
/// or in flight, the rest has the bits of the whole.
TEST(Output, RestartOnSoftGround) {
  class All : public Recorded {
   public:
    void checkpoint(const sim::Checkpoint& state) override { states.emplace_back(state, rows.size()); }
    std::vector<std::pair<sim::Checkpoint, std::size_t>> states;
  } whole;
  const std::string text = with(on_soft_ground(), {3e-3, 0.05}, "checkpoint_steps = 1\n");
  sim::Simulation first(scene::read_scene_text(text, "/test.toml"));
  ASSERT_EQ(first.run(whole).exit_code, 0);
  ASSERT_GT(whole.states.size(), 5u);
  const double crush_depth = first.world().counters().crush_depth;
  EXPECT_GT(crush_depth, 0);
  for (std::size_t k = 0; k < whole.states.size(); k += std::max<std::size_t>(1, whole.states.size() / 8)) {
    sim::Simulation again(scene::read_scene_text(text, "/test.toml"));
    again.restore(whole.states[k].first);
    Recorded rest;
    ASSERT_EQ(again.run(rest).exit_code, 0);
    ASSERT_EQ(rest.rows.size() + whole.states[k].second, whole.rows.size());
    EXPECT_EQ(compare(whole, rest), static_cast<int>(rest.rows.size()))
        << "stopped before row " << whole.states[k].second;
    EXPECT_EQ(again.world().counters().crush_depth, crush_depth);
  }
}

TEST(Output, TwoThreadsOnSoftGround) {
  const std::string text = with(on_soft_ground(), {3e-3, 0.05});
  std::string two = text;
  two.replace(two.find("threads = 1"), 11, "threads = 2");
  const Recorded one = run(text), other = run(two);
  ASSERT_EQ(one.rows.size(), other.rows.size());
  EXPECT_EQ(compare(one, other), static_cast<int>(other.rows.size()));
}

/// In flight rows are the closed form: parabola, angular momentum and energy to round-off.
TEST(Output, RowsInFlightAreTheClosedForm) {
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.history(7e-4).material("rock", 2600).interface("rock", "ground", 0.5).plane(Vec3::UnitZ());
  const Vec3 c0(0, 0, 8), v0(3, -1, 2), w0(2, 1, 0.5);
  const Recorded r = run(s.box("B", Vec3(1, 0.7, 0.4), c0, velocity(v0) + spin(w0)).str());
  ASSERT_GT(r.rows.size(), 1000u);
  const sim::LedgerRow& start = r.rows.front().ledger;
  for (const sim::HistoryRow& row : r.rows) {
    const double t = row.time;
    EXPECT_LT((row.position[0] - (c0 + t * v0 - 0.5 * g * t * t * Vec3::UnitZ())).norm(), 1e-13);
    EXPECT_LT((row.velocity[0] - (v0 - g * t * Vec3::UnitZ())).norm(), 1e-13);
    EXPECT_NEAR(row.kinetic_rotational[0], r.rows.front().kinetic_rotational[0], 1e-11 * start.kinetic);
    EXPECT_LT(std::abs(row.ledger.residual), 1e-12 * (start.kinetic + start.potential));
  }
}

/// Steady sliding: rows lie on the parabola of the step, and the works follow the energy.
TEST(Output, RowsInSlidingAreTheStepsParabola) {
  const double mu = 0.3, v0 = 4;
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.history(7e-4).material("rock", 2600).interface("rock", "ground", mu).plane(Vec3::UnitZ());
  const Recorded r = run(s.box("B", Vec3(1, 1, 0.2), Vec3(0, 0, 0.1), velocity(Vec3(v0, 0, 0))).str());
  for (const sim::HistoryRow& row : r.rows) {
    const double t = row.time;
    EXPECT_NEAR(row.position[0].x(), v0 * t - 0.5 * mu * g * t * t, 1e-9);
    EXPECT_NEAR(row.velocity[0].x(), v0 - mu * g * t, 1e-9);
    EXPECT_NEAR(row.ledger.friction_work, 2600 * 0.2 * mu * g * row.position[0].x(),
                1e-6 * r.rows.front().ledger.kinetic);
    EXPECT_LT(std::abs(row.ledger.residual), 1e-9 * r.rows.front().ledger.kinetic);
  }
}

}  // namespace
}  // namespace talus::verify

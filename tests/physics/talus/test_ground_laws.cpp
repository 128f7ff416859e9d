// Laws of the ground against closed forms (docs/theory/ground.md): what yields, ploughs, grows with the way
// slid, and brakes in flight.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "coupling/ground/ground_laws.hpp"
#include "verify/measures.hpp"
#include "verify/suite.hpp"

namespace talus::verify {
namespace {

/// Boxes of 1 x 1 x 0.5 m, 1250 kg, on the level ground, all with one velocity; `law`: what the interface of
/// rock and ground says.
std::string boxes(int count, double apart, const Vec3& velocity, double height, double duration,
                  const std::string& law, const std::string& gravity = "[0.0, 0.0, -9.81]") {
  std::string text = fmt::format(
      "schema = 1\n[simulation]\nduration = {}\ngravity = {}\n[output]\nhistory_interval = 0.001\nreport = "
      "false\n[[plane]]\nmaterial = \"ground\"\nnormal = [0, 0, 1]\n"
      "[[material]]\nname = \"rock\"\ndensity = 2500\n[[interface]]\nbetween = [\"rock\", "
      "\"rock\"]\nfriction = 0.0\nnormal_stiffness = \"hard\"\n[[interface]]\nbetween = [\"rock\", "
      "\"ground\"]\n{}\n",
      duration, gravity, law);
  for (int i = 0; i < count; ++i)
    text += fmt::format(
        "[[block]]\nname = \"B{}\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.0, 1.0, 0.5]\nposition = "
        "[{}, 0.0, {}]\nvelocity = [{}, {}, {}]\n",
        i + 1, i * (1 + apart), 0.25 + height, velocity.x(), velocity.y(), velocity.z());
  return text;
}

/// Way after which a block that slides with friction mu(s) on the level stands, from v^2 / 2g = int mu ds.
double stops_after(double speed, double mu, double most, double length) {
  const auto taken = [&](double s) {
    return mu * s + (most - mu) * 2 / M_PI *
                        (s * std::atan(s / length) - 0.5 * length * std::log1p(s * s / (length * length)));
  };
  double low = 0, high = 1000;
  for (int i = 0; i < 200; ++i)
    (taken(0.5 * (low + high)) < 0.5 * speed * speed / g ? low : high) = 0.5 * (low + high);
  return low;
}

}  // namespace

TEST(GroundLaws, FrictionGrowsWithTheWaySlid) {
  const double way = stops_after(4, 0.2, 1.0, 1.5);
  EXPECT_LT(way, 0.8 * 16 / (2 * g * 0.2));  // the law matters
  // One block, and blocks side by side that are one island: beyond a dozen it is solved otherwise.
  for (const int count : {1, 14}) {
    const Outcome o = run_scene(boxes(count, 0.0, Vec3(0, 4, 0), 0, 4,
                                      "friction = 0.2\nslip_friction = { most = 1.0, length = 1.5, recovery "
                                      "= 5 }\nnormal_stiffness = \"hard\""));
    ASSERT_TRUE(o.ok());
    for (int i = 0; i < count; ++i)
      EXPECT_NEAR(o.last().position[static_cast<std::size_t>(i)].y() / way, 1, count == 1 ? 2e-3 : 1e-2)
          << "of " << count;  // the coefficient lags by a step
    const double kinetic = count * 0.5 * 1250 * 16;
    EXPECT_NEAR(o.last().ledger.friction_work / kinetic, 1, 2e-3);
    EXPECT_LT(std::abs(o.last().ledger.residual), 1e-6 * kinetic);
  }
}

TEST(GroundLaws, TheWayIsForgottenInFlight) {
  dda::State state;
  state.slid = {2.0, 1.0};
  coupling::go_on_sliding(state, 0, -1, 5, 0.1);  // out of contact
  coupling::go_on_sliding(state, 1, 3, 5, 0.1);   // 3 m/s
  EXPECT_NEAR(state.slid[0], 2 * std::exp(-0.5), 1e-15);
  EXPECT_NEAR(state.slid[1], 1.3, 1e-15);
}

TEST(GroundLaws, VegetationBrakesByExp) {
  // No gravity, 0.4 m above the ground in growth of 2 m: v = v0 exp(-eta t / m).
  for (const int count : {1, 14}) {
    const Outcome o = run_scene(
        boxes(count, 0.2, Vec3(0, 10, 0), 0.4, 2,
              "friction = 0.5\nvegetation = { height = 2.0, drag = 800 }\nnormal_stiffness = \"hard\"",
              "[0.0, 0.0, 0.0]"));
    ASSERT_TRUE(o.ok());
    const double rate = 800.0 / 1250, left = 10 * std::exp(-rate * 2);
    for (int i = 0; i < count; ++i) {
      EXPECT_NEAR(o.last().velocity[static_cast<std::size_t>(i)].y(), left, 1e-9);
      EXPECT_NEAR(o.last().position[static_cast<std::size_t>(i)].y() / ((10 - left) / rate), 1, 1e-12);
    }
    EXPECT_NEAR(o.last().ledger.vegetation_work / (count * 0.5 * 1250 * (100 - left * left)), 1, 1e-9);
    EXPECT_LT(std::abs(o.last().ledger.residual), 1e-9 * count * 0.5 * 1250 * 100);
  }
  // Above the growth nothing brakes.
  const Outcome above = run_scene(
      boxes(1, 0, Vec3(0, 10, 0), 4, 1,
            "friction = 0.5\nvegetation = { height = 2.0, drag = 800 }\nnormal_stiffness = \"hard\"",
            "[0.0, 0.0, 0.0]"));
  EXPECT_EQ(above.last().velocity[0].y(), 10);
  EXPECT_EQ(above.last().ledger.vegetation_work, 0);
}

/// x'' = a - c x' in closed form.
struct Braked {
  double way, speed;
};
Braked braked(double speed, double acceleration, double rate, double t) {
  const double end = acceleration / rate, now = end + (speed - end) * std::exp(-rate * t);
  return {end * t + (speed - now) / rate, now};
}

std::string with_settings(std::string text, const std::string& simulation, double interval) {
  const auto put = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  put("[simulation]\n", "[simulation]\n" + simulation + "\n");
  put("history_interval = 0.001", fmt::format("history_interval = {}", interval));
  return text;
}

/// Free flight is exact: what is left is the time at which the surface of the layer is met, to 1e-9 s, and
/// round-off.
TEST(GroundLaws, FallIntoVegetationIsExactAtAnySettings) {
  const double drag = 2500, height = 4, rate = drag / 1250, drop = 2, duration = 0.9,
               enters = std::sqrt(2 * drop / g);
  const auto at = [&](double t) {
    const double in = std::max(0.0, t - enters), out = std::min(t, enters);
    const Braked along = braked(8, 0, rate, in), down = braked(g * enters, g, rate, in);
    return Vec3(0, 8 * out + (in > 0 ? along.way : 0.0),
                height + drop - 0.5 * g * out * out - (in > 0 ? down.way : 0.0));
  };
  const std::string law = fmt::format(
      "friction = 0.5\nvegetation = {{ height = {}, drag = {} }}\nnormal_stiffness = \"hard\"", height, drag);
  for (const int count : {1, 13})
    for (const char* settings : {"accuracy = 1e-1", "accuracy = 1e-3", "accuracy = 1e-6", "step = 0.01"})
      for (const double interval : {0.004, 0.3}) {
        const Outcome o = run_scene(with_settings(
            boxes(count, 0.2, Vec3(0, 8, 0), height + drop - 0.25, duration, law), settings, interval));
        ASSERT_TRUE(o.ok());
        for (const auto& row : o.rows)
          for (int i = 0; i < count; ++i) {
            Vec3 x = row.position[static_cast<std::size_t>(i)];
            x.x() = 0;
            EXPECT_LT((x - at(row.time)).norm(), 2e-8) << settings << " at " << row.time;
          }
        const Braked along = braked(8, 0, rate, duration - enters),
                     down = braked(g * enters, g, rate, duration - enters);
        const double lost = 0.5 * 1250 * (64 - along.speed * along.speed - down.speed * down.speed) +
                            1250 * g * (height + drop - at(duration).z());
        EXPECT_NEAR(o.last().ledger.vegetation_work / (count * lost), 1, 1e-7) << settings;
        EXPECT_LT(std::abs(o.last().ledger.algorithmic), 1e-10 * count * lost) << settings;
      }
}

/// Thrown up through the surface of the layer: out of it and back within one flight.
TEST(GroundLaws, ShortFlightOutOfVegetationCounts) {
  const double rate = 2, height = 3, up = 4, first = 2.9;
  const Outcome o = run_scene(with_settings(
      boxes(1, 0, Vec3(0, 20, up), first - 0.25, 0.8,
            "friction = 0.5\nvegetation = { height = 3.0, drag = 2500 }\nnormal_stiffness = \"hard\""),
      "accuracy = 1e-1", 0.8));
  ASSERT_TRUE(o.ok());
  double low = 0, high = 0.1;  // the time at which it leaves
  for (int i = 0; i < 100; ++i)
    (first + braked(up, -g, rate, 0.5 * (low + high)).way < height ? low : high) = 0.5 * (low + high);
  const Braked rises = braked(up, -g, rate, low), along = braked(20, 0, rate, low);
  const double flies = 2 * rises.speed / g, rest = 0.8 - low - flies;
  EXPECT_NEAR(o.last().position[0].y(),
              along.way + along.speed * flies + braked(along.speed, 0, rate, rest).way, 1e-7);
  EXPECT_NEAR(o.last().position[0].z(), height + braked(-rises.speed, -g, rate, rest).way, 1e-7);
}

/// m u' = -mu m g - eta u: exact as well, since friction stays.
TEST(GroundLaws, SlidingInVegetationIsExactAtAnySettings) {
  const double drag = 2500, rate = drag / 1250, mu = 0.3, duration = 0.9;
  for (const int count : {1, 13})
    for (const char* settings : {"accuracy = 1e-1", "accuracy = 1e-3", "accuracy = 1e-6", "step = 0.01"}) {
      const Outcome o = run_scene(with_settings(
          boxes(count, 0.2, Vec3(0, 8, 0), 0, duration,
                "friction = 0.3\nvegetation = { height = 2, drag = 2500 }\nnormal_stiffness = \"hard\""),
          settings, 0.05));
      ASSERT_TRUE(o.ok());
      for (const auto& row : o.rows)
        for (int i = 0; i < count; ++i)
          EXPECT_NEAR(row.position[static_cast<std::size_t>(i)].y(), braked(8, -mu * g, rate, row.time).way,
                      1e-9)
              << settings << " at " << row.time;
      const Braked end = braked(8, -mu * g, rate, duration);
      const double rubbed = 1250 * mu * g * end.way,
                   dragged = 0.5 * 1250 * (64 - end.speed * end.speed) - rubbed;
      EXPECT_NEAR(o.last().ledger.vegetation_work / (count * dragged), 1, 1e-9) << settings;
      EXPECT_NEAR(o.last().ledger.friction_work / (count * rubbed), 1, 1e-9) << settings;
    }
}

TEST(GroundLaws, LayerThatHardensStopsAFlatBlock) {
  // Crushed by y it has sunk by x = y + (p + G y)/k:  m v^2/2 + m g x = A (p y + G y^2/2 + (p + G y)^2/2k).
  const double k = 50e6, p = 2e5, G = 2e6, mass = 1250;
  for (const double speed : {2.0, 4.0}) {
    const Outcome o =
        run_scene(boxes(1, 0, Vec3(0, 0, -speed), 0, 0.5,
                        fmt::format("friction = 0.5\nnormal_stiffness = \"{} Pa/m\"\ncontact_law = {{ kind = "
                                    "\"crushing\", pressure = {}, gradient = {} }}",
                                    k, p, G)));
    ASSERT_TRUE(o.ok());
    const auto balance = [&](double y) {
      const double stress = p + G * y, sunk = y + stress / k;
      return p * y + 0.5 * G * y * y + 0.5 * stress * stress / k - 0.5 * mass * speed * speed -
             mass * g * sunk;
    };
    double low = 0, high = 2;
    for (int i = 0; i < 100; ++i) (balance(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
    double lowest = 1;
    for (const auto& row : o.rows) lowest = std::min(lowest, row.position[0].z() - 0.25);
    const double deepest = low + (p + G * low) / k;
    EXPECT_NEAR(lowest / -deepest, 1, 0.02) << speed;
    EXPECT_NEAR(o.last().ledger.yield_work / (p * low + 0.5 * G * low * low), 1, 0.02) << speed;
    EXPECT_LT(std::abs(o.last().ledger.residual), 1e-3 * 0.5 * mass * speed * speed);
    EXPECT_NEAR(o.result.counters.crush_depth / low, 1, 0.02);
  }
}

TEST(GroundLaws, LayerThatEndsIsAsStiffAsItsColumns) {
  // 0.05 m of layer: what it cannot take presses on its bottom.
  const double k = 50e6, p = 2e5, H = 0.05, mass = 1250, speed = 6;
  const Outcome o = run_scene(boxes(1, 0, Vec3(0, 0, -speed), 0, 0.2,
                                    fmt::format("friction = 0.5\nnormal_stiffness = \"{} Pa/m\"\ncontact_law "
                                                "= {{ kind = \"crushing\", pressure = {}, thickness = {} }}",
                                                k, p, H)));
  ASSERT_TRUE(o.ok());
  // m v^2 / 2 + m g x = p H + k s^2 / 2 with x = H + s.
  const double energy = 0.5 * mass * speed * speed + mass * g * H - p * H,
               s = (mass * g + std::sqrt(mass * g * mass * g + 2 * k * energy)) / k;
  double lowest = 1;
  for (const auto& row : o.rows) lowest = std::min(lowest, row.position[0].z() - 0.25);
  EXPECT_GT(-lowest, 0.8 * (H + s));
  EXPECT_LT(-lowest, 1.01 * (H + s));
  EXPECT_NEAR(o.last().ledger.yield_work / (p * H), 1, 1e-2);
  EXPECT_NEAR(o.result.counters.crush_depth / H, 1, 1e-3);
  EXPECT_NEAR(o.result.counters.crush_share, 1, 1e-3);
}

TEST(GroundLaws, PloughingBrakesWhatSlides) {
  // Without friction: m dv/dt = -sigma y sqrt(A), and the mean of the depth y is that at which it rests.
  const double k = 2e6, sigma = 5e4, mass = 1250, depth = mass * g / k, force = sigma * depth * 1.0,
               speed = 3;
  const std::string law = fmt::format(
      "friction = 0.0\ndamping_ratio = 0.3\nnormal_stiffness = \"{} Pa/m\"\nshear_stiffness = \"1e7 "
      "Pa/m\"\ncontact_law = {{ kind = \"crushing\", pressure = \"10 MPa\", ploughing = {} }}",
      k, sigma);
  for (const int count : {1, 14}) {
    const Outcome o = run_scene(boxes(count, 0.0, Vec3(0, speed, 0), 0, 2, law));
    ASSERT_TRUE(o.ok());
    const double decelerates = force / mass, stops = speed / decelerates;
    ASSERT_GT(stops, 2);
    for (int i = 0; i < count; ++i)
      EXPECT_NEAR((speed - o.last().velocity[static_cast<std::size_t>(i)].y()) / (2 * decelerates), 1, 0.02)
          << count;
    const double left = speed - 2 * decelerates;
    EXPECT_NEAR(o.last().ledger.ploughing_work / (count * 0.5 * mass * (speed * speed - left * left)), 1,
                0.03)
        << count;
  }
}

}  // namespace talus::verify

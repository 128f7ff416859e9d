// Laws of the ground against closed forms (docs/theory/ground.md): what yields, ploughs, grows with the way
// slid, and brakes in flight.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "coupling/ground_laws.hpp"
#include "verify/suite.hpp"

namespace talus::verify {
namespace {

constexpr double g = 9.81;

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
      EXPECT_NEAR(o.last().position[static_cast<std::size_t>(i)].y() / ((10 - left) / rate), 1,
                  1e-3);  // halves of stretches of 0.05 s: (0.5 x 0.032)^2
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

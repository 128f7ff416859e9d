// Laws of areas, springs in Pa/m and crushing: what a block sinks by is told by its form, however finely it
// or the ground is meshed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double density = 2500, radius = 0.5, pressure = 2e6, stiffness = 2e7, speed = 8;
const std::string crushes =
    "normal_stiffness = \"1 GPa/m\"\ncontact_law = { kind = \"crushing\", pressure = " + number(pressure) +
    " }";
const std::string springs = "normal_stiffness = \"" + number(stiffness) + " Pa/m\"";
const std::string plane_ground = "[[plane]]\nnormal = [0, 0, 1]\nmaterial = \"ground\"\n";

/// Corners of a ball, evenly spread.
std::vector<Vec3> ball(int corners) {
  std::vector<Vec3> x;
  for (int i = 0; i < corners; ++i) {
    const double z = 1 - (2 * i + 1.0) / corners, r = std::sqrt(1 - z * z),
                 a = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
    x.push_back(radius * Vec3(r * std::cos(a), r * std::sin(a), z) + Vec3(0, 0, 0.52));
  }
  return x;
}

/// Ground in cells of a size, each corner off by up to `rough` [m].
std::string terrain(double cell, double rough) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("footprints" + number(cell) + ".obj");
  std::ofstream out(file);
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> off(-rough, rough);
  const int n = static_cast<int>(std::lround(6 / cell)) + 1;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      out << "v " << i * cell - 2.97 << ' ' << j * cell - 2.93 << ' ' << off(rng) << '\n';
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 1; j < n; ++j) {
      const int a = i * n + j, b = a + n;
      out << "f " << a << ' ' << b << ' ' << b + 1 << "\nf " << a << ' ' << b + 1 << ' ' << a + 1 << '\n';
    }
  return "[site]\nterrain = \"" + file.string() + "\"\nmaterial = \"ground\"\n";
}

/// How far the centroid of a ball without weight goes beyond where it touches.
double sinks(int corners, const std::string& ground, const std::string& law) {
  SceneText s(Method::by_accuracy(1e-3), 0.05, Vec3::Zero());
  s.history(1e-4).material("rock", density).material("ground", density).interface("rock", "ground", 0, law);
  s.raw(ground);
  s.hull("B", ball(corners), Vec3(0, 0, 0.52), velocity(Vec3(0, 0, -speed)) + "deformable = false\n");
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  double z = o.rows.front().position[0].z();
  for (const auto& r : o.rows) z = std::min(z, r.position[0].z());
  EXPECT_LT(std::abs(o.last().ledger.algorithmic), 2e-3 * o.rows.front().ledger.kinetic);
  return radius - z;
}

/// Depth at which a work is done, by bisection.
template <class Work>
double depth_of(double energy, const Work& work) {
  double low = 0, high = radius;
  for (int i = 0; i < 60; ++i) (work(0.5 * (low + high)) < energy ? low : high) = 0.5 * (low + high);
  return low;
}

double energy_of_ball() {
  return 0.5 * density * 4 / 3 * std::numbers::pi * std::pow(radius, 3) * speed * speed;
}

/// p pi (r d^2 - d^3 / 3), the volume of the cap, and the springs' give on the way down.
double crushed_by() {
  return depth_of(energy_of_ball(),
                  [](double d) { return pressure * std::numbers::pi * (radius * d * d - d * d * d / 3); }) +
         0.5 * pressure / 1e9;
}

/// k pi (r d^3 / 3 - d^4 / 12).
double sprung_by() {
  return depth_of(energy_of_ball(), [](double d) {
    return stiffness * std::numbers::pi * (radius * d * d * d / 3 - d * d * d * d / 12);
  });
}

// With an area of its own for each corner, grown as a right-angled one, 42 corners sank 0.20 m and 2562 0.06
// m.
TEST(Footprints, ABallSinksAsItsFormSaysHoweverFineItsMesh) {
  for (const int corners : {60, 240, 960}) {
    const double coarse =
        9.0 / corners;  // part of the depth by which an inscribed ball of so many corners is off
    EXPECT_NEAR(sinks(corners, plane_ground, crushes), crushed_by(), (0.015 + coarse) * crushed_by())
        << corners;
    EXPECT_NEAR(sinks(corners, plane_ground, springs), sprung_by(), (0.015 + coarse) * sprung_by())
        << corners;
  }
}

// In cells of 0.2 m, 2 mm rough, it sank 0.05 m: the ground's own corners and edges pressed beside the
// ball's.
TEST(Footprints, HoweverFineTheGround) {
  for (const auto& [cell, rough] :
       {std::pair(3.0, 0.0), std::pair(1.0, 1e-3), std::pair(0.2, 2e-3), std::pair(0.1, 1e-3)}) {
    const std::string ground = terrain(cell, rough);
    EXPECT_NEAR(sinks(240, ground, crushes), crushed_by(), 0.06 * crushed_by()) << cell;
    EXPECT_NEAR(sinks(240, ground, springs), sprung_by(), 0.06 * sprung_by()) << cell;
  }
}

// Right-angled, 0.5 m high, edge down: m g h + m g d = p L d^2. Of 20 m it sank 0.38 m for 0.059 m.
TEST(Footprints, AnEdgeSinksTheSameHoweverLong) {
  const double h = 0.5, fall = 0.5;
  for (const double length : {0.5, 5.0, 20.0}) {
    SceneText s(Method::by_accuracy(1e-3), 0.5);
    s.history(1e-3)
        .material("rock", density)
        .material("ground", density)
        .interface("rock", "ground", 0,
                   "normal_stiffness = \"10 GPa/m\"\ncontact_law = { kind = \"crushing\", pressure = 1e6 }");
    s.raw(plane_ground);
    std::vector<Vec3> x;
    for (const double along : {-0.5 * length, 0.5 * length})
      for (const Vec3& p : {Vec3(along, 0, fall), Vec3(along, -h, fall + h), Vec3(along, h, fall + h)})
        x.push_back(p);
    s.hull("B", x, Vec3(0, 0, fall + 2 * h / 3), "deformable = false\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    double z = o.rows.front().position[0].z();
    for (const auto& r : o.rows) z = std::min(z, r.position[0].z());
    const double weight = density * 9.81 * h * h,  // for each metre
        right = depth_of(weight * fall, [&](double d) { return 1e6 * d * d - weight * d; });
    EXPECT_NEAR(2 * h / 3 - z, right, 0.01 * right) << length;
  }
}

// As it turns in a layer that hardens, cells that press more take each other's place: what they hold is more
// than p/k of depth, and cut down to that 8 % of the energy were lost to the scheme.
TEST(Footprints, ABallThatTurnsInALayerThatHardensLosesNothingElse) {
  SceneText s(Method::by_accuracy(1e-3), 0.3);
  s.history(1e-3)
      .material("rock", density)
      .material("ground", density)
      .interface("rock", "ground", 0.5,
                 "normal_stiffness = \"50 MPa/m\"\ncontact_law = { kind = \"crushing\", pressure = 4e5, "
                 "gradient = 2e6 }");
  s.raw(plane_ground);
  s.hull("B", ball(60), Vec3(0, 0, 0.52), velocity(Vec3(5, 0, -speed)) + "deformable = false\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double moved = o.rows.front().ledger.kinetic;
  EXPECT_GT(o.last().ledger.yield_work, 0.3 * moved);
  EXPECT_LT(std::abs(o.last().ledger.algorithmic), 2e-3 * moved);
}

// Past the border of the terrain is no ground, however near its rim is.
TEST(Footprints, ABallFallsPastTheBorder) {
  SceneText s(Method::by_accuracy(1e-3), 0.6);
  s.history(0.01)
      .material("rock", density)
      .material("ground", density)
      .interface("rock", "ground", 0, springs);
  s.raw(terrain(1, 0));
  std::vector<Vec3> x = ball(60);
  for (Vec3& p : x) p.x() += 3.03 + radius + 1e-3;
  s.hull("B", x, Vec3(3.03 + radius + 1e-3, 0, 0.52), "deformable = false\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_NEAR(o.last().position[0].z(), 0.52 - 0.5 * 9.81 * 0.36, 1e-6);
  EXPECT_NEAR(o.last().position[0].x(), 3.03 + radius + 1e-3, 1e-6);
}

// On a ridge under its middle, between corners, a cube is held by the points there: it does not come down on
// its corners.
TEST(Footprints, ACubeIsHeldByARidgeUnderItsMiddle) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "ridge.obj";
  std::ofstream(file) << "v -5 -5 -2\nv -5 5 -2\nv 0 -5 0\nv 0 5 0\nv 5 -5 -2\nv 5 5 -2\n"
                         "f 1 3 4\nf 1 4 2\nf 3 5 6\nf 3 6 4\n";
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.history(0.01)
      .material("rock", density)
      .material("ground", density)
      .interface("rock", "ground", 0.6, "normal_stiffness = \"10 MPa/m\"\ndamping_ratio = 0.3");
  s.raw("[site]\nterrain = \"" + file.string() + "\"\nmaterial = \"ground\"\n");
  s.box("B", Vec3::Ones(), Vec3(0, 0, 0.5), "deformable = false\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_GT(o.last().position[0].z(), 0.35);  // its corners hang 0.2 m above the slopes
}

}  // namespace
}  // namespace talus::verify

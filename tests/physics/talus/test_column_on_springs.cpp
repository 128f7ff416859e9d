// Oscillations that the springs of many blocks share.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Ways of n masses m one on the other, by springs k that only press, from unloaded rest under gravity, at
/// multiples of dt: leapfrog, some thousandth of a period a step.
std::vector<std::vector<double>> column(int n, double k, double m, double dt, int rows) {
  constexpr int parts = 10000;
  const double h = dt / parts;
  std::vector<double> z(static_cast<std::size_t>(n), 0.0), v(z), force(static_cast<std::size_t>(n) + 1, 0.0);
  std::vector<std::vector<double>> out{z};
  for (int i = 0; i < rows * parts; ++i) {
    for (std::size_t j = 0; j < z.size(); ++j)
      force[j] = std::max(0.0, k * ((j > 0 ? z[j - 1] : 0.0) - z[j]));
    for (std::size_t j = 0; j < z.size(); ++j)
      v[j] += (i == 0 ? 0.5 : 1.0) * h * ((force[j] - force[j + 1]) / m - g), z[j] += h * v[j];
    if ((i + 1) % parts == 0) out.push_back(z);
  }
  return out;
}

/// Each spring gives by about the accuracy, all of them together by 18 times that: the oscillation of the
/// column died within 0.3 s. Within the first 50 ms no contact opens and none meets.
void keeps_its_oscillation(int rows, const std::string& more = {}) {
  constexpr int n = 5;
  constexpr double k = 1e8, dt = 0.0125, accuracy = 1e-4;
  SceneText s(Method::by_accuracy(accuracy), rows * dt);
  const std::string law = "normal_stiffness = 1e8\n" + more;  // [N/m] at each of four corners
  s.history(dt).material("rock", 2500).material("ground", 2500).plane(Vec3::UnitZ());
  s.interface("rock", "rock", 0.3, law).interface("rock", "ground", 0.3, law);
  for (int i = 0; i < n; ++i)
    s.box("B" + std::to_string(i), Vec3::Ones(), Vec3(0, 0, i + 0.5), "deformable = false\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const auto expected = column(n, 4 * k, 2500, dt, rows);
  ASSERT_EQ(o.rows.size(), expected.size());
  double off = 0;
  for (std::size_t r = 0; r < expected.size(); ++r)
    for (std::size_t b = 0; b < n; ++b)
      off = std::max(off,
                     std::abs(o.rows[r].position[b].z() - (static_cast<double>(b) + 0.5) - expected[r][b]));
  EXPECT_LT(off, accuracy);
}

TEST(ColumnOnSprings, KeepsTheOscillationThatItsSpringsShare) { keeps_its_oscillation(8); }

/// An impulse at every step stopped what the springs carried: the column sank by a part that the accuracy
/// decided.
TEST(ColumnOnSprings, RestitutionIsOfWhatMeets) { keeps_its_oscillation(4, "restitution = 0.8"); }

}  // namespace
}  // namespace talus::verify

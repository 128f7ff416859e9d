// Free flight of the 1988 scheme: the parabola, the shear of Eq. (4), the growth without it, the missing
// gyroscopic terms.
#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "dda/shi1988_matrices.hpp"
#include "scene1988.hpp"

using namespace talus;
using namespace talus::dda;
using namespace talus::dda::test;

namespace {
/// Stretches of the vertex map, largest first.
Vec3 stretches(const Mat3& A) { return Eigen::JacobiSVD<Mat3>(A).singularValues(); }

Mat3 spun(bool corrected, double seconds, double dt) {
  Shi1988Settings settings;
  settings.post_correction = corrected;
  Scene s(0, 1e8, 1e8);
  s.model.gravity.setZero();
  s.add_box(Vec3(1, 1, 1), Vec3::Zero());
  s.state.w[0] = 10 * Vec3(1, 1, 1).normalized();
  const Shi1988 method(settings);
  const long n = std::lround(seconds / dt);
  for (long k = 0; k < n; ++k) s.step(method, dt);
  return s.history.map[0];
}
}  // namespace

TEST(Flight1988, ParabolaIsExact) {
  // Newmark with beta 0.5, gamma 1 integrates a constant acceleration exactly in position and velocity (A21).
  Scene s(0, 1e8, 1e8);
  s.add_box(Vec3(1, 2, 3), Vec3(0, 0, 100));
  s.state.v[0] = Vec3(3, -2, 5);
  s.state.w[0] = Vec3(0.1, 0.2, -0.3);
  const Shi1988 method;
  Shi1988Report r{};
  for (int k = 0; k < 200; ++k) {
    r = s.step(method, 0.005);
    EXPECT_LT(std::abs(Scene::dissipated(r)), 1e-6 * r.kinetic);
    EXPECT_EQ(r.iterations, 1);
    EXPECT_TRUE(r.settled());
  }
  const Vec3 expected = Vec3(0, 0, 100) + Vec3(3, -2, 5) + 0.5 * s.model.gravity;
  EXPECT_LT((s.state.c[0] - expected).norm(), 1e-11);
  EXPECT_LT((s.state.v[0] - (Vec3(3, -2, 5) + s.model.gravity)).norm(), 1e-12);
  // w stays where it is in world axes although the body turns: no gyroscopic terms.
  EXPECT_LT((s.state.w[0] - Vec3(0.1, 0.2, -0.3)).norm(), 1e-13);
}

TEST(Flight1988, ShearOfEquation4) {
  // About (1,1,1) one step multiplies lengths along the axis by 2 cos(r / sqrt 3) - 1 and across it by
  // |2 cos(r / sqrt 3) - 1 + i sqrt 3 sin(r / sqrt 3)|: 0.905 and 1.051 after 30 s at 10 rad/s with dt 1e-4.
  const double dt = 1e-4, r = 10 * dt / std::sqrt(3.0);
  const double along = 2 * std::cos(r) - 1, across = std::hypot(along, std::sqrt(3.0) * std::sin(r));
  EXPECT_NEAR(std::pow(along, 3e5), 0.905, 5e-4);
  EXPECT_NEAR(std::pow(across, 3e5), 1.051, 5e-4);

  const double seconds = full() ? 30 : 0.5;
  const Vec3 s = stretches(spun(true, seconds, dt));
  const double n = std::round(seconds / dt);
  EXPECT_NEAR(s[0], std::pow(across, n), 1e-9 * n);
  EXPECT_NEAR(s[1], std::pow(across, n), 1e-9 * n);
  EXPECT_NEAR(s[2], std::pow(along, n), 1e-9 * n);
  RecordProperty("stretches", testing::PrintToString(s.transpose()));
}

TEST(Flight1988, VolumeGrowsWithoutPostCorrection) {
  // det(I + [r]_x) = 1 + r^2 a step: 35 % in 30 s.
  const double dt = 1e-4, seconds = full() ? 30 : 0.5, n = std::round(seconds / dt);
  EXPECT_NEAR(std::pow(1 + 1e-6, 3e5), 1.35, 1e-3);
  EXPECT_NEAR(spun(false, seconds, dt).determinant(), std::pow(1 + 1e-6, n), 1e-9 * n);
}

TEST(Flight1988, IntermediateAxisIsMissed) {
  // A10: a 1 x 2 x 3 box spun about its intermediate axis with a small disturbance turns over; the reference
  // integrates Euler's equations with the classical Runge-Kutta method. The scheme keeps w in world axes and
  // never turns over.
  const Vec3 size(1, 2, 3), w0(0.01, 5, 0.01);
  const double T = 12.9012460037936, half = T / 2;
  Scene s(0, 1e8, 1e8);
  s.model.gravity.setZero();
  s.add_box(size, Vec3::Zero());
  s.state.w[0] = w0;
  const Mat3 J = s.model.blocks[0].inertia;

  Quat q = Quat::Identity();
  Vec3 w = w0;  // body axes
  const int n = 20000;
  const double h = half / n;
  const auto rate = [&](const Vec3& v) -> Vec3 { return J.inverse() * (J * v).cross(v); };
  for (int k = 0; k < n; ++k) {
    const Vec3 k1 = rate(w), k2 = rate(w + 0.5 * h * k1), k3 = rate(w + 0.5 * h * k2), k4 = rate(w + h * k3);
    const Vec3 next = w + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4),
               mean = 0.5 * (w + next) - h / 12 * (rate(next) - rate(w));
    q = (q * Quat(Eigen::AngleAxisd(mean.norm() * h, mean.normalized()))).normalized();
    w = next;
  }
  ASSERT_LT((w - Vec3(0.01, -5, -0.01)).norm(), 1e-5);  // the reference itself

  const Shi1988 method;
  const int steps = 6451;  // dt about 1e-3
  for (int k = 0; k < steps; ++k) s.step(method, half / steps);
  const Vec3 body = s.state.q[0].conjugate() * s.state.w[0];
  EXPECT_NEAR((body - w).norm(), 10, 0.05);  // w of the body has the wrong sign
  const double angle = s.state.q[0].angularDistance(q);
  EXPECT_NEAR(angle, 3.14, 0.02);
  RecordProperty("orientation_error_rad", std::to_string(angle));
  std::printf("orientation error at half a period: %.4f rad, |w error| %.4f rad/s\n", angle,
              (body - w).norm());
}

TEST(Flight1988, AngularMomentumIsNotKept) {
  // With w fixed in world axes the angular momentum of a block that is not a cube turns with it.
  Scene s(0, 1e8, 1e8);
  s.model.gravity.setZero();
  s.add_box(Vec3(1, 2, 3), Vec3::Zero());
  s.state.w[0] = Vec3(1, 2, 0.5);
  Vec3 p, before, after;
  momentum(s.model, s.state, 0, p, before);
  const Shi1988 method;
  for (int k = 0; k < 1000; ++k) s.step(method, 1e-3);
  momentum(s.model, s.state, 0, p, after);
  EXPECT_GT((after - before).norm(), 0.1 * before.norm());
}

TEST(Flight1988, StrainVibratesAndIsDamped) {
  // One breathing mode: the Newmark constants damp it, and what they take is booked.
  Scene s(0, 1e8, 1e8);
  s.model.gravity.setZero();
  s.add_box(Vec3(1, 1, 1), Vec3::Zero(), Quat::Identity(), 2500, 1e9);
  s.state.eps_rate[0] << 0.5, 0.5, 0.5, 0, 0, 0;
  const Shi1988 method;
  double kinetic = 0.5 * 3 * 0.25 * 2500.0 / 12, total = kinetic;
  for (int k = 0; k < 200; ++k) {
    const Shi1988Report r = s.step(method, 1e-4);
    total -= Scene::dissipated(r);
    EXPECT_NEAR(total, Scene::total(r), 1e-9 * kinetic);
    EXPECT_GE(r.newmark_strain, 0);
  }
  EXPECT_LT(total, 0.9 * kinetic);
}

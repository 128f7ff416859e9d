// What `accuracy` asks for it gets: the error against the closed form falls, a decade at a time, until
// round-off.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>

#include "sim/world.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double g = 9.81;
constexpr double deg = M_PI / 180;
constexpr double round_off = 1e-9;  // relative: what is exact at every accuracy stays exact

/// `by`: how much over all three decades, at least. The error estimate of a step follows the iteration within
/// it, not the trapezoid's own error.
void falls(const std::string& what, double by, const std::function<double(const Method&)>& error) {
  double last = INFINITY, first = 0;
  for (const double a : {1e-2, 1e-3, 1e-4, 1e-5}) {
    const double e = std::abs(error(Method::by_accuracy(a)));
    if (std::isinf(last)) first = e;
    // Two accuracies may take all but the same steps.
    EXPECT_LE(e, std::max(1.01 * last, round_off)) << what << ", accuracy " << a;
    last = e;
  }
  EXPECT_LE(last, std::max(first / by, round_off)) << what << ": over all three decades";
}

TEST(Accuracy, BounceOnSprings) {
  // Four corners on springs: y'' = g - w^2 y while y > 0, hence off again after (2/w) (pi - atan(v w / g))
  // with the speed that it came with.
  const double fall = 0.1, end = 0.35, w = std::sqrt(4e7 / 2600), v = std::sqrt(2 * g * fall),
               flight = end - v / g - 2 / w * (M_PI - std::atan(v * w / g));
  falls("height", 10, [&](const Method& m) {
    SceneText s(m, end);
    s.material("rock", 2600)
        .interface("rock", "ground", 0, "normal_stiffness = \"1e7 N/m\"")
        .plane(Vec3::UnitZ())
        .box("B", Vec3::Ones(), Vec3(0, 0, 0.5 + fall));
    return (run_scene(s.str()).last().position[0].z() - 0.5 - v * flight + 0.5 * g * flight * flight) / fall;
  });
}

TEST(Accuracy, SlidingDownAnIncline) {
  falls("path", 10, [](const Method& m) {
    const Mat3 axes = slope_axes(30 * deg);
    SceneText s(m, 1);
    s.material("rock", 2600)
        .interface("rock", "ground", 0.3)
        .plane(axes.col(2))
        .box("B", Vec3::Ones(), 0.5 * axes.col(2), turned(rotation_vector(axes)));
    const Outcome o = run_scene(s.str());
    const double expected = 0.5 * g * (std::sin(30 * deg) - 0.3 * std::cos(30 * deg));
    return axes.col(0).dot(o.last().position[0] - o.rows.front().position[0]) / expected - 1;
  });
}

TEST(Accuracy, Rocking) {
  // A block of 1 x 4 about its lower edge, let go at half of its critical angle: I x'' = -m g R sin(alpha -
  // x), I = 17/3 m, R^2 = 17/4.
  const double alpha = std::atan(0.25), rate = 3 * g * std::sqrt(17.0) / 34, end = 0.6;
  constexpr int steps = 20000;
  double x = alpha / 2, v = 0;
  const auto slope = [&](double y) { return -rate * std::sin(alpha - y); };
  for (int i = 0; i < steps; ++i) {  // Runge, Kutta
    const double h = end / steps, a1 = slope(x), a2 = slope(x + h / 2 * v),
                 a3 = slope(x + h / 2 * v + h * h / 4 * a1), a4 = slope(x + h * v + h * h / 2 * a2);
    x += h * v + h * h / 6 * (a1 + a2 + a3);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  falls("angle", 5, [&](const Method& m) {
    const Mat3 tilted = Eigen::AngleAxisd(alpha / 2, Vec3::UnitY()).toRotationMatrix();
    SceneText s(m, end);
    s.material("rock", 2600)
        .interface("rock", "ground", 10)
        .plane(Vec3::UnitZ())
        .box("B", Vec3(1, 1, 4), Vec3(0.5, 0, 0) + tilted * Vec3(-0.5, 0, 2),
             turned(rotation_vector(tilted)));
    const Outcome o = run_scene(s.str());
    return turn_about_y(o.last()) / x - 1;
  });
}

TEST(Accuracy, Wedge) {
  falls("acceleration", 10, [](const Method& m) {
    const WedgeScene w;
    // Normal forces hold the weight across the line; along it friction acts against what is left.
    const Vec3 down = -Vec3::UnitZ(), across = down - w.line * w.line.dot(down);
    Eigen::Matrix<double, 3, 2> normals;
    normals << w.normal_a, w.normal_b;
    const Eigen::Vector2d pressed =
        -(normals.transpose() * normals).inverse() * (normals.transpose() * across);
    const double expected = w.line.dot(down) - std::tan(20 * deg) * pressed.sum();
    const Outcome o = run_scene(w.text(m, 20 * deg, 0.5));
    return w.line.dot(o.last().position[0] - o.rows.front().position[0]) / (0.125 * g) / expected - 1;
  });
}

TEST(Accuracy, OverTheEdgeOfATable) {
  // A cube slides over the edge and tips; where it is after 1.2 s by fixed steps of 1e-5 s of our own, no
  // closed form.
  const Vec3 expected(0.9199214, 0, -1.3229271);
  for (const double a : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5}) {
    SceneText s(Method::by_accuracy(a), 1.2);
    s.material("rock", 2500)
        .interface("rock", "*", 0.3)
        .box("table", Vec3(4, 4, 1), Vec3(-2, 0, -0.5), "fixed = true\n")
        .box("B", Vec3::Ones(), Vec3(-0.6, 0, 0.5), velocity(Vec3(2.2, 0, 0)));
    const Outcome o = run_scene(s.str());
    const auto n = o.simulation->world().counters();
    EXPECT_LE((o.last().position[1] - expected).norm(), a) << a;
    EXPECT_LE(static_cast<double>(n.steps + n.rejected), 100 + 100 * std::sqrt(1e-3 / a)) << a;
  }
}

}  // namespace
}  // namespace talus::verify

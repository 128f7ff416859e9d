#include "verify/measures.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/bisect.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

Vec3 upward_normal(double dip_direction, double dip) {
  return {std::sin(dip) * std::sin(dip_direction), std::sin(dip) * std::cos(dip_direction), std::cos(dip)};
}
}  // namespace

WedgeScene::WedgeScene()
    : normal_a(upward_normal(130 * deg, 40 * deg)), normal_b(upward_normal(220 * deg, 60 * deg)) {
  line = normal_a.cross(normal_b).normalized();
  if (line.z() > 0) line = -line;
}

std::vector<Vec3> WedgeScene::corners() const {
  // One edge on the line, one more corner on each plane, upwards and outwards.
  Vec3 up_a = normal_a.cross(line), up_b = normal_b.cross(line);
  if (up_a.dot(normal_b) < 0) up_a = -up_a;
  if (up_b.dot(normal_a) < 0) up_b = -up_b;
  return {-line, line, 1.2 * up_a, 1.2 * up_b};
}

std::string WedgeScene::text(const Method& m, double phi, double duration, double speed) const {
  const std::vector<Vec3> all = corners();
  Vec3 centroid = Vec3::Zero();
  for (const Vec3& x : all) centroid += 0.25 * x;
  SceneText s(m, duration);
  s.material("rock", 2600, "young = \"30 GPa\"\npoisson = 0.25").interface("rock", "ground", std::tan(phi));
  s.plane(normal_a).plane(normal_b).hull("W", all, centroid, velocity(speed * line));
  return s.str();
}

double shaken_block_slip(double amplitude, double omega, double friction, double end) {
  // u: slip velocity of the block against the table, which accelerates with a(t) = A sin(w t). Stuck while
  // |a| <= mu g.
  const auto accelerate = [&](double t) { return amplitude * std::sin(omega * t); };
  const auto base_velocity = [&](double t) { return -amplitude / omega * std::cos(omega * t); };
  const auto base_place = [&](double t) { return -amplitude / (omega * omega) * std::sin(omega * t); };
  double t = 0, x = 0, u = 0;
  const double grain = 2 * std::numbers::pi / omega / 4000;
  while (t < end) {
    if (u == 0 && std::abs(accelerate(t)) <= friction * (1 + 1e-15)) {
      // Stuck: until |a| exceeds friction.
      double low = t, high = t;
      while (high < end && std::abs(accelerate(high)) <= friction * (1 + 1e-15)) {
        low = high;
        high += grain;
      }
      if (high >= end) break;
      t = bisect(low, high, [&](double at) { return std::abs(accelerate(at)) <= friction; }).second;
      if (t >= end) break;
    }
    // Slides with sign s until u returns to zero.
    const double s = u != 0 ? (u > 0 ? 1 : -1) : (accelerate(t) > 0 ? -1 : 1);
    const auto slip_velocity = [&](double q) {
      return u - s * friction * (q - t) - (base_velocity(q) - base_velocity(t));
    };
    const auto slip_place = [&](double q) {
      const double d = q - t;
      return x + u * d - 0.5 * s * friction * d * d - (base_place(q) - base_place(t) - base_velocity(t) * d);
    };
    double low = t + 1e-3 * grain, high = t + grain;
    while (high < end && s * slip_velocity(high) > 0) {
      low = high;
      high += grain;
    }
    if (high >= end && s * slip_velocity(end) > 0) {
      x = slip_place(end);
      return x;
    }
    high = std::min(high, end);
    high = bisect(low, high, [&](double at) { return s * slip_velocity(at) > 0; }).second;
    x = slip_place(high);
    t = high;
    u = 0;
    // Where the base still pulls harder than friction, it slides the other way at once.
    if (std::abs(accelerate(t)) > friction * (1 + 1e-15)) u = accelerate(t) > 0 ? -1e-300 : 1e-300;
  }
  return x;
}

Vec3 body_spin(const sim::HistoryRow& r) {
  const Quat q(r.orientation[0][0], r.orientation[0][1], r.orientation[0][2], r.orientation[0][3]);
  return q.toRotationMatrix().transpose() * r.spin[0];
}

double turn_about_y(const sim::HistoryRow& r) {
  return 2 * std::atan2(r.orientation[0][2], r.orientation[0][0]);
}

std::vector<Vec3> prism(int n, double radius, double length, double& inradius) {
  inradius = radius * std::cos(std::numbers::pi / n);
  std::vector<Vec3> points;
  for (int i = 0; i < n; ++i) {
    const double a = -std::numbers::pi / 2 + std::numbers::pi / n * (2 * i + 1);
    const double x = radius * std::cos(a);
    // The two lowest corners exactly at one height.
    const double z = i == 0 || i == n - 1 ? 0 : inradius + radius * std::sin(a);
    for (const double y : {-0.5 * length, 0.5 * length}) points.push_back({x, y, z});
  }
  return points;
}

std::string arch_text(const Method& m, int n, double thickness, double mu, double duration) {
  SceneText s(m, duration);
  s.material("rock", 2600, "young = \"30 GPa\"\npoisson = 0.25")
      .interface("rock", "ground", mu, "normal_stiffness = \"hard\"", 1e10)
      .interface("rock", "rock", mu, "normal_stiffness = \"hard\"", 1e10);
  s.plane(Vec3::UnitZ());
  const auto corner = [&](int i, double r) {
    const double a = std::numbers::pi * i / n;
    return Vec3(i == n ? -r : r * std::cos(a), 0, i == 0 || i == n ? 0 : r * std::sin(a));
  };
  for (int i = 0; i < n; ++i) {
    const Vec3 q[4] = {corner(i, 1 - thickness / 2), corner(i, 1 + thickness / 2),
                       corner(i + 1, 1 + thickness / 2), corner(i + 1, 1 - thickness / 2)};
    // Centroid of the quadrilateral by its two triangles.
    Vec3 centroid = Vec3::Zero();
    double area = 0;
    for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      const double part = (q[b] - q[a]).cross(q[c] - q[a]).norm();
      area += part;
      centroid += part * (q[a] + q[b] + q[c]) / 3;
    }
    centroid /= area;
    std::vector<Vec3> points;
    for (const Vec3& x : q)
      for (const double y : {-0.1, 0.1}) points.push_back(x + Vec3(0, y, 0));
    s.hull(fmt::format("V{}", i + 1), points, centroid);
  }
  return s.str();
}

}  // namespace talus::verify

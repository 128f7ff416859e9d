#include "coupling/touch/touch_tilt.hpp"

#include <cmath>
#include <vector>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {
namespace {

using Mat2 = Eigen::Matrix2d;
using Vec2 = Eigen::Vector2d;

struct Corner {
  Vec2 at;        // from the centre of pressure, across the normal [m]
  double spring;  // [m]
};

/// Keeps of the polygon where sign (spring - level) >= 0.
void keep(std::vector<Corner>& polygon, double sign, double level) {
  std::vector<Corner> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double va = sign * (a.spring - level), vb = sign * (b.spring - level);
    if (va >= 0) kept.push_back(a);
    if ((va >= 0) != (vb >= 0)) kept.push_back({a.at + va / (va - vb) * (b.at - a.at), level});
  }
  polygon.swap(kept);
}

}  // namespace

std::array<Vec3, 4> tilt_points(const contact::Footprint& part, const Vec3& p, const Vec3& n, double limit) {
  const Mat3 frame = contact_frame(n);
  const Eigen::Matrix<double, 2, 3> across = frame.rightCols<2>().transpose();
  double area = 0;
  Mat2 spread = Mat2::Zero();
  for (const contact::Column& c : part.columns) {
    if (c.full(limit)) continue;
    std::vector<Corner> pressed;
    for (std::size_t k = 0; k < 3; ++k) pressed.push_back({across * (c.place[k] - p), c.spring[k]});
    keep(pressed, 1, 0);
    keep(pressed, -1, limit);
    for (std::size_t k = 1; k + 1 < pressed.size(); ++k) {
      const Vec2 &a = pressed[0].at, &b = pressed[k].at, &d = pressed[k + 1].at, sum = a + b + d;
      const double part_area = 0.5 * std::abs((b - a).x() * (d - a).y() - (b - a).y() * (d - a).x());
      area += part_area;
      spread += part_area / 12 *
                (a * a.transpose() + b * b.transpose() + d * d.transpose() + sum * sum.transpose());
    }
  }
  std::array<Vec3, 4> points;
  points.fill(Vec3::Zero());
  if (!(area > 0)) return points;
  spread /= area;
  // The symmetric root of the spread takes the corners of a square to the points.
  const double root = std::sqrt(std::max(0.0, spread.determinant())), trace = spread.trace() + 2 * root;
  if (!(trace > 0)) return points;
  const Mat2 arm = (spread + root * Mat2::Identity()) / std::sqrt(trace);
  for (int i = 0; i < 4; ++i)
    points[static_cast<std::size_t>(i)] =
        across.transpose() * (arm * Vec2((i & 1) != 0 ? -1 : 1, (i & 2) != 0 ? -1 : 1));
  return points;
}

}  // namespace talus::coupling

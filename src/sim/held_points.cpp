#include "sim/held_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/QR>

namespace talus::sim {
namespace {

/// Solid angle of a triangle as seen from the origin, Van Oosterom and Strackee 1983 [sr].
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& x) {
  const Vec3 along = b - a;
  return a + std::clamp((x - a).dot(along) / along.squaredNorm(), 0.0, 1.0) * along;
}

Vec3 nearest_on_triangle(const std::array<Vec3, 3>& t, const Vec3& x) {
  const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]).normalized(), foot = x - n * n.dot(x - t[0]);
  bool within = true;
  Vec3 best = t[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[i], &b = t[(i + 1) % 3];
    within = within && n.cross(b - a).dot(foot - a) >= 0;
    const Vec3 p = nearest_on_segment(a, b, x);
    if ((p - x).squaredNorm() < (best - x).squaredNorm()) best = p;
  }
  return within ? foot : best;
}

}  // namespace

Vec3 nearest_of(const Polyhedron& body, const Vec3& x) {
  double winding = 0, least = std::numeric_limits<double>::infinity();
  Vec3 best = x;
  for (const std::array<int, 3>& ids : body.triangles) {
    std::array<Vec3, 3> t;
    for (std::size_t i = 0; i < 3; ++i) t[i] = body.vertices[static_cast<std::size_t>(ids[i])];
    winding += solid_angle(t[0] - x, t[1] - x, t[2] - x) / (4 * M_PI);
    const Vec3 p = nearest_on_triangle(t, x);
    if ((p - x).norm() < least) least = (p - x).norm(), best = p;
  }
  return winding > 0.5 ? x : best;
}

RigidMotion held_motion(double mass, const Mat3& inertia, std::span<const Vec3> arms,
                        const RigidMotion& given) {
  // In units of the root of the masses (1) is an orthogonal projection: x = L^T V, off the rows J L^-T.
  const Eigen::LLT<Mat3> turning(inertia);
  const auto rows = static_cast<Eigen::Index>(3 * arms.size());
  Eigen::MatrixXd scaled(6, rows);  // the rows' transposes
  for (Eigen::Index i = 0; i < rows / 3; ++i) {
    const Vec3& r = arms[static_cast<std::size_t>(i)];
    Mat3 cross;
    cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    scaled.block<3, 3>(0, 3 * i) = Mat3::Identity() / std::sqrt(mass);
    scaled.block<3, 3>(3, 3 * i) = turning.matrixL().solve(cross);  // w x r = -r x w, transposed
  }
  Eigen::Matrix<double, 6, 1> x;
  x << std::sqrt(mass) * given.v, turning.matrixU() * given.w;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  qr.setThreshold(1e-9);
  const Eigen::MatrixXd held = Eigen::MatrixXd(qr.householderQ()).leftCols(qr.rank());
  x -= held * (held.transpose() * x);
  return {x.head<3>() / std::sqrt(mass), turning.matrixU().solve(x.tail<3>())};
}

}  // namespace talus::sim

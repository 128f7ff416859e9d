#include "core/turn.hpp"

namespace talus {

Quat turn_between(const Vec3& a, const Vec3& b) {
  const Vec3 from = a.normalized(), to = b.normalized(), across = from.cross(to);
  const Quat q(1 + from.dot(to), across.x(), across.y(), across.z());
  if (q.norm() > 1e-8) return q.normalized();
  // Opposite as far as round-off tells.
  Eigen::Index least;
  from.cwiseAbs().minCoeff(&least);
  const Vec3 axis = from.cross(Vec3::Unit(least)).normalized();
  return Quat(0, axis.x(), axis.y(), axis.z());
}

}  // namespace talus

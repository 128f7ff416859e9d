/// Small fixed-size vectors and matrices that every folder shares. SI units throughout; x east, y north, z
/// up.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace talus {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Vec12 = Eigen::Matrix<double, 12, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat12 = Eigen::Matrix<double, 12, 12>;
using Quat = Eigen::Quaterniond;
using VecX = Eigen::VectorXd;
using MatX = Eigen::MatrixXd;

/// Axis-aligned box [min, max], m. Empty when min > max.
using Box3 = Eigen::AlignedBox3d;

/// [a]_x b = a x b.
inline Mat3 skew(const Vec3& a) {
  Mat3 s;
  s << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return s;
}

}  // namespace talus

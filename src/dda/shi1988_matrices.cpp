#include "dda/shi1988_matrices.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "dda/state.hpp"

namespace talus::dda::shi1988 {

Mat3x12 transformation(const Vec3& x) {
  Mat3x12 t = Mat3x12::Zero();
  t.leftCols<3>().setIdentity();
  t.middleCols<3>(3) = -skew(x);
  t(0, 6) = x.x();
  t(1, 7) = x.y();
  t(2, 8) = x.z();
  t(1, 9) = 0.5 * x.z();
  t(2, 9) = 0.5 * x.y();
  t(0, 10) = 0.5 * x.z();
  t(2, 10) = 0.5 * x.x();
  t(0, 11) = 0.5 * x.y();
  t(1, 11) = 0.5 * x.x();
  return t;
}

namespace {
/// One non-zero product of T_k^T T_l: M(row, col) += value S(k, l).
struct Product {
  int row, col, k, l;
  double value;
};
std::vector<Product> products() {
  std::array<Mat3x12, 3> t;  // T_k: T at the k-th unit vector, without the translations
  for (int k = 0; k < 3; ++k) {
    t[static_cast<std::size_t>(k)] = transformation(Vec3::Unit(k));
    t[static_cast<std::size_t>(k)].leftCols<3>().setZero();
  }
  std::vector<Product> out;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) {
      const Mat12 p = t[static_cast<std::size_t>(k)].transpose() * t[static_cast<std::size_t>(l)];
      for (int c = 0; c < 12; ++c)
        for (int r = 0; r < 12; ++r)
          if (p(r, c) != 0) out.push_back({r, c, k, l, p(r, c)});
    }
  return out;
}
}  // namespace

Mat12 mass_matrix(double mass, const Mat3& S) {
  static const std::vector<Product> list = products();
  Mat12 m = Mat12::Zero();
  m.topLeftCorner<3, 3>().diagonal().setConstant(mass);
  for (const Product& p : list) m(p.row, p.col) += p.value * S(p.k, p.l);
  return m;
}

Mat3 post_correction(const Vec3& r) {
  const Vec3 c = r.array().cos(), s = r.array().sin();
  Mat3 m;
  m << c.y() + c.z() - 2, -s.z(), s.y(),  //
      s.z(), c.x() + c.z() - 2, -s.x(),   //
      -s.y(), s.x(), c.x() + c.y() - 2;
  return m;
}

Mat3 step_map(const Vec3& r, const Vec6& eps, bool corrected) {
  return Mat3::Identity() + strain_tensor(eps) + (corrected ? post_correction(r) : skew(r));
}

Mat3 polar_rotation(const Mat3& A) {
  // Newton's iteration; quadratic, and A is near a rotation in all but pathological steps.
  Mat3 r = A;
  for (int k = 0; k < 60; ++k) {
    const Mat3 next = 0.5 * (r + r.inverse().transpose());
    const double change = (next - r).cwiseAbs().maxCoeff();
    r = next;
    if (change < 1e-15) break;
  }
  return r;
}

Vec6 rotate_strain(const Vec6& e, const Mat3& Q) {
  const Mat3 t = Q * strain_tensor(e) * Q.transpose();
  Vec6 out;
  out << t(0, 0), t(1, 1), t(2, 2), 2 * t(1, 2), 2 * t(2, 0), 2 * t(0, 1);
  return out;
}

double energy_density(const Vec6& s, double young, double poisson) {
  const double trace = s.head<3>().sum();
  const double square = s.head<3>().squaredNorm() + 2 * s.tail<3>().squaredNorm();
  return ((1 + poisson) * square - poisson * trace * trace) / (2 * young);
}

}  // namespace talus::dda::shi1988

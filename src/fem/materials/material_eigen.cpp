#include "fem/materials/material_eigen.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "fem/materials/material_damage.hpp"

namespace talus::material {

std::array<double, 3> principal_direction(const Sym& s, double value) {
  Mat3 tensor;
  tensor << s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2];
  const Eigen::SelfAdjointEigenSolver<Mat3> principal(tensor);
  Eigen::Index nearest = 0;
  (principal.eigenvalues().array() - value).abs().minCoeff(&nearest);
  const Vec3 n = principal.eigenvectors().col(nearest);
  return {n.x(), n.y(), n.z()};
}

std::array<double, 2> extreme_rates(const Sym& rate) {
  const double tensor[6] = {rate[0], rate[1], rate[2], 0.5 * rate[3], 0.5 * rate[4], 0.5 * rate[5]};
  const auto v = principal_values(tensor);
  return {v.first, v.third};
}

double crack_width(double l, const Sym& strain, const Sym& stress, double young, double poisson) {
  const double tr = stress[0] + stress[1] + stress[2];
  double inelastic[6];
  for (int i = 0; i < 3; ++i) inelastic[i] = strain[i] - ((1 + poisson) * stress[i] - poisson * tr) / young;
  for (int i = 3; i < 6; ++i) inelastic[i] = 0.5 * strain[i] - (1 + poisson) * stress[i] / young;
  return l * std::max(0.0, principal_values(inelastic).first);
}

}  // namespace talus::material

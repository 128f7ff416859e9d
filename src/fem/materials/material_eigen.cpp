#include "fem/materials/material_eigen.hpp"

#include <algorithm>
#include <cmath>

#include "fem/materials/material_damage.hpp"

namespace talus::material {

std::array<double, 3> principal_direction(const Sym& s, double value) {
  // Rows of s - value I span the plane normal to the direction: their largest cross product gives it; if all
  // vanish the value is repeated and a vector normal to the largest row, or any vector, is one.
  const double rows[3][3] = {
      {s[0] - value, s[5], s[4]}, {s[5], s[1] - value, s[3]}, {s[4], s[3], s[2] - value}};
  double scale = 0;
  for (const auto& r : rows)
    for (const double x : r) scale = std::max(scale, std::abs(x));
  if (scale == 0) return {1, 0, 0};
  std::array<double, 3> best{};
  double largest = 0;
  const auto offer = [&](const double* a, const double* b) {
    const std::array<double, 3> c{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                  a[0] * b[1] - a[1] * b[0]};
    const double sq = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    if (sq > largest) {
      largest = sq;
      best = c;
    }
  };
  offer(rows[0], rows[1]);
  offer(rows[1], rows[2]);
  offer(rows[2], rows[0]);
  if (largest < 1e-14 * scale * scale * scale * scale) {
    int row = 0;
    double norm = 0;
    for (int i = 0; i < 3; ++i) {
      const double sq = rows[i][0] * rows[i][0] + rows[i][1] * rows[i][1] + rows[i][2] * rows[i][2];
      if (sq > norm) {
        norm = sq;
        row = i;
      }
    }
    largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      double unit[3] = {0, 0, 0};
      unit[axis] = 1;
      offer(rows[row], unit);
    }
  }
  const double length = std::sqrt(largest);
  return {best[0] / length, best[1] / length, best[2] / length};
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

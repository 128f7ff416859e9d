/// Strain paths for tests of one material point.
#pragma once
#include <cmath>

#include "fem/materials/material_damage.hpp"

namespace talus::material::test {

/// Strain of an isotropic elastic point under the given stress: eps = C^-1 : s.
inline Sym strain_of(const Sym& s, double young, double poisson) {
  const double tr = s[0] + s[1] + s[2];
  Sym e{};
  for (int i = 0; i < 3; ++i) e[i] = ((1 + poisson) * s[i] - poisson * tr) / young;
  for (int i = 3; i < 6; ++i) e[i] = 2 * (1 + poisson) * s[i] / young;
  return e;
}

inline Sym scaled(const Sym& s, double f) {
  Sym out = s;
  for (double& x : out) x *= f;
  return out;
}

/// R s R^T for a rotation by the given angles about z, then x, then y; strains with halved shears go in and
/// out as tensors.
inline Sym rotated(const Sym& s, double a, double b, double c) {
  const double z[3][3] = {{std::cos(a), -std::sin(a), 0}, {std::sin(a), std::cos(a), 0}, {0, 0, 1}};
  const double x[3][3] = {{1, 0, 0}, {0, std::cos(b), -std::sin(b)}, {0, std::sin(b), std::cos(b)}};
  const double y[3][3] = {{std::cos(c), 0, std::sin(c)}, {0, 1, 0}, {-std::sin(c), 0, std::cos(c)}};
  double xz[3][3]{}, r[3][3]{}, t[3][3]{}, out[3][3]{};
  const double m[3][3] = {{s[0], s[5], s[4]}, {s[5], s[1], s[3]}, {s[4], s[3], s[2]}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) xz[i][j] += x[i][k] * z[k][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) r[i][j] += y[i][k] * xz[k][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) t[i][j] += r[i][k] * m[k][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) out[i][j] += t[i][k] * r[j][k];
  return {out[0][0], out[1][1], out[2][2], out[1][2], out[0][2], out[0][1]};
}

inline ConcreteDamage::Parameters c30(double cell = 0.1) {
  ConcreteDamage::Parameters p;
  p.concrete = mc2010(38e6);
  p.cell = CellFrame::cube(cell);
  p.rate_effect = false;
  return p;
}

/// Stress of a monotonic uniaxial compression test at strain magnitude eps in a cell of extent l [Pa,
/// positive].
inline double compression_curve(const ConcreteDamage::Parameters& p, double eps, double l) {
  const Concrete& c = p.concrete;
  const double f_0 = ConcreteDamage::elastic_limit * c.f_cm, eps_0 = f_0 / c.young;
  if (eps <= eps_0) return c.young * eps;
  if (eps >= c.eps_c1) return c.f_cm * std::exp(-(eps - c.eps_c1) * l * c.f_cm / c.crushing_energy);
  const double x = (eps - eps_0) / (c.eps_c1 - eps_0), k = c.young * (c.eps_c1 - eps_0) / (c.f_cm - f_0);
  return f_0 + (c.f_cm - f_0) * (k * x - x * x) / (1 + (k - 2) * x);
}

}  // namespace talus::material::test

#include "fem/law_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fem/material_simd.hpp"

namespace talus::fem {
namespace {

typedef double Points[8];
using material::V4, material::load4, material::store4;

void gradient_of(const LawGeometry& g, const double* field, Points (&h)[9]) {
  for (int c = 0; c < 3; ++c) {
    V4 sum[3][2] = {};  // axis, half of the points
#pragma GCC unroll 8
    for (int a = 0; a < 8; ++a) {
      const double value = field[g.node[a] + c];
#pragma GCC unroll 3
      for (int x = 0; x < 3; ++x) {
        sum[x][0] += value * load4(g.gradient[a][x]);
        sum[x][1] += value * load4(g.gradient[a][x] + 4);
      }
    }
#pragma GCC unroll 3
    for (int x = 0; x < 3; ++x) {
      store4(h[3 * c + x], sum[x][0]);
      store4(h[3 * c + x] + 4, sum[x][1]);
    }
  }
}

void symmetric_part(const Points* d, Points* out) {
  for (int q = 0; q < 8; ++q) {
    out[0][q] = d[0][q], out[1][q] = d[4][q], out[2][q] = d[8][q];
    out[3][q] = d[5][q] + d[7][q], out[4][q] = d[2][q] + d[6][q], out[5][q] = d[1][q] + d[3][q];
  }
}

/// Adds factor (H^T D) symmetrised: D = H with 1/2 gives the Green-Lagrange term, D = H' with 1 its rate.
void add_product(const Points* h, const Points* d, double factor, Points* out) {
  for (int i = 0; i < 3; ++i)
    for (int q = 0; q < 8; ++q) {
      const double x = h[3 * i][q], y = h[3 * i + 1][q], z = h[3 * i + 2][q];
      const double a = factor * d[3 * i][q], b = factor * d[3 * i + 1][q], c = factor * d[3 * i + 2][q];
      out[0][q] += x * a, out[1][q] += y * b, out[2][q] += z * c;
      out[3][q] += y * c + z * b, out[4][q] += x * c + z * a, out[5][q] += x * b + y * a;
    }
}

}  // namespace

void point_strains(const LawGeometry& g, const double* u, const double* v, bool finite, PointStrains& out) {
  Points(&h)[9] = out.displacement_gradient;
  gradient_of(g, u, h);
  symmetric_part(h, out.strain);
  if (finite) add_product(h, h, 0.5, out.strain);
  g.assumed.assume(out.strain);
  if (!v) return;
  Points hr[9];
  gradient_of(g, v, hr);
  symmetric_part(hr, out.rate);
  if (finite) add_product(h, hr, 1.0, out.rate);
  g.assumed.assume(out.rate);
}

void strains_before(const LawGeometry& g, const PointStrains& at, const double* v, double step, bool finite, double (&before)[6][8]) {
  Points h[9];
  gradient_of(g, v, h);
  for (int i = 0; i < 9; ++i)
    for (int q = 0; q < 8; ++q) h[i][q] = at.displacement_gradient[i][q] - step * h[i][q];
  symmetric_part(h, before);
  if (finite) add_product(h, h, 0.5, before);
  g.assumed.assume(before);
}

void nodal_force(const LawGeometry& g, const PointStrains& at, const double (*stress)[8], bool finite, double* force) {
  const Points* h = at.displacement_gradient;
  Points t[6];
  g.assumed.transpose(stress, t);
  Points p[9];
  for (int q = 0; q < 8; ++q) {
    const double s[9] = {t[0][q], t[5][q], t[4][q], t[5][q], t[1][q], t[3][q], t[4][q], t[3][q], t[2][q]};
    for (int i = 0; i < 9; ++i) p[i][q] = g.volume * s[i];
  }
  if (finite) {
    Points s[9];
    std::memcpy(s, p, sizeof p);
    for (int c = 0; c < 3; ++c)
      for (int x = 0; x < 3; ++x)
        for (int q = 0; q < 8; ++q) p[3 * c + x][q] += h[3 * c][q] * s[x][q] + h[3 * c + 1][q] * s[3 + x][q] + h[3 * c + 2][q] * s[6 + x][q];
  }
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) {
      Points sum;
      for (int q = 0; q < 8; ++q)
        sum[q] = p[3 * c][q] * g.gradient[a][0][q] + p[3 * c + 1][q] * g.gradient[a][1][q] + p[3 * c + 2][q] * g.gradient[a][2][q];
      force[3 * a + c] = ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
    }
}

double largest_strain(const PointStrains& at) {
  double most = 0;
  const Points* e = at.strain;
  for (int q = 0; q < 8; ++q) {
    const double norm_sq = e[0][q] * e[0][q] + e[1][q] * e[1][q] + e[2][q] * e[2][q] + 0.5 * (e[3][q] * e[3][q] + e[4][q] * e[4][q] + e[5][q] * e[5][q]);
    most = std::max(most, norm_sq);
  }
  return std::sqrt(most);
}

}  // namespace talus::fem

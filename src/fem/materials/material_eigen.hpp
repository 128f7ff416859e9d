/// Principal values of a symmetric 3 x 3 tensor and its split into tension and compression, without branches.
///
///   s = m I + p B,  m = tr s / 3,  p = sqrt(J2 / 3)
///   x^3 - 3 x - 2 r = 0 for the eigenvalues x of B,  r = det B / 2 in [-1, 1]
///
/// The root of largest magnitude, 2 cos(acos(|r|) / 3) in [sqrt 3, 2], is smooth in |r| over [0, 1]: a
/// polynomial of degree 7 (error 2.2e-8) and one Newton step give it to round-off without trigonometric
/// functions. The other two follow as -x/2 +- sqrt(3 - 3 x^2 / 4). Where those two nearly coincide their
/// difference is good to sqrt(round-off), about 1e-8 p.
///
/// The split needs no eigenvectors. With one eigenvalue e whose sign differs from the other two (a, b), its
/// part of the tensor is, by Cayley-Hamilton,
///
///   e n (x) n = e (s - a I)(s - b I) / ((e - a)(e - b)),
///
/// and since |e| <= min(|e - a|, |e - b|) the expression stays bounded when e approaches a or b.
#pragma once
#include <algorithm>
#include "fem/materials/material_simd.hpp"
#include "fem/materials/material_types.hpp"

namespace talus::material {

template <class R>
struct Principal {
  R first, second, third;  ///< first >= second >= third
};

/// 2 cos(acos(q) / 3), the largest root of x^3 - 3 x - 2 q = 0, for q in [0, 1].
template <class R>
inline R far_root(R q) {
  R x = q * 0x1.2249a4f240d50p-10 + -0x1.843bc9e190d4cp-8;
  x = x * q + 0x1.f9dc3393addb6p-7;
  x = x * q + -0x1.d57a14192cdf6p-6;
  x = x * q + 0x1.8fdd83c348c5ep-5;
  x = x * q + -0x1.89de545dba39cp-4;
  x = x * q + 0x1.55548f518b99dp-2;
  x = x * q + 0x1.bb67aee434c7cp+0;
  const R x_sq = x * x;
  return x - ((x_sq - 3.0) * x - 2.0 * q) / (3.0 * x_sq - 3.0);
}

/// cos(acos(c) / 3) for c in [-1, 1].
inline double cosine_of_third(double c) {
  const double x = far_root(std::abs(c));
  return c >= 0 ? 0.5 * x : 0.5 * (0.5 * x + std::sqrt(std::max(0.0, 3.0 - 0.75 * x * x)));
}

template <class R>
inline Principal<R> principal_values(const R (&s)[6]) {
  const R m = (s[0] + s[1] + s[2]) * (1.0 / 3.0);
  const R a = s[0] - m, b = s[1] - m, c = s[2] - m;
  const R yz = s[3], zx = s[4], xy = s[5];
  const R off = yz * yz + zx * zx + xy * xy;
  const R j2 = 0.5 * (a * a + b * b + c * c) + off;
  const R det = a * (b * c - yz * yz) - xy * (xy * c - yz * zx) + zx * (xy * yz - b * zx);
  const R p_sq = j2 * (1.0 / 3.0);
  const R p = square_root(p_sq);
  const R cube = p_sq * p;
  const R zero = spread(0.0, m), one = spread(1.0, m);
  const auto round = cube > 1e-290;  // otherwise the tensor is hydrostatic to the last bit
  const R r = select(round, 0.5 * det / select(round, cube, one), zero);
  const R q = minimum(maximum(r, -r), one);
  const R x = far_root(q);
  const R gap = square_root(maximum(3.0 - 0.75 * x * x, zero));
  const R near_high = -0.5 * x + gap, near_low = -0.5 * x - gap;
  const auto flip = r < zero;  // the mirrored spectrum
  return {m + p * select(flip, -near_low, x), m + p * select(flip, -near_high, near_high),
          m + p * select(flip, -x, near_low)};
}

/// The part of s that belongs to its positive principal values.
template <class R>
inline void positive_part(const R (&s)[6], const Principal<R>& v, R (&plus)[6]) {
  const R zero = spread(0.0, s[0]), one = spread(1.0, s[0]);
  const auto all = v.third >= zero;
  const auto none = v.first <= zero;
  const auto single =
      v.second <= zero;  // one positive value at most: it is the odd one, otherwise the third is
  const R odd = select(single, v.first, v.third);
  const R a = v.second, b = select(single, v.third, v.first);
  const R denominator = (odd - a) * (odd - b);
  const auto regular = denominator > 1e-290;
  const R scale = select(regular, odd / select(regular, denominator, one), zero);
  const R sum = a + b, product = a * b;
  const R square[6] = {s[0] * s[0] + s[5] * s[5] + s[4] * s[4], s[5] * s[5] + s[1] * s[1] + s[3] * s[3],
                       s[4] * s[4] + s[3] * s[3] + s[2] * s[2], s[5] * s[4] + s[1] * s[3] + s[3] * s[2],
                       s[0] * s[4] + s[5] * s[3] + s[4] * s[2], s[0] * s[5] + s[5] * s[1] + s[4] * s[3]};
  for (int i = 0; i < 6; ++i) {
    R part = square[i] - sum * s[i];
    if (i < 3) part = part + product;
    part = scale * part;
    plus[i] = select(all, s[i], select(none, zero, select(single, part, s[i] - part)));
  }
}

/// Unit eigenvector to the given principal value (scalar; used where a crack forms, not in the hot loop). For
/// a repeated value any vector of its space is returned, the same one for the same input.
std::array<double, 3> principal_direction(const Sym& s, double value);

}  // namespace talus::material

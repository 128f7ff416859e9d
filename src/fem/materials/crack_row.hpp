/// Rows of leaning cells that cracks run along, for laws that see the crack and not its row.
///
/// A crack of normal n that crosses a row of normal m opens it by a jump delta over the row's thickness,
/// eps = sym(delta m). The law sees, and forces go by the transpose of,
///
///   eps' = eps + share (c sym(delta n) - sym(delta m)),   delta = 2 eps m - (m . eps m) m,   c = m . n
///
/// share: damage in tension. R is a double, V4 or V8. Included by the files that make laws for one of them,
/// each with its own instruction set: nothing here may exist for the same R in two of them.
#pragma once
#include <cmath>

#include "fem/materials/material_damage.hpp"
#include "fem/materials/material_eigen.hpp"

namespace talus::material {

namespace {
/// The part of a symmetric tensor's product with n that lies in the plane normal to n; `normal_part` the
/// rest.
template <class R>
inline void in_plane(const R (&s)[6], const R (&n)[3], double shear, R (&t)[3], R& normal_part) {
  t[0] = s[0] * n[0] + shear * (s[5] * n[1] + s[4] * n[2]);
  t[1] = s[1] * n[1] + shear * (s[5] * n[0] + s[3] * n[2]);
  t[2] = s[2] * n[2] + shear * (s[4] * n[0] + s[3] * n[1]);
  normal_part = t[0] * n[0] + t[1] * n[1] + t[2] * n[2];
  for (int i = 0; i < 3; ++i) t[i] = t[i] - normal_part * n[i];
}
template <class R>
inline R dot(const R (&a)[3], const R (&b)[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class R>
struct CrackRow {
  R m[3], n[3], c, share;

  /// eps' in place of the strain.
  void see_crack(R (&e)[6]) const {
    R v[3], normal;
    in_plane(e, m, 0.5, v, normal);  // e m = v + normal m
    R jump[3];
    for (int i = 0; i < 3; ++i) jump[i] = 2.0 * v[i] + normal * m[i];
    R turned[3];
    for (int i = 0; i < 3; ++i) turned[i] = share * (c * n[i] - m[i]);
    for (int i = 0; i < 3; ++i) {
      const int y = (i + 1) % 3, z = (i + 2) % 3;
      e[i] = e[i] + jump[i] * turned[i];
      e[3 + i] = e[3 + i] + jump[y] * turned[z] + jump[z] * turned[y];
    }
  }
  /// Its transpose, of the stress.
  void press_row(R (&s)[6]) const {
    R turned[3], r[3];
    for (int i = 0; i < 3; ++i) turned[i] = share * (c * n[i] - m[i]);
    r[0] = s[0] * turned[0] + s[5] * turned[1] + s[4] * turned[2];
    r[1] = s[5] * turned[0] + s[1] * turned[1] + s[3] * turned[2];
    r[2] = s[4] * turned[0] + s[3] * turned[1] + s[2] * turned[2];
    const R across = dot(r, m);
    for (int i = 0; i < 3; ++i) {
      const int y = (i + 1) % 3, z = (i + 2) % 3;
      s[i] = s[i] + (2.0 * r[i] - across * m[i]) * m[i];
      s[3 + i] = s[3 + i] + r[y] * m[z] + r[z] * m[y] - across * m[y] * m[z];
    }
  }
};

/// The row of a leaning cell that a crack of this normal runs along, that with the largest |n . g_k|.
template <class R>
inline CrackRow<R> row_along(const CellFrame& cell, const R (&normal)[3], R share) {
  const R zero = spread(0.0, share);
  CrackRow<R> row{{zero, zero, zero}, {normal[0], normal[1], normal[2]}, zero, share};
  R most = spread(-1.0, zero);
  for (const auto& g : cell.dual) {
    const double size = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    const R along = g[0] * normal[0] + g[1] * normal[1] + g[2] * normal[2],
            way = maximum(along, zero - along);
    const auto better = way > most;
    const R sign = select(along < 0.0, spread(-1 / size, zero), spread(1 / size, zero));
    for (int i = 0; i < 3; ++i) row.m[i] = select(better, g[i] * sign, row.m[i]);
    row.c = select(better, way * (1 / size), row.c);
    most = maximum(most, way);
  }
  return row;
}

}  // namespace
}  // namespace talus::material

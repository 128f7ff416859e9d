/// Products with the three rows of a Jacobian, four columns at a time: what sweeps, directions and residuals
/// spend most of their time on.
///
///   u = J x,   x += J^T p
///
/// symbol   meaning                                    unit             shape
/// J        rows n, t1, t2 of a term, row major        kg^-1/2          3 x n
/// x        velocities of its body                     m/s kg^1/2       n
/// p        impulse                                    N s              3
#pragma once
#include <cstring>

#include "core/types.hpp"

namespace talus::contact::detail {

using Two = double __attribute__((vector_size(16)));
using Four = double __attribute__((vector_size(32)));

template <class V>
inline V load(const double* from) {
  V v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

template <class V>
inline void store(const V& v, double* to) {
  std::memcpy(to, &v, sizeof v);
}

inline double sum_of(const Four& a, const Two& b) {
  const Two s = __builtin_shufflevector(a, a, 0, 1) + __builtin_shufflevector(a, a, 2, 3) + b;
  return s[0] + s[1];
}

/// Sum of products of the first `Rows` rows of terms with the velocities of their bodies.
template <int Rows>
class RowSums {
 public:
  template <int N>
  void add(const double* J, const double* x) {
    constexpr int fours = N / 4 * 4, twos = N / 2 * 2;
    for (int k = 0; k < fours; k += 4) {
      const Four v = load<Four>(x + k);
      for (int r = 0; r < Rows; ++r) four_[r] += load<Four>(J + r * N + k) * v;
    }
    for (int k = fours; k < twos; k += 2) {
      const Two v = load<Two>(x + k);
      for (int r = 0; r < Rows; ++r) two_[r] += load<Two>(J + r * N + k) * v;
    }
    for (int k = twos; k < N; ++k)
      for (int r = 0; r < Rows; ++r) two_[r][0] += J[r * N + k] * x[k];
  }
  void add(const double* J, int n, const double* x) {
    switch (n) {
      case 3: return add<3>(J, x);
      case 6: return add<6>(J, x);
      case 12: return add<12>(J, x);
    }
    for (int k = 0; k < n; ++k)
      for (int r = 0; r < Rows; ++r) two_[r][0] += J[r * n + k] * x[k];
  }
  double operator[](int r) const { return sum_of(four_[r], two_[r]); }

 private:
  Four four_[Rows] = {};
  Two two_[Rows] = {};
};

template <int N>
inline void add_transposed(const double* J, const Vec3& p, double* x) {
  constexpr int fours = N / 4 * 4, twos = N / 2 * 2;
  for (int k = 0; k < fours; k += 4)
    store<Four>(load<Four>(x + k) + load<Four>(J + k) * p.x() + load<Four>(J + N + k) * p.y() +
                    load<Four>(J + 2 * N + k) * p.z(),
                x + k);
  for (int k = fours; k < twos; k += 2)
    store<Two>(load<Two>(x + k) + load<Two>(J + k) * p.x() + load<Two>(J + N + k) * p.y() +
                   load<Two>(J + 2 * N + k) * p.z(),
               x + k);
  for (int k = twos; k < N; ++k) x[k] += J[k] * p.x() + J[N + k] * p.y() + J[2 * N + k] * p.z();
}

/// x += J^T p of a 3 x n block.
inline void add_transposed(const double* J, int n, const Vec3& p, double* x) {
  switch (n) {
    case 3: return add_transposed<3>(J, p, x);
    case 6: return add_transposed<6>(J, p, x);
    case 12: return add_transposed<12>(J, p, x);
  }
  for (int k = 0; k < n; ++k) x[k] += J[k] * p.x() + J[n + k] * p.y() + J[2 * n + k] * p.z();
}

}  // namespace talus::contact::detail

/// Four doubles at once with the vector extension of the compiler, and the same operations for one double, so
/// that a kernel is written once. No alignment is assumed in memory: load and store go through memcpy.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace talus::material {

typedef double V4 __attribute__((vector_size(32)));
typedef std::int64_t M4 __attribute__((vector_size(32)));

template <class R>
inline R load(const double* p) {
  R v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <class R>
inline void store(double* p, const R& v) {
  std::memcpy(p, &v, sizeof v);
}
inline V4 load4(const double* p) { return load<V4>(p); }
inline void store4(double* p, V4 v) { store(p, v); }
inline double sum_of(V4 a) { return (a[0] + a[2]) + (a[1] + a[3]); }
/// How many doubles an R holds.
template <class R>
constexpr int width = static_cast<int>(sizeof(R) / sizeof(double));

inline V4 spread(double a, V4) { return V4{a, a, a, a}; }
inline double spread(double a, double) { return a; }

inline V4 select(M4 mask, V4 a, V4 b) { return mask ? a : b; }
inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline V4 maximum(V4 a, V4 b) { return a > b ? a : b; }
inline double maximum(double a, double b) { return a > b ? a : b; }
inline V4 minimum(V4 a, V4 b) { return a < b ? a : b; }
inline double minimum(double a, double b) { return a < b ? a : b; }
inline bool any(M4 m) { return (m[0] | m[1] | m[2] | m[3]) != 0; }
inline bool any(bool m) { return m; }

inline double square_root(double a) { return std::sqrt(a); }
inline V4 square_root(V4 a) {
#ifdef __AVX__
  return __builtin_ia32_sqrtpd256(a);
#else
  return V4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
#endif
}

/// y 2^n, n in the low bits of `shifted`.
inline double scale_by_power(double shifted, double y) {
  return y * std::bit_cast<double>((std::bit_cast<std::int64_t>(shifted) + 1023) << 52);
}
inline V4 scale_by_power(V4 shifted, V4 y) {
  const M4 bits = (M4)shifted + 1023;
  return y * (V4)(bits << 52);
}

/// exp(x) for x in [-700, 0] (clamped to it), relative error below 4e-16: x = n ln 2 + r, Taylor series of
/// degree 13 in r.
template <class R>
inline R exponential(R x) {
  x = maximum(minimum(x, spread(0.0, x)), spread(-700.0, x));
  constexpr double magic = 0x1.8p52;  // adding it rounds to an integer that stands in the low bits
  const R shifted = x * 1.4426950408889634 + magic;
  const R n = shifted - magic;
  const R r = (x - n * 0x1.62e42fefa0000p-1) - n * 0x1.cf79abc9e3b3ap-40;
  R p = spread(1.0 / 6227020800.0, x);
  p = p * r + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  return scale_by_power(shifted, p);
}

/// atan(x) for x >= 0, relative error below 4e-16: reduced at tan(3 pi/8) and 0.66, then the rational
/// function of the Cephes library.
template <class R>
inline R arctangent(R x) {
  const R one = spread(1.0, x), zero = spread(0.0, x);
  const auto far = x > 2.414213562373095, middle = x > 0.66;
  const R y =
      select(far, zero - one, select(middle, x - 1.0, x)) / select(far, x, select(middle, x + 1.0, one));
  const R z = y * y;
  const R p =
      (((-0.8750608600031904 * z - 16.157537187333652) * z - 75.00855792314705) * z - 122.88666844901361) *
          z -
      64.85021904942025;
  const R q = ((((z + 24.858464901423062) * z + 165.02700983169885) * z + 432.88106049129027) * z +
               485.3903996359137) *
                  z +
              194.5506571482614;
  return select(far, spread(1.5707963267948966, x), select(middle, spread(0.7853981633974483, x), zero)) +
         (y + y * z * p / q);
}

/// Eight doubles as two vectors of four: what V8 (material_simd8.hpp) is without AVX-512, as far as strains
/// and forces need it.
struct V44 {
  V4 low, high;
  V44() = default;
  V44(V4 a, V4 b) : low(a), high(b) {}
  V44(double a) : low(spread(a, V4{})), high(low) {}
  friend V44 operator+(V44 a, V44 b) { return {a.low + b.low, a.high + b.high}; }
  friend V44 operator-(V44 a, V44 b) { return {a.low - b.low, a.high - b.high}; }
  friend V44 operator*(V44 a, V44 b) { return {a.low * b.low, a.high * b.high}; }
  friend V44 operator/(V44 a, V44 b) { return {a.low / b.low, a.high / b.high}; }
};
inline V44 maximum(V44 a, V44 b) { return {maximum(a.low, b.low), maximum(a.high, b.high)}; }
inline V44 minimum(V44 a, V44 b) { return {minimum(a.low, b.low), minimum(a.high, b.high)}; }
inline V44 square_root(V44 a) { return {square_root(a.low), square_root(a.high)}; }

template <>
inline V44 load<V44>(const double* p) {
  return {load<V4>(p), load<V4>(p + 4)};
}
template <>
inline void store<V44>(double* p, const V44& v) {
  store(p, v.low), store(p + 4, v.high);
}

/// The doubles whose numbers differ in the bit `stride` (1, 2 or 4) change places.
template <int stride>
inline V44 exchanged(V44 a) {
  if constexpr (stride == 4) return {a.high, a.low};
  constexpr M4 order = stride == 1 ? M4{1, 0, 3, 2} : M4{2, 3, 0, 1};
  return {__builtin_shuffle(a.low, order), __builtin_shuffle(a.high, order)};
}
inline V4 first_four(V44 a) { return a.low; }
inline V4 last_four(V44 a) { return a.high; }

}  // namespace talus::material

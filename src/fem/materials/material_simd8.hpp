/// Eight doubles in one vector of the processor (AVX-512), with the operations of material_simd.hpp. Only for
/// files that are compiled for such processors and called on no others.
#pragma once
#include <immintrin.h>

#include "fem/materials/material_simd.hpp"

namespace talus::material {

struct M8 {
  __mmask8 bits;
  friend M8 operator&(M8 a, M8 b) { return {static_cast<__mmask8>(a.bits & b.bits)}; }
  friend M8 operator|(M8 a, M8 b) { return {static_cast<__mmask8>(a.bits | b.bits)}; }
};

struct V8 {
  __m512d v;
  V8() = default;
  V8(__m512d a) : v(a) {}
  V8(double a) : v(_mm512_set1_pd(a)) {}
  friend V8 operator+(V8 a, V8 b) { return a.v + b.v; }
  friend V8 operator-(V8 a, V8 b) { return a.v - b.v; }
  friend V8 operator*(V8 a, V8 b) { return a.v * b.v; }
  friend V8 operator/(V8 a, V8 b) { return a.v / b.v; }
  V8 operator-() const { return -v; }
  friend M8 operator>(V8 a, V8 b) { return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_GT_OQ)}; }
  friend M8 operator<(V8 a, V8 b) { return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LT_OQ)}; }
  friend M8 operator>=(V8 a, V8 b) { return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_GE_OQ)}; }
  friend M8 operator<=(V8 a, V8 b) { return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LE_OQ)}; }
  friend M8 operator==(V8 a, V8 b) { return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_EQ_OQ)}; }
};

constexpr __mmask8 all_eight = 0xff;  // the forms without a mask warn of uninitialised values in GCC 12

inline V8 spread(double a, V8) { return V8(a); }
inline V8 select(M8 mask, V8 a, V8 b) { return _mm512_mask_blend_pd(mask.bits, b.v, a.v); }
inline V8 maximum(V8 a, V8 b) { return _mm512_maskz_max_pd(all_eight, a.v, b.v); }
inline V8 minimum(V8 a, V8 b) { return _mm512_maskz_min_pd(all_eight, a.v, b.v); }
inline bool any(M8 m) { return m.bits != 0; }
inline V8 square_root(V8 a) { return _mm512_maskz_sqrt_pd(all_eight, a.v); }

inline V8 scale_by_power(V8 shifted, V8 y) {
  const __m512i exponent = _mm512_add_epi64(_mm512_castpd_si512(shifted.v), _mm512_set1_epi64(1023));
  return y * V8(_mm512_castsi512_pd(_mm512_maskz_slli_epi64(all_eight, exponent, 52)));
}

template <int stride>
inline V8 exchanged(V8 a) {
  if constexpr (stride == 4)
    return __builtin_shufflevector(a.v, a.v, 4, 5, 6, 7, 0, 1, 2, 3);
  else if constexpr (stride == 2)
    return __builtin_shufflevector(a.v, a.v, 2, 3, 0, 1, 6, 7, 4, 5);
  else
    return __builtin_shufflevector(a.v, a.v, 1, 0, 3, 2, 5, 4, 7, 6);
}
inline V4 first_four(V8 a) { return __builtin_shufflevector(a.v, a.v, 0, 1, 2, 3); }
inline V4 last_four(V8 a) { return __builtin_shufflevector(a.v, a.v, 4, 5, 6, 7); }

}  // namespace talus::material

#include "fem/kernels/law_points_body.inc"
#include "fem/materials/material_simd8.hpp"

namespace talus::fem {

const LawPoints& law_points_avx512() { return all_of<material::V8>; }

}  // namespace talus::fem

#include "fem/materials/material_simd8.hpp"
// The body is written in terms of the vectors above.
#include "fem/kernels/law_points_body.inc"

namespace talus::fem {

const LawPoints& law_points_avx512() { return all_of<material::V8>; }

}  // namespace talus::fem

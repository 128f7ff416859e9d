#include "fem/material_simd8.hpp"
#include "fem/law_points_body.inc"

namespace talus::fem {

const LawPoints& law_points_avx512() { return all_of<material::V8>; }

}  // namespace talus::fem

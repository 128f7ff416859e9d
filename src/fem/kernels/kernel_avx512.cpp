#define TALUS_W 8
#include "fem/kernels/kernel_body.inc"

const Kernels& kernels_avx512() {
  static const Kernels set{W, "avx512", internal_force, bulk_viscosity};
  return set;
}

}  // namespace talus::fem

#define TALUS_W 4
#include "fem/kernels/kernel_body.inc"

const Kernels& kernels_avx2() {
  static const Kernels set{W, "avx2", internal_force, bulk_viscosity};
  return set;
}

}  // namespace talus::fem

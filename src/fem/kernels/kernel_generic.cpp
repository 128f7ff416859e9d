#define TALUS_W 4
#include "fem/kernels/kernel_body.inc"

const Kernels& kernels_generic() {
  static const Kernels set{W, "generic", internal_force, bulk_viscosity};
  return set;
}

}  // namespace talus::fem

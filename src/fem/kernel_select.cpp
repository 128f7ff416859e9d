#include <cstdlib>
#include <cstring>

#include "fem/kernel.hpp"

namespace talus::fem {

const Kernels& kernels() {
  static const Kernels& chosen = []() -> const Kernels& {
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    const char* asked = std::getenv("TALUS_KERNELS");
    if (asked && std::strcmp(asked, "generic") == 0) return kernels_generic();
    if (asked && std::strcmp(asked, "avx2") == 0 && avx2) return kernels_avx2();
    if (avx512) return kernels_avx512();
    if (avx2) return kernels_avx2();
    return kernels_generic();
  }();
  return chosen;
}

}  // namespace talus::fem

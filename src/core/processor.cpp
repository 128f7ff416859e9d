#include "core/processor.hpp"

#include <cstdlib>
#include <cstring>

namespace talus {

InstructionSet instruction_set() {
  static const InstructionSet chosen = [] {
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                        __builtin_cpu_supports("avx512vl");
    const char* asked = std::getenv("TALUS_KERNELS");
    if (asked && std::strcmp(asked, "generic") == 0) return InstructionSet::generic;
    if (asked && std::strcmp(asked, "avx2") == 0 && avx2) return InstructionSet::avx2;
    return avx512 ? InstructionSet::avx512 : avx2 ? InstructionSet::avx2 : InstructionSet::generic;
  }();
  return chosen;
}

}  // namespace talus

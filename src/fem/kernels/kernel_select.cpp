#include "core/processor.hpp"
#include "fem/kernels/kernel.hpp"

namespace talus::fem {

const Kernels& kernels() {
  switch (instruction_set()) {
    case InstructionSet::avx512: return kernels_avx512();
    case InstructionSet::avx2: return kernels_avx2();
    case InstructionSet::generic: break;
  }
  return kernels_generic();
}

}  // namespace talus::fem

/// Which vectors the processor at hand has: code in files of its own instruction set is chosen by it, once a
/// run.
#pragma once

namespace talus {

enum class InstructionSet { generic, avx2, avx512 };

/// The best that the processor has; "generic", "avx2" or "avx512" in TALUS_KERNELS overrules, but for what it
/// does not have.
InstructionSet instruction_set();

}  // namespace talus

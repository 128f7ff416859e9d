// Blocks striking structures: not run through scenes yet; said so, never passed over.
#include "verify/suite.hpp"

namespace talus::verify {

std::vector<Case> coupling_cases() {
  return {{"coupling", "C", "Blocks striking structures", "Timoshenko 1913; d'Alembert", true, [](CaseRun& c) { c.unavailable("no case of this suite is part of this build"); }}};
}

}  // namespace talus::verify

#pragma once
#include "core/error.hpp"

namespace talus::fem {

/// A factor that this machine has no room for.
class NotEnoughMemory : public NumericalFailure {
 public:
  using NumericalFailure::NumericalFailure;
};

}  // namespace talus::fem

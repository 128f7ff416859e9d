/// Takes the numbers of a saved state one after the other.
#pragma once
#include <span>

#include "core/error.hpp"

namespace talus::fem {

class StateReader {
 public:
  explicit StateReader(std::span<const double> state) : left_(state) {}
  /// Throw NumericalFailure where it ends before.
  double next() { return *take(1); }
  const double* take(std::size_t count) {
    if (count > left_.size()) throw NumericalFailure("the saved state belongs to another structure");
    const double* const first = left_.data();
    left_ = left_.subspan(count);
    return first;
  }
  /// A number of things that the state holds after it.
  std::size_t count() {
    const double n = next();
    if (!(n >= 0 && n <= static_cast<double>(left_.size())))
      throw NumericalFailure("the saved state belongs to another structure");
    return static_cast<std::size_t>(n);
  }
  bool empty() const { return left_.empty(); }

 private:
  std::span<const double> left_;
};

}  // namespace talus::fem

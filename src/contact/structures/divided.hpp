/// A structure of which several processes may hold a part each.
#pragma once
#include <span>
#include <vector>

namespace talus {

class DividedStructure {
 public:
  virtual ~DividedStructure() = default;
  /// As Structure::save() and restore(), of what this process holds alone. All of them call these together.
  virtual void save_here(std::vector<double>& state) const = 0;
  virtual void restore_here(std::span<const double> state) = 0;
};

}  // namespace talus

/// Disjoint sets of the numbers 0 to n - 1. The lowest number of a set is its name, whatever the order in
/// which its members were joined.
#pragma once
#include <algorithm>
#include <numeric>
#include <vector>

namespace talus {

class DisjointSets {
 public:
  explicit DisjointSets(int n) : parent_(static_cast<std::size_t>(n)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// The lowest number in the set of `i`.
  int root(int i) {
    while (up(i) != i) i = up(i) = up(up(i));
    return i;
  }

  void join(int a, int b) {
    a = root(a), b = root(b);
    up(std::max(a, b)) = std::min(a, b);
  }

 private:
  int& up(int i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<int> parent_;
};

}  // namespace talus

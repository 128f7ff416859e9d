/// A list as a set: ascending, each value once.
#pragma once
#include <algorithm>
#include <vector>

namespace talus {

template <class Value>
void sort_unique(std::vector<Value>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace talus

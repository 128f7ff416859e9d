/// Places of structures' nodes in a list that every contact problem begins anew.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

namespace talus::coupling {

class NodePlaces {
 public:
  void clear() { ++round_, count_ = 0; }
  /// Where the node stands, and whether it was given its place, the next one, by this call.
  std::pair<int, bool> place(int structure, int node) {
    const auto s = static_cast<std::size_t>(structure), n = static_cast<std::size_t>(node);
    if (s >= seen_.size()) seen_.resize(s + 1);
    if (n >= seen_[s].size()) seen_[s].resize(n + 1);
    Seen& seen = seen_[s][n];
    const bool fresh = seen.round != round_;
    if (fresh) seen = {round_, count_++};
    return {seen.place, fresh};
  }

 private:
  struct Seen {
    std::uint32_t round = 0;  // in which it was placed
    int place = 0;
  };
  std::vector<std::vector<Seen>> seen_;  // by structure and node
  std::uint32_t round_ = 1;
  int count_ = 0;
};

}  // namespace talus::coupling

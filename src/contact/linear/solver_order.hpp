/// In which order sweeps visit the contacts: as the problem lists them, which brings loads down a tower in
/// one sweep.
///
/// In large problems the bodies are parted in halves, and these again. Contacts within a part are visited in
/// the order of the problem, then, level by level, those between the halves of what was parted last. No two
/// groups of a level share a body: they do not feel each other, and several threads may visit them.
#pragma once
#include <algorithm>
#include <atomic>
#include <span>
#include <utility>
#include <vector>

#include "contact/parallel.hpp"

namespace talus::contact::detail {

struct System;

class VisitingOrder {
 public:
  static constexpr int contacts_of_part =
      2000;  // at least, on the average; the order may depend on the problem, never on the threads
  /// Groups of a level that a thread visits in turn: those that follow each other in one wait for each
  /// other's velocities, those of two groups do not.
  static constexpr int at_once = 2;
  void find(const System& system);
  int levels() const { return static_cast<int>(first_.size()) - 1; }
  int groups(int level) const {
    return first_[static_cast<std::size_t>(level) + 1] - first_[static_cast<std::size_t>(level)];
  }
  /// Contacts of a group, in the order of the problem.
  std::span<const int> group(int level, int k) const {
    const auto [from, to] = groups_[static_cast<std::size_t>(first_[static_cast<std::size_t>(level)] + k)];
    return std::span(visits_).subspan(static_cast<std::size_t>(from), static_cast<std::size_t>(to - from));
  }

  /// Calls visit(contact) for all contacts, `forward` or the other way round; on several threads if `wide`.
  /// Returns for how many it was true.
  template <class Visit>
  long each(bool forward, bool wide, Visit&& visit) const {
    std::atomic<long> count_of_true = 0;
    for (int k = 0; k < levels(); ++k) {
      const int level = forward ? k : levels() - 1 - k, first = first_[static_cast<std::size_t>(level)];
      in_ranges(groups(level), wide ? 1 : groups(level), [&](int from, int to) {
        long here = 0;
        for (int g = first + from; g < first + to; g += at_once) {
          const int last = std::min(g + at_once, first + to);
          bool any = true;
          for (int k = 0; any; ++k) {
            any = false;
            for (int a = g; a < last; ++a) {
              const auto [begin, end] = groups_[static_cast<std::size_t>(a)];
              if (begin + k >= end) continue;
              here += visit(visits_[static_cast<std::size_t>(forward ? begin + k : end - 1 - k)]) ? 1 : 0;
              any = true;
            }
          }
        }
        count_of_true.fetch_add(here, std::memory_order_relaxed);
      });
    }
    return count_of_true;
  }

 private:
  void list_neighbours(const System& system);
  void spread(std::span<int> bodies, int node, int start);
  void part(const System& system, std::span<int> bodies, int node, int parts);

  std::vector<int> visits_;                  // contacts, by group
  std::vector<std::pair<int, int>> groups_;  // of visits_, from and to; by level
  std::vector<int> first_;                   // group of every level
  std::vector<int> node_;  // per body: of the tree of halves, whose root is 1 and whose node k has the halves
                           // 2 k and 2 k + 1
  std::vector<int> first_neighbour_, neighbours_;
  std::vector<int> bodies_, reached_, group_of_;
};

}  // namespace talus::contact::detail

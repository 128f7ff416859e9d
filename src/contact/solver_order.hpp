/// In which order sweeps visit the contacts. In large problems runs of contacts that follow each other are coloured, no two of a colour on the same body, and
/// visited colour by colour: those of one colour do not feel each other, and several threads may visit them. In small problems all contacts are one run:
/// what is one above the other is visited in turn, which brings loads down a tower in one sweep.
#pragma once
#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "contact/parallel.hpp"

namespace talus::contact::detail {

struct System;

class VisitingOrder {
 public:
  static constexpr int coloured_from = 4000, run_length = 192;   // contacts; the order may depend on the problem, never on the threads
  /// Groups of a colour that a thread visits in turn: those that follow each other in one wait for each other's velocities, those of two groups do not.
  static constexpr int at_once = 2;
  void find(const System& system);
  int colours() const { return static_cast<int>(first_.size()) - 1; }

  /// Calls visit(contact) for all contacts, `forward` or the other way round; on several threads if `wide`. Returns for how many it was true.
  template <class Visit>
  long each(bool forward, bool wide, Visit&& visit) const {
    std::atomic<long> count_of_true = 0;
    for (int k = 0; k < colours(); ++k) {
      const int c = forward ? k : colours() - 1 - k, first = first_[static_cast<std::size_t>(c)], count = first_[static_cast<std::size_t>(c) + 1] - first;
      in_ranges(count, wide ? 1 : count, [&](int from, int to) {
        long here = 0;
        for (int g = first + from; g < first + to; g += at_once) {
          const int last = std::min(g + at_once, first + to);
          bool any = true;
          for (int k = 0; any; ++k) {
            any = false;
            for (int a = g; a < last; ++a) {
              const auto [begin, end] = groups_[static_cast<std::size_t>(a)];
              if (begin + k >= end) continue;
              here += visit(forward ? begin + k : end - 1 - k) ? 1 : 0;
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
  std::vector<std::pair<int, int>> groups_;   // of contacts, from and to; by colour
  std::vector<int> first_;                    // group of every colour
  std::vector<std::pair<int, int>> runs_;
  std::vector<int> colour_;
  std::vector<unsigned long long> taken_;     // per body: colours of its groups
};

}  // namespace talus::contact::detail

#include "contact/solver_order.hpp"

#include <algorithm>
#include <bit>

#include "contact/solver_system.hpp"

namespace talus::contact::detail {

void VisitingOrder::find(const System& system) {
  const int nc = system.contacts();
  groups_.clear();
  if (nc < coloured_from) {
    groups_.emplace_back(0, nc);
    first_ = {0, 1};
    return;
  }
  runs_.clear();
  for (int i = 0; i < nc; i += run_length) runs_.emplace_back(i, std::min(i + run_length, nc));
  // The least colour that no run on one of its bodies has; beyond 63 each run has one of its own.
  taken_.assign(system.body.size(), 0);
  colour_.clear();
  int last = 0;
  for (const auto& [begin, end] : runs_) {
    const auto first_term = system.terms.begin() + system.touch[begin].first, last_term = system.terms.begin() + system.touch[end - 1].first + system.touch[end - 1].count;
    unsigned long long taken = 0;
    for (auto term = first_term; term != last_term; ++term) taken |= taken_[term->body];
    const int least = std::countr_one(taken), colour = least < 63 ? least : std::max(last + 1, 63);
    if (least < 63)
      for (auto term = first_term; term != last_term; ++term) taken_[term->body] |= 1ull << colour;
    last = std::max(last, colour);
    colour_.push_back(colour);
  }
  first_.assign(static_cast<std::size_t>(last) + 2, 0);
  for (const int c : colour_) ++first_[static_cast<std::size_t>(c) + 1];
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  groups_.resize(runs_.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t g = 0; g < runs_.size(); ++g) groups_[static_cast<std::size_t>(next[static_cast<std::size_t>(colour_[g])]++)] = runs_[g];
}

}  // namespace talus::contact::detail

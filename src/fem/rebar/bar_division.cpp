#include "fem/rebar/bar_division.hpp"

namespace talus::fem {

void BarDivision::hold(const std::vector<rebar::Segment>& whole) {
  in_all_ = whole.size();
  for (std::size_t k = 0; k < whole.size(); ++k)
    if (k == 0 || whole[k].bar != whole[k - 1].bar) first_.push_back(static_cast<int>(k));
}

void BarDivision::divide(std::vector<int> numbers, Partition& partition) {
  number_ = std::move(numbers);
  number_.shrink_to_fit();
  partition_ = &partition;
}

int BarDivision::segment(int number) const {
  if (partition_ == nullptr) return number;
  const auto at = std::lower_bound(number_.begin(), number_.end(), number);
  return at == number_.end() || *at != number ? -1 : static_cast<int>(at - number_.begin());
}

void BarTies::find_broken(const std::vector<material::Steel::State>& states) {
  std::vector<double> mine;
  for (std::size_t k = 0; k < states.size(); ++k)
    if (division_.own(bars_.segments()[k].cell) && states[k].broken > 0) mine.push_back(division_.number(k));
  if (division_.partition() != nullptr) mine = division_.partition()->collect(mine);
  broken_.assign(mine.begin(), mine.end());
  std::sort(broken_.begin(), broken_.end());
  stale_ = true;
}

void BarTies::visit(const std::function<void(int, int, int)>& use) const {
  if (stale_) {
    stale_ = false;
    ties_.clear();
    tied_.clear();
    const auto& segments = bars_.segments();
    const auto holds = [this](int k) { return !std::binary_search(broken_.begin(), broken_.end(), k); };
    // The pair k is of segments k and k + 1 of the whole.
    for (std::size_t k = 0; k < segments.size(); ++k) {
      const int n = division_.number(k);
      const bool seen = k > 0 && division_.number(k - 1) == n - 1,
                 next = k + 1 < segments.size() && division_.number(k + 1) == n + 1;
      if (!seen && !division_.starts(n) && holds(n - 1) && holds(n))
        ties_.push_back({n - 1, -1, segments[k].cell});
      if (n + 1 < static_cast<int>(division_.in_all()) && !division_.starts(n + 1) && holds(n) &&
          holds(n + 1))
        ties_.push_back({n, segments[k].cell, next ? segments[k + 1].cell : -1});
    }
  }
  for (const auto& [number, a, b] : ties_) use(number, a, b);
}

const std::vector<char>& BarTies::tied(std::size_t cells) const {
  if (!stale_ && tied_.size() == cells) return tied_;
  std::vector<char> held(cells, 0);
  visit([&](int, int a, int b) {
    for (const int cell : {a, b})
      if (cell >= 0) held[static_cast<std::size_t>(cell)] = 1;
  });
  tied_.swap(held);
  return tied_;
}

}  // namespace talus::fem

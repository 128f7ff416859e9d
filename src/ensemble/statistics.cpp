#include "ensemble/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "ensemble/random.hpp"
#include "ensemble/sobol.hpp"

namespace talus::ensemble {
namespace {

constexpr int resamples = 2000;

/// Percentile of values that stand for `count` equal ones each; sorted by value, `total` of them in all.
double weighted_percentile(std::span<const double> values, std::span<const std::int32_t> counts, long total,
                           double percent) {
  if (total == 0) return none;
  const double place = static_cast<double>(total - 1) * percent / 100;
  const long k = std::min(total - 1, static_cast<long>(place));
  const double f = place - static_cast<double>(k);
  long passed = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    passed += counts[i];
    if (passed <= k) continue;
    const double low = values[i];
    if (f == 0 || passed > k + 1) return low;
    for (std::size_t j = i + 1; j < values.size(); ++j)
      if (counts[j] > 0) return low + f * (values[j] - low);
    return low;
  }
  return none;
}

Estimate interval(double value, std::vector<double>& drawn) {
  std::erase_if(drawn, [](double x) { return !std::isfinite(x); });
  std::sort(drawn.begin(), drawn.end());
  return {value, percentile(drawn, 2.5), percentile(drawn, 97.5)};
}

}  // namespace

double percentile(std::span<const double> sorted, double percent) {
  if (sorted.empty()) return none;
  const double place = static_cast<double>(sorted.size() - 1) * percent / 100;
  const auto k = std::min(sorted.size() - 1, static_cast<std::size_t>(place));
  if (k + 1 == sorted.size()) return sorted[k];
  return sorted[k] + (place - static_cast<double>(k)) * (sorted[k + 1] - sorted[k]);
}

long enough_for(double percent) {
  return static_cast<long>(std::ceil(std::log(0.05) / std::log(percent / 100)));
}

std::string interval_text(const Estimate& e, double scale, int digits) {
  const auto text = [&](double x) { return fmt::format("{:.{}g}", scale * x, digits); };
  if (!std::isfinite(e.low)) return std::isfinite(e.high) ? text(e.high) + " or less" : "";
  return text(e.low) + (std::isfinite(e.high) ? " to " + text(e.high) : " or more");
}

Estimate wilson(long k, long n) {
  if (n == 0) return {none, none, none};
  return wilson_share(static_cast<double>(k) / static_cast<double>(n), static_cast<double>(n));
}

Estimate wilson_share(double p, double n) {
  const double z2 = normal_975 * normal_975;
  const double centre = (p + z2 / (2 * n)) / (1 + z2 / n),
               half = normal_975 / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  return {p, p <= 0 ? 0.0 : std::max(0.0, centre - half), p >= 1 ? 1.0 : std::min(1.0, centre + half)};
}

Bootstrap::Bootstrap(std::span<const Sample> members, std::uint32_t seed, bool replicated)
    : members_(members.begin(), members.end()), seed_(seed), replicated_(replicated) {}

std::vector<Estimate> Bootstrap::percentiles(std::span<const double> percents) const {
  std::vector<double> values;
  std::vector<std::size_t> owner;  // member of each value, in their order
  for (std::size_t i = 0; i < members_.size(); ++i)
    if (members_[i].crosses) owner.push_back(i);
  std::sort(owner.begin(), owner.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(members_[a].value, a) < std::pair(members_[b].value, b);
  });
  for (const std::size_t i : owner) values.push_back(members_[i].value);
  std::vector<Estimate> found;
  if (values.empty()) return std::vector<Estimate>(percents.size(), Estimate{none, none, none});
  std::vector<std::int32_t> place(members_.size(), -1), counts(values.size());
  for (std::size_t k = 0; k < owner.size(); ++k) place[owner[k]] = static_cast<std::int32_t>(k);
  std::vector<std::vector<double>> drawn(percents.size());
  const auto n = static_cast<std::uint64_t>(members_.size());
  for (std::uint32_t b = 0; b < resamples; ++b) {
    std::fill(counts.begin(), counts.end(), 0);
    long total = 0;
    if (replicated_) {
      std::array<int, replicates> weight{};
      for (std::uint32_t r = 0; r < replicates; ++r)
        ++weight[static_cast<std::size_t>(bits(seed_, for_bootstrap, r, b, 0) % replicates)];
      for (std::size_t k = 0; k < owner.size(); ++k) {
        counts[k] = weight[static_cast<std::size_t>(members_[owner[k]].index % replicates)];
        total += counts[k];
      }
    } else {
      // Four draws of 32 bits from one block of the generator; n is far below 2^32.
      for (std::uint64_t i = 0; i < n; i += 4) {
        const Counter x = philox({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32), b, 0},
                                 seed_, for_bootstrap);
        for (std::uint64_t q = 0; q < 4 && i + q < n; ++q) {
          const std::int32_t at =
              place[static_cast<std::size_t>((static_cast<std::uint64_t>(x[q]) * n) >> 32)];
          if (at >= 0) ++counts[static_cast<std::size_t>(at)], ++total;
        }
      }
    }
    for (std::size_t p = 0; p < percents.size(); ++p)
      drawn[p].push_back(weighted_percentile(values, counts, total, percents[p]));
  }
  const auto crossing = static_cast<long>(values.size());
  for (std::size_t p = 0; p < percents.size(); ++p) {
    Estimate& e = found.emplace_back(interval(percentile(values, percents[p]), drawn[p]));
    if (crossing < enough_for(percents[p])) e.high = none;
    if (crossing < enough_for(100 - percents[p])) e.low = none;
  }
  return found;
}

Estimate Bootstrap::probability() const {
  const auto n = static_cast<long>(members_.size());
  const auto k = static_cast<long>(
      std::count_if(members_.begin(), members_.end(), [](const Sample& s) { return s.crosses; }));
  if (!replicated_ || n < replicates) return wilson(k, n);
  std::array<double, replicates> hits{}, size{};
  for (const Sample& s : members_) {
    const auto r = static_cast<std::size_t>(s.index % replicates);
    size[r] += 1;
    hits[r] += s.crosses ? 1 : 0;
  }
  std::vector<double> drawn;
  for (std::uint32_t b = 0; b < resamples; ++b) {
    double sum = 0, of = 0;
    for (std::uint32_t r = 0; r < replicates; ++r) {
      const auto q = static_cast<std::size_t>(bits(seed_, for_bootstrap, r, b, 0) % replicates);
      sum += hits[q], of += size[q];
    }
    drawn.push_back(of > 0 ? sum / of : none);
  }
  const Estimate found = interval(static_cast<double>(k) / static_cast<double>(n), drawn);
  return found.low < found.high ? found : wilson(k, n);
}

}  // namespace talus::ensemble

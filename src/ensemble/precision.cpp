#include "ensemble/precision.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace talus::ensemble {

Precision precision_of(const Ensemble& ensemble, const Briefs& briefs) {
  Precision p;
  p.asked = *ensemble.settings().precision;
  const auto line =
      static_cast<std::size_t>(std::find_if(ensemble.lines().begin(), ensemble.lines().end(),
                                            [&](const PlanLine& l) { return l.name == p.asked.line; }) -
                               ensemble.lines().begin());
  const auto quantity = static_cast<std::size_t>(
      std::find(quantities.begin(), quantities.end(), p.asked.quantity) - quantities.begin());
  const std::vector<Sample> samples = samples_of(briefs, line, quantity);
  p.members = static_cast<long>(samples.size());
  p.crossing = static_cast<long>(std::ranges::count_if(samples, &Sample::crosses));
  if (p.crossing == 0) return p;
  const Bootstrap bootstrap(samples, ensemble.settings().seed,
                            ensemble.settings().design == scene::Ensemble::Design::sobol);
  const Estimate e = bootstrap.percentiles(std::array{p.asked.percentile}).front();
  p.within = 0.5 * (e.high - e.low) / std::abs(e.value);
  p.reached = p.within <= p.asked.within;  // false for NaN: an end that the members do not bound
  return p;
}

std::string unreached_text(const Precision& p) {
  if (p.reached) return {};
  const std::string what = fmt::format("the {:g}th percentile of {} at line {}", p.asked.percentile,
                                       p.asked.quantity, p.asked.line),
                    remedy = "raise ensemble.members, or ask for less";
  if (!std::isfinite(p.within))
    return fmt::format(
        "precision not reached: {} is to be known within {:g} of it, and {} of {} members cross the line, "
        "which takes {}; {}",
        what, p.asked.within, p.crossing, p.members,
        enough_for(std::max(p.asked.percentile, 100 - p.asked.percentile)), remedy);
  return fmt::format(
      "precision not reached: {} is known within {:.3g} of it, {:g} was asked for, of {} members; {}", what,
      p.within, p.asked.within, p.members, remedy);
}

}  // namespace talus::ensemble

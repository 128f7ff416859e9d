#include "io/force_track.hpp"

#include <algorithm>
#include <cmath>

#include "io/report_parts.hpp"

namespace talus::io {
namespace {

constexpr double bin = 1e-4;         // [s]
constexpr std::size_t margin = 50;   // bins of no force before and after, for the filter

}  // namespace

void ForceTrack::add(double t, double dt, const Vec3& force) {
  const double start = (t - dt) / bin, end = t / bin;
  const long from = static_cast<long>(std::floor(start)), to = std::max(from + 1, static_cast<long>(std::ceil(end)));
  if (impulse_.empty()) first_ = from;
  if (from < first_) {
    impulse_.insert(impulse_.begin(), static_cast<std::size_t>(first_ - from), Vec3::Zero());
    first_ = from;
  }
  if (static_cast<std::size_t>(to - first_) > impulse_.size()) impulse_.resize(static_cast<std::size_t>(to - first_), Vec3::Zero());
  for (long k = from; k < to; ++k) {
    const double share = std::min(end, static_cast<double>(k + 1)) - std::max(start, static_cast<double>(k));
    impulse_[static_cast<std::size_t>(k - first_)] += std::max(share, 0.0) * bin * force;
  }
}

double ForceTrack::filtered_peak() const {
  if (impulse_.empty()) return 0;
  std::vector<double> x(impulse_.size() + 2 * margin, 0.0);
  std::transform(impulse_.begin(), impulse_.end(), x.begin() + margin, [](const Vec3& j) { return j.norm() / bin; });
  const std::vector<double> y = low_pass(std::move(x), bin, force_cutoff);
  return *std::max_element(y.begin(), y.end());
}

}  // namespace talus::io

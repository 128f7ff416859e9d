#include "io/force_track.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "io/report_parts.hpp"

namespace talus::io {
namespace {

constexpr double bin = 1e-4;         // [s]
constexpr std::size_t margin = 50;   // bins of no force before and after, for the filter
constexpr std::size_t piece = 2000, remembered = 200;   // bins
constexpr double latest = 1e15, longest = 1e6;          // bins that a run can come to, and that one row can take: beyond, a journal's row is no row

}  // namespace

void ForceTrack::add(double t, double dt, const Vec3& force) {
  const double start = (t - dt) / bin, end = t / bin;
  if (!(std::abs(start) < latest && std::abs(end) < latest && end >= start && end - start < longest)) return;
  if (!impulse_.empty() && std::abs(start - static_cast<double>(first_)) > static_cast<double>(impulse_.size()) + longest) {   // a contact of its own: nothing is left in the filter
    peak_ = filtered_peak();
    impulse_.clear();
    goes_on_ = false;
  }
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
  if (impulse_.size() < piece) return;
  peak_ = std::max(peak_, peak_here(false));
  const std::size_t gone = impulse_.size() - remembered;
  impulse_.erase(impulse_.begin(), impulse_.begin() + static_cast<std::ptrdiff_t>(gone));
  first_ += static_cast<long>(gone);
  goes_on_ = true;
}

/// Where the force begins and ends there is none before and after; where a piece is cut the filter goes on with its last value.
double ForceTrack::peak_here(bool ends) const {
  if (impulse_.empty()) return 0;
  std::vector<double> x(goes_on_ ? 0 : margin, 0.0);
  std::transform(impulse_.begin(), impulse_.end(), std::back_inserter(x), [](const Vec3& j) { return j.norm() / bin; });
  if (ends) x.resize(x.size() + margin, 0.0);
  const std::vector<double> y = low_pass(std::move(x), bin, force_cutoff);
  // What is near a cut belongs to the piece that holds more around it.
  const std::size_t from = goes_on_ ? std::min(remembered / 2, y.size()) : 0, to = ends ? y.size() : y.size() - std::min(remembered / 2, y.size());
  return from < to ? *std::max_element(y.begin() + static_cast<std::ptrdiff_t>(from), y.begin() + static_cast<std::ptrdiff_t>(to)) : 0;
}

double ForceTrack::filtered_peak() const { return std::max(peak_, peak_here(true)); }

}  // namespace talus::io

#include "io/force_track.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "io/report_parts.hpp"

namespace talus::io {
namespace {

constexpr double bin = force_bin;
constexpr std::size_t margin = 50;                     // bins of no force before and after, for the filter
constexpr std::size_t piece = 2000, remembered = 200;  // bins
constexpr double latest = 1e15, longest = 1e6;  // bins that a run can come to, and that one row can take:
                                                // beyond, a journal's row is no row

/// Whether a run can have written a row that begins and ends at these bins.
bool is_row(double start, double end) {
  return std::abs(start) < latest && std::abs(end) < latest && end >= start && end - start < longest;
}

/// The impulse of a force over start to end [bins] goes to the bins it lies in; `first` is the number of the
/// first.
void share_out(double start, double end, const Vec3& force, long first, std::vector<Vec3>& impulse) {
  const long from = static_cast<long>(std::floor(start)),
             to = std::min(static_cast<long>(std::ceil(end)), first + static_cast<long>(impulse.size()));
  for (long k = from; k < to; ++k)
    impulse[static_cast<std::size_t>(k - first)] +=
        std::max(std::min(end, static_cast<double>(k + 1)) - std::max(start, static_cast<double>(k)), 0.0) *
        bin * force;
}

}  // namespace

void ForceTrack::add(double t, double dt, const Vec3& force) {
  const double start = (t - dt) / bin, end = t / bin;
  if (!is_row(start, end)) return;
  if (!impulse_.empty() && std::abs(start - static_cast<double>(first_)) >
                               static_cast<double>(impulse_.size()) +
                                   longest) {  // a contact of its own: nothing is left in the filter
    peak_ = filtered_peak();
    impulse_.clear();
    goes_on_ = false;
  }
  const long from = static_cast<long>(std::floor(start)),
             to = std::max(from + 1, static_cast<long>(std::ceil(end)));
  if (impulse_.empty()) first_ = from;
  if (from < first_) {
    impulse_.insert(impulse_.begin(), static_cast<std::size_t>(first_ - from), Vec3::Zero());
    first_ = from;
  }
  if (static_cast<std::size_t>(to - first_) > impulse_.size())
    impulse_.resize(static_cast<std::size_t>(to - first_), Vec3::Zero());
  share_out(start, end, force, first_, impulse_);
  if (impulse_.size() < piece) return;
  peak_ = std::max(peak_, peak_here(false));
  const std::size_t gone = impulse_.size() - remembered;
  impulse_.erase(impulse_.begin(), impulse_.begin() + static_cast<std::ptrdiff_t>(gone));
  first_ += static_cast<long>(gone);
  goes_on_ = true;
}

/// Where the force begins and ends there is none before and after; where a piece is cut the filter goes on
/// with its last value.
double ForceTrack::peak_here(bool ends) const {
  if (impulse_.empty()) return 0;
  std::vector<double> x(goes_on_ ? 0 : margin, 0.0);
  std::transform(impulse_.begin(), impulse_.end(), std::back_inserter(x),
                 [](const Vec3& j) { return j.norm() / bin; });
  if (ends) x.resize(x.size() + margin, 0.0);
  const std::vector<double> y = low_pass(std::move(x), bin, force_cutoff);
  // What is near a cut belongs to the piece that holds more around it.
  const std::size_t from = goes_on_ ? std::min(remembered / 2, y.size()) : 0,
                    to = ends ? y.size() : y.size() - std::min(remembered / 2, y.size());
  return from < to ? *std::max_element(y.begin() + static_cast<std::ptrdiff_t>(from),
                                       y.begin() + static_cast<std::ptrdiff_t>(to))
                   : 0;
}

double ForceTrack::filtered_peak() const { return std::max(peak_, peak_here(true)); }

ForceCurve force_curve(const std::vector<ForceRow>& rows, double before, double after, std::size_t most) {
  double start = latest, end = -latest;  // bins
  for (const ForceRow& r : rows)
    if (is_row((r.time - r.dt) / bin, r.time / bin))
      start = std::min(start, (r.time - r.dt) / bin), end = std::max(end, r.time / bin);
  ForceCurve c;
  if (!(end >= start) || end - start + (before + after) / bin > static_cast<double>(most)) return c;
  const auto ahead = std::max(margin, static_cast<std::size_t>(std::ceil(before / bin))),
             behind = std::max(margin, static_cast<std::size_t>(std::ceil(after / bin)));
  const long first = static_cast<long>(std::floor(start)) - static_cast<long>(ahead);
  std::vector<Vec3> impulse(static_cast<std::size_t>(static_cast<long>(std::ceil(end)) - first) + behind,
                            Vec3::Zero());
  for (const ForceRow& r : rows)
    if (is_row((r.time - r.dt) / bin, r.time / bin))
      share_out((r.time - r.dt) / bin, r.time / bin, r.force, first, impulse);
  for (std::size_t k = 0; k < impulse.size(); ++k) {
    c.time.push_back((static_cast<double>(first + static_cast<long>(k)) + 0.5) * bin);
    c.mean.push_back(impulse[k].norm() / bin);
  }
  c.filtered = low_pass(c.mean, bin, force_cutoff);
  return c;
}

}  // namespace talus::io

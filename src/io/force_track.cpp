#include "io/force_track.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/structures/structure.hpp"

namespace talus::io {
namespace {

constexpr double bin = force_bin;
constexpr long window = 15, piece = 2000;  // bins
static_assert(window * bin == load_window);
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

/// Size of the mean force over each window of whole bins [N].
std::vector<double> window_means(const std::vector<Vec3>& impulse) {
  std::vector<double> mean;
  for (auto from = impulse.begin(); impulse.end() - from >= window; ++from)
    mean.push_back(std::accumulate(from, from + window, Vec3(Vec3::Zero())).norm() /
                   (static_cast<double>(window) * bin));
  return mean;
}

double greatest(double peak, const std::vector<Vec3>& impulse) {
  for (const double mean : window_means(impulse)) peak = std::max(peak, mean);
  return peak;
}

}  // namespace

void ForceTrack::add(double t, double dt, const Vec3& force) {
  const double start = (t - dt) / bin, end = t / bin;
  if (!is_row(start, end)) return;
  const auto size = static_cast<long>(impulse_.size());
  const bool apart = size > 0 && std::abs(start - static_cast<double>(first_)) > longest + piece;
  if (t != end_ && (apart || size >= piece)) {  // the rows at one time belong together
    peak_ = apart ? filtered_peak() : greatest(peak_, impulse_);
    const long gone = apart ? size : size - window;
    impulse_.erase(impulse_.begin(), impulse_.begin() + gone);
    first_ += gone;
  }
  end_ = t;
  const long from = static_cast<long>(std::floor(start)),
             to = std::max(from + 1, static_cast<long>(std::ceil(end)));
  if (impulse_.empty()) first_ = from;
  if (impulse_.empty() || from < first_) {
    impulse_.insert(impulse_.begin(), static_cast<std::size_t>(first_ - from + window), Vec3::Zero());
    first_ = from - window;
  }
  if (static_cast<std::size_t>(to - first_) > impulse_.size())
    impulse_.resize(static_cast<std::size_t>(to - first_), Vec3::Zero());
  share_out(start, end, force, first_, impulse_);
}

double ForceTrack::filtered_peak() const {
  std::vector<Vec3> all = impulse_;
  all.resize(all.size() + window, Vec3::Zero());
  return greatest(peak_, all);
}

ForceCurve force_curve(const std::vector<ForceRow>& rows, double before, double after, std::size_t most) {
  double start = latest, end = -latest;  // bins
  for (const ForceRow& r : rows)
    if (is_row((r.time - r.dt) / bin, r.time / bin))
      start = std::min(start, (r.time - r.dt) / bin), end = std::max(end, r.time / bin);
  ForceCurve c;
  if (!(end >= start) || end - start + (before + after) / bin > static_cast<double>(most)) return c;
  const auto ahead = static_cast<std::size_t>(std::ceil(before / bin)),
             behind = static_cast<std::size_t>(std::ceil(after / bin));
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
  impulse.insert(impulse.begin(), window / 2, Vec3::Zero());
  impulse.insert(impulse.end(), window / 2, Vec3::Zero());
  c.filtered = window_means(impulse);
  return c;
}

}  // namespace talus::io

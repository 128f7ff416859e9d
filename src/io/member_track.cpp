#include "io/member_track.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace talus::io {

using json = nlohmann::ordered_json;

void MemberTrack::add(double time, const MemberState& s, const MemberPeaks& peaks) {
  if (time_.empty()) first_drift_ = s.drift;
  time_.push_back(time);
  drift_.push_back({s.drift[0] - first_drift_[0], s.drift[1] - first_drift_[1]});
  peaks_ = peaks;
  last_ = s;
}

std::array<double, 2> MemberTrack::residual_drift() const {
  if (time_.empty()) return {};
  const double from = time_.back() - 0.1 * (time_.back() - time_.front());
  std::array<double, 2> sum{};
  double count = 0;
  for (std::size_t k = 0; k < time_.size(); ++k)
    if (time_[k] >= from) sum[0] += drift_[k][0], sum[1] += drift_[k][1], ++count;
  return {sum[0] / count, sum[1] / count};
}

bool MemberTrack::top_came_off() const { return !std::isfinite(last_.drift[0]); }

int MemberTrack::damage_class() const {
  const std::array<double, 2> drift = residual_drift();
  const double residual = std::hypot(drift[0], drift[1]) / member_.length;
  const double share = member_.volume > 0 ? last_.lost_volume / member_.volume : 0;
  if (share > 0.1 || residual > 0.05 || top_came_off()) return 4;
  if (last_.bars_broken > 0 || share > 0.01 || residual > 0.01 || peaks_.use_mean.value > 1) return 3;
  if (last_.bars_yielded > 0 || peaks_.crack_width > 0.4e-3 || peaks_.use_design.value > 1) return 2;
  return peaks_.crack_width > 0.1e-3 ? 1 : 0;
}

json MemberTrack::summary() const {
  static const char* names[] = {"none", "slight", "moderate", "severe", "lost"};
  const auto pair = [](const std::array<double, 2>& v) { return json::array({v[0], v[1]}); };
  const auto peak = [](const LoadPeak& p) { return json{{"value", p.value}, {"time", p.time}, {"station", p.station}}; };
  const bool concrete = member_.shear_design[0] > 0;
  const std::array<double, 2> residual = residual_drift();
  const int grade = damage_class();   // of concrete: what is elastic alone cannot be damaged, which is no finding
  return {{"name", member_.name},
          {"length", member_.length},
          {"axial_preload", member_.axial_preload},
          {"axial_least", peaks_.axial_least},
          {"axial_largest", peaks_.axial_largest},
          {"peak_shear", peak(peaks_.shear)},
          {"peak_moment", peak(peaks_.moment)},
          {"shear_resistance_design", concrete ? pair(member_.shear_design) : json()},
          {"shear_resistance_mean", concrete ? pair(member_.shear_mean) : json()},
          {"shear_utilisation_design", concrete ? peak(peaks_.use_design) : json()},
          {"shear_utilisation_mean", concrete ? peak(peaks_.use_mean) : json()},
          {"peak_drift", peaks_.drift},
          {"residual_drift", top_came_off() ? json() : pair(residual)},
          {"residual_drift_ratio", top_came_off() ? json() : json(std::hypot(residual[0], residual[1]) / member_.length)},
          {"top_came_off", top_came_off()},
          {"crack_width_peak", peaks_.crack_width},
          {"crack_width_end", last_.crack_width},
          {"bars_yielded", last_.bars_yielded},
          {"bars_broken", last_.bars_broken},
          {"lost_volume", last_.lost_volume},
          {"damage_class", concrete ? json(grade) : json()},
          {"damage_class_name", concrete ? json(names[grade]) : json()}};
}

}  // namespace talus::io

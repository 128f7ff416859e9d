#include "io/member_track.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace talus::io {

using json = nlohmann::ordered_json;

void MemberTrack::add(double time, const MemberState& s) {
  const bool first = time_.empty();
  if (first) {
    first_drift_ = s.drift;
    if (!s.axial.empty()) least_axial_ = largest_axial_ = s.axial.front();
  }
  const auto keep = [&](Peak& peak, double value, std::size_t station) {
    if (value > peak.value) peak = {value, time, member_.stations[station]};
  };
  const std::size_t stations = std::min({s.axial.size(), s.shear.size(), s.moment.size(), member_.stations.size()});   // a journal's row may hold less
  for (std::size_t k = 0; k < stations; ++k) {
    least_axial_ = std::min(least_axial_, s.axial[k]), largest_axial_ = std::max(largest_axial_, s.axial[k]);
    keep(shear_, std::hypot(s.shear[k][0], s.shear[k][1]), k);
    keep(moment_, std::hypot(s.moment[k][0], s.moment[k][1]), k);
    const auto use = [&](const std::array<double, 2>& r) { return r[0] > 0 && r[1] > 0 ? std::hypot(s.shear[k][0] / r[0], s.shear[k][1] / r[1]) : 0.0; };
    keep(design_, use(member_.shear_design), k);
    keep(mean_, use(member_.shear_mean), k);
  }
  time_.push_back(time);
  drift_.push_back({s.drift[0] - first_drift_[0], s.drift[1] - first_drift_[1]});
  if (const double now = std::hypot(drift_.back()[0], drift_.back()[1]); now > peak_drift_) peak_drift_ = now;   // not once the top has come off (NaN)
  crack_width_ = std::max(crack_width_, s.crack_width);
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
  if (last_.bars_broken > 0 || share > 0.01 || residual > 0.01 || mean_.value > 1) return 3;
  if (last_.bars_yielded > 0 || crack_width_ > 0.4e-3 || design_.value > 1) return 2;
  return crack_width_ > 0.1e-3 ? 1 : 0;
}

json MemberTrack::summary() const {
  static const char* names[] = {"none", "slight", "moderate", "severe", "lost"};
  const auto pair = [](const std::array<double, 2>& v) { return json::array({v[0], v[1]}); };
  const auto peak = [](const Peak& p) { return json{{"value", p.value}, {"time", p.time}, {"station", p.station}}; };
  const bool concrete = member_.shear_design[0] > 0;
  const std::array<double, 2> residual = residual_drift();
  const int grade = damage_class();   // of concrete: what is elastic alone cannot be damaged, which is no finding
  return {{"name", member_.name},
          {"length", member_.length},
          {"axial_preload", member_.axial_preload},
          {"axial_least", least_axial_},
          {"axial_largest", largest_axial_},
          {"peak_shear", peak(shear_)},
          {"peak_moment", peak(moment_)},
          {"shear_resistance_design", concrete ? pair(member_.shear_design) : json()},
          {"shear_resistance_mean", concrete ? pair(member_.shear_mean) : json()},
          {"shear_utilisation_design", concrete ? peak(design_) : json()},
          {"shear_utilisation_mean", concrete ? peak(mean_) : json()},
          {"peak_drift", peak_drift_},
          {"residual_drift", top_came_off() ? json() : pair(residual)},
          {"residual_drift_ratio", top_came_off() ? json() : json(std::hypot(residual[0], residual[1]) / member_.length)},
          {"top_came_off", top_came_off()},
          {"crack_width_peak", crack_width_},
          {"crack_width_end", last_.crack_width},
          {"bars_yielded", last_.bars_yielded},
          {"bars_broken", last_.bars_broken},
          {"lost_volume", last_.lost_volume},
          {"damage_class", concrete ? json(grade) : json()},
          {"damage_class_name", concrete ? json(names[grade]) : json()}};
}

}  // namespace talus::io

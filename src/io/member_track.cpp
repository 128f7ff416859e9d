#include "io/member_track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <utility>

namespace talus::io {

using json = nlohmann::ordered_json;

namespace {

// How far what a class rests on differs between runs that a user may as well have made. Cube of 5 t at 18 m/s
// against a pier of 1.5 m: lost volume 4.8 to 7.1 % with critical_step_fraction 0.2 to 0.9 (5.5 to 13.5 %
// where the pier was an octagon), 7.1 and 3.3 % with cells of 0.25 and 0.2 m; V_dyn/V_Rd 2.66 to 3.33;
// drift 1.2 to 1.3 %. The measure over its value, either way.
constexpr double scatter_of_volume = 2.5, scatter_of_shear = 1.25, scatter_of_drift = 1.25;

}  // namespace

void MemberTrack::add(double time, const MemberState& s, const MemberPeaks& peaks) {
  if (time_.empty()) first_drift_ = s.drift, first_shift_ = s.end_shift;
  time_.push_back(time);
  drift_.push_back({s.drift[0] - first_drift_[0], s.drift[1] - first_drift_[1]});
  widest_ = std::max({widest_, peaks.crack_width, s.crack_width});  // rows may come between its samples
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

MemberTrack::Verdict MemberTrack::verdict() const {
  static constexpr const char* names[] = {"none", "slight", "moderate", "severe", "lost"};
  const std::array<double, 2> drift = residual_drift();
  const double residual = std::hypot(drift[0], drift[1]) / member_.length;
  const double share = member_.volume > 0 ? last_.lost_volume / member_.volume : 0;
  const double crack = 1e3 * std::max(widest_, peaks_.before.crack_width);  // [mm]
  const MemberPeaks::Before& before = peaks_.before;
  const double use_design = std::max(peaks_.use_design.value, before.use_design),
               use_mean = std::max(peaks_.use_mean.value, before.use_mean);
  const auto in_time = [](double now) { return now > 1 ? "" : " in the run that it goes on from"; };
  struct Reason {
    bool holds;
    std::string text;
  };
  const auto any_of = [](std::initializer_list<Reason> reasons) {
    std::string found;
    for (const Reason& r : reasons)
      if (r.holds) found += (found.empty() ? "" : ", ") + r.text;
    return found;
  };
  const std::string gone = fmt::format("{:.3g} % of its volume gone", 100 * share),
                    leans = fmt::format("{}{} {:.2g} %", under_load_ ? "" : "residual ",
                                        std::string(member_.span ? "deflection" : "drift") +
                                            (under_load_ ? " under a load that still acts" : ""),
                                        100 * residual),
                    wide =
                        fmt::format("a crack of {:.3g} mm{}", crack,
                                    widest_ < before.crack_width ? " in the run that it goes on from" : "");
  const auto bars = [](int count, const char* what) {
    return fmt::format("{} bar{} {}", count, count == 1 ? "" : "s", what);
  };
  if (elastic_)
    return {
        0,
        "",
        fmt::format(
            "not judged: elastic in this run (damage = \"none\"), so cracks, lost parts and what breaks were "
            "not computed{}; V_dyn/V_Rd with design strengths {:.2f}, with mean strengths {:.2f} at most",
            last_.bars_yielded > 0 ? ", " + bars(last_.bars_yielded, "yielded") : "", peaks_.use_design.value,
            peaks_.use_mean.value),
        use_design,
        0,
        0};
  // What speaks for a class, were volume, shear and drift by these factors greater.
  const auto reasons = [&](int grade, double volume, double shear, double lean) {
    switch (grade) {
      case 4:
        return any_of({{top_came_off(), member_.span ? "a part of it has come off" : "its top has come off"},
                       {last_.ends_unseated > 0,
                        last_.ends_unseated > 1 ? "both ends off their bearings" : "an end off its bearings"},
                       {volume * share > 0.1, gone},
                       {lean * residual > 0.05, leans}});
      case 3:
        return any_of({{last_.bars_broken > 0, bars(last_.bars_broken, "broken")},
                       {volume * share > 0.01, gone},
                       {lean * residual > 0.01, leans},
                       {shear * use_mean > 1, std::string("V_dyn above V_Rd with mean strengths") +
                                                  in_time(peaks_.use_mean.value)}});
      case 2:
        return any_of({{last_.bars_yielded > 0, bars(last_.bars_yielded, "yielded")},
                       {crack > 0.4, wide},
                       {shear * use_design > 1,
                        std::string("V_dyn above the design V_Rd") + in_time(peaks_.use_design.value)}});
      case 1: return any_of({{crack > 0.1, wide}});
      default: return std::string("no crack above 0.1 mm, no bar yields");
    }
  };
  const auto class_at = [&](double volume, double shear, double lean) {
    int grade = 4;
    while (grade > 0 && reasons(grade, volume, shear, lean).empty()) --grade;
    return grade;
  };
  const int grade = class_at(1, 1, 1);
  return {grade,
          names[grade],
          reasons(grade, 1, 1, 1),
          use_design,
          class_at(1 / scatter_of_volume, 1 / scatter_of_shear, 1 / scatter_of_drift),
          class_at(scatter_of_volume, scatter_of_shear, scatter_of_drift)};
}

std::string MemberTrack::Verdict::doubt() const {
  if (least == most) return "";
  return fmt::format(
      "class {} to {} within what time steps and cells change (lost volume by a factor of {:g}, "
      "shear {:g}, drift {:g})",
      least, most, scatter_of_volume, scatter_of_shear, scatter_of_drift);
}

MemberTrack::Function MemberTrack::function(std::span<const MemberTrack> all) const {
  constexpr double joint = 0.05, deflected = 1.0 / 250, visible = 1.0 / 1000;  // [m], of the length
  if (!member_.span || !has_verdict() || elastic_) return {};
  int grade = verdict().grade;
  std::string of_class = fmt::format("damage class {}", grade);
  for (const int k : member_.carried_by) {
    const MemberTrack& below = all[static_cast<std::size_t>(k)];
    if (!below.has_verdict() || below.elastic()) continue;
    const Verdict pier = below.verdict();
    if (pier.grade > grade)
      grade = pier.grade,
      of_class = fmt::format("{}, which carries it, has damage class {} {}", below.name(), grade, pier.name);
  }
  const std::array<double, 2> drift = residual_drift();
  const double deflection = std::hypot(drift[0], drift[1]), shift = std::abs(last_.end_shift - first_shift_);
  const std::string bent = fmt::format("residual deflection {:.3g} mm, 1/{:.0f} of the span",
                                       1e3 * deflection, member_.length / std::max(deflection, 1e-6));
  if (grade >= 3) return {"closed", of_class};
  if (shift > joint) return {"closed", fmt::format("an end has moved by {:.3g} mm", 1e3 * shift)};
  if (deflection > deflected * member_.length) return {"closed", bent};
  if (grade == 2) return {"restricted", of_class};
  if (deflection > visible * member_.length) return {"restricted", bent};
  return {"open", fmt::format("{}, {}", of_class, bent)};
}

json MemberTrack::summary(std::span<const MemberTrack> all) const {
  const auto pair = [](const std::array<double, 2>& v) { return json::array({v[0], v[1]}); };
  const auto peak = [](const LoadPeak& p) {
    return json{{"value", p.value}, {"time", p.time}, {"station", p.station}};
  };
  const bool concrete = has_verdict();  // what is elastic alone cannot be damaged, which is no finding
  const std::array<double, 2> residual = residual_drift();
  const Verdict judged = verdict();
  const Function use = function(all);
  return {{"name", member_.name},
          {"span", member_.span},
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
          {"residual_drift_under_load", under_load_},
          {"residual_drift_ratio",
           top_came_off() ? json() : json(std::hypot(residual[0], residual[1]) / member_.length)},
          {"top_came_off", top_came_off()},
          {"crack_width_peak", widest_},
          {"crack_width_end", last_.crack_width},
          {"bars_yielded", last_.bars_yielded},
          {"bars_broken", last_.bars_broken},
          {"lost_volume", last_.lost_volume},
          {"damage_class", concrete && !elastic_ ? json(judged.grade) : json()},
          {"damage_class_name", concrete && !elastic_ ? json(judged.name) : json()},
          {"damage_class_basis", concrete ? json(judged.basis) : json()},
          {"damage_class_range", concrete && !elastic_ ? json::array({judged.least, judged.most}) : json()},
          {"ends_unseated", member_.span ? json(last_.ends_unseated) : json()},
          {"end_shift", member_.span ? json(std::abs(last_.end_shift - first_shift_)) : json()},
          {"function", use.basis.empty() ? json() : json(use.state)},
          {"function_basis", use.basis.empty() ? json() : json(use.basis)}};
}

}  // namespace talus::io

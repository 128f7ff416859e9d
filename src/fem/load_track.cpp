#include "fem/load_track.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace talus::fem {
namespace {

constexpr std::size_t per_station = 5;

std::vector<double> section_forces(std::span<const MemberState> states) {
  std::vector<double> f;
  for (const MemberState& s : states)
    for (std::size_t k = 0; k < s.axial.size(); ++k) f.insert(f.end(), {s.axial[k], s.shear[k][0], s.shear[k][1], s.moment[k][0], s.moment[k][1]});
  return f;
}

void keep(LoadPeak& peak, double value, double time, double station = 0) {
  if (value > peak.value) peak = {value, time, station};
}

/// Every number of the peaks, for writing and for reading.
void each_number(auto& peaks, auto&& f) {
  const auto three = [&](auto& p) { f(p.value), f(p.time), f(p.station); };
  three(peaks.force), three(peaks.shear), three(peaks.moment);
  for (auto& m : peaks.members) {
    three(m.shear), three(m.moment), three(m.use_design), three(m.use_mean);
    f(m.axial_least), f(m.axial_largest), f(m.drift), f(m.crack_width);
  }
}

}  // namespace

void LoadTrack::begin(const Vec6& reaction, std::span<const Member> members, std::span<const MemberState> states) {
  clear();
  at_start_ = reaction;
  reactions_.begin({reaction.data(), 6});
  forces_.begin(section_forces(states));
  std::size_t at = 0;
  for (const MemberState& s : states) {
    first_drift_.push_back(s.drift);
    MemberPeaks p;
    if (!s.axial.empty()) p.axial_least = p.axial_largest = s.axial.front();
    p.crack_width = s.crack_width;
    peaks_.members.push_back(p);
    const std::size_t width = per_station * s.axial.size(), member = peaks_.members.size() - 1;
    judge(0, member, members[member], forces_.mean().subspan(at, width));
    at += width;
  }
}

void LoadTrack::shift(const Vec6& reaction, std::span<const std::array<double, 2>> drift) {
  at_start_ += reaction;
  for (std::size_t k = 0; k < std::min(drift.size(), first_drift_.size()); ++k)
    for (std::size_t axis = 0; axis < 2; ++axis) first_drift_[k][axis] += drift[k][axis];
}

void LoadTrack::begin_again(const Vec6& reaction, std::span<const Member> members, std::span<const MemberState> states) {
  const Vec6 permanent = at_start_;
  const RunningMean so_far = reactions_;   // a reaction of the moment is no mean
  begin(reaction, members, states);
  at_start_ = permanent;
  if (so_far.begun()) reactions_ = so_far;
  count(0);   // what rests takes no step that would tell
}

void LoadTrack::react(double t, double duration, const Vec6& reaction) {
  const bool moved = reactions_.add(unheard_ + duration, {reaction.data(), 6});
  unheard_ = 0;
  if (!moved) return;
  count(std::max(0.0, t - 0.5 * load_window));
}

void LoadTrack::count(double when) {
  const Vec6 added = Eigen::Map<const Vec6>(reactions_.mean().data()) - at_start_;
  keep(peaks_.force, added.head<3>().norm(), when);
  keep(peaks_.shear, added.head<2>().norm(), when);
  keep(peaks_.moment, added.tail<3>().norm(), when);
}

void LoadTrack::sample(double t, double duration, std::span<const Member> members, std::span<const MemberState> states) {
  const std::vector<double> now = section_forces(states);
  const bool moved = forces_.add(since_ + duration, now);
  since_ = 0;
  std::size_t at = 0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    MemberPeaks& p = peaks_.members[k];
    p.drift = std::max(p.drift, std::hypot(states[k].drift[0] - first_drift_[k][0], states[k].drift[1] - first_drift_[k][1]));
    p.crack_width = std::max(p.crack_width, states[k].crack_width);
    const std::size_t width = per_station * states[k].axial.size();
    if (moved) judge(std::max(0.0, t - 0.5 * load_window), k, members[k], forces_.mean().subspan(at, width));
    at += width;
  }
}

/// V_dyn / V_Rd along both axes, of a section without concrete none.
void LoadTrack::judge(double t, std::size_t member, const Member& shape, std::span<const double> forces) {
  MemberPeaks& p = peaks_.members[member];
  for (std::size_t k = 0; k < forces.size() / per_station; ++k) {
    const double* f = &forces[per_station * k];
    const double station = shape.stations[k];
    p.axial_least = std::min(p.axial_least, f[0]), p.axial_largest = std::max(p.axial_largest, f[0]);
    keep(p.shear, std::hypot(f[1], f[2]), t, station);
    keep(p.moment, std::hypot(f[3], f[4]), t, station);
    const auto use = [&](const std::array<double, 2>& r) { return r[0] > 0 && r[1] > 0 ? std::hypot(f[1] / r[0], f[2] / r[1]) : 0.0; };
    keep(p.use_design, use(shape.shear_design), t, station);
    keep(p.use_mean, use(shape.shear_mean), t, station);
  }
}

void LoadTrack::clear() { *this = {}; }

void LoadTrack::save(std::vector<double>& state) const {
  state.insert(state.end(), at_start_.data(), at_start_.data() + 6);
  state.insert(state.end(), {since_, unheard_});
  state.push_back(static_cast<double>(first_drift_.size()));
  for (const auto& d : first_drift_) state.insert(state.end(), d.begin(), d.end());
  each_number(peaks_, [&](double v) { state.push_back(v); });
  reactions_.save(state);
  forces_.save(state);
}

std::size_t LoadTrack::restore(std::span<const double> state) {
  std::size_t at = 0;
  const auto next = [&] {
    if (at >= state.size()) throw NumericalFailure("a saved state ends within its greatest loads");
    return state[at++];
  };
  clear();
  for (int k = 0; k < 6; ++k) at_start_[k] = next();
  since_ = next(), unheard_ = next();
  const double members = next();
  if (!(members >= 0 && members <= static_cast<double>(state.size()))) throw NumericalFailure("a saved state has counts that it cannot hold");
  first_drift_.resize(static_cast<std::size_t>(members));
  for (auto& d : first_drift_) d = {next(), next()};
  peaks_.members.resize(first_drift_.size());
  each_number(peaks_, [&](double& v) { v = next(); });
  at += reactions_.restore(state.subspan(at));
  at += forces_.restore(state.subspan(at));
  return at;
}

}  // namespace talus::fem

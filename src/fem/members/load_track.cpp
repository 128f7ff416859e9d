#include "fem/members/load_track.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace talus::fem {
namespace {

constexpr std::size_t per_station = 5;

void keep(LoadPeak& peak, double value, double time, double station = 0) {
  if (value > peak.value) peak = {value, time, station};
}

/// Every number of the peaks, for writing and for reading.
void each_number(auto& peaks, auto&& f) {
  const auto three = [&](auto& p) { f(p.value), f(p.time), f(p.station); };
  three(peaks.force), three(peaks.shear), three(peaks.moment);
  for (auto* p : {&peaks.tension, &peaks.compression})
    f(p->value), f(p->time), f(p->strength), f(p->share), f(p->at.x()), f(p->at.y()), f(p->at.z());
  for (auto& m : peaks.members) {
    three(m.shear), three(m.moment), three(m.use_design), three(m.use_mean);
    f(m.axial_least), f(m.axial_largest), f(m.drift), f(m.crack_width);
    f(m.before.use_design), f(m.before.use_mean), f(m.before.crack_width);
  }
  for (auto& p : peaks.probes) three(p);
}

}  // namespace

std::vector<double> section_forces(std::span<const MemberState> states) {
  std::vector<double> f;
  for (const MemberState& s : states)
    for (std::size_t k = 0; k < s.axial.size(); ++k)
      f.insert(f.end(), {s.axial[k], s.shear[k][0], s.shear[k][1], s.moment[k][0], s.moment[k][1]});
  return f;
}

void LoadTrack::name_feet(std::span<const Vec3> at, std::span<const int> member) {
  foot_.assign(at.begin(), at.end());
  foot_member_.assign(member.begin(), member.end());
}

void LoadTrack::strain(const StressPeak& tension, const StressPeak& compression) {
  const auto take = [](StressPeak& peak, const StressPeak& now) {
    const double share = std::max(peak.share, now.share);
    if (now.value > peak.value || peak.strength == 0) peak = now;
    peak.share = share;
  };
  take(peaks_.tension, tension), take(peaks_.compression, compression);
}

void LoadTrack::begin(std::span<const double> reaction, std::span<const Member> members,
                      std::span<const MemberState> states) {
  clear();
  at_start_.assign(reaction.begin(), reaction.end());
  reactions_.begin(reaction);
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

void LoadTrack::shift(std::span<const double> reaction, std::span<const std::array<double, 2>> drift) {
  for (std::size_t i = 0; i < std::min(reaction.size(), at_start_.size()); ++i) at_start_[i] += reaction[i];
  for (std::size_t k = 0; k < std::min(drift.size(), first_drift_.size()); ++k)
    for (std::size_t axis = 0; axis < 2; ++axis) first_drift_[k][axis] += drift[k][axis];
}

void LoadTrack::begin_again(std::span<const double> reaction, std::span<const Member> members,
                            std::span<const MemberState> states) {
  const std::vector<double> permanent = at_start_;
  const RunningMean so_far = reactions_;  // a reaction of the moment is no mean
  const std::vector<MemberPeaks> earlier = peaks_.members;
  begin(reaction, members, states);
  for (std::size_t k = 0; k < std::min(earlier.size(), peaks_.members.size()); ++k) {
    const MemberPeaks& was = earlier[k];
    peaks_.members[k].before = {std::max(was.before.use_design, was.use_design.value),
                                std::max(was.before.use_mean, was.use_mean.value),
                                std::max(was.before.crack_width, was.crack_width)};
  }
  if (permanent.size() == at_start_.size()) at_start_ = permanent;
  if (so_far.begun()) reactions_ = so_far;
  count(0);  // what rests takes no step that would tell
}

void LoadTrack::react(double t, double duration, std::span<const double> reaction) {
  if (!reactions_.add(duration, reaction)) return;
  count(std::max(0.0, t - 0.5 * load_window));
}

void LoadTrack::count(double when) {
  const std::span<const double> mean = reactions_.mean();
  const auto added = [&](std::size_t first) {
    return Vec3(mean[first] - at_start_[first], mean[first + 1] - at_start_[first + 1],
                mean[first + 2] - at_start_[first + 2]);
  };
  keep(peaks_.force, added(0).norm(), when);
  keep(peaks_.shear, added(0).head<2>().norm(), when);
  for (std::size_t foot = 0; 6 + 3 * foot + 2 < mean.size(); ++foot) {
    const double moment = added(6 + 3 * foot).norm();
    if (!(moment > peaks_.moment.value)) continue;
    peaks_.moment = {moment, when, 0};
    if (foot < foot_.size()) peaks_.moment_at = foot_[foot], peaks_.moment_member = foot_member_[foot];
  }
}

void LoadTrack::sample(double t, double duration, std::span<const Member> members,
                       std::span<const MemberState> states) {
  bear(t, duration, members, section_forces(states));
  for (std::size_t k = 0; k < states.size(); ++k) {
    sway(k, states[k].drift);
    MemberPeaks& p = peaks_.members[k];
    p.crack_width = std::max(p.crack_width, states[k].crack_width);
  }
}

void LoadTrack::bear(double t, double duration, std::span<const Member> members,
                     std::span<const double> forces) {
  const bool moved = forces_.add(since_ + duration, forces);
  since_ = 0;
  if (!moved) return;
  std::size_t at = 0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const std::size_t width = per_station * members[k].stations.size();
    judge(std::max(0.0, t - 0.5 * load_window), k, members[k], forces_.mean().subspan(at, width));
    at += width;
  }
}

void LoadTrack::sway(std::size_t member, const std::array<double, 2>& drift) {
  MemberPeaks& p = peaks_.members[member];
  p.drift =
      std::max(p.drift, std::hypot(drift[0] - first_drift_[member][0], drift[1] - first_drift_[member][1]));
}

void LoadTrack::displace(double t, std::size_t probe, const Vec3& u) {
  if (probe >= peaks_.probes.size()) peaks_.probes.resize(probe + 1);
  keep(peaks_.probes[probe], u.norm(), t);
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
    const auto use = [&](const std::array<double, 2>& r) {
      return r[0] > 0 && r[1] > 0 ? std::hypot(f[1] / r[0], f[2] / r[1]) : 0.0;
    };
    keep(p.use_design, use(shape.shear_design), t, station);
    keep(p.use_mean, use(shape.shear_mean), t, station);
  }
}

void LoadTrack::clear() {
  std::vector<Vec3> foot = std::move(foot_);
  std::vector<int> member = std::move(foot_member_);
  *this = {};
  foot_ = std::move(foot), foot_member_ = std::move(member);
}

void LoadTrack::save(std::vector<double>& state) const {
  state.push_back(static_cast<double>(at_start_.size()));
  state.insert(state.end(), at_start_.begin(), at_start_.end());
  state.insert(state.end(), {since_, static_cast<double>(peaks_.moment_member), peaks_.moment_at.x(),
                             peaks_.moment_at.y(), peaks_.moment_at.z()});
  state.push_back(static_cast<double>(first_drift_.size()));
  for (const auto& d : first_drift_) state.insert(state.end(), d.begin(), d.end());
  state.push_back(static_cast<double>(peaks_.probes.size()));
  each_number(peaks_, [&](double v) { state.push_back(v); });
  reactions_.save(state);
  forces_.save(state);
}

void LoadTrack::restore(StateReader& state) {
  clear();
  at_start_.resize(state.count());
  for (double& value : at_start_) value = state.next();
  since_ = state.next();
  peaks_.moment_member = static_cast<int>(state.next());
  for (int k = 0; k < 3; ++k) peaks_.moment_at[k] = state.next();
  first_drift_.resize(state.count());
  for (auto& d : first_drift_) d = {state.next(), state.next()};
  peaks_.members.resize(first_drift_.size());
  peaks_.probes.resize(state.count());
  each_number(peaks_, [&](double& v) { v = state.next(); });
  reactions_.restore(state);
  forces_.restore(state);
}

}  // namespace talus::fem

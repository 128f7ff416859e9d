/// What a structure had to carry so far: greatest base reactions and member forces of means over
/// `load_window`, from every step that it makes.
///
///   R(t) = mean of (r - r_0),   V(t), M(t), N(t) = means of the section forces,
///   peak = max over t (and stations, and feet) of their sizes
///
/// Reactions and displacements of probes are taken in every step, where they are at hand. Section forces cost
/// as much as their layers of cells: a sample every `member_bin` stands for the time since the one before.
/// Crack widths, which cost the law of every cracked cell, are looked at every `width_bin`. In modal motion,
/// which is exact in time, forces are means over steps of `reaction_bin`.
///
/// symbol   meaning                                              unit        shape
/// r        what the structure presses on its supports           N, N m      6: force, moment
///          for each foot the moment on it about its centroid    N m         3
/// r_0      the same under permanent load, at the start          N, N m      6
#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "contact/structures/structure.hpp"
#include "fem/members/running_mean.hpp"

namespace talus::fem {

/// Section forces of members, one after the other.
std::vector<double> section_forces(std::span<const MemberState> states);

class LoadTrack {
 public:
  static constexpr double reaction_bin = 1e-4;  // [s]
  bool begun() const { return reactions_.begun(); }
  /// Nothing has moved yet.
  void begin(std::span<const double> reaction, std::span<const Member> members,
             std::span<const MemberState> states);
  /// A new run from where it is, in motion perhaps: the permanent load stays what it was.
  void begin_again(std::span<const double> reaction, std::span<const Member> members,
                   std::span<const MemberState> states);
  /// The permanent load's state is another by so much, of a finer mesh: what is counted from it goes on.
  void shift(std::span<const double> reaction, std::span<const std::array<double, 2>> drift);
  /// Reaction under permanent load.
  Vec6 permanent() const {
    return at_start_.size() < 6 ? Vec6::Zero() : Vec6(Eigen::Map<const Vec6>(at_start_.data()));
  }
  /// A sample of what elastic concrete bears.
  void strain(const StressPeak& tension, const StressPeak& compression);
  /// Which feet there are: their centroids, and the member that stands on each.
  void name_feet(std::span<const Vec3> at, std::span<const int> member);
  /// The reaction over a step of `duration` that ends at t [s].
  void react(double t, double duration, std::span<const double> reaction);
  /// Whether so much time has passed since the last sample of the members, this step included, that another
  /// is due.
  bool due(double duration, double spacing = member_bin) const {
    return since_ + duration >= spacing * (1 - 1e-9);
  }
  /// Whether the sample that is due at t, the end of a step of `duration`, is the first after a multiple of
  /// `width_bin`: it is to have crack widths [s].
  bool widths_due(double t, double duration) const { return stress_due(t - since_ - duration, t); }
  /// Whether a multiple of `width_bin` lies between them, the latter included [s].
  static bool stress_due(double before, double t) {
    return std::floor(t / width_bin) > std::floor(before / width_bin);
  }
  /// A step passes without one.
  void pass(double duration) { since_ += duration; }
  /// The members at the end of a step of `duration`, at t [s].
  void sample(double t, double duration, std::span<const Member> members,
              std::span<const MemberState> states);
  /// Section forces alone, station by station N, V_x, V_y, M_x, M_y.
  void bear(double t, double duration, std::span<const Member> members, std::span<const double> forces);
  /// Drift of a member.
  void sway(std::size_t member, const std::array<double, 2>& drift);
  /// Displacement of a probe at t [m], [s].
  void displace(double t, std::size_t probe, const Vec3& u);
  const LoadPeaks& peaks() const { return peaks_; }
  void clear();
  void save(std::vector<double>& state) const;
  void restore(StateReader& state);

 private:
  void count(double when);                                        // of the reaction's mean now
  static constexpr double member_bin = 2.5e-4, width_bin = 1e-3;  // [s]
  void judge(double t, std::size_t member, const Member& shape, std::span<const double> forces);

  std::vector<double> at_start_;
  std::vector<Vec3> foot_;
  std::vector<int> foot_member_;
  RunningMean reactions_{load_window, reaction_bin},
      forces_{load_window, member_bin};  // of the members, station by station: N, V_x, V_y, M_x, M_y
  double since_ = 0;                     // the last sample [s]
  std::vector<std::array<double, 2>> first_drift_;  // under permanent load [m]
  LoadPeaks peaks_;
};

}  // namespace talus::fem

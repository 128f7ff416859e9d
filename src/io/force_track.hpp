/// The force of a contact against time, in bins of 0.1 ms, and its filtered peak.
///
/// A sub-step's force depends on the cells and the contact law: one node that arrives late gives a needle.
/// What a member feels is the force low-passed at 300 Hz (Butterworth, four poles, no phase shift: channel
/// class 180 of SAE J211), which is independent of the sub-step.
///
/// A block may lie on a structure for minutes: the track is filtered piece by piece, each with as much of the
/// one before as the filter remembers.
#pragma once
#include <cstddef>
#include <vector>

#include "core/types.hpp"

namespace talus::io {

inline constexpr double force_cutoff = 300;  // [Hz]
inline constexpr double force_bin = 1e-4;    // [s]

class ForceTrack {
 public:
  /// A force, mean over (t - dt, t] [s], [N]; several at one time add up.
  void add(double t, double dt, const Vec3& force);
  /// Greatest low-passed size of the force [N]; 0 without any.
  double filtered_peak() const;

 private:
  double peak_here(bool ends) const;

  double peak_ = 0;            // of the pieces before [N]
  bool goes_on_ = false;       // a piece before this one has been filtered
  long first_ = 0;             // number of the first bin since t = 0
  std::vector<Vec3> impulse_;  // of each bin [N s]
};

/// What the filter of a ForceTrack sees and gives, for a plot: the mean size of the force in each bin, whose
/// integral is the impulse, and that low-passed.
struct ForceCurve {
  std::vector<double> time;      // middle of each bin [s]
  std::vector<double> mean;      // [N]
  std::vector<double> filtered;  // [N]; its greatest is ForceTrack::filtered_peak()
};

/// A row of contact forces: mean over (time - dt, time] [s], [N].
struct ForceRow {
  double time = 0, dt = 0;
  Vec3 force = Vec3::Zero();
};

/// The curve of one contact from `before` [s] ahead of its first row to `after` [s] behind its last; empty
/// where the rows hold no force of a run, or take more than `most` bins.
ForceCurve force_curve(const std::vector<ForceRow>& rows, double before, double after,
                       std::size_t most = 20'000'000);

}  // namespace talus::io

/// The force of a contact against time, in bins of 0.1 ms, and its greatest mean over 1.5 ms.
///
/// A sub-step's force depends on the cells and the contact law: one node that arrives late gives a needle.
/// What a member feels is the impulse over a window, as of base and section forces (load_window),
///
///   F(t) = |1/T int_{t-T/2}^{t+T/2} f dt|,
///
/// a low-pass of 295 Hz that does not overshoot: F exceeds no force of a sub-step.
#pragma once
#include <cstddef>
#include <vector>

#include "core/types.hpp"

namespace talus::io {

inline constexpr double force_bin = 1e-4;  // [s]

class ForceTrack {
 public:
  /// A force, mean over (t - dt, t] [s], [N]; several at one time add up. A block may lie on a structure for
  /// minutes: only the bins that windows to come can reach are kept.
  void add(double t, double dt, const Vec3& force);
  /// Greatest mean over the window [N]; 0 without any.
  double filtered_peak() const;

 private:
  double peak_ = 0;            // of windows that end before the bins kept [N]
  double end_ = 0;             // of the last row [s]
  long first_ = 0;             // number of the first bin since t = 0
  std::vector<Vec3> impulse_;  // of each bin [N s]
};

/// A contact's force for a plot: the mean size of the force in each bin, and over the window about it.
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

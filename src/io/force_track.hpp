/// The force of a contact against time, in bins of 0.1 ms, and its filtered peak.
///
/// A sub-step's force depends on the cells and the contact law: one node that arrives late gives a needle. What a member feels is the force
/// low-passed at 300 Hz (Butterworth, four poles, no phase shift: channel class 180 of SAE J211), which is independent of the sub-step.
///
/// A block may lie on a structure for minutes: the track is filtered piece by piece, each with as much of the one before as the filter remembers.
#pragma once
#include <vector>

#include "core/types.hpp"

namespace talus::io {

inline constexpr double force_cutoff = 300;   // [Hz]

class ForceTrack {
 public:
  /// A force, mean over (t - dt, t] [s], [N]; several at one time add up.
  void add(double t, double dt, const Vec3& force);
  /// Greatest low-passed size of the force [N]; 0 without any.
  double filtered_peak() const;

 private:
  double peak_here(bool ends) const;

  double peak_ = 0;             // of the pieces before [N]
  bool goes_on_ = false;        // a piece before this one has been filtered
  long first_ = 0;              // number of the first bin since t = 0
  std::vector<Vec3> impulse_;   // of each bin [N s]
};

}  // namespace talus::io

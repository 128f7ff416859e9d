/// Every number of the one step that is not physics, in one place.
///
///   eps = accuracy x size: what a position may be off by. All follow from it, so that a run of finer accuracy converges as a whole.
///
/// member    meaning                                                       unit   reason
/// error     change of a body's place that one step may leave unseen       m      eps (eps/size)^(1/2): a jump of force costs a step its whole error, and
///                                                                                smooth motion adds up 1/sqrt(error) of them
/// memory    time over which an error of velocity shows as one of place    s      sqrt(size/g), the block's own time
/// touch     gap up to which two features touch                            m      a tenth of eps: near-simultaneous impacts share one problem
/// land      gap at which a body that comes down is stopped                m      half of the touch band
/// missed    overlap of new features after which their closing is sought   m      a fiftieth of the touch band
/// open      normal or sliding speed that counts as none                   m/s    what moves the place by a quarter of `error` within `memory`
/// bounce    closing speed below which an impact does not rebound          m/s    that of a fall by the touch band
/// residual  of a contact problem                                          m/s    a hundredth of `open`
#pragma once
#include <algorithm>
#include <cmath>

namespace talus::coupling::step {

struct Tolerances {
  double error = 0, memory = 0, touch = 0, land = 0, missed = 0, open = 0, bounce = 0, residual = 0;

  /// size [m]: cube root of the block's volume; gravity [m/s^2].
  Tolerances(double accuracy, double size, double gravity) {
    constexpr double longest_memory = 1.0;   // [s], where no gravity sets the time
    const double eps = accuracy * size;
    error = eps * std::sqrt(accuracy);
    memory = gravity > 0 ? std::min(longest_memory, std::sqrt(size / gravity)) : longest_memory;
    touch = 0.1 * eps;
    land = 0.5 * touch;
    missed = 0.02 * touch;
    open = 0.25 * error / memory;
    bounce = std::max(open, std::sqrt(2 * gravity * touch));
    residual = 0.01 * open;
  }
};

}  // namespace talus::coupling::step

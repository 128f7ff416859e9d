/// Gaps and speeds that count as none, or as near, in an island of length L and speed V.
#pragma once
#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// L_m = (sum m / sum m/r^2)^(1/2) [m]: where every block is off by accuracy L_m, the root mean square of
/// error over size r, weighed by mass m, is the accuracy. Slivers and pebbles, of next to no mass, do not
/// count.
class MassLength {
 public:
  void add(double mass, double size) {
    mass_ += mass;
    over_size_sq_ += mass / (size * size);
  }
  double value() const { return std::sqrt(mass_ / over_size_sq_); }

 private:
  double mass_ = 0, over_size_sq_ = 0;
};

struct Scales {
  double length = 1;       // L, of the smallest block [m]
  double mass_length = 1;  // L_m [m]
  double speed = 1;        // V, that the island can have [m/s]
  double accuracy = 1e-3;  // relative to the block size

  /// Of closed contacts [m].
  double touch_gap() const { return contact::tolerances().touch_gap * length; }
  /// Within which what moves slower than impact_speed() is in contact [m].
  double near_gap() const {
    return std::max(touch_gap(), contact::tolerances().near_gap * accuracy * length);
  }
  /// Touches that cannot close within a step of a time-stepped island are rows all the same so near [m].
  double row_reach() const { return contact::tolerances().row_reach * length; }
  /// Overlap by features that were no rows, left to the projection [m].
  double unseen() const { return std::min(row_reach(), 5 * accuracy * length); }
  /// Steps this low between neighbours are none; the same where one is a skin that moves: what positions may
  /// be off by [m].
  double flush() const { return contact::tolerances().flush * length; }
  double flush_skins() const {
    return std::clamp(accuracy, contact::tolerances().flush, contact::tolerances().row_reach) * length;
  }
  /// Of nodes of a skin against faces of another [m].
  double surface_reach() const { return 0.5 * length; }
  /// Between the last two passes of a step, relative to the block size.
  double error_limit() const { return contact::tolerances().pass_error * accuracy; }
  /// Part of a speed that the error of a step may be, and that is none by it (docs/theory/contact.md, 3).
  double part_of_error() const { return accuracy * std::sqrt(accuracy); }
  double part_of_none() const { return 0.25 * part_of_error(); }
  /// An opening of a closed touch that the drift has left, and the speed at which a step lets it close: none
  /// by the error of a step [m/s].
  bool left_open(const Touch& t) const { return t.at.gap > contact::tolerances().located_gap * length; }
  double closing_speed() const { return part_of_none() * speed; }
  /// Most that a step of length h corrects of a spring's place at a structure [m].
  double offset_correction(double h) const { return 1e-3 * speed * h; }
};

}  // namespace talus::coupling

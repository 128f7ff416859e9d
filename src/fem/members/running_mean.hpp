/// Means of several values over a window that moves along, from values that are held over steps of any
/// length.
///
///   mean(t) = 1/T int_{t-T}^{t} f dt
///
/// A low-pass without overshoot: a step of f arrives as a ramp of length T. Steps shorter than a bin are
/// summed in it; a bin longer than T stands alone.
///
/// symbol   meaning                 unit        shape
/// T        window                  s
/// f        values                  any         channels
#pragma once
#include <cstddef>
#include <deque>
#include <span>
#include <vector>

#include "fem/state_reader.hpp"

namespace talus::fem {

class RunningMean {
 public:
  RunningMean(double window, double bin) : window_(window), bin_(bin) {}
  /// The values have been these for longer than the window.
  void begin(std::span<const double> values);
  bool begun() const { return !bins_.empty(); }
  /// They were `values` over the last `duration` [s] > 0. True if a bin is full: then mean() has moved.
  bool add(double duration, std::span<const double> values);
  /// Over the window before the end of the last full bin.
  std::span<const double> mean() const { return mean_; }
  void clear();
  /// As many numbers at any time, once it has begun.
  void save(std::vector<double>& state) const;
  void restore(StateReader& state);

 private:
  struct Bin {
    double duration = 0;
    std::vector<double> integral;
  };
  void set_mean();
  std::size_t most_bins() const;  // full ones that the window can reach

  double window_, bin_;
  std::deque<Bin> bins_;  // full ones, oldest first, as many as the window reaches back
  Bin open_;
  std::vector<double> mean_;
};

}  // namespace talus::fem

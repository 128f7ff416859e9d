/// A probability from runs that are spread over strata of known weights.
///
/// Of a population whose stratum h has the share W_h, x_h of n_h runs come to the event:
///
///   C = sum_h W_h x_h / n_h                                       unbiased [Cochran 1977, 5.3]
///   V = sum_h W_h^2 q_h (1 - q_h) / n_h,  q_h = (x_h + c) / (n_h + 1),  c = (sum x + 1/2) / (sum n + 1)
///
/// since a stratum of few runs that all end alike says little of its variance, it is drawn towards that of
/// all. The interval is Wilson's for C of m = D (1 - D) / V runs, D = sum_h W_h q_h [Korn & Graubard 1998].
#pragma once
#include <span>

#include "ensemble/statistics.hpp"

namespace talus::ensemble {

struct Stratum {
  double weight = 0;          // of any scale
  int reached = 0, runs = 0;  // those without a run are left out
};

/// Of the population; NaN without any run.
Estimate stratified(std::span<const Stratum> strata);

/// What one more run in a stratum takes off V on average.
double variance_gain(std::span<const Stratum> strata, std::size_t stratum);

/// Of independent factors, 95 %: logarithms add [Zou & Donner 2008].
Estimate product(const Estimate& a, const Estimate& b);

}  // namespace talus::ensemble

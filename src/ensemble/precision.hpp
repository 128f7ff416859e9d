/// How well a percentile at a line is known beside what [ensemble.precision] asks for.
///
///   within   (high - low) / (2 |value|) of its 95 % interval
///
/// It counts from as many crossings on as bound the percentile at all (enough_for).
#pragma once
#include <string>

#include "ensemble/brief.hpp"
#include "ensemble/ensemble.hpp"

namespace talus::ensemble {

struct Precision {
  scene::Ensemble::Precision asked;
  long members = 0, crossing = 0;  // finished ones, those of them that cross the line
  double within = none;            // NaN where nothing crosses
  bool reached = false;
};

/// Of an ensemble that asks for a precision.
Precision precision_of(const Ensemble& ensemble, const Briefs& briefs);

/// That it was not reached and what was, in a sentence; empty if it was.
std::string unreached_text(const Precision& precision);

}  // namespace talus::ensemble

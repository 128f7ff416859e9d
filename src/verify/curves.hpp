/// Scenes that are run by three methods: error against CPU time.
#pragma once
#include "verify/suite.hpp"

namespace talus::verify {

/// `part` of the period 39.10573419726872 s.
Outcome euler_top_run(CaseRun& c, const Method& m, double part);

struct RockingMeasure {
  double time = 0, before = 0, after = 0;
  Outcome outcome;
};
RockingMeasure rocking_run(CaseRun& c, const Method& m);

}  // namespace talus::verify

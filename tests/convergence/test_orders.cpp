// Orders of convergence against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "verify/curves.hpp"

namespace talus::verify {
namespace {

TEST(Orders, RockingBlockIsOfSecondOrderInTheStep) {
  std::vector<CaseResult> results;
  std::vector<CurvePoint> curves;
  const Case c{"dda", "A11", "rocking", "", true, {}};
  CaseRun run(c, results, curves, true);
  const auto error = [&](double h) {
    return std::abs(rocking_run(run, Method::fixed_step(h)).time / 0.69834320390792 - 1);
  };
  const double coarse = error(2e-4), fine = error(1e-4);
  EXPECT_LT(fine, 1e-8);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.3);
}

}  // namespace
}  // namespace talus::verify

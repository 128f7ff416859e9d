// What the suites of `talus verify` say of a row that falls short. The rows themselves: tests/verify.
#include <gtest/gtest.h>

#include "verify/suite.hpp"

namespace talus::verify {
namespace {

TEST(Suites, AMissIsReportedAsAMiss) {
  std::vector<CaseResult> results;
  std::vector<CurvePoint> curves;
  const Case c{"dda", "X", "miss", "none", true, {}};
  CaseRun run(c, results, curves, true);
  EXPECT_FALSE(run.relative("q", "r", 1, 1.1, 0.05).passed);
  EXPECT_FALSE(run.absolute("q", "r", 1, std::nan(""), 0.05).passed);
  EXPECT_TRUE(run.relative("q", "r", 1, 1.01, 0.05).passed);
  run.unavailable("why");
  Report report;
  report.results = results;
  EXPECT_FALSE(report.passed());
}

}  // namespace
}  // namespace talus::verify

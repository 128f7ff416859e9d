// The closed forms of the verification suite, asserted in their short form.
#include <gtest/gtest.h>

#include <algorithm>

#include "verify/suite.hpp"

namespace talus::verify {
namespace {

class ClosedForm : public testing::TestWithParam<const char*> {};

TEST_P(ClosedForm, Holds) {
  const Report report = run_suites("dda", true, {}, GetParam());
  ASSERT_FALSE(report.results.empty());
  for (const CaseResult& r : report.results) {
    if (!r.judged) continue;
    EXPECT_TRUE(r.passed) << table_line(r);
  }
}

INSTANTIATE_TEST_SUITE_P(A, ClosedForm,
                         testing::Values("A1", "A2", "A3", "A4", "A5", "A6", "A7", "A8", "A9", "A10", "A11",
                                         "A12", "A13", "A15", "A16", "A18", "A19", "A21", "A22", "A23", "A24",
                                         "A25", "A26", "A27", "A28", "A29", "A30", "A31", "A32", "A33",
                                         "A34"),
                         [](const auto& info) { return std::string(info.param); });

class StructureForm : public testing::TestWithParam<const char*> {};

TEST_P(StructureForm, Holds) {
  const Report report = run_suites("fem", true, {}, GetParam());
  ASSERT_FALSE(report.results.empty());
  for (const CaseResult& r : report.results) EXPECT_TRUE(r.passed) << table_line(r);
}

INSTANTIATE_TEST_SUITE_P(B, StructureForm,
                         testing::Values("B1", "B2", "B3", "B4", "B5", "B6", "B7", "B8", "B9", "B10", "B12",
                                         "B13", "B14", "B15", "B16", "B17", "B18"),
                         [](const auto& info) { return std::string(info.param); });

class Invariant : public testing::TestWithParam<const char*> {};

TEST_P(Invariant, Holds) {
  const Report report = run_suites("invariants", true, {}, GetParam());
  ASSERT_FALSE(report.results.empty());
  for (const CaseResult& r : report.results) EXPECT_TRUE(r.passed) << table_line(r);
}

INSTANTIATE_TEST_SUITE_P(G, Invariant,
                         testing::Values("G1", "G2", "G3", "G4", "G6", "G7", "G9", "G10", "G11", "G12",
                                         "G8-slide", "G8-stop", "G8-rider", "G8-bounce", "G8-rocking",
                                         "G8-wedge", "G8-edge", "G8-pendulum", "G8-springs", "G8-soft",
                                         "G13-tolerances"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

class Stressed : public testing::TestWithParam<const char*> {};

TEST_P(Stressed, KeepsItsInvariants) {
  const Report report = run_suites("stability", true, {}, GetParam());
  ASSERT_FALSE(report.results.empty());
  for (const CaseResult& r : report.results) EXPECT_TRUE(r.passed) << table_line(r);
}

INSTANTIATE_TEST_SUITE_P(E, Stressed,
                         testing::Values("E1-crowd", "E2", "E3-1e+06", "E4", "E5", "E8", "E8-turned",
                                         "E8-4e-10", "E8-crowd", "E9", "E10", "E11", "E12", "E17", "E18"),
                         [](const auto& info) {
                           std::string name = info.param;
                           for (char& c : name)
                             if (c == '-' || c == '+') c = '_';
                           return name;
                         });

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

#include "contact/tolerances.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

namespace talus::contact {
namespace {

TEST(Tolerances, ThePageListsThem) {
  std::ifstream file(std::string(TALUS_SOURCE_DIR) + "/docs/theory/tolerances.md");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_TRUE(text.str() == tolerances_markdown())
      << "docs/theory/tolerances.md is out of date: run make reference";
}

TEST(Tolerances, AreNamedOnceAndPositive) {
  std::set<std::string_view> names;
  const Tolerances defaults;
  for (const ToleranceInfo& t : list_of_tolerances()) {
    EXPECT_TRUE(names.insert(t.name).second) << t.name;
    EXPECT_GT(defaults.*t.value, 0) << t.name;
    EXPECT_FALSE(t.why.empty()) << t.name;
  }
}

TEST(Tolerances, OthersHoldUntilTheirScopeEnds) {
  const double before = tolerances().touch_gap;
  {
    Tolerances others;
    others.touch_gap *= 10;
    const OtherTolerances in_use(others);
    EXPECT_EQ(tolerances().touch_gap, 10 * before);
  }
  EXPECT_EQ(tolerances().touch_gap, before);
}

}  // namespace
}  // namespace talus::contact

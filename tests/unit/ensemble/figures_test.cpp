// What coupled runs of some kinds of hits say of members that other kinds strike.
#include "ensemble/fragility/figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace talus::ensemble {
namespace {

/// Hits on P1, P2 and P3, 10, 30 and 20 of 100 events; a run of each of the first two leaves the pier that it
/// strikes severely damaged, of the third none is done. A pier is not damaged more often than it is struck.
TEST(FragilityFigures, HitsWithoutARunAreNotCountedOnPiersThatTheyMiss) {
  FragilityRequest request;
  request.structure = "viaduct";
  request.runs = 2;
  std::vector<Cluster> clusters;
  for (const auto& [struck, events] : {std::pair{0, 10}, std::pair{1, 30}, std::pair{2, 20}}) {
    Cluster cluster;
    cluster.struck = struck;
    for (int e = 0; e < events; ++e) {
      Event event;
      event.energy = 1e6;
      event.struck = struck;
      cluster.events.push_back(event);
    }
    cluster.runs = struck < 2;
    clusters.push_back(cluster);
  }
  std::vector<Task> tasks(2);
  std::vector<Outcome> outcomes(2);
  for (int t = 0; t < 2; ++t) {
    const auto k = static_cast<std::size_t>(t);
    tasks[k].cluster = t;
    tasks[k].event = &clusters[k].events.front();
    outcomes[k].made = outcomes[k].good = true;
    outcomes[k].names = {"P1", "P2", "P3"};
    outcomes[k].grade = {t == 0 ? 3 : 0, t == 1 ? 3 : 0, 0};
    outcomes[k].basis = {"", "", ""};
  }
  const std::vector<talus::Member> members;
  const std::vector<std::string> faults;
  const FragilityFigures f =
      figures_of({request, 0, 100, 60, members, clusters, tasks, outcomes, faults, ""});
  const auto severe = [&](std::size_t m) { return f.root["members"][m]["per_event"][2]["value"]; };
  EXPECT_NEAR(severe(0).get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(severe(1).get<double>(), 0.3, 1e-12);
  EXPECT_TRUE(severe(2).is_null()) << severe(2);
  EXPECT_NE(
      std::ranges::find(f.result.lines,
                        "P(P3 severe) is not known: no run is done of the hits on it, or of all others"),
      f.result.lines.end());
  bool said = false;
  for (const auto& doubt : f.root["doubts"])
    said = said || doubt.get<std::string>().find("33 % of the hits") != std::string::npos;
  EXPECT_TRUE(said) << f.root["doubts"];
}

/// Twelve hits, four on each of two piers and of a span: those of less than 1 MJ leave the member that they
/// strike as it is, the others make it severe, and no other is damaged. The curves of a pier are those of the
/// hits on piers, and are not lowered by hits that miss it.
TEST(FragilityFigures, MembersWithFewRunsShareTheCurvesOfTheirKind) {
  FragilityRequest request;
  request.runs = 12;
  std::vector<talus::Member> members(3);
  members[2].span = true;
  std::vector<Cluster> clusters(3);
  for (int c = 0; c < 3; ++c) {
    auto& cluster = clusters[static_cast<std::size_t>(c)];
    cluster.struck = c, cluster.runs = 4;
    for (const double energy : {1e5, 3e5, 3e6, 1e7}) {
      Event event;
      event.energy = energy * (1 + 0.1 * c), event.struck = c;
      cluster.events.push_back(event);
    }
  }
  std::vector<Task> tasks(12);
  std::vector<Outcome> outcomes(12);
  for (std::size_t t = 0; t < 12; ++t) {
    const std::size_t c = t / 4;
    tasks[t].cluster = static_cast<int>(c);
    tasks[t].event = &clusters[c].events[t % 4];
    outcomes[t].made = outcomes[t].good = true;
    outcomes[t].names = {"P1", "P2", "S1"};
    outcomes[t].grade = {0, 0, 0};
    outcomes[t].basis = {"", "", ""};
    outcomes[t].grade[c] = t % 4 < 2 ? 0 : 3;
  }
  const std::vector<std::string> faults;
  const FragilityFigures f =
      figures_of({request, 0, 100, 12, members, clusters, tasks, outcomes, faults, ""});
  const auto severe = [&](std::size_t m) { return f.root["members"][m]["curves"][2]; };
  EXPECT_EQ(severe(0)["hits"], "on any pier");
  EXPECT_EQ(severe(0)["runs"], 8);
  EXPECT_EQ(severe(0)["reached"], 4);
  EXPECT_EQ(severe(0), severe(1));
  EXPECT_GT(severe(0)["probability"].back().get<double>(), 0.8);
  EXPECT_EQ(severe(2)["hits"], "on this member");
  EXPECT_EQ(severe(2)["runs"], 4);
}

}  // namespace
}  // namespace talus::ensemble

// Files around an ensemble as a user brings them: areas beside the terrain, structures in map coordinates,
// what is forgotten; what the plan says of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error.hpp"
#include "ensemble/barrier.hpp"
#include "ensemble/calibrate.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/fragility/hits.hpp"
#include "ensemble/maps.hpp"
#include "ensemble/report.hpp"
#include "ensemble/results.hpp"
#include "helpers/place.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace talus::ensemble {
namespace {

namespace fs = std::filesystem;

/// A level grid of 41 x 41 nodes of 5 m at 1200 m, from map coordinates (652300, 5241800), and an area of
/// 40 x 20 m from (`x`, 5241900) on.
class Site {
 public:
  explicit Site(double x = 652400) {
    std::ofstream grid(place_.path() / "dem.asc");
    grid << "ncols 41\nnrows 41\nxllcenter 652300\nyllcenter 5241800\ncellsize 5\nNODATA_value -9999\n";
    for (int i = 0; i < 41; ++i) {
      for (int j = 0; j < 41; ++j) grid << "1200 ";
      grid << "\n";
    }
    std::ofstream area(place_.path() / "source.geojson");
    area.precision(12);
    area << R"({"type": "Polygon", "coordinates": [[[)" << x << ", 5241900], [" << x + 40 << ", 5241900], ["
         << x + 40 << ", 5241920], [" << x << ", 5241920], [" << x << ", 5241900]]]}";
  }
  fs::path scene(const std::string& more) const {
    std::ofstream(place_.path() / "scene.toml") << R"(schema = 1
[simulation]
duration = "1 s"
[site]
terrain = "dem.asc"
material = "slope"
origin = [652300, 5241800, 1150]
crs = "EPSG:32632"
[[material]]
name = "rock"
density = 2600
[[material]]
name = "C40"
f_cm = "48 MPa"
[[interface]]
between = ["*", "*"]
friction = 0.6
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "sphere"
volume = 1
release = { polygon = "source.geojson", height = "0.5 m" }
[output]
report = false
[ensemble]
members = 70
)" << more;
    return place_.path() / "scene.toml";
  }

 private:
  talus::test::Place place_;
};

const std::string drawn = "[[ensemble.vary]]\nkey = \"block.B.release\"\n";

std::vector<std::string> warnings_of(const Ensemble& ensemble) {
  std::vector<std::string> texts;
  for (const Problem& p : ensemble.warnings()) texts.push_back(p.str());
  return texts;
}

bool any_holds(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(),
                     [&](const std::string& t) { return t.find(part) != std::string::npos; });
}

std::string refusal(const fs::path& scene) {
  try {
    const Ensemble ensemble(scene.string(), {});
  } catch (const InputError& error) { return error.what(); }
  return {};
}

TEST(Site, AnAreaThatIsInPartBesideTheTerrainIsToldWithItsShare) {
  const Site inside;
  EXPECT_TRUE(warnings_of(Ensemble(inside.scene(drawn).string(), {})).empty());
  // The grid ends at 652500; 30 m of 40 lie beyond.
  const Site beside(652490);
  const auto told = warnings_of(Ensemble(beside.scene(drawn).string(), {}));
  ASSERT_EQ(told.size(), 1u);
  EXPECT_TRUE(any_holds(told, "block.B.release.polygon")) << told[0];
  EXPECT_TRUE(any_holds(told, "75 % of the area has no ground below")) << told[0];
}

TEST(Site, MeasuredEndPointsOfTheMapAreRefused) {
  const Site site;
  CalibrationRequest request;
  request.scene = site.scene(drawn).string();
  request.measured = fs::path(request.scene).parent_path() / "ends.csv";
  request.parameters = {parse_parameter("interface.*/*.friction=0.4:0.8")};
  const auto refusal = [&](double x, double y) -> std::string {
    std::ofstream(request.measured) << "x,y\n"
                                    << std::fixed << x << "," << y << "\n"
                                    << x + 1 << "," << y << "\n"
                                    << x + 2 << "," << y << "\n"
                                    << x + 300 << "," << y << "\n";
    try {
      check(request);
    } catch (const InputError& e) { return e.what(); }
    return {};
  };
  EXPECT_NE(refusal(652420, 5241910).find("map coordinates less site.origin"), std::string::npos);
  EXPECT_EQ(refusal(120, 110), "");  // one of the four lies beside the terrain
}

// Within the limits of a terrain that is no rectangle there may be no ground.
TEST(Site, ABlockOverAGapOfTheTerrainIsToldOf) {
  const talus::test::Place place;
  std::ofstream(place.path() / "notch.obj") << "v 0 0 0\nv 100 0 50\nv 100 100 50\nv 90 10 45\nf 1 2 3 4\n";
  const auto warnings = [&](const char* position) {
    std::ofstream(place.path() / "scene.toml") << R"(schema = 1
[simulation]
duration = "1 s"
[site]
terrain = "notch.obj"
material = "g"
[[material]]
name = "r"
density = 2500
[[interface]]
between = ["r", "g"]
friction = 0.5
[[block]]
name = "B"
material = "r"
shape = "box"
size = [1, 1, 1]
position = )" << position << "\n";
    const sim::Simulation simulation(scene::read_scene((place.path() / "scene.toml").string()));
    std::vector<std::string> texts;
    for (const Problem& p : simulation.warnings()) texts.push_back(p.str());
    return texts;
  };
  EXPECT_TRUE(any_holds(warnings("[30, 70, 50]"), "block.B.position = [30, 70, 50]: has no ground below"));
  EXPECT_FALSE(any_holds(warnings("[95, 30, 60]"), "no ground below"));
  EXPECT_TRUE(any_holds(warnings("[30, 170, 50]"), "lies beside the terrain"));
}

// Over a plane all places are over ground, but no block comes so far.
TEST(Site, MeasuredEndPointsThatNoBlockReachesAreRefused) {
  const Site site;
  CalibrationRequest request;
  request.scene =
      site.scene(drawn + "[[plane]]\nnormal = [0, 0, 1]\npoint = [0, 0, -500]\nmaterial = \"slope\"\n")
          .string();
  request.measured = fs::path(request.scene).parent_path() / "ends.csv";
  request.parameters = {parse_parameter("interface.*/*.friction=0.4:0.8")};
  std::ofstream(request.measured) << "x,y\n120,110\n121,110\n122,110\n652420,5241910\n";
  try {
    check(request);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("km from where blocks start"), std::string::npos) << e.what();
  }
}

TEST(Site, WhatIsNotDrawnIsTold) {
  const Site site;
  EXPECT_TRUE(any_holds(warnings_of(Ensemble(site.scene("").string(), {})), "all members are the same"));
  const auto told = warnings_of(
      Ensemble(site.scene("[[ensemble.vary]]\nkey = \"block.B.volume\"\nuniform = [1, 2]\n").string(), {}));
  EXPECT_TRUE(any_holds(told, "every member starts at the same places"));
  EXPECT_TRUE(any_holds(told, "key = \"block.B.release\""));
}

TEST(Site, ThePlanSaysWhatIsDrawnAndCounted) {
  const Site site;
  const Ensemble ensemble(site.scene(drawn + R"([[ensemble.vary]]
key = "block.B.volume"
uniform = ["1 m^3", "3 m^3"]
[[ensemble.vary]]
key = "interface.*/*.friction"
uniform = ["30 deg", "36 deg"]
[[line]]
name = "road"
points = [[10, 20], [110, 20]]
)")
                              .string(),
                          {});
  const std::vector<std::string> plan = ensemble.plan();
  EXPECT_TRUE(any_holds(plan, "70 members, seed 1"));
  EXPECT_TRUE(any_holds(plan, "block.B.release: one place a member in 800 m^2, x 100 to 140, y 100 to 120"));
  // Of the distributions themselves, whatever the members draw.
  EXPECT_TRUE(any_holds(plan, "block.B.volume: 5 % below 1.1 m^3, half below 2 m^3, 5 % above 2.9 m^3"));
  EXPECT_TRUE(any_holds(plan, "friction: 5 % below 30.3 deg, half below 33 deg, 5 % above 35.7 deg"));
  EXPECT_TRUE(any_holds(plan, "Line road: 100 m"));
  EXPECT_TRUE(any_holds(plan, "Releases a year: not given"));
}

const std::string viaduct = R"([[structure]]
name = "bridge"
kind = "viaduct"
material = "C40"
position = [60, 40, 0]
spans = 2
span_length = "20 m"
deck_level = 65
pier_width = "2 m"
pier_depth = "2 m"
deck_width = "6 m"
deck_depth = "1 m"
cell_size = "1 m"
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Site, AViaductInMapCoordinatesIsRefusedWithThoseOfTheScene) {
  const Site site;
  EXPECT_EQ(refusal(site.scene(drawn + viaduct)), "");
  const std::string high = refusal(site.scene(drawn + replaced(viaduct, "level = 65", "level = 1215")));
  EXPECT_NE(high.find("structure.bridge.deck_level = 1215: is in map coordinates"), std::string::npos)
      << high;
  EXPECT_NE(high.find("write 65"), std::string::npos) << high;
  const std::string far =
      refusal(site.scene(drawn + replaced(viaduct, "[60, 40, 0]", "[652360, 5241840, 0]")));
  EXPECT_NE(far.find("structure.bridge.position"), std::string::npos) << far;
  EXPECT_NE(far.find("write [60, 40, 0]"), std::string::npos) << far;
  // Beside the terrain either way: no more is known than that.
  const std::string lost = refusal(site.scene(drawn + replaced(viaduct, "[60, 40, 0]", "[400, 40, 0]")));
  EXPECT_EQ(lost.find("map coordinates"), std::string::npos) << lost;
  EXPECT_NE(lost.find("no height under this pier"), std::string::npos) << lost;
}

TEST(Site, CellsAtTheStrikeAreNoMatterOfMembers) {
  const Site site;
  const Ensemble ensemble(
      site.scene(drawn + viaduct + "[[structure.refine]]\nwhere = \"impact\"\ncell_size = \"0.5 m\"\n")
          .string(),
      {});
  EXPECT_FALSE(any_holds(warnings_of(ensemble), "refine"));
}

TEST(Site, HitsOnAStructureAreInTheSummary) {
  const Site site;
  // Spheres that fly at the pier from 20 m, or away from it.
  Ensemble ensemble(site.scene(R"([[ensemble.vary]]
key = "block.B.velocity"
list = [[30, 0, 0], [30, 0, 0], [-30, 0, 0]]
[[structure]]
name = "pier"
kind = "column"
material = "C40"
base = [60, 40, 50]
section = [4, 4]
height = 12
cell_size = "2 m"
)")
                        .string(),
                    {{"block.B.release.at", "[40, 40]"},
                     {"block.B.release.count", "1"},
                     {"ensemble.design", "\"factorial\""},
                     {"ensemble.members", "6"}});
  const fs::path out = fs::path(site.scene("")).parent_path() / "out";
  fs::create_directories(out);
  ensemble::Run run;
  run.directory = out;
  run.meet = [] {};
  const Summary summary = write_results(ensemble, out, run_members(ensemble, run));
  ASSERT_EQ(summary.structures.size(), 1u);
  EXPECT_EQ(summary.structures[0].name, "pier");
  EXPECT_EQ(summary.structures[0].members, 4);
  EXPECT_NEAR(summary.structures[0].probability.value, 4.0 / 6, 1e-12);
  EXPECT_NEAR(summary.structures[0].probability.low, wilson(4, 6).low, 1e-12);
}

// E_d and h_d by hand of the factors that stand with them.
TEST(Barrier, EnergyOfTheNinetyNinthHeightOfTheNinetyFifthPercentile) {
  const auto values = barrier_values({.speed_95 = 20, .mass_95 = 1000, .energy_99 = 400e3, .height_95 = 3});
  ASSERT_EQ(values.size(), 4u);
  EXPECT_NEAR(values[0].energy, 0.5 * (1000 * 1.1) * std::pow(20 * 1.1 * 1.02, 2) * 1.05, 1e-6);
  EXPECT_NEAR(values[0].height, 3 * 1.1 * 1.02, 1e-12);
  EXPECT_NEAR(values[2].energy, 400e3 * 1.05, 1e-6);
  EXPECT_NEAR(values[2].height, 3 * 1.10, 1e-12);
  EXPECT_EQ(values[2].from, "energy p99, height p95");
}

TEST(Hits, RunsGoRoundTheKindsOfHit) {
  std::vector<Task> tasks;
  for (int cluster = 0; cluster < 3; ++cluster)
    for (int turn = 0; turn < 3 - cluster; ++turn) tasks.push_back({.cluster = cluster, .turn = turn});
  std::vector<Cluster> kinds(3);
  for (std::size_t k = 0; k < 3; ++k) kinds[k].events.resize(std::array<std::size_t, 3>{4, 9, 4}[k]);
  std::vector<int> clusters;
  for (const std::size_t k : order_of_runs(tasks, kinds)) clusters.push_back(tasks[k].cluster);
  EXPECT_EQ(clusters, (std::vector<int>{1, 0, 2, 1, 0, 0}));
}

// From the area, at x = 100 to 140 m, a block gets beyond the grid's end at 200 m within the second, or
// rests.
TEST(Site, BlocksThatLeaveTheTerrainAreCounted) {
  const Site site;
  const fs::path scene = site.scene(drawn + R"([[ensemble.vary]]
key = "block.B.velocity"
list = [[0, 0, 0], [150, 0, 0]]
)");
  Ensemble ensemble(scene.string(), {});
  talus::test::Place out;
  ensemble::Run run;
  run.directory = out.path();
  run.meet = [] {};
  const Summary summary = write_results(ensemble, run.directory, run_members(ensemble, run));
  long fast = 0;
  for (long i = 0; i < 70; ++i) fast += ensemble.design().draw(i).texts[1].starts_with("[150") ? 1 : 0;
  ASSERT_GT(fast, 10);
  ASSERT_LT(fast, 60);
  EXPECT_EQ(summary.left, fast);
  const std::string expected = std::to_string(fast) + " of 70 members: a block left the terrain";
  EXPECT_TRUE(left_text(summary).starts_with(expected)) << left_text(summary);
  const auto text_of = [](const fs::path& file) {
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  };
  EXPECT_NE(text_of(run.directory / "summary.json").find(expected), std::string::npos);
  write_maps(ensemble, run.directory, 70);
  const std::string page = text_of(write_report(ensemble, run.directory));
  EXPECT_NE(page.find(expected), std::string::npos);
  // A colour and what it stands for stay in one line; what is long in small print does not.
  EXPECT_NE(page.find("td small,.key b{white-space:nowrap}"), std::string::npos);
  EXPECT_NE(page.find("</span>little</b>"), std::string::npos);
}

std::string with_line(const std::string& points) {
  return drawn + "[[line]]\nname = \"road\"\npoints = " + points + "\n";
}

TEST(Site, ALineTypedInSceneCoordinatesIsNotTakenForDegreesWhereTheOriginIsLeftOut) {
  const Site site;
  const fs::path scene = site.scene(with_line("[[65, 0], [65, 60]]"));
  std::stringstream text;
  text << std::ifstream(scene).rdbuf();
  std::string without = text.str();
  const std::string origin = "origin = [652300, 5241800, 1150]\n";
  without.erase(without.find(origin), origin.size());
  std::ofstream(scene) << without;
  const std::string refused = refusal(scene);
  EXPECT_NE(refused.find("line.road"), std::string::npos) << refused;
  EXPECT_NE(refused.find("the terrain's middle is at [652400, 5241900], its lowest ground at 1200 m"),
            std::string::npos)
      << refused;
  EXPECT_NE(refused.find("site.origin = [652400, 5241900, 1200]"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("degrees"), std::string::npos) << refused;
}

TEST(Site, ALineBesideTheTerrainIsToldWhereThatIs) {
  const Site site;
  const std::string refused = refusal(site.scene(with_line("[[65, 500], [65, 560]]")));
  EXPECT_NE(refused.find("the terrain spans x 0 to 200, y 0 to 200 there"), std::string::npos) << refused;
}

TEST(Site, FilesOfOneSceneAreInOneCoordinateSystemThoughTheTerrainNamesNone) {
  const Site site;
  const fs::path scene = site.scene("[[line]]\nname = \"road\"\nfile = \"road.geojson\"\n"),
                 folder = scene.parent_path();
  const auto read = [](const fs::path& path) {
    std::stringstream all;
    all << std::ifstream(path).rdbuf();
    return all.str();
  };
  std::string text = read(scene);
  text.erase(text.find("crs = "), std::string("crs = \"EPSG:32632\"\n").size());
  std::ofstream(scene) << text;
  const auto road = [&](const std::string& crs) {
    std::ofstream(folder / "road.geojson")
        << R"({"type": "LineString", "coordinates": [[652310, 5241900], [652490, 5241900]], "crs": {"type": )"
        << R"("name", "properties": {"name": "urn:ogc:def:crs:)" << crs << "\"}}}";
  };
  road("EPSG::25832");
  const Ensemble known(scene.string(), {});
  EXPECT_EQ(known.crs(), "EPSG:25832");
  EXPECT_FALSE(any_holds(warnings_of(known), "coordinate"));
  road("OGC:1.3:CRS84");
  EXPECT_NE(refusal(scene).find("degrees"), std::string::npos) << refusal(scene);
  road("EPSG::25832");
  std::string area = read(folder / "source.geojson");
  area.insert(1, R"("crs": {"type": "name", "properties": {"name": "EPSG:25833"}}, )");
  std::ofstream(folder / "source.geojson") << area;
  EXPECT_NE(refusal(scene).find("is in another coordinate system than"), std::string::npos) << refusal(scene);
}

// The nodes of a grid are the middles of its cells: half a cell beyond them belongs to it.
TEST(Site, ALineMayReachToTheEdgesOfTheOutermostCells) {
  const Site site;
  EXPECT_TRUE(warnings_of(Ensemble(site.scene(with_line("[[65, -2.5], [65, 202.5]]")).string(), {})).empty());
  const auto told = warnings_of(Ensemble(site.scene(with_line("[[65, -10], [65, 200]]")).string(), {}));
  ASSERT_EQ(told.size(), 1u);
  EXPECT_TRUE(any_holds(told, "10 m of its 210 m lie off the terrain")) << told[0];
  EXPECT_FALSE(any_holds(told, "site.origin")) << told[0];
}

}  // namespace
}  // namespace talus::ensemble

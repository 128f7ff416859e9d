#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "geometry/raster/raster_module.hpp"
#include "helpers/place.hpp"
#include "io/gis_files.hpp"
#include "io/hdf5_file.hpp"
#include "io/recorder.hpp"
#include "synthetic.hpp"

using namespace talus;
using talus::test::Place;
using talus::test::SyntheticRun;

namespace {

const Vec3 map_origin(50'000, 200'000, 10);

struct GisFiles : testing::Test {
  Place scratch;
  SyntheticRun run;
  std::filesystem::path results;
  void SetUp() override {
    run.cells = {1, 1, 2};
    run.history_interval = 0.02;
    auto header = run.header();
    header.crs = "EPSG:31254";
    header.map_origin = map_origin;
    io::RecorderOptions o;
    o.directory = scratch.path() / "out";
    o.paraview = false;
    io::Recorder recorder(o, header);
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.finish({});
    results = o.directory / "results.h5";
  }
  /// Value of the cell that holds a point of the scene.
  static double at(const geometry::Raster& map, const Vec3& p) {
    const auto j =
        static_cast<int>(std::floor((p.x() + map_origin.x() - map.transform[0]) / map.transform[1]));
    const auto i =
        static_cast<int>(std::floor((p.y() + map_origin.y() - map.transform[3]) / map.transform[5]));
    EXPECT_TRUE(i >= 0 && i < map.rows && j >= 0 && j < map.columns);
    return map.values[static_cast<std::size_t>(i * map.columns + j)];
  }
  static double sum(const geometry::Raster& map) {
    double s = 0;
    for (const double v : map.values) s += std::isnan(v) ? 0 : v;
    return s;
  }
};

TEST_F(GisFiles, TracksLieInMapCoordinatesWithTheirSystem) {
  const auto root = nlohmann::json::parse(io::tracks_geojson(results));
  EXPECT_EQ(root["type"], "FeatureCollection");
  EXPECT_EQ(root["crs"]["properties"]["name"], "EPSG:31254");
  ASSERT_EQ(root["features"].size(), 3u);  // two boulders and a fragment
  const auto& boulder = root["features"][0];
  EXPECT_EQ(boulder["geometry"]["type"], "LineString");
  EXPECT_EQ(boulder["properties"]["name"], "B1");
  EXPECT_DOUBLE_EQ(boulder["properties"]["mass"].get<double>(), 2600 * 2.6 * 3.0 * 3.4);
  const auto& line = boulder["geometry"]["coordinates"];
  const Vec3 start = run.position(0, 0) + map_origin, end = run.position(0, run.end) + map_origin;
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(line.front()[static_cast<std::size_t>(k)].get<double>(), start[k], 1e-9);
    EXPECT_NEAR(line.back()[static_cast<std::size_t>(k)].get<double>(), end[k], 1e-6);
  }
  EXPECT_GT(line.size(), 50u);
  EXPECT_EQ(root["features"][2]["properties"]["fragment"], true);
  EXPECT_NEAR(root["features"][2]["properties"]["birth"].get<double>(), run.impact + 0.5,
              1.5 * run.history_interval);
}

TEST_F(GisFiles, MapsHoldWhatCrossedTheirCells) {
  const auto passages = io::results_map(results, "passages", 2.5);
  EXPECT_EQ(passages.crs, "EPSG:31254");
  EXPECT_EQ(passages.transform[1], 2.5);
  EXPECT_EQ(std::remainder(passages.transform[0], 2.5), 0.0);  // on multiples of the cell
  EXPECT_GE(at(passages, run.position(0, 1.0)), 1);
  EXPECT_LE(*std::max_element(passages.values.begin(), passages.values.end(),
                              [](double a, double b) { return std::isnan(a) || (!std::isnan(b) && a < b); }),
            3);

  const auto speed = io::results_map(results, "speed", 2.5);
  const Vec3 v = (run.position(0, 3.001) - run.position(0, 2.999)) / 0.002;
  EXPECT_GE(at(speed, run.position(0, 3.0)), v.norm() - 1e-3);
  EXPECT_LE(at(speed, run.position(0, 3.0)), v.norm() + 3);
  for (std::size_t k = 0; k < speed.values.size(); ++k)
    EXPECT_EQ(std::isnan(speed.values[k]), std::isnan(passages.values[k]));

  const auto kinetic = io::results_map(results, "kinetic", 2.5);
  EXPECT_GE(at(kinetic, run.position(0, 3.0)), 0.5 * 2600 * 2.6 * 3.0 * 3.4 * v.squaredNorm());
}

TEST_F(GisFiles, HeightsAreOverTheTerrain) {
  const auto height = io::results_map(results, "height", 1);
  double greatest = 0;
  for (const double h : height.values)
    if (!std::isnan(h)) {
      EXPECT_GT(h, 1.4);  // 1.6 m over the ground, but for the terrain's triangles
      greatest = std::max(greatest, h);
    }
  EXPECT_NEAR(greatest, 1.6 + 4.5, 0.15);
}

TEST_F(GisFiles, DepositKeepsTheVolume) {
  const auto volume = io::Hdf5File::open(results).read<double>("/geometry/blocks/volume").values;
  EXPECT_NEAR(sum(io::results_map(results, "deposit", 5)), volume[0] + volume[1] + volume[2], 1e-12);
  EXPECT_GE(at(io::results_map(results, "deposit", 5), run.position(0, run.end)), volume[0]);
}

/// Over the edge northwards at 20 m/s after a second, then a free fall: the line ends at the edge, and
/// nothing lies beyond it.
TEST(GisTracks, EndWhereTheBlockLeftTheModel) {
  const Place scratch;
  SyntheticRun run;
  run.structure = false;
  run.blocks = 1;
  run.terrain_nodes = 9;
  io::RecorderOptions o;
  o.directory = scratch.path() / "out";
  o.paraview = false;
  io::Recorder recorder(o, run.header());
  const Vec3 edge = run.offset + Vec3(80, 160, run.ground(80, 160) + 1);
  sim::HistoryRow row = run.row(0, 1);
  for (int k = 0; k <= 400; ++k) {
    row.time = 0.01 * k;
    const double past = std::max(0.0, row.time - 1);
    row.position[0] = edge + Vec3(0, 20 * (row.time - 1), -4.905 * past * past);
    row.velocity[0] = Vec3(0, 20, -9.81 * past);
    recorder.history(row);
  }
  recorder.finish({});
  const auto results = o.directory / "results.h5";
  const double left = io::Hdf5File::open(results).read<double>("/history/blocks/left").values.at(0);
  EXPECT_NEAR(left, 1.0, 0.02);
  const auto feature = nlohmann::json::parse(io::tracks_geojson(results))["features"][0];
  EXPECT_EQ(feature["properties"]["left"], true);
  EXPECT_EQ(feature["properties"]["end"], left);
  EXPECT_NEAR(feature["geometry"]["coordinates"].back()[1].get<double>(), edge.y(), 0.5);
  const auto deposit = io::results_map(results, "deposit", 5);
  EXPECT_TRUE(
      std::all_of(deposit.values.begin(), deposit.values.end(), [](double v) { return std::isnan(v); }));
}

TEST_F(GisFiles, TheCellIsChosenRoundAndBadRequestsAreTold) {
  const auto map = io::results_map(results, "passages", 0);
  EXPECT_EQ(map.transform[1], 1);  // some 110 m of path
  EXPECT_THROW(io::results_map(results, "anger", 1), InputError);
  EXPECT_THROW(io::results_map(results, "passages", 1e-3), InputError);
  EXPECT_THROW(io::results_map(results, "passages", 1e30), InputError);
  EXPECT_THROW(io::tracks_geojson(scratch.path() / "missing.h5"), InputError);
}

TEST(ForeignResults, AreRefusedBeforeTheyAreUsedAsIndices) {
  const Place scratch;
  const auto written = [&](const char* name, std::size_t velocities, std::int32_t corner) {
    const auto path = scratch.path() / name;
    io::Hdf5File file = io::Hdf5File::create(path);
    const std::string h = "/history/blocks/";
    file.write<double>("/history/time", std::vector<double>{0, 1}, {2});
    file.write(h + "name", std::vector<std::string>{"B"});
    file.write<double>(h + "position", std::vector<double>{0, 0, 5, 1, 1, 5}, {2, 1, 3});
    file.write<double>(h + "velocity", std::vector<double>(velocities, 1.0), {velocities});
    for (const char* energy : {"kinetic_translational", "kinetic_rotational"})
      file.write<double>(h + energy, std::vector<double>{1, 1}, {2, 1});
    file.write<double>("/geometry/terrain/vertices", std::vector<double>{-9, -9, 0, 9, -9, 0, 0, 9, 0},
                       {3, 3});
    file.write<std::int32_t>("/geometry/terrain/triangles", std::vector<std::int32_t>{0, 1, corner}, {1, 3});
    file.close();
    return path;
  };
  EXPECT_GT(io::results_map(written("whole.h5", 6, 2), "height", 1).values.size(), 0u);
  EXPECT_THROW(io::results_map(written("short.h5", 3, 2), "speed", 1), InputError);
  EXPECT_THROW(io::results_map(written("beyond.h5", 6, 7'000'000), "height", 1), InputError);
}

}  // namespace

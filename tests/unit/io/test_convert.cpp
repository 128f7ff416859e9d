#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "core/error.hpp"
#include "geometry/block_output.hpp"
#include "helpers/place.hpp"
#include "io/block_files.hpp"
#include "io/convert.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"
#include "synthetic.hpp"

using namespace talus;
using talus::test::Place;
using talus::test::SyntheticRun;

namespace {

std::vector<std::vector<std::string>> cells(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    rows.emplace_back();
    std::istringstream parts(line + ",");
    for (std::string cell; std::getline(parts, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

struct Converted : testing::Test {
  Place scratch;
  std::string results;
  void SetUp() override {
    SyntheticRun run;
    run.terrain_nodes = 5;
    run.cells = {1, 1, 2};
    run.history_interval = 0.05;
    io::RecorderOptions o;
    o.directory = scratch.path() / "out";
    o.paraview = false;
    io::Recorder recorder(o, run.header());
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.finish({});
    results = (scratch.path() / "out/results.h5").string();
  }
};

TEST_F(Converted, BlocksComeWithNamesUnitsAndAllDigits) {
  const std::string out = (scratch.path() / "blocks.csv").string();
  io::convert(results + "#/history/blocks", out);
  const auto rows = cells(io::read_file(out));
  ASSERT_EQ(rows.size(), 162u);
  ASSERT_EQ(rows[0].size(), 1 + 3 * (3 + 3 + 3 + 4 + 6 + 2 + 1));  // the last: heights over the ground
  EXPECT_EQ(rows[0][0], "time [s]");
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin());
  };
  const auto position = io::Hdf5File::open(results).read<double>("/history/blocks/position");
  const std::size_t y = column("B2.position.y [m]");
  ASSERT_LT(y, rows[0].size());
  for (std::size_t k = 0; k < 161; k += 20)
    EXPECT_EQ(std::stod(rows[k + 1][y]), position.values[(k * 3 + 1) * 3 + 1]);
  EXPECT_LT(column("B1.orientation.w"), rows[0].size());
  // The boulder hops by up to 4.5 m with its centroid 1.6 m over the ground, but for the coarse triangles of
  // this terrain.
  const std::size_t height = column("B1.height_over_ground [m]");
  ASSERT_LT(height, rows[0].size());
  double greatest = 0;
  for (std::size_t k = 1; k < rows.size(); ++k) greatest = std::max(greatest, std::stod(rows[k][height]));
  EXPECT_NEAR(greatest, 1.6 + 4.5, 3.5);
  EXPECT_EQ(rows[1][column("P2-fragment-1.height_over_ground [m]")], "");
  EXPECT_LT(column("B1.strain.g_yz"), rows[0].size());
  EXPECT_EQ(rows[1][column("P2-fragment-1.position.x [m]")], "");  // not born yet
  EXPECT_NE(rows[161][column("P2-fragment-1.position.x [m]")], "");
}

TEST_F(Converted, LedgerStructureContactsAndSingleDatasets) {
  EXPECT_EQ(cells(io::csv_text(results, "/ledger"))[0].size(), 1 + 14 + 6);
  const auto p2 = cells(io::csv_text(results, "/history/structures/P2"));
  EXPECT_NE(std::find(p2[0].begin(), p2[0].end(), "top.probe_displacement.x [m]"), p2[0].end());
  const auto contacts = cells(io::csv_text(results, "/history/contacts/structure"));
  EXPECT_EQ(contacts.size(), 401u);
  EXPECT_EQ(contacts[0][0], "time [s]");
  EXPECT_EQ(
      cells(io::csv_text(results, "/history/blocks/kinetic_translational"))[0],
      (std::vector<std::string>{"time [s]", "B1.kinetic_translational [J]", "B2.kinetic_translational [J]",
                                "P2-fragment-1.kinetic_translational [J]"}));
  EXPECT_EQ(cells(io::csv_text(results, "/geometry/blocks/vertices")).size(), 25u);
  EXPECT_EQ(cells(io::csv_text(results, "/history/time"))[0], (std::vector<std::string>{"time [s]"}));
  for (const char* several : {"/history", "/history/contacts", "/history/structures"}) try {
      io::csv_text(results, several);
      ADD_FAILURE() << several << " was written";
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("holds several histories"), std::string::npos) << e.what();
    }
}

/// Shear of members has four axes: time, member, station, direction. Every row of the file is one time.
TEST(Convert, ForcesOfMembersStandInTheRowOfTheirTime) {
  const Place scratch;
  const std::string file = (scratch.path() / "members.h5").string(),
                    out = (scratch.path() / "shear.csv").string(), group = "/history/structures/V/members/";
  {
    io::Hdf5File h5 = io::Hdf5File::create(file);
    const std::vector<double> time{0, 0.5, 1};
    h5.write<double>("/history/time", time, {3}, "s");
    h5.write(group + "name", {"P1", "P2"});
    std::vector<double> shear;
    for (int t = 0; t < 3; ++t)
      for (int m = 1; m <= 2; ++m)
        for (int s = 0; s < 3; ++s)
          for (int axis = 0; axis < 2; ++axis) shear.push_back(1000 * t + 100 * m + 10 * s + axis);
    h5.write<double>(group + "shear", shear, {3, 2, 3, 2}, "N");
  }
  io::convert(file + "#" + group + "shear", out);
  const auto rows = cells(io::read_file(out));
  ASSERT_EQ(rows.size(), 4u);
  ASSERT_EQ(rows[0].size(), 13u);
  const std::size_t at = static_cast<std::size_t>(
      std::find(rows[0].begin(), rows[0].end(), "P2.shear.2.1 [N]") - rows[0].begin());
  ASSERT_EQ(at, 12u);
  for (int t = 0; t < 3; ++t)
    EXPECT_EQ(rows[static_cast<std::size_t>(t) + 1][at], std::to_string(1000 * t + 221)) << t;
}

TEST_F(Converted, BadRequestsSayWhatToDo) {
  const std::string out = (scratch.path() / "x.csv").string();
  EXPECT_THROW(io::convert(results + "#/history/nothing", out), InputError);
  EXPECT_THROW(io::convert(results + "#history", out), InputError);
  EXPECT_THROW(io::convert("missing.h5#/ledger", out), InputError);
  EXPECT_THROW(io::convert(results + "#/ledger", (scratch.path() / "x.xls").string()), InputError);
  EXPECT_THROW(io::convert("terrain.asc", out), InputError);
  EXPECT_FALSE(std::filesystem::exists(out));
  io::write_file(scratch.path() / "junk.h5", "this is no HDF5");
  EXPECT_THROW(io::convert((scratch.path() / "junk.h5").string(), out), InputError);
}

TEST_F(Converted, BlocksOfAnyTimeAreClosedSurfacesThatGoBackToHdf5) {
  const auto file = io::Hdf5File::open(results);
  const auto position = file.read<double>("/history/blocks/position");
  const auto names = file.read_texts("/history/blocks/name");
  const std::size_t blocks = names.size(), last = position.rows() - 1;
  const std::string obj = (scratch.path() / "end.obj").string(), h5 = (scratch.path() / "end.h5").string();
  geometry::write_mesh(obj, io::read_blocks(results, "end"));
  const auto system = geometry::read_block_system(obj);
  ASSERT_FALSE(system.empty());
  for (const auto& b : system) {
    const auto at = static_cast<std::size_t>(std::find(names.begin(), names.end(), b.name) - names.begin());
    ASSERT_LT(at, blocks);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(b.centroid[k], position.values[(last * blocks + at) * 3 + static_cast<std::size_t>(k)],
                  1e-9);
  }
  io::write_blocks(h5, obj);
  const geometry::Mesh again = io::read_blocks(h5, "");
  double volume = 0, sum = 0;
  for (const auto& b : system) sum += b.volume;
  volume = geometry::signed_volume(again.vertices, again.triangles);
  EXPECT_NEAR(volume, sum, 1e-9 * sum);
  for (const char* when : {"noon", "nan", "inf", "-5", "99", "8.01"})
    EXPECT_THROW(io::read_blocks(results, when), InputError) << when;
  EXPECT_EQ(io::read_blocks(results, "8.000001").vertices,
            io::read_blocks(results, "end").vertices);  // rounded
  EXPECT_NE(io::read_blocks(results, "0").vertices, io::read_blocks(results, "end").vertices);
}

TEST_F(Converted, FoldersMayHaveAHashInTheirNames) {
  const auto folder = scratch.path() / "site #2";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(results, folder / "results.h5");
  const std::string moved = (folder / "results.h5").string(), out = (scratch.path() / "ledger.csv").string();
  io::convert(moved + "#/ledger", out);
  EXPECT_TRUE(io::read_file(out).starts_with("time [s],"));
  io::convert(moved, out);
  EXPECT_NE(io::read_file(out).find("B1.position.x [m]"), std::string::npos);
  EXPECT_EQ(io::file_and_part((folder / "missing.h5").string()).part, std::nullopt);
  EXPECT_EQ(io::file_and_part((folder / "missing.h5").string() + "#/ledger").part, "/ledger");
}

}  // namespace

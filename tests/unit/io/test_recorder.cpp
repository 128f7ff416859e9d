#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/error.hpp"
#include "helpers/place.hpp"
#include "io/hdf5_file.hpp"
#include "io/journal.hpp"
#include "io/recorder.hpp"
#include "io/results.hpp"
#include "recorded.hpp"

namespace fs = std::filesystem;
using namespace talus;
using talus::test::Place;
using talus::test::recorder_options;
using talus::test::small;
using talus::test::SyntheticRun;
using talus::test::whole_run;

TEST(Recorder, WritesEveryDatasetOfTheContractWithItsShape) {
  const Place scratch;
  const SyntheticRun run = small();
  const auto file = io::Hdf5File::open(whole_run(scratch, run) / "results.h5");
  const std::size_t nt = static_cast<std::size_t>(run.rows()), nb = 3;
  const std::map<std::string, io::Dims> expected = {
      {"/history/time", {nt}},
      {"/history/blocks/position", {nt, nb, 3}},
      {"/history/blocks/velocity", {nt, nb, 3}},
      {"/history/blocks/spin", {nt, nb, 3}},
      {"/history/blocks/orientation", {nt, nb, 4}},
      {"/history/blocks/strain", {nt, nb, 6}},
      {"/history/blocks/kinetic_translational", {nt, nb}},
      {"/history/blocks/kinetic_rotational", {nt, nb}},
      {"/history/blocks/mass", {nb}},
      {"/history/blocks/name", {nb}},
      {"/history/structures/P2/base_force", {nt, 3}},
      {"/history/structures/P2/base_moment", {nt, 3}},
      {"/history/structures/P2/probe_displacement", {nt, 2, 3}},
      {"/history/structures/P2/damage_max", {nt}},
      {"/history/structures/P2/damaged_volume", {nt}},
      {"/history/contacts/structure/time", {400}},
      {"/history/contacts/structure/force", {400, 3}},
      {"/history/contacts/structure/block", {400}},
      {"/ledger/residual", {nt}},
      {"/ledger/angular_momentum", {nt, 3}},
      {"/geometry/blocks/vertices", {24, 3}},
      {"/geometry/blocks/vertex_offset", {4}},
      {"/geometry/blocks/face_vertices", {72}},
      {"/geometry/blocks/face_offset", {19}},
      {"/geometry/blocks/block_face_offset", {4}},
  };
  for (const auto& [path, dims] : expected) {
    ASSERT_TRUE(file.exists(path)) << path;
    EXPECT_EQ(file.dims(path), dims) << path;
    EXPECT_FALSE(file.text_attribute(path, "description").empty()) << path;
    if (!file.is_text(path)) { EXPECT_FALSE(file.text_attribute(path, "unit").empty()) << path; }
  }
  EXPECT_EQ(file.read_texts("/history/blocks/name"), (std::vector<std::string>{"B1", "B2", "P2-fragment-1"}));
}

TEST(Recorder, KeepsEveryNumberAndGivesNanBeforeBirth) {
  const Place scratch;
  const SyntheticRun run = small();
  const auto file = io::Hdf5File::open(whole_run(scratch, run) / "results.h5");
  const auto time = file.read<double>("/history/time");
  const auto position = file.read<double>("/history/blocks/position");
  const auto moment = file.read<double>("/history/structures/P2/base_moment");
  const auto residual = file.read<double>("/ledger/residual");
  (void)run.row(0, 2);  // fixes the energy at the start
  for (int k = 0; k < run.rows(); k += 13) {
    const double t = time.values[static_cast<std::size_t>(k)];
    ASSERT_EQ(t, k * run.history_interval);
    const auto row = run.row(t, run.present(t));
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t c = 0; c < 3; ++c) {
        const double v = position.values[(static_cast<std::size_t>(k) * 3 + b) * 3 + c];
        if (b < row.position.size())
          EXPECT_EQ(v, row.position[b][static_cast<Eigen::Index>(c)]);
        else
          EXPECT_TRUE(std::isnan(v)) << t;
      }
    EXPECT_EQ(moment.values[static_cast<std::size_t>(k) * 3 + 1], row.structures[0].base_moment.y());
    EXPECT_EQ(residual.values[static_cast<std::size_t>(k)], row.ledger.residual);
  }
}

TEST(Recorder, RefusesADirectoryThatIsNotItsOwn) {
  const Place scratch;
  const fs::path dir = scratch.path() / "mine";
  fs::create_directories(dir);
  std::ofstream(dir / "thesis.txt") << "ten years of work";
  EXPECT_THROW(io::Recorder(recorder_options(dir), small().header()), InputError);
  EXPECT_EQ(io::read_file(dir / "thesis.txt"), "ten years of work");
  EXPECT_EQ(std::distance(fs::directory_iterator(dir), fs::directory_iterator{}), 1);  // nothing was written
  std::ofstream(scratch.path() / "file") << "x";
  EXPECT_THROW(io::Recorder(recorder_options(scratch.path() / "file"), small().header()), InputError);
  EXPECT_THROW(io::Recorder(recorder_options(scratch.path() / "file" / "below"), small().header()),
               InputError);
}

TEST(Recorder, OverwritesItsOwnDirectoryButLeavesForeignFiles) {
  const Place scratch;
  const fs::path dir = whole_run(scratch, small());
  std::ofstream(dir / "notes.txt") << "keep";
  SyntheticRun shorter = small();
  shorter.end = 1;
  whole_run(scratch, shorter);
  EXPECT_EQ(io::read_file(dir / "notes.txt"), "keep");
  EXPECT_EQ(io::Hdf5File::open(dir / "results.h5").dims("/history/time"), io::Dims{101});
  EXPECT_FALSE(fs::exists(dir / "fields/blocks_000100.vtu"));
}

TEST(Recorder, WhatWasFlushedSurvivesACutAtAnyByte) {
  const Place scratch;
  SyntheticRun run = small();
  run.end = 0.3;
  const fs::path dir = scratch.path() / "out";
  std::string journal;
  {
    io::Recorder recorder(recorder_options(dir), run.header());
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.checkpoint();
    journal = io::read_file(dir / "journal.bin");
  }
  std::size_t before = 0;
  bool grew = false;
  for (std::size_t cut = 8; cut <= journal.size(); cut += 1 + journal.size() / 29) {
    io::write_file(dir / "journal.bin", std::string_view(journal).substr(0, cut));
    ASSERT_TRUE(io::recover(dir));
    const std::size_t rows = io::Hdf5File::open(dir / "results.h5").dims("/history/time")[0];
    EXPECT_GE(rows, before);
    grew = grew || rows > before;
    before = rows;
  }
  EXPECT_TRUE(grew);
  EXPECT_GE(before, 29u);
}

TEST(Recorder, AFlippedBitEndsTheJournalThere) {
  const Place scratch;
  SyntheticRun run = small();
  run.end = 0.3;
  const fs::path dir = scratch.path() / "out";
  {
    io::Recorder recorder(recorder_options(dir), run.header());
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.checkpoint();
  }
  std::string journal = io::read_file(dir / "journal.bin");
  journal[journal.size() * 3 / 4] = static_cast<char>(journal[journal.size() * 3 / 4] ^ 4);
  io::write_file(dir / "journal.bin", journal);
  io::JournalReader reader(dir / "journal.bin");
  io::RecordKind kind;
  std::string payload;
  while (reader.next(kind, payload)) {}
  EXPECT_TRUE(reader.damaged());
  EXPECT_LT(reader.position(), journal.size() * 3 / 4 + 1);
  EXPECT_TRUE(io::recover(dir));
}

TEST(Recorder, ResumedRunWritesTheSameBytesAsAnUnbrokenOne) {
  const Place scratch;
  const SyntheticRun run = small();
  const fs::path whole = whole_run(scratch, run, "whole"), dir = scratch.path() / "cut";
  std::uint64_t position = 0;
  {
    io::Recorder recorder(recorder_options(dir), run.header());
    run.record(recorder, 0, 600, [&](int k) {
      if (k == 555) position = recorder.checkpoint();  // a fragment is there by now
    });
  }  // rows 556 to 600 are lost with the process
  io::Recorder recorder(recorder_options(dir), position);
  EXPECT_EQ(recorder.header().blocks.size(), 3u);
  run.record(recorder, 556, run.rows() - 1, [](int) {});
  recorder.finish({});
  for (const char* name : {"results.h5", "results.xdmf", "results.pvd", "summary.json"})
    EXPECT_EQ(io::read_file(whole / name), io::read_file(dir / name)) << name;
  for (const auto& entry : fs::directory_iterator(whole / "fields"))
    EXPECT_EQ(io::read_file(entry.path()), io::read_file(dir / "fields" / entry.path().filename()));
}

TEST(Recorder, RebuildingAsItGrowsStaysLinear) {
  const Place scratch;
  SyntheticRun run = small();
  run.structure = false;
  const fs::path dir = scratch.path() / "out";
  io::Recorder recorder(recorder_options(dir), run.header());
  int rebuilds = 0;
  fs::file_time_type last{};
  std::uintmax_t written = 0;
  run.record(recorder, 0, run.rows() - 1, [&](int) {
    recorder.checkpoint();
    const auto now = fs::last_write_time(dir / "results.h5");
    if (now != last) ++rebuilds, written += fs::file_size(dir / "results.h5");
    last = now;
  });
  recorder.finish({});
  EXPECT_LT(rebuilds, 25);  // log(size) / log(1.5), not one per checkpoint
  EXPECT_LT(written, 4 * fs::file_size(dir / "results.h5"));
}

TEST(Recorder, QuietStructuresAreNotWrittenAgain) {
  const Place scratch;
  const SyntheticRun run = small();
  const fs::path dir = whole_run(scratch, run);
  EXPECT_TRUE(fs::exists(dir / "fields/P2_000000.vtu"));
  EXPECT_FALSE(fs::exists(dir / "fields/P2_000050.vtu"));  // nothing has happened yet at 2.5 s
  EXPECT_TRUE(fs::exists(dir / "fields/P2_000110.vtu"));
  const std::string pvd = io::read_file(dir / "results.pvd");
  EXPECT_NE(pvd.find("timestep=\"2.5\" part=\"2\" name=\"P2\" file=\"fields/P2_000000.vtu\""),
            std::string::npos);
  EXPECT_NE(pvd.find("timestep=\"0\""), std::string::npos);
  EXPECT_NE(io::read_file(dir / "results.xdmf").find("<Time Value=\"2.5\"/>"), std::string::npos);
}

/// A run of 0.2 s whose structure has this name.
fs::path run_of_structure(const Place& scratch, const std::string& name) {
  SyntheticRun run = small();
  run.end = 0.2;
  run.bars = true;
  sim::RunHeader header = run.header();
  header.structures[0].name = name;
  const fs::path dir = scratch.path() / "out";
  io::Recorder recorder(recorder_options(dir), header);
  run.record(recorder, 0, run.rows() - 1, [](int) {});
  recorder.finish({});
  return dir;
}

TEST(Recorder, NamesAreEscapedInWhatParaViewOpens) {
  const Place scratch;
  const fs::path dir = run_of_structure(scratch, "Pier <A> & \"B\"");
  EXPECT_TRUE(fs::exists(dir / "fields/Pier <A> & \"B\"_000000.vtu"));
  const std::string pvd = io::read_file(dir / "results.pvd"), xdmf = io::read_file(dir / "results.xdmf"),
                    name = "Pier &lt;A&gt; &amp; &quot;B&quot;";
  EXPECT_NE(pvd.find("name=\"" + name + "\" file=\"fields/" + name + "_000000.vtu\""), std::string::npos)
      << pvd;
  EXPECT_NE(xdmf.find("Name=\"" + name + "\""), std::string::npos);
  EXPECT_NE(xdmf.find("/structures/" + name + "/nodes"), std::string::npos);
}

/// A structure of the name "blocks" wrote over the files of the blocks.
TEST(Recorder, NoTwoPartsShareTheirFiles) {
  const Place scratch;
  const fs::path dir = run_of_structure(scratch, "blocks");
  const std::string pvd = io::read_file(dir / "results.pvd");
  for (const std::string stem : {"blocks", "blocks_", "blocks__bars"}) {
    EXPECT_TRUE(fs::exists(dir / ("fields/" + stem + "_000000.vtu"))) << stem;
    EXPECT_NE(pvd.find("file=\"fields/" + stem + "_000000.vtu\""), std::string::npos) << pvd;
  }
  EXPECT_NE(io::read_file(dir / "fields/blocks_000000.vtu").find("faceoffsets"), std::string::npos);
  EXPECT_EQ(io::read_file(dir / "fields/blocks__000000.vtu").find("faceoffsets"), std::string::npos);
}

TEST(Recorder, FullDiskIsReportedAndKeepsWhatWasThere) {
  if (!fs::exists("/dev/full")) GTEST_SKIP();
  const Place scratch;
  const fs::path dir = scratch.path();
  fs::create_symlink("/dev/full", dir / "journal.bin");
  EXPECT_THROW(
      {
        io::JournalWriter writer(dir / "journal.bin", 0);
        writer.flush();
      },
      io::WriteError);
}

TEST(Recorder, SceneWithoutBlocksOrStructuresIsFine) {
  const Place scratch;
  const fs::path dir = scratch.path() / "out";
  io::Recorder recorder(recorder_options(dir), sim::RunHeader{});
  recorder.history(sim::HistoryRow{});
  recorder.field(0, {}, {});
  recorder.finish({});
  EXPECT_EQ(io::Hdf5File::open(dir / "results.h5").dims("/history/blocks/position"), (io::Dims{1, 0, 3}));
}

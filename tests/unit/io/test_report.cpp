#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/error.hpp"
#include "helpers/place.hpp"
#include "io/files.hpp"
#include "io/report.hpp"
#include "io/report_data.hpp"
#include "io/report_parts.hpp"
#include "synthetic.hpp"

using namespace talus;
using talus::test::Place;
using talus::test::SyntheticRun;

TEST(ReportParts, FramesKeepTheEndsAndThickenInTheWindows) {
  std::vector<double> time;
  for (int i = 0; i <= 10000; ++i) time.push_back(i * 1e-3);
  const auto picked = io::pick_frames(time, 300, {{4.0, 4.2}});
  EXPECT_EQ(picked.front(), 0u);
  EXPECT_EQ(picked.back(), 10000u);
  EXPECT_LE(picked.size(), 301u);
  EXPECT_TRUE(std::is_sorted(picked.begin(), picked.end()));
  const auto inside =
      std::count_if(picked.begin(), picked.end(), [](std::size_t i) { return i >= 4000 && i <= 4200; });
  EXPECT_GT(inside, 60);  // 2 % of the time, at least a fifth of the frames
}

TEST(ReportParts, ExtremesSurviveDecimation) {
  std::vector<double> y(100000, 0.0);
  y[12345] = 7;
  y[98765] = -3;
  const auto picked = io::pick_extremes(y.size(), {y}, 500);
  EXPECT_LE(picked.size(), 600u);
  EXPECT_TRUE(std::binary_search(picked.begin(), picked.end(), 12345u));
  EXPECT_TRUE(std::binary_search(picked.begin(), picked.end(), 98765u));
}

TEST(ReportParts, DecimationKeepsTheRegionAndTheExtent) {
  io::Mesh mesh;
  const int n = 301;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) mesh.vertices.emplace_back(i, j, 0.3 * i);
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      const int a = j * n + i;
      mesh.triangles.push_back({a, a + 1, a + n + 1});
      mesh.triangles.push_back({a, a + n + 1, a + n});
    }
  const Box3 region(Vec3(100, 100, 0), Vec3(140, 140, 0));
  const io::Mesh thin = io::decimate(mesh, region, 30000);
  EXPECT_LE(thin.triangles.size(), 30000u);
  EXPECT_GT(thin.triangles.size(), 3000u);
  // Within the region nothing is merged, and the surface stays the plane that it was.
  const auto kept = std::count_if(thin.vertices.begin(), thin.vertices.end(), [&](const Vec3& v) {
    return v.x() >= 100 && v.x() <= 140 && v.y() >= 100 && v.y() <= 140;
  });
  EXPECT_GE(kept, 41 * 41);
  for (const Vec3& v : thin.vertices) EXPECT_NEAR(v.z(), 0.3 * v.x(), 1e-9);
  const io::Raster r = io::rasterise(mesh, region, 21);
  EXPECT_EQ(r.nx, 21);
  for (int i = 0; i < r.nx; ++i)
    EXPECT_NEAR(r.z[static_cast<std::size_t>(5 * r.nx + i)], 0.3 * (r.x0 + i * r.dx), 1e-5);
}

TEST(ReportParts, SkinOfABarHasOnlyOuterFacesOutward) {
  SyntheticRun run;
  run.cells = {2, 3, 4};
  const auto s = run.snapshot(0);
  std::vector<std::int32_t> hexes;
  for (const auto& h : s.hexes) hexes.insert(hexes.end(), h.begin(), h.end());
  const io::Skin skin = io::skin(hexes);
  EXPECT_EQ(skin.quads.size(), 2u * (2 * 3 + 3 * 4 + 2 * 4));
  double volume = 0;  // by the divergence theorem: right only if every face points outward
  for (const auto& q : skin.quads) {
    const auto x = [&](int k) -> Vec3 {
      return s.nodes[static_cast<std::size_t>(q[static_cast<std::size_t>(k)])] - run.base();
    };
    volume += (x(0).dot(x(1).cross(x(2))) + x(0).dot(x(2).cross(x(3)))) / 6;
  }
  EXPECT_NEAR(volume, 2.0 * 2.0 * 12.0, 1e-9);
}

TEST(ReportParts, Base64OfTheStandard) {
  EXPECT_EQ(io::base64(""), "");
  EXPECT_EQ(io::base64("f"), "Zg==");
  EXPECT_EQ(io::base64("fo"), "Zm8=");
  EXPECT_EQ(io::base64("foobar"), "Zm9vYmFy");
}

TEST(Report, IsOneFileWithoutReferencesAndHostileNamesStayText) {
  const Place scratch;
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.cells = {1, 1, 2};
  run.end = 6;
  auto header = run.header();
  header.title = "</script><script>alert(1)</script> & \"quotes\" %%TALUS_DATA%%";
  header.blocks[0].name = "<img src=x onerror=alert(2)>";
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  {
    io::Recorder recorder(options, header);
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.finish({});
  }
  const std::string page = io::read_file(io::write_report(options.directory));
  EXPECT_EQ(page.find("<script>alert(1)"), std::string::npos);
  EXPECT_EQ(page.find("<img src=x"), std::string::npos);
  EXPECT_EQ(page.find("<script src"), std::string::npos);
  EXPECT_EQ(page.find("<link rel=\"stylesheet"), std::string::npos);
  EXPECT_NE(page.find("\\u003cimg src=x"), std::string::npos);
}

/// An array of the page, as numbers.
std::vector<double> array_of(const io::ReportData& data, const std::string& name) {
  const auto& entry = data.blob.index().at(name);
  const std::size_t n = entry.at("dims")[0],
                    size = entry.at("type") == "f64" ? sizeof(double) : sizeof(float);
  std::vector<double> v(n);
  for (std::size_t i = 0; i < n; ++i) {
    const char* from = data.blob.bytes().data() + entry.at("offset").get<std::size_t>() + i * size;
    float narrow = 0;
    if (size == sizeof(double))
      std::memcpy(&v[i], from, size);
    else
      std::memcpy(&narrow, from, size), v[i] = narrow;
  }
  return v;
}

/// Section forces over the stations of a pier under a known force at 3.4 m; a member's place; where a path
/// crosses a line.
TEST(Report, ShowsSectionForcesAlongMembersAndCrossingsOfLines) {
  const Place scratch;
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.cells = {1, 1, 2};
  run.end = 5.2;
  run.history_interval = 0.005;
  run.members = run.line = true;
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  {
    io::Recorder recorder(options, run.header());
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.finish({});
  }
  io::ReportData data(options.directory);
  io::add_curves(data);
  const auto& pier = data.meta.at("members").at(0);
  const auto& span = data.meta.at("members").at(1);
  EXPECT_EQ(pier.at("name"), "P2");
  const Vec3 foot = run.base();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(pier.at("base")[k].get<double>(), foot[k], 1e-9);
  EXPECT_NEAR(pier.at("end")[2].get<double>() - foot.z(), 12, 1e-9);
  EXPECT_NEAR(span.at("end")[1].get<double>() - foot.y(), 15, 1e-9);  // 30 m along y from 15 m before
  const std::string key = pier.at("key");
  EXPECT_EQ(array_of(data, key + "_station"), (std::vector<double>{0, 3, 6, 9, 12}));
  const double middle = pier.at("time"), force = run.force(middle);
  EXPECT_NEAR(middle, run.impact + 0.5 * run.contact_time, 0.5 * run.history_interval + 1e-9);
  const auto then = array_of(data, key + "_shear_then"), most = array_of(data, key + "_shear_most");
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(then[k], k < 2 ? force : 0, 1e-6 * force) << k;
  EXPECT_NEAR(most[0], std::max({run.force(5.005), run.force(5.01), run.force(5.015)}), 1e-6 * force);
  EXPECT_NEAR(array_of(data, key + "_moment_then")[0], 3.4 * force, 1e-6 * force);
  EXPECT_NEAR(array_of(data, key + "_axial_first")[4], 0.72e6, 1);
  const auto& road = data.meta.at("lines").at(0);
  EXPECT_EQ(road.at("name"), "road");
  EXPECT_EQ(road.at("rows").size(), 1u);
  EXPECT_EQ(road.at("rows")[0].at("block"), "B1");
  EXPECT_NEAR(road.at("rows")[0].at("speed").get<double>(), std::hypot(20, 9), 1e-12);
  EXPECT_NEAR(road.at("rows")[0].at("kinetic").get<double>(), 4.1e6, 1e-6);
}

/// What ground laws took has its curves in the plot of the ledger, and none where they took nothing.
TEST(Report, LedgerPlotHasWhatGroundLawsTook) {
  for (const bool taken : {false, true}) {
    const Place scratch;
    SyntheticRun run;
    run.structure = run.fragment = false;
    io::RecorderOptions options;
    options.directory = scratch.path() / "out";
    options.paraview = false;
    {
      io::Recorder recorder(options, run.header());
      for (int k = 0; k < 3; ++k) {
        sim::HistoryRow row = run.row(k, run.blocks);
        row.ledger.ploughing_work = taken ? 3e3 * k : 0, row.ledger.vegetation_work = taken ? 2e3 * k : 0;
        recorder.history(row);
      }
      recorder.finish({});
    }
    io::ReportData data(options.directory);
    io::add_curves(data);
    const auto series = data.meta.at("curves")[0].at("series").get<std::vector<std::string>>();
    for (const char* name : {"ploughing", "vegetation"})
      EXPECT_EQ(std::find(series.begin(), series.end(), name) != series.end(), taken) << name;
    EXPECT_EQ(std::find(series.begin(), series.end(), "yielding"), series.end());
    if (!taken) continue;
    const auto at = std::find(series.begin(), series.end(), "ploughing") - series.begin();
    EXPECT_NEAR(array_of(data, "energy_" + std::to_string(at)).back(), 6e3, 1e-3);
  }
}

/// A blow whose steps are uneven by two orders, with needles in the shortest of them: plot, headline and
/// impulse are of one force.
TEST(Report, PlotsTheFilteredForceThatItsHeadlineStates) {
  const Place scratch;
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.cells = {1, 1, 2};
  run.end = 5.2;
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  Vec3 impulse = Vec3::Zero();
  {
    io::Recorder recorder(options, run.header());
    for (int k = 0; k < run.rows(); ++k) {
      const double t = k * run.history_interval, before = t - run.history_interval;
      std::vector<sim::ContactRow> rows;
      double at = run.impact;
      for (int i = 0; at < run.impact + 0.02; ++i) {
        sim::ContactRow r;
        const bool needle = i % 3 == 2;
        r.dt = needle ? 4e-6 : 3.1e-4;
        r.time = at += r.dt;
        r.force = Vec3(needle ? 5e7 : 1e6, 0, 0);
        r.normal = Vec3(-1, 0, 0);
        r.point = run.base() + Vec3(-1, 0, 3.4);
        if (r.time > before && r.time <= t) rows.push_back(r), impulse += r.force * r.dt;
      }
      if (k > 0) recorder.contacts(rows);
      recorder.history(run.row(t, run.present(0)));
    }
    recorder.finish({});
  }
  io::ReportData data(options.directory);
  io::add_curves(data);
  const auto curve = [&](const char* name) { return array_of(data, name); };
  const double stated = data.summary.at("impacts")[0].at("filtered_force");
  const auto time = curve("impact_0_time"), mean = curve("impact_0_0"), filtered = curve("impact_0_1");
  EXPECT_NEAR(*std::max_element(filtered.begin(), filtered.end()) / stated, 1, 1e-6);
  double plotted = 0;
  for (std::size_t i = 1; i < time.size(); ++i)
    plotted += 0.5 * (time[i] - time[i - 1]) * (mean[i] + mean[i - 1]);
  EXPECT_NEAR(plotted / impulse.norm(), 1, 1e-3);
  EXPECT_NEAR(data.summary.at("impacts")[0].at("impulse")[0].get<double>() / impulse.norm(), 1, 1e-9);
}

/// A piece of a bar at an open crack does not take the colours from all others; its strain is told beside
/// them.
TEST(Report, ColoursOfBarsReachToWhereMostOfThemLie) {
  const Place scratch;
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.bars = true;
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  {
    io::Recorder recorder(options, run.header());
    recorder.history(run.row(0, run.blocks));
    Structure::Snapshot s = run.snapshot(0);
    for (std::size_t i = 0; i < s.bar_strain.size(); ++i) s.bar_strain[i] = 1e-5F * static_cast<float>(i + 1);
    s.bar_strain[7] = -0.421F;
    const Structure::Fields fields = Structure::fields(s);
    recorder.field(0, run.poses(0, run.blocks), {&fields, 1});
    recorder.finish({});
  }
  io::ReportData data(options.directory);
  io::add_structures(data);
  const auto& bars = data.meta.at("structures")[0].at("bars");
  EXPECT_NEAR(bars.at("strain_greatest").get<double>(), 0.421, 1e-6);
  EXPECT_NEAR(bars.at("strain_max").get<double>(), 0.00421,
              1e-6);  // the 95th of a hundred is below a hundredth of the greatest
}

TEST(Report, SaysHowManyImpactsItDoesNotPlot) {
  const Place scratch;
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.cells = {1, 1, 2};
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  {
    io::Recorder recorder(options, run.header());
    for (int k = 0; k < 4; ++k) {
      sim::HistoryRow row = run.row(k, run.blocks);
      for (double& e : row.kinetic_translational) e = k == 2 ? 10 : 1e6;  // the third blow is a touch
      for (double& e : row.kinetic_rotational) e = 0;
      sim::ContactRow c;
      c.time = k + 0.5, c.dt = 1e-3, c.force = Vec3(1e6, 0, 0), c.normal = Vec3::UnitX();
      recorder.history(row);
      if (k < 3) recorder.contacts({&c, 1});
    }
    recorder.finish({});
  }
  io::ReportData data(options.directory);
  io::add_curves(data);
  EXPECT_EQ(data.summary.at("impacts").size(), 3u);
  EXPECT_EQ(data.meta.at("impacts_left_out").at("weak"), 1);
  EXPECT_EQ(data.meta.at("impacts_left_out").at("more"), 0);
}

TEST(Report, NeedsResults) {
  const Place scratch;
  EXPECT_THROW(io::write_report(scratch.path()), InputError);
  EXPECT_THROW(io::write_report(scratch.path() / "nowhere"), InputError);
}

TEST(Report, NamesTheFileThatIsNotAsTheRunWroteIt) {
  const Place scratch;
  SyntheticRun run;
  io::RecorderOptions options;
  options.directory = scratch.path() / "out";
  options.paraview = false;
  {
    io::Recorder recorder(options, run.header());
    run.record(recorder, 0, run.rows() - 1, [](int) {});
    recorder.finish({});
  }
  const std::string whole = io::read_file(options.directory / "summary.json");
  const auto told = [&](const char* file, std::string_view text) {
    io::write_file(options.directory / file, text);
    try {
      io::write_report(options.directory);
    } catch (const InputError& error) { return std::string(error.what()).find(file) != std::string::npos; }
    return false;
  };
  for (const char* text : {"", "{", "[]", "{\"title\": 3}", "{\"impacts\": [{\"start\": \"soon\"}]}", "{}",
                           "{\"schema\": 1, \"headline\": [\"a\"], \"structures\": 5}"})
    EXPECT_TRUE(told("summary.json", text)) << text;
  // Each would have stopped the script of a page that was written all the same.
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, nlohmann::json>>{{"/headline", "a"},
                                                           {"/warnings", {1}},
                                                           {"/plan", {{{"a", 1}}}},
                                                           {"/time/end", "soon"},
                                                           {"/blocks/0/name", 5},
                                                           {"/blocks/0/end", {1, 2}},
                                                           {"/impacts/0/impulse", nullptr},
                                                           {"/structures/0/probes", 3},
                                                           {"/structures/0/hit", "yes"},
                                                           {"/confidence", {1, 2}},
                                                           {"/energy", nullptr}}) {
    auto wrong = nlohmann::json::parse(whole);
    wrong[nlohmann::json::json_pointer(pointer)] = value;
    EXPECT_TRUE(told("summary.json", wrong.dump())) << pointer;
  }
  io::write_file(options.directory / "summary.json", whole);
  for (const char* text : {"", "{}", "{\"members\": [7]}"}) EXPECT_TRUE(told("capacity.json", text)) << text;
}

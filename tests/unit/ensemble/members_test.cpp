// Ensembles of small scenes: a block that slides down a plane against what is known of it, the same bits by
// any way of running, mistakes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <tuple>

#include <fmt/format.h>

#include "core/error.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/results.hpp"
#include "ensemble/store.hpp"
#include "helpers/place.hpp"
#include "io/convert.hpp"
#include "io/hdf5_file.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {
namespace {

namespace fs = std::filesystem;

using test::Place;

/// A box that slides down a plane of 40 degrees along -y, from rest at y = 0, with friction to be drawn. The
/// line lies at y = -2 in plan.
const std::string slide = R"(schema = 1
[simulation]
duration = "1.6 s"
[[plane]]
normal = [0.0, -0.6427876096865393, 0.766044443118978]
material = "ground"
[[material]]
name = "rock"
density = 2600
[[material]]
name = "ground"
[[interface]]
between = ["rock", "ground"]
friction = 0.3
restitution = 0.0
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1.0, 1.0, 0.4]
position = [0.0, -0.12855752193730787, 0.15320888862379562]
orientation = { rotation_vector = ["0 deg", "0 deg", "0 deg"] }
[[line]]
name = "road"
points = [[-5.0, -2.0], [5.0, -2.0]]
[ensemble]
members = 24
seed = 3
map_cell = "0.5 m"
[[ensemble.vary]]
key = "interface.rock/ground.friction"
uniform = [0.1, 0.5]
[output]
history_interval = "20 ms"
report = false
)";

/// The scene with the plane's tilt as the block's.
std::string tilted() {
  std::string text = slide;
  const std::string from = "rotation_vector = [\"0 deg\", \"0 deg\", \"0 deg\"]";
  text.replace(text.find(from), from.size(), "rotation_vector = [\"40 deg\", \"0 deg\", \"0 deg\"]");
  return text;
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string message(const fs::path& scene) {
  try {
    const Ensemble ensemble(scene.string(), {});
  } catch (const InputError& error) { return error.what(); }
  return {};
}

long run(Ensemble& ensemble, const fs::path& directory, int threads, int rank = 0, int ranks = 1) {
  Run r;
  r.directory = directory;
  r.threads = threads;
  r.rank = rank;
  r.ranks = ranks;
  r.meet = [] {};
  fs::create_directories(directory);
  return run_members(ensemble, r);
}

TEST(Members, AnEnsembleGoesOnInAnotherDirectory) {
  std::string identity;
  for (const char* name : {"here", "there"}) {
    const Place place;
    const fs::path directory = place.path() / name;
    fs::create_directories(directory);
    std::ofstream(directory / "road.geojson")
        << R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry":
            {"type": "LineString", "coordinates": [[-5, -2], [5, -2]]}}]})";
    std::ofstream(directory / "scene.toml")
        << changed(tilted(), "points = [[-5.0, -2.0], [5.0, -2.0]]", "file = \"road.geojson\"");
    const Ensemble ensemble((directory / "scene.toml").string(), {});
    if (!identity.empty()) { EXPECT_EQ(ensemble.identity(), identity); }
    identity = ensemble.identity();
  }
}

// m v^2 / 2 = m g s (sin a - mu cos a) with s cos a the way in plan: exact for a block that slides without
// turning.
TEST(Members, EnergyAtALineOfASlidingBlock) {
  const Place place;
  Ensemble ensemble(place.put("scene.toml", tilted()).string(), {});
  ASSERT_EQ(run(ensemble, place.path() / "out", 2), 24);
  const double a = 40 * M_PI / 180, start = -0.12855752193730787, way = (2.0 + start) / std::cos(a),
               mass = 2600 * 0.4, g = 9.81;
  std::vector<double> energies;
  long crossings = 0;
  each_member(place.path() / "out", ensemble.identity(), [&](Member&& m) {
    const double mu = ensemble.design().draw(m.index).numbers[0][0];
    EXPECT_GE(mu, 0.1);
    EXPECT_LE(mu, 0.5);
    ASSERT_EQ(m.crossings.size(), 1u) << "member " << m.index << " mu " << mu;
    const Crossing& c = m.crossings.front();
    const double acceleration = g * (std::sin(a) - mu * std::cos(a));
    EXPECT_NEAR(c.energy() / (mass * acceleration * way), 1,
                2e-3);  // the accuracy of the run is 1e-3 of the block's size
    EXPECT_NEAR(c.time, std::sqrt(2 * way / acceleration), 2e-3);
    EXPECT_NEAR(c.position.y(), -2, 1e-9);
    EXPECT_NEAR(c.height, 0.2 / std::cos(a), 2e-3);
    energies.push_back(mass * acceleration * way);
    ++crossings;
  });
  EXPECT_EQ(crossings, 24);
  const Summary summary = write_results(ensemble, place.path() / "out", 24);
  std::sort(energies.begin(), energies.end());
  const Estimate& p95 = summary.lines.at(0).percentiles[0][2];
  EXPECT_NEAR(p95.value / percentile(energies, 95), 1, 2e-3);
  // Of the uniform friction itself: the median of the energy is at mu = 0.3.
  const Estimate& p50 = summary.lines.at(0).percentiles[0][0];
  const double exact = mass * g * way * (std::sin(a) - 0.3 * std::cos(a));
  EXPECT_LE(
      std::abs(p50.value - exact),
      1.7 * 0.5 * (p50.high - p50.low));  // 3.3 standard errors: passed by chance in 1 of 1000 ensembles
  EXPECT_EQ(summary.lines[0].crossings, 24);
  EXPECT_EQ(summary.done, 24);
  io::Hdf5File file = io::Hdf5File::open(place.path() / "out" / "ensemble.h5");
  EXPECT_EQ(file.read<double>("/members/varied/interface.rock|ground.friction").values.size(), 24u);
  EXPECT_EQ(file.dims("/lines/road/velocity"), (io::Dims{24, 3}));
  EXPECT_EQ(file.dims("/members/end_position"), (io::Dims{24, 1, 3}));
}

/// Everything of the members but their processor time.
std::vector<std::string> bits_of(const Ensemble& ensemble, const fs::path& directory) {
  std::map<std::int64_t, std::string> members;
  each_member(directory, ensemble.identity(), [&](Member&& m) {
    m.cpu = 0;
    members[m.index] = m.encode();
  });
  std::vector<std::string> list;
  for (auto& [index, text] : members) list.push_back(std::move(text));
  return list;
}

TEST(Members, SameBitsForThreadsRanksOrderAndAfterAStop) {
  const Place place;
  const std::string scene = place.put("scene.toml", tilted()).string();
  Ensemble ensemble(scene, {});
  run(ensemble, place.path() / "one", 1);
  const auto expected = bits_of(ensemble, place.path() / "one");
  ASSERT_EQ(expected.size(), 24u);
  run(ensemble, place.path() / "three", 3);
  EXPECT_EQ(bits_of(ensemble, place.path() / "three"), expected);
  // Two ranks one after the other: the second finds what the first has done.
  run(ensemble, place.path() / "ranks", 1, 1, 2);
  EXPECT_LT(bits_of(ensemble, place.path() / "ranks").size(), 24u);
  run(ensemble, place.path() / "ranks", 1, 0, 1);
  EXPECT_EQ(bits_of(ensemble, place.path() / "ranks"), expected);
  // Killed in the middle of a record.
  fs::create_directories(place.path() / "killed" / "journal");
  fs::copy_file(place.path() / "one" / "journal" / "0.bin", place.path() / "killed" / "journal" / "0.bin");
  fs::resize_file(place.path() / "killed" / "journal" / "0.bin",
                  fs::file_size(place.path() / "one" / "journal" / "0.bin") * 2 / 3);
  Ensemble again(scene, {});
  EXPECT_LT(bits_of(again, place.path() / "killed").size(), 24u);
  run(again, place.path() / "killed", 2);
  EXPECT_EQ(bits_of(again, place.path() / "killed"), expected);
  // Another ensemble does not go on with it.
  Ensemble other(place.put("other.toml", changed(tilted(), "seed = 3", "seed = 4")).string(), {});
  EXPECT_THROW(run(other, place.path() / "one", 1), InputError);
}

// What is recorded changes nothing: neither the crossings nor the motion know of output intervals.
TEST(Members, AMemberIsTheSceneThatTalusRunRepeats) {
  const Place place;
  Ensemble ensemble(place.put("scene.toml", tilted()).string(), {});
  const auto member = ensemble.run(5, nullptr);
  ASSERT_TRUE(member);
  sim::Simulation alone(
      scene::read_scene(place.put("5.toml", ensemble.scene_file(5, "as it was\nin two lines")).string()));
  sim::Sink none;
  alone.run(none);
  const auto& state = alone.world().system->state().blocks;
  EXPECT_EQ((state.c[0] - member->end[0]).norm(), 0);
}

// The copy of the scene in the output directory, with what was set on the command line, is the same ensemble.
TEST(Members, TheWrittenSceneIsTheSameEnsemble) {
  const Place place;
  const Ensemble ensemble(place.put("scene.toml", tilted()).string(),
                          {{"simulation.accuracy", "1e-2"}, {"block.B.spin", "[0.0, 0.0, 0.0]"}});
  const Ensemble copy(place.put("copy.toml", ensemble.whole_scene()).string(), {});
  EXPECT_EQ(copy.identity(), ensemble.identity());
}

TEST(Members, StepLimitStopsAndCounts) {
  const Place place;
  Ensemble ensemble(
      place.put("scene.toml", changed(tilted(), "seed = 3", "seed = 3\nstep_limit = 3")).string(), {});
  const auto member = ensemble.run(0, nullptr);
  ASSERT_TRUE(member);
  EXPECT_EQ(member->status, Status::over_limit);
  run(ensemble, place.path() / "out", 1);
  const Summary s = write_results(ensemble, place.path() / "out", 24);
  EXPECT_EQ(s.over_limit, 24);
  EXPECT_TRUE(fs::exists(place.path() / "out" / "members" / "17.toml"));
}

TEST(Members, ListsOfNumbersAreOfOneUnit) {
  const auto column = [](const std::string& key, const std::string& list) {
    const Place place;
    const std::string text =
        changed(tilted(), "key = \"interface.rock/ground.friction\"\nuniform = [0.1, 0.5]",
                "key = \"" + key + "\"\nlist = " + list);
    const Ensemble ensemble(place.put("scene.toml", text).string(), {});
    const Column& c = ensemble.design().columns().front();
    return c.text ? "text" : c.unit;
  };
  const std::string friction = "interface.rock/ground.friction";
  EXPECT_EQ(column(friction, "[\"30 deg\", 0.7]"), "1");
  EXPECT_EQ(column("interface.rock/ground.normal_stiffness", "[\"1 GN/m\", \"1 GPa/m\"]"), "text");
  EXPECT_EQ(column("simulation.duration", "[1, \"1.6 s\"]"), "s");
}

// Of one crossing an interval of resamples is that value alone: no precision.
// A table of members has their words, and seeds to the last digit.
TEST(Members, TablesOfMembersAreWhole) {
  const Place place;
  Ensemble ensemble(place.put("scene.toml", tilted()).string(), {});
  const fs::path out = place.path() / "out";
  run(ensemble, out, 1);
  write_results(ensemble, out, 24);
  const std::string file = (out / "ensemble.h5").string();
  std::istringstream csv(io::csv_text(file, "/members"));
  std::string head, row;
  std::getline(csv, head), std::getline(csv, row);
  EXPECT_EQ(
      "," + head + ",",
      ",cpu [s],0.end_position.x [m],0.end_position.y [m],0.end_position.z [m],energy_residual,index,"
      "numerical_gain,reach_angle [rad],runout.0 [m],seed,status,steps,interface.rock|ground.friction,");
  const std::int64_t seed = io::Hdf5File::open(file).read<std::int64_t>("/members/seed").values[0];
  EXPECT_NE(("," + row + ",").find(fmt::format(",{},done,", seed)), std::string::npos) << row;
}

TEST(Members, FewCrossingsAreNoPrecision) {
  const auto members = [](double most) {
    const Place place;
    std::string text =
        changed(tilted(), "members = 24",
                "members = 768\nprecision = { line = \"road\", quantity = \"height\", percentile "
                "= 95, within = 0.1 }");
    text = changed(text, "uniform = [0.1, 0.5]", "uniform = [0.1, " + std::to_string(most) + "]");
    Ensemble ensemble(place.put("scene.toml", text).string(), {});
    const long count = run(ensemble, place.path() / "out", 2);
    const Summary summary = write_results(ensemble, place.path() / "out", count);
    std::ifstream in(place.path() / "out" / "summary.json");
    const std::string written{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(summary.precision->reached, count == 256);
    EXPECT_EQ(unreached_text(*summary.precision).empty(), count == 256);
    EXPECT_EQ(written.find("precision not reached: the 95th percentile of height at line road") ==
                  std::string::npos,
              count == 256)
        << written;
    return count;
  };
  EXPECT_EQ(members(20), 768);   // friction lets some one in fifty slide so far
  EXPECT_EQ(members(0.5), 256);  // all of them
}

// The ground is read once for all members where none of them draws it.
TEST(Members, GroundThatIsDrawnIsTheMembersOwn) {
  const Place place;
  const fs::path scene = place.put("scene.toml", R"(schema = 1
[simulation]
duration = "3 s"
[site]
crest = [0.0, 0.0, 20.0]
dip_direction = "0 deg"
width = "20 m"
face = [{ dip = "40 deg", length = "30 m" }, { dip = "0 deg", length = "40 m" }]
material = "ground"
crs = "EPSG:31254"
[[material]]
name = "rock"
density = 2600
[[material]]
name = "ground"
roughness = { amplitude = "0.3 m", length = "3 m", seed = 1 }
[[interface]]
between = ["rock", "ground"]
friction = 0.5
restitution = 0.2
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1.0, 0.8, 0.6]
position = [0.0, 3.0, 20.5]
[output]
report = false
[ensemble]
design = "factorial"
[[ensemble.vary]]
key = "material.ground.roughness.seed"
list = [1, 2, 3, 4]
)");
  Ensemble ensemble(scene.string(), {});
  std::set<double> ends;
  for (long i = 0; i < 4; ++i) {
    const std::optional<Member> m = ensemble.run(i, nullptr);
    ASSERT_TRUE(m && !m->end.empty());
    EXPECT_NE(m->status, Status::failed) << m->message;
    ends.insert(m->end.front().y());
  }
  EXPECT_EQ(ends.size(), 4u);
}

TEST(Members, FactorialTakesEveryCombination) {
  const Place place;
  std::string text = changed(tilted(), "members = 24", "design = \"factorial\"");
  text = changed(text, "uniform = [0.1, 0.5]",
                 "list = [0.2, \"15 deg\", 0.4]\n[[ensemble.vary]]\nkey = \"material.rock.density\"\nlist = "
                 "[2500, 2700]");
  Ensemble ensemble(place.put("scene.toml", text).string(), {});
  EXPECT_EQ(ensemble.design().members(), 6);
  std::set<std::pair<double, double>> seen;
  for (long i = 0; i < 6; ++i) {
    const Draw d = ensemble.design().draw(i);
    seen.emplace(d.numbers[0][0], d.numbers[1][0]);
    if (i % 3 == 1) { EXPECT_NEAR(d.numbers[0][0], std::tan(15 * M_PI / 180), 1e-12); }
  }
  EXPECT_EQ(seen.size(), 6u);
}

/// Boxes fly past, below and against a viaduct of three piers: each hit names the pier or span that it is on,
/// the summary counts the members that strike each, and of a viaduct that is drawn itself none is named.
TEST(Members, HitsNameThePierOrSpanThatIsStruck) {
  const std::string scene = R"(schema = 1
[simulation]
duration = "0.2 s"
gravity = [0, 0, 0]
accuracy = 1e-2
[[material]]
name = "rock"
density = 2600
[[material]]
name = "C30"
f_cm = "38 MPa"
[[interface]]
between = ["*", "*"]
friction = 0.5
normal_stiffness = "hard"
[[structure]]
name = "viaduct"
kind = "viaduct"
material = "C30"
position = [0, 0, 0]
spans = 2
span_length = 12
pier_height = 6
cell_size = "1 m"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [0.4, 0.4, 0.4]
position = [0, -8, 3]
velocity = [0, 60, 0]
[ensemble]
design = "factorial"
[[ensemble.vary]]
key = "block.B.position"
list = [[0, -8, 3], [12, -8, 3], [12.1, -8, 2], [24, -8, 3], [18, -8, 3], [18, -8, DECK]]
[output]
report = false
)";
  const Place place;
  const auto results = [&](const std::string& text, const char* name) {
    Ensemble ensemble(place.put(std::string(name) + ".toml", text).string(), {});
    const fs::path directory = place.path() / name;
    const long members = run(ensemble, directory, 1);
    double soffit = 0;
    for (const auto& part : ensemble.structure_members())
      for (const talus::Member& m : part)
        if (m.span) soffit = m.base.z();
    return std::tuple(write_results(ensemble, directory, members), directory / "ensemble.h5", soffit);
  };
  const std::string first = changed(scene, "DECK", "30");
  const auto [unused, file, deck] = results(first, "first");
  const auto [summary, named, again] = results(changed(scene, "DECK", fmt::format("{}", deck)), "named");
  const io::Hdf5File h5 = io::Hdf5File::open(named);
  const auto member = h5.read<std::int64_t>("/hits/viaduct/member").values;
  const std::vector<std::string> struck = h5.read_texts("/hits/viaduct/struck");
  ASSERT_EQ(member.size(), struck.size());
  const std::map<std::int64_t, std::string> right{{0, "P1"}, {1, "P2"}, {2, "P2"}, {3, "P3"}, {5, "S2"}};
  std::set<std::int64_t> seen;
  for (std::size_t k = 0; k < member.size(); ++k) {
    ASSERT_TRUE(right.contains(member[k])) << member[k];
    EXPECT_EQ(struck[k], right.at(member[k])) << member[k];
    seen.insert(member[k]);
  }
  EXPECT_EQ(seen.size(), right.size());
  ASSERT_EQ(summary.structures.size(), 1u);
  EXPECT_EQ(summary.structures[0].members, 5);
  std::map<std::string, long> counted;
  for (const StructureSummary::Struck& part : summary.structures[0].struck) {
    counted[part.name] = part.members;
    EXPECT_NEAR(part.probability.value, static_cast<double>(part.members) / 6, 1e-12);
  }
  EXPECT_EQ(counted, (std::map<std::string, long>{{"P1", 1}, {"P2", 2}, {"P3", 1}, {"S2", 1}}));
  const auto [drawn, of_drawn, none] = results(
      changed(
          first, "[output]",
          "[[ensemble.vary]]\nkey = \"structure.viaduct.position\"\nlist = [[0, 0, 0], [0, 1, 0]]\n[output]"),
      "drawn");
  EXPECT_TRUE(drawn.structures[0].struck.empty());
  EXPECT_FALSE(io::Hdf5File::open(of_drawn).exists("/hits/viaduct/struck"));
}

TEST(Members, MistakesAreNamedBeforeTheFirstMember) {
  const Place place;
  const auto with = [&](const std::string& from, const std::string& to) {
    return message(place.put("bad.toml", changed(tilted(), from, to)));
  };
  EXPECT_NE(with("key = \"interface.rock/ground.friction\"", "key = \"block.B.volum\"").find("volum"),
            std::string::npos);
  EXPECT_NE(with("uniform = [0.1, 0.5]", "normal = [0.3, 0.4]")
                .find("of the first 24 members draw a value that the key does not take"),
            std::string::npos);
  EXPECT_NE(with("uniform = [0.1, 0.5]", "uniform = [0.5, 0.1]").find("low must be less than high"),
            std::string::npos);
  EXPECT_NE(
      with("uniform = [0.1, 0.5]", "uniform = [0.1, 0.5]\nlike = 0").find("must name an earlier variable"),
      std::string::npos);
  EXPECT_NE(with("members = 24", "").find("members"), std::string::npos);
  EXPECT_NE(with("uniform = [0.1, 0.5]", "").find("has no distribution"), std::string::npos);
  for (const char* same : {"line.road.points", "ensemble.members", "title", "output.interval"})
    EXPECT_NE(with("key = \"interface.rock/ground.friction\"", std::string("key = \"") + same + "\"")
                  .find("is the same for all members"),
              std::string::npos)
        << same;
  for (const auto& [one, other] :
       {std::pair{"interface.rock/ground.friction", "interface.ground/rock.friction"},
        std::pair{"interface.rock/ground.friction", "interface.0.friction"},
        std::pair{"block.B.velocity", "block.0.velocity"},
        std::pair{"block.0.velocity", "block.B.velocity"}}) {
    const std::string twice =
        with("key = \"interface.rock/ground.friction\"",
             fmt::format("key = \"{}\"\nlist = [0.1]\n[[ensemble.vary]]\nkey = \"{}\"", one, other));
    EXPECT_NE(twice.find(fmt::format("variable 0 draws it already, as {}", one)), std::string::npos) << twice;
  }
  EXPECT_NE(with("members = 24", "members = 24\nmap_cell = \"1 um\"").find("map_cell"), std::string::npos);
  EXPECT_NE(with("duration = \"1.6 s\"", "duration = \"-1 s\"").find("duration"), std::string::npos);
  EXPECT_EQ(message(place.put("good.toml", tilted())), "");
}

/// A slope in words of 30 degrees down to the north, 60 m long, and an area on it to start from.
const std::string slope = R"(schema = 1
[simulation]
duration = "20 s"
until = "rest"
[site]
face = [{ dip = "35 deg", length = 40 }, { dip = "0 deg", length = 40 }]
crest = [0.0, 0.0, 30.0]
dip_direction = "0 deg"
width = 60
material = "ground"
crs = "EPSG:31254"
[[material]]
name = "rock"
density = 2600
[[interface]]
between = ["rock", "ground"]
friction = "30 deg"
restitution = 0.2
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "EOTA111"
volume = 1.0
release = { polygon = "source.geojson", height = "0.5 m" }
[[line]]
name = "road"
points = [[-25.0, 36.0], [25.0, 36.0]]
[ensemble]
members = 6
[[ensemble.vary]]
key = "block.B.release"
[[ensemble.vary]]
key = "block.B.volume"
lognormal = ["1.0 m^3", "0.4 m^3"]
[output]
report = false
)";

const std::string source = R"({"type":"Polygon","coordinates":[[[-10,4],[10,4],[10,10],[-10,10],[-10,4]]]})";

// What is wrong with a value of the command line is said of it, not of what members draw.
TEST(Members, MistakesOfTheCommandLineAreItsOwn) {
  const Place place;
  const std::string scene = place.put("scene.toml", slide).string();
  const auto refusal = [&](const std::string& key, const std::string& value) -> std::string {
    try {
      const Ensemble ensemble(scene, {{key, value}});
    } catch (const InputError& error) { return error.what(); }
    return {};
  };
  EXPECT_TRUE(refusal("simulation.accuracy", "0.9").starts_with("--set simulation.accuracy: error"))
      << refusal("simulation.accuracy", "0.9");
  EXPECT_NE(refusal("ensemble.vary.0.uniform", "[-0.1, 0.5]").find("ensemble.vary"), std::string::npos);
}

TEST(Members, ReleaseDrawsOnePlaceOfTheAreaForEach) {
  const Place place;
  place.put("source.geojson", source);
  Ensemble ensemble(place.put("scene.toml", slope).string(), {});
  EXPECT_EQ(ensemble.blocks(), std::vector<std::string>{"B"});
  std::set<double> places;
  for (long i = 0; i < 6; ++i) {
    const std::vector<double> at = ensemble.design().draw(i).numbers[0];
    EXPECT_GE(at[0], -10);
    EXPECT_LE(at[0], 10);
    EXPECT_GE(at[1], 4);
    EXPECT_LE(at[1], 10);
    places.insert(at[0]);
    const auto world = ensemble.simulation(i);
    EXPECT_EQ(world->world().pose(0).c.x(), at[0]);
  }
  EXPECT_EQ(places.size(), 6u);
  const auto a = ensemble.run(2, nullptr), b = ensemble.run(2, nullptr);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->message, "");
  EXPECT_GT(a->steps, 10);
  EXPECT_EQ(a->end[0], b->end[0]);
  // What talus run makes of the member's own file is the member.
  sim::Simulation alone(scene::read_scene(place.put("2.toml", ensemble.scene_file(2, "")).string()));
  sim::Sink none;
  alone.run(none);
  EXPECT_EQ((alone.world().system->state().blocks.c[0] - a->end[0]).norm(), 0);
  place.put("source.geojson", changed(source, "[-10,4],[10,4],[10,10],[-10,10],[-10,4]",
                                      "[900,4],[910,4],[910,10],[900,10],[900,4]"));
  EXPECT_NE(message(place.path() / "scene.toml").find("no place of the area lies over ground"),
            std::string::npos);
  place.put("source.geojson", source);
  EXPECT_NE(message(place.put("off.toml", changed(slope, "[[-25.0, 36.0], [25.0, 36.0]]",
                                                  "[[925.0, 36.0], [975.0, 36.0]]")))
                .find("lies off the terrain"),
            std::string::npos);
}

// A member releases one block: a count beside it would have no effect.
TEST(Members, AReleaseThatIsDrawnHasNoCount) {
  const Place place;
  const auto with = [&](const std::string& from, const std::string& to) {
    return message(place.put("count.toml", changed(slope, from, to)));
  };
  place.put("source.geojson", "{}");
  EXPECT_NE(
      with("height = \"0.5 m\" }", "height = \"0.5 m\", count = 3 }").find("the scene releases 3 of it"),
      std::string::npos);
  EXPECT_NE(
      with("key = \"block.B.release\"",
           "key = \"block.B.release\"\n[[ensemble.vary]]\nkey = \"block.0.release.count\"\nlist = [1, 2]")
          .find("variable 0, block.B.release, sets it already"),
      std::string::npos);
}

// A path through a vertex of a line crosses it as one beside the vertex does, and a line that is touched in a
// vertex from one side is not crossed.
TEST(Members, PathsThroughVerticesOfALine) {
  const Place place;
  std::string text = tilted();
  const std::string road = "[[line]]\nname = \"road\"\npoints = [[-5.0, -2.0], [5.0, -2.0]]\n";
  const auto at = text.find(road);
  ASSERT_NE(at, std::string::npos);
  const auto line = [](const std::string& name, const std::string& points) {
    return "[[line]]\nname = \"" + name + "\"\npoints = " + points + "\n";
  };
  text.replace(at, road.size(),
               road + line("vertex", "[[-5.0, -2.0], [0.0, -2.0], [5.0, -2.0]]") +
                   line("backwards", "[[5.0, -2.0], [0.0, -2.0], [-5.0, -2.0]]") +
                   line("apex", "[[-5.0, -3.0], [0.0, -2.0], [5.0, -3.0]]") +
                   line("touched", "[[1.0, -1.0], [0.0, -2.0], [1.0, -3.0]]") +
                   line("ring", "[[0.0, -2.0], [3.0, -1.5], [-3.0, -1.5], [0.0, -2.0]]") +
                   line("doubled", "[[-5.0, -2.0], [0.0, -2.0], [0.1, -2.5], [-5.0, -2.5]]"));
  Ensemble ensemble(place.put("scene.toml", text).string(), {});
  ASSERT_EQ(run(ensemble, place.path() / "out", 2), 24);
  const Summary summary = write_results(ensemble, place.path() / "out", 24);
  std::map<std::string, long> crossings;
  for (const LineSummary& l : summary.lines) crossings[l.name] = l.crossings;
  EXPECT_EQ(crossings["road"], 24);
  EXPECT_EQ(crossings["vertex"], 24);
  EXPECT_EQ(crossings["backwards"], 24);
  EXPECT_EQ(crossings["apex"], 24);
  EXPECT_EQ(crossings["touched"], 0);
  EXPECT_EQ(crossings["doubled"], 48);
  EXPECT_EQ(crossings["ring"], 48);  // once in, once out where it is closed
}

}  // namespace
}  // namespace talus::ensemble

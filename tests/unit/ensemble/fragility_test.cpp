// From hits to damage on a small concrete column, options side by side, and parameters from passages: against
// what the runs and closed forms say.
#include "ensemble/fragility/fragility.hpp"
#include "ensemble/fragility/fragility_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.hpp"
#include "ensemble/calibrate.hpp"
#include "ensemble/compare.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/fragility/strata.hpp"
#include "ensemble/report.hpp"
#include "ensemble/results.hpp"
#include "helpers/place.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

using test::Place;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}
Json json_of(const fs::path& file) { return Json::parse(text_of(file)); }

/// A column of 0.4 x 0.4 x 2 m that boxes of 166 kg strike from two sides, low and high, at 1 or 24 m/s.
const std::string struck = R"(schema = 1
[simulation]
duration = "0.4 s"
accuracy = 1e-2
[[plane]]
normal = [0, 0, 1]
material = "ground"
[[material]]
name = "rock"
density = 2600
[[material]]
name = "ground"
[[material]]
name = "C30"
f_cm = "38 MPa"
[[interface]]
between = ["*", "*"]
friction = 0.5
normal_stiffness = "hard"
[[structure]]
name = "pier"
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [0.4, 0.4]
height = 2.0
cell_size = "0.2 m"
damage = "concrete"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [0.4, 0.4, 0.4]
position = [-1.0, 0, 0.5]
[[line]]
name = "past"
points = [[-0.41, -3], [-0.41, 3]]
[ensemble]
design = "factorial"
members = 72
seed = 1
releases_per_year = 0.1
[[ensemble.vary]]
key = "block.B.position"
list = [[-0.42, 0, 0.6], [-0.42, 0, 1.6], [0, -0.42, 0.6], [0, -0.42, 1.6], [-0.42, 0, 0.6], [-0.42, 0, 1.6], [0, -0.42, 0.6], [0, -0.42, 1.6], [-9, 0, 0.2]]
[[ensemble.vary]]
key = "block.B.velocity"
list = [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [24, 0, 0], [24, 0, 0], [0, 24, 0], [0, 24, 0], [0, 0, 0]]
like = 0
[output]
report = false
)";

void run_ensemble(const fs::path& scene, const fs::path& directory) {
  Ensemble ensemble(scene.string(), {});
  fs::create_directories(directory);
  std::ofstream(directory / "scene.toml") << ensemble.whole_scene();
  Run r;
  r.directory = directory;
  r.meet = [] {};
  write_results(ensemble, directory, run_members(ensemble, r));
}

FragilityRequest request_of(const fs::path& directory, int threads) {
  FragilityRequest r;
  r.directory = directory;
  r.structure = "pier";
  r.runs = 24;
  r.window = 0.02;
  r.threads = threads;
  r.capacity = true;
  return r;
}

/// A coupled run turns the block a little as it hits. One that slides on a plane would be turned into it: all
/// runs of such hits failed. It is raised until its lowest corner lies on the plane.
TEST(Fragility, WhatSlidesIsRaisedOutOfItsGround) {
  const Place place;
  sim::Simulation simulation(scene::read_scene(place
                                                   .put("slide.toml", R"(schema = 1
[simulation]
duration = "1 s"
[[plane]]
dip_direction = "90 deg"
dip = "35 deg"
material = "slope"
[[material]]
name = "rock"
density = 2650
[[interface]]
between = ["rock", "slope"]
friction = 0.5
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [2, 2, 0.8]
position = [0, 0, 3]
)")
                                                   .string()));
  const double dip = 35 * M_PI / 180;
  const Vec3 normal(std::sin(dip), 0, std::cos(dip));
  const Mat3 flat = Eigen::AngleAxisd(dip, Vec3::UnitY()).toRotationMatrix(),
             turned = Eigen::AngleAxisd(0.035, Vec3(1, 2, 0.5).normalized()).toRotationMatrix() * flat;
  const auto lowest = [&](const Mat3& rotation, const Vec3& centre) {
    double least = std::numeric_limits<double>::infinity();
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        for (const double z : {-0.4, 0.4})
          least = std::min(least, normal.dot(centre + rotation * Vec3(x, y, z)));
    return least;
  };
  const Vec3 at = 0.4 * normal;
  ASSERT_NEAR(lowest(flat, at), 0, 1e-12);
  EXPECT_LT(sim::raise_above_ground(simulation.world(), 0, {at, flat}), 1e-8);
  const double raise = sim::raise_above_ground(simulation.world(), 0, {at, turned});
  EXPECT_NEAR(raise, -lowest(turned, at) / normal.z(), 1e-8);
  EXPECT_NEAR(lowest(turned, at + raise * Vec3::UnitZ()), 0, 1e-8);
}

TEST(Fragility, ClustersRunsAndProbabilities) {
  const Place place;
  const fs::path out = place.path() / "out";
  run_ensemble(place.put("scene.toml", struck), out);
  fs::copy(out, place.path() / "two", fs::copy_options::recursive);
  const FragilityResult result = write_fragility(request_of(out, 1));
  EXPECT_EQ(result.done, 24);
  const Json f = json_of(out / "fragility.json");
  ASSERT_EQ(f["faults"].size(), 0u) << f["faults"];

  // The clusters are the eight kinds of hit: one height, one speed, one direction each; together they are all
  // hits, with all runs.
  long events = 0, runs = 0;
  std::set<std::tuple<bool, bool, bool>> kinds;
  for (const Json& c : f["clusters"]) {
    EXPECT_LT(c["energy"][1].get<double>() / c["energy"][0].get<double>(), 2);
    EXPECT_LT(c["height"][1].get<double>() - c["height"][0].get<double>(), 0.5);
    const double direction = c["mean_direction"].get<double>();
    EXPECT_LT(std::min(std::abs(direction), std::abs(direction - M_PI / 2)), 0.1) << "towards +y or +x";
    kinds.emplace(c["energy"][0].get<double>() > 5e3, c["height"][0].get<double>() > 1, direction > 0.7);
    EXPECT_GE(c["runs"].get<int>(), 1);
    events += c["events"].get<long>(), runs += c["runs"].get<long>();
  }
  EXPECT_EQ(kinds.size(), 8u);
  EXPECT_EQ(f["clusters"].size(), 8u);
  EXPECT_EQ(runs, 24);
  EXPECT_EQ(events, f["events"]["hits"].get<long>());
  EXPECT_EQ(events, 64);  // one kind of member in nine does not get there

  // Probabilities are those of the classes that the runs came to.
  std::vector<int> grades;
  double largest = 0;
  for (int k = 0; k < 24; ++k) {
    const Json s = json_of(out / "fragility" / fmt::format("pier-{}", k) / "summary.json");
    grades.push_back(s["structures"][0]["members"][0]["damage_class"].get<int>());
    for (const auto& impact : s["impacts"])
      largest = std::max(largest, impact["filtered_force"].get<double>());
  }
  EXPECT_GT(*std::max_element(grades.begin(), grades.end()), *std::min_element(grades.begin(), grades.end()));
  EXPECT_EQ(f["peak_force"]["largest"].get<double>(), largest);
  const Estimate hit = wilson(events, 72);
  double before = 1;
  for (int k = 1; k <= 4; ++k) {
    std::vector<Stratum> strata;
    std::size_t at = 0;
    for (const Json& c : f["clusters"]) {
      Stratum& h = strata.emplace_back(Stratum{c["events"].get<double>(), 0, c["runs"].get<int>()});
      for (int q = 0; q < h.runs; ++q) h.reached += grades[at++] >= k;
    }
    const Estimate expected = product(hit, stratified(strata));
    const Json& p = f["per_event"][static_cast<std::size_t>(k - 1)];
    EXPECT_NEAR(p["value"].get<double>(), expected.value, 1e-12);
    EXPECT_NEAR(p["low"].get<double>(), expected.low, 1e-12);
    EXPECT_NEAR(p["high"].get<double>(), expected.high, 1e-12);
    EXPECT_LE(p["value"].get<double>(), before);
    before = p["value"].get<double>();
    EXPECT_NEAR(f["per_year"][static_cast<std::size_t>(k - 1)]["value"].get<double>(),
                -std::expm1(-0.1 * expected.value), 1e-12);
  }
  EXPECT_GT(f["per_event"][0]["value"].get<double>(), 0);
  const double ratio = f["capacity"]["least_ratio"]["value"].get<double>();
  EXPECT_GE(ratio, 0);
  EXPECT_LT(ratio, 1.02);  // what is damaged bears no more than as built

  // What a reader must know of the runs to judge the figures.
  const std::string doubts = f["doubts"].dump();
  EXPECT_NE(doubts.find("each run is 0.02 s from just before the strike"), std::string::npos) << doubts;
  EXPECT_NE(doubts.find("2 cells across the smallest section (0.4 m)"), std::string::npos) << doubts;
  int above_hertz = 0;
  for (int k = 0; k < 24; ++k)
    above_hertz += text_of(out / "fragility" / fmt::format("pier-{}", k) / "summary.json")
                       .find("is above Hertz's elastic") != std::string::npos;
  EXPECT_EQ(doubts.find(fmt::format("warned of in {} of 24 runs: force of a single sub-step above Hertz",
                                    above_hertz)) != std::string::npos,
            above_hertz > 0)
      << doubts;
  for (const Json& line : f["doubts"])
    EXPECT_NE(std::find(result.lines.begin(), result.lines.end(), line.get<std::string>()),
              result.lines.end());

  // The report names the curves that there are, and says so where there is none.
  const auto report = [&] {
    Ensemble ensemble((place.path() / "scene.toml").string(), {});
    return text_of(write_report(ensemble, out));
  };
  EXPECT_NE(report().find("Curves over the energy of the hit"), std::string::npos);
  Json flat = f;
  for (Json& m : flat["members"])
    for (Json& c : m["curves"]) c["fitted"] = false;
  const std::string kept = text_of(out / "fragility.json");
  std::ofstream(out / "fragility.json") << flat;
  EXPECT_EQ(report().find("Curves over the energy of the hit"), std::string::npos);
  EXPECT_NE(report().find("No curve over the energy of the hit"), std::string::npos);
  std::ofstream(out / "fragility.json", std::ios::binary) << kept;

  // Figures of another structure stay, and so does what the report says of it.
  const fs::path several = place.path() / "several";
  fs::create_directories(several);
  Json of_another = f;
  of_another["structure"] = "wall";
  for (const Json& figures : {of_another, f, f}) keep_fragility(several, figures);
  const std::vector<Json> both_structures = read_fragility(several);
  ASSERT_EQ(both_structures.size(), 2u);
  EXPECT_EQ(both_structures[0], f);
  EXPECT_EQ(both_structures[1], of_another);
  fs::copy_file(several / "fragility.json", out / "fragility.json", fs::copy_options::overwrite_existing);
  const std::string page_of_both = report();
  for (const char* name : {"Damage of pier<", "Damage of wall<", "wall severe or worse"})
    EXPECT_NE(page_of_both.find(name), std::string::npos) << name;
  std::ofstream(out / "fragility.json", std::ios::binary) << kept;

  // Two threads, and a second call that finds all runs: the same bytes.
  write_fragility(request_of(place.path() / "two", 2));
  EXPECT_EQ(text_of(place.path() / "two" / "fragility.json"), text_of(out / "fragility.json"));
  int done_again = 0;
  FragilityRequest again = request_of(out, 1);
  again.progress = [&](const Progress&) { ++done_again; };
  write_fragility(again);
  EXPECT_EQ(done_again, 0);
  EXPECT_EQ(text_of(place.path() / "two" / "fragility.json"), text_of(out / "fragility.json"));

  // A run that the stop cuts off is not counted as done.
  const fs::path cut = place.path() / "cut";
  fs::copy(out, cut, fs::copy_options::recursive);
  fs::remove_all(cut / "fragility");
  std::atomic<int> stop = 0;
  long counted = 0;
  FragilityRequest amid = request_of(cut, 2);
  amid.window = 0.1;  // of several macro steps, between which it can be stopped
  amid.stop = &stop;
  amid.progress = [&](const Progress& p) {
    stop = 2;
    counted = p.done;
  };
  EXPECT_EQ(write_fragility(amid).done, counted);

  // Stopped after eight runs, there is one of each kind of hit, and the figures stand for all; the same
  // command goes on to the same bytes. A plan of other runs begins anew, whichever of the old ones were
  // there.
  const fs::path third = place.path() / "three";
  fs::copy(out, third, fs::copy_options::recursive);
  fs::remove_all(third / "fragility");
  fs::remove(third / "fragility.json");
  stop = 0;
  FragilityRequest stopped = request_of(third, 1);
  stopped.stop = &stop;
  int until = 3;
  stopped.progress = [&](const Progress& p) { stop = p.done == until ? 2 : 0; };
  const FragilityResult few = write_fragility(stopped);
  EXPECT_EQ(few.done, 3);
  EXPECT_LT(json_of(third / "fragility.json")["runs"]["share_of_hits"].get<double>(), 1);
  ASSERT_FALSE(few.lines.empty());
  EXPECT_NE(few.lines[0].find("of kinds of which no run is done"), std::string::npos) << few.lines[0];
  stop = 0, until = 8;
  const FragilityResult part = write_fragility(stopped);
  EXPECT_EQ(part.asked, 24);
  EXPECT_EQ(part.done, 8);
  EXPECT_EQ(part.failed, 0);
  const Json so_far = json_of(third / "fragility.json");
  EXPECT_EQ(so_far["runs"]["done"].get<int>(), 8);
  EXPECT_EQ(so_far["runs"]["share_of_hits"].get<double>(), 1);
  for (const Json& c : so_far["clusters"]) EXPECT_EQ(c["done"].get<int>(), 1);
  write_fragility(request_of(third, 1));
  EXPECT_EQ(text_of(third / "fragility.json"), text_of(out / "fragility.json"));
  FragilityRequest fewer = request_of(third, 1);
  fewer.runs = 3;
  fs::remove_all(third / "fragility" / "pier-1");
  write_fragility(fewer);
  EXPECT_FALSE(fs::exists(third / "fragility" / "pier-20")) << "a run of the earlier plan";

  // Beside the same with half as many hits: differences by the root of the sum of squares.
  const fs::path other = place.path() / "slow";
  fs::create_directories(other);
  fs::copy(out / "summary.json", other / "summary.json");
  Json half = f;
  for (const char* key : {"value", "low", "high"})
    half["per_event"][0][key] = 0.5 * f["per_event"][0][key].get<double>();
  Json beside = half;
  beside["structure"] = "pier B";
  half["others"] = {beside};
  std::ofstream(other / "fragility.json") << half;
  const std::vector<fs::path> both{out, other};
  write_comparison(both, place.path() / "options");
  const Json compared = json_of(place.path() / "options" / "compare.json");
  std::set<std::string> names;
  for (const Json& row : compared["figures"]) {
    const std::string name = row["name"].get<std::string>();
    names.insert(name);
    const Json &a = row["options"][0], &b = row["options"][1], &d = row["differences"][0];
    if (a.is_null()) {
      EXPECT_TRUE(name.starts_with("pier B: ") || name.starts_with("pier B pier: ")) << name;
      continue;
    }
    EXPECT_NEAR(d["value"].get<double>(), b["value"].get<double>() - a["value"].get<double>(), 1e-12) << name;
    const bool interval = a["high"].is_number() && b["low"].is_number();
    EXPECT_EQ(d["low"].is_number(), interval) << name;
    if (!interval) continue;
    EXPECT_NEAR(d["low"].get<double>(),
                d["value"].get<double>() - std::hypot(b["value"].get<double>() - b["low"].get<double>(),
                                                      a["high"].get<double>() - a["value"].get<double>()),
                1e-9 * (1 + std::abs(d["low"].get<double>())))
        << name;
    if (name == "pier: P(class >= 1) per event") {
      EXPECT_NEAR(d["value"].get<double>(), -0.5 * a["value"].get<double>(), 1e-12);
    }
  }
  for (const char* name :
       {"past: probability of crossing", "past: energy p95", "pier: probability of a hit",
        "pier: transmitted force, mean of the peaks over hits", "pier: transmitted force, largest peak",
        "pier: capacity over that as built, least member, mean over hits", "pier: P(class >= 3) per event",
        "pier: P(class >= 3) per year", "pier: expected closure per event, days",
        "pier B: P(class >= 3) per event"})
    EXPECT_TRUE(names.contains(name)) << name;
  std::ifstream page(place.path() / "options" / "compare.html");
  const std::string html((std::istreambuf_iterator<char>(page)), std::istreambuf_iterator<char>());
  EXPECT_NE(html.find("<main>"), std::string::npos);
  EXPECT_NE(html.find("<th scope=\"col\">difference"), std::string::npos);
}

TEST(Fragility, WhatCannotBeIsSaid) {
  const Place place;
  std::string away = struck;
  for (const auto& [from, to] : {std::pair{"[-0.42,", "[-59.0,"}, std::pair{"[0, -0.42,", "[0, -59.0,"}})
    for (std::size_t at = away.find(from); at != std::string::npos; at = away.find(from, at))
      away.replace(at, std::string(from).size(), to);
  away.replace(away.find("members = 72"), 12, "members = 9");
  const fs::path out = place.path() / "out";
  run_ensemble(place.put("scene.toml", away), out);
  const auto message = [&](FragilityRequest r) {
    try {
      write_fragility(r);
    } catch (const InputError& error) { return std::string(error.what()); }
    return std::string();
  };
  EXPECT_NE(message(request_of(out, 1)).find("no member hits the structure"), std::string::npos);
  FragilityRequest wrong = request_of(out, 1);
  wrong.structure = "bridge";
  EXPECT_NE(message(wrong).find("name one of: pier"), std::string::npos);
}

TEST(Fragility, AHollowThatRunsWouldLeaveOutIsSaid) {
  const Place place;
  std::string text = struck;
  text.replace(text.find("members = 72"), 12, "members = 9");
  text += R"([site]
material = "ground"
crest = [500.0, 0.0, 30.0]
dip_direction = "90 deg"
width = "30 m"
face = [{ dip = "40 deg", length = "30 m" }]
[rock_mass]
from_terrain = true
box = { min = [505.0, -3.0, 20.0], max = [510.0, 3.0, 40.0] }
material = "rock"
)";
  const fs::path out = place.path() / "out";
  run_ensemble(place.put("scene.toml", text), out);
  FragilityRequest request = request_of(out, 1);
  request.runs = 2;
  std::string said;
  request.tell = [&](const std::string& line) { said += line + "\n"; };
  try {
    write_fragility(request);
  } catch (const InputError& error) { said += error.what(); }
  EXPECT_NE((said + text_of(out / "fragility.json")).find("is cut out of the terrain"), std::string::npos)
      << said;
}

TEST(Fragility, WhatIsAboutToBeComputedIsSaid) {
  const Place place;
  std::string elastic = struck;
  elastic.replace(elastic.find("damage = \"concrete\""), 19, "damage = \"none\"");
  const fs::path out = place.path() / "out";
  run_ensemble(place.put("scene.toml", elastic), out);
  FragilityRequest request = request_of(out, 1);
  std::vector<std::string> told;
  std::atomic<int> stop = 1;  // nothing is run
  request.stop = &stop;
  request.window = 500;
  request.tell = [&](const std::string& line) { told.push_back(line); };
  EXPECT_EQ(write_fragility(request).done, 0);
  ASSERT_EQ(told.size(), 3u);
  EXPECT_NE(told[0].find("64 of 72 members hit pier; 24 coupled runs of 500 s for 8 kinds"),
            std::string::npos)
      << told[0];
  EXPECT_NE(told[1].find("--window = 500 s"), std::string::npos) << told[1];
  EXPECT_NE(told[2].find("no damage class"), std::string::npos) << told[2];
}

/// A box that slides down a plane of 40 degrees to a line 2 m on in plan: energy and speed there follow from
/// the coefficient of friction, and end points too.
const std::string slide_to_line = R"(schema = 1
[simulation]
duration = "1.2 s"
accuracy = 1e-2
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
orientation = { rotation_vector = ["40 deg", "0 deg", "0 deg"] }
velocity = [0.0, 0.0, 0.0]
[[line]]
name = "road"
points = [[-5.0, -1.0], [5.0, -1.0]]
[ensemble]
members = 6
[[ensemble.vary]]
key = "block.B.velocity"
list = [[0, 0, 0], [0, -0.766044443118978, -0.6427876096865393]]
[output]
report = false
)";

TEST(Calibrate, FindsTheFrictionFromPassagesAndFromEndPoints) {
  const Place place;
  const double a = 40 * M_PI / 180, g = 9.81, mass = 2600 * 0.4, mu = 0.35,
               pull = g * (std::sin(a) - mu * std::cos(a)), start = -0.12855752193730787;
  const fs::path scene = place.put("scene.toml", slide_to_line);
  // Measured by the closed form, from rest and from 1 m/s.
  std::string passages = "line,speed,energy\n", ends = "x,y\n";
  for (int k = 0; k < 8; ++k) {
    const double v0 = k % 2, v = std::sqrt(v0 * v0 + 2 * pull * (1 + start) / std::cos(a)),
                 way = v0 * 1.2 + 0.5 * pull * 1.44;
    passages += fmt::format("road,{:.6f},{:.6f}\n", v, 0.5 * mass * v * v);
    ends += fmt::format("0.0,{:.6f}\n", start - way * std::cos(a));
  }
  CalibrationRequest request;
  request.scene = scene.string();
  request.parameters = {parse_parameter("interface.rock/ground.friction=0.1:0.6")};
  request.candidates = 16;
  const double low = 0.1, high = 0.6,
               spacing = (high - low) / 3 / 8;  // half of the candidates in a third of the box
  for (const auto& [name, text] : {std::pair{"passages.csv", passages}, std::pair{"ends.csv", ends}}) {
    request.measured = place.put(name, text);
    request.directory = place.path() / (std::string(name) + "-out");
    fs::create_directories(request.directory);
    const std::vector<std::string> lines = calibrate(request);
    ASSERT_FALSE(lines.empty());
    // The box slides on when its time is over: a place, and no end point.
    EXPECT_EQ(lines.back().find("still moved") != std::string::npos, std::string(name) == "ends.csv")
        << lines.back();
    const Json c = json_of(request.directory / "calibration.json");
    EXPECT_NEAR(c["best"]["values"]["interface.rock/ground.friction"].get<double>(), mu, 2 * spacing) << name;
    EXPECT_EQ(c["measured"]["held_out"], 2);
    EXPECT_EQ(c["candidates"].size(), 16u);
    // The best is better than any candidate of the first half.
    double first = 1e300;
    for (std::size_t k = 0; k < 8; ++k) first = std::min(first, c["candidates"][k]["distance"].get<double>());
    EXPECT_LE(c["best"]["distance"].get<double>(), first);
  }
  // What the file says of a line that is not there.
  request.measured = place.put("other.csv", "line,speed\nbridge,1\nbridge,2\nbridge,3\nbridge,4\n");
  EXPECT_THROW(calibrate(request), InputError);
  request.measured = place.put("few.csv", "x,y\n1,2\n");
  EXPECT_THROW(calibrate(request), InputError);
  const auto refusal = [&](const std::string& text) -> std::string {
    request.measured = place.put("dialect.csv", text);
    try {
      calibrate(request);
    } catch (const InputError& e) { return e.what(); }
    return {};
  };
  for (const auto& [text, rule] :
       {std::pair{"x [ft],y\n1,2\n3,4\n5,6\n7,8\n", "1 ft = 0.3048 m"},
        std::pair{"x_kg,y\n1,2\n3,4\n5,6\n7,8\n", "is no a length in m"},
        std::pair{"x,y,X\n1,2,3\n3,4,5\n5,6,7\n7,8,9\n", "is the name of two columns"},
        std::pair{"line,energy\nroad,-1\nroad,2\nroad,3\nroad,4\n", "none is below 0"}})
    EXPECT_NE(refusal(text).find(rule), std::string::npos) << text << refusal(text);
  // The same rows as spreadsheets of other countries write them; and commas that would be cut.
  const auto best = [&](const std::string& text) {
    request.candidates = 4;
    request.measured = place.put("dialect.csv", text);
    calibrate(request);
    return json_of(request.directory / "calibration.json")["best"].dump();
  };
  std::string semicolons = "\xEF\xBB\xBFX;Y\r\n";
  for (const char c : ends.substr(4)) semicolons += c == ',' ? ';' : c == '.' ? ',' : c;
  EXPECT_EQ(best(semicolons), best(ends));
  EXPECT_EQ(best("x [m],y (m)" + ends.substr(3)), best(ends));
  EXPECT_NE(refusal("x [kg],y\n1,2\n1,2\n1,2\n1,2\n").find("is no"), std::string::npos);
  EXPECT_NE(refusal("x,y\n10,5,20,3\n11,5,20,3\n12,5,20,3\n13,5,20,3\n").find("are the commas decimal ones?"),
            std::string::npos);
  EXPECT_NE(refusal("x,y\n1 kg,2\n1,2\n1,2\n1,2\n").find("is no"), std::string::npos);
}

TEST(Compare, PercentilesOfFewMembersAreNotSureAndNamesTellOptionsApart) {
  const auto lines = [](const Json& above) {
    const Place place;
    std::vector<fs::path> options;
    for (const char* name : {"as-it-is", "with-net"}) {
      options.push_back(place.path() / name / "out");
      fs::create_directories(options.back());
      const double value = options.size() == 1 ? 100.0 : 200.0;
      const Json p95 = {{"value", value},
                        {"low", value - 5},
                        {"high", above.is_null() ? Json() : Json(value + above.get<double>())}};
      const Json line = {{"name", "road"}, {"energy", {{"p95", p95}}}};
      std::ofstream(options.back() / "summary.json") << Json{{"lines", {line}}};
    }
    return write_comparison(options, place.path() / "options").front();
  };
  EXPECT_NE(lines(Json()).find("of too few members to bound it"), std::string::npos) << lines(Json());
  EXPECT_EQ(lines(5).find("too few"), std::string::npos) << lines(5);
  EXPECT_NE(lines(5).find("with-net/out against as-it-is/out: 100 "), std::string::npos) << lines(5);
}

TEST(Calibrate, ParametersAreRead) {
  const Parameter p = parse_parameter("interface.rock/ground.friction=20 deg:40 deg");
  EXPECT_EQ(p.key, "interface.rock/ground.friction");
  EXPECT_NEAR(p.low, 20 * M_PI / 180, 1e-12);
  EXPECT_EQ(p.unit, "rad");
  for (const char* wrong : {"", "a=1", "=1:2", "a=2:1", "a=1:x", "a=1 m:2 s"})
    EXPECT_THROW(parse_parameter(wrong), InputError) << wrong;
}

}  // namespace
}  // namespace talus::ensemble

// talus capacity: pushes every pier of a finished run down, once as it stands now and once as it was built.
#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/final_state.hpp"
#include "io/files.hpp"
#include "sim/simulation.hpp"

namespace talus::app {
namespace {

using json = nlohmann::ordered_json;

json curve(const PushDown& p) {
  json points = json::array();
  for (const auto& [drop, load] : p.curve) points.push_back(json::array({drop, load}));
  return points;
}

/// What the run's summary says of a member, if it says anything.
json of_summary(const json& summary, const std::string& structure, const std::string& member) {
  for (const json& s : summary.value("structures", json::array()))
    if (s.value("name", std::string()) == structure)
      for (const json& m : s.value("members", json::array()))
        if (m.value("name", std::string()) == member) return m;
  return json::object();
}

json entry(const std::string& structure, const PushDown& now, const PushDown& built, double permanent, const json& said) {
  const double ratio = now.capacity / built.capacity;
  fmt::print("{:<16} {:<8} {:>14.1f} {:>14.1f} {:>9.3f} {:>14.1f} {:>8.2f}   {} {}\n", structure, now.member, built.capacity / 1e3, now.capacity / 1e3, ratio, permanent / 1e3,
             permanent > 0 ? now.capacity / permanent : 0.0, said.contains("damage_class") ? said["damage_class"].dump() : "-", said.value("damage_class_name", std::string("-")));
  return {{"structure", structure},
          {"member", now.member},
          {"capacity_built", built.capacity},
          {"capacity_now", now.capacity},
          {"ratio", ratio},
          {"displacement_built", built.at},
          {"displacement_now", now.at},
          {"axial_preload", permanent},
          {"damage_class", said.value("damage_class", json())},
          {"damage_class_name", said.value("damage_class_name", json())},
          {"reserve", permanent > 0 ? json(now.capacity / permanent) : json()},
          {"curve_built", curve(built)},
          {"curve_now", curve(now)}};
}

}  // namespace

int command_capacity(const Options& options) {
  namespace fs = std::filesystem;
  const fs::path directory = options.input;
  const FinalState final = load_final_state(directory);
  sim::Simulation simulation(final.scene, [](const std::string& line) {
    if (line.starts_with("push-down")) fmt::print(stderr, "{}\n", line);
  });
  const std::vector<Structure*> structures = simulation.structures();
  std::error_code none;
  const json summary = fs::exists(directory / "summary.json", none) ? json::parse(io::read_file(directory / "summary.json")) : json::object();
  json rows = json::array();
  const fs::path file = directory / "capacity.json";
  fmt::print("{:<16} {:<8} {:>14} {:>14} {:>9} {:>14} {:>8}   {}\n", "structure", "member", "as built [kN]", "now [kN]", "now/built", "permanent [kN]", "reserve", "damage class");
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (!structures[q]) continue;
    Structure& s = *structures[q];
    fmt::print(stderr, "{} as built:\n", final.scene.structures[q].name);
    const std::vector<PushDown> built = s.push_down();
    fmt::print(stderr, "{} as it stands now:\n", final.scene.structures[q].name);
    s.restore(final.of(static_cast<int>(q)));
    const std::vector<PushDown> now = s.push_down();
    for (std::size_t k = 0; k < built.size(); ++k) rows.push_back(entry(final.scene.structures[q].name, now[k], built[k], s.members()[k].axial_preload, of_summary(summary, final.scene.structures[q].name, now[k].member)));
    std::fflush(stdout);
    io::write_file(file, json{{"schema", 1}, {"program", "talus"}, {"time", final.time}, {"members", rows}}.dump(2) + "\n");   // with each structure, should a later one fail
  }
  fmt::print("Load on the top of each member between rigid plates; curves: {}\n", file.string());
  return done;
}

}  // namespace talus::app

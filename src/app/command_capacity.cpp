// talus capacity: pushes every pier of a finished run down, once as it stands now and once as it was built.
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/final_state.hpp"
#include "app/tell.hpp"
#include "io/files.hpp"
#include "io/json_file.hpp"
#include "sim/simulation.hpp"

namespace talus::app {
namespace {

using json = nlohmann::ordered_json;

json curve(const PushDown& p) {
  json points = json::array();
  for (const auto& [drop, load] : p.curve) points.push_back(json::array({drop, load}));
  return points;
}

/// The object named `name` in list `key` of `of`; empty if there is none.
json named(const json& of, const char* key, const std::string& name) {
  if (of.contains(key))
    for (const json& entry : of[key])
      if (entry.is_object() && entry.contains("name") && entry["name"] == name) return entry;
  return json::object();
}

/// The value of `key` as a cell of a table.
std::string plain(const json& of, const char* key) {
  const json value = of.value(key, json("-"));
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// A member of which a tenth is gone, whose top has come off, or that the run left leaning beyond use (class 4 of the summary), has no capacity as a pier: what its
/// stump bears between two plates that neither move aside nor tilt is told beside it, and is no reserve.
bool is_lost(const Member& member, const MemberState& state, const json& said) {
  constexpr double share = 0.1;
  return said.value("damage_class", json()) == 4 || !std::isfinite(state.drift[0]) || (member.volume > 0 && state.lost_volume > share * member.volume);
}

json entry(const std::string& structure, const PushDown& now, const PushDown& built, const Member& member, bool lost, const json& said) {
  const double ratio = now.capacity / built.capacity, permanent = member.axial_preload;
  const auto unless_lost = [&](const std::string& text) { return lost ? std::string("-") : text; };
  fmt::print("{:<16} {:<8} {:>14.1f} {:>14} {:>9} {:>14.1f} {:>8}   {} {}{}\n", structure, now.member, built.capacity / 1e3, lost ? "lost" : fmt::format("{:.1f}", now.capacity / 1e3), unless_lost(fmt::format("{:.3f}", ratio)),
             std::abs(permanent) < 50 ? 0.0 : permanent / 1e3, unless_lost(permanent > 0 ? fmt::format("{:.2f}", now.capacity / permanent) : std::string("-")), plain(said, "damage_class"), plain(said, "damage_class_name"), lost ? fmt::format("; what is left bears {:.1f} kN between plates", now.capacity / 1e3) : std::string());
  return {{"structure", structure},
          {"member", now.member},
          {"lost", lost},
          {"capacity_built", built.capacity},
          {"capacity_now", lost ? json() : json(now.capacity)},
          {"ratio", lost ? json() : json(ratio)},
          {"capacity_of_rest", lost ? json(now.capacity) : json()},
          {"displacement_built", built.at},
          {"displacement_now", now.at},
          {"axial_preload", permanent},
          {"damage_class", said.value("damage_class", json())},
          {"damage_class_name", said.value("damage_class_name", json())},
          {"reserve", permanent > 0 && !lost ? json(now.capacity / permanent) : json()},
          {"curve_built", curve(built)},
          {"curve_now", curve(now)}};
}

}  // namespace

int command_capacity(const Options& options) {
  namespace fs = std::filesystem;
  const fs::path directory = options.input;
  io::require_idle(directory);
  const FinalState final = load_final_state(directory);
  sim::Simulation simulation(final.scene, [](const std::string& line) {
    if (line.starts_with("push-down")) tell("{}\n", line);
  });
  const std::vector<Structure*> structures = simulation.structures();
  std::error_code none;
  const json summary = fs::exists(directory / "summary.json", none) ? io::read_json(directory / "summary.json", "delete it to have the capacities without the damage classes") : json::object();
  json rows = json::array();
  bool any_lost = false;
  const fs::path file = directory / "capacity.json";
  fmt::print("{:<16} {:<8} {:>14} {:>14} {:>9} {:>14} {:>8}   {}\n", "structure", "member", "as built [kN]", "now [kN]", "now/built", "permanent [kN]", "reserve", "damage class");
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (!structures[q]) continue;
    Structure& s = *structures[q];
    tell("{} as built:\n", final.scene.structures[q].name);
    const std::vector<PushDown> built = s.push_down();
    tell("{} as it stands now:\n", final.scene.structures[q].name);
    s.restore(final.of(static_cast<int>(q)));
    const std::vector<PushDown> now = s.push_down();
    const std::vector<MemberState> states = s.member_states();
    for (std::size_t k = 0; k < built.size(); ++k) {
      const json said = named(named(summary, "structures", final.scene.structures[q].name), "members", now[k].member);
      const bool lost = is_lost(s.members()[k], states[k], said);
      any_lost = any_lost || lost;
      rows.push_back(entry(final.scene.structures[q].name, now[k], built[k], s.members()[k], lost, said));
    }
    std::fflush(stdout);
    io::write_file(file, json{{"schema", 1}, {"program", "talus"}, {"time", final.time}, {"members", rows}}.dump(2) + "\n");   // with each structure, should a later one fail
  }
  if (any_lost) fmt::print("lost: a tenth of the member or more is gone, its top has come off, or it leans by more than 5 %; as a pier it is not to be counted on, and no capacity is stated. "
                           "What its stump bears between rigid plates that neither move aside nor tilt (capacity_of_rest) is no reserve: nothing holds the load above it like that.\n");
  fmt::print("Load on the top of each member between rigid plates; curves: {}\n", file.string());
  return done;
}

}  // namespace talus::app

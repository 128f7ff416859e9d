// talus capacity: pushes every pier of a finished run down, and with --lateral sideways, once as it stands
// now and once as it was built, beside EN 1992-1-1.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/tell.hpp"
#include "io/files.hpp"
#include "io/final_state.hpp"
#include "io/hdf5_file.hpp"
#include "io/json_file.hpp"
#include "io/report.hpp"
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

/// A member of which a tenth is gone, whose top has come off, or that the run left leaning beyond use (class
/// 4 of the summary), has no capacity as a pier: what its stump carries between two plates that neither
/// move aside nor tilt is printed beside it, and is no reserve.
bool is_lost(const Member& member, const MemberState& state, const json& said) {
  constexpr double share = 0.1;
  return said.value("damage_class", json()) == 4 || !std::isfinite(state.drift[0]) ||
         (member.volume > 0 && state.lost_volume > share * member.volume);
}

json entry(const std::string& structure, const PushDown& now, const PushDown& built, const Member& member,
           bool lost, const json& said) {
  const double ratio = now.capacity / built.capacity, permanent = member.axial_preload;
  const auto unless_lost = [&](const std::string& text) { return lost ? std::string("-") : text; };
  fmt::print("{:<16} {:<8} {:>14.1f} {:>14} {:>9} {:>14.1f} {:>8}   {} {}{}\n", structure, now.member,
             built.capacity / 1e3, lost ? "lost" : fmt::format("{:.1f}", now.capacity / 1e3),
             unless_lost(fmt::format("{:.3f}", ratio)), std::abs(permanent) < 50 ? 0.0 : permanent / 1e3,
             unless_lost(permanent > 0 ? fmt::format("{:.2f}", now.capacity / permanent) : std::string("-")),
             plain(said, "damage_class"), plain(said, "damage_class_name"),
             lost ? fmt::format("; what is left bears {:.1f} kN between plates", now.capacity / 1e3)
                  : std::string());
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

/// Static resistances of the section by rule, and the lateral force at the top that a cantilever of them
/// bears.
json by_rule(const SectionResistance& r, double length) {
  const auto values = [&](const SectionResistance::Values& v) {
    return json{{"n_rd", v.compression},
                {"n_rd_tension", v.tension},
                {"m_rd", v.moment},
                {"v_rd", v.shear},
                {"lateral",
                 {std::min(v.shear[0], v.moment[0] / length), std::min(v.shear[1], v.moment[1] / length)}}};
  };
  return {{"axial", r.axial},
          {"design", values(r.design)},
          {"mean", values(r.mean)},
          {"interaction_x", r.interaction[0]},
          {"interaction_y", r.interaction[1]}};
}

void print_by_rule(const std::string& structure, const SectionResistance& r, double length) {
  for (const bool design : {true, false}) {
    const SectionResistance::Values& v = design ? r.design : r.mean;
    fmt::print("{:<16} {:<8} {:<6} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f}\n",
               structure, r.member, design ? "design" : "mean", v.compression / 1e3, v.moment[0] / 1e3,
               v.moment[1] / 1e3, v.shear[0] / 1e3, v.shear[1] / 1e3,
               std::min(v.shear[0], v.moment[0] / length) / 1e3,
               std::min(v.shear[1], v.moment[1] / length) / 1e3);
  }
}

/// The lateral tests of one member, beside what its section bears by rule.
json lateral(const std::string& structure, const PushDown& now, const PushDown& built, bool lost,
             const SectionResistance* rule, double length) {
  const char* axis = now.axis == 0 ? "x" : "y";
  const auto along = static_cast<std::size_t>(now.axis);
  const double hand =
      rule != nullptr ? std::min(rule->mean.shear[along], rule->mean.moment[along] / length) : 0;
  fmt::print("{:<16} {:<8} {:<5} {:>14.1f} {:>14} {:>9} {:>16}\n", structure, now.member, axis,
             built.capacity / 1e3, lost ? "lost" : fmt::format("{:.1f}", now.capacity / 1e3),
             lost ? "-" : fmt::format("{:.3f}", now.capacity / built.capacity),
             rule != nullptr ? fmt::format("{:.1f}", hand / 1e3) : std::string("-"));
  return {{"axis", axis},
          {"capacity_built", built.capacity},
          {"capacity_now", lost ? json() : json(now.capacity)},
          {"ratio", lost ? json() : json(now.capacity / built.capacity)},
          {"drift_built", built.at},
          {"drift_now", now.at},
          {"by_rule_mean", rule != nullptr ? json(hand) : json()},
          {"curve_built", curve(built)},
          {"curve_now", curve(now)}};
}

}  // namespace

int command_capacity(const Options& options) {
  namespace fs = std::filesystem;
  const fs::path directory = options.input;
  io::require_idle(directory);
  if (!fs::exists(directory / io::marker_name))
    throw io::bad_file(directory, "DIR", "is no output directory of Talus",
                       "name the directory of a finished run");
  const fs::path results = directory / "results.h5";
  const sim::FinalState state = io::read_final_state(results);
  const scene::Scene scene = scene::read_scene((directory / "scene.resolved.json").string());
  sim::Simulation simulation(scene, [](const std::string& line) {
    if (line.starts_with("push-")) tell("{}\n", line);
  });
  simulation.halve_cells_struck(state);
  const std::vector<Structure*> structures = simulation.structures();
  if (std::ranges::none_of(structures, [](const Structure* s) { return s != nullptr; }))
    throw io::bad_file(
        directory, "structure", "the run has no structure that gives way: nothing to press",
        "name the directory of a run with a pier, column or box, coupling.scheme = \"two-way\" "
        "or \"one-way\"");
  std::error_code none;
  const json summary = fs::exists(directory / "summary.json", none)
                           ? io::read_json(directory / "summary.json",
                                           "delete it to have the capacities without the damage classes")
                           : json::object();
  const double time = io::Hdf5File::open(results).read<double>("/history/time").values.back();
  json rows = json::array();
  bool any_lost = false;
  const fs::path file = directory / "capacity.json";
  fmt::print("{:<16} {:<8} {:>14} {:>14} {:>9} {:>14} {:>8}   {}\n", "structure", "member", "as built [kN]",
             "now [kN]", "now/built", "permanent [kN]", "reserve", "damage class");
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (!structures[q]) continue;
    Structure& s = *structures[q];
    const auto last = state.structures.find(scene.structures[q].name);
    if (last == state.structures.end())
      throw io::bad_file(results, scene.structures[q].name, "the final state lacks this structure",
                         "run the scene again");
    const std::size_t first = rows.size();
    std::vector<char> lost_ones;
    tell("{} as built:\n", scene.structures[q].name);
    const std::vector<PushDown> built = s.capacity().push_down(),
                                over = options.lateral ? s.capacity().push_over() : std::vector<PushDown>{};
    const std::vector<SectionResistance> rules = s.capacity().section_resistances();
    tell("{} as it stands now:\n", scene.structures[q].name);
    s.restore(last->second.history);
    const std::vector<PushDown> now = s.capacity().push_down(), over_now = options.lateral
                                                                               ? s.capacity().push_over()
                                                                               : std::vector<PushDown>{};
    const std::vector<MemberState> states = s.loads().states();
    for (std::size_t k = 0; k < built.size(); ++k) {
      const json said =
          named(named(summary, "structures", scene.structures[q].name), "members", now[k].member);
      const bool lost = is_lost(s.loads().members()[k], states[k], said);
      any_lost = any_lost || lost;
      rows.push_back(entry(scene.structures[q].name, now[k], built[k], s.loads().members()[k], lost, said));
      lost_ones.push_back(lost);
    }
    if (!over.empty())
      fmt::print(
          "\nLateral force at the top, foot held, top free to turn\n{:<16} {:<8} {:<5} {:>14} {:>14} {:>9} "
          "{:>16}\n",
          "structure", "member", "axis", "as built [kN]", "now [kN]", "now/built", "by rule, mean");
    for (std::size_t k = 0; k < over.size(); ++k)
      rows[first + k / 2]["lateral"].push_back(
          lateral(scene.structures[q].name, over_now[k], over[k], lost_ones[k / 2],
                  k / 2 < rules.size() ? &rules[k / 2] : nullptr, s.loads().members()[k / 2].length));
    if (!rules.empty())
      fmt::print(
          "\nSection at the foot by EN 1992-1-1 (6.1, 6.2), as built, static; M at the permanent axial "
          "force; H = min(V, M / L) at the top of a cantilever\n{:<16} {:<8} {:<6} {:>12} {:>12} {:>12} "
          "{:>12} {:>12} {:>12} {:>12}\n",
          "structure", "member", "", "N_Rd [kN]", "M_Rd,x [kNm]", "M_Rd,y [kNm]", "V_Rd,x [kN]",
          "V_Rd,y [kN]", "H_x [kN]", "H_y [kN]");
    for (std::size_t k = 0; k < rules.size() && first + k < rows.size(); ++k) {
      print_by_rule(scene.structures[q].name, rules[k], s.loads().members()[k].length);
      rows[first + k]["en1992"] = by_rule(rules[k], s.loads().members()[k].length);
    }
    std::fflush(stdout);
    io::write_file(file,
                   json{{"schema", 1}, {"program", "talus"}, {"time", time}, {"members", rows}}.dump(2) +
                       "\n");  // with each structure, should a later one fail
  }
  if (any_lost)
    fmt::print(
        "lost: a tenth of the member or more is gone, its top has come off, or it leans by more than 5 %; as "
        "a pier it is not to be counted on, and no capacity is stated. "
        "What its stump bears between rigid plates that neither move aside nor tilt (capacity_of_rest) is no "
        "reserve: nothing holds the load above it like that.\n");
  fmt::print("Load on the top of each member between rigid plates; curves: {}\n", file.string());
  // It says what the members still bear.
  if (fs::exists(directory / "report.html", none))
    fmt::print("Report, renewed: {}\n", io::write_report(directory).string());
  return done;
}

}  // namespace talus::app

#include "ensemble/compare.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "ensemble/fragility/fragility_file.hpp"
#include "ensemble/results.hpp"
#include "ensemble/statistics.hpp"
#include "io/files.hpp"
#include "io/json_file.hpp"
#include "io/xml.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

/// Behind a figure of this name, with a blank before it.
const char* unit_of(const std::string& name) {
  return name.find("energy") != std::string::npos   ? " J"
         : name.find("speed") != std::string::npos  ? " m/s"
         : name.find("height") != std::string::npos ? " m"
                                                    : "";
}

/// Of an option, or a difference of two. An end of the interval that is not known is NaN: nothing is sure by
/// it.
using Figure = Estimate;

std::optional<Figure> figure_of(const Json& e) {
  if (!e.is_object() || !e.contains("value") || !e["value"].is_number()) return {};
  const auto number = [&](const char* key) {
    return e.contains(key) && e[key].is_number() ? e[key].get<double>() : none;
  };
  return Figure{number("value"), number("low"), number("high")};
}

/// What rounding leaves of two figures that are one is no difference.
Figure difference(const Figure& from, const Figure& to) {
  constexpr double round_off = 1e-12;
  double d = to.value - from.value;
  if (std::abs(d) <= round_off * std::max(std::abs(to.value), std::abs(from.value))) d = 0;
  return {d, d - std::hypot(to.value - to.low, from.high - from.value),
          d + std::hypot(to.high - to.value, from.value - from.low)};
}

/// The last parts of their paths, as many as tell them apart.
std::vector<std::string> names_of(const std::vector<fs::path>& directories) {
  std::vector<fs::path> rest, names(directories.size());
  for (const fs::path& directory : directories) {
    const fs::path whole = fs::absolute(directory).lexically_normal();
    rest.push_back(whole.filename().empty() ? whole.parent_path() : whole);
  }
  for (bool alike = true; alike;) {
    alike = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
      names[k] = names[k].empty() ? rest[k].filename() : rest[k].filename() / names[k];
      rest[k] = rest[k].parent_path();
    }
    for (std::size_t k = 0; k < names.size(); ++k)
      for (std::size_t j = 0; j < k; ++j) alike = alike || (names[j] == names[k] && rest[j] != rest[k]);
  }
  std::vector<std::string> texts;
  for (const fs::path& name : names) texts.push_back(name.string());
  return texts;
}

using Figures = std::vector<std::pair<std::string, Figure>>;

void add(Figures& all, const std::string& name, const Json& e) {
  if (const auto f = figure_of(e)) all.emplace_back(name, *f);
}

/// Figures of damage of a structure.
void add_fragility(Figures& all, const Json& fragility) {
  const std::string structure = fragility.value("structure", "");
  const auto plain = [&](const std::string& name, const Json& value) { add(all, name, {{"value", value}}); };
  const Json& events = fragility["events"];
  if (events.contains("probability_of_hit_interval"))
    add(all, structure + ": probability of a hit",
        {{"value", events.value("probability_of_hit", Json())},
         {"low", events["probability_of_hit_interval"][0]},
         {"high", events["probability_of_hit_interval"][1]}});
  add(all, structure + ": transmitted force, mean of the peaks over hits",
      fragility["peak_force"].value("mean", Json()));
  plain(structure + ": transmitted force, largest peak", fragility["peak_force"].value("largest", Json()));
  if (fragility.contains("capacity"))
    add(all, structure + ": capacity over that as built, least member, mean over hits",
        fragility["capacity"].value("least_ratio", Json()));
  for (const Json& p : fragility.value("per_event", Json::array()))
    add(all, fmt::format("{}: P(class >= {}) per event", structure, p.value("class", 0)), p);
  for (const Json& p : fragility.value("per_year", Json::array()))
    add(all, fmt::format("{}: P(class >= {}) per year", structure, p.value("class", 0)), p);
  for (const Json& m : fragility.value("members", Json::array()))
    for (const Json& p : m.value("per_event", Json::array()))
      add(all,
          fmt::format("{} {}: P(class >= {}) per event", structure, m.value("name", ""), p.value("class", 0)),
          p);
  plain(structure + ": expected closure per event, days",
        fragility["expected_closure"].value("days_per_event", Json()));
}

/// All figures of a directory by their names, in order.
Figures figures_of(const fs::path& directory) {
  Figures all;
  if (!fs::exists(directory / "summary.json")) require_finished(directory);
  const Json summary =
      io::read_json(directory / "summary.json", "name the output directory of talus ensemble");
  if (!summary.contains("lines"))
    throw io::bad_file(directory / "summary.json", "lines", "is missing",
                       "name the output directory of talus ensemble");
  for (const Json& line : summary["lines"]) {
    const std::string name = line.value("name", "");
    add(all, name + ": probability of crossing", line.value("probability", Json()));
    for (const char* quantity : {"energy", "speed", "height"})
      for (const int p : {50, 90, 95, 99})
        if (const std::string key = fmt::format("p{}", p);
            line.contains(quantity) && line[quantity].contains(key))
          add(all, fmt::format("{}: {} {}", name, quantity, key), line[quantity][key]);
  }
  for (const Json& fragility : read_fragility(directory)) add_fragility(all, fragility);
  return all;
}

/// NaN is written as null.
Json json_of(const Figure& f) { return {{"value", f.value}, {"low", f.low}, {"high", f.high}}; }

std::string cell(const Figure& f) {
  const std::string interval = interval_text(f);
  return fmt::format("{:.4g}", f.value) + (interval.empty() ? "" : "<br><small>" + interval + "</small>");
}

}  // namespace

std::vector<std::string> write_comparison(const std::vector<fs::path>& directories, const fs::path& output) {
  const std::vector<std::string> names = names_of(directories);
  std::vector<std::map<std::string, Figure>> options;
  std::vector<std::string> order;
  for (const fs::path& directory : directories) {
    auto& option = options.emplace_back();
    for (const auto& [name, figure] : figures_of(directory)) {
      option[name] = figure;
      if (std::find(order.begin(), order.end(), name) == order.end()) order.push_back(name);
    }
  }
  Json root{{"options", Json::array()}, {"figures", Json::array()}};
  for (std::size_t k = 0; k < names.size(); ++k)
    root["options"].push_back({{"name", names[k]}, {"directory", fs::absolute(directories[k]).string()}});
  std::string head = "<th scope=\"col\">figure</th>", body;
  for (std::size_t k = 0; k < names.size(); ++k)
    head += fmt::format("<th scope=\"col\">{}</th>", io::xml_text(names[k])) +
            (k > 0 ? "<th scope=\"col\">difference</th>" : "");
  std::vector<std::string> lines;
  for (const std::string& name : order) {
    Json row{{"name", name}, {"options", Json::array()}, {"differences", Json::array()}};
    body += "<tr><td>" + io::xml_text(name) + "</td>";
    const auto base = options.front().find(name);
    for (std::size_t k = 0; k < options.size(); ++k) {
      const auto found = options[k].find(name);
      const bool there = found != options[k].end();
      row["options"].push_back(there ? json_of(found->second) : Json(nullptr));
      body += "<td>" + (there ? cell(found->second) : std::string("-")) + "</td>";
      if (k == 0) continue;
      if (!there || base == options.front().end()) {
        row["differences"].push_back(nullptr);
        body += "<td>-</td>";
        continue;
      }
      const Figure d = difference(base->second, found->second);
      row["differences"].push_back(json_of(d));
      const bool bounded = std::isfinite(d.low) && std::isfinite(d.high),
                 sure = bounded && (d.low > 0 || d.high < 0);
      body += fmt::format("<td{}>{}</td>", sure ? " class=\"sure\"" : "", cell(d));
      if (name.ends_with("p95") || name.find("P(class >= 3) per event") != std::string::npos)
        lines.push_back(fmt::format("{}: {} against {}: {:.4g}{}{}{}", name, names[k], names[0], d.value,
                                    bounded ? fmt::format(" ({})", interval_text(d)) : "", unit_of(name),
                                    !bounded ? ", of too few members to bound it"
                                    : sure   ? ""
                                             : ", within the intervals"));
    }
    body += "</tr>\n";
    root["figures"].push_back(std::move(row));
  }
  if (lines.empty())
    lines.emplace_back(
        "No 95th percentile at a line and no probability of class 3 is known of two of them: all other "
        "figures are in compare.json and compare.html");
  fs::create_directories(output);
  io::write_file(output / "compare.json", root.dump(2) + "\n");
  io::write_file(
      output / "compare.html",
      "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>Options side by side</title><style>:root{color-scheme:light "
      "dark;--ink:#1d2733;--soft:#5b6672;--line:#d9dee4;--ground:#fff}@media(prefers-color-scheme:dark){:"
      "root{--ink:#e7ebf0;--soft:#a8b3bf;--line:#3a4552;--ground:#14191f}}"
      "body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:1080px;padding:0 "
      "1em;color:var(--ink);background:var(--ground)}table{border-collapse:collapse;display:block;overflow-x:"
      "auto;max-width:100%}"
      "td,th{padding:.35em .9em;border-bottom:1px solid "
      "var(--line);text-align:right;vertical-align:top}td:first-child,th:first-child{text-align:left}small{"
      "color:var(--soft);white-space:nowrap}.sure{font-weight:600}</style></head><body><main>"
      "<h1>Options side by side</h1><p>SI units. Small figures are 95 % intervals; a difference in bold has "
      "an interval that leaves zero out, of enough members to bound it. Blocks do not break on "
      "impact.</p><table><thead><tr>" +
          head + "</tr></thead><tbody>" + body + "</tbody></table></main></body></html>\n");
  return lines;
}

}  // namespace talus::ensemble

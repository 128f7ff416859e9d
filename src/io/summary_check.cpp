#include "io/summary_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "io/files.hpp"

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

/// A number that was not finite is null in the file; so is what there is none of.
enum class Kind { text, number, flag, vector, place, texts, object, objects };

struct Field {
  const char* key;
  Kind kind;
  bool needed = true;
};

constexpr Field of_run[] = {{"title", Kind::text},
                            {"status", Kind::text},
                            {"message", Kind::text, false},
                            {"time", Kind::object},
                            {"headline", Kind::texts},
                            {"impacts", Kind::objects},
                            {"formulas", Kind::objects, false},
                            {"structures", Kind::objects},
                            {"blocks", Kind::objects},
                            {"energy", Kind::object},
                            {"warnings", Kind::texts, false},
                            {"counters", Kind::object, false},
                            {"audit", Kind::object, false},
                            {"confidence", Kind::objects, false},
                            {"plan", Kind::texts, false}};
constexpr Field of_time[] = {{"end", Kind::number}, {"wall_seconds", Kind::number, false}};
constexpr Field of_energy[] = {{"residual_relative", Kind::number}};
constexpr Field of_impact[] = {{"structure", Kind::text},
                               {"block", Kind::text},
                               {"start", Kind::number},
                               {"end", Kind::number},
                               {"speed", Kind::number},
                               {"kinetic", Kind::number},
                               {"kinetic_rotational", Kind::number, false},
                               {"point", Kind::vector},
                               {"impulse", Kind::vector},
                               {"peak_force", Kind::number},
                               {"peak_time", Kind::number},
                               {"filtered_force", Kind::number, false},
                               {"mean_force", Kind::number}};
constexpr Field of_structure[] = {{"name", Kind::text},
                                  {"form", Kind::text, false},
                                  {"loaded", Kind::flag, false},
                                  {"hit", Kind::flag},
                                  {"impulse", Kind::vector},
                                  {"peak_force", Kind::number},
                                  {"peak_base_force", Kind::number},
                                  {"peak_base_shear", Kind::number, false},
                                  {"peak_base_moment", Kind::number},
                                  {"damage_max", Kind::number},
                                  {"damaged_volume", Kind::number},
                                  {"spalled_volume", Kind::number},
                                  {"members", Kind::objects, false},
                                  {"probes", Kind::objects}};
constexpr Field of_member[] = {{"name", Kind::text},
                               {"axial_preload", Kind::number},
                               {"peak_shear", Kind::place},
                               {"peak_moment", Kind::place},
                               {"shear_utilisation_design", Kind::place},
                               {"peak_drift", Kind::number},
                               {"crack_width_peak", Kind::number},
                               {"damage_class", Kind::number, false}};
constexpr Field of_probe[] = {{"name", Kind::text},
                              {"peak_displacement", Kind::number},
                              {"peak_time", Kind::number},
                              {"final_displacement", Kind::vector}};
constexpr Field of_block[] = {{"name", Kind::text},
                              {"mass", Kind::number},
                              {"volume", Kind::number},
                              {"fixed", Kind::flag},
                              {"fragment", Kind::flag},
                              {"start", Kind::vector, false},
                              {"end", Kind::vector, false},
                              {"runout", Kind::number, false},
                              {"drop", Kind::number, false},
                              {"max_speed", Kind::number, false},
                              {"max_kinetic", Kind::number, false}};
constexpr Field of_formula[] = {{"structure", Kind::text},  {"block", Kind::text},    {"name", Kind::text},
                                {"symbol", Kind::text},     {"kind", Kind::text},     {"value", Kind::number},
                                {"computed", Kind::number}, {"equation", Kind::text}, {"inputs", Kind::text},
                                {"source", Kind::text},     {"status", Kind::text},   {"note", Kind::text}};
constexpr Field of_confidence[] = {{"quantity", Kind::text}, {"level", Kind::text}, {"basis", Kind::text}};

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::text: return "a text";
    case Kind::number: return "a number";
    case Kind::flag: return "true or false";
    case Kind::vector: return "three numbers";
    case Kind::place: return "a table of value, time and station";
    case Kind::texts: return "a list of texts";
    case Kind::object: return "a table";
    case Kind::objects: return "a list of tables";
  }
  return "";
}

bool is_number(const json& v) { return v.is_number() || v.is_null(); }

bool is_list(const json& v, bool (*of)(const json&)) {
  return v.is_array() && std::all_of(v.begin(), v.end(), of);
}

bool has_number(const json& table, const char* key) {
  return table.contains(key) && is_number(table.at(key));
}

bool is_of(const json& v, Kind kind) {
  switch (kind) {
    case Kind::text: return v.is_string();
    case Kind::number: return is_number(v);
    case Kind::flag: return v.is_boolean();
    case Kind::vector: return v.size() == 3 && is_list(v, is_number);
    case Kind::place:
      return v.is_null() ||
             (v.is_object() && has_number(v, "value") && has_number(v, "time") && has_number(v, "station"));
    case Kind::texts: return is_list(v, [](const json& x) { return x.is_string(); });
    case Kind::object: return v.is_object();
    case Kind::objects: return is_list(v, [](const json& x) { return x.is_object(); });
  }
  return false;
}

class Check {
 public:
  explicit Check(const std::filesystem::path& file) : file_(file) {}

  void table(const json& t, std::span<const Field> fields, const std::string& at = {}) const {
    for (const Field& f : fields) {
      const std::string key = at.empty() ? f.key : at + "." + f.key;
      if (!t.contains(f.key)) {
        if (f.needed) refuse(key, "is missing");
      } else if (!is_of(t.at(f.key), f.kind)) {
        refuse(key, fmt::format("must be {}", name_of(f.kind)));
      }
    }
  }
  void list(const json& of, const char* key, std::span<const Field> fields,
            const std::string& at = {}) const {
    if (!of.contains(key)) return;
    for (std::size_t i = 0; i < of.at(key).size(); ++i)
      table(of.at(key)[i], fields, fmt::format("{}{}.{}", at, key, i));
  }

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& rule) const {
    throw bad_file(file_, key, rule + ": it is not as this program wrote it",
                   "run the scene again, or bring back the file that the run wrote");
  }
  const std::filesystem::path& file_;
};

}  // namespace

void check_summary(const json& summary, const std::filesystem::path& file) {
  const Check check(file);
  check.table(summary, of_run);
  check.table(summary.at("time"), of_time, "time");
  check.table(summary.at("energy"), of_energy, "energy");
  check.list(summary, "impacts", of_impact);
  check.list(summary, "structures", of_structure);
  for (std::size_t i = 0; i < summary.at("structures").size(); ++i) {
    const json& structure = summary.at("structures")[i];
    const std::string at = fmt::format("structures.{}.", i);
    check.list(structure, "members", of_member, at);
    check.list(structure, "probes", of_probe, at);
  }
  check.list(summary, "blocks", of_block);
  check.list(summary, "formulas", of_formula);
  check.list(summary, "confidence", of_confidence);
}

}  // namespace talus::io

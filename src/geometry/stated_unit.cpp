#include "geometry/stated_unit.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <sstream>
#include <vector>

namespace talus::geometry {
namespace {

constexpr double survey_foot = 1200.0 / 3937;  // [m]

}  // namespace

double metres_of(const std::string& unit) {
  std::string plain;
  for (const char c : unit)
    if (std::isalnum(static_cast<unsigned char>(c)))
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  struct Unit {
    double metres;
    std::vector<const char*> names;
  };
  static const Unit units[] = {
      {1, {"m", "metre", "metres", "meter", "meters"}},
      {0.1, {"dm", "decimetre", "decimeter", "decimetres", "decimeters"}},
      {0.01, {"cm", "centimetre", "centimeter", "centimetres", "centimeters"}},
      {0.001, {"mm", "millimetre", "millimeter", "millimetres", "millimeters"}},
      {1000, {"km", "kilometre", "kilometer", "kilometres", "kilometers"}},
      {0.3048,
       {"ft", "foot", "feet", "internationalfoot", "internationalfeet", "footinternational", "ift",
        "footintl", "intlfoot"}},
      {survey_foot,
       {"ussurveyfoot", "ussurveyfeet", "usft", "usfoot", "usfeet", "ftus", "footus", "feetus", "surveyfoot",
        "surveyfeet", "sft", "usf", "footussurvey", "ftussurvey", "ussft"}},
      {0.0254, {"in", "inch", "inches"}},
      {0.9144, {"yd", "yard", "yards"}},
  };
  for (const Unit& u : units)
    for (const char* name : u.names)
      if (plain == name) return u.metres;
  return 0;
}

bool names_other_unit(const std::string& text) {
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  bool number_before = false;
  for (std::size_t at = 0; at < text.size();) {
    if (!letter(text[at])) {
      const char c = text[at++];
      number_before = digit(c) || (number_before && (c == ' ' || c == '-' || c == '.'));
      continue;
    }
    const std::size_t from = at;
    while (at < text.size() && letter(text[at])) ++at;
    const std::string word = text.substr(from, at - from);
    const double metres = word == "in" || number_before ? 0 : metres_of(word);
    if (metres > 0 && std::abs(metres - 1) > 1e-9) return true;
    number_before = false;
  }
  return false;
}

namespace {

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

/// The word after "unit" or "units", past "=", ":", "are" and blanks: "# File units = millimeters".
std::string word_after_units(const std::string& line) {
  const std::string lower = lower_case(line);
  for (std::size_t at = lower.find("unit"); at != std::string::npos; at = lower.find("unit", at + 4)) {
    if (at > 0 && is_letter(lower[at - 1])) continue;
    std::size_t i = at + 4;
    if (i < lower.size() && lower[i] == 's') ++i;
    const std::size_t gap = i;
    while (i < lower.size() && (lower[i] == ' ' || lower[i] == '=' || lower[i] == ':' || lower[i] == '\t'))
      ++i;
    if (i == gap) continue;
    for (const char* filler : {"are ", "is ", "in "})
      if (lower.compare(i, std::string(filler).size(), filler) == 0) i += std::string(filler).size();
    std::size_t end = i;
    while (end < line.size() && is_letter(line[end])) ++end;
    if (end > i && metres_of(line.substr(i, end - i)) > 0) return line.substr(i, end - i);
  }
  return {};
}

/// The remarks at the head of a mesh file, before its first vertex or face.
std::string head_of(const std::string& path) {
  constexpr std::size_t enough = 4096;
  std::string bytes(enough, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(enough));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  const std::string end = lower_case(path.substr(std::min(path.size(), path.find_last_of('.'))));
  if (end == ".stl") return bytes.substr(0, std::min<std::size_t>(80, bytes.find('\n')));
  std::istringstream lines(bytes);
  std::string remarks;
  if (end == ".vtk") {  // its second line is a title
    std::getline(lines, remarks), std::getline(lines, remarks);
    return remarks;
  }
  if (end == ".inp") {  // "**" begins a remark; what follows *HEADING is one
    for (std::string line; std::getline(lines, line) && lower_case(line).rfind("*node", 0) != 0;)
      if (line.rfind("**", 0) == 0 || line.rfind('*', 0) != 0) remarks += line + "\n";
    return remarks;
  }
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (end == ".ply") {
      if (first == "end_header") break;
      if (first == "comment" || first == "obj_info") remarks += line + "\n";
    } else if (!first.empty() && first[0] == '#') {
      remarks += line + "\n";
    } else if (first == "v" || first == "f" ||
               (!first.empty() && std::isdigit(static_cast<unsigned char>(first[0])))) {
      break;
    }
  }
  return remarks;
}

/// The unit of a universal file by its dataset 164, whose first number is the code of a system of units
/// [SDRC, Universal File Datasets]: 1 and 3 metres, 2 and 4 feet, 5, 8 and 10 millimetres, 6 centimetres, 7
/// inches.
StatedUnit unit_of_universal_file(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  for (int n = 0; n < 100 && std::getline(in, line); ++n) {
    std::istringstream words(line);
    int number = 0, code = 0;
    if (!(words >> number) || number != 164 || !(in >> code)) continue;
    switch (code) {
      case 2:
      case 4: return {"feet", 0.3048};
      case 5:
      case 8:
      case 10: return {"millimetres", 0.001};
      case 6: return {"centimetres", 0.01};
      case 7: return {"inches", 0.0254};
      default: return {};
    }
  }
  return {};
}

}  // namespace

StatedUnit stated_unit(const std::string& path) {
  if (lower_case(path).ends_with(".unv")) return unit_of_universal_file(path);
  std::istringstream lines(head_of(path));
  for (std::string line; std::getline(lines, line);)
    if (const std::string name = word_after_units(line); !name.empty()) {
      const double metres = metres_of(name);
      return std::abs(metres - 1) < 1e-9 ? StatedUnit{} : StatedUnit{name, metres};
    }
  return {};
}

}  // namespace talus::geometry

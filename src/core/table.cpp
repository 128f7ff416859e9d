#include "core/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace talus {
namespace {

/// Position of the first separator at or after `at` that does not stand in quotes; the size if there is none.
std::size_t end_of_cell(std::string_view line, std::size_t at, char separator) {
  bool quoted = false;
  for (; at < line.size(); ++at) {
    if (line[at] == '"') quoted = !quoted;
    if (line[at] == separator && !quoted) return at;
  }
  return line.size();
}

/// True if a unit is not known because it is one of another system, and not because the text is no unit at
/// all.
bool of_another_system(const std::string& error) { return error.find("\": ") != std::string::npos; }

/// A heading cut in two where a unit may begin.
struct Cut {
  std::string name, unit;
  bool said = false;  // by "/" or "in": what follows is a unit if it is known as one
};

std::vector<Cut> cuts_before_unit(const std::string& text) {
  const auto trimmed = [](std::string part) {
    const auto first = part.find_first_not_of(" \t"), last = part.find_last_not_of(" \t");
    if (first == std::string::npos) return std::string();
    part = part.substr(first, last - first + 1);
    return part.size() > 2 && part.front() == '(' && part.back() == ')' ? part.substr(1, part.size() - 2)
                                                                        : part;
  };
  std::vector<Cut> cuts;
  const auto cut = [&](std::size_t at, std::size_t length, bool said) {
    if (at == std::string::npos || at == 0) return;
    Cut c{trimmed(text.substr(0, at)), trimmed(text.substr(at + length)), said};
    if (!c.name.empty() && !c.unit.empty()) cuts.push_back(std::move(c));
  };
  cut(text.rfind(" in "), 4, true);
  cut(text.find('/'), 1, true);
  cut(text.find_last_of("_ "), 1, false);
  return cuts;
}

}  // namespace

char table_separator(std::string_view text) {
  bool tab = false;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    if (end_of_cell(line, first, ';') < line.size()) return ';';
    tab = tab || end_of_cell(line, first, '\t') < line.size();
  }
  return tab ? '\t' : ',';
}

std::vector<TableCell> table_cells(std::string_view line, char separator) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  std::vector<TableCell> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = end_of_cell(line, at, separator);
    std::size_t first = at, last = end;
    const auto blank = [&](std::size_t i) {
      return line[i] == ' ' || (line[i] == '\t' && separator != '\t');
    };
    const auto trim = [&] {
      while (first < last && blank(first)) ++first;
      while (last > first && blank(last - 1)) --last;
    };
    trim();
    TableCell cell;
    cell.column = static_cast<int>(first) + 1;
    cell.quoted = last - first >= 2 && line[first] == '"' && line[last - 1] == '"';
    if (cell.quoted) ++first, --last, trim();
    for (std::size_t i = first; i < last; ++i) {
      cell.text += line[i];
      if (cell.quoted && line[i] == '"' && i + 1 < last && line[i + 1] == '"') ++i;  // "" stands for a quote
    }
    cells.push_back(std::move(cell));
    at = end + 1;
  }
  if (cells.size() > 1 && cells.back().text.empty()) cells.pop_back();
  return cells;
}

bool is_blank_row(std::string_view line) {
  const auto first = line.find_first_not_of(" \t\r,;");
  if (line.starts_with("sep=") && line.find_first_not_of(" \t\r", 5) == std::string_view::npos)
    return true;  // "sep=;", by which a spreadsheet knows the separator
  return first == std::string_view::npos || line[line.find_first_not_of(" \t")] == '#';
}

bool is_bare_number(std::string_view text) {
  return text.find_first_not_of("+-.0123456789eE") == std::string_view::npos;
}

std::string with_decimal_point(const TableCell& cell, char separator) {
  std::string text = cell.text;
  if ((separator != ',' || (cell.quoted && !groups_digits(text))) &&
      std::count(text.begin(), text.end(), ',') == 1 && text.find('.') == std::string::npos)
    std::replace(text.begin(), text.end(), ',', '.');
  return text;
}

NameAndUnit name_and_unit(const std::string& text) {
  const auto open = text.find_last_of("[(");
  if (open == std::string::npos || text.back() != (text[open] == '[' ? ']' : ')')) return {text, {}};
  const auto last = open == 0 ? std::string::npos : text.find_last_not_of(" \t", open - 1);
  return {last == std::string::npos ? std::string() : text.substr(0, last + 1),
          text.substr(open + 1, text.size() - open - 2), text[open] == '['};
}

std::string column_name(const std::string& text) {
  std::string name = text;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

std::optional<Quantity> unit_by_text(const std::string& text, std::string& error) {
  return parse_quantity("1 " + text, error);
}

bool may_be_name(const std::string& unit) {
  return unit.size() == 1 && std::isalpha(static_cast<unsigned char>(unit[0])) != 0;
}

std::optional<Heading> read_heading(const std::string& text,
                                    const std::function<ColumnHolds(const std::string&)>& holds,
                                    std::string& problem) {
  std::string error;
  const auto refuse = [&] { problem = fmt::format("column {}: {}", text, error); };
  if (const NameAndUnit parts = name_and_unit(text); !parts.unit.empty()) {
    if (unit_by_text(parts.unit, error))
      return Heading{parts.name.substr(0, parts.name.find_last_not_of(" /") + 1), parts.unit};
    // In round brackets there may be any remark; a unit of another system is none.
    if (!holds(parts.name).read || (!parts.square && !of_another_system(error)))
      return Heading{parts.name, {}};
    refuse();
    return {};
  }
  for (const Cut& cut : cuts_before_unit(text)) {
    const ColumnHolds of = holds(cut.name);
    if (!of.read) continue;
    const std::optional<Quantity> unit = unit_by_text(cut.unit, error);
    if (!unit && of_another_system(error)) {
      refuse();
      return {};
    }
    if (!unit) continue;
    const bool fits = of.dimension && *of.dimension == unit->dimension;
    // Behind a blank or "_" also stands what a name goes on with: F_t, h_min.
    if (fits || cut.said || !(may_be_name(cut.unit) || cut.unit == "min")) return Heading{cut.name, cut.unit};
  }
  return Heading{text, {}};
}

}  // namespace talus

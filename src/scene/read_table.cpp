// Tables of numbers in files: columns, their names and units.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "core/table.hpp"
#include "core/text_file.hpp"
#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

constexpr const char* remedy =
    "numbers in SI with decimal points, separated by commas; or with decimal commas, separated by "
    "semicolons";

/// True for a cell that is meant as a number, whether it can be read as one or not.
bool begins_a_number(const std::string& text) {
  constexpr std::string_view typographic_minus = "\u2212";
  std::size_t at = text.starts_with(typographic_minus) ? typographic_minus.size() : 0;
  while (at < text.size() && at < 4 && std::string_view("+-.,<>~").find(text[at]) != std::string_view::npos)
    ++at;
  char* end = nullptr;
  std::strtod(text.c_str(), &end);  // inf and nan, too
  return text.starts_with('=') || (end != text.c_str() && *end == '\0') ||
         (at < text.size() && text[at] >= '0' && text[at] <= '9');
}

class TableReader {
 public:
  TableReader(const View& view, const std::string& key, std::size_t columns, const ColumnUse& holds)
      : view_(view), key_(key), holds_(holds), expected_(columns) {}

  NumberTable read(const std::string& path) {
    std::string text;
    try {
      text = read_text(path);
    } catch (const InputError& e) {
      view_.problem(key_, e.problems()[0].rule, e.problems()[0].remedy);
      return {};
    }
    separator_ = table_separator(text);
    std::istringstream in(text);
    std::string line;
    for (line_ = 1; std::getline(in, line); ++line_) {
      if (is_blank_row(line)) continue;
      if (std::ranges::count(line, '"') % 2 != 0) {
        refuse(
            fmt::format("line {} of the file has a quote that does not end: {}", line_, line.substr(0, 80)));
        return {};
      }
      if (!take(table_cells(line, separator_))) return {};
    }
    if (table_.rows.empty()) view_.problem(key_, "the file holds no rows of numbers", remedy);
    return std::move(table_);
  }

 private:
  bool take(const std::vector<TableCell>& cells) {
    std::vector<double> row;
    for (const TableCell& cell : cells) {
      std::string error;
      const std::string number = with_decimal_point(cell, separator_);
      const auto value = is_bare_number(number) ? parse_quantity(number, error) : std::nullopt;
      if (!value) break;
      row.push_back(value->value);
    }
    if (row.empty() && table_.rows.empty() && !begins_a_number(cells[0].text)) return take_names(cells);
    if (row.size() < cells.size())
      return refuse(
          fmt::format("line {} of the file: \"{}\" is not a number", line_, cells[row.size()].text));
    if (expected_ > 0 && row.size() != expected_)
      return refuse(fmt::format(
          "line {} of the file has {} numbers where {} are expected{}", line_, row.size(), expected_,
          separator_ == ',' && row.size() > expected_ ? "; are the commas decimal ones?" : ""));
    if (!one_decimal_mark(cells)) return false;
    if (table_.rows.empty() && !settle_units()) return false;
    for (std::size_t k = 0; k < row.size() && k < factors_.size(); ++k) row[k] *= factors_[k];
    table_.rows.push_back(std::move(row));
    table_.lines.push_back(line_);
    return true;
  }

  /// A row of text: names of columns with or without units, or units alone, which may stand below the names.
  bool take_names(const std::vector<TableCell>& cells) {
    if (expected_ == 0) expected_ = cells.size();
    if (!table_.header.empty() || !units_.empty()) return take_units(cells);
    std::string error;
    const bool units_alone = std::all_of(cells.begin(), cells.end(), [&](const TableCell& cell) {
      return unit_by_text(unit_in(cell), error).has_value();
    });
    if (units_alone && (fit(cells) || holds_a_bare_unit(cells))) return take_units(cells);
    if (units_alone && cells.size() == 1 && is_no_name(cells[0]))
      return refuse(
          fmt::format("line {} of the file, \"{}\", is a unit, and not of the column, which is {}; if it is "
                      "the column's name, write the unit behind it: {} [{}]",
                      line_, cells[0].text, describe(*holds_(0, "").dimension), unit_in(cells[0]),
                      unit_name(*holds_(0, "").dimension)));
    if (units_alone && cells.size() > 1)
      return refuse(
          fmt::format("line {} of the file holds units of other quantities than the columns, which "
                      "are {}",
                      line_, columns_text(cells.size())));
    for (const TableCell& cell : cells) {
      std::string problem;
      const auto heading = read_heading(
          cell.text, [&](const std::string& name) { return holds_(units_.size(), name); }, problem);
      if (!heading) return refuse(fmt::format("line {} of the file: {}", line_, problem));
      table_.header.push_back(heading->name);
      units_.push_back(heading->unit);
    }
    return true;
  }

  /// A row of units: all of columns that are read must be known.
  bool take_units(const std::vector<TableCell>& cells) {
    if (std::any_of(units_.begin(), units_.end(), [](const std::string& unit) { return !unit.empty(); }))
      return refuse(fmt::format("line {} of the file is text below the units of the columns: \"{}\"", line_,
                                cells[0].text));
    units_.clear();
    for (const TableCell& cell : cells) {
      std::string error;
      const std::string unit = unit_in(cell);
      const bool known = unit_by_text(unit, error).has_value();
      if (!known && holds_(units_.size(), column(units_.size())).read)
        return refuse(fmt::format("line {} of the file, below the names of the columns: {}", line_, error));
      units_.push_back(known ? unit : "");
    }
    return true;
  }

  /// "m" of a cell "m", "[m]" or "(m)".
  static std::string unit_in(const TableCell& cell) {
    const NameAndUnit parts = name_and_unit(cell.text);
    return parts.name.empty() ? parts.unit : cell.text;
  }

  /// Cells are units of what the columns hold: a first row of them is no row of names.
  bool fit(const std::vector<TableCell>& cells) const {
    for (std::size_t k = 0; k < cells.size(); ++k) {
      std::string error;
      if (holds_(k, "").dimension != unit_by_text(unit_in(cells[k]), error)->dimension) return false;
    }
    return true;
  }

  /// True for a unit of another kind than that of its column, and no name with the column's: "kg" over
  /// volumes, but not "m / kg" over masses.
  bool is_no_name(const TableCell& cell) const {
    const auto holds = [this](const std::string& name) { return holds_(0, name); };
    const std::optional<Dimension> of = holds("").dimension;
    std::string problem, error;
    const auto heading = read_heading(cell.text, holds, problem);
    const auto unit = heading && !heading->name.empty() && !heading->unit.empty()
                          ? unit_by_text(heading->unit, error)
                          : std::nullopt;
    return of && !(unit && unit->dimension == *of);
  }

  /// One cell that is a unit and hardly a name, of a column that may hold several kinds of quantities.
  bool holds_a_bare_unit(const std::vector<TableCell>& cells) const {
    const ColumnHolds of = holds_(0, "");
    return cells.size() == 1 && of.read && !of.dimension && !may_be_name(cells[0].text);
  }

  std::string column(std::size_t k) const {
    return k < table_.header.size() ? table_.header[k] : fmt::format("column {}", k + 1);
  }

  std::string columns_text(std::size_t count) const {
    std::vector<std::string> texts;
    for (std::size_t k = 0; k < count; ++k)
      if (const auto of = holds_(k, "").dimension) texts.push_back(describe(*of));
    return fmt::format("{}", fmt::join(texts, "; "));
  }

  bool settle_units() {
    for (std::size_t k = 0; k < units_.size(); ++k) {
      std::string error;
      const Quantity unit =
          units_[k].empty() ? Quantity{1, {}} : unit_by_text(units_[k], error).value_or(Quantity{1, {}});
      factors_.push_back(unit.value);
      table_.units.push_back(unit.dimension);
      const std::string name = column(k);
      const auto holds = holds_(k, name).dimension;
      if (unit.dimension.none() || !holds || *holds == unit.dimension ||
          (*holds == dimension::angular_velocity && unit.dimension == dimension::rate &&
           !counts_turns(units_[k])))
        continue;
      return refuse(
          fmt::format("the file gives {} in {}: {} is {}", name, units_[k], name, describe(*holds)));
    }
    return true;
  }

  /// Where commas are decimal ones, a point groups digits: 1.500 is fifteen hundred there.
  bool one_decimal_mark(const std::vector<TableCell>& cells) {
    for (const TableCell& cell : cells) {
      if (cell.text.find(',') != std::string::npos && comma_.empty()) comma_ = cell.text;
      if (cell.text.find('.') != std::string::npos && point_.empty()) point_ = cell.text;
    }
    return comma_.empty() || point_.empty() ||
           refuse(fmt::format("the file has decimal commas in some numbers and points in others: {} and {}",
                              comma_, point_));
  }

  bool refuse(const std::string& rule) {
    view_.problem(key_, rule, remedy);
    return false;
  }

  const View& view_;
  const std::string& key_;
  const ColumnUse& holds_;
  std::size_t expected_;
  char separator_ = ',';
  int line_ = 0;
  std::vector<std::string> units_;
  std::vector<double> factors_;
  std::string comma_, point_;  // first numbers with either
  NumberTable table_;
};

}  // namespace

NumberTable read_numbers(const View& view, const std::string& key, const std::string& path,
                         std::size_t columns, const ColumnUse& holds) {
  return TableReader(view, key, columns, holds).read(path);
}

}  // namespace talus::scene

/// Tables of text as spreadsheets and other programs write them: columns separated by commas, semicolons or
/// tabs, numbers with decimal points or decimal commas, cells in quotes [RFC 4180].
///
/// Where a table has semicolons or tabs these separate its columns, and a comma in a number is a decimal one;
/// so is the comma within a cell in quotes, unless it may as well set thousands apart ("1,000"), which
/// readers refuse. In all other tables commas separate the columns: a decimal comma there shows as one number
/// too many in its line, which readers refuse as well.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/units.hpp"

namespace talus {

struct TableCell {
  std::string text;     ///< without quotes and blanks around
  int column = 1;       ///< of its first character in the line, from 1
  bool quoted = false;  ///< stood in quotes
};

/// ';', '\t' or ',': what keeps the columns of a table apart. Lines that begin with # do not count.
char table_separator(std::string_view text);

/// The cells of a line; a separator that ends the line begins no cell. At least one.
std::vector<TableCell> table_cells(std::string_view line, char separator);

/// True for a line without cells: empty, separators alone, or a comment after #.
bool is_blank_row(std::string_view line);

/// The number in a cell with a decimal point in place of its decimal comma, if that is what the comma is.
std::string with_decimal_point(const TableCell& cell, char separator);

/// True for a number without a unit, not even "%": what a cell says that leaves its unit to the first row.
bool is_bare_number(std::string_view text);

/// The name of a column and the unit in brackets behind it: "s [mm]", "F (kN)".
struct NameAndUnit {
  std::string name, unit;
  bool square = false;  ///< a unit stands in square brackets; in round ones there may be any remark
};
NameAndUnit name_and_unit(const std::string& text);

/// Names of columns for comparison: in lower case.
std::string column_name(const std::string& text);

/// Whether a column is read, and what it holds.
struct ColumnHolds {
  bool read = false;
  std::optional<Dimension> dimension;  ///< nothing: not known
};

/// The dimension and size of a unit by its text.
std::optional<Quantity> unit_by_text(const std::string& text, std::string& error);

/// True for a unit of one letter, which may as well be the name of a column: "t", "s", "m".
bool may_be_name(const std::string& unit);

/// A column's name and unit by its heading: "s [mm]", "F (kN)", "V / m3", "V in dm3", "mass_kg", "mass kg".
/// `holds` says by the name whether the column is read, and what it holds: without brackets a unit of one
/// letter counts as one where it is of that kind. Nothing, and `problem`, if the unit of a column that is
/// read is not known.
struct Heading {
  std::string name, unit;  ///< unit: empty if the heading names none
};
std::optional<Heading> read_heading(const std::string& text,
                                    const std::function<ColumnHolds(const std::string&)>& holds,
                                    std::string& problem);

}  // namespace talus

/// Tables of text as spreadsheets and other programs write them: columns separated by commas, semicolons or
/// tabs, numbers with decimal points or decimal commas, cells in quotes [RFC 4180].
///
/// Where a table has semicolons or tabs these separate its columns, and a comma in a number is a decimal one;
/// so is the comma within a cell in quotes, unless it may as well set thousands apart ("1,000"), which
/// readers refuse. In all other tables commas separate the columns: a decimal comma there shows as one number
/// too many in its line, which readers refuse as well.
#pragma once
#include <string>
#include <string_view>
#include <vector>

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

/// The name of a column and the unit in brackets behind it: "s [mm]", "F (kN)".
struct NameAndUnit {
  std::string name, unit;
  bool square = false;  ///< a unit stands in square brackets; in round ones there may be any remark
};
NameAndUnit name_and_unit(const std::string& text);

/// Names of columns for comparison: in lower case.
std::string column_name(const TableCell& cell);

}  // namespace talus

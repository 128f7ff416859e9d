/// Fields of structures in the journal. They come in parts, and no more than a part is ever held: each column
/// (all displacements, all stresses) is a sequence of records, which whoever writes a file of it reads one
/// after the other.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "contact/structures/structure.hpp"
#include "io/journal.hpp"

namespace talus::io {

enum class ColumnOf { node, cell, bar, point };
enum class ColumnType { f64, f32, i32 };

struct FieldColumn {
  const char* name;
  const char* unit;
  const char* description;
  ColumnOf of;
  std::size_t width;  // numbers per row
  ColumnType type;
  std::size_t bytes() const { return width * (type == ColumnType::f64 ? 8 : 4); }  // of a row
};

/// Those of the shape first: nodes, hexes, bars. What varies is of single precision.
constexpr std::size_t column_count = 13, shape_columns = 3;
constexpr std::size_t nodes_column = 0, hexes_column = 1, bars_column = 2, points_column = 9;
extern const std::array<FieldColumn, column_count> field_columns;

/// The fields of a structure at an instant: where in the journal they are. Those that are as at the instant
/// before are where those are.
struct StructureField {
  struct Range {
    std::uint64_t begin = 0, end = 0;
    bool operator==(const Range&) const = default;
  };
  Range shape, values;
  std::array<std::uint64_t, column_count> rows{}, crc{};
  const Range& range(std::size_t column) const { return column < shape_columns ? shape : values; }
  std::uint64_t count(ColumnOf of) const;
  /// Whether there is a row for each node, cell or bar, and any.
  bool has(std::size_t column) const;
  bool operator==(const StructureField&) const = default;
};

/// Writes the fields to the journal, but what `before` has as well.
StructureField append_fields(JournalWriter& journal, const Structure::Fields& source,
                             const StructureField& before);

/// Calls with the rows of a column, a part at a time. Throws std::out_of_range if the journal has not as many
/// as it should have.
void read_column(const std::filesystem::path& journal, const StructureField& field, std::size_t column,
                 const std::function<void(std::string_view)>& take);

}  // namespace talus::io

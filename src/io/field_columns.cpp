#include "io/field_columns.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include "io/checksum.hpp"

namespace talus::io {

const std::array<FieldColumn, column_count> field_columns{{
    {"nodes", "m", "reference positions", ColumnOf::node, 3, ColumnType::f64},
    {"hexes", "1", "live cells, VTK order", ColumnOf::cell, 8, ColumnType::i32},
    {"bars", "1", "reinforcement: rows of bar_points", ColumnOf::bar, 2, ColumnType::i32},
    {"displacement", "m", "displacement", ColumnOf::node, 3, ColumnType::f32},
    {"velocity", "m/s", "velocity", ColumnOf::node, 3, ColumnType::f32},
    {"damage_tension", "1", "damage_tension", ColumnOf::cell, 1, ColumnType::f32},
    {"damage_compression", "1", "damage_compression", ColumnOf::cell, 1, ColumnType::f32},
    {"stress_von_mises", "Pa", "stress_von_mises", ColumnOf::cell, 1, ColumnType::f32},
    {"crack_width", "m", "crack_width", ColumnOf::cell, 1, ColumnType::f32},
    {"bar_points", "m", "scene coordinates", ColumnOf::point, 3, ColumnType::f64},
    {"bar_strain", "1", "axial strain", ColumnOf::bar, 1, ColumnType::f32},
    {"bar_stress", "Pa", "axial stress", ColumnOf::bar, 1, ColumnType::f32},
    {"bar_state", "1", "0 elastic, 1 has yielded, 2 broken", ColumnOf::bar, 1, ColumnType::f32},
}};

namespace {

template <class T>
std::string_view bytes_of(const std::vector<T>& list) {
  return {reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T)};
}

/// Calls with the number of each column of which the part has rows, and their bytes.
template <class F>
void each_column(const Structure::Snapshot& s, F&& f) {
  const auto exact = [&](std::size_t column, const auto& list) {
    if (!list.empty()) f(column, bytes_of(list));
  };
  const auto narrow = [&](std::size_t column, const auto& list) {
    const auto* const from = reinterpret_cast<const double*>(list.data());
    const std::vector<float> values(from, from + list.size() * sizeof(list[0]) / sizeof(double));
    exact(column, values);
  };
  exact(nodes_column, s.nodes), exact(hexes_column, s.hexes), exact(bars_column, s.bars);
  std::size_t column = shape_columns;
  for (const auto* list : {&s.displacement, &s.velocity}) narrow(column++, *list);
  for (const auto* list : {&s.damage_tension, &s.damage_compression, &s.stress_von_mises, &s.crack_width})
    narrow(column++, *list);
  exact(column++, s.bar_points);
  for (const auto* list : {&s.bar_strain, &s.bar_stress, &s.bar_state}) narrow(column++, *list);
}

/// Appends all parts; takes them back if they are those of `before`.
StructureField::Range append(JournalWriter& journal,
                             const std::function<void(const Structure::TakePart&)>& source, std::size_t first,
                             std::size_t last, const StructureField& before, StructureField& now) {
  StructureField::Range range{journal.position(), 0};
  source([&](const Structure::Snapshot& part) {
    each_column(part, [&](std::size_t column, std::string_view bytes) {
      if (column < first || column >= last) return;
      journal.append(RecordKind::column, bytes, static_cast<std::uint32_t>(column));
      now.rows[column] += bytes.size() / field_columns[column].bytes();
      now.crc[column] = crc64(bytes, now.crc[column]);
    });
  });
  range.end = journal.position();
  const StructureField::Range& old = first == 0 ? before.shape : before.values;
  bool same = old.end > 0;
  for (std::size_t c = first; c < last; ++c)
    same = same && now.rows[c] == before.rows[c] && now.crc[c] == before.crc[c];
  if (!same) return range;
  journal.take_back(range.begin);
  return old;
}

}  // namespace

std::uint64_t StructureField::count(ColumnOf of) const {
  return rows[of == ColumnOf::node   ? nodes_column
              : of == ColumnOf::cell ? hexes_column
              : of == ColumnOf::bar  ? bars_column
                                     : points_column];
}

bool StructureField::has(std::size_t column) const {
  return rows[column] > 0 && rows[column] == count(field_columns[column].of);
}

StructureField append_fields(JournalWriter& journal, const Structure::Fields& source,
                             const StructureField& before) {
  StructureField now;
  now.shape = append(journal, source.shape, 0, shape_columns, before, now);
  now.values = append(journal, source.values, shape_columns, column_count, before, now);
  return now;
}

void read_column(const std::filesystem::path& journal, const StructureField& field, std::size_t column,
                 const std::function<void(std::string_view)>& take) {
  const StructureField::Range& range = field.range(column);
  JournalReader reader(journal, range.end);
  reader.seek(range.begin);
  std::uint64_t rows = 0;
  RecordKind kind;
  const auto wanted = static_cast<std::uint32_t>(column);
  for (std::string bytes; rows < field.rows[column] && reader.next(kind, bytes, &wanted);) {
    if (kind != RecordKind::column || bytes.size() % field_columns[column].bytes() != 0) continue;
    rows += bytes.size() / field_columns[column].bytes();
    take(bytes);
  }
  if (rows != field.rows[column]) throw std::out_of_range("a field has not as many rows as it says");
}

}  // namespace talus::io

#include "fem/discretisation/division.hpp"

#include <algorithm>
#include <array>

namespace talus::fem {

long Division::count_of(long count) const {
  auto value = static_cast<double>(count);
  sum({&value, 1});
  return static_cast<long>(value);
}

std::vector<int> Division::joined(const std::vector<int>& cells) const {
  std::vector<int> all = cells;
  if (partition) {
    std::vector<double> mine;
    for (const int cell : cells) mine.push_back(partition->whole_cell(cell));
    const std::vector<double> values = partition->collect(mine);
    all.assign(values.begin(), values.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<double> Division::of_cells(const std::vector<int>& cells, std::size_t width,
                                       const std::function<void(int, double*)>& write) const {
  std::vector<double> values(width * cells.size(), 0.0);
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (const int cell = cell_here(cells[k]); cell >= 0 && own_cell(cell)) write(cell, &values[width * k]);
  sum(values);
  return values;
}

void Division::share(AlignedVector& u, AlignedVector& v) {
  if (!partition) return;
  std::size_t n = 0;
  const auto three = [](auto& field, std::size_t node) { return &field[4 * node]; };
  partition->each(
      Of::nodes, 6,
      [&](int node, double* to) {
        for (const AlignedVector* field : {&u, &v})
          to = std::copy_n(three(*field, static_cast<std::size_t>(node)), 3, to);
      },
      [&](std::span<const double> rows) {
        for (const double* from = rows.data(); from != rows.data() + rows.size(); ++n)
          for (AlignedVector* field : {&u, &v}) std::copy_n(from, 3, three(*field, n)), from += 3;
      });
}

void Division::each(Of of, int width, const WriteRow& write, const TakeRows& take) const {
  partition ? partition->each(of, width, write, take) : rows_of(held(of), width, write, take);
}

void Division::save(std::vector<double>& state, bool here, Of of, int width, const WriteRow& write) const {
  const TakeRows take = [&](std::span<const double> rows) {
    if (here || first_rank()) state.insert(state.end(), rows.begin(), rows.end());
  };
  here ? rows_of(held(of), width, write, take) : each(of, width, write, take);
}

Division::Saved Division::saved(StateReader& state, bool here, Of of, std::size_t width) const {
  const std::size_t in_all = of == Of::nodes ? nodes_in_all() : cells_in_all();
  const double* const first = state.take(width * (here ? held(of) : in_all));
  return [=, this](int k) {
    const int row = here ? k : of == Of::nodes ? whole_node(k) : whole_cell(k);
    return first + width * static_cast<std::size_t>(row);
  };
}

}  // namespace talus::fem

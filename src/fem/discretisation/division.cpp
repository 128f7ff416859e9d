#include "fem/discretisation/division.hpp"

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
  const std::array<AlignedVector*, 2> fields{&u, &v};
  partition->gather(fields);
}

}  // namespace talus::fem

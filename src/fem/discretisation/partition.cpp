#include "fem/discretisation/partition.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace talus::fem {
namespace {

/// An axis whose extent is at least this share of the longest is as good.
constexpr double as_long = 0.75;

/// Number of runs of consecutive numbers.
std::size_t runs(std::vector<int> numbers) {
  std::sort(numbers.begin(), numbers.end());
  std::size_t count = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) count += i == 0 || numbers[i] != numbers[i - 1] + 1;
  return count;
}

/// Gives `nodes` to the ranks [first, first + count), by halves across their longest extent; of several as
/// long, the one that leaves the longest pieces of memory.
void bisect(const HexMesh& mesh, const std::vector<double>& cost, std::vector<int> nodes, int first,
            int count, std::vector<int>& owner) {
  if (count == 1) {
    for (int n : nodes) owner[n] = first;
    return;
  }
  Box3 box;
  double total = 0;
  for (int n : nodes) box.extend(mesh.nodes[n]), total += cost[n];
  const int low = count / 2;
  std::array<std::vector<int>, 2> best;
  std::size_t fewest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (box.sizes()[axis] < as_long * box.sizes().maxCoeff()) continue;
    std::sort(nodes.begin(), nodes.end(), [&](int a, int b) {
      const double x = mesh.nodes[a][axis], y = mesh.nodes[b][axis];
      return x != y ? x < y : a < b;
    });
    auto cut = nodes.begin();
    for (double sum = 0; cut != nodes.end() && sum + 0.5 * cost[*cut] < total * low / count; ++cut)
      sum += cost[*cut];
    const std::array<std::vector<int>, 2> halves{std::vector<int>(nodes.begin(), cut),
                                                 std::vector<int>(cut, nodes.end())};
    const std::size_t pieces = runs(halves[0]);
    if (fewest == 0 || pieces < fewest) fewest = pieces, best = halves;
  }
  bisect(mesh, cost, std::move(best[0]), first, low, owner);
  bisect(mesh, cost, std::move(best[1]), first + low, count - low, owner);
}

}  // namespace

std::vector<NodeRange> ranges_of(const std::vector<char>& in) {
  std::vector<NodeRange> list;
  for (int n = 0; n < static_cast<int>(in.size()); ++n) {
    if (!in[n]) continue;
    if (!list.empty() && list.back().second == n)
      ++list.back().second;
    else
      list.emplace_back(n, n + 1);
  }
  return list;
}

void rows_of(std::size_t count, int width, const WriteRow& write, const TakeRows& take) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<double> rows;
  for (std::size_t begin = 0; begin < count; begin += rows_at_once) {
    const std::size_t end = std::min(begin + rows_at_once, count);
    rows.assign(w * (end - begin), 0.0);
    for (std::size_t i = begin; i < end; ++i) write(static_cast<int>(i), &rows[w * (i - begin)]);
    take(rows);
  }
}

Partition::Partition(const HexMesh& whole, const std::vector<int>& common, const std::vector<double>& cost,
                     bool everywhere, Ranks& ranks)
    : RankTables(ranks),
      me_(ranks.rank()),
      nodes_in_all_(whole.nodes.size()),
      cells_in_all_(whole.hexes.size()) {
  std::vector<int> owner(nodes_in_all_), nodes(nodes_in_all_);
  std::iota(nodes.begin(), nodes.end(), 0);
  bisect(whole, cost, std::move(nodes), 0, ranks.size(), owner);
  const auto count = static_cast<std::size_t>(ranks.size());
  send_.resize(count), receive_.resize(count), outgoing_.resize(count), incoming_.resize(count);
  std::vector<char> held(nodes_in_all_, everywhere), border(nodes_in_all_, 0), computed(cells_in_all_, 0),
      kept(cells_in_all_, everywhere);
  for (const int cell : common) kept[static_cast<std::size_t>(cell)] = 1;
  // Every rank finds the borders of all, so that sender and receiver list the same nodes in the same order.
  for (int r = 0; r < ranks.size(); ++r) {
    std::vector<char> needed(nodes_in_all_, 0);
    for (const int cell : common)
      for (const int n : whole.hexes[static_cast<std::size_t>(cell)]) needed[n] = 1;
    long cells = 0;
    for (std::size_t cell = 0; cell < cells_in_all_; ++cell) {
      const auto& hex = whole.hexes[cell];
      if (std::none_of(hex.begin(), hex.end(), [&](int n) { return owner[n] == r; })) continue;
      if (r == me_) computed[cell] = 1;
      ++cells;
      for (int n : hex) needed[n] = 1;
    }
    cells_per_rank_.push_back(cells);
    for (std::size_t n = 0; n < needed.size(); ++n) {
      if (r == me_ && needed[n]) held[n] = 1;
      if (!needed[n] || owner[n] == r) continue;
      if (r == me_)
        receive_[owner[n]].push_back(static_cast<int>(n)), border[n] = 1;
      else if (owner[n] == me_)
        send_[r].push_back(static_cast<int>(n));
    }
  }
  for (std::size_t cell = 0; cell < cells_in_all_; ++cell) {
    if (!kept[cell] && !computed[cell]) continue;
    cell_number_.push_back(static_cast<int>(cell));
    local_cells_.push_back(computed[cell]);
    own_cells_.push_back(owner[whole.hexes[cell][0]] == me_);
  }
  std::vector<char> own, at_border;
  for (std::size_t n = 0; n < nodes_in_all_; ++n) {
    if (!held[n]) continue;
    node_number_.push_back(static_cast<int>(n));
    owner_.push_back(owner[n]);
    own.push_back(owner[n] == me_);
    at_border.push_back(border[n]);
  }
  own_nodes_ = ranges_of(own);
  border_nodes_ = ranges_of(at_border);
  for (auto* lists : {&send_, &receive_})
    for (std::vector<int>& list : *lists) list = nodes_here(list);
}

HexMesh Partition::part_of(const HexMesh& whole) const {
  HexMesh part;
  part.nodes.reserve(node_number_.size()), part.local.reserve(node_number_.size());
  part.hexes.reserve(cell_number_.size());
  std::vector<int> number(nodes_in_all_, -1);
  for (std::size_t n = 0; n < node_number_.size(); ++n) {
    const auto from = static_cast<std::size_t>(node_number_[n]);
    number[from] = static_cast<int>(n);
    part.nodes.push_back(whole.nodes[from]);
    part.local.push_back(whole.local[from]);
  }
  for (const int from : cell_number_) {
    std::array<int, 8> hex = whole.hexes[from];
    for (int& n : hex) n = number[n];
    part.hexes.push_back(hex);
    if (!whole.component.empty()) part.component.push_back(whole.component[from]);
    if (!whole.number.empty()) part.number.push_back(whole.number[from]);
  }
  for (const auto& [name, nodes] : whole.node_groups) part.node_groups[name] = nodes_here(nodes);
  part.remark = whole.remark;
  return part;
}

int Partition::here(const std::vector<int>& numbers, int whole) {
  const auto at = std::lower_bound(numbers.begin(), numbers.end(), whole);
  return at == numbers.end() || *at != whole ? -1 : static_cast<int>(at - numbers.begin());
}

std::vector<int> Partition::nodes_here(const std::vector<int>& whole) const {
  std::vector<int> list;
  for (const int n : whole)
    if (const int at = node_here(n); at >= 0) list.push_back(at);
  return list;
}

std::vector<int> Partition::cells_here(const std::vector<int>& whole) const {
  std::vector<int> list;
  for (const int cell : whole)
    if (const int at = cell_here(cell); at >= 0) list.push_back(at);
  return list;
}

void Partition::exchange(AlignedVector& field) {
  exchange(
      3, [&](int n, double* to) { std::copy_n(&field[4 * static_cast<std::size_t>(n)], 3, to); },
      [&](int n, const double* from) { std::copy_n(from, 3, &field[4 * static_cast<std::size_t>(n)]); });
}

void RankTables::each(const std::vector<int>& numbers, std::size_t in_all,
                      const std::function<bool(int)>& own, int width, const WriteRow& write,
                      const TakeRows& take) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<double> mine, values;
  std::size_t next = 0;
  for (std::size_t begin = 0; begin < in_all; begin += rows_at_once) {
    const std::size_t end = std::min(begin + rows_at_once, in_all);
    mine.clear();
    for (; next < numbers.size() && static_cast<std::size_t>(numbers[next]) < end; ++next) {
      if (!own(static_cast<int>(next))) continue;
      mine.push_back(numbers[next]);
      mine.resize(mine.size() + w);
      write(static_cast<int>(next), mine.data() + mine.size() - w);
    }
    const std::vector<double> all = collect(mine);
    values.resize(w * (end - begin));
    for (std::size_t at = 0; at < all.size(); at += w + 1)
      std::copy_n(&all[at + 1], w, &values[w * (static_cast<std::size_t>(all[at]) - begin)]);
    take(values);
  }
}

void Partition::each(Of of, int width, const WriteRow& write, const TakeRows& take) {
  const bool nodes = of == Of::nodes;
  RankTables::each(
      nodes ? node_number_ : cell_number_, nodes ? nodes_in_all_ : cells_in_all_,
      [&](int k) { return nodes ? owns_node(k) : owns_cell(k); }, width, write, take);
}

std::vector<double> RankTables::collect_at_first(std::span<const double> mine) {
  const auto count = static_cast<double>(mine.size());
  const std::vector<double> counts = collect({&count, 1});
  std::vector<std::vector<double>> send(counts.size()), receive(counts.size());
  if (!first_rank()) send[0].assign(mine.begin(), mine.end());
  for (std::size_t r = 1; r < counts.size() && first_rank(); ++r)
    receive[r].resize(static_cast<std::size_t>(counts[r]));
  ranks_->exchange(send, receive);
  if (!first_rank()) return {};
  std::vector<double> all(mine.begin(), mine.end());
  all.reserve(static_cast<std::size_t>(std::accumulate(counts.begin(), counts.end(), 0.0)));
  for (std::vector<double>& part : receive) {
    all.insert(all.end(), part.begin(), part.end());
    std::vector<double>().swap(part);
  }
  return all;
}

std::vector<double> RankTables::records(int width, std::span<const double> mine, For whom) {
  const auto w = static_cast<std::size_t>(width);
  const std::vector<double> all = whom == For::all ? collect(mine) : collect_at_first(mine);
  std::vector<std::size_t> order(all.size() / w);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i * w;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return all[a] < all[b]; });
  std::vector<double> sorted;
  sorted.reserve(all.size());
  for (const std::size_t at : order)
    sorted.insert(sorted.end(), all.begin() + static_cast<std::ptrdiff_t>(at),
                  all.begin() + static_cast<std::ptrdiff_t>(at + w));
  return sorted;
}

void RankTables::sum(std::span<double> values) {
  const std::vector<int> count(static_cast<std::size_t>(ranks_->size()), static_cast<int>(values.size()));
  std::vector<double> all(values.size() * count.size());
  ranks_->gather(values, count, all.data());
  std::fill(values.begin(), values.end(), 0.0);
  for (std::size_t i = 0; i < all.size(); ++i) values[i % values.size()] += all[i];
}

double RankTables::largest(double value) {
  const std::vector<double> all = collect({&value, 1});
  return *std::max_element(all.begin(), all.end());
}

std::size_t Partition::memory_consumption() const {
  std::size_t bytes = (node_number_.capacity() + cell_number_.capacity() + owner_.capacity()) * sizeof(int) +
                      own_cells_.capacity() + local_cells_.capacity();
  for (const auto* lists : {&send_, &receive_})
    for (const auto& list : *lists) bytes += list.capacity() * (sizeof(int) + 3 * sizeof(double));
  return bytes;
}

WatchedNodes::WatchedNodes(std::vector<int> nodes, Partition& partition)
    : partition_(&partition), nodes_(std::move(nodes)) {
  std::vector<double> mine;
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    if (const int n = partition.node_here(nodes_[k]); n >= 0 && partition.owns_node(n))
      own_.push_back(n), mine.push_back(static_cast<double>(k));
  const double owned = static_cast<double>(own_.size());
  for (const double value : partition.collect({&owned, 1})) count_.push_back(static_cast<int>(value));
  for (const double value : partition.collect(mine)) place_.push_back(static_cast<int>(value));
  if (nodes_.empty()) return;
  place_of_.assign(static_cast<std::size_t>(nodes_.back()) + 1, -1);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    place_of_[static_cast<std::size_t>(nodes_[i])] = static_cast<int>(i);
}

int WatchedNodes::place(int whole) const {
  const auto n = static_cast<std::size_t>(whole);
  return n < place_of_.size() ? place_of_[n] : -1;
}

void WatchedNodes::gather(std::span<const AlignedVector* const> fields, std::vector<double>& values) const {
  const std::size_t width = 3 * fields.size();
  std::vector<double> mine, all(width * nodes_.size());
  mine.reserve(width * own_.size());
  for (const int n : own_)
    for (const AlignedVector* field : fields)
      mine.insert(mine.end(), &(*field)[4 * static_cast<std::size_t>(n)],
                  &(*field)[4 * static_cast<std::size_t>(n)] + 3);
  std::vector<int> count(count_);
  for (int& c : count) c *= static_cast<int>(width);
  partition_->collect(mine, count, all.data());
  values.resize(all.size());
  for (std::size_t i = 0; i < place_.size(); ++i)
    std::copy_n(&all[width * i], width, &values[width * static_cast<std::size_t>(place_[i])]);
}

}  // namespace talus::fem

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

/// Gives `nodes` to the ranks [first, first + count), by halves across their longest extent; of several as long, the one that leaves the
/// longest pieces of memory.
void bisect(const HexMesh& mesh, const std::vector<double>& cost, std::vector<int> nodes, int first, int count, std::vector<int>& owner) {
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
    for (double sum = 0; cut != nodes.end() && sum + 0.5 * cost[*cut] < total * low / count; ++cut) sum += cost[*cut];
    const std::array<std::vector<int>, 2> halves{std::vector<int>(nodes.begin(), cut), std::vector<int>(cut, nodes.end())};
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
    if (!list.empty() && list.back().second == n) ++list.back().second;
    else list.emplace_back(n, n + 1);
  }
  return list;
}

Partition::Partition(const HexMesh& mesh, const std::vector<int>& common, const std::vector<double>& cost, Ranks& ranks)
    : ranks_(&ranks), me_(ranks.rank()), owner_(mesh.nodes.size()), own_cells_(mesh.hexes.size()), local_cells_(mesh.hexes.size()) {
  std::vector<int> nodes(mesh.nodes.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  bisect(mesh, cost, std::move(nodes), 0, ranks.size(), owner_);
  const auto count = static_cast<std::size_t>(ranks.size());
  send_.resize(count), receive_.resize(count), outgoing_.resize(count), incoming_.resize(count);
  std::vector<char> own(owner_.size()), border(owner_.size(), 0);
  for (std::size_t n = 0; n < owner_.size(); ++n) own[n] = owner_[n] == me_;
  own_nodes_ = ranges_of(own);
  // Every rank finds the borders of all, so that sender and receiver list the same nodes in the same order.
  for (int r = 0; r < ranks.size(); ++r) {
    std::vector<char> needed(owner_.size(), 0);
    for (int n : common) needed[n] = 1;
    long cells = 0;
    for (std::size_t cell = 0; cell < mesh.hexes.size(); ++cell) {
      const auto& hex = mesh.hexes[cell];
      const bool local = std::any_of(hex.begin(), hex.end(), [&](int n) { return owner_[n] == r; });
      if (r == me_) local_cells_[cell] = local, own_cells_[cell] = owner_[hex[0]] == me_;
      if (!local) continue;
      ++cells;
      for (int n : hex) needed[n] = 1;
    }
    cells_per_rank_.push_back(cells);
    for (std::size_t n = 0; n < needed.size(); ++n) {
      if (!needed[n] || owner_[n] == r) continue;
      if (r == me_) receive_[owner_[n]].push_back(static_cast<int>(n));
      else if (owner_[n] == me_) send_[r].push_back(static_cast<int>(n));
    }
  }
  for (const auto& list : receive_)
    for (int n : list) border[n] = 1;
  border_nodes_ = ranges_of(border);
}

void Partition::exchange(AlignedVector& field) {
  for (std::size_t r = 0; r < send_.size(); ++r) {
    outgoing_[r].resize(3 * send_[r].size());
    incoming_[r].resize(3 * receive_[r].size());
    for (std::size_t i = 0; i < send_[r].size(); ++i) std::copy_n(&field[4 * static_cast<std::size_t>(send_[r][i])], 3, &outgoing_[r][3 * i]);
  }
  ranks_->exchange(outgoing_, incoming_);
  for (std::size_t r = 0; r < receive_.size(); ++r)
    for (std::size_t i = 0; i < receive_[r].size(); ++i) std::copy_n(&incoming_[r][3 * i], 3, &field[4 * static_cast<std::size_t>(receive_[r][i])]);
}

void Partition::gather(std::span<AlignedVector* const> fields, const std::vector<int>& subset) {
  std::vector<int> count(static_cast<std::size_t>(ranks_->size()), 0);
  std::vector<double> mine;
  for (int n : subset) {
    count[owner_[n]] += 3 * static_cast<int>(fields.size());
    if (owns_node(n))
      for (const AlignedVector* field : fields) mine.insert(mine.end(), &(*field)[4 * static_cast<std::size_t>(n)], &(*field)[4 * static_cast<std::size_t>(n)] + 3);
  }
  std::vector<double> all(3 * fields.size() * subset.size());
  ranks_->gather(mine, count, all.data());
  std::vector<const double*> at(count.size(), all.data());
  for (std::size_t r = 1; r < count.size(); ++r) at[r] = at[r - 1] + count[r - 1];
  for (int n : subset)
    for (AlignedVector* field : fields) {
      std::copy_n(at[owner_[n]], 3, &(*field)[4 * static_cast<std::size_t>(n)]);
      at[owner_[n]] += 3;
    }
}

void Partition::sum(std::span<double> values) {
  const std::vector<int> count(static_cast<std::size_t>(ranks_->size()), static_cast<int>(values.size()));
  std::vector<double> all(values.size() * count.size());
  ranks_->gather(values, count, all.data());
  std::fill(values.begin(), values.end(), 0.0);
  for (std::size_t i = 0; i < all.size(); ++i) values[i % values.size()] += all[i];
}

double Partition::largest(double value) {
  const std::vector<double> all = collect({&value, 1});
  return *std::max_element(all.begin(), all.end());
}

double Partition::repeated_share() const {
  const long all = std::accumulate(cells_per_rank_.begin(), cells_per_rank_.end(), 0L);
  return static_cast<double>(all) / static_cast<double>(local_cells_.size()) - 1;
}

}  // namespace talus::fem

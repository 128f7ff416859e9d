#include "contact/solver_linear.hpp"

#include <suitesparse/amd.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace talus::contact::detail {

namespace {

using Panel = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

constexpr int dense_limit = 48;       // scalar size up to which one front is used
constexpr int supernode_limit = 36;   // pivots beyond which relaxed amalgamation stops

using Buffer = std::vector<double, Eigen::aligned_allocator<double>>;

// In-place LU of the first k columns and rows of the m x m front F; the rest becomes the Schur complement.
bool partial_lu(double* F, int m, int k, int* pivot_row, Buffer& upper) {
  for (int j = 0; j < k; ++j) {
    double* cj = F + static_cast<std::size_t>(j) * m;
    int best = j;
    for (int i = j + 1; i < k; ++i)
      if (std::abs(cj[i]) > std::abs(cj[best])) best = i;
    pivot_row[j] = best;
    if (!(std::abs(cj[best]) > 0) || !std::isfinite(cj[best])) return false;
    if (best != j)
      for (int c = 0; c < m; ++c) std::swap(F[static_cast<std::size_t>(c) * m + j], F[static_cast<std::size_t>(c) * m + best]);
    const double inverse = 1 / cj[j];
    for (int i = j + 1; i < m; ++i) cj[i] *= inverse;
    for (int c = j + 1; c < k; ++c) {
      double* cc = F + static_cast<std::size_t>(c) * m;
      const double x = cc[j];
      if (x == 0) continue;
      for (int i = j + 1; i < m; ++i) cc[i] -= cj[i] * x;
    }
  }
  if (k == m) return true;
  const int r = m - k;
  // Rows of the upper part become contiguous columns of its transpose.
  upper.resize(static_cast<std::size_t>(r) * k);
  double* U = upper.data();
  for (int c = 0; c < r; ++c) {
    const double* cc = F + static_cast<std::size_t>(k + c) * m;
    for (int j = 0; j < k; ++j) U[static_cast<std::size_t>(j) * r + c] = cc[j];
  }
  for (int j = 0; j < k; ++j) {
    const double* cj = F + static_cast<std::size_t>(j) * m;
    const double* uj = U + static_cast<std::size_t>(j) * r;
    for (int i = j + 1; i < k; ++i) {
      const double x = cj[i];
      if (x == 0) continue;
      double* ui = U + static_cast<std::size_t>(i) * r;
      for (int c = 0; c < r; ++c) ui[c] -= x * uj[c];
    }
  }
  for (int c = 0; c < r; ++c) {
    double* cc = F + static_cast<std::size_t>(k + c) * m;
    for (int j = 0; j < k; ++j) cc[j] = U[static_cast<std::size_t>(j) * r + c];
  }
  Panel lower(F + k, r, k, Eigen::OuterStride<>(m));
  Panel transposed(U, r, k, Eigen::OuterStride<>(r));
  Panel rest(F + static_cast<std::size_t>(k) * m + k, r, r, Eigen::OuterStride<>(m));
  if (r <= 12)
    rest.noalias() -= lower.lazyProduct(transposed.transpose());
  else
    rest.noalias() -= lower * transposed.transpose();
  return true;
}

}  // namespace

void BlockLU::analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& pairs) {
  if (sizes == sizes_ && pairs == pairs_) return;
  sizes_ = sizes;
  pairs_ = pairs;
  const int nb = static_cast<int>(sizes_.size());
  offsets_.resize(nb + 1);
  offsets_[0] = 0;
  diagonal_.resize(nb);
  std::size_t at = 0;
  for (int a = 0; a < nb; ++a) {
    offsets_[a + 1] = offsets_[a] + sizes_[a];
    diagonal_[a] = at;
    at += static_cast<std::size_t>(sizes_[a]) * sizes_[a];
  }
  n_ = offsets_[nb];
  upper_.resize(pairs_.size());
  lower_.resize(pairs_.size());
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const std::size_t count = static_cast<std::size_t>(sizes_[pairs_[p].first]) * sizes_[pairs_[p].second];
    upper_[p] = at;
    lower_[p] = at + count;
    at += 2 * count;
  }
  values_.resize(at);
  fronts_.clear();
  front_body_.clear();
  front_offset_.clear();
  entries_.clear();
  if (n_ <= dense_limit) {
    Front f;
    f.bodies = f.pivot_bodies = nb;
    f.pivots = f.size = n_;
    for (int a = 0; a < nb; ++a) {
      front_body_.push_back(a);
      front_offset_.push_back(offsets_[a]);
      entries_.push_back({diagonal_[a], sizes_[a], sizes_[a], offsets_[a], offsets_[a]});
    }
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      const auto [a, b] = pairs_[p];
      entries_.push_back({upper_[p], sizes_[a], sizes_[b], offsets_[a], offsets_[b]});
      entries_.push_back({lower_[p], sizes_[b], sizes_[a], offsets_[b], offsets_[a]});
    }
    f.entries = static_cast<int>(entries_.size());
    fronts_.push_back(f);
    factor_.resize(static_cast<std::size_t>(n_) * n_);
    pivot_rows_.resize(n_);
    front_.resize(static_cast<std::size_t>(n_) * n_);
    local_.resize(n_);
    return;
  }
  std::vector<int> permutation;
  order(permutation);
  symbolic(permutation);
}

void BlockLU::order(std::vector<int>& permutation) const {
  const int nb = static_cast<int>(sizes_.size());
  std::vector<int> start(nb + 1, 0), row(2 * pairs_.size() + 1);
  for (const auto& [a, b] : pairs_) {
    ++start[a + 1];
    ++start[b + 1];
  }
  for (int a = 0; a < nb; ++a) start[a + 1] += start[a];
  std::vector<int> next(start.begin(), start.end() - 1);
  // Sorted pairs give sorted columns: smaller neighbours first (as b), then the larger (as a).
  for (const auto& [a, b] : pairs_) row[next[b]++] = a;
  for (const auto& [a, b] : pairs_) row[next[a]++] = b;
  permutation.resize(nb);
  if (amd_order(nb, start.data(), row.data(), permutation.data(), nullptr, nullptr) < 0)
    for (int a = 0; a < nb; ++a) permutation[a] = a;
}

void BlockLU::symbolic(const std::vector<int>& permutation) {
  const int nb = static_cast<int>(sizes_.size());
  std::vector<int> position(nb);
  for (int k = 0; k < nb; ++k) position[permutation[k]] = k;
  // Structure of every column in elimination order: its later neighbours and those of its children.
  std::vector<std::vector<int>> structure(nb);
  for (const auto& [a, b] : pairs_) {
    const int i = std::min(position[a], position[b]), j = std::max(position[a], position[b]);
    structure[i].push_back(j);
  }
  std::vector<int> parent(nb, -1), merged;
  std::vector<std::vector<int>> child(nb);
  for (int j = 0; j < nb; ++j) {
    auto& s = structure[j];
    std::sort(s.begin(), s.end());
    for (int c : child[j]) {
      merged.clear();
      std::set_union(s.begin(), s.end(), structure[c].begin() + 1, structure[c].end(), std::back_inserter(merged));
      s.swap(merged);
    }
    if (!s.empty()) {
      parent[j] = s.front();
      child[s.front()].push_back(j);
    }
  }
  // Postorder, so that the update matrices form a stack.
  std::vector<int> post, stack, visit(nb, 0);
  post.reserve(nb);
  for (int root = 0; root < nb; ++root) {
    if (parent[root] >= 0) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const int j = stack.back();
      if (visit[j] < static_cast<int>(child[j].size()))
        stack.push_back(child[j][visit[j]++]);
      else {
        post.push_back(j);
        stack.pop_back();
      }
    }
  }
  std::vector<int> rank(nb);
  for (int k = 0; k < nb; ++k) rank[post[k]] = k;
  auto size_at = [&](int j) { return sizes_[permutation[j]]; };
  // Relaxed supernodes: a column joins the front of its last child if that costs few explicit zeros.
  std::vector<int> front_of(nb, -1), last;
  std::vector<std::vector<int>> pivots;
  for (int k = 0; k < nb; ++k) {
    const int j = post[k];
    int join = -1;
    if (k > 0 && parent[post[k - 1]] == j) {
      const int f = front_of[post[k - 1]];
      int rest_child = 0, rest_own = size_at(j), own = 0;
      for (int i : structure[post[k - 1]]) rest_child += size_at(i);
      for (int i : structure[j]) rest_own += size_at(i);
      for (int i : pivots[f]) own += size_at(i);
      const int zeros = rest_own - rest_child;  // scalar rows added to each of the front's columns
      if (zeros == 0 || (own + size_at(j) <= supernode_limit && zeros * own <= (rest_own * (own + size_at(j))) / 4)) join = f;
    }
    if (join < 0) {
      join = static_cast<int>(pivots.size());
      pivots.emplace_back();
      last.push_back(j);
    }
    pivots[join].push_back(j);
    last[join] = j;
    front_of[j] = join;
  }
  const int nf = static_cast<int>(pivots.size());
  fronts_.resize(nf);
  place_.assign(nb, -1);
  std::size_t factor_size = 0, largest = 0;
  int pivot_total = 0, widest = 0;
  for (int f = 0; f < nf; ++f) {
    Front& front = fronts_[f];
    front = Front{};
    front.first_body = static_cast<int>(front_body_.size());
    int at = 0;
    auto put = [&](int j) {
      front_body_.push_back(permutation[j]);
      front_offset_.push_back(at);
      at += size_at(j);
    };
    for (int j : pivots[f]) put(j);
    front.pivot_bodies = static_cast<int>(pivots[f].size());
    front.pivots = at;
    for (int j : structure[last[f]]) put(j);
    front.size = at;
    front.bodies = static_cast<int>(front_body_.size()) - front.first_body;
    front.parent = parent[last[f]] < 0 ? -1 : front_of[parent[last[f]]];
    front.factor = factor_size;
    front.pivot_row = pivot_total;
    factor_size += static_cast<std::size_t>(front.size) * front.pivots +
                   static_cast<std::size_t>(front.pivots) * (front.size - front.pivots);
    pivot_total += front.pivots;
    largest = std::max(largest, static_cast<std::size_t>(front.size) * front.size);
    widest = std::max(widest, front.size);
  }
  for (int f = 0; f < nf; ++f)
    if (fronts_[f].parent >= 0) ++fronts_[fronts_[f].parent].children;
  // Every block of the matrix belongs to the front that eliminates its first body.
  std::vector<std::vector<int>> pairs_of(nf);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const int i = std::min(rank[position[pairs_[p].first]], rank[position[pairs_[p].second]]);
    pairs_of[front_of[post[i]]].push_back(static_cast<int>(p));
  }
  for (int f = 0; f < nf; ++f) {
    Front& front = fronts_[f];
    front.first_entry = static_cast<int>(entries_.size());
    for (int i = 0; i < front.bodies; ++i) place_[front_body_[front.first_body + i]] = front_offset_[front.first_body + i];
    for (int i = 0; i < front.pivot_bodies; ++i) {
      const int a = front_body_[front.first_body + i];
      entries_.push_back({diagonal_[a], sizes_[a], sizes_[a], place_[a], place_[a]});
    }
    for (int p : pairs_of[f]) {
      const auto [a, b] = pairs_[p];
      entries_.push_back({upper_[p], sizes_[a], sizes_[b], place_[a], place_[b]});
      entries_.push_back({lower_[p], sizes_[b], sizes_[a], place_[b], place_[a]});
    }
    front.entries = static_cast<int>(entries_.size()) - front.first_entry;
  }
  factor_.resize(factor_size);
  pivot_rows_.resize(pivot_total);
  front_.resize(largest);
  local_.resize(widest);
}

void BlockLU::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

bool BlockLU::factor() {
  stack_.clear();
  struct Update { int front; std::size_t at; };
  static thread_local std::vector<Update> updates;
  updates.clear();
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    const int m = front.size, k = front.pivots, r = m - k;
    double* F = front_.data();
    std::fill(F, F + static_cast<std::size_t>(m) * m, 0.0);
    for (int e = front.first_entry; e < front.first_entry + front.entries; ++e) {
      const Entry& entry = entries_[e];
      const double* from = values_.data() + entry.value;
      for (int c = 0; c < entry.cols; ++c) {
        double* to = F + static_cast<std::size_t>(entry.col + c) * m + entry.row;
        for (int i = 0; i < entry.rows; ++i) to[i] += from[c * entry.rows + i];
      }
    }
    if (front.children > 0) {
      for (int i = 0; i < front.bodies; ++i)
        place_[front_body_[front.first_body + i]] = front_offset_[front.first_body + i];
      for (int c = 0; c < front.children; ++c) {
        const Update update = updates.back();
        updates.pop_back();
        const Front& kid = fronts_[update.front];
        const int rest = kid.size - kid.pivots;
        const double* U = stack_.data() + update.at;
        for (int bc = kid.pivot_bodies; bc < kid.bodies; ++bc) {
          const int body_c = front_body_[kid.first_body + bc];
          const int to_c = place_[body_c], from_c = front_offset_[kid.first_body + bc] - kid.pivots;
          for (int br = kid.pivot_bodies; br < kid.bodies; ++br) {
            const int body_r = front_body_[kid.first_body + br];
            const int to_r = place_[body_r], from_r = front_offset_[kid.first_body + br] - kid.pivots;
            const int rows = sizes_[body_r];
            for (int j = 0; j < sizes_[body_c]; ++j) {
              double* to = F + static_cast<std::size_t>(to_c + j) * m + to_r;
              const double* from = U + static_cast<std::size_t>(from_c + j) * rest + from_r;
              if (rows == 6)
                for (int i = 0; i < 6; ++i) to[i] += from[i];
              else
                for (int i = 0; i < rows; ++i) to[i] += from[i];
            }
          }
        }
        stack_.resize(update.at);
      }
    }
    if (!partial_lu(F, m, k, pivot_rows_.data() + front.pivot_row, upper_part_)) return false;
    double* out = factor_.data() + front.factor;
    std::memcpy(out, F, sizeof(double) * static_cast<std::size_t>(m) * k);
    out += static_cast<std::size_t>(m) * k;
    if (r > 0) {
      for (int c = 0; c < r; ++c)
        std::memcpy(out + static_cast<std::size_t>(c) * k, F + static_cast<std::size_t>(k + c) * m, sizeof(double) * k);
      const std::size_t at = stack_.size();
      stack_.resize(at + static_cast<std::size_t>(r) * r);
      for (int c = 0; c < r; ++c)
        std::memcpy(stack_.data() + at + static_cast<std::size_t>(c) * r, F + static_cast<std::size_t>(k + c) * m + k,
                    sizeof(double) * r);
      updates.push_back({static_cast<int>(f), at});
    }
  }
  return true;
}

void BlockLU::solve(double* x) const {
  double* y = local_.data();
  auto gather = [&](const Front& front, int from, int to) {
    for (int b = from; b < to; ++b) {
      const int body = front_body_[front.first_body + b];
      std::memcpy(y + front_offset_[front.first_body + b], x + offsets_[body], sizeof(double) * sizes_[body]);
    }
  };
  auto scatter = [&](const Front& front, int from, int to) {
    for (int b = from; b < to; ++b) {
      const int body = front_body_[front.first_body + b];
      std::memcpy(x + offsets_[body], y + front_offset_[front.first_body + b], sizeof(double) * sizes_[body]);
    }
  };
  for (const Front& front : fronts_) {
    const int m = front.size, k = front.pivots;
    const double* L = factor_.data() + front.factor;
    gather(front, 0, front.bodies);
    for (int j = 0; j < k; ++j) std::swap(y[j], y[pivot_rows_[front.pivot_row + j]]);
    for (int j = 0; j < k; ++j) {
      const double t = y[j];
      const double* cj = L + static_cast<std::size_t>(j) * m;
      for (int i = j + 1; i < m; ++i) y[i] -= cj[i] * t;
    }
    scatter(front, 0, front.bodies);
  }
  for (auto it = fronts_.rbegin(); it != fronts_.rend(); ++it) {
    const Front& front = *it;
    const int m = front.size, k = front.pivots, r = m - k;
    const double* L = factor_.data() + front.factor;
    const double* U = L + static_cast<std::size_t>(m) * k;
    gather(front, 0, front.bodies);
    for (int c = 0; c < r; ++c) {
      const double t = y[k + c];
      const double* uc = U + static_cast<std::size_t>(c) * k;
      for (int i = 0; i < k; ++i) y[i] -= uc[i] * t;
    }
    for (int j = k - 1; j >= 0; --j) {
      const double* cj = L + static_cast<std::size_t>(j) * m;
      y[j] /= cj[j];
      const double t = y[j];
      for (int i = 0; i < j; ++i) y[i] -= cj[i] * t;
    }
    scatter(front, 0, front.pivot_bodies);
  }
}

}  // namespace talus::contact::detail

// Symbolic part of the sparse factorisation: order of the bodies, fronts, and the parts of their tree that
// threads share.
#include <suitesparse/amd.h>

#include <algorithm>

#include "contact/linear/solver_linear.hpp"

namespace talus::contact::detail {

namespace {

constexpr int dense_limit = 48;        // scalar size up to which one front is used
constexpr int supernode_limit = 36;    // pivots beyond which relaxed amalgamation stops
constexpr double work_to_share = 2e6;  // multiplications of a factorisation from which on it is parted
constexpr double share = 1.0 / 24;     // of the work, at most in one part

/// Multiplications that the pivots of a front take.
double work_of(double size, double pivots) {
  const double rest = size - pivots;
  return pivots * (rest * rest + rest * pivots + pivots * pivots / 3);
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
    part();
    return;
  }
  std::vector<int> permutation;
  order(permutation);
  symbolic(permutation);
  part();
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

/// Bodies by their place in the order of elimination, and what each column holds: its later neighbours and
/// those of its children.
struct BlockLU::Columns {
  std::vector<int> position;                // of a body
  std::vector<int> entries, begin, end;     // of column j: entries from begin[j] to end[j]
  std::vector<int> parent, child, sibling;  // children in ascending order
  std::vector<int> post, rank;              // columns so that the update matrices form a stack; its inverse
  std::vector<int> front_of, first_pivot;   // front of a column; place in `post` of a front's first pivot
};

BlockLU::Columns BlockLU::columns_of(const std::vector<int>& permutation) const {
  const int nb = static_cast<int>(sizes_.size());
  Columns c;
  c.position.resize(nb);
  for (int k = 0; k < nb; ++k) c.position[permutation[k]] = k;
  std::vector<int> first_own(nb + 1, 0), own(pairs_.size());
  const auto ends = [&](const std::pair<int, int>& p) {
    return std::minmax(c.position[p.first], c.position[p.second]);
  };
  for (const auto& p : pairs_) ++first_own[ends(p).first + 1];
  for (int j = 0; j < nb; ++j) first_own[j + 1] += first_own[j];
  std::vector<int> next(first_own.begin(), first_own.end() - 1);
  for (const auto& p : pairs_) own[next[ends(p).first]++] = ends(p).second;
  std::vector<int> seen_by(nb, -1), last_child(nb, -1);
  c.begin.resize(nb), c.end.resize(nb);
  c.parent.assign(nb, -1), c.child.assign(nb, -1), c.sibling.assign(nb, -1);
  c.entries.reserve(8 * pairs_.size());
  for (int j = 0; j < nb; ++j) {
    c.begin[j] = static_cast<int>(c.entries.size());
    const auto take = [&](int i) {
      if (seen_by[i] != j) c.entries.push_back(i);
      seen_by[i] = j;
    };
    for (int k = first_own[j]; k < first_own[j + 1]; ++k) take(own[k]);
    for (int i = c.child[j]; i >= 0; i = c.sibling[i])
      for (int k = c.begin[i] + 1; k < c.end[i]; ++k) take(c.entries[k]);
    c.end[j] = static_cast<int>(c.entries.size());
    if (c.begin[j] == c.end[j]) continue;
    std::sort(c.entries.begin() + c.begin[j], c.entries.end());
    const int above = c.parent[j] = c.entries[c.begin[j]];
    (c.child[above] < 0 ? c.child[above] : c.sibling[last_child[above]]) = j;
    last_child[above] = j;
  }
  return c;
}

/// Postorder of the tree of columns.
void BlockLU::order_by_children(Columns& c) {
  const int nb = static_cast<int>(c.parent.size());
  std::vector<int> stack, visit = c.child;  // the next child of every column to go to
  c.post.reserve(nb);
  for (int root = 0; root < nb; ++root) {
    if (c.parent[root] >= 0) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const int j = stack.back();
      if (const int i = visit[j]; i >= 0) {
        stack.push_back(i);
        visit[j] = c.sibling[i];
      } else {
        c.post.push_back(j);
        stack.pop_back();
      }
    }
  }
  c.rank.resize(nb);
  for (int k = 0; k < nb; ++k) c.rank[c.post[k]] = k;
}

/// Relaxed supernodes: a column joins the front of its last child if that costs few explicit zeros.
void BlockLU::join_columns(const std::vector<int>& permutation, Columns& c) const {
  const int nb = static_cast<int>(sizes_.size());
  const auto size_at = [&](int j) { return sizes_[permutation[j]]; };
  const auto rest_of = [&](int j) {
    int size = 0;
    for (int k = c.begin[j]; k < c.end[j]; ++k) size += size_at(c.entries[k]);
    return size;
  };
  std::vector<int> own_size;
  c.front_of.assign(nb, -1);
  for (int k = 0; k < nb; ++k) {
    const int j = c.post[k];
    int join = -1;
    if (k > 0 && c.parent[c.post[k - 1]] == j) {
      const int f = c.front_of[c.post[k - 1]];
      const int rest_own = size_at(j) + rest_of(j), pivots = own_size[f];
      const int zeros =
          rest_own - rest_of(c.post[k - 1]);  // scalar rows added to each of the front's columns
      if (zeros == 0 || (pivots + size_at(j) <= supernode_limit &&
                         zeros * pivots <= (rest_own * (pivots + size_at(j))) / 4))
        join = f;
    }
    if (join < 0) {
      join = static_cast<int>(c.first_pivot.size());
      c.first_pivot.push_back(k);
      own_size.push_back(0);
    }
    own_size[join] += size_at(j);
    c.front_of[j] = join;
  }
  c.first_pivot.push_back(nb);
}

void BlockLU::place_fronts(const std::vector<int>& permutation, const Columns& c) {
  const int nf = static_cast<int>(c.first_pivot.size()) - 1;
  fronts_.resize(nf);
  std::size_t factor_size = 0;
  int pivot_total = 0;
  for (int f = 0; f < nf; ++f) {
    Front& front = fronts_[f];
    front = Front{};
    front.first_body = static_cast<int>(front_body_.size());
    int at = 0;
    const auto put = [&](int j) {
      front_body_.push_back(permutation[j]);
      front_offset_.push_back(at);
      at += sizes_[permutation[j]];
    };
    for (int k = c.first_pivot[f]; k < c.first_pivot[f + 1]; ++k) put(c.post[k]);
    front.pivot_bodies = c.first_pivot[f + 1] - c.first_pivot[f];
    front.pivots = at;
    const int last = c.post[c.first_pivot[f + 1] - 1];
    for (int k = c.begin[last]; k < c.end[last]; ++k) put(c.entries[k]);
    front.size = at;
    front.bodies = static_cast<int>(front_body_.size()) - front.first_body;
    front.parent = c.parent[last] < 0 ? -1 : c.front_of[c.parent[last]];
    front.factor = factor_size;
    front.pivot_row = pivot_total;
    factor_size += static_cast<std::size_t>(front.size) * front.pivots +
                   static_cast<std::size_t>(front.pivots) * (front.size - front.pivots);
    pivot_total += front.pivots;
  }
  for (int f = 0; f < nf; ++f)
    if (fronts_[f].parent >= 0) ++fronts_[fronts_[f].parent].children;
  factor_.resize(factor_size);
  pivot_rows_.resize(pivot_total);
}

/// Every block of the matrix belongs to the front that eliminates its first body.
void BlockLU::place_entries(const Columns& c) {
  const int nf = static_cast<int>(fronts_.size());
  const auto front_of_pair = [&](const std::pair<int, int>& p) {
    return c.front_of[c.post[std::min(c.rank[c.position[p.first]], c.rank[c.position[p.second]])]];
  };
  std::vector<int> first_pair(nf + 1, 0), pairs_of(pairs_.size()), place(sizes_.size(), -1);
  for (const auto& p : pairs_) ++first_pair[front_of_pair(p) + 1];
  for (int f = 0; f < nf; ++f) first_pair[f + 1] += first_pair[f];
  std::vector<int> next(first_pair.begin(), first_pair.end() - 1);
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    pairs_of[next[front_of_pair(pairs_[p])]++] = static_cast<int>(p);
  for (int f = 0; f < nf; ++f) {
    Front& front = fronts_[f];
    front.first_entry = static_cast<int>(entries_.size());
    for (int i = 0; i < front.bodies; ++i)
      place[front_body_[front.first_body + i]] = front_offset_[front.first_body + i];
    for (int i = 0; i < front.pivot_bodies; ++i) {
      const int a = front_body_[front.first_body + i];
      entries_.push_back({diagonal_[a], sizes_[a], sizes_[a], place[a], place[a]});
    }
    for (int k = first_pair[f]; k < first_pair[f + 1]; ++k) {
      const int p = pairs_of[k];
      const auto [a, b] = pairs_[p];
      entries_.push_back({upper_[p], sizes_[a], sizes_[b], place[a], place[b]});
      entries_.push_back({lower_[p], sizes_[b], sizes_[a], place[b], place[a]});
    }
    front.entries = static_cast<int>(entries_.size()) - front.first_entry;
  }
}

void BlockLU::symbolic(const std::vector<int>& permutation) {
  Columns columns = columns_of(permutation);
  order_by_children(columns);
  join_columns(permutation, columns);
  place_fronts(permutation, columns);
  place_entries(columns);
}

/// Ranges of fronts (children before parents) that no front before them depends on, each at most a share of
/// the work; the fronts above are parts by themselves.
void BlockLU::part() {
  const int nf = static_cast<int>(fronts_.size());
  std::vector<double> below(nf, 0);  // work of a front and all that it waits for
  double all = 0;
  for (int f = 0; f < nf; ++f) {
    below[f] += work_of(fronts_[f].size, fronts_[f].pivots);
    if (fronts_[f].parent >= 0)
      below[fronts_[f].parent] += below[f];
    else
      all += below[f];
  }
  const double most = all < work_to_share ? all : share * all;
  parts_.clear();
  double filled = 0;
  int covered = 0;  // fronts before this one are in parts
  for (int f = 0; f < nf; ++f) {
    const bool fits = below[f] <= most, top = fronts_[f].parent < 0 || below[fronts_[f].parent] > most;
    if (fits && !top) continue;
    const double work = fits ? below[f] : 0;
    if (fits && !parts_.empty() && parts_.back().shared && filled + work <= most) {
      parts_.back().last = f + 1;
      filled += work;
    } else {
      parts_.emplace_back();
      parts_.back().first = covered;
      parts_.back().last = f + 1;
      parts_.back().shared = fits;
      filled = work;
    }
    covered = f + 1;
  }
  part_of_body_.assign(sizes_.size(), -1);
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    Part& p = parts_[k];
    for (int f = p.first; f < p.last; ++f) {
      const Front& front = fronts_[f];
      p.largest = std::max(p.largest, front.size);
      for (int b = 0; b < front.pivot_bodies; ++b)
        part_of_body_[front_body_[front.first_body + b]] = static_cast<int>(k);
    }
    for (int f = p.first; f < p.last; ++f) {
      const Front& front = fronts_[f];
      for (int b = front.pivot_bodies; b < front.bodies; ++b)
        if (const int body = front_body_[front.first_body + b]; part_of_body_[body] != static_cast<int>(k))
          p.outside.push_back(body);
    }
    std::sort(p.outside.begin(), p.outside.end());
    p.outside.erase(std::unique(p.outside.begin(), p.outside.end()), p.outside.end());
  }
  shared_.clear();
  levels_.clear();
  left_.assign(fronts_.size(), Update{});
  std::vector<int> part_of_front(fronts_.size());
  for (std::size_t k = 0; k < parts_.size(); ++k)
    std::fill(part_of_front.begin() + parts_[k].first, part_of_front.begin() + parts_[k].last,
              static_cast<int>(k));
  for (int f = 0; f < nf; ++f)
    if (const int parent = fronts_[f].parent; parent >= 0 && part_of_front[parent] != part_of_front[f])
      parts_[part_of_front[parent]].below.push_back(f);
  for (std::size_t k = 0; k < parts_.size(); ++k) {  // children come before their parents
    Part& p = parts_[k];
    if (p.shared) {
      shared_.push_back(static_cast<int>(k));
      continue;
    }
    p.level = 1;
    for (const int f : p.below) p.level = std::max(p.level, parts_[part_of_front[f]].level + 1);
    if (levels_.size() < static_cast<std::size_t>(p.level)) levels_.resize(static_cast<std::size_t>(p.level));
    levels_[static_cast<std::size_t>(p.level - 1)].push_back(static_cast<int>(k));
  }
}

}  // namespace talus::contact::detail

#include "contact/linear/solver_linear.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "contact/parallel.hpp"

namespace talus::contact::detail {

namespace {

using Panel = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

constexpr double pivot_threshold =
    0.1;  // a diagonal at least so large beside the column's largest is the pivot

/// What the columns from..to of L leave of those beyond, up to k: U = L^-1 A on their rows, A - L U below.
void update_columns(double* F, int m, int k, int from, int to) {
  const int width = to - from, columns = k - to, below = m - to;
  if (columns == 0) return;
  Panel lower(F + static_cast<std::size_t>(from) * m + from, width, width, Eigen::OuterStride<>(m));
  Panel upper(F + static_cast<std::size_t>(to) * m + from, width, columns, Eigen::OuterStride<>(m));
  lower.triangularView<Eigen::UnitLower>().solveInPlace(upper);
  Panel left(F + static_cast<std::size_t>(from) * m + to, below, width, Eigen::OuterStride<>(m));
  Panel rest(F + static_cast<std::size_t>(to) * m + to, below, columns, Eigen::OuterStride<>(m));
  rest.noalias() -= left * upper;
}

/// Takes from x[first..last) what four columns of L, first of them a, leave there: loaded and stored once
/// instead of four times.
inline void take_four(double* __restrict x, const double* a, std::size_t stride, int first, int last,
                      double x0, double x1, double x2, double x3) {
  const double *b = a + stride, *c = b + stride, *d = c + stride;
  for (int i = first; i < last; ++i) {
    double left = x[i];
    left -= a[i] * x0;
    left -= b[i] * x1;
    left -= c[i] * x2;
    left -= d[i] * x3;
    x[i] = left;
  }
}

inline void take_one(double* __restrict x, const double* a, int first, int last, double by) {
  if (by == 0) return;
  for (int i = first; i < last; ++i) x[i] -= a[i] * by;
}

/// Column j less what the columns from..j of L leave of it: U above the diagonal, what is to be parted by the
/// pivot from there on.
void eliminate_before(double* F, int m, int from, int j) {
  const auto stride = static_cast<std::size_t>(m);
  double* x = F + static_cast<std::size_t>(j) * stride;
  int p = from;
  for (; p + 4 <= j; p += 4) {
    const double* a = F + static_cast<std::size_t>(p) * stride;
    const double *b = a + stride, *c = b + stride;
    x[p + 1] -= a[p + 1] * x[p];
    x[p + 2] -= a[p + 2] * x[p];
    x[p + 2] -= b[p + 2] * x[p + 1];
    x[p + 3] -= a[p + 3] * x[p];
    x[p + 3] -= b[p + 3] * x[p + 1];
    x[p + 3] -= c[p + 3] * x[p + 2];
    if (x[p] != 0 || x[p + 1] != 0 || x[p + 2] != 0 || x[p + 3] != 0)
      take_four(x, a, stride, p + 4, m, x[p], x[p + 1], x[p + 2], x[p + 3]);
  }
  for (; p < j; ++p) take_one(x, F + static_cast<std::size_t>(p) * stride, p + 1, m, x[p]);
}

// In-place LU of the first k columns and rows of the m x m front F; the rest becomes the Schur complement. Of
// many columns, a skin's, so many at a time are eliminated one by one.
bool partial_lu(double* F, int m, int k, int* pivot_row,
                std::vector<double, Eigen::aligned_allocator<double>>& upper) {
  constexpr int columns_at_once = 48;
  const int width = k > 2 * columns_at_once ? columns_at_once : k;
  for (int j = 0, begin = 0, end = width; j < k; ++j) {
    double* cj = F + static_cast<std::size_t>(j) * m;
    eliminate_before(F, m, begin, j);
    int best = j;
    for (int i = j + 1; i < k; ++i)
      if (std::abs(cj[i]) > std::abs(cj[best])) best = i;
    if (std::abs(cj[j]) >= pivot_threshold * std::abs(cj[best]))
      best = j;  // rows far apart in memory stay where they are
    pivot_row[j] = best;
    if (!(std::abs(cj[best]) > 0) || !std::isfinite(cj[best])) return false;
    if (best != j)
      for (int c = 0; c < m; ++c)
        std::swap(F[static_cast<std::size_t>(c) * m + j], F[static_cast<std::size_t>(c) * m + best]);
    const double inverse = 1 / cj[j];
    for (int i = j + 1; i < m; ++i) cj[i] *= inverse;
    if (j + 1 < end) continue;
    update_columns(F, m, k, begin, end);
    begin = end;
    end = std::min(k, end + width);
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
  for (int i = 1; i < k; ++i) {
    const double* row = F + i;  // of L, a column apart
    const auto L = [&](int j) { return row[static_cast<std::size_t>(j) * m]; };
    double* ui = U + static_cast<std::size_t>(i) * r;
    int j = 0;
    for (; j + 4 <= i; j += 4) {
      const double l0 = L(j), l1 = L(j + 1), l2 = L(j + 2), l3 = L(j + 3);
      if (l0 != 0 || l1 != 0 || l2 != 0 || l3 != 0)
        take_four(ui, U + static_cast<std::size_t>(j) * r, static_cast<std::size_t>(r), 0, r, l0, l1, l2, l3);
    }
    for (; j < i; ++j) take_one(ui, U + static_cast<std::size_t>(j) * r, 0, r, L(j));
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

void BlockLU::set_zero() {
  constexpr int values_at_once = 1 << 14;
  in_ranges(static_cast<int>(values_.size()), values_at_once,
            [&](int from, int to) { std::fill(values_.begin() + from, values_.begin() + to, 0.0); });
}

/// The front's own blocks of the matrix, and what its children left.
void BlockLU::gather_front(const Front& front, Part& part) {
  const int m = front.size;
  double* F = part.front.data();
  std::fill(F, F + static_cast<std::size_t>(m) * m, 0.0);
  for (int e = front.first_entry; e < front.first_entry + front.entries; ++e) {
    const Entry& entry = entries_[e];
    const double* from = values_.data() + entry.value;
    for (int c = 0; c < entry.cols; ++c) {
      double* to = F + static_cast<std::size_t>(entry.col + c) * m + entry.row;
      for (int i = 0; i < entry.rows; ++i) to[i] += from[c * entry.rows + i];
    }
  }
  if (front.children == 0) return;
  part.place.resize(sizes_.size());
  for (int i = 0; i < front.bodies; ++i)
    part.place[front_body_[front.first_body + i]] = front_offset_[front.first_body + i];
  if (!part.shared) {
    for (auto kid = part.below.rbegin(); kid != part.below.rend(); ++kid)
      add_child(fronts_[*kid], parts_[left_[*kid].part].stack.data() + left_[*kid].at, part.place, m, F);
    return;
  }
  for (int c = 0; c < front.children; ++c) {
    const Update update = part.updates.back();
    part.updates.pop_back();
    Part& from = parts_[update.part];
    add_child(fronts_[update.front], from.stack.data() + update.at, part.place, m, F);
    from.top = update.at;
  }
}

/// Adds the Schur complement U of a child to the front F of size m.
void BlockLU::add_child(const Front& kid, const double* U, const std::vector<int>& place, int m,
                        double* F) const {
  const int rest = kid.size - kid.pivots;
  for (int bc = kid.pivot_bodies; bc < kid.bodies; ++bc) {
    const int body_c = front_body_[kid.first_body + bc];
    const int to_c = place[body_c], from_c = front_offset_[kid.first_body + bc] - kid.pivots;
    for (int br = kid.pivot_bodies; br < kid.bodies; ++br) {
      const int body_r = front_body_[kid.first_body + br];
      const int to_r = place[body_r], from_r = front_offset_[kid.first_body + br] - kid.pivots;
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
}

bool BlockLU::factor_part(int number) {
  Part& part = parts_[number];
  part.front.resize(static_cast<std::size_t>(part.largest) * part.largest);
  for (int f = part.first; f < part.last; ++f) {
    const Front& front = fronts_[f];
    const int m = front.size, k = front.pivots, r = m - k;
    gather_front(front, part);
    double* F = part.front.data();
    if (!partial_lu(F, m, k, pivot_rows_.data() + front.pivot_row, part.upper)) return false;
    double* out = factor_.data() + front.factor;
    std::memcpy(out, F, sizeof(double) * static_cast<std::size_t>(m) * k);
    out += static_cast<std::size_t>(m) * k;
    if (r == 0) continue;
    for (int c = 0; c < r; ++c)
      std::memcpy(out + static_cast<std::size_t>(c) * k, F + static_cast<std::size_t>(k + c) * m,
                  sizeof(double) * k);
    const std::size_t at = part.top;
    part.top += static_cast<std::size_t>(r) * r;
    if (part.stack.size() < part.top) part.stack.resize(part.top);
    for (int c = 0; c < r; ++c)
      std::memcpy(part.stack.data() + at + static_cast<std::size_t>(c) * r,
                  F + static_cast<std::size_t>(k + c) * m + k, sizeof(double) * r);
    part.updates.push_back({f, number, at});
    left_[f] = part.updates.back();
  }
  return true;
}

bool BlockLU::factor() {
  for (Part& p : parts_) {
    p.top = 0;
    p.updates.clear();
  }
  std::atomic<bool> good = true;
  in_ranges(static_cast<int>(shared_.size()), 1, [&](int from, int to) {
    for (int k = from; k < to; ++k)
      if (!factor_part(shared_[k])) good.store(false, std::memory_order_relaxed);
  });
  if (!good) return false;
  for (const std::vector<int>& level : levels_) {
    in_ranges(static_cast<int>(level.size()), 1, [&](int from, int to) {
      for (int k = from; k < to; ++k)
        if (!factor_part(level[k])) good.store(false, std::memory_order_relaxed);
    });
    if (!good) return false;
  }
  return true;
}

/// Forward substitution; what bodies outside of a shared part lose is kept in the part's own vector until all
/// are done.
void BlockLU::forward(Part& part, int number, double* x) const {
  part.local.resize(part.largest);
  double* y = part.local.data();
  if (part.shared) {
    part.left.resize(static_cast<std::size_t>(n_));
    for (const int body : part.outside) std::fill_n(part.left.data() + offsets_[body], sizes_[body], 0.0);
  }
  const auto at = [&](int body) {
    return (!part.shared || part_of_body_[body] == number ? x : part.left.data()) + offsets_[body];
  };
  for (int f = part.first; f < part.last; ++f) {
    const Front& front = fronts_[f];
    const int m = front.size, k = front.pivots;
    const double* L = factor_.data() + front.factor;
    for (int b = front.first_body; b < front.first_body + front.bodies; ++b)
      std::copy_n(at(front_body_[b]), sizes_[front_body_[b]], y + front_offset_[b]);
    for (int j = 0; j < k; ++j) std::swap(y[j], y[pivot_rows_[front.pivot_row + j]]);
    for (int j = 0; j < k; ++j) {
      const double t = y[j];
      const double* cj = L + static_cast<std::size_t>(j) * m;
      for (int i = j + 1; i < m; ++i) y[i] -= cj[i] * t;
    }
    for (int b = front.first_body; b < front.first_body + front.bodies; ++b)
      std::copy_n(y + front_offset_[b], sizes_[front_body_[b]], at(front_body_[b]));
  }
}

void BlockLU::backward(Part& part, double* x) const {
  double* y = part.local.data();
  for (int f = part.last; f-- > part.first;) {
    const Front& front = fronts_[f];
    const int m = front.size, k = front.pivots, r = m - k;
    const double* L = factor_.data() + front.factor;
    const double* U = L + static_cast<std::size_t>(m) * k;
    for (int b = front.first_body; b < front.first_body + front.bodies; ++b)
      std::copy_n(x + offsets_[front_body_[b]], sizes_[front_body_[b]], y + front_offset_[b]);
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
    for (int b = front.first_body; b < front.first_body + front.pivot_bodies; ++b)
      std::copy_n(y + front_offset_[b], sizes_[front_body_[b]], x + offsets_[front_body_[b]]);
  }
}

void BlockLU::solve(double* x) const {
  const auto each_shared = [&](auto&& use) {
    in_ranges(static_cast<int>(shared_.size()), 1, [&](int from, int to) {
      for (int k = from; k < to; ++k) use(shared_[k]);
    });
  };
  each_shared([&](int k) { forward(parts_[k], k, x); });
  for (const int k : shared_)
    for (const int body : parts_[k].outside)
      for (int i = offsets_[body]; i < offsets_[body + 1]; ++i) x[i] += parts_[k].left[i];
  const int n = static_cast<int>(parts_.size());
  for (int k = 0; k < n; ++k)
    if (!parts_[k].shared) forward(parts_[k], k, x);
  for (int k = n - 1; k >= 0; --k)
    if (!parts_[k].shared) backward(parts_[k], x);
  each_shared([&](int k) { backward(parts_[k], x); });
}

}  // namespace talus::contact::detail

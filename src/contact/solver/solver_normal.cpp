#include "contact/solver/solver_normal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::contact::detail {

namespace {

constexpr int pace = 30;  // sweeps between two looks at what they gain

inline void add_six(double s, const double* a, double* x) {
  store<Four>(load<Four>(x) + load<Four>(a) * s, x);
  store<Two>(load<Two>(x + 4) + load<Two>(a + 4) * s, x + 4);
}

}  // namespace

void NormalSweeps::gather(const System& system, const std::vector<Vec3>& p) {
  system_ = &system;
  rows_.resize(system.touch.size());
  p_.resize(system.touch.size());
  J_.resize(system.J.size() / 3);
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      const TouchTerm* terms = system.terms.data() + t.first;
      const bool rigid =
          t.count > 0 && t.count <= 2 &&
          std::all_of(terms, terms + t.count, [](const TouchTerm& term) { return term.n == 6; });
      rows_[i] = {t.first,
                  t.count,
                  rigid ? t.count : 0,
                  {rigid ? terms[0].v : 0, rigid ? terms[t.count - 1].v : 0},
                  t.count > 0 ? terms[0].at / 3 : 0,
                  t.bias.x(),
                  t.W(0, 0),
                  t.slip.k,
                  t.w,
                  t.compliance.x(),
                  t.law.floor};
      p_[i] = p[i].x();
      for (int k = 0; k < t.count; ++k)
        std::copy_n(system.J.data() + terms[k].at, terms[k].n, J_.data() + terms[k].at / 3);
    }
  });
}

inline double NormalSweeps::velocity(const Row& row, const double* v) const {
  RowSums<1> u;
  if (row.rigid > 0) {
    const double* j = J_.data() + row.at;
    u.add<6>(j, v + row.v[0]);
    if (row.rigid > 1) u.add<6>(j + 6, v + row.v[1]);
  } else {
    for (int k = row.first; k < row.first + row.count; ++k)
      u.add(J_.data() + system_->terms[k].at / 3, system_->terms[k].n, v + system_->terms[k].v);
  }
  return row.bias + u[0];
}

inline void NormalSweeps::push(const Row& row, double change, double* v) const {
  if (row.rigid > 0) {
    const double* j = J_.data() + row.at;
    add_six(change, j, v + row.v[0]);
    if (row.rigid > 1) add_six(change, j + 6, v + row.v[1]);
    return;
  }
  for (int k = row.first; k < row.first + row.count; ++k) {
    const TouchTerm& t = system_->terms[k];
    for (int i = 0; i < t.n; ++i) v[t.v + i] += change * J_[t.at / 3 + i];
  }
}

void NormalSweeps::sweep(bool forward, double* v) {
  system_->order.each(forward, true, [&](int i) {
    const Row& row = rows_[i];
    change_[i] = 0;
    if (!(row.diagonal > 0)) return false;
    const double next =
        std::max(row.floor, p_[i] - (velocity(row, v) + row.compliance * p_[i]) * row.inverse);
    const double change = next - p_[i];
    if (change == 0) return false;
    p_[i] = next;
    push(row, change, v);
    change_[i] = row.diagonal * std::abs(change);
    return true;
  });
}

/// On along the last direction, within the bounds; the direction takes up what the last two sweeps changed.
void NormalSweeps::carry_on(double momentum, double* v) {
  system_->order.each(true, true, [&](int i) {
    const double step = p_[i] - before_[i];
    direction_[i] *= momentum;
    const double next = std::max(rows_[i].floor, p_[i] + direction_[i]), change = next - p_[i];
    direction_[i] += step;
    if (change == 0) return false;
    p_[i] = next;
    push(rows_[i], change, v);
    return true;
  });
}

double NormalSweeps::residual(const double* v) {
  in_ranges(static_cast<int>(rows_.size()), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Row& row = rows_[i];
      const double u = velocity(row, v) + row.compliance * p_[i];
      change_[i] = !std::isfinite(u) ? std::numeric_limits<double>::quiet_NaN()
                   : row.scale > 0 ? row.scale * std::abs(p_[i] - std::max(row.floor, p_[i] - u / row.scale))
                                   : 0;
    }
  });
  double worst = 0;
  for (const double r : change_) worst = larger(worst, r);
  return worst;
}

/// Largest change of the last sweep [m/s], and p . N p of what both changed by the diagonal of N. Sums by
/// ranges, then range by range, whatever the threads.
std::pair<double, double> NormalSweeps::gain() {
  const int n = static_cast<int>(rows_.size()), ranges = (n + contacts_at_once - 1) / contacts_at_once;
  gains_.resize(static_cast<std::size_t>(ranges));
  in_ranges(ranges, 4, [&](int from, int to) {
    for (int r = from; r < to; ++r) {
      double largest = 0, square = 0;
      for (int i = r * contacts_at_once; i < std::min(n, (r + 1) * contacts_at_once); ++i) {
        largest = std::max(largest, change_[i]);
        square += rows_[i].diagonal * (p_[i] - before_[i]) * (p_[i] - before_[i]);
      }
      gains_[r] = {largest, square};
    }
  });
  std::pair<double, double> all{0, 0};
  for (const auto& [largest, square] : gains_) {
    all.first = std::max(all.first, largest);
    all.second += square;
  }
  return all;
}

void NormalSweeps::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance,
                       int budget) {
  gather(system, p);
  direction_.assign(rows_.size(), 0.0);
  change_.assign(rows_.size(), 0.0);
  double last = 0, checked = INFINITY;
  for (int sweeps = 0; sweeps < budget; sweeps += 3) {
    before_ = p_;
    sweep(true, v.data());
    sweep(false, v.data());
    const auto [largest, square] = gain();
    const double momentum = sweeps > 0 && square < last ? square / last : 0;
    last = square;
    carry_on(momentum, v.data());
    if (!(largest > 2 * tolerance) && !(residual(v.data()) > tolerance)) break;
    if (sweeps % pace == 0) {
      // Of a tower every sweep carries an impulse on by a part of it alone: where the same pace does not
      // nearly get there, others are faster.
      const double rounds_left = static_cast<double>(budget - sweeps) / pace;
      const double in_the_end = largest * std::pow(std::min(1.0, largest / checked), rounds_left);
      if (sweeps >= 2 * pace && in_the_end > 10 * tolerance) break;
      checked = largest;
    }
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) p[i] = Vec3(p_[i], 0, 0);
}

}  // namespace talus::contact::detail

#include "contact/solver_normal.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

namespace {

constexpr int pace = 30;   // sweeps between two looks at what they gain

template <int N>
inline double dot(const double* a, const double* x) {
  using Row = Eigen::Map<const Eigen::Matrix<double, N, 1>>;   // several products at a time
  return Row(a).dot(Row(x));
}

template <int N>
inline void add(double s, const double* a, double* x) {
  for (int k = 0; k < N; ++k) x[k] += s * a[k];
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
      rows_[i] = {t.first, t.count, t.bias.x(), t.W(0, 0), t.slip.k, t.w, t.compliance.x(), t.law.floor};
      p_[i] = p[i].x();
      for (int k = t.first; k < t.first + t.count; ++k) std::copy_n(system.J.data() + system.terms[k].at, system.terms[k].n, J_.data() + system.terms[k].at / 3);
    }
  });
}

double NormalSweeps::velocity(const Row& row, const double* v) const {
  double u = row.bias;
  for (int k = row.first; k < row.first + row.count; ++k) {
    const TouchTerm& t = system_->terms[k];
    const double *j = J_.data() + t.at / 3, *x = v + t.v;
    if (t.n == 6) u += dot<6>(j, x);
    else
      for (int i = 0; i < t.n; ++i) u += j[i] * x[i];
  }
  return u;
}

void NormalSweeps::push(const Row& row, double change, double* v) const {
  for (int k = row.first; k < row.first + row.count; ++k) {
    const TouchTerm& t = system_->terms[k];
    const double* j = J_.data() + t.at / 3;
    double* x = v + t.v;
    if (t.n == 6) add<6>(change, j, x);
    else
      for (int i = 0; i < t.n; ++i) x[i] += change * j[i];
  }
}

void NormalSweeps::sweep(bool forward, double* v) {
  system_->order.each(forward, true, [&](int i) {
    const Row& row = rows_[i];
    change_[i] = 0;
    if (!(row.diagonal > 0)) return false;
    const double next = std::max(row.floor, p_[i] - (velocity(row, v) + row.compliance * p_[i]) * row.inverse);
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
      change_[i] = row.scale > 0 ? row.scale * std::abs(p_[i] - std::max(row.floor, p_[i] - (velocity(row, v) + row.compliance * p_[i]) / row.scale)) : 0;
    }
  });
  double worst = 0;
  for (const double r : change_)
    if (!(r <= worst)) worst = r;   // keeps a NaN
  return worst;
}

void NormalSweeps::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance, int budget) {
  gather(system, p);
  direction_.assign(rows_.size(), 0.0);
  change_.assign(rows_.size(), 0.0);
  double last = 0, checked = INFINITY;
  for (int sweeps = 0; sweeps < budget; sweeps += 3) {
    before_ = p_;
    sweep(true, v.data());
    sweep(false, v.data());
    const double largest = *std::max_element(change_.begin(), change_.end());
    double square = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) square += rows_[i].diagonal * (p_[i] - before_[i]) * (p_[i] - before_[i]);
    const double momentum = sweeps > 0 && square < last ? square / last : 0;
    last = square;
    carry_on(momentum, v.data());
    if (!(largest > 2 * tolerance) && !(residual(v.data()) > tolerance)) break;
    if (sweeps % pace == 0) {
      // Of a tower every sweep carries an impulse on by a part of it alone: where the same pace does not nearly get there, others are faster.
      const double rounds_left = static_cast<double>(budget - sweeps) / pace;
      if (sweeps >= 2 * pace && largest * std::pow(std::min(1.0, largest / checked), rounds_left) > 10 * tolerance) break;
      checked = largest;
    }
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) p[i] = Vec3(p_[i], 0, 0);
}

}  // namespace talus::contact::detail

#include "contact/solver_normal.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

namespace {

template <int N>
inline double dot(const double* a, const double* x) {
  double sum = 0;
  for (int k = 0; k < N; ++k) sum += a[k] * x[k];
  return sum;
}

template <int N>
inline void add(double s, const double* a, double* x) {
  for (int k = 0; k < N; ++k) x[k] += s * a[k];
}

}  // namespace

void NormalSweeps::gather(const System& system, const std::vector<Vec3>& p) {
  rows_.clear();
  terms_.clear();
  coefficients_.clear();
  p_.clear();
  for (const Touch& t : system.touch) {
    const std::size_t i = p_.size();
    rows_.push_back({static_cast<int>(terms_.size()), t.count, t.bias.x(), t.W(0, 0), t.w, t.compliance.x(), t.law.floor});
    p_.push_back(p[i].x());
    for (int k = t.first; k < t.first + t.count; ++k) {
      const TouchTerm& term = system.terms[k];
      terms_.push_back({term.v, term.n, coefficients_.size()});
      for (const auto* from : {&system.J, &system.Y}) coefficients_.insert(coefficients_.end(), from->begin() + term.at, from->begin() + term.at + term.n);
    }
  }
}

double NormalSweeps::velocity(const Row& row, const double* v) const {
  double u = row.bias;
  for (int k = row.first; k < row.first + row.count; ++k) {
    const Term& t = terms_[k];
    const double *j = coefficients_.data() + t.at, *x = v + t.v;
    if (t.n == 6) u += dot<6>(j, x);
    else
      for (int i = 0; i < t.n; ++i) u += j[i] * x[i];
  }
  return u;
}

void NormalSweeps::push(const Row& row, double change, double* v) const {
  for (int k = row.first; k < row.first + row.count; ++k) {
    const Term& t = terms_[k];
    const double* y = coefficients_.data() + t.at + t.n;
    double* x = v + t.v;
    if (t.n == 6) add<6>(change, y, x);
    else
      for (int i = 0; i < t.n; ++i) x[i] += change * y[i];
  }
}

/// Returns the largest change, as a velocity [m/s].
double NormalSweeps::sweep(bool forward, double* v) {
  const std::size_t n = rows_.size();
  double largest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = forward ? k : n - 1 - k;
    const Row& row = rows_[i];
    if (!(row.diagonal > 0)) continue;
    const double next = std::max(row.floor, p_[i] - (velocity(row, v) + row.compliance * p_[i]) / row.diagonal);
    const double change = next - p_[i];
    if (change == 0) continue;
    p_[i] = next;
    push(row, change, v);
    largest = std::max(largest, row.diagonal * std::abs(change));
  }
  return largest;
}

/// On along the last direction, within the bounds; the direction takes up what the last two sweeps changed.
void NormalSweeps::carry_on(double momentum, double* v) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const double step = p_[i] - before_[i];
    direction_[i] *= momentum;
    const double next = std::max(rows_[i].floor, p_[i] + direction_[i]), change = next - p_[i];
    direction_[i] += step;
    if (change == 0) continue;
    p_[i] = next;
    push(rows_[i], change, v);
  }
}

double NormalSweeps::residual(const double* v) const {
  double worst = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    if (!(row.scale > 0)) continue;
    const double u = velocity(row, v) + row.compliance * p_[i];
    const double r = row.scale * std::abs(p_[i] - std::max(row.floor, p_[i] - u / row.scale));
    if (!(r <= worst)) worst = r;   // keeps a NaN
  }
  return worst;
}

void NormalSweeps::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance, int budget) {
  gather(system, p);
  direction_.assign(rows_.size(), 0.0);
  double last = 0;
  for (int sweeps = 0; sweeps < budget; sweeps += 3) {
    before_ = p_;
    sweep(true, v.data());
    const double largest = sweep(false, v.data());
    double square = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) square += rows_[i].diagonal * (p_[i] - before_[i]) * (p_[i] - before_[i]);
    const double momentum = sweeps > 0 && square < last ? square / last : 0;
    last = square;
    carry_on(momentum, v.data());
    if (!(largest > 2 * tolerance) && !(residual(v.data()) > tolerance)) break;
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) p[i] = Vec3(p_[i], 0, 0);
}

}  // namespace talus::contact::detail

#include "fem/rebar/rebar_slip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace talus::rebar {
namespace {

/// Distances along the bar of its bends and of its ends where they are held, or if it is closed.
std::vector<double> anchors(const Bar& bar) {
  std::vector<double> at;
  double arc = 0;
  for (std::size_t i = 1; i < bar.points.size(); ++i) {
    const Vec3 leg = bar.points[i] - bar.points[i - 1];
    arc += leg.norm();
    if (i + 1 == bar.points.size()) break;
    const Vec3 next = bar.points[i + 1] - bar.points[i];
    if (leg.normalized().dot(next.normalized()) < std::cos(M_PI / 6)) at.push_back(arc);
  }
  if ((bar.points.back() - bar.points.front()).norm() < 1e-6 * arc) at.push_back(0), at.push_back(arc);
  if (bar.start_held) at.push_back(0);
  if (bar.end_held) at.push_back(arc);
  return at;
}

/// Solves a tridiagonal system in place: diagonal d, off-diagonal e (e[j] couples j and j + 1), right side x.
void solve_tridiagonal(std::vector<double>& d, const std::vector<double>& e, std::vector<double>& x) {
  for (std::size_t j = 1; j < d.size(); ++j) {
    const double m = e[j - 1] / d[j - 1];
    d[j] -= m * e[j - 1];
    x[j] -= m * x[j - 1];
  }
  for (std::size_t j = d.size(); j-- > 0;) x[j] = (x[j] - (j + 1 < d.size() ? e[j] * x[j + 1] : 0.0)) / d[j];
}

}  // namespace

SlipField::SlipField(const EmbeddedBars& bars, double f_cm) : bars_(&bars), law_(f_cm) {
  const auto& segments = bars.segments();
  for (int k = 0; k < static_cast<int>(segments.size());) {
    Run run{segments[k].bar, k, k, static_cast<int>(surface_.size())};
    while (run.last < static_cast<int>(segments.size()) && segments[run.last].bar == run.bar) ++run.last;
    const Bar& bar = bars.bars()[run.bar];
    const std::vector<double> held = anchors(bar);
    for (int j = run.first; j <= run.last; ++j) {
      if (j < run.last) point_.push_back(static_cast<int>(surface_.size()));
      const double before = j > run.first ? segments[j - 1].length : 0,
                   after = j < run.last ? segments[j].length : 0;
      const double arc = j < run.last ? segments[j].arc : segments[j - 1].arc + segments[j - 1].length;
      const bool anchored = std::any_of(held.begin(), held.end(),
                                        [&](double a) { return std::abs(a - arc) < 1e-6 * bar.length(); });
      surface_.push_back(anchored ? 0.0 : bar.perimeter() * 0.5 * (before + after));
    }
    runs_.push_back(run);
    k = run.last;
  }
  slip_.assign(surface_.size(), 0.0);
  next_slip_ = slip_;
  strain_.assign(segments.size(), 0.0);
  old_.resize(surface_.size());
  next_ = old_;
}

SlipField::Sums SlipField::solve(std::span<const double> host, double h,
                                 std::span<const material::Steel::State> old,
                                 std::span<const double> old_strain, const std::function<bool(int)>& counts) {
  Sums sums;
  for (const Run& run : runs_) {
    solve_run(run, host, h, old, old_strain);
    const bool counted = !counts || counts(run.first);
    const auto first = static_cast<std::size_t>(run.point);
    for (std::size_t j = first; j <= first + static_cast<std::size_t>(run.last - run.first); ++j) {
      if (surface_[j] == 0) continue;
      const auto r = law_(next_slip_[j], old_[j], next_[j]);
      if (!counted) continue;
      sums.energy += surface_[j] * r.energy;
      sums.dissipation += surface_[j] * r.dissipation;
      sums.largest = std::max(sums.largest, std::abs(next_slip_[j]));
    }
  }
  return sums;
}

void SlipField::solve_run(const Run& run, std::span<const double> host, double h,
                          std::span<const material::Steel::State> old, std::span<const double> old_strain) {
  const auto& segments = bars_->segments();
  const int n = run.last - run.first + 1;
  const Bar& bar = bars_->bars()[run.bar];
  const double area = segments[run.first].area;
  const material::Steel& steel = bars_->law(run.bar);
  std::vector<double> s(slip_.begin() + run.point, slip_.begin() + run.point + n), diagonal(n),
      off(std::max(0, n - 1)), residual(n), moved(n);
  for (int j = 0; j < n; ++j)
    if (surface_[run.point + j] == 0) s[j] = 0;  // anchored

  // Minus the gradient of the energy in the slips; its derivative. Softening counts as flat, so that the
  // matrix stays positive.
  const auto balance = [&](const std::vector<double>& at, std::vector<double>& out, bool matrix) {
    std::fill(out.begin(), out.end(), 0.0);
    if (matrix) std::fill(diagonal.begin(), diagonal.end(), 0.0);
    for (int i = 0; i + 1 < n; ++i) {
      const int k = run.first + i;
      if (matrix) off[i] = 0;
      if (std::isnan(host[k])) continue;
      const double length = segments[k].length, strain = host[k] + (at[i + 1] - at[i]) / length;
      material::Steel::State unused;
      const auto r = steel(strain, h > 0 ? (strain - old_strain[k]) / h : 0.0, old[k], unused);
      out[i] += area * r.stress, out[i + 1] -= area * r.stress;
      const double stiffness = area * std::max(r.tangent, 1e-6 * bar.steel.young) / length;
      if (matrix) diagonal[i] += stiffness, diagonal[i + 1] += stiffness, off[i] = -stiffness;
    }
    for (int j = 0; j < n; ++j) {
      const double surface = surface_[run.point + j];
      if (surface == 0) {
        out[j] = 0;
        if (!matrix) continue;
        diagonal[j] = 1;
        if (j > 0) off[j - 1] = 0;
        if (j + 1 < n) off[j] = 0;
        continue;
      }
      material::BondSlip::State unused;
      const auto& start = old_[run.point + j];
      out[j] -= surface * law_(at[j], start, unused).stress;
      if (matrix)
        diagonal[j] += surface * std::max(law_.tangent(at[j], start), 1e-3 * law_.strength() / 1e-3);
    }
  };

  constexpr int most = 200;
  const double scale = area * bar.steel.yield;
  double worst = 0;
  for (int iteration = 0; iteration < most; ++iteration) {
    balance(s, residual, true);
    worst = 0;
    for (double r : residual) worst = std::max(worst, std::abs(r));
    if (worst <= 1e-9 * scale) break;
    std::vector<double> step = residual;
    solve_tridiagonal(diagonal, off, step);
    // Along the step the energy falls at first; where it would rise again, the step ends near its least
    // value.
    const auto slope = [&](double length) {
      std::vector<double> at = s;
      for (int j = 0; j < n; ++j) at[j] += length * step[j];
      balance(at, moved, false);
      double sum = 0;
      for (int j = 0; j < n; ++j) sum += moved[j] * step[j];
      return sum;
    };
    double start = 0, low = 0, high = 1;
    for (int j = 0; j < n; ++j) start += residual[j] * step[j];
    double length = 1, at_end = slope(1);
    for (int cut = 0; cut < 30 && (at_end < -0.1 * start || (length < 1 && at_end > 0.5 * start)); ++cut) {
      (at_end < 0 ? high : low) = length;
      length = 0.5 * (low + high);
      at_end = slope(length);
    }
    for (int j = 0; j < n; ++j) s[j] += length * step[j];
  }
  if (!(worst <= 1e-3 * scale))
    throw NumericalFailure(
        fmt::format("bar {}: the bond finds no balance (residual {:.3g} N)", bar.name, worst));
  for (int j = 0; j < n; ++j) next_slip_[run.point + j] = s[j];
  for (int i = 0; i + 1 < n; ++i) strain_[run.first + i] = (s[i + 1] - s[i]) / segments[run.first + i].length;
}

void SlipField::accept() {
  slip_ = next_slip_;
  old_ = next_;
}

void SlipField::write(std::size_t segment, std::vector<double>& record) const {
  const auto start = static_cast<std::size_t>(point_[segment]);
  for (const std::size_t j : {start, start + 1})
    record.insert(record.end(), {slip_[j], old_[j].plastic, old_[j].largest});
  record.push_back(strain_[segment]);
}

void SlipField::read(std::size_t segment, const double* record) {
  const auto start = static_cast<std::size_t>(point_[segment]);
  for (const std::size_t j : {start, start + 1}) {
    slip_[j] = next_slip_[j] = *record++;
    old_[j].plastic = *record++, old_[j].largest = *record++;
    next_[j] = old_[j];
  }
  strain_[segment] = *record;
}

}  // namespace talus::rebar

// Rolling and drilling resistance: couples about the tangents and about the normal of a contact.
//
//   |m_t| <= mu_r R p_n,   m_t opposite to the rolling velocity (w_b - w_a)_t     R = equivalent radius; of two blocks R_a R_b / (R_a + R_b)
//   |m_n| <= mu_d R p_n,   m_n opposite to the drilling velocity (w_b - w_a)_n
//
// They act as long as the normal force does: in an impact that has no duration as an impulse, bounded by the impact's own normal impulse.
// A faceted body that rolls hops from edge to edge, and meets the ground in impacts alone.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {

/// arm * axis . w in the rows from `first` on, one for each axis; the others are empty.
void push_couple(std::vector<double>& pool, std::span<const Vec3> axes, int ndof, double arm) {
  for (int c = 0; c < ndof; ++c)
    for (std::size_t r = 0; r < 3; ++r) pool.push_back(r > 0 && r <= axes.size() && c >= 3 && c < 6 ? arm * axes[r - 1][c - 3] : 0.0);
}

double equivalent_radius(double volume) { return std::cbrt(0.75 * volume / M_PI); }

}  // namespace

/// R: of a block at what is fixed its equivalent radius, of two blocks half of their harmonic mean [m].
double IslandStepper::rolling_arm(const Touch& t) const {
  const double arm = equivalent_radius(model_.blocks[static_cast<std::size_t>(t.b)].volume);
  if (t.a.kind != Partner::Kind::block || local_[static_cast<std::size_t>(t.a.index)] < 0) return arm;
  const double other = equivalent_radius(model_.blocks[static_cast<std::size_t>(t.a.index)].volume);
  return arm * other / (arm + other);
}

/// The couples of every touch that resists rolling or drilling, after the rows of all touches; bounded by nothing yet.
void IslandStepper::add_rolling_rows() {
  for (const Touch& t : touches_) {
    if (couples(t) == 0) continue;
    const int a = t.a.kind == Partner::Kind::block ? local_[static_cast<std::size_t>(t.a.index)] : -1, b = local_[static_cast<std::size_t>(t.b)];
    const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(t.b)];
    const double arm = rolling_arm(t);
    const auto add = [&](std::span<const Vec3> axes) {
      contact::ProblemContact c;
      c.first_term = static_cast<int>(problem_.terms.size());
      for (const auto& [body, sign] : {std::pair(a, -1.0), std::pair(b, 1.0)}) {
        if (body < 0) continue;
        problem_.terms.push_back({body, static_cast<int>(problem_.jacobians.size())});
        push_couple(problem_.jacobians, axes, bodies_[static_cast<std::size_t>(body)].ndof, sign * arm);
      }
      c.terms = static_cast<int>(problem_.terms.size()) - c.first_term;
      c.bias[0] = 1;   // its normal row never closes
      c.compliance[0] = 1 / block.mass;
      problem_.contacts.push_back(c);
    };
    const std::array<Vec3, 2> tangents{t.frame.col(1), t.frame.col(2)};
    const std::array<Vec3, 1> normal{t.frame.col(0)};
    if (t.law->rolling_resistance > 0) add(tangents);
    if (t.law->drilling_resistance > 0) add(normal);
  }
}

/// Bounds the rolling rows by the normal impulses [N s] that `pressed` tells; by how much that changed them, over what they are.
double IslandStepper::limit_rolling(const std::function<double(const Touch&)>& pressed) {
  double change = 0, all = 0;
  each_rolling(touches_, problem_, [&](const Touch& t, double resistance, contact::ProblemContact& c) {
    const double bound = resistance * std::max(0.0, pressed(t));
    change += std::abs(bound - c.cohesion);
    all += bound;
    c.cohesion = bound;
  });
  return all > 0 ? change / all : 0;
}

/// Solves again while the normal impulses found ask for other bounds than those it was solved with. The bounds x are a fixed point of x -> g(x), which is
/// found by relaxation [irons1969]:  x' = x + w r,   r = g(x) - x,   w' = -w r . (r' - r) / |r' - r|^2
bool IslandStepper::solve_rolling(double h, Effort effort) {
  constexpr int most = 30;
  constexpr double same = 1e-9, least_relaxed = 0.3, most_relaxed = 4;
  const auto found = [&](const Touch& t) { return problem_.contacts[static_cast<std::size_t>(t.row)].impulse[0]; };
  std::vector<double> bounds, residuals, before;
  double relaxed = 1;
  for (int i = 0; i < most; ++i) {
    if (!solve(h, effort)) return false;
    bounds.clear();
    each_rolling(touches_, problem_, [&](const Touch&, double, const contact::ProblemContact& c) { bounds.push_back(c.cohesion); });
    if (bounds.empty() || limit_rolling(found) <= std::max(same, h > 0 ? 0.1 * settings_.accuracy : 0.0)) break;
    residuals.clear();
    each_rolling(touches_, problem_, [&](const Touch&, double, const contact::ProblemContact& c) { residuals.push_back(c.cohesion - bounds[residuals.size()]); });
    if (i > 0) {
      double along = 0, change = 0;
      for (std::size_t k = 0; k < residuals.size(); ++k) {
        const double d = residuals[k] - before[k];
        along += before[k] * d;
        change += d * d;
      }
      relaxed = change > 0 && i < most / 2 ? std::clamp(-relaxed * along / change, least_relaxed, most_relaxed) : 1.0;
    }
    std::size_t k = 0;
    each_rolling(touches_, problem_, [&](const Touch&, double, contact::ProblemContact& c) {
      c.cohesion = std::max(0.0, bounds[k] + relaxed * residuals[k]);
      ++k;
    });
    before.swap(residuals);
  }
  return true;
}

}  // namespace talus::coupling

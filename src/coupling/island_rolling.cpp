// Rolling resistance: a couple about the tangents of a contact, at most mu_r R times its normal force.
//
//   |m_t| <= mu_r R p_n,   m_t opposite to the rolling velocity w_b - w_a,   R = equivalent radius; of two blocks R_a R_b / (R_a + R_b)
//
// It acts as long as the normal force does: in an impact that has no duration as an impulse, bounded by the impact's own normal impulse.
// A faceted body that rolls hops from edge to edge, and meets the ground in impacts alone.
#include <algorithm>
#include <cmath>

#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {

/// Rows 1 and 2: arm * t . w; row 0 is empty.
void push_rolling(std::vector<double>& pool, const Mat3& frame, int ndof, double arm) {
  for (int c = 0; c < ndof; ++c)
    for (int r = 0; r < 3; ++r) pool.push_back(r > 0 && c >= 3 && c < 6 ? arm * frame(c - 3, r) : 0.0);
}

double equivalent_radius(double volume) { return std::cbrt(0.75 * volume / M_PI); }

}  // namespace

/// One contact per touch that resists rolling, after the rows of all touches; bounded by nothing yet.
void IslandStepper::add_rolling_rows() {
  for (const Touch& t : touches_) {
    if (!resists_rolling(t)) continue;
    const int a = t.a.kind == Partner::Kind::block ? local_[static_cast<std::size_t>(t.a.index)] : -1, b = local_[static_cast<std::size_t>(t.b)];
    const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(t.b)];
    double arm = equivalent_radius(block.volume);
    if (a >= 0) {
      const double other = equivalent_radius(model_.blocks[static_cast<std::size_t>(t.a.index)].volume);
      arm *= other / (arm + other);
    }
    contact::ProblemContact c;
    c.first_term = static_cast<int>(problem_.terms.size());
    for (const auto& [body, sign] : {std::pair(a, -1.0), std::pair(b, 1.0)}) {
      if (body < 0) continue;
      problem_.terms.push_back({body, static_cast<int>(problem_.jacobians.size())});
      push_rolling(problem_.jacobians, t.frame, bodies_[static_cast<std::size_t>(body)].ndof, sign * arm);
    }
    c.terms = static_cast<int>(problem_.terms.size()) - c.first_term;
    c.bias[0] = 1;   // its normal row never closes
    c.compliance[0] = 1 / block.mass;
    problem_.contacts.push_back(c);
  }
}

/// Bounds the rolling rows by the normal impulses [N s] that `pressed` tells; by how much that changed them, over what they are.
double IslandStepper::limit_rolling(const std::function<double(const Touch&)>& pressed) {
  double change = 0, all = 0;
  each_rolling(touches_, problem_, [&](const Touch& t, contact::ProblemContact& c) {
    const double bound = t.law->rolling_resistance * std::max(0.0, pressed(t));
    change += std::abs(bound - c.cohesion);
    all += bound;
    c.cohesion = bound;
  });
  return all > 0 ? change / all : 0;
}

/// Solves again while the normal impulses found ask for other bounds than those it was solved with.
bool IslandStepper::solve_rolling(double h, Effort effort) {
  constexpr int most = 30;
  constexpr double same = 1e-9;
  for (int i = 0; i < most; ++i) {
    if (!solve(h, effort)) return false;
    const auto found = [&](const Touch& t) { return problem_.contacts[static_cast<std::size_t>(t.row)].impulse[0]; };
    if (limit_rolling(found) <= std::max(same, h > 0 ? 0.1 * settings_.accuracy : 0.0)) break;
  }
  return true;
}

}  // namespace talus::coupling

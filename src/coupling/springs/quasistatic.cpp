// Light blocks between heavy ones: springs whose oscillation a step does not resolve, on blocks whose own it
// does.
//
// A block of the trapezoid (x_np = x_n + h v_m, m: mean of both ends) is pressed through one of the end rule
// (x_np = x_n + h v_np), whose place follows the loads. By its force at the end of the step the spring
// between them would damp the slow motion at order one, k h per spring. With x a block's generalised
// coordinates, G = dU/dx the forces that all springs on it and its stress take up, K = d2U/dx2 of it alone:
//
//   F_i = F_m,i - k_i sum_b J_i,b e_b,   e_b = 1/2 (K_b + A_b/h^2)^-1 (G_np - G_n)_b                     (1)
//   F_m,i = (U_i(x_np) - U_i(x_n)) / (x_np - x_n),     k_i = (F_np - F_n) / (x_np - x_n)
//
// with the sum over blocks b of the end rule, so that each is evaluated where its own forces balance as at
// the end of the step, but meets its neighbours at mid-step. The energy of blocks and springs changes by
//
//   - 1/2 sum_b |v_np - v_n|^2_M,b - 1/2 sum_b (G_np - G_n)_b . (K_b + A_b/h^2)^-1 (G_np - G_n)_b   <= 0 (2)
//
// for any step, masses and stiffnesses. Of a resolved motion G_np - G_n is h M x^(3), so that e is of order
// h^3 and the rule of order two; an oscillation of a light block is at its end rule's (e = (x_np - x_n)/2)
// and dies within a few steps.
//
// (1) couples the springs of a block; it is met pass by pass, by the solution before. Where all that springs
// connect goes by the end rule, nothing is of order two and the springs have the force at the end alone.
#include "coupling/springs/quasistatic.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {

void find_followers(const IslandContext& in, Step& step) {
  const auto body_of = [&](int block) -> Body* {
    const int l = in.local[static_cast<std::size_t>(block)];
    return l < 0 ? nullptr : &step.bodies[static_cast<std::size_t>(l)];
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (const Touch& t : step.touches) {
      if (t.spring != Mode::spring_end || t.a.kind != Partner::Kind::block || t.b < 0) continue;
      Body *const a = body_of(t.a.index), *const b = body_of(t.b);
      if (a == nullptr) continue;
      for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
        if (one->end_rule && !one->follows && (other->follows || !other->end_rule))
          changed = one->follows = true;
    }
  }
}

void balance_springs(const IslandContext& in, Step& step, double h) {
  if (std::none_of(step.bodies.begin(), step.bodies.end(), [](const Body& b) { return b.follows; })) return;
  struct Balance {
    Mat12 stiffness = Mat12::Zero();                     // K + A/h^2
    Vec12 force = Vec12::Zero(), place = Vec12::Zero();  // G_np - G_n, e
  };
  std::vector<Balance> balances(step.bodies.size());
  std::vector<Mat6> elastic(step.bodies.size());  // of blocks that strain, times their volume [J]
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    const Body& b = step.bodies[i];
    if (!b.follows) continue;
    balances[i].stiffness.topLeftCorner(b.ndof, b.ndof) = b.free.mass.topLeftCorner(b.ndof, b.ndof) / (h * h);
    if (!b.strains()) continue;
    const dda::Model::Block& block = in.model.blocks[static_cast<std::size_t>(b.block)];
    elastic[i] = block.volume * dda::elastic_matrix(block.young, block.poisson);
    balances[i].force.tail<6>() = elastic[i] * (in.state.eps[static_cast<std::size_t>(b.block)] - b.eps0);
  }
  const auto each_follower = [&](const Touch& t, auto&& use) {  // with the row of its normal
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    for (const contact::ContactTerm& term : step.problem.terms_of(c)) {
      if (term.body >= static_cast<int>(step.bodies.size()) ||
          !step.bodies[static_cast<std::size_t>(term.body)].follows)
        continue;
      const int n = step.bodies[static_cast<std::size_t>(term.body)].ndof;
      use(balances[static_cast<std::size_t>(term.body)],
          Eigen::Map<const Eigen::Matrix3Xd>(step.problem.jacobians.data() + term.jacobian, 3, n).row(0), n);
    }
  };
  const auto force = [](const Touch& t, double x) {
    return t.pulls() ? t.normal_law.force(x) : std::max(0.0, t.normal_law.force(std::max(0.0, x)));
  };
  const auto secant = [&](const Touch& t) {  // k_i
    const double way = t.indentation + t.at.gap, rounding = 1e-12 * in.scale.length;
    return std::max(0.0, std::abs(way) > rounding ? (force(t, t.indentation) - force(t, -t.at.gap)) / way
                         : t.indentation < 0 && !t.pulls() ? 0.0
                                                           : t.normal_law.slope(t.indentation));
  };
  const auto on_followers = [&](const Touch& t) {
    return t.row >= 0 && t.b >= 0 && t.spring == Mode::spring_end && !in.deformable_structure(t);
  };
  for (const Touch& t : step.touches) {
    if (!on_followers(t)) continue;
    const double k = secant(t), risen = force(t, t.indentation) - force(t, -t.at.gap);
    each_follower(t, [&](Balance& balance, const auto& j, int n) {
      balance.force.head(n) -= risen * j.transpose();
      balance.stiffness.topLeftCorner(n, n) += k * j.transpose() * j;
    });
  }
  step.each_body([&](Body& b) {
    if (!b.follows) return;
    const auto i = static_cast<std::size_t>(&b - step.bodies.data());
    Balance& balance = balances[i];
    balance.place.head(b.ndof) =
        0.5 * balance.stiffness.topLeftCorner(b.ndof, b.ndof).llt().solve(balance.force.head(b.ndof));
    if (b.strains())
      b.strain_lag = h * (elastic[i] * (0.5 * (in.state.eps[static_cast<std::size_t>(b.block)] - b.eps0) -
                                        balance.place.tail<6>()));
  });
  for (Touch& t : step.touches) {
    if (!on_followers(t)) continue;
    double aside = 0;
    each_follower(
        t, [&](const Balance& balance, const auto& j, int n) { aside += j.dot(balance.place.head(n)); });
    double derivative = 0;
    t.balanced_force = mean_force(t, derivative) - secant(t) * aside;
  }
}

}  // namespace talus::coupling

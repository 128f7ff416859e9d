#include "coupling/solution/over_constrained.hpp"

#include <algorithm>
#include <vector>

namespace talus::coupling {
namespace {

constexpr double facing =
    -0.3;  // cosine of two normals: the rows of any body that no motion frees hold a pair beyond -1/3

contact::ProblemContact& row_of(contact::ContactProblem& problem, const Touch& t) {
  return problem.contacts[static_cast<std::size_t>(t.row)];
}

/// A closed hard row on a block, its normal pointing into the block.
struct Side {
  int block = 0;
  Vec3 normal;
  const Touch* touch = nullptr;
};

bool side_before(const Side& a, const Side& b) { return a.block < b.block; }

}  // namespace

void spare_jammed(std::span<const Touch> touches, double closed, double kept,
                  contact::ContactProblem& problem) {
  std::vector<Side> sides;
  bool any = false;
  for (const Touch& t : touches) {
    if (t.row < 0 || t.b < 0 || t.stiffness > 0 || t.at.gap > closed) continue;
    any = any || row_of(problem, t).bias[0] < 0;
    sides.push_back({t.b, t.normal, &t});
    if (t.a.kind == Partner::Kind::block) sides.push_back({t.a.index, -t.normal, &t});
  }
  if (!any) return;
  std::stable_sort(sides.begin(), sides.end(), side_before);
  std::vector<int> spared;  // all by what was asked at first, whatever their order
  for (const Side& s : sides) {
    if (!(row_of(problem, *s.touch).bias[0] < 0)) continue;
    const bool rebound = s.touch->a.kind != Partner::Kind::structure;
    const auto [first, last] = std::equal_range(sides.begin(), sides.end(), s, side_before);
    if (std::any_of(first, last, [&](const Side& o) {
          return s.normal.dot(o.normal) < facing &&
                 (!rebound || (o.touch->a == s.touch->a && o.touch->b == s.touch->b));
        }))
      spared.push_back(s.touch->row);
  }
  for (const int row : spared) {
    contact::ProblemContact& c = problem.contacts[static_cast<std::size_t>(row)];
    c.bias[0] = 0;
    c.impulse *= kept;
  }
}

double left_inside(double gap, double moving, double h) {
  return gap < 0 ? std::min(0.0, gap + std::min(-0.05 * gap, 1e-3 * moving * h)) : 0.0;
}

bool ask_for_no_motion(std::span<const Touch> touches, contact::ContactProblem& problem, double h) {
  bool any = false;
  for (const Touch& t : touches) {
    if (t.row < 0) continue;
    contact::ProblemContact& c = row_of(problem, t);
    c.impulse = h * (t.frame.transpose() * t.warm);
    if (t.stiffness > 0 || !(c.bias[0] < 0)) continue;
    c.bias[0] = 0;
    any = true;
  }
  return any;
}

void give_a_little(std::span<const Touch> touches, double epsilon, contact::ContactProblem& problem) {
  for (const Touch& t : touches) {
    if (t.row < 0 || t.b < 0 || t.stiffness > 0) continue;
    contact::ProblemContact& c = row_of(problem, t);
    if (c.cohesion > 0 || c.tension > 0) continue;  // a bond does not creep
    double w = 0;
    for (int k = c.first_term; k < c.first_term + c.terms; ++k) {
      const contact::ContactTerm& term = problem.terms[static_cast<std::size_t>(k)];
      const contact::ProblemBody& body = problem.bodies[static_cast<std::size_t>(term.body)];
      const Eigen::Map<const VecX, 0, Eigen::InnerStride<3>> normal(problem.jacobians.data() + term.jacobian,
                                                                    body.ndof);
      w += normal.dot(Eigen::Map<const MatX>(body.mass_inverse, body.ndof, body.ndof) * normal);
    }
    c.compliance.setConstant(epsilon * w);
  }
}

}  // namespace talus::coupling

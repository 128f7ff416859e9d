#include "coupling/solution/spurious_work.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "contact/parallel.hpp"

namespace talus::coupling {
namespace {

constexpr int contacts_at_once = 512;

/// Bodies that are not among the slowest, whose kinetic energies together are at most `at_rest` [J].
std::vector<char> moving(const contact::ContactProblem& problem, double at_rest) {
  std::vector<double> energy;
  for (const contact::ProblemBody& body : problem.bodies) {
    if (body.mass == nullptr) {  // a condensed structure, which is no body at rest
      energy.push_back(std::numeric_limits<double>::infinity());
      continue;
    }
    const Eigen::Map<const MatX> mass(body.mass, body.ndof, body.ndof);
    const Eigen::Map<const VecX> v(problem.v.data() + body.offset, body.ndof);
    energy.push_back(0.5 * v.dot(mass * v));
  }
  std::vector<std::size_t> order(energy.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return energy[a] < energy[b]; });
  std::vector<char> moves(energy.size(), 1);
  double sum = 0;
  for (const std::size_t b : order) {
    if ((sum += energy[b]) > at_rest) break;
    moves[b] = 0;
  }
  return moves;
}

}  // namespace

double spurious_work(const contact::ContactProblem& problem, double at_rest) {
  const std::vector<char> moves = moving(problem, at_rest);
  struct Work {
    double all = 0, reaching = 0;
  };  // whatever the bodies do; what moves
  std::vector<Work> of(problem.contacts.size());
  contact::in_ranges(static_cast<int>(of.size()), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const contact::ProblemContact& c = problem.contacts[static_cast<std::size_t>(i)];
      if (c.impulse.isZero(0)) continue;
      Vec3 u = c.bias + c.compliance.cwiseProduct(c.impulse), resting = Vec3::Zero();
      bool any = false;
      for (const contact::ContactTerm& term : problem.terms_of(c)) {
        const contact::ProblemBody& body = problem.body_of(term);
        const Vec3 part =
            problem.jacobian(term) * Eigen::Map<const VecX>(problem.v.data() + body.offset, body.ndof);
        u += part;
        if (moves[static_cast<std::size_t>(term.body)] != 0)
          any = true;
        else
          resting += part;
      }
      const double work = std::abs(c.impulse[0] * u[0]) + std::max(0.0, c.impulse.tail<2>().dot(u.tail<2>()));
      of[static_cast<std::size_t>(i)] = {work, any ? work + std::abs(c.impulse.dot(resting)) : 0.0};
    }
  });
  double all = 0, reaching = 0;  // one after the other, whatever the threads
  for (const Work& w : of) {
    all += w.all;
    reaching += w.reaching;
  }
  return std::min(all, reaching);
}

}  // namespace talus::coupling

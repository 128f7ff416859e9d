// Velocities of rows by the solution, and the bonds that it breaks.
#include "coupling/rows/bonds.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {

Vec3 row_velocity(const Step& step, const Touch& t) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  return c.bias + step.problem.relative(c, step.problem.v);
}

bool bond_breaks(const IslandContext& in, const Step& step, const Touch& t) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  if (t.broken || !(c.cohesion > t.ploughing || c.tension > 0)) return false;  // ploughed ground is no bond
  if (t.stiffness > 0) return spring_bond_gives_way(step, t);
  const double nearly = contact::tolerances().bond_yields;
  constexpr double times_unsolved = 5;
  const double least = c.friction > 0 ? std::min(c.tension, c.cohesion / c.friction) : c.tension,
               most = c.friction * c.impulse[0] + c.cohesion;
  const bool torn = c.impulse[0] <= -least + nearly * least,
             slid = c.cohesion > 0 && c.impulse.tail<2>().norm() >= (1 - nearly) * most;
  if (!torn && !slid) return false;
  const Vec3 moves = row_velocity(step, t);
  return std::max(moves[0], moves.tail<2>().norm()) > std::max(contact::tolerances().still * in.scale.speed,
                                                               times_unsolved * step.solution.unsolved_speed);
}

bool spring_bond_gives_way(const Step& step, const Touch& t) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const double least = c.friction > 0 ? std::min(c.tension, c.cohesion / c.friction) : c.tension;
  if (c.cohesion > 0 && at_coulomb_bound(c, c.impulse)) return true;  // slid
  return least > 0 ? c.impulse[0] <= -least * (1 - contact::tolerances().at_bound) : c.impulse.isZero(0);
}

}  // namespace talus::coupling

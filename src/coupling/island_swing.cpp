// Friction of what slides through a step while its direction turns.
//
// Friction against the slip at the end of the step alone is of first order: a block that spins as it slides
// ends several per cent of its path off, however small the accuracy asked for. Against the mean of the slips
// at both ends it is of second order, as the trapezoid of the positions.
#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"

namespace talus::coupling {

/// Whether the positions follow this touch's impulse by the trapezoid, and its friction has no spring.
bool IslandStepper::by_trapezoid(const Touch& t) const {
  if (t.b >= 0 && step_.bodies[static_cast<std::size_t>(in_.local[static_cast<std::size_t>(t.b)])].from_start)
    return false;
  return t.mode == Mode::closed || (t.mode == Mode::spring_mean && t.shear_stiffness == 0);
}

void IslandStepper::begin_swing() {
  for (Touch& t : step_.touches) {
    t.swings = false;
    t.slip = t.b < 0 || !in_.island->structures.empty() ? Vec3(Vec3::Zero()) : slip(t, t.at.point_b);
  }
}

/// Along the row's tangents by the solution [m/s].
Eigen::Vector2d IslandStepper::slip_at_end(const Touch& t) const {
  return parting(t).tail<2>() - (t.swings ? t.slip_row : Eigen::Vector2d(Eigen::Vector2d::Zero()));
}

/// Whether each touch slides on, by the solution, as its row supposed. After the first pass all those that
/// turn by less than 60 degrees change to the mean; what that turns round, or stops, changes back. In
/// condensed steps: whether friction takes energy at each pair, sum p_t . (u_t + slip) <= 0. Where it drives,
/// the slip at the end is none that the step resolves, and what drives opposes the mean from the next pass
/// on. But for what a step may make of a block at rest: its slips come and go from step to step, and against
/// the mean of them friction takes nothing.
bool IslandStepper::swing(bool first_pass) {
  bool as_supposed = true;
  if (in_.condensed) {
    const auto work = [&](const Touch& t) {  // twice that of friction [J]
      if (t.row < 0 || t.stiffness > 0) return 0.0;
      const Eigen::Vector2d end = parting(t).tail<2>();
      return t.impulse.tail<2>().dot(t.swings ? end : Eigen::Vector2d(end + t.slip_row));
    };
    for (auto first = step_.touches.begin(); first != step_.touches.end();) {
      const auto last = std::find_if(first, step_.touches.end(),
                                     [&](const Touch& t) { return !(t.a == first->a) || t.b != first->b; });
      double of_pair = 0;
      for (auto t = first; t != last; ++t) of_pair += work(*t);
      const dda::Model::Block* const block =
          first->b < 0 ? nullptr : &in_.model.blocks[static_cast<std::size_t>(first->b)];
      const double rest = block == nullptr
                              ? 0.0
                              : contact::tolerances().gain * in_.settings.accuracy * 0.1 *
                                    in_.settings.accuracy * block->mass * in_.model.gravity.norm() *
                                    in_.scale.length;  // below what gains_energy() tells of a step [J]
      for (auto t = first; t != last && 0.5 * of_pair > rest; ++t)
        if (!t->swings && work(*t) > 0) t->swings = true, as_supposed = false;
      first = last;
    }
    return as_supposed;
  }
  for (Touch& t : step_.touches) {
    if (t.row < 0 || !by_trapezoid(t) || !(first_pass || t.swings) ||
        !(t.slip.norm() > contact::tolerances().slips * in_.scale.speed))
      continue;
    const contact::ProblemContact& c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
    const Eigen::Vector2d end = slip_at_end(t);
    const bool slides =
        c.impulse[0] > 0 && end.norm() > 2 * step_.solution.unsolved_speed;  // more than the solution leaves
    const bool on = slides && end.dot(t.slip_row) > (first_pass ? 0.5 * end.norm() * t.slip_row.norm() : 0.0);
    if (on == t.swings) continue;
    t.swings = on;
    as_supposed = false;
  }
  return as_supposed;
}

/// What the turning of the slip within the step adds to the error of the path until friction has stopped it,
/// relative to block size.
double IslandStepper::swing_error(double h) const {
  double most = 0;
  for (const Touch& t : step_.touches) {
    if (t.row < 0 || !by_trapezoid(t) || !(t.impulse[0] > 0)) continue;
    const double before = t.slip_row.norm();
    if (!(before > contact::tolerances().slips * in_.scale.speed)) continue;
    const Eigen::Vector2d end = slip_at_end(t);
    const double after = end.norm();
    if (!(after > contact::tolerances().slips * in_.scale.speed)) continue;
    const double across = t.slip_row.x() * end.y() - t.slip_row.y() * end.x(),
                 angle = std::atan2(std::abs(across), t.slip_row.dot(end)), sum = before + after;
    const double off =
        t.swings ? angle * angle / 24 + angle * std::abs(before - after) / (6 * sum) : angle / 4;
    most = std::max(most, 0.5 * h * sum * off / in_.scale.length);
  }
  return most;
}

}  // namespace talus::coupling

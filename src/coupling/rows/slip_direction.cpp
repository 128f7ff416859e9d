// Friction of what slides through a step while its direction turns.
//
// Friction against the slip at the end of the step alone is of first order: a block that spins as it slides
// ends several per cent of its path off, however small the accuracy asked for. Against the mean of the slips
// at both ends it is of second order, as the trapezoid of the positions.
#include "coupling/rows/slip_direction.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/rows/bonds.hpp"

namespace talus::coupling {
namespace {

/// Whether the positions follow this touch's impulse by the trapezoid, and its friction has no spring.
bool by_trapezoid(const IslandContext& in, const Step& step, const Touch& t) {
  if (t.b >= 0 && step.bodies[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)])].from_start)
    return false;
  return t.mode == Mode::closed || (t.mode == Mode::spring_mean && t.shear_stiffness == 0);
}

/// Along the row's tangents by the solution [m/s].
Eigen::Vector2d slip_at_end(const Step& step, const Touch& t) {
  return row_velocity(step, t).tail<2>() - (t.swings ? t.slip_row : Eigen::Vector2d(Eigen::Vector2d::Zero()));
}

}  // namespace

void begin_friction_direction(const IslandContext& in, Step& step) {
  for (Touch& t : step.touches) {
    t.swings = false;
    t.slip = Vec3::Zero();
    if (t.b < 0 || !in.island->structures.empty()) continue;
    t.acts_at = acting_point(in, t);
    t.slip = slip_velocity(in, t, t.acts_at);
  }
}

bool turn_friction(const IslandContext& in, Step& step, bool first_pass) {
  bool as_supposed = true;
  if (in.condensed) {
    const auto work = [&](const Touch& t) {  // twice that of friction [J]
      if (t.row < 0 || t.stiffness > 0) return 0.0;
      const Eigen::Vector2d end = row_velocity(step, t).tail<2>();
      return t.impulse.tail<2>().dot(t.swings ? end : Eigen::Vector2d(end + t.slip_row));
    };
    for (auto first = step.touches.begin(); first != step.touches.end();) {
      const auto last = std::find_if(first, step.touches.end(),
                                     [&](const Touch& t) { return !(t.a == first->a) || t.b != first->b; });
      double of_pair = 0;
      for (auto t = first; t != last; ++t) of_pair += work(*t);
      const dda::Model::Block* const block =
          first->b < 0 ? nullptr : &in.model.blocks[static_cast<std::size_t>(first->b)];
      const double rest = block == nullptr
                              ? 0.0
                              : contact::tolerances().gain * in.settings.accuracy * 0.1 *
                                    in.settings.accuracy * block->mass * in.model.gravity.norm() *
                                    in.scale.length;  // below what gains_energy() tells of a step [J]
      for (auto t = first; t != last && 0.5 * of_pair > rest; ++t)
        if (!t->swings && work(*t) > 0) t->swings = true, as_supposed = false;
      first = last;
    }
    return as_supposed;
  }
  for (Touch& t : step.touches) {
    if (t.row < 0 || !by_trapezoid(in, step, t) || !(first_pass || t.swings) ||
        !(t.slip.norm() > contact::tolerances().slips * in.scale.speed))
      continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const Eigen::Vector2d end = slip_at_end(step, t);
    const bool slides =
        c.impulse[0] > 0 && end.norm() > 2 * step.solution.unsolved_speed;  // more than the solution leaves
    const bool on = slides && end.dot(t.slip_row) > (first_pass ? 0.5 * end.norm() * t.slip_row.norm() : 0.0);
    if (on == t.swings) continue;
    t.swings = on;
    as_supposed = false;
  }
  return as_supposed;
}

double friction_direction_error(const IslandContext& in, const Step& step, double h) {
  double most = 0;
  for (const Touch& t : step.touches) {
    if (t.row < 0 || !by_trapezoid(in, step, t) || !(t.impulse[0] > 0)) continue;
    const double before = t.slip_row.norm();
    if (!(before > contact::tolerances().slips * in.scale.speed)) continue;
    const Eigen::Vector2d end = slip_at_end(step, t);
    const double after = end.norm();
    if (!(after > contact::tolerances().slips * in.scale.speed)) continue;
    const double across = t.slip_row.x() * end.y() - t.slip_row.y() * end.x(),
                 angle = std::atan2(std::abs(across), t.slip_row.dot(end)), sum = before + after;
    const double off =
        t.swings ? angle * angle / 24 + angle * std::abs(before - after) / (6 * sum) : angle / 4;
    most = std::max(most, 0.5 * h * sum * off / in.scale.length);
  }
  return most;
}

}  // namespace talus::coupling

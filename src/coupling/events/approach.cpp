// Which approach is an impact, which parting none.
#include "coupling/events/approach.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {
namespace {

/// No point of one of the two moves faster as the other's centroid sees it [m/s].
double relative_speed(const IslandContext& in, const Touch& t) {
  Vec3 v = -partner_velocity(in.state, in.env, t);
  double turning = 0;
  const auto turn = [&](int block) {
    const auto k = static_cast<std::size_t>(block);
    turning += in.model.blocks[k].shape->radius * in.state.w[k].norm();
    return in.state.v[k];
  };
  if (t.a.kind == Partner::Kind::block) v = -turn(t.a.index);
  if (t.b >= 0) v += turn(t.b);
  return v.norm() + turning;
}

}  // namespace

Vec3 acting_point(const IslandContext& in, const Touch& t) {
  const Pose pose_a = t.a.kind == Partner::Kind::block ? dda::pose(in.state, t.a.index) : Pose{};
  return acts_between(normal_owner(t, in.model, in.env, &pose_a), t.at.point_a, t.at.point_b);
}

Vec3 slip_velocity(const IslandContext& in, const Touch& t, const Vec3& x) {
  const Vec3 u = point_velocity(in.state, t.b, x) - (t.a.kind == Partner::Kind::block
                                                         ? point_velocity(in.state, t.a.index, x)
                                                         : partner_velocity(in.state, in.env, t));
  return u - t.at.normal * t.at.normal.dot(u);
}

double slow_speed(const IslandContext& in, const Touch& t) {
  return contact::tolerances().lowest_bounce * in.settings.accuracy *
         std::max(relative_speed(in, t), std::sqrt(2 * in.model.gravity.norm() * in.scale.length));
}

double impact_speed(const IslandContext& in, const Touch& t) {
  const double fall = std::sqrt(in.model.gravity.norm() * in.scale.length), relative = relative_speed(in, t),
               motion = fall > 0 ? std::min(relative, fall) : relative;
  return std::max(t.stiffness > 0 ? in.gentle_speed() : contact::tolerances().still * in.scale.speed,
                  (t.persistent ? in.scale.part_of_error() : in.scale.part_of_none()) * motion);
}

bool meets_hard(const IslandContext& in, const Touch& t) {
  return t.at.gap <= in.scale.touch_gap() && !in.deformable_structure(t) &&
         (t.stiffness == 0 || t.law->restitution);
}

bool spring_presses(const IslandContext& in, const Touch& t) {
  return t.stiffness > 0 &&
         (t.persistent || t.at.gap < -contact::tolerances().overlap_none * in.scale.length);
}

bool rebounds(const IslandContext& in, const Touch& t) {
  return t.stiffness == 0 && t.law->restitution.value_or(0) > 0 &&
         t.approach < -std::max(slow_speed(in, t), impact_speed(in, t));
}

bool rebound_waits(const IslandContext& in, const Step& step) {
  return std::ranges::any_of(step.touches,
                             [&](const Touch& t) { return rebounds(in, t) && meets_hard(in, t); });
}

bool any_contact(const IslandContext& in, const Step& step) {
  for (const Body& b : step.bodies)
    if (!in.model.blocks[static_cast<std::size_t>(b.block)].fixed_points.empty()) return true;
  for (const Touch& t : step.touches)
    // A spring that meets has a row from here on; on which side of zero round-off put its gap must not tell.
    if (t.stiffness > 0 ? t.at.gap <= 0 || (t.at.gap <= in.scale.touch_gap() && t.approach < 0) || t.pulls()
                        : t.at.gap <= in.scale.touch_gap() || (t.at.gap <= in.scale.near_gap() &&
                                                               std::abs(t.approach) <= impact_speed(in, t)))
      return true;
  return false;
}

}  // namespace talus::coupling

// Ways of the bodies within a step.
#include "coupling/events/step_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {

contact::Motion motion_of(const IslandContext& in, const Step& step, int block, bool time_stepped) {
  contact::Motion m;
  m.start = dda::pose(in.state, block);
  const int l = in.local[static_cast<std::size_t>(block)];
  if (l < 0) return m;
  const Body& b = step.bodies[static_cast<std::size_t>(l)];
  m.start = b.start;
  m.displacement = in.state.c[static_cast<std::size_t>(block)] - b.start.c;
  if (!time_stepped || b.impulse.isZero(0))
    m.half_gravity_step =
        m.displacement - step.length * b.v0.head<3>();  // leaves with the velocity that it has
  m.rotation = dda::rotation_vector(in.state.q[static_cast<std::size_t>(block)] * b.q0.conjugate());
  return m;
}

StepMotion::StepMotion(const IslandContext& in, const Step& step, bool time_stepped)
    : in_(in), step_(step), lumped_(time_stepped) {}

StepMotion::StepMotion(const IslandContext& in, const Step& step, std::vector<contact::Motion> of_bodies)
    : in_(in), step_(step), motions_(std::move(of_bodies)) {}

contact::Motion StepMotion::of(int block) const {
  const int l = in_.local[static_cast<std::size_t>(block)];
  return l < 0 || motions_.empty() ? motion_of(in_, step_, block, lumped_)
                                   : motions_[static_cast<std::size_t>(l)];
}

double StepMotion::time_of_impact(const CandidatePair& pair, double tolerance) const {
  const Polyhedron& shape = *in_.model.blocks[static_cast<std::size_t>(pair.b)].shape;
  const contact::Motion motion = of(pair.b);
  const auto index = static_cast<std::size_t>(pair.a.index);
  switch (pair.a.kind) {
    case Partner::Kind::block:
      return contact::time_of_impact(*in_.model.blocks[index].shape, of(pair.a.index), shape, motion,
                                     tolerance);
    case Partner::Kind::plane:
      return contact::time_of_impact(in_.env.planes[index], shape, motion, tolerance);
    case Partner::Kind::terrain: return contact::time_of_impact(*in_.env.terrain, shape, motion, tolerance);
    case Partner::Kind::structure:
      return contact::time_of_impact(*in_.env.structures[index].index, shape, motion, tolerance);
  }
  return 2;
}

double StepMotion::path(const CandidatePair& pair) const {
  const contact::Motion b = of(pair.b);
  Vec3 moved = b.displacement, bulge = b.half_gravity_step;
  double turned = in_.model.blocks[static_cast<std::size_t>(pair.b)].shape->radius * b.rotation.norm();
  if (pair.a.kind == Partner::Kind::block) {
    const contact::Motion a = of(pair.a.index);
    moved -= a.displacement;
    bulge -= a.half_gravity_step;
    turned += in_.model.blocks[static_cast<std::size_t>(pair.a.index)].shape->radius * a.rotation.norm();
  }
  return moved.norm() + bulge.norm() / 4 + turned;
}

Vec3 carried_back(const IslandContext& in, const Step& step, int block, const Vec3& x) {
  const int l = block < 0 ? -1 : in.local[static_cast<std::size_t>(block)];
  if (l < 0) return x;
  const Pose now = dda::pose(in.state, block);
  const Pose& then = step.bodies[static_cast<std::size_t>(l)].start;
  return then.c + then.F * (now.F.inverse() * (x - now.c));
}

Touch carried_back(const IslandContext& in, const Step& step, Touch t) {
  const int a = t.a.kind == Partner::Kind::block ? t.a.index : -1;
  const Pose pose_a = a >= 0 ? dda::pose(in.state, a) : Pose{};
  const NormalOwner owner = normal_owner(t, in.model, in.env, &pose_a);
  const int carrier = owner == NormalOwner::a ? a : owner == NormalOwner::b ? t.b : -1;
  const Vec3 x = carrier >= 0 ? in.state.c[static_cast<std::size_t>(carrier)] : Vec3(Vec3::Zero());
  t.at.normal =
      (carried_back(in, step, carrier, x + t.at.normal) - carried_back(in, step, carrier, x)).normalized();
  t.at.point_b = carried_back(in, step, t.b, t.at.point_b);
  t.at.point_a = carried_back(in, step, a, t.at.point_a);
  t.at.gap = t.at.normal.dot(t.at.point_b - t.at.point_a);
  return t;
}

double thickness(const dda::Model& model, const CandidatePair& pair) {
  const double b = model.blocks[static_cast<std::size_t>(pair.b)].shape->inradius;
  return pair.a.kind == Partner::Kind::block
             ? std::min(b, model.blocks[static_cast<std::size_t>(pair.a.index)].shape->inradius)
             : b;
}

}  // namespace talus::coupling

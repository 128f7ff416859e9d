#include "coupling/motion/motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dda/kinematics.hpp"

namespace talus::coupling {
namespace {

/// The rotation vector from a to b, of all that differ by whole turns the one nearest to `expected`.
Vec3 turn_between(const Quat& a, const Quat& b, const Vec3& expected) {
  const Vec3 turn = dda::rotation_vector(b * a.conjugate());
  const double angle = turn.norm();
  const Vec3 axis = angle > 0             ? Vec3(turn / angle)
                    : expected.norm() > 1 ? Vec3(expected.normalized())
                                          : Vec3(Vec3::Zero());
  const double turns = std::round((axis.dot(expected) - angle) / (2 * std::numbers::pi));
  return turn + 2 * std::numbers::pi * turns * axis;
}

bool strains(const dda::Model::Block& b) { return b.deformable; }

/// Angular momentum about the centroid.
Vec3 spin_momentum(const dda::Model::Block& b, const dda::BlockState& s) {
  const Mat3 rotation = s.q.toRotationMatrix();
  if (!strains(b)) return rotation * (b.inertia * (rotation.transpose() * s.w));
  const Mat12 m = dda::mass_matrix(b, dda::pose(s), rotation);
  return m.block<3, 3>(3, 3) * s.w + m.block<3, 6>(3, 6) * s.eps_rate;
}

/// Spin that has this angular momentum, where and as strained as the block is.
Vec3 spin_of(const dda::Model::Block& b, const dda::BlockState& s, const Vec3& momentum) {
  const Mat3 rotation = s.q.toRotationMatrix();
  if (!strains(b)) return rotation * (b.inertia.inverse() * (rotation.transpose() * momentum));
  const Mat12 m = dda::mass_matrix(b, dda::pose(s), rotation);
  return m.block<3, 3>(3, 3).inverse() * (momentum - m.block<3, 6>(3, 6) * s.eps_rate);
}

dda::BlockState flown(const dda::Model::Block& b, const Vec3& gravity, const dda::BlockState& start, double s,
                      double drag) {
  dda::BlockState now = start;
  now.c = start.c + s * start.v + (0.5 * s * s) * gravity;
  now.v = start.v + s * gravity;
  if (drag > 0) {
    const dda::Dragged path = dda::drag_path(drag, s, start.v, gravity);
    now.c = start.c + path.way;
    now.v = path.velocity;
  }
  if (start.w.isZero(0)) return now;
  const Vec3 momentum = spin_momentum(b, start);
  now.q = dda::rotate_free(b, b.inertia, start.q, momentum, s);
  now.w = spin_of(b, now, momentum);
  return now;
}

/// True if free flow leads from one state to the other, to round-off.
bool flies(const dda::Model::Block& b, const Vec3& gravity, double t1, double h, const dda::BlockState& start,
           const dda::BlockState& end, double drag) {
  if (strains(b)) return false;
  constexpr double round_off = 64 * std::numeric_limits<double>::epsilon(), of_turns = 1e-11;
  const dda::BlockState free = flown(b, gravity, start, h, drag);
  const double speed = start.v.norm() + end.v.norm();
  return (free.v - end.v).norm() <= round_off * (speed + t1 * gravity.norm()) &&
         (free.c - end.c).norm() <= round_off * (start.c.norm() + end.c.norm() + t1 * speed) &&
         (free.w - end.w).norm() <= of_turns * (1 + t1) * end.w.norm() &&
         dda::rotation_vector(free.q * end.q.conjugate()).norm() <= of_turns * (1 + t1);
}

double dissipated(const Ledger& l) { return l.dissipated(); }

}  // namespace

double MotionPeaks::add(const dda::Model::Block& block, const dda::BlockState& state) {
  const dda::BlockEnergy e = dda::energy(block, Vec3::Zero(), state);
  const double now = e.translational + e.rotational + e.straining;
  add({.speed = state.v.norm(), .spin = state.w.norm(), .kinetic = now});
  return now;
}

void MotionPeaks::add(const MotionPeaks& other) {
  speed = std::max(speed, other.speed);
  spin = std::max(spin, other.spin);
  kinetic = std::max(kinetic, other.kinetic);
}

MotionSegment motion_segment(const dda::Model& model, int block, double t0, double t1,
                             const dda::BlockState& start, const dda::BlockState& end, bool all_at_start,
                             double drag) {
  MotionSegment segment{block, MotionSegment::Path::trapezoid, t0, t1, start, end, drag};
  const double h = t1 - t0;
  if (flies(model.blocks[static_cast<std::size_t>(block)], model.gravity, t1, h, start, end, drag)) {
    segment.path = MotionSegment::Path::flight;
    return segment;
  }
  const Vec3 way = end.c - start.c;
  const double beside_line = (way - h * end.v).norm(),
               beside_trapezoid = (way - 0.5 * h * (start.v + end.v)).norm();
  if (all_at_start || beside_line < 0.5 * beside_trapezoid) segment.path = MotionSegment::Path::straight;
  return segment;
}

dda::BlockState evaluate(const MotionSegment& segment, double t, const dda::Model& model) {
  if (t >= segment.t1) return segment.end;
  const dda::Model::Block& b = model.blocks[static_cast<std::size_t>(segment.block)];
  const dda::BlockState &start = segment.start, &end = segment.end;
  const double h = segment.t1 - segment.t0, s = std::max(0.0, t - segment.t0), r = s / h;
  if (segment.path == MotionSegment::Path::flight) return flown(b, model.gravity, start, s, segment.drag);
  dda::BlockState now;
  now.eps = start.eps + r * (end.eps - start.eps);
  now.eps_rate = start.eps_rate + r * (end.eps_rate - start.eps_rate);
  Vec3 turn;
  if (segment.path == MotionSegment::Path::straight) {
    now.c = start.c + r * (end.c - start.c);
    now.v = start.v + r * (end.v - start.v);
    turn = r * turn_between(start.q, end.q, h * end.w);
  } else {
    const auto along = [&](const Vec3& v0, const Vec3& v1, const Vec3& way) {
      return Vec3(s * v0 + 0.5 * s * r * (v1 - v0) + r * r * (3 - 2 * r) * (way - 0.5 * h * (v0 + v1)));
    };
    now.c = start.c + along(start.v, end.v, end.c - start.c);
    now.v = start.v + r * (end.v - start.v);
    if (segment.drag > 0) {
      const Vec3 force = dda::drag_acceleration(segment.drag, h, start.v, end.v);  // over mass
      const dda::Dragged path = dda::drag_path(segment.drag, s, start.v, force),
                         whole = dda::drag_path(segment.drag, h, start.v, force);
      now.c = start.c + path.way + r * r * (3 - 2 * r) * (end.c - start.c - whole.way);
      now.v = path.velocity;
    }
    turn = along(start.w, end.w, turn_between(start.q, end.q, 0.5 * h * (start.w + end.w)));
  }
  now.q = turn.isZero(0) ? start.q : (dda::rotation_by(turn) * start.q).normalized();
  if (start.w.isZero(0) && end.w.isZero(0)) return now;
  const Vec3 before = spin_momentum(b, start), after = spin_momentum(b, end);
  now.w = spin_of(b, now, before + r * (after - before));
  return now;
}

Ledger evaluate(const WorkSegment& segment, double t, double energy) {
  if (t >= segment.t1) return segment.after;
  const Ledger &before = segment.before, &after = segment.after;
  const double r = std::max(0.0, t - segment.t0) / (segment.t1 - segment.t0);
  const double work = dissipated(after) + after.contact - dissipated(before) - before.contact;
  const double unbalanced = segment.energy_after - segment.energy_before + work;  // of the whole step
  const double done = segment.energy_before - energy + r * unbalanced;
  const double part = work != 0 ? std::clamp(done / work, 0.0, 1.0) : r;
  const auto between = [&](double a, double b) { return a + part * (b - a); };
  Ledger now;
  now.friction_work = between(before.friction_work, after.friction_work);
  now.damping_work = between(before.damping_work, after.damping_work);
  now.yield_work = between(before.yield_work, after.yield_work);
  now.ploughing_work = between(before.ploughing_work, after.ploughing_work);
  now.vegetation_work = between(before.vegetation_work, after.vegetation_work);
  now.algorithmic = between(before.algorithmic, after.algorithmic);
  now.contact = between(before.contact, after.contact);
  now.structure_contact_work = between(before.structure_contact_work, after.structure_contact_work);
  now.blocks_contact_work = between(before.blocks_contact_work, after.blocks_contact_work);
  // What is given on the way and taken back by the end: springs that are pressed and let go store it, the
  // rest is the error of what lies between the ends.
  const double on_the_way = done - part * work;
  const double stored = before.contact > 0 || after.contact > 0 ? std::max(on_the_way, -now.contact) : 0.0;
  now.contact += stored;
  now.algorithmic += on_the_way - stored;
  return now;
}

bool falls_into(std::span<const double> times, double t0, double t1) {
  const auto next = std::upper_bound(times.begin(), times.end(), t0);
  return next != times.end() && *next <= t1;
}

}  // namespace talus::coupling

// Contact springs: which rule a step uses for each, and how long it may be.
//
//   spring_mean  p = -h k (g_n + g_np) / 2  positions by the trapezoid: order 2, keeps energy, for a step
//                                           that resolves the spring
//   spring_end   p = -h k g_np              positions and strains by the velocities at the end:
//                                           L-stable, rests where it is; the energy that it takes of what it
//                                           does not resolve is algorithmic (and quasistatic.cpp)
//
// Each block has the rule that its own frequency asks for. By accuracy, an oscillation of amplitude V/w that
// may not be lost is resolved. A block of mass m that others press by F on its springs may lose one that
// never opens its contacts and is beneath the accuracy:
//
//   V <= max(sqrt(2 g a_q), w min(accuracy L, F/(m w^2)))
//   a_q = 0.1 accuracy L, the height of a rebound that is none
#include "coupling/springs/spring_rules.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/springs/bond_swing.hpp"
#include "coupling/springs/quasistatic.hpp"

namespace talus::coupling {
namespace {

/// Gives the end rule of the one block of a hard touch that is near enough to be a row to the other; true if
/// it had not yet.
bool share_end_rule(const IslandContext& in, Step& step, const Touch& t, double h) {
  if (t.stiffness > 0 || t.b < 0 || t.a.kind != Partner::Kind::block) return false;
  if (t.at.gap > in.scale.touch_gap() &&
      t.at.gap + h * t.approach - h * h * in.model.gravity.norm() >= in.scale.row_reach())
    return false;
  const int a = in.local[static_cast<std::size_t>(t.a.index)], b = in.local[static_cast<std::size_t>(t.b)];
  if (a < 0 || b < 0) return false;
  bool &of_a = step.bodies[static_cast<std::size_t>(a)].end_rule,
       &of_b = step.bodies[static_cast<std::size_t>(b)].end_rule;
  if (of_a == of_b) return false;
  return of_a = of_b = true;
}

}  // namespace
Vec12 point_row(const dda::Model::Block& block, const Mat3& rotation, const Mat3& strain_map, const Vec3& r,
                const Vec3& n) {
  Vec12 j = Vec12::Zero();
  j.head<3>() = n;
  j.segment<3>(3) = r.cross(n);
  if (!block.deformable) return j;
  const Vec3 X = strain_map * r, m = rotation.transpose() * n;
  for (int e = 0; e < 6; ++e) {
    Vec6 unit = Vec6::Zero();
    unit[e] = 1;
    j[6 + e] = m.dot(dda::strain_tensor(unit) * X);
  }
  return j;
}

namespace {

/// Blocks on their springs, as the springs and loads of an island give them.
class SpringFrequencies {
 public:
  SpringFrequencies(const IslandContext& in, Step& step);
  /// Frequency and speed of the oscillation that the spring of a contact takes part in, and whether it
  /// counts.
  void set(Touch& t) const;

 private:
  /// Of a body.
  struct Weight {
    Mat12 inverse;  // generalised mass
    Mat3 rotation, strain_map;
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    double forces = 0;   // sum of their sizes [N]
    double rate_sq = 0;  // trace over its closed springs
  };
  /// Of a contact: a block on its springs.
  struct Side {
    double rate_sq = 0, quiet = 0;
    Vec3 acceleration = Vec3::Zero();  // at the contact [m/s^2]
    double swing(const Vec3& n, double approach, bool loaded) const {
      return std::sqrt(approach * approach + (loaded ? std::pow(n.dot(acceleration), 2) / rate_sq : 0.0));
    }
  };
  int body_of(const Partner& a) const {
    return a.kind == Partner::Kind::block ? in_.local[static_cast<std::size_t>(a.index)] : -1;
  }
  std::size_t block_of(int body) const {
    return static_cast<std::size_t>(step_.bodies[static_cast<std::size_t>(body)].block);
  }
  bool reached(const Touch& t) const { return t.at.gap <= 1e-3 * in_.scale.length; }
  /// Squared frequency of the spring with the body alone; 0 of none [1/s^2].
  double rate_sq(const Touch& t, int body, const Vec3& x) const;
  void add_loads(const Touch& t);
  Vec3 acceleration_at(int body, const Vec3& x) const;
  Side side(const Touch& t, int body, const Vec3& x) const;

  const IslandContext& in_;
  const Step& step_;
  std::vector<Weight> weights_;
};

SpringFrequencies::SpringFrequencies(const IslandContext& in, Step& step)
    : in_(in), step_(step), weights_(step.bodies.size()) {
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const int block = step.bodies[i].block;
    Mat12 mass;
    dda::impulse_mass(in.model, in.state, block, !in.model.blocks[static_cast<std::size_t>(block)].deformable,
                      mass, weights_[i].inverse);
    weights_[i].rotation = in.state.rotation(block);
    weights_[i].strain_map = dda::pose(in.state, block).F.inverse();
  }
  for (const Touch& t : step.touches)
    if (t.b >= 0) add_loads(t);  // others are between structures
  for (std::size_t i = 0; i < weights_.size(); ++i) step.bodies[i].spring_rate_sq = weights_[i].rate_sq;
}

double SpringFrequencies::rate_sq(const Touch& t, int body, const Vec3& x) const {
  if (body < 0) return 0;
  const std::size_t k = block_of(body);
  const Weight& w = weights_[static_cast<std::size_t>(body)];
  const Vec12 j = point_row(in_.model.blocks[k], w.rotation, w.strain_map, x - in_.state.c[k], t.at.normal);
  return t.stiffness * j.dot(w.inverse * j);
}

void SpringFrequencies::add_loads(const Touch& t) {
  Vec3 f = t.warm;  // hard contacts and friction: as in the last step
  if (t.stiffness > 0) {
    f -= t.at.normal * t.at.normal.dot(f);
    f += t.at.normal * t.normal_law.force(t.pulls() ? -t.at.gap : std::max(0.0, -t.at.gap));
  }
  const auto load = [&](int body, const Vec3& x, const Vec3& force) {
    if (body < 0) return;
    Weight& w = weights_[static_cast<std::size_t>(body)];
    if (t.stiffness > 0 && reached(t)) w.rate_sq += rate_sq(t, body, x);
    w.force += force;
    w.forces += force.norm();
    w.moment += (x - in_.state.c[block_of(body)]).cross(force);
  };
  load(in_.local[static_cast<std::size_t>(t.b)], t.at.point_b, f);
  load(body_of(t.a), t.at.point_a, -f);
}

Vec3 SpringFrequencies::acceleration_at(int body, const Vec3& x) const {
  const Weight& w = weights_[static_cast<std::size_t>(body)];
  const std::size_t k = block_of(body);
  const Vec3 spin = w.inverse.block<3, 3>(3, 3) * w.moment;
  return in_.model.gravity + w.force / in_.model.blocks[k].mass + spin.cross(x - in_.state.c[k]);
}

SpringFrequencies::Side SpringFrequencies::side(const Touch& t, int body, const Vec3& x) const {
  Side s;
  if (body < 0) return s;
  const Weight& w = weights_[static_cast<std::size_t>(body)];
  s.acceleration = acceleration_at(body, x);
  s.rate_sq = std::max(w.rate_sq, rate_sq(t, body, x));  // of a spring that nothing else presses on
  const double rate = 0.5 * std::sqrt(s.rate_sq),
               pressed = 0.5 * (w.forces - w.force.norm()) /
                         in_.model.blocks[block_of(body)].mass;  // forces in balance with each other
  s.quiet = std::max(
      in_.gentle_speed(),
      rate > 0 ? rate * std::min(in_.settings.accuracy * in_.scale.length, pressed / (rate * rate)) : 0.0);
  return s;
}

void SpringFrequencies::set(Touch& t) const {
  const int a = body_of(t.a), b = in_.local[static_cast<std::size_t>(t.b)];
  const Side of_a = side(t, a, t.at.point_a), of_b = side(t, b, t.at.point_b);
  const bool loaded = t.at.gap < 0 || t.pulls(), a_is_slow = a >= 0 && of_a.rate_sq < of_b.rate_sq;
  t.rate_sq = of_a.rate_sq + of_b.rate_sq;
  t.quiet_speed = a >= 0 ? std::min(of_a.quiet, of_b.quiet) : of_b.quiet;
  // Of both sides against each other at the frequency of the faster one; where that is quiet, of the slower
  // one alone.
  Side both = a_is_slow || a < 0 ? of_b : of_a;
  both.acceleration = of_b.acceleration - of_a.acceleration;
  both.rate_sq = t.rate_sq;
  const Side& slow = a_is_slow ? of_a : of_b;
  t.swing_rate = std::sqrt(t.rate_sq);
  t.swing_speed = both.swing(t.at.normal, t.approach, loaded);
  t.energetic = t.swing_speed > both.quiet;
  if (!t.energetic && a >= 0 && slow.rate_sq > 0) {
    t.swing_rate = std::sqrt(slow.rate_sq);
    t.swing_speed = slow.swing(t.at.normal, t.approach, loaded);
    t.energetic = t.swing_speed > slow.quiet;
  }
  // A crushing contact rebounds by its elastic energy, no farther.
  if (t.normal_law.limit > 0)
    t.swing_speed = std::min(t.swing_speed, 0.5 * t.swing_rate * t.normal_law.limit / t.normal_law.stiffness);
}

}  // namespace

void estimate_spring_frequencies(const IslandContext& in, Step& step) {
  if (std::ranges::none_of(step.touches, [](const Touch& t) { return t.stiffness > 0; })) return;
  const SpringFrequencies frequencies(in, step);
  for (Touch& t : step.touches)
    if (t.stiffness != 0 && t.b >= 0) frequencies.set(t);
  // A bond, or cohesion, that would bear its load at rest may be lost as it swings about that: the spring's
  // greatest force follows from the amplitude, however small that is beside the accuracy of positions.
  const auto asked = [&](const Touch& t) { return t.b >= 0 && !t.energetic && loses_strength(in, t); };
  if (std::ranges::none_of(step.touches, asked)) return;
  const std::vector<bool> gives_way = may_give_way(in, step);
  for (std::size_t i = 0; i < gives_way.size(); ++i)
    if (gives_way[i]) step.touches[i].energetic = true;
}

void choose_spring_rules(const IslandContext& in, Step& step, double h, bool time_stepped) {
  for (Body& b : step.bodies)
    b.end_rule = b.follows = b.strains_at_end = false, b.strain_lag.setZero(), b.leapfrog = in.leapfrog(),
    b.guarded = time_stepped && !in.leapfrog();
  const auto body_of = [&](int block) -> Body* {
    const int l = in.local[static_cast<std::size_t>(block)];
    return l < 0 ? nullptr : &step.bodies[static_cast<std::size_t>(l)];
  };
  const double fall = 0.5 * h * h * in.model.gravity.norm();
  bool any_end = false;
  for (Touch& t : step.touches) {
    t.spring = Mode::idle;
    if (t.stiffness == 0) continue;
    if (in.leapfrog()) {
      // The step before counts, too: the leapfrog's force lies between both.
      if (t.at.gap + h * t.approach - fall < 0 || t.at.gap <= 0 || t.at.gap - h * t.approach < 0)
        t.spring = Mode::spring_secant;
      continue;
    }
    // In event driven islands an onset fast enough to matter ends the step; the others are rows from the
    // start. It may gain its speed on the way.
    const double onset_sq = t.approach * t.approach + 2 * in.model.gravity.norm() * std::max(0.0, t.at.gap);
    const bool meets =
        t.at.gap + h * t.approach - fall < 0 &&
        (time_stepped || t.at.gap <= in.scale.touch_gap() || onset_sq < t.quiet_speed * t.quiet_speed);
    if (t.at.gap > 0 && !meets && !t.pulls()) continue;
    t.spring = h * std::sqrt(t.rate_sq) <= resolved_phase ? Mode::spring_mean : Mode::spring_end;
    if (t.spring == Mode::spring_mean || in.deformable_structure(t))
      continue;  // a condensed step is the trapezoid's, whatever the spring's rule
    // Of the two the one whose own frequency the step does not resolve, both where they share it.
    any_end = true;
    Body *const b = body_of(t.b), *const a = t.a.kind == Partner::Kind::block ? body_of(t.a.index) : nullptr;
    const double unresolved = 0.5 * resolved_phase * resolved_phase / (h * h),
                 of_a = a != nullptr ? a->spring_rate_sq : 0.0, of_b = t.rate_sq - of_a;
    if (a != nullptr && (of_a > unresolved || of_a > of_b)) a->end_rule = true;
    if (of_b > unresolved || of_b >= of_a) b->end_rule = true;
  }
  step.sprung =
      in.island->structures.empty() && std::any_of(step.touches.begin(), step.touches.end(),
                                                   [](const Touch& t) { return t.spring != Mode::idle; });
  if (!any_end) return;
  // Those that touch share it: held by its velocity at the end to one that goes half as far, one would part
  // from the other by the other half.
  for (bool changed = time_stepped; changed;) {
    changed = false;
    for (const Touch& t : step.touches)
      if (t.spring == Mode::idle && !in.deformable_structure(t))
        changed = share_end_rule(in, step, t, h) || changed;
  }
  for (Touch& t : step.touches) {
    if (t.spring == Mode::idle || in.deformable_structure(t)) continue;
    const Body* const a = t.a.kind == Partner::Kind::block ? body_of(t.a.index) : nullptr;
    t.spring = body_of(t.b)->end_rule || (a != nullptr && a->end_rule) ? Mode::spring_end : Mode::spring_mean;
  }
  find_followers(in, step);
}

}  // namespace talus::coupling

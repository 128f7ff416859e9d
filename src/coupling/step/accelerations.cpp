// Error of a step by what the contacts allow at both of its ends.
//
// Within a step the contacts are those of its start. A face that ends, a friction that changes, a slide that
// stops, a bond that breaks show in the accelerations that the contacts allow at its end, wherever in the
// step they happen:
//
//   e = max(t_c, h) h |a - (a_0 + a_1) / 2|,   a = (v_np - v_n) / h
//   accepted if  e <= eta = accuracy^(3/2) r
//
// The trapezoid of smooth motion has e = O(h^3); an event at the middle of a step has the velocity error h
// |a_1 - a_0|, which acts over the time t_c in which a fall takes up what is off. a_0 and a_1 solve the
// contact problem of accelerations over the closed contacts, those whose gap is within the touch band and
// whose normal velocity is below v_o:
//
//   A (a - a_free) = sum J^T f,   0 <= f_n  _|_  J_n a + c_n >= 0
//   f_t by Coulomb: against the slip where |u_t| > v_o, else against the slip to be
//   c = n . (x''_b - x''_a) + 2 n' . (x'_b - x'_a)   centripetal accelerations, turning of the normal
//
// symbol   meaning                                                          unit
// a        generalised acceleration                                         m/s^2, rad/s^2
// r        radius of the block                                              m
// t_c      (r / g)^(1/2), the time of a fall by half the radius             s
// v_o      eta / (4 t_c): normal and slip speeds below it are none          m/s
#include "coupling/step/accelerations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "contact/tolerances.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/rows/rolling.hpp"
#include "coupling/touch/touch_flush.hpp"

namespace talus::coupling {
namespace {

constexpr double instant = 1e-6;    // of the time of a fall
constexpr double resolved = 1e-11;  // of the radius: the error by accelerations as they are solved for

/// The contact problem of the accelerations at one end of a step. Velocities after a time `delta` stand for
/// them: so long that they are far above the round-off of velocities, so short that nothing falls.
class EndProblem {
 public:
  EndProblem(const IslandContext& in, const Step& step);
  /// A contact point, if it is closed. False if the rate of its normal is not known well enough: such steps
  /// are judged by their iteration alone.
  bool add(const Touch& t);
  /// False if there is no solution.
  bool solve(IslandReport& report, contact::ContactSolver& solver);
  std::vector<Vec6> accelerations() const;

 private:
  struct Couple {
    std::size_t row;
    const Touch* first;
    std::vector<std::size_t> of;  // rows of the touches that roll as one
    double resistance;
    double bound(const contact::ContactProblem& problem) const {
      double pressed = 0;
      for (const std::size_t k : of) pressed += std::max(0.0, problem.contacts[k].impulse[0]);
      return resistance * pressed;
    }
  };
  void add_bodies();
  bool closed(const Touch& t) const;
  /// A row at the point of a contact; with `axes` that of a couple about them, with this arm [m].
  contact::ProblemContact row_of(const Touch& t, const Mat3& frame, std::span<const Vec3> axes = {},
                                 double arm = 0);
  void add_couple(const Touch& t, const Mat3& frame, std::span<const Vec3> axes, double resistance,
                  std::size_t of);
  /// Normal impulse of the last step's force.
  double warm_pressure(const Touch& t) const { return std::max(0.0, delta_ * t.at.normal.dot(t.warm)); }
  /// Bounds of the couples by the normal impulses found; true if they were met.
  bool bounds_met();

  const IslandContext& in_;
  const Step& step_;
  contact::ContactProblem problem_;
  std::vector<double> pool_, drag_;
  std::vector<Vec6> now_;
  std::vector<Couple> couples_;
  double slowest_ = std::numeric_limits<double>::infinity();  // v_o of the island [m/s]
  double delta_ = 0;                                          // [s]
  double scale_ = 0;                                          // of the velocities solved for [m/s]
};

EndProblem::EndProblem(const IslandContext& in, const Step& step) : in_(in), step_(step) {
  for (const Body& b : step.bodies)
    slowest_ = std::min(slowest_, step_error(in, b.block) / (4 * fall_time(in, b.block)));
  delta_ = slowest_ / in.model.gravity.norm();
  for (const Body& b : step.bodies) delta_ = std::max(delta_, instant * fall_time(in, b.block));
  scale_ = delta_ * in.model.gravity.norm();
  add_bodies();
}

void EndProblem::add_bodies() {
  pool_.resize(2 * 36 * step_.bodies.size());
  now_.resize(step_.bodies.size());
  drag_.resize(step_.bodies.size());
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step_.bodies[i].block);
    Mat12 mass, inverse;
    dda::impulse_mass(in_.model, in_.state, step_.bodies[i].block, true, mass, inverse);
    double* const m = pool_.data() + 72 * i;
    Eigen::Map<Mat6>(m, 6, 6) = mass.topLeftCorner<6, 6>();
    Eigen::Map<Mat6>(m + 36, 6, 6) = inverse.topLeftCorner<6, 6>();
    problem_.bodies.push_back({6, static_cast<int>(6 * i), m, m + 36});
    now_[i] << in_.state.v[k], in_.state.w[k];
    Vec6 free;
    drag_[i] = in_.vegetated ? vegetation_drag(in_.model.blocks[k], in_.env, in_.state.c[k]) : 0.0;
    free << in_.model.gravity - drag_[i] * in_.state.v[k],
        inverse.block<3, 3>(3, 3) * -in_.state.w[k].cross(mass.block<3, 3>(3, 3) * in_.state.w[k]);
    for (int c = 0; c < 6; ++c) problem_.v_hat.push_back(now_[i][c] + delta_ * free[c]);
  }
}

/// Slower than v_o, or pressed by the step just computed: what it holds lasts.
bool EndProblem::closed(const Touch& t) const {
  if (!(std::abs(t.approach) > slowest_)) return true;
  return std::abs(t.approach) < contact::tolerances().pressed_still * in_.scale.speed &&
         std::any_of(step_.touches.begin(), step_.touches.end(), [&](const Touch& k) {
           return k.row >= 0 && k.impulse[0] > 0 && k.b == t.b && k.a == t.a && k.at.key == t.at.key;
         });
}

contact::ProblemContact EndProblem::row_of(const Touch& t, const Mat3& frame, std::span<const Vec3> axes,
                                           double arm) {
  contact::ProblemContact c;
  c.first_term = static_cast<int>(problem_.terms.size());
  const Vec3 x = 0.5 * (t.at.point_a + t.at.point_b);
  for (const auto& [block, sign] :
       {std::pair(t.a.kind == Partner::Kind::block ? t.a.index : -1, -1.0), std::pair(t.b, 1.0)}) {
    const int l = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)];
    if (l < 0) continue;
    const std::size_t at = problem_.jacobians.size();
    problem_.terms.push_back({l, static_cast<int>(at)});
    problem_.jacobians.resize(at + 18, 0.0);
    double* const j = problem_.jacobians.data() + at;
    if (axes.empty())
      write_jacobian(j, frame, x - in_.state.c[static_cast<std::size_t>(block)], Mat3::Identity(),
                     Mat3::Identity(), 6, sign);
    for (std::size_t r = 0; r < axes.size(); ++r)
      for (int d = 0; d < 3; ++d) j[3 * (3 + d) + static_cast<int>(r) + 1] = sign * arm * axes[r][d];
  }
  c.terms = static_cast<int>(problem_.terms.size()) - c.first_term;
  return c;
}

void EndProblem::add_couple(const Touch& t, const Mat3& frame, std::span<const Vec3> axes, double resistance,
                            std::size_t of) {
  if (!(resistance > 0)) return;
  const double arm = rolling_arm(in_, t);
  Vec3 spin = in_.state.w[static_cast<std::size_t>(t.b)];
  if (t.a.kind == Partner::Kind::block) spin -= in_.state.w[static_cast<std::size_t>(t.a.index)];
  contact::ProblemContact rolling = row_of(t, frame, axes, arm);
  rolling.bias[0] = 1;
  rolling.compliance[0] = 1 / in_.model.blocks[static_cast<std::size_t>(t.b)].mass;
  double fastest = 0;
  for (const Vec3& axis : axes) fastest = std::max(fastest, arm * std::abs(axis.dot(spin)));
  if (fastest <= slowest_)
    for (std::size_t r = 0; r < axes.size(); ++r)
      rolling.bias[static_cast<int>(r) + 1] = -arm * axes[r].dot(spin);
  rolling.cohesion = resistance * warm_pressure(t);
  couples_.push_back({problem_.contacts.size(), &t, {of}, resistance});
  problem_.contacts.push_back(rolling);
}

bool EndProblem::add(const Touch& t) {
  if (!closed(t)) return true;
  const bool of_blocks = t.a.kind == Partner::Kind::block;
  const Pose pose_a = of_blocks ? dda::pose(in_.state, t.a.index) : Pose{};
  const NormalOwner owner = normal_owner(t, in_.model, in_.env, &pose_a);
  if (owner == NormalOwner::edges) return false;
  const Mat3 frame = contact_frame(t.at.normal);
  const Vec3 x = 0.5 * (t.at.point_a + t.at.point_b);
  const auto turning = [&](int block) {
    const auto k = static_cast<std::size_t>(block);
    return Vec3(in_.state.w[k].cross(in_.state.w[k].cross(x - in_.state.c[k])));
  };
  const Vec3 u = point_velocity(in_.state, t.b, x) -
                 (of_blocks ? point_velocity(in_.state, t.a.index, x) : Vec3(Vec3::Zero()));
  const Vec3 bent = turning(t.b) - (of_blocks ? turning(t.a.index) : Vec3(Vec3::Zero()));
  contact::ProblemContact c = row_of(t, frame);
  c.bias = delta_ * (frame.transpose() * bent);
  const int turns = owner == NormalOwner::a ? (of_blocks ? t.a.index : -1) : t.b;  // what the normal is of
  if (turns >= 0)
    c.bias[0] += delta_ * 2 * in_.state.w[static_cast<std::size_t>(turns)].cross(t.at.normal).dot(u);
  c.bias[0] -= t.at.normal.dot(u);
  const Vec3 along = frame.transpose() * u;
  if (along.tail<2>().norm() <= slowest_)
    c.bias.tail<2>() -= along.tail<2>();
  else
    scale_ = std::max(scale_, contact::tolerances().still *
                                  along.tail<2>().norm());  // round-off of the slip is no acceleration
  c.friction = friction_now(in_.state, t);
  c.cohesion = t.cohesion() * delta_;
  c.tension = t.tension() * delta_;
  if (!t.rolls) c.impulse = delta_ * (frame.transpose() * t.warm);
  const std::size_t of = problem_.contacts.size();
  problem_.contacts.push_back(c);
  if (!t.rolls) return true;
  bool joins = false;
  for (Couple& couple : couples_) {
    if (!roll_as_one(*couple.first, t)) continue;
    couple.of.push_back(of);
    problem_.contacts[couple.row].cohesion += couple.resistance * warm_pressure(t);
    joins = true;
  }
  if (joins) return true;
  add_couple(t, frame, std::array<Vec3, 2>{frame.col(1), frame.col(2)}, t.law->rolling_resistance, of);
  add_couple(t, frame, std::array<Vec3, 1>{frame.col(0)}, t.law->drilling_resistance, of);
  return true;
}

bool EndProblem::bounds_met() {
  double change = 0, all = 0;
  for (const Couple& couple : couples_) {
    const double bound = couple.bound(problem_);
    change += std::abs(bound - problem_.contacts[couple.row].cohesion);
    all += bound;
    problem_.contacts[couple.row].cohesion = bound;
  }
  return change <= 1e-5 * all;
}

bool EndProblem::solve(IslandReport& report, contact::ContactSolver& solver) {
  constexpr int most = 10;
  if (problem_.contacts.empty()) {
    problem_.v = problem_.v_hat;
    return true;
  }
  contact::SolveSettings settings;
  settings.velocity_scale = scale_;
  settings.tolerance = std::max(resolved, contact::tolerances().acceleration * in_.settings.accuracy *
                                              std::sqrt(in_.settings.accuracy));
  settings.sufficient = 1e-5;
  for (int i = 0; i < most; ++i) {
    const contact::SolveReport r = solver.solve(problem_, settings);
    report.counters.newton += r.newton;
    if (!r.converged) return false;
    if (bounds_met()) break;
  }
  return true;
}

std::vector<Vec6> EndProblem::accelerations() const {
  std::vector<Vec6> a(step_.bodies.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = (Eigen::Map<const Vec6>(problem_.v.data() + 6 * i) - now_[i]) / delta_;
    if (drag_[i] > 0) a[i].head<3>() += drag_[i] * now_[i].head<3>();
  }
  return a;
}

}  // namespace

double step_error(const IslandContext& in, int block) {
  return std::max(resolved, in.scale.part_of_error()) *
         in.model.blocks[static_cast<std::size_t>(block)].shape->radius;
}

double fall_time(const IslandContext& in, int block) {
  const double g = in.model.gravity.norm(),
               radius = in.model.blocks[static_cast<std::size_t>(block)].shape->radius;
  return g > 0 ? std::sqrt(radius / g) : 0;
}

bool looks_ahead(const IslandContext& in, const Step& step) {
  if (in.settings.fixed_step > 0 || !in.island->structures.empty() || !(in.model.gravity.norm() > 0))
    return false;
  for (const Body& b : step.bodies) {
    const dda::Model::Block& block = in.model.blocks[static_cast<std::size_t>(b.block)];
    if (block.deformable || !block.fixed_points.empty()) return false;
  }
  return std::all_of(step.touches.begin(), step.touches.end(),
                     [](const Touch& t) { return t.stiffness == 0 && !(t.bond() > 0); });
}

std::optional<std::vector<Vec6>> allowed_accelerations(const IslandContext& in, const Step& step,
                                                       IslandReport& report, contact::ContactSolver& solver) {
  std::vector<Touch> touches;
  for (const CandidatePair& pair : in.island->pairs)
    find_touches(in.model, in.state, in.env, pair, in.scale.near_gap(), in.history, touches);
  drop_internal_edges(in.model, in.state, in.env, in.scale.flush(), in.scale.flush_skins(), touches);
  EndProblem end(in, step);
  for (const Touch& t : touches)
    if (!end.add(t)) return std::nullopt;
  if (!end.solve(report, solver)) return std::nullopt;
  return end.accelerations();
}

double error_by_ends(const IslandContext& in, const Step& step, double h, std::span<const Vec6> at_start,
                     std::span<const Vec6> at_end) {
  double worst = 0;
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    const Body& b = step.bodies[i];
    const auto k = static_cast<std::size_t>(b.block);
    Vec6 used;
    used << in.state.v[k] - b.v0.head<3>(), in.state.w[k] - b.v0.segment<3>(3);
    if (b.drag > 0) used.head<3>() = h * dda::drag_acceleration(b.drag, h, b.v0.head<3>(), in.state.v[k]);
    const Vec6 off = used - 0.5 * h * (at_start[i] + at_end[i]);
    const double speed = off.head<3>().norm() + in.model.blocks[k].shape->radius * off.tail<3>().norm();
    worst = std::max(worst, std::max(fall_time(in, b.block), h) * speed / step_error(in, b.block));
  }
  return worst;
}

double error_by_end_rule(const IslandContext& in, const Step& step, double h) {
  const auto held = [](const Body& b, const Vec12& v) {
    const Vec3 moves = v.head<3>();
    return b.end_rule ? Vec3(moves - b.along * moves) : Vec3(Vec3::Zero());
  };
  double worst = 0;
  for (Vec12 Body::*const of : {&Body::v0, &Body::v_solved}) {
    double inertia = 0, stiffness = 0, fastest = 0, longest = 0, strains = 0;
    for (const Body& b : step.bodies) {
      if (!b.end_rule && !b.strains_at_end) continue;
      const auto k = static_cast<std::size_t>(b.block);
      const Vec3 v = held(b, b.*of);
      inertia += in.model.blocks[k].mass * v.squaredNorm();
      fastest = std::max(fastest, v.norm());
      longest = std::max(longest, fall_time(in, b.block));
      if (b.strains())
        strains = std::max(strains, v.norm() + in.model.blocks[k].shape->radius * (b.*of).tail<6>().norm());
    }
    for (const Touch& t : step.touches) {
      if (t.row < 0 || t.mode != Mode::spring_end || t.b < 0) continue;
      const auto of_block = [&](int block) {
        const int l = in.local[static_cast<std::size_t>(block)];
        return l < 0 ? Vec3(Vec3::Zero())
                     : held(step.bodies[static_cast<std::size_t>(l)],
                            step.bodies[static_cast<std::size_t>(l)].*of);
      };
      Vec3 u = of_block(t.b);
      if (t.a.kind == Partner::Kind::block) u -= of_block(t.a.index);
      stiffness += t.stiffness * std::pow(t.normal.dot(u), 2);
    }
    const double half_period = 0.5 * std::numbers::pi * h;
    worst = std::max(worst, half_period * strains);
    if (!(inertia > 0)) continue;
    worst = std::max(worst, half_period * fastest);
    if (!(stiffness > 0)) continue;
    const double rate = std::sqrt(stiffness / inertia);
    worst = std::max(worst, fastest * std::min(1 / rate, 0.5 * h * rate * longest));
  }
  return worst / (in.settings.accuracy * in.scale.length);
}

}  // namespace talus::coupling

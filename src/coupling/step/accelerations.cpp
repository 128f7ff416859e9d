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
#include "coupling/touch/crossed_edges.hpp"
#include "coupling/touch/touch_flush.hpp"

namespace talus::coupling {
namespace {

constexpr double instant = 1e-6;    // of the time of a fall
constexpr double resolved = 1e-11;  // of the radius: the error by accelerations as they are solved for

/// Rate at which the normal turns [1/s].
Vec3 normal_rate(const Touch& t, NormalOwner owner, const std::optional<CrossedEdges>& edges,
                 const Vec3& spin_a, const Vec3& spin_b) {
  if (owner == NormalOwner::a) return spin_a.cross(t.at.normal);
  if (owner == NormalOwner::b) return spin_b.cross(t.at.normal);
  if (!edges) return 0.5 * (spin_a + spin_b).cross(t.at.normal);
  const Vec3 cross = edges->a.cross(edges->b),
             rate = spin_a.cross(edges->a).cross(edges->b) + edges->a.cross(spin_b.cross(edges->b));
  const Vec3 turned = (rate - t.at.normal * t.at.normal.dot(rate)) / cross.norm();
  return cross.dot(t.at.normal) < 0 ? Vec3(-turned) : turned;
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
  std::vector<Touch> closed;
  double slowest = std::numeric_limits<double>::infinity();  // v_o of the island
  for (const Body& b : step.bodies)
    slowest = std::min(slowest, 0.25 * step_error(in, b.block) / fall_time(in, b.block));
  for (const CandidatePair& pair : in.island->pairs)
    find_touches(in.model, in.state, in.env, pair, in.scale.near_gap(), in.history, closed);
  drop_internal_edges(in.model, in.state, in.env, in.scale.flush(), in.scale.flush_skins(), closed);
  // Velocities after so short a time stand for the accelerations: far above round-off of the velocities, far
  // below a fall [s].
  double delta = slowest / in.model.gravity.norm();
  for (const Body& b : step.bodies) delta = std::max(delta, instant * fall_time(in, b.block));

  contact::ContactProblem problem;
  std::vector<double> pool(2 * 36 * step.bodies.size());
  std::vector<Vec6> now(step.bodies.size());
  std::vector<double> drag(step.bodies.size());
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step.bodies[i].block);
    Mat12 mass, inverse;
    dda::impulse_mass(in.model, in.state, step.bodies[i].block, true, mass, inverse);
    double* const m = pool.data() + 72 * i;
    Eigen::Map<Mat6>(m, 6, 6) = mass.topLeftCorner<6, 6>();
    Eigen::Map<Mat6>(m + 36, 6, 6) = inverse.topLeftCorner<6, 6>();
    problem.bodies.push_back({6, static_cast<int>(6 * i), m, m + 36});
    now[i] << in.state.v[k], in.state.w[k];
    Vec6 free;
    drag[i] = in.vegetated ? vegetation_drag(in.model.blocks[k], in.env, in.state.c[k]) : 0.0;
    free << in.model.gravity - drag[i] * in.state.v[k],
        inverse.block<3, 3>(3, 3) * -in.state.w[k].cross(mass.block<3, 3>(3, 3) * in.state.w[k]);
    for (int c = 0; c < 6; ++c) problem.v_hat.push_back(now[i][c] + delta * free[c]);
  }

  double scale = delta * in.model.gravity.norm();
  struct Couple {
    std::size_t row, of;
    double resistance;
  };
  std::vector<Couple> couples_of;
  const auto row_of = [&](const Touch& t, const Mat3& frame, std::span<const Vec3> axes, double arm,
                          bool couple) {
    contact::ProblemContact c;
    c.first_term = static_cast<int>(problem.terms.size());
    const Vec3 x = 0.5 * (t.at.point_a + t.at.point_b);
    for (const auto& [block, sign] :
         {std::pair(t.a.kind == Partner::Kind::block ? t.a.index : -1, -1.0), std::pair(t.b, 1.0)}) {
      const int l = block < 0 ? -1 : in.local[static_cast<std::size_t>(block)];
      if (l < 0) continue;
      const std::size_t at = problem.jacobians.size();
      problem.terms.push_back({l, static_cast<int>(at)});
      problem.jacobians.resize(at + 18, 0.0);
      double* const j = problem.jacobians.data() + at;
      if (!couple) {
        write_jacobian(j, frame, x - in.state.c[static_cast<std::size_t>(block)], Mat3::Identity(),
                       Mat3::Identity(), 6, sign);
      } else {
        for (std::size_t r = 0; r < axes.size(); ++r)
          for (int d = 0; d < 3; ++d) j[3 * (3 + d) + static_cast<int>(r) + 1] = sign * arm * axes[r][d];
      }
    }
    c.terms = static_cast<int>(problem.terms.size()) - c.first_term;
    return c;
  };
  const auto pressed = [&](const Touch& t) {  // by the step just computed: what it holds lasts
    return std::any_of(step.touches.begin(), step.touches.end(), [&](const Touch& k) {
      return k.row >= 0 && k.impulse[0] > 0 && k.b == t.b && k.a == t.a && k.at.key == t.at.key;
    });
  };
  for (const Touch& t : closed) {
    if (std::abs(t.approach) > slowest &&
        !(std::abs(t.approach) < contact::tolerances().pressed_still * in.scale.speed && pressed(t)))
      continue;
    const auto kb = static_cast<std::size_t>(t.b);
    const bool of_blocks = t.a.kind == Partner::Kind::block;
    const Pose pose_a = of_blocks ? dda::pose(in.state, t.a.index) : Pose{},
               pose_b = dda::pose(in.state, t.b);
    const NormalOwner owner = normal_owner(t, in.model, in.env, &pose_a);
    const auto edges =
        owner == NormalOwner::edges ? crossed_edges(t, in.model, in.env, pose_a, pose_b) : std::nullopt;
    if (owner == NormalOwner::edges)
      return std::nullopt;  // the rate of its normal is not known well enough: such steps are judged by their
                            // iteration alone
    const Mat3 frame = contact_frame(t.at.normal);
    const Vec3 x = 0.5 * (t.at.point_a + t.at.point_b);
    const auto turning = [&](int block) {
      return Vec3(
          in.state.w[static_cast<std::size_t>(block)].cross(in.state.w[static_cast<std::size_t>(block)].cross(
              x - in.state.c[static_cast<std::size_t>(block)])));
    };
    const Vec3 spin_a = of_blocks ? in.state.w[static_cast<std::size_t>(t.a.index)] : Vec3(Vec3::Zero());
    const Vec3 u = point_velocity(in.state, t.b, x) -
                   (of_blocks ? point_velocity(in.state, t.a.index, x) : Vec3(Vec3::Zero()));
    const Vec3 bent = turning(t.b) - (of_blocks ? turning(t.a.index) : Vec3(Vec3::Zero()));
    contact::ProblemContact c = row_of(t, frame, {}, 0, false);
    c.bias = delta * (frame.transpose() * bent);
    c.bias[0] += delta * 2 * normal_rate(t, owner, edges, spin_a, in.state.w[kb]).dot(u) - t.at.normal.dot(u);
    const Vec3 along = frame.transpose() * u;
    if (along.tail<2>().norm() <= slowest)
      c.bias.tail<2>() -= along.tail<2>();
    else
      scale = std::max(scale, contact::tolerances().still *
                                  along.tail<2>().norm());  // round-off of the slip is no acceleration
    c.friction = friction_now(in.state, t);
    if (!t.broken) {
      c.cohesion = (t.law->cohesion + (t.glued ? t.bond_cohesion : 0.0)) * t.at.area * delta;
      if (t.glued) c.tension = (t.law->tension + t.bond_tension) * t.at.area * delta;
    }
    c.impulse = delta * (frame.transpose() * t.warm);
    const std::size_t of = problem.contacts.size();
    problem.contacts.push_back(c);
    if (!t.rolls) continue;
    const double arm = rolling_arm(in, t);
    const std::array<Vec3, 2> tangents{frame.col(1), frame.col(2)};
    const std::array<Vec3, 1> normal{frame.col(0)};
    const Vec3 spin = in.state.w[kb] - spin_a;
    const auto add = [&](std::span<const Vec3> axes, double resistance) {
      contact::ProblemContact rolling = row_of(t, frame, axes, arm, true);
      rolling.bias[0] = 1;
      rolling.compliance[0] = 1 / in.model.blocks[kb].mass;
      double fastest = 0;
      for (const Vec3& axis : axes) fastest = std::max(fastest, arm * std::abs(axis.dot(spin)));
      if (fastest <= slowest)
        for (std::size_t r = 0; r < axes.size(); ++r)
          rolling.bias[static_cast<int>(r) + 1] = -arm * axes[r].dot(spin);
      rolling.cohesion = resistance * std::max(0.0, c.impulse[0]);
      couples_of.push_back({problem.contacts.size(), of, resistance});
      problem.contacts.push_back(rolling);
    };
    if (t.law->rolling_resistance > 0) add(tangents, t.law->rolling_resistance);
    if (t.law->drilling_resistance > 0) add(normal, t.law->drilling_resistance);
  }
  std::vector<Vec6> a(step.bodies.size());
  if (problem.contacts.empty()) {
    problem.v = problem.v_hat;
  } else {
    contact::SolveSettings settings;
    settings.velocity_scale = scale;
    settings.tolerance = std::max(resolved, contact::tolerances().acceleration * in.settings.accuracy *
                                                std::sqrt(in.settings.accuracy));
    settings.sufficient = 1e-5;
    constexpr int most = 10;
    for (int i = 0; i < most; ++i) {
      const contact::SolveReport r = solver.solve(problem, settings);
      report.counters.newton += r.newton;
      if (!r.converged) return std::nullopt;
      double change = 0, all = 0;
      for (const Couple& couple : couples_of) {
        const double bound = couple.resistance * std::max(0.0, problem.contacts[couple.of].impulse[0]);
        change += std::abs(bound - problem.contacts[couple.row].cohesion);
        all += bound;
        problem.contacts[couple.row].cohesion = bound;
      }
      if (change <= 1e-5 * all) break;
    }
  }
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    a[i] = (Eigen::Map<const Vec6>(problem.v.data() + 6 * i) - now[i]) / delta;
    if (drag[i] > 0) a[i].head<3>() += drag[i] * now[i].head<3>();
  }
  return a;
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
  double fastest = 0;
  for (const Body& b : step.bodies) {
    if (!b.end_rule && !b.strains_at_end) continue;
    const double radius = in.model.blocks[static_cast<std::size_t>(b.block)].shape->radius;
    const auto swings = [&](const Vec12& v) {
      const Vec3 moves = v.head<3>();
      return (b.end_rule ? (moves - b.along * moves).norm() : 0.0) +
             (b.ndof == 12 ? radius * v.tail<6>().norm() : 0.0);
    };
    fastest = std::max({fastest, swings(b.v0), swings(b.v_solved)});
  }
  return 0.5 * std::numbers::pi * h * fastest / (in.settings.accuracy * in.scale.length);
}

}  // namespace talus::coupling

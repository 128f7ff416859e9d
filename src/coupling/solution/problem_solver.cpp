// The smooth part of a step: rows about its end, solved, moved, and again; and how closely.
#include "coupling/solution/problem_solver.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/rows/rolling.hpp"
#include "coupling/rows/spring_rows.hpp"
#include "coupling/solution/solve_settings.hpp"
#include "coupling/solution/spurious_work.hpp"
#include "coupling/step/accelerations.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/step_length.hpp"
#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {
namespace {

/// Sweeps from what solved a problem while they reduce the spurious work by a twentieth at a time, down to
/// `most` [J], the residual within `limit` [m/s]. What is left of it in a pile at rest lies on thousands of
/// contacts, whose regions a factorisation would have to know. The work left.
double sweep_while_it_pays(contact::ContactSolver& solver, contact::ContactProblem& problem, double limit,
                           double most, double work, contact::SolveReport& r) {
  constexpr int sweeps = 20, rounds = 10;
  std::vector<contact::ProblemContact> contacts;
  std::vector<double> v;
  for (int round = 0; round < rounds && work > most; ++round) {
    contacts = problem.contacts;
    v = problem.v;
    const double residual = solver.sweep(problem, sweeps), before = work;
    r.sweeps += sweeps;
    work = spurious_work(problem, 0.5 * most);
    if (!(work < before) || !(residual <= limit)) {
      problem.contacts.swap(contacts);
      problem.v.swap(v);
      return before;
    }
    r.residual = residual;
  }
  return work;
}

/// On from what solved a problem, until its contacts do no more than `most` spurious work on what moves [J]
/// or it gets no farther: by sweeps and by a few steps of Newton's method with a strong proximal term. Near
/// rest the interior-point method does not improve a warm start. `scale`: a velocity beside which the
/// residual is so small that Newton's method goes first [m/s].
contact::SolveReport solve_closer(contact::ContactSolver& solver, contact::ContactProblem& problem,
                                  const contact::SolveSettings& settings, double scale, double most,
                                  contact::SolveReport r) {
  r.residual *= settings.velocity_scale;  // in m/s until it is returned
  const double limit = std::max(r.residual, settings.tolerance * settings.velocity_scale);
  for (int round = 0; round < 3; ++round) {
    const double begun = spurious_work(problem, 0.5 * most);
    const double work = sweep_while_it_pays(solver, problem, limit, most, begun, r),
                 residual = r.residual / scale;
    if (work <= most) break;
    contact::SolveSettings closer = settings;
    closer.at_hand = true;
    closer.velocity_scale = scale;
    closer.tolerance = residual * most / work;
    closer.sufficient = std::max(closer.tolerance, (work > 10 * most ? 0.3 : 1.0) * residual);
    const contact::SolveReport next = solver.solve(problem, closer);
    r.newton += next.newton;
    r.sweeps += next.sweeps;
    r.outer += next.outer;
    if (next.converged) r.method = std::max(r.method, next.method);
    r.residual = next.residual * scale;
    if (!(next.residual < 0.5 * residual)) break;
  }
  r.residual /= settings.velocity_scale;
  return r;
}

/// The fastest point of the blocks by the solution of a step, a bound [m/s].
double fastest_by_solution(const dda::Model& model, const Step& step) {
  double fastest = 0;
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    const Body& b = step.bodies[i];
    const Eigen::Map<const VecX> v(step.problem.v.data() + step.problem.bodies[i].offset, b.ndof);
    const double radius = model.blocks[static_cast<std::size_t>(b.block)].shape->radius;
    fastest =
        std::max(fastest, v.head<3>().norm() + radius * (v.segment<3>(3).norm() + v.tail(b.ndof - 6).norm()));
  }
  return fastest;
}

}  // namespace

ProblemSolver::ProblemSolver(const IslandContext& in, Step& step, IslandReport& report)
    : in_(in), step_(step), report_(report) {}

bool ProblemSolver::solve(double h, Effort effort) {
  if (step_.problem.contacts.empty()) {
    step_.problem.v = step_.problem.v_hat;
    return true;
  }
  const bool small = !in_.time_stepping && !in_.leapfrog();
  // What is left unsolved of a bond is a motion that the next step stops, by more than the bond may bear.
  const bool bonded =
      std::any_of(step_.problem.contacts.begin(),
                  step_.problem.contacts.end() - static_cast<std::ptrdiff_t>(step_.rocking_rows),
                  [](const contact::ProblemContact& c) { return c.cohesion > 0 || c.tension > 0; });
  StepToSolve step{
      .h = h,
      .small = small,
      .provisional = effort == Effort::provisional,
      .heap = in_.time_stepped(),
      .bonded = std::ranges::any_of(step_.touches, [](const Touch& t) { return t.row >= 0 && t.holds(); }),
      // Explicit sub-steps at structures lie far below what the accuracy asks, and nothing is
      // located within them: no round-off either.
      .sub_step = h > 0 && !in_.condensed && !in_.island->structures.empty(),
      .sprung = step_.sprung,
      .speed = in_.scale.speed,
      .fastest = fastest_among(in_, step_),
      .length = in_.time_stepped() ? in_.scale.mass_length : in_.scale.length,
      .gravity = in_.model.gravity.norm(),
      .accuracy = in_.settings.accuracy};
  if (in_.event_driven() && !bonded)  // a hundredth of the error of velocity that a step may have
    for (const Body& b : step_.bodies) {
      const double part = 0.01 * step_error(in_, b.block) / std::max(fall_time(in_, b.block), h);
      step.located = step.located > 0 ? std::min(step.located, part) : part;
    }
  for (const contact::ProblemContact& c : step_.problem.contacts) {
    step.largest_bias = std::max(step.largest_bias, c.bias.cwiseAbs().maxCoeff());
    step.gives = step.gives || c.compliance[0] > 0;
  }
  Counters& n = report_.counters;
  const bool moves = h > 0 && !small && !step.sub_step;
  if (moves && balanced(h)) return true;
  contact::SolveSettings settings = how_closely(step);
  const double before = work_;
  // A step of blocks among themselves, 2 sqrt(accuracy) L / V, may have accuracy of the kinetic energy as
  // spurious work; shorter ones share it [J].
  double most =
      in_.settings.accuracy * kinetic_energy(step_, &Body::v0) *
      std::min(1.0, h * in_.scale.speed / (2 * std::sqrt(in_.settings.accuracy) * in_.scale.length));
  const auto attempt = [&] {
    contact::SolveReport r = solver_.solve(step_.problem, settings);
    // In a tower residuals of one sign add up from block to block, and the projection lifts again what has
    // sunk: gravity would drive on what hardly moves, for ever; loads that part throw it. The spurious
    // work of all contacts together is to be a small part of the motion.
    if (r.converged && moves) r = solve_closer(solver_, step_.problem, settings, in_.scale.speed, most, r);
    work_ += static_cast<double>(step_.problem.contacts.size()) *
             (5.0 + r.newton);  // what goes with a solution costs as much as a few factorisations
    n.newton += r.newton;
    n.sweeps += r.sweeps;
    n.outer += r.outer;
    return r;
  };
  contact::SolveReport r = attempt();
  if (r.converged && (moves || (step.sub_step && r.residual > settings.tolerance))) {
    // What presses itself, handed on from step to step, may be of any size: if it does more with what is left
    // than loads may by sinking, it is let go.
    most += contact::tolerances().solved * in_.settings.accuracy * weight() * h *
            std::sqrt(in_.model.gravity.norm() * in_.scale.length);
    if (spurious_work(step_.problem, 0.5 * most) > most) {
      for (contact::ProblemContact& c : step_.problem.contacts) c.impulse.setZero();
      settings.goes_on = false;
      r = attempt();
    }
  }
  if (!r.converged) in_vain_ += work_ - before;
  const bool last_resort = effort == Effort::last_resort,
             no_better = last_resort || not_worth_more() ||
                         (effort == Effort::repeated && r.residual > 0.5 * step_.solution.residual);
  step_.solution.residual = r.residual;
  step_.solution.unsolved_speed = r.residual * settings.velocity_scale;
  step_.solution.stagnated = !r.converged;
  step_.solution.certified = r.converged;
  long* count = !r.converged                                  ? &n.above_tolerance
                : r.method == contact::Method::interior_point ? &n.interior_point
                                                              : &n.newton_method;
  bool used =
      r.converged || accepted(step, settings, {.no_better = no_better, .last_resort = last_resort}, r);
  if (!used && last_resort && h > 0) {  // impulses of no duration are left to the step
    // The convex problem alone: it has a solution always, which takes energy as it must but lifts what
    // slides.
    settings.exact_coulomb = false;
    settings.sufficient = 1e-6;
    for (contact::ProblemContact& c :
         step_.problem.contacts) {  // small compliance: between friction cones an over-constrained body has
                                    // no largest force
      c.compliance.array() += 1e-7 * normal_compliance(in_, step_, c);
      c.impulse.setZero();
    }
    r = attempt();
    used = r.converged;
    count = &n.convex;
  }
  if (!used) return false;  // the caller refines the rows or halves the step
  n.worst_residual = std::max(n.worst_residual, r.residual);
  ++*count;
  return true;
}

bool ProblemSolver::not_worth_more() const {
  return in_vain_ > worth_of_a_step(static_cast<double>(step_.problem.contacts.size()));
}

double ProblemSolver::weight() const {
  double mass = 0;
  for (const Body& b : step_.bodies) mass += in_.model.blocks[static_cast<std::size_t>(b.block)].mass;
  return mass * in_.model.gravity.norm();
}

bool ProblemSolver::balanced(double h) {
  // Rest is looked for where the motion that is left does not matter any more, and found only where what the
  // contacts give at first is far less than what the bodies would fall by.
  if (!(step_.fastest < in_.settings.accuracy * in_.scale.speed)) return false;
  const double moving = contact::tolerances().gives * in_.model.gravity.norm() * h;
  contact::ContactProblem asked = step_.problem;
  contact::SolveReport r;
  const bool found = solver_.balance(
      step_.problem, rest_speed(in_.model, h), moving, [&] { return fastest_by_solution(in_.model, step_); },
      &r);
  report_.counters.newton += r.newton;
  work_ += static_cast<double>(step_.problem.contacts.size()) * r.newton;
  if (!found) {
    step_.problem = std::move(asked);
    return false;
  }
  step_.solution.residual = r.residual / in_.scale.speed;
  step_.solution.unsolved_speed = r.residual;
  step_.solution.stagnated = false;
  step_.solution.certified = true;
  ++report_.counters.interior_point;
  return true;
}

bool ProblemSolver::solve_rolling(double h, Effort effort) {
  constexpr int most = 30;
  const double same = contact::tolerances().at_bound;
  constexpr double least_relaxed = 0.3, most_relaxed = 4;
  const auto found = [&](const Touch& t) {
    return step_.problem.contacts[static_cast<std::size_t>(t.row)].impulse[0];
  };
  std::vector<double> bounds, residuals, before;
  double relaxed = 1;
  for (int i = 0; i < most; ++i) {
    if (!solve(h, effort)) return false;
    bounds.clear();
    each_rolling(step_.touches, step_.problem, [&](const Touch&, double, const contact::ProblemContact& c) {
      bounds.push_back(c.cohesion);
    });
    if (bounds.empty() ||
        limit_rolling(step_, found) <=
            std::max(same, h > 0 ? contact::tolerances().rolling_bound * in_.settings.accuracy : 0.0))
      break;
    residuals.clear();
    each_rolling(step_.touches, step_.problem, [&](const Touch&, double, const contact::ProblemContact& c) {
      residuals.push_back(c.cohesion - bounds[residuals.size()]);
    });
    if (i > 0) {
      double along = 0, change = 0;
      for (std::size_t k = 0; k < residuals.size(); ++k) {
        const double d = residuals[k] - before[k];
        along += before[k] * d;
        change += d * d;
      }
      relaxed = change > 0 && i < most / 2
                    ? std::clamp(-relaxed * along / change, least_relaxed, most_relaxed)
                    : 1.0;
    }
    std::size_t k = 0;
    each_rolling(step_.touches, step_.problem, [&](const Touch&, double, contact::ProblemContact& c) {
      c.cohesion = std::max(0.0, bounds[k] + relaxed * residuals[k]);
      ++k;
    });
    before.swap(residuals);
  }
  return true;
}

}  // namespace talus::coupling

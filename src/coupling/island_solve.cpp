// The smooth part of a step: rows about its end, solved, moved, and again; and how closely.
#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/closeness.hpp"
#include "coupling/island_body.hpp"
#include "coupling/jammed.hpp"
#include "coupling/touch_spring.hpp"
#include "coupling/unearned.hpp"

namespace talus::coupling {
namespace {

/// True if these rows give the bodies energy: impulses times the mean of the velocities without and with
/// them.
bool give_energy(const contact::ContactProblem& problem, const std::vector<int>& rows) {
  double work = 0, size = 0;
  for (const int row : rows) {
    const contact::ProblemContact& c = problem.contacts[static_cast<std::size_t>(row)];
    Vec3 mean = Vec3::Zero();
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem.terms[static_cast<std::size_t>(c.first_term + k)];
      const contact::ProblemBody& body = problem.bodies[static_cast<std::size_t>(term.body)];
      const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>> j(
          problem.jacobians.data() + term.jacobian, 3, body.ndof);
      const Eigen::Map<const VecX> before(problem.v_hat.data() + body.offset, body.ndof),
          after(problem.v.data() + body.offset, body.ndof);
      mean += 0.5 * (j * (before + after));
    }
    work += c.impulse.dot(mean);
    size += std::abs(c.impulse.dot(mean));
  }
  return work > 1e-6 * size;
}

constexpr double may_sink =
    1e-5;  // of a block: all of a large heap, in a step whose solution is taken where its search stalls
constexpr double may_creep = 2e-6;  // the same of one that moves by less than 1e-3 of its speed
constexpr double far_off =
    100;  // times the work allowed, from which on sweeps do not bring a large heap near to it either
constexpr double hopeless = 4;  // times the work allowed, from which on a large heap is left as its sweeps
                                // leave it: Newton's method got there in a tenth of all tries

/// Sweeps from what solved a problem while they take a twentieth of the work unearned at a time, down to
/// `most` [J], the residual within `limit` [m/s]. What is left of it in a heap at rest lies on thousands of
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
    work = unearned(problem, 0.5 * most);
    if (!(work < before) || !(residual <= limit)) {
      problem.contacts.swap(contacts);
      problem.v.swap(v);
      return before;
    }
    r.residual = residual;
    if (work > 0.95 * before) break;
  }
  return work;
}

/// On from what solved a problem, until its contacts give no more than `most` work unearned to what moves [J]
/// or it gets no farther: by sweeps, by Newton's method, where it is far more and no `large` heap by the
/// whole search: a path from where a large one nearly rests ends nowhere nearer, Newton's method with a
/// strong proximal term does. `scale`: a velocity beside which the residual is so small that Newton's method
/// goes first [m/s].
contact::SolveReport solve_closer(contact::ContactSolver& solver, contact::ContactProblem& problem,
                                  const contact::SolveSettings& settings, bool large, double scale,
                                  double most, contact::SolveReport r) {
  r.residual *= settings.velocity_scale;  // in m/s until it is returned
  const double limit = std::max(r.residual, settings.tolerance * settings.velocity_scale);
  for (int round = 0; round < 3; ++round) {
    const double begun = unearned(problem, 0.5 * most);
    if (large && begun > far_off * most) break;
    const double work = sweep_while_it_pays(solver, problem, limit, most, begun, r),
                 residual = r.residual / scale;
    if (work <= most || (large && work > hopeless * most)) break;
    contact::SolveSettings closer = settings;
    closer.velocity_scale = scale;
    closer.stalled = 0;
    closer.tolerance = residual * most / work;
    closer.sufficient = std::max(closer.tolerance, (work > 10 * most ? 0.3 : 1.0) * residual);
    closer.most_factorisations = large ? 8 : 20;  // more than a hundred did not get there either
    if (large) closer.proximal = 1e-2;
    const contact::SolveReport next = solver.solve(problem, closer);
    r.newton += next.newton;
    r.sweeps += next.sweeps;
    r.outer += next.outer;
    r.tier = std::max(r.tier, next.converged ? next.tier : 'A');
    r.residual = next.residual * scale;
    if (!(next.residual < 0.5 * residual)) break;
  }
  r.residual /= settings.velocity_scale;
  return r;
}

/// What is taken where its search stalls leaves residuals of one sign, which add up along a tower: sinking by
/// them and lifted again, it would move by itself. Of more than `bearable` unearned work [J; `most` is what a
/// step may have] the whole search of smaller heaps solves the problem.
contact::SolveReport solve_soundly(contact::ContactSolver& solver, contact::ContactProblem& problem,
                                   const contact::SolveSettings& settings, double most, double bearable) {
  if (!(settings.stalled > 0)) return solver.solve(problem, settings);
  std::vector<contact::ProblemContact> asked = problem.contacts;
  const contact::SolveReport r = solver.solve(problem, settings);
  if (!r.converged || !r.stalled || unearned(problem, 0.5 * most) <= bearable) return r;
  problem.contacts.swap(asked);
  contact::SolveSettings whole = settings;
  whole.stalled = 0;
  contact::SolveReport searched = solver.solve(problem, whole);
  searched.newton += r.newton;
  searched.sweeps += r.sweeps;
  searched.outer += r.outer;
  return searched;
}

}  // namespace

bool IslandStepper::solve(double h, Effort effort) {
  if (step_.problem.contacts.empty()) {
    step_.problem.v = step_.problem.v_hat;
    return true;
  }
  const bool small = step_.problem.contacts.size() <= many_contacts && !in_.crowded,
             still = step_.fastest <
                     1e-6 * in_.scale.speed;  // a certificate of rest is only as good as its residual
  // What is left unsolved of a bond is a motion that the next step stops, by more than the bond may bear.
  const bool bonded =
      std::any_of(step_.problem.contacts.begin(),
                  step_.problem.contacts.end() - static_cast<std::ptrdiff_t>(step_.rocking_rows),
                  [](const contact::ProblemContact& c) { return c.cohesion > 0 || c.tension > 0; });
  StepToSolve step{.h = h,
                   .small = small,
                   .still = still,
                   .provisional = effort == Effort::provisional,
                   .heap = in_.in_heap(),
                   .large = in_.in_vast_heap() && !bonded,
                   // Explicit sub-steps at structures lie far below what the accuracy asks, and nothing is
                   // located within them: no round-off either.
                   .sub_step = h > 0 && !in_.condensed && !in_.island->structures.empty(),
                   .blocks = !in_.island->blocks.empty(),
                   .sprung = step_.sprung,
                   .speed = in_.scale.speed,
                   .fastest = fastest_among(in_, step_),
                   .at_rest = still_speed(in_.model, h),
                   .length = in_.scale.length,
                   .gravity = in_.model.gravity.norm(),
                   .accuracy = in_.settings.accuracy};
  if (in_.event_driven() && !bonded)  // a hundredth of the error of velocity that a step may have
    for (const Body& b : step_.bodies) {
      const double part = 0.01 * step_error(in_, b.block) / std::max(fall_time(in_, b.block), h);
      step.located = step.located > 0 ? std::min(step.located, part) : part;
    }
  for (const contact::ProblemContact& c : step_.problem.contacts)
    step.largest_bias = std::max(step.largest_bias, c.bias.cwiseAbs().maxCoeff());
  contact::SolveSettings settings = how_closely(step);
  Counters& n = report_.counters;
  const bool moves = h > 0 && in_.in_heap() && !small && !still;
  double weight = 0;  // [N]
  for (const Body& b : step_.bodies)
    weight += in_.model.blocks[static_cast<std::size_t>(b.block)].mass * in_.model.gravity.norm();
  const double most =
      in_.settings.accuracy * kinetic_energy(step_, &Body::v0);  // unearned work of a step [J]
  const auto attempt = [&] {
    contact::SolveReport r =
        solve_soundly(solver_, step_.problem, settings, most,
                      std::max(10 * most, (step_.fastest > 1e-3 * in_.scale.speed ? may_sink : may_creep) *
                                              in_.scale.length * weight));
    // In a tower residuals of one sign add up from block to block, and the projection lifts again what has
    // sunk: gravity would drive on what hardly moves, for ever; loads that part throw it. What all contacts
    // do unearned together is to be a small part of the motion.
    if (r.converged && !r.stalled && moves)
      r = solve_closer(solver_, step_.problem, settings, step.large, in_.scale.speed, most, r);
    work_ += static_cast<double>(step_.problem.contacts.size()) *
             (5.0 + r.newton);  // what goes with a solution costs as much as a few factorisations
    n.newton += r.newton;
    n.sweeps += r.sweeps;
    n.outer += r.outer;
    return r;
  };
  contact::SolveReport r = attempt();
  const bool last_resort = effort == Effort::last_resort,
             no_better =
                 last_resort || (effort == Effort::repeated && r.residual > 0.5 * step_.solution.residual);
  step_.solution.residual = r.residual;
  step_.solution.unsolved_speed = r.residual * settings.velocity_scale;
  step_.solution.stalled = r.stalled;
  step_.solution.certified = judge(step, settings, {.no_better = no_better, .last_resort = last_resort}, r);
  if (!r.converged && last_resort && h > 0) {  // impulses of no duration are left to the step
    // The convex problem alone: it has a solution always, which takes energy as it must but lifts what
    // slides.
    settings.exact_coulomb = false;
    settings.stalled = 0;
    settings.sufficient = step.sub_step ? std::max(1e-6, 1e-2 * in_.settings.accuracy) : 1e-6;
    for (contact::ProblemContact& c :
         step_.problem
             .contacts) {  // a little give: what is jammed between friction cones has no largest force
      c.compliance.array() += 1e-7 * normal_compliance(in_, step_, c);
      c.impulse.setZero();
    }
    r = attempt();
    r.tier = 'E';
  }
  if (!r.converged) return false;  // the caller refines the rows or halves the step, tier D
  n.worst_residual = std::max(n.worst_residual, r.residual);
  (r.tier == 'A' ? n.tier_a : r.tier == 'B' ? n.tier_b : r.tier == 'C' ? n.tier_c : n.tier_e) += 1;
  return true;
}

IslandStepper::Outcome IslandStepper::smooth(double h, bool lumped, int passes, bool last_resort) {
  Outcome out;
  choose_spring_rules(in_, step_, h, lumped);
  find_pressed(in_, step_);
  to_half_steps(in_, step_, h);
  begin_step(in_, step_, h, false);
  begin_friction_direction(in_, step_);
  step_.pending = Ledger{};
  linearise_resting(in_, step_, h);
  std::vector<Vec3> last_c;
  std::vector<Quat> last_q;
  constexpr int most_passes = 12;  // while a spring's law is not met at the indentation reached
  bool solved = true, followed = true;
  for (int pass = 0; pass < most_passes; ++pass) {
    assemble(h, lumped, pass == 0);
    if (lumped && in_.jammed() && !in_.in_large_heap()) ask_for_no_motion(step_.touches, step_.problem, h);
    const Effort effort = last_resort         ? Effort::last_resort
                          : pass + 1 < passes ? Effort::provisional
                          : solved            ? Effort::full
                                              : Effort::repeated;
    solved = solve_rolling(h, effort);
    if (!solved && lumped && (in_.leapfrog() || last_resort) &&
        ask_for_no_motion(step_.touches, step_.problem, h)) {
      ++in_.unsolved;
      solved = solve_rolling(h, effort);
    }
    // Restitution on many contacts may not create energy, as little as in an impact stage: pieces jammed in a
    // notch would be shot out of it.
    std::vector<int> hard;
    const auto bounces = [&](const Touch& t) {
      return t.mode == Mode::end && !in_.deformable_structure(t) && t.law->restitution.value_or(0) > 0 &&
             step_.problem.contacts[static_cast<std::size_t>(t.row)].bias[0] < 0;
    };
    for (const Touch& t : step_.touches)
      if (lumped && t.row >= 0 && t.stiffness == 0) hard.push_back(t.row);
    for (const double left : {0.5, 0.0}) {
      if (!solved || !give_energy(step_.problem, hard)) break;
      bool any = false;
      for (const Touch& t : step_.touches)
        if (t.row >= 0 && t.stiffness == 0 && bounces(t))
          step_.problem.contacts[static_cast<std::size_t>(t.row)].bias[0] *= left, any = true;
      if (!any) break;
      solved = solve_rolling(h, effort);
    }
    if (!solved && (lumped || pass + 1 >= most_passes || step_.solution.residual > 1e-7)) return out;
    apply(h);
    if (!finite_bodies(in_, step_)) return out;
    balance_springs(in_, step_, h);
    if (solved && strain_from_start(step_)) {
      restore_bodies(in_, step_);
      begin_step(in_, step_, h, false);
      linearise_resting(in_, step_, h);
      pass = -1;
      continue;
    }
    if (step_.problem.contacts.empty()) break;
    // Of time-stepped islands where the turning of the slip adds more to the error than a step may have.
    const bool turns = in_.condensed || !lumped || pass > 0 ||
                       friction_direction_error(in_, step_, h) > in_.scale.error_limit();
    const bool swung = !turns || turn_friction(in_, step_, pass == 0);
    followed = laws_met(in_, step_, h);
    const bool met = solved && swung && followed;
    double error = 0;
    for (std::size_t i = 0; pass > 0 && i < step_.bodies.size(); ++i) {
      const auto k = static_cast<std::size_t>(step_.bodies[i].block);
      error = std::max(error, (in_.state.c[k] - last_c[i]).norm() / in_.scale.length);
      error = std::max(error, 2 * (in_.state.q[k].conjugate() * last_q[i]).vec().norm());
    }
    if (pass > 0 && pass < passes) out.error = error;
    if (met && (pass + 1 >= passes || (pass > 0 && error < 1e-14))) break;
    last_c.clear();
    last_q.clear();
    for (Body& b : step_.bodies) {
      const auto k = static_cast<std::size_t>(b.block);
      last_c.push_back(in_.state.c[k]);
      last_q.push_back(in_.state.q[k]);
      b.ref = dda::pose(in_.state, b.block);
      b.v_ref << in_.state.v[k], in_.state.w[k], in_.state.eps_rate[k];
      linearise_about_end(b, in_.state.q[k]);
    }
  }
  out.error = std::max(out.error, friction_direction_error(in_, step_, h));
  // Springs that open and close from pass to pass: a shorter step moves less.
  if (!followed &&
      std::any_of(step_.bodies.begin(), step_.bodies.end(), [](const Body& b) { return b.follows; }))
    out.error = std::max(out.error, 2 * in_.scale.error_limit());
  if (!in_.island->structures.empty()) collect_node_impulses(in_, step_);
  to_full_steps(in_, step_, h);
  book(h);
  out.ok = true;
  return out;
}

bool laws_met(const IslandContext& in, const Step& step, double h) {
  // The rows hold the law's tangent; is the force that they gave the law's own at the indentation reached?
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.stiffness == 0) continue;
    if (in.leapfrog()) {
      // The work that is off goes with the impulse and is of either sign.
      if (in.deformable_structure(t) && !follows_law(in, step, t, h, contact::tolerances().follows_law))
        return false;
      continue;
    }
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const double least = h * t.bond();  // pulled no harder than the bond holds
    const auto follows = [&](int block) {
      return in.local[static_cast<std::size_t>(block)] >= 0 &&
             step.bodies[static_cast<std::size_t>(in.local[static_cast<std::size_t>(block)])].follows;
    };
    if (t.spring == Mode::spring_end && t.b >= 0 && !in.deformable_structure(t) &&
        (follows(t.b) || (t.a.kind == Partner::Kind::block && follows(t.a.index)))) {
      const double allowed = contact::tolerances().follows_law;
      const double asked =
          h * (t.balanced_force - (t.dashpot > 0 ? t.dashpot * (row_velocity(step, t)[0] - c.bias[0]) : 0.0));
      if (std::abs(c.impulse[0] - std::max(asked, -least)) >
          allowed * (c.impulse[0] + h * t.stiffness * 1e-6 * in.settings.accuracy * in.scale.length))
        return false;
      continue;
    }
    double derivative = 0;
    double force =
        t.mode == Mode::spring_mean ? mean_force(t, derivative) : t.normal_law.force(t.indentation);
    if (t.dashpot > 0) {
      const double u = t.u_ref - (t.indentation + t.gap_ref) / (t.theta * h);
      force -= t.dashpot * (t.mode == Mode::spring_mean ? 0.5 * (t.approach + u) : u);
    }
    if (std::abs(c.impulse[0] - std::max(h * force, -least)) >
        1e-10 * (c.impulse[0] + h * t.stiffness * 1e-6 * in.scale.length))
      return false;
  }
  return true;
}

}  // namespace talus::coupling

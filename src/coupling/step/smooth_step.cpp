// The smooth part of a step: rows about its end, solved, moved, and again.
#include "coupling/step/smooth_step.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/rows/assembly.hpp"
#include "coupling/rows/bonds.hpp"
#include "coupling/rows/slip_direction.hpp"
#include "coupling/rows/spring_rows.hpp"
#include "coupling/springs/quasistatic.hpp"
#include "coupling/springs/spring_rules.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/commit.hpp"
#include "coupling/step/works.hpp"
#include "coupling/structures/leapfrog.hpp"
#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {

namespace {

/// True if these rows give the bodies energy: impulses times the mean of the velocities without and with
/// them.
bool give_energy(const contact::ContactProblem& problem, const std::vector<int>& rows) {
  double work = 0, size = 0;
  for (const int row : rows) {
    const contact::ProblemContact& c = problem.contacts[static_cast<std::size_t>(row)];
    const Vec3 mean = 0.5 * (problem.relative(c, problem.v_hat) + problem.relative(c, problem.v));
    work += c.impulse.dot(mean);
    size += std::abs(c.impulse.dot(mean));
  }
  return work > 1e-6 * size;
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
    // No closer than the solution, which leaves r of a row u + R p = b: r / R of its impulse, and impulses
    // that move the bodies by less than r.
    const double mass = t.b >= 0 ? mass_in_series(in.model, t) : 0,
                 solved = 2 * step.solution.unsolved_speed * (1 / c.compliance[0] + mass);
    if (std::abs(c.impulse[0] - std::max(h * force, -least)) >
        1e-10 * (c.impulse[0] + h * t.stiffness * 1e-6 * in.scale.length) + solved)
      return false;
  }
  return true;
}

}  // namespace

SmoothStep::SmoothStep(IslandContext& in, Step& step, RowAssembly& assembly, ProblemSolver& solver,
                       BodyUpdate& update)
    : in_(in), step_(step), assembly_(assembly), solver_(solver), update_(update) {}

SmoothStep::Outcome SmoothStep::solve(double h, bool time_stepped, int passes, bool last_resort) {
  Outcome out;
  choose_spring_rules(in_, step_, h, time_stepped);
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
    assembly_.assemble(h, time_stepped, pass == 0);
    const Effort effort = last_resort         ? Effort::last_resort
                          : pass + 1 < passes ? Effort::provisional
                          : solved            ? Effort::full
                                              : Effort::repeated;
    solved = solver_.solve_rolling(h, effort);
    // Restitution on many contacts may not create energy, as little as in an impact stage: pieces wedged in a
    // notch would be shot out of it.
    std::vector<int> hard;
    const auto bounces = [&](const Touch& t) {
      return t.mode == Mode::end && !in_.deformable_structure(t) && t.law->restitution.value_or(0) > 0 &&
             step_.problem.contacts[static_cast<std::size_t>(t.row)].bias[0] < 0;
    };
    for (const Touch& t : step_.touches)
      if (time_stepped && t.row >= 0 && t.stiffness == 0) hard.push_back(t.row);
    for (const double left : {0.5, 0.0}) {
      if (!solved || !give_energy(step_.problem, hard)) break;
      bool any = false;
      for (const Touch& t : step_.touches)
        if (t.row >= 0 && t.stiffness == 0 && bounces(t))
          step_.problem.contacts[static_cast<std::size_t>(t.row)].bias[0] *= left, any = true;
      if (!any) break;
      solved = solver_.solve_rolling(h, effort);
    }
    if (!solved && (time_stepped || pass + 1 >= most_passes || solver_.not_worth_more())) return out;
    update_.apply(h);
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
    const bool turns = in_.condensed || !time_stepped || pass > 0 ||
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
    if (met && pass + 1 >= passes) break;
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
  // A layer that crushes within a fraction of a long step: no pass met its law, and what it would crush at
  // the depth reached nothing gave.
  if (!followed && in_.condensed && !last_resort) return out;
  out.error = std::max(out.error, friction_direction_error(in_, step_, h));
  // Springs that open and close from pass to pass: a shorter step moves less.
  if (!followed &&
      std::any_of(step_.bodies.begin(), step_.bodies.end(), [](const Body& b) { return b.follows; }))
    out.error = std::max(out.error, 2 * in_.scale.error_limit());
  if (!in_.island->structures.empty()) collect_node_impulses(in_, step_);
  to_full_steps(in_, step_, h);
  account_works(in_, step_, h);
  out.ok = true;
  return out;
}

}  // namespace talus::coupling

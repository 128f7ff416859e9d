#include <algorithm>
#include <cmath>

#include "contact/problem.hpp"
#include "contact/solver_dual.hpp"
#include "contact/solver_interior.hpp"
#include "contact/solver_newton.hpp"
#include "contact/solver_sweep.hpp"
#include "contact/solver_system.hpp"
#include "core/assert.hpp"

namespace talus::contact {

using namespace detail;

void ContactProblem::clear() {
  bodies.clear();
  contacts.clear();
  terms.clear();
  jacobians.clear();
  v_hat.clear();
  v.clear();
}

struct ContactSolver::Work {
  System system;
  Hessian hessian;
  Newton newton{hessian};
  Interior interior{hessian};
  DualNewton dual;
  std::vector<Vec3> p, best_p, trial_p;
  std::vector<double> v, trial_v, best_v;
  double best = 0;
  bool consider(const std::vector<Vec3>& candidate, const std::vector<double>& velocities, double residual) {
    if (!(residual < best)) return false;
    best = residual;
    best_p = candidate;
    best_v = velocities;
    return true;
  }
};

ContactSolver::ContactSolver() : work_(new Work) {}
ContactSolver::~ContactSolver() { delete work_; }
ContactSolver::ContactSolver(ContactSolver&& other) noexcept : work_(other.work_) { other.work_ = nullptr; }
ContactSolver& ContactSolver::operator=(ContactSolver&& other) noexcept {
  std::swap(work_, other.work_);
  return *this;
}

SolveReport ContactSolver::solve(ContactProblem& problem, const SolveSettings& settings) {
  SolveReport report;
  problem.v = problem.v_hat;
  if (problem.contacts.empty()) {
    report.converged = true;
    return report;
  }
  Work& work = *work_;
  System& system = work.system;
  system.assemble(problem, settings.exact_coulomb);
  const int nc = system.contacts();
  const double tolerance = settings.tolerance * settings.velocity_scale;
  const double sufficient = std::max(settings.tolerance, settings.sufficient) * settings.velocity_scale;
  work.p.resize(nc);
  for (int i = 0; i < nc; ++i) {
    const Touch& t = system.touch[i];
    Vec3 start = problem.contacts[t.id].impulse;
    if (!start.allFinite() || !(t.w > 0)) start.setZero();
    Law cone = t.law;
    cone.exact = false;
    project(cone, start, 1, 1, work.p[i], nullptr);
  }
  system.velocities(work.p, work.v);
  work.best = INFINITY;
  work.consider(work.p, work.v, system.residual(work.v, work.p));

  if (work.best > tolerance) {
    const bool small = system.n <= 48;
    const int first_sweeps = small ? 6 : 10;
    sweep(system, work.p, work.v, first_sweeps);
    report.sweeps += first_sweeps;
    system.velocities(work.p, work.v);
    work.consider(work.p, work.v, system.residual(work.v, work.p));
  }
  if (work.best > tolerance) {
    work.hessian.prepare(system);
    NewtonOptions options;
    options.tolerance = tolerance;
    options.max_newton = settings.max_newton;
    options.max_outer = settings.max_outer;
    auto attempt = [&](double epsilon, int max_newton) {
      options.convex = false;
      options.epsilon = epsilon;
      options.max_newton = max_newton;
      work.trial_p = work.p;
      const NewtonOutcome outcome = work.newton.run(system, work.trial_p, work.trial_v, options);
      report.newton += outcome.newton;
      report.outer += outcome.outer;
      work.consider(work.trial_p, work.trial_v, outcome.residual);
      return work.best <= sufficient;
    };
    auto interior = [&](const std::vector<Vec3>& start, double distance) {
      InteriorOptions inside;
      inside.tolerance = std::max(tolerance, 1e-7 * settings.velocity_scale);
      inside.start = distance;
      work.trial_p = start;
      system.velocities(work.trial_p, work.trial_v);
      const InteriorOutcome outcome = work.interior.run(system, work.trial_p, work.trial_v, inside);
      report.newton += outcome.iterations;
      work.consider(work.trial_p, work.trial_v, outcome.residual);
      return work.best <= sufficient;
    };
    // The last digits of a small problem.
    auto polish = [&] {
      if (nc > DualNewton::most_contacts || work.best > 1e-2 * settings.velocity_scale) return false;
      work.trial_p = work.best_p;
      const DualOutcome outcome = work.dual.run(system, work.trial_p, work.trial_v, tolerance, 40);
      report.newton += outcome.iterations;
      work.consider(work.trial_p, work.trial_v, outcome.residual);
      return work.best <= sufficient;
    };
    // Large islands whose warm start is off by more than this change too many regions for Newton's method: straight to the path.
    const bool near = system.n <= 48 || work.best <= 1e-4 * settings.velocity_scale;
    bool done = near && (attempt(1e-4, std::min(settings.max_newton, system.n <= 48 ? 20 : 8)) || polish());
    if (!done) {
      // Cold: the interior point from the warm start, at the distance its residual tells; then from nothing. The Newton
      // method finishes, since the regions are known by then.
      report.tier = 'B';
      // Starts: the warm one at three times its residual (fewest iterations over a set of piles); what a few sweeps make of
      // the best so far (a path that stops short usually leaves a handful of contacts wrong); nothing.
      for (int round = 0; round < 5 && !done; ++round) {
        work.p = work.best_p;
        if (round == 0) {
          done = interior(work.p, 3 * work.best);
        } else if (round <= 2) {
          system.velocities(work.p, work.v);
          sweep(system, work.p, work.v, 20);
          report.sweeps += 20;
          system.velocities(work.p, work.v);
          const double after = system.residual(work.v, work.p);
          work.consider(work.p, work.v, after);
          done = work.best <= sufficient || interior(work.p, round == 1 ? after : 0.3 * after);
        } else {
          for (int i = 0; i < nc; ++i) work.p[i] = Vec3(std::max(0.0, system.touch[i].law.floor), 0, 0);
          system.velocities(work.p, work.v);
          done = interior(work.p, system.residual(work.v, work.p) * (round == 3 ? 1 : 10));
        }
        work.p = work.best_p;
        if (done || (system.n > 48 && work.best > 1e-3 * settings.velocity_scale)) continue;
        done = attempt(1e-4, 20) || polish() || (system.n <= 48 && attempt(1e-3, 20));
      }
    }
    for (int round = 0; round < (system.n <= 48 ? 4 : 1) && !done; ++round) {
      // Many sweeps find regions that a path misses; costly, so only now and then of use.
      report.tier = 'C';
      work.p = work.best_p;
      if (round % 2 == 0)
        for (int i = 0; i < nc; ++i) work.p[i] = Vec3(std::max(0.0, system.touch[i].law.floor), 0, 0);
      const int count = nc <= 300 ? 100 << round : 50;
      system.velocities(work.p, work.v);
      sweep(system, work.p, work.v, count);
      report.sweeps += count;
      system.velocities(work.p, work.v);
      work.consider(work.p, work.v, system.residual(work.v, work.p));
      done = work.best <= sufficient || attempt(1e-4, 20) || attempt(1e-2, 30);
    }
    if (!done) {
      // De Saxce: the convex problem with the shift held, then the shift from its solution; the exact Newton is tried again
      // from every convex solution, since it converges fast once the slip directions are right.
      report.tier = 'C';
      work.p = work.best_p;
      work.v = work.best_v;
      const int budget = report.newton + (system.n <= 48 ? 1000 : 200);  // a step that cannot be solved must not hang
      for (int k = 0; k < settings.max_outer && !done && report.newton < budget; ++k) {
        for (int i = 0; i < nc; ++i) {
          Touch& t = system.touch[i];
          const Vec3 u = system.relative(t, work.v.data()) + t.bias + t.compliance.cwiseProduct(work.p[i]);
          t.shift = t.law.exact ? t.law.mu * std::hypot(u.y(), u.z()) : 0.0;
        }
        options.convex = true;
        options.epsilon = 1e-3;
        options.max_newton = settings.max_newton;
        options.tolerance = std::max(tolerance, 0.01 * work.best);
        const NewtonOutcome outcome = work.newton.run(system, work.p, work.v, options);
        report.newton += outcome.newton;
        report.outer += 1;
        report.convex_residual = outcome.residual / settings.velocity_scale;
        options.tolerance = tolerance;
        work.consider(work.p, work.v, system.residual(work.v, work.p));
        done = work.best <= sufficient || attempt(1e-3, 15);
      }
      for (Touch& t : system.touch) t.shift = 0;
      if (!done) report.tier = 'E';
    }
  }
  for (int i = 0; i < nc; ++i) problem.contacts[system.touch[i].id].impulse = work.best_p[i];
  for (std::size_t b = 0; b < system.body.size(); ++b)
    std::copy_n(work.best_v.begin() + system.offset[b], system.ndof[b],
                problem.v.begin() + problem.bodies[system.body[b]].offset);
  report.residual = work.best / settings.velocity_scale;
  report.converged = work.best <= sufficient;
  return report;
}

double coulomb_residual(const ContactProblem& problem, bool exact_coulomb) {
  System system;
  system.assemble(problem, exact_coulomb);
  std::vector<Vec3> p(system.touch.size());
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = problem.contacts[system.touch[i].id].impulse;
  std::vector<double> v;
  system.velocities(p, v);
  double worst = system.residual(v, p);
  // The velocities given must be those of the impulses: measured as contact velocities.
  std::vector<double> difference(v.size());
  for (std::size_t b = 0; b < system.body.size(); ++b)
    for (int k = 0; k < system.ndof[b]; ++k)
      difference[system.offset[b] + k] =
          problem.v[problem.bodies[system.body[b]].offset + k] - v[system.offset[b] + k];
  std::vector<double> reach;
  system.impulse_reach(p, reach);
  for (const Touch& t : system.touch) {
    const double gap = system.relative(t, difference.data()).norm() - system.round_off(t, reach);
    if (!(gap <= worst)) worst = gap;
  }
  return worst;
}

}  // namespace talus::contact

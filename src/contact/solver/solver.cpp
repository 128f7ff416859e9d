#include <algorithm>
#include <cmath>

#include "contact/solver/problem.hpp"
#include "contact/solver/solver_normal.hpp"
#include "contact/solver/solver_search.hpp"
#include "contact/solver/solver_sweep.hpp"
#include "contact/solver/solver_system.hpp"
#include "contact/tolerances.hpp"
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
  Search search;
  NormalSweeps normal;
  std::vector<Touch> every;  // all contacts, while a part is solved
  std::vector<Vec3> every_p;
  std::vector<char> chosen;
};

ContactSolver::ContactSolver() : work_(new Work) {}
ContactSolver::~ContactSolver() { delete work_; }
ContactSolver::ContactSolver(ContactSolver&& other) noexcept : work_(other.work_) { other.work_ = nullptr; }
ContactSolver& ContactSolver::operator=(ContactSolver&& other) noexcept {
  std::swap(work_, other.work_);
  return *this;
}

namespace {

/// Gauss-Seidel sweeps from p while they pay. Each costs a tenth of a factorisation and what goes with it.
void sweeps(Search& search, double tolerance, SolveReport& report) {
  const bool small = search.system.n <= Search::few_unknowns;
  const int count = small ? 6 : 10;
  for (int round = 0; round < (small ? 1 : 4); ++round) {
    const double before = search.best;
    sweep(search.system, search.p, search.v, count);
    report.sweeps += count;
    search.system.velocities(search.p, search.v);
    search.consider(search.p, search.v, search.system.residual(search.v, search.p));
    // Worth another round if the same gain twice more would do.
    if (search.best <= tolerance ||
        !(search.best < 0.3 * before && search.best * std::pow(search.best / before, 2) <= tolerance))
      return;
  }
}

/// Solves with the contacts that carry an impulse or are near to it; those that the solution closes are
/// added. Costs in proportion.
bool solve_in_parts(Search& search, std::vector<Touch>& every, std::vector<Vec3>& every_p,
                    std::vector<char>& chosen, const SolveSettings& settings, SolveReport& report) {
  std::vector<int> part;  // what is chosen, ascending
  System& system = search.system;
  const double tolerance = settings.tolerance * settings.velocity_scale;
  const int nc = system.contacts();
  every_p = search.best_p;
  chosen.assign(nc, 0);
  const double near = search.best + 10 * tolerance;
  in_ranges(nc, contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      chosen[i] = every_p[i] != Vec3::Zero() || t.law.floor < 0 || t.law.cohesion > 0 ||
                  system.relative_normal(t, search.best_v.data()) + t.bias.x() < near;
    }
  });
  every.swap(system.touch);
  for (int round = 0;; ++round) {
    const bool whole = round >= 4 || std::count(chosen.begin(), chosen.end(), 1) > 0.9 * nc;
    if (whole) chosen.assign(nc, 1);
    part.clear();
    for (int i = 0; i < nc; ++i)
      if (chosen[i]) part.push_back(i);
    system.touch.resize(part.size());
    search.p.resize(part.size());
    in_ranges(static_cast<int>(part.size()), contacts_at_once, [&](int from, int to) {
      for (int k = from; k < to; ++k) {
        system.touch[k] = every[part[k]];
        search.p[k] = every_p[part[k]];
      }
    });
    system.list();
    system.velocities(search.p, search.v);
    search.start();
    const bool done = search.best <= tolerance || search.run(settings, report);
    for (int i = 0, k = 0; i < nc; ++i) every_p[i] = chosen[i] ? search.best_p[k++] : Vec3::Zero();
    system.touch.resize(every.size());
    in_ranges(nc, contacts_at_once, [&](int from, int to) {
      std::copy(every.begin() + from, every.begin() + to, system.touch.begin() + from);
    });
    system.list();
    search.best_p = every_p;
    for (int i = 0; i < nc; ++i) {
      const Touch& t = every[i];
      if (chosen[i] || system.open_still(t, Vec3::Zero(), search.best_v.data())) continue;
      search.best =
          larger(search.best, natural_residual(t.law, system.relative(t, search.best_v.data()) + t.bias,
                                               Vec3::Zero(), t.scale(), 0));
    }
    const bool enough = search.enough();
    if (whole || enough) return enough;
    for (int i = 0; i < nc; ++i) {
      const Touch& t = every[i];
      if (!chosen[i])
        chosen[i] = !done || system.relative_normal(t, search.best_v.data()) + t.bias.x() < tolerance;
    }
  }
}

/// The impulses of the problem, within the law's bounds.
void start_from(const ContactProblem& problem, const System& system, std::vector<Vec3>& p) {
  p.resize(system.touch.size());
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      Vec3 start = problem.contacts[t.id].impulse;
      if (!start.allFinite() || !(t.w > 0)) start.setZero();
      Law cone = t.law;
      cone.exact = false;
      project(cone, start, 1, 1, p[i], nullptr);
    }
  });
}

}  // namespace

double ContactSolver::sweep(ContactProblem& problem, int count) {
  problem.v = problem.v_hat;
  if (problem.contacts.empty()) return 0;
  Search& search = work_->search;
  System& system = search.system;
  system.assemble(problem, true);
  start_from(problem, system, search.p);
  system.velocities(search.p, search.v);
  detail::sweep(system, search.p, search.v, count);
  system.velocities(search.p, search.v);
  for (int i = 0; i < system.contacts(); ++i) problem.contacts[system.touch[i].id].impulse = search.p[i];
  system.write(search.v, problem);
  return system.residual(search.v, search.p);
}

SolveReport ContactSolver::solve(ContactProblem& problem, const SolveSettings& settings) {
  SolveReport report;
  problem.v = problem.v_hat;
  if (problem.contacts.empty()) {
    report.converged = true;
    return report;
  }
  Search& search = work_->search;
  System& system = search.system;
  system.assemble(problem, settings.exact_coulomb);
  const int nc = system.contacts();
  const double tolerance = settings.tolerance * settings.velocity_scale;
  system.most_excused = tolerance;
  search.aim(settings);
  start_from(problem, system, search.p);
  system.velocities(search.p, search.v);
  search.start();
  if (!std::isfinite(search.best)) {  // of a wild start, or the problem's own
    search.start_from_nothing();
    search.start();
  }
  const bool solvable = std::isfinite(search.best);
  bool done = !solvable || search.best <= tolerance;
  const bool few = nc <= Search::few_contacts;
  const bool frictionless = std::all_of(system.touch.begin(), system.touch.end(),
                                        [](const Touch& t) { return t.law.mu == 0 && t.law.cohesion == 0; });
  const bool by_normals = !few && frictionless;  // forces that hold each other do not matter there
  if (!done && !by_normals && settings.goes_on) {
    sweeps(search, tolerance, report);
    done = search.best <= tolerance || search.goes_on(settings, report);
  }
  if (!done && !by_normals && (few || settings.unstressed)) done = search.unstressed(settings, report);
  if (done) {
    // or a figure of the problem is none
  } else if (by_normals) {
    work_->normal.run(system, search.p, search.v, tolerance, 300);
    system.velocities(search.p, search.v);
    search.consider(search.p, search.v, system.residual(search.v, search.p));
    // The caller goes on from what is left: worth it if the same gain twice more would do.
    const double left = search.best / settings.velocity_scale;
    done = search.enough() && search.best * square(left) <= tolerance;
  } else if (few || search.best > Search::near * settings.velocity_scale) {
    sweeps(search, tolerance, report);
  }
  if (!done && search.best > tolerance) {
    if (few)
      search.run(settings, report);
    else
      solve_in_parts(search, work_->every, work_->every_p, work_->chosen, settings, report);
  }
  for (int i = 0; i < nc; ++i) problem.contacts[system.touch[i].id].impulse = search.best_p[i];
  system.write(search.best_v, problem);
  report.residual = search.best / settings.velocity_scale;
  search.aim(settings);  // whatever was asked for on the way
  report.converged = search.enough();
  return report;
}

bool ContactSolver::balance(ContactProblem& problem, double still, double moving,
                            const std::function<double()>& fastest, SolveReport* report) {
  constexpr double part = 0.1;  // of the speed of what rests, left by the iteration
  constexpr int most_rounds = 6;
  ContactProblem closed = problem;
  std::vector<std::size_t> from;
  closed.contacts.clear();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    ProblemContact c = problem.contacts[i];
    if (c.compliance.isZero(0)) {
      if (c.bias.x() > still) continue;
      if (c.bias.norm() <= still) c.bias.setZero();
    }
    closed.contacts.push_back(c);
    from.push_back(i);
  }
  Search& search = work_->search;
  System& system = search.system;
  system.assemble(closed, true);
  search.prepare();
  start_from(closed, system, search.p);
  std::vector<Vec3> about(search.p.size(), Vec3::Zero());
  double before = moving;
  for (int round = 0; round < most_rounds; ++round) {
    system.velocities(search.p, search.v);
    const int iterations = search.give_about(about, part * still);
    for (ProblemContact& c : problem.contacts) c.impulse.setZero();
    for (int i = 0; i < system.contacts(); ++i)
      problem.contacts[from[static_cast<std::size_t>(system.touch[i].id)]].impulse = search.p[i];
    problem.v = problem.v_hat;
    system.write(search.v, problem);
    const double speed = fastest();
    if (report != nullptr) {
      report->newton += iterations;
      report->residual = search.best;
    }
    // A path that stopped short may be on its way to forces that hold each other.
    if (speed <= still && search.best <= part * still) return true;
    if (!(speed < before)) return false;
    before = 0.5 * speed;
    about = search.p;
  }
  return false;
}

double coulomb_residual(const ContactProblem& problem, bool exact_coulomb) {
  System system;
  system.assemble(problem, exact_coulomb);
  std::vector<Vec3> p(system.touch.size());
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = problem.contacts[system.touch[i].id].impulse;
  std::vector<double> v, reach;
  system.velocities(p, v);
  system.impulse_reach(p, reach);
  double worst = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Touch& t = system.touch[i];
    const ProblemContact& contact = problem.contacts[t.id];
    const Vec3 u = contact.bias + problem.relative(contact, problem.v);
    const double round_off = system.round_off(t, reach);
    worst = larger(worst,
                   natural_residual(t.law, u + t.compliance.cwiseProduct(p[i]), p[i], t.scale(), round_off));
    worst = larger(worst, (u - t.bias - system.relative(t, v.data())).norm() - round_off);
  }
  return worst;
}

}  // namespace talus::contact

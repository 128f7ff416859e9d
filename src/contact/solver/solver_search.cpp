#include "contact/solver/solver_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "contact/solver/solver_sweep.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::detail {

bool Search::consider(const std::vector<Vec3>& candidate, const std::vector<double>& velocities,
                      double residual) {
  if (!(residual < best)) return false;
  best = residual;
  best_p = candidate;
  best_v = velocities;
  return true;
}

void Search::start() {
  best = INFINITY;
  if (consider(p, v, system.residual(v, p))) return;
  best_p = p;  // whatever it is: what is left here is of another problem
  best_v = v;
}

bool Search::enough() const {
  if (best <= sufficient_) return true;
  if (!(most_ > 0)) return false;
  const double enough = std::max(sufficient_, std::min(settings_->of_motion * system.speed(best_v), most_));
  return best <= enough || system.residual_by_mass(best_v, best_p, std::min(1.0, enough / most_)) <= enough;
}

bool Search::newton(double epsilon, int max_newton, bool held) {
  NewtonOptions options;
  options.tolerance = tolerance_;
  options.sufficient = sufficient_ > tolerance_ ? sufficient_ : round_off_;
  options.max_outer = settings_->max_outer;
  options.epsilon = epsilon;
  options.max_newton = max_newton;
  options.held = held;
  options.most = std::max(settings_->tolerance, settings_->sufficient) * settings_->velocity_scale;
  trial_p_ = p;
  trial_v_ = v;
  const NewtonOutcome outcome = newton_.run(system, trial_p_, trial_v_, options);
  report_->newton += outcome.newton;
  report_->outer += outcome.outer;
  least_ = std::max(least_, outcome.least);
  consider(trial_p_, trial_v_, outcome.residual);
  return enough();
}

namespace {

/// Contacts that give a little about impulses, u + r (p - about), until it is destroyed.
class Giving {
 public:
  Giving(std::vector<Touch>& touches, double give, const std::vector<Vec3>& about) : touches_(touches) {
    own_.reserve(touches.size());
    for (std::size_t i = 0; i < touches.size(); ++i) {
      Touch& t = touches[i];
      own_.push_back({t.compliance, t.bias});
      t.compliance = t.compliance.cwiseMax(give * square(t.load) * t.w);
      if (!about.empty()) t.bias -= (t.compliance - own_[i].compliance).cwiseProduct(about[i]);
    }
  }
  ~Giving() {
    for (std::size_t i = 0; i < own_.size(); ++i)
      touches_[i].compliance = own_[i].compliance, touches_[i].bias = own_[i].bias;
  }
  Giving(const Giving&) = delete;
  Giving& operator=(const Giving&) = delete;

 private:
  struct Own {
    Vec3 compliance, bias;
  };
  std::vector<Touch>& touches_;
  std::vector<Own> own_;
};

}  // namespace

bool Search::interior(double distance) {
  constexpr double left = 0.3;  // of what is wanted
  InteriorOptions options;
  options.tolerance = std::max(tolerance_, 1e-7 * settings_->velocity_scale);
  options.start = distance;
  options.sweeps = 15;
  options.correctors = 2;
  const std::vector<Vec3> start = p;
  const double wanted = options.tolerance;
  std::vector<double> apart(v.size());
  // What it leaves is to be no more than is wanted.
  double reach = 0;
  for (std::size_t i = 0; i < p.size(); ++i)
    reach = std::max(reach, square(system.touch[i].load) * system.touch[i].w * p[i].norm());
  double lent = !unstressed_first() && reach > 0 ? std::min(give, left * wanted / reach) : give;
  for (bool again = false;; again = true) {
    trial_p_ = start;
    system.velocities(trial_p_, trial_v_);
    InteriorOutcome outcome;
    {
      const Giving giving(system.touch, lent, {});
      outcome = interior_.run(system, trial_p_, trial_v_, options);
    }
    report_->newton += outcome.iterations;
    // Without what was lent, of the velocities that follow from the impulses and of the path's own.
    p = trial_p_;
    system.velocities(p, v);
    std::ranges::transform(trial_v_, v, apart.begin(), std::minus<>{});
    const double own = system.residual_apart(trial_v_, apart, p), following = system.residual(v, p);
    consider(p, v, following);
    consider(p, trial_v_, own);
    if (best <= tolerance_ || (unstressed_first() ? newton(give, 20) : enough())) return true;
    const double residual = std::min(own, following);
    if (again || outcome.residual > options.tolerance || residual <= 2 * wanted) return false;
    // So little that what it leaves suffices, and solved so closely that it still tells.
    lent *= left * wanted / residual;
    options.tolerance = left * left * wanted;
  }
}

bool Search::polish() {
  constexpr int iterations = 40;
  if (system.contacts() > DualNewton::most_contacts || best > 1e-2 * settings_->velocity_scale) return false;
  if (best >= polished_) return false;  // it was there before, and would end where it did
  polished_ = best;
  trial_p_ = best_p;
  const DualOutcome outcome = dual_.run(system, trial_p_, trial_v_, tolerance_, sufficient_, iterations);
  report_->newton += outcome.iterations;
  consider(trial_p_, trial_v_, outcome.residual);
  return enough();
}

double Search::swept(int count) {
  system.velocities(p, v);
  sweep(system, p, v, count);
  report_->sweeps += count;
  system.velocities(p, v);
  const double residual = system.residual(v, p);
  consider(p, v, residual);
  return residual;
}

/// From p, visits to the contacts that are off, `count` per contact at most; their residual.
double Search::visited(int count) {
  system.velocities(p, v);
  local_.run(system, p, v, tolerance_, count);
  system.velocities(p, v);
  const double residual = system.residual(v, p);
  consider(p, v, residual);
  return residual;
}

void Search::from_best() {
  p = best_p;
  v = best_v;
}

void Search::start_from_nothing() {
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = Vec3(std::max(0.0, system.touch[i].law.floor), 0, 0);
  system.velocities(p, v);
}

void Search::aim(const SolveSettings& settings) {
  settings_ = &settings;
  tolerance_ = settings.tolerance * settings.velocity_scale;
  sufficient_ = std::max(settings.tolerance, settings.sufficient) * settings.velocity_scale;
  most_ = settings.most * settings.velocity_scale;
}

void Search::begin(const SolveSettings& settings, SolveReport& report) {
  aim(settings);
  report_ = &report;
  polished_ = INFINITY;
  round_off_ = 0;
  least_ = 0;
  hessian_.prepare(system);
}

void Search::ask_for_tolerance() {
  round_off_ = std::min(100 * tolerance_, sufficient_);  // where rows that repeat each other may hold it
  sufficient_ = tolerance_;                              // what else would do depends on where it began
  most_ = 0;
}

bool Search::unstressed(const SolveSettings& settings, SolveReport& report) {
  begin(settings, report);
  ask_for_tolerance();
  for (Vec3& impulse : p) impulse *= 0.5;  // of the same region
  system.velocities(p, v);
  newton(soft, first_try(), true);
  p = best_p;
  swept(6);  // to round-off
  // Rows of walls on both sides of a body, whose normals differ in their last digits, leave by what it slides
  // at most: less is to be had by jamming it alone.
  return best <= round_off_;
}

bool Search::goes_on(const SolveSettings& settings, SolveReport& report) {
  begin(settings, report);
  const double enough = sufficient_;
  ask_for_tolerance();
  from_best();
  newton(soft, first_try());
  return best <= enough;
}

bool Search::alternated(std::vector<Vec3> start) {
  constexpr int rounds = 4, visits = 15, factorisations = 30;
  p.swap(start);
  for (int round = 0; round < rounds; ++round) {
    visited(visits);
    if (enough() || newton(loose, factorisations)) return true;
    p = newton_.last_impulses();
  }
  return false;
}

bool Search::path_from(double distance) {
  constexpr double far_on = 1e-2;  // part of its work that a path has left
  if (interior(distance)) return true;
  // Visits from a path that was blocked before it got anywhere would find forces that hold each other.
  if (interior_.work_left() < far_on && alternated(interior_.last_impulses())) return true;
  from_best();
  return newton(firm, 20) || polish();
}

int Search::give_about(const std::vector<Vec3>& about, double tolerance) {
  InteriorOptions options;
  options.tolerance = tolerance;
  options.start = system.residual(v, p);
  options.correctors = 2;
  const Giving giving(system.touch, give, about);
  const InteriorOutcome outcome = interior_.run(system, p, v, options);
  system.velocities(p, v);
  best = outcome.residual;
  return outcome.iterations;
}

bool Search::run(const SolveSettings& settings, SolveReport& report) {
  begin(settings, report);
  if (settings.at_hand) return newton(strong, 8);
  if ((unstressed_first() || best <= near * settings.velocity_scale) &&
      (newton(soft, first_try()) || polish()))
    return true;
  report.method = Method::interior_point;
  p = best_p;
  if (contradicted()) return false;
  if (path_from(0.5 * best)) return true;
  if (contradicted()) return false;
  p = best_p;
  const double left = visited(30);
  if (enough() || path_from(left)) return true;
  start_from_nothing();
  return path_from(system.residual(v, p));
}

}  // namespace talus::contact::detail

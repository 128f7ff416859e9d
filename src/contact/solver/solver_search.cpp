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

bool Search::newton(double epsilon, int max_newton) {
  NewtonOptions options;
  options.tolerance = tolerance_;
  options.sufficient = sufficient_ > tolerance_ ? sufficient_ : round_off_;
  options.max_outer = settings_->max_outer;
  options.epsilon = epsilon;
  options.max_newton = max_newton;
  options.most = stalled_;
  trial_p_ = p;
  trial_v_ = v;
  const NewtonOutcome outcome = newton_.run(system, trial_p_, trial_v_, options);
  report_->newton += outcome.newton;
  report_->outer += outcome.outer;
  least_ = std::max(least_, outcome.least);
  consider(trial_p_, trial_v_, outcome.residual);
  return best <= sufficient_;
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
  const bool many = system.contacts() > few_contacts;
  options.sweeps = many ? 15 : 0;
  options.correctors = many ? 2 : 0;
  if (settings_->most_factorisations > 0)
    options.max_iterations =
        std::clamp(settings_->most_factorisations - report_->newton, 1, options.max_iterations);
  const std::vector<Vec3> start = p;
  const double wanted = options.tolerance;
  std::vector<double> apart(v.size());
  // What it leaves is to be no more than is wanted.
  double reach = 0;
  for (std::size_t i = 0; i < p.size(); ++i)
    reach = std::max(reach, square(system.touch[i].load) * system.touch[i].w * p[i].norm());
  double lent = many && reach > 0 ? std::min(give, left * wanted / reach) : give;
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
    if (best <= tolerance_ || (!many && newton(give, 20))) return true;
    if (many && best <= sufficient_) return true;
    const double residual = std::min(own, following);
    if (again || outcome.residual > options.tolerance || residual <= 2 * wanted) return false;
    // So little that what it leaves suffices, and solved so closely that it still tells.
    lent *= left * wanted / residual;
    options.tolerance = left * left * wanted;
  }
}

bool Search::polish(int iterations) {
  if (system.contacts() > DualNewton::most_contacts || best > 1e-2 * settings_->velocity_scale) return false;
  if (best >= polished_ && iterations <= polished_for_)
    return false;  // it was there before, and would end where it did
  polished_ = best;
  polished_for_ = iterations;
  trial_p_ = best_p;
  const DualOutcome outcome = dual_.run(system, trial_p_, trial_v_, tolerance_, sufficient_, iterations);
  report_->newton += outcome.iterations;
  consider(trial_p_, trial_v_, outcome.residual);
  return best <= sufficient_;
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

/// Visits and Newton's method in turn: the former settle what is light or loose, over which the latter goes
/// round in a cycle, the latter what runs through many bodies.
bool Search::alternated(const std::vector<Vec3>& start, int rounds) {
  constexpr double enough = 0.25;  // of what is taken where no more is to be had: less is not worth a round
  p = start;
  for (int round = 0; round < rounds && !hopeless(150); ++round) {
    visited(15);
    if (best <= sufficient_ || newton(0.1, 30)) return true;
    if (best <= enough * stalled_) return true;
    p = newton_.last_impulses();
  }
  return false;
}

bool Search::from_near() { return newton(soft, 20) || polish(); }

bool Search::swept_while_it_pays() {
  p = best_p;
  double before = best;  // when it last paid
  for (int round = 0, idle = 0; round < 20 && idle < 4;
       ++round) {  // the largest residual of one round says little: contacts hand it on
    swept(20);
    if (best <= sufficient_) return true;
    idle = best > 0.9 * before ? idle + 1 : 0;
    if (idle == 0) before = best;
  }
  return false;
}

void Search::from_best() {
  p = best_p;
  v = best_v;
}

void Search::start_from_nothing() {
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = Vec3(std::max(0.0, system.touch[i].law.floor), 0, 0);
  system.velocities(p, v);
}

void Search::hold_shift() {
  for (int i = 0; i < system.contacts(); ++i) {
    Touch& t = system.touch[i];
    const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
    t.shift = t.law.exact ? t.law.mu * length(u.y(), u.z()) : 0.0;
  }
}

bool Search::shifted(int rounds, int budget) {
  from_best();
  const int most = report_->newton + budget;  // a step that cannot be solved must not hang
  bool done = false;
  for (int k = 0; k < rounds && !done && report_->newton < most; ++k) {
    hold_shift();
    NewtonOptions options;
    options.tolerance = std::max(tolerance_, 0.01 * best);
    options.max_outer = settings_->max_outer;
    options.convex = true;
    options.epsilon = firm;
    options.max_newton = settings_->max_newton;
    const NewtonOutcome outcome = newton_.run(system, p, v, options);
    report_->newton += outcome.newton;
    report_->outer += 1;
    system.velocities(p, v);
    consider(p, v, system.residual(v, p));
    done = best <= sufficient_ || newton(firm, 25);
  }
  for (Touch& t : system.touch) t.shift = 0;
  return done;
}

bool Search::solved_from_best() {
  p = best_p;
  system.velocities(p, v);
  best = INFINITY;
  polished_ = INFINITY;
  polished_for_ = 0;
  consider(p, v, system.residual(v, p));
  if (best <= sufficient_ || from_near()) return true;
  from_best();
  if (interior(0.5 * best)) return true;
  from_best();
  return from_near();
}

bool Search::raised(double step) {
  constexpr double moderate = 1;
  constexpr int most_factorisations = 600;  // until it goes straight to its own
  const double own =
      std::ranges::max_element(system.touch, {}, [](const Touch& t) { return t.law.mu; })->law.mu;
  if (own <= moderate) return false;
  const std::vector<Touch> touches = system.touch;
  const auto hold_at = [&](double friction) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      Law& law = system.touch[i].law = touches[i].law;
      if (law.mu <= friction) continue;
      law.mu = friction;
      law.floor_bound = friction * law.floor + law.cohesion;
    }
  };
  const std::vector<Vec3> before_p = best_p;
  const std::vector<double> before_v = best_v;
  const double before = best;
  const int last = report_->newton + most_factorisations;
  for (double friction = moderate; friction < own && report_->newton < last; friction *= step) {
    hold_at(friction);
    solved_from_best();
  }
  hold_at(own);
  if (solved_from_best()) return true;
  best = before;
  best_p = before_p;
  best_v = before_v;
  return false;
}

bool Search::hopeless(int factorisations, bool tried) const {
  if (spent()) return true;
  return settings_->sufficient > settings_->tolerance && best <= 100 * sufficient_ &&
         (tried || report_->newton > factorisations);
}

bool Search::spent() const {
  return least_ > stalled_ ||
         (settings_->most_factorisations > 0 && report_->newton >= settings_->most_factorisations);
}

void Search::begin(const SolveSettings& settings, SolveReport& report) {
  settings_ = &settings;
  report_ = &report;
  polished_ = INFINITY;
  polished_for_ = 0;
  round_off_ = 0;
  least_ = 0;
  tolerance_ = settings.tolerance * settings.velocity_scale;
  sufficient_ = std::max(settings.tolerance, settings.sufficient) * settings.velocity_scale;
  stalled_ = std::max(settings.stalled * settings.velocity_scale, sufficient_);
  hessian_.prepare(system);
}

bool Search::unstressed(const SolveSettings& settings, SolveReport& report) {
  begin(settings, report);
  sufficient_ = tolerance_;  // what else would do depends on where the search began
  round_off_ = std::min(100 * tolerance_,
                        std::max(settings.tolerance, settings.sufficient) *
                            settings.velocity_scale);  // where rows that repeat each other may hold it
  for (Vec3& impulse : p) impulse *= 0.5;              // of the same region
  system.velocities(p, v);
  newton(soft, 20);
  p = best_p;
  swept(6);  // to round-off
  return best <= tolerance_;
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
  const bool small = system.n <= few_unknowns, many = system.contacts() > few_contacts;
  if (spent()) return false;
  // From farther off straight to the path.
  if ((small || best <= near * settings.velocity_scale) &&
      (small ? from_near() : newton(settings.proximal, std::min(settings.max_newton, 8)) || polish()))
    return true;
  if (spent()) return false;

  // A large island near rest with a tolerance relative to its speed: sweeps converge from the last impulses,
  // the interior-point method does not.
  if (!small && sufficient_ > 10 * tolerance_ && swept_while_it_pays()) return true;

  report.tier = 'B';

  // Cold: the interior point from the warm start, at half the distance its residual indicates (fewest
  // iterations over problems of moving piles). The Newton method finishes, since the regions are known by
  // then.
  double finished = INFINITY;  // the best that was tried last [m/s]
  int fruitless = 0;           // tries since the best was last halved
  const auto finish = [&] {
    from_best();
    fruitless = best > 0.5 * finished ? fruitless + 1 : 0;
    if (best >= finished) return false;
    finished = best;
    if (!small && best > 1e-3 * settings.velocity_scale) return false;
    return from_near() || (small && newton(firm, 20));
  };
  const auto given_up = [&] { return hopeless(many ? 150 : 300, !many && fruitless >= 2); };
  p = best_p;
  if (interior(0.5 * best)) return true;
  if (many) {  // a path from a poor start may be blocked before it gets anywhere
    if (interior_.work_left() < 1e-2 && alternated(interior_.last_impulses(), 2)) return true;
    if (finish() || best <= stalled_) return true;
    report.tier = 'E';
    if (given_up()) return false;
    start_from_nothing();
    if (!interior(system.residual(v, p)) && !alternated(interior_.last_impulses(), 4) && !finish())
      return false;
    report.tier = 'B';
    return true;
  }
  if (finish()) return true;
  // What a few sweeps make of the best so far (a path that stops short usually leaves a handful of contacts
  // wrong); nothing.
  for (int round = 0; round < 4 && !given_up(); ++round) {
    report.tier = 'B';
    if (round == 2 && !small) {  // the convex problems are a surer way on than a path from nothing
      report.tier = 'C';
      if (shifted(4, 100)) return true;
    }
    p = best_p;
    if (round < 2) {
      const double after = small ? swept(20) : visited(30);
      if (best <= sufficient_ || interior(round == 0 ? after : 0.3 * after)) return true;
    } else {
      start_from_nothing();
      if (interior(system.residual(v, p) * (round == 2 ? 1 : 10))) return true;
    }
    if (finish()) return true;
  }
  report.tier = 'E';
  if (given_up()) return false;
  // Many sweeps find regions that a path misses; costly, so only now and then of use.
  report.tier = 'C';
  if (raised(1.2) || raised(1.1)) return true;
  if (polish(200)) return true;
  for (int round = 0; round < (small ? 2 : 1); ++round) {
    from_best();
    if (round % 2 == 0) start_from_nothing();
    swept(100 << round);
    if (best <= sufficient_ || newton(soft, 20) || newton(firm, 30)) return true;
  }
  if (shifted(settings.max_outer, small ? 400 : 200) || polish(200)) return true;
  report.tier = 'E';
  return false;
}

}  // namespace talus::contact::detail

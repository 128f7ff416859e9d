#include "fem/integrators/condensed_motion.hpp"

#include <algorithm>
#include <cmath>

namespace talus::fem {

namespace {
constexpr double start_share = 10,
                 most_start_share = 0.1;  // of the energy of its fastest motion, and what it has dissipated,
                                          // that may be taken in all: times the accuracy, and at most
constexpr double least_start_share = 1e-3;     // of that, which one may take whatever the others took
constexpr double steps_worth_a_factor = 2000;  // explicit ones that cost as much as it and the first
                                               // frequency: 1200 at 10,000 degrees of freedom, 4000 at 80,000
constexpr double period_error = 3.3e-4;        // of the first mode: a hundredth of its period
constexpr double least_gain = 6;  // explicit steps that a condensed one has to save, unless it is asked for
}  // namespace

/// What takes less than the accuracy's part of the stored energy in a period of the first mode leaves the
/// motion what it was, to that accuracy. Of a structure that has broken little may be stored; what it has
/// taken so far is known to the accuracy, too: a hundred periods may add that part of it [J].
double CondensedMotion::taken_at_ease(double h) const {
  const double share = laws_share_ * h * factors_.lowest_frequency() / (2 * M_PI),
               stored = std::abs(forces_.stored());
  return std::max(1e-9 * stored,
                  share * (stored + 0.01 * (energy_.works.damage_work + energy_.works.plastic_work)));
}

bool CondensedMotion::at_ease(double h) const {
  return forces_.dissipation() <= taken_at_ease(h) && !(body_.damage && !spent_cells(body_).empty());
}

/// What condensed steps may take in all, beside what damping and laws do [J].
double CondensedMotion::budget(double accuracy) const {
  return std::min(start_share * accuracy, most_start_share) *
         (fields_.reference_kinetic + energy_.works.damage_work + energy_.works.plastic_work);
}

/// Over a way s the viscosity h/2 (K - K_now) takes 1/2 s . (K - K_now) s, most of it as cracks open and
/// close: as little as the laws may take, and a small part of what damping takes in the step or, without any,
/// of the motion; more only out of the budget, half of what is left of it.
bool CondensedMotion::viscosity_at_ease(double h, double taken, double damped, double kinetic) const {
  constexpr double of_damping = 0.05, of_motion = 1e-3;  // in a period of the first mode
  const double always =
      taken_at_ease(h) +
      (body_.alpha > 0 ? of_damping * damped : of_motion * h * factors_.lowest_frequency() / M_PI * kinetic);
  return std::abs(taken) <= always + 0.5 * std::max(0.0, budget(laws_share_) - taken_);
}

bool CondensedMotion::loads_hold(double from, double to) const {
  return std::all_of(body_.loads.begin(), body_.loads.end(), [&](const PatchLoad& load) {
    if (load.factor(from) != load.factor(to)) return false;
    return std::all_of(load.history.begin(), load.history.end(), [&](const auto& point) {
      return point.first <= from || point.first >= to || point.second == load.factor(from);
    });
  });
}

bool CondensedMotion::possible(double t, double laws_share) {
  // Where neither weight nor damping asked for a factor, none is made before explicit steps have cost as
  // much: a short run needs none.
  if (!body_.factored && !by_choice() && fields_.steps_taken < steps_worth_a_factor) return false;
  if (!factors_.possible()) return false;
  const double quarter = 0.5 * M_PI / factors_.lowest_frequency();
  if (t < blow_time_ + quarter || (!by_choice() && !loads_hold(t - quarter, t + quarter))) return false;
  forces_.evaluate(t);
  laws_share_ = laws_share;
  return at_ease(fields_.contact_step > 0 ? fields_.contact_step : body_.critical_step);
}

/// What a step gains is the island's to judge: contacts shorten explicit steps, rest lengthens this one.
double CondensedMotion::longest_step(double t, double accuracy, double within) {
  if (!possible(t, accuracy)) return 0;
  const double period = std::sqrt(12 * accuracy) / factors_.lowest_frequency(),  // off by (omega h)^2 / 12
      ringing = modal_.ringing_step(t, within);
  return ringing < std::min(period, body_.critical_step) ? 0 : std::min(period, ringing);
}

/// Length of step by which it goes on alone, 0: not by condensed steps [s]. What rubs in cracks is part of
/// how it rings down, and explicit steps follow it; so they do while cracks open and close, which are softer
/// than K (viscosity_at_ease()).
double CondensedMotion::lone_step(double t, double duration) {
  if (!possible(t, 0) || (!by_choice() && !loads_hold(t, t + duration))) return 0;
  const double longest =
      std::min(std::sqrt(12 * period_error) / factors_.lowest_frequency(), modal_.ringing_step(t));
  double steps = 1;  // a power of two: few factors serve
  while (longest * steps < duration * (1 - 1e-12)) steps *= 2;
  const double h = duration / steps;
  return h < (by_choice() ? 1.0 : least_gain) * body_.critical_step ? 0 : h;
}

bool CondensedMotion::advance(double t, double duration) {
  const double h = lone_step(t, duration);
  if (!(h > 0)) return false;
  const double steps = duration / h;
  for (double k = 0; k < steps; ++k) {
    const double now = t + duration * (k / steps);
    predict(now, h, false);
    if (correct(now, h, {})) continue;
    undo();
    struck(now);
    leapfrog_.advance(now, t + duration - now);
    break;
  }
  fields_.time = t + duration;
  return true;
}

/// What h does not resolve of the velocities, (1 - A^-1 M)^3 v: a mode keeps all but (x / (1 + x))^3 of its
/// own, x = (omega h)^2.
VecX CondensedMotion::unresolved_velocities(double h) {
  factors_.use(h, starting_);
  VecX v(body_.dofs.size), rhs(body_.dofs.size), kept(body_.dofs.size);
  gather(body_.dofs, fields_.v, v);
  for (int pass = 0; pass < 3; ++pass) {
    for (int d = 0; d < body_.dofs.size; ++d)
      rhs[d] = factors_.mass()[static_cast<std::size_t>(d)] * v[d] / factors_.scale();
    factors_.solve(rhs, kept);
    v -= kept;
  }
  return v;
}

bool CondensedMotion::may_begin(double t, double h, double accuracy) {
  if (fields_.h_last == 0 || !(body_.spec.damping_ratio > 0) || by_choice())
    return true;  // under way, or with all of its motion
  factors_.follow_frames();
  starting_ = true;  // by the factor of the first step
  const VecX v = unresolved_velocities(h);
  starting_ = false;
  double lost = 0;  // its kinetic energy, and as much that it stores
  for (int d = 0; d < body_.dofs.size; ++d)
    if (factors_.moves()[static_cast<std::size_t>(d)])
      lost += factors_.mass()[static_cast<std::size_t>(d)] * v[d] * v[d];
  // Half of what earlier starts have left of it: together they never take more, and one more is never far
  // off.
  const double all = budget(accuracy);
  const double most = std::max(0.5 * (all - taken_), least_start_share * all);
  if (lost <= most) return true;
  // Damping alone takes so long; contacts and cracks may be quicker.
  const double quarter = 0.5 * M_PI / factors_.lowest_frequency();
  blow_time_ = t + std::max(0.0, 0.5 * std::log(lost / most) / body_.alpha - quarter);
  return false;
}

/// Velocities come to the time of the displacements.
void CondensedMotion::leave_explicit(double t, double h, bool smoothed) {
  const double before = energy_.mechanical();
  leapfrog_.synchronise(t);
  fields_.time = t;
  starting_ = smoothed;
  if (smoothed) {
    VecX v(body_.dofs.size);
    gather(body_.dofs, fields_.v, v);
    scatter(body_.dofs, v - unresolved_velocities(h), fields_.v);
    ++fields_.revision;
  }
  const double taken = before - energy_.mechanical() -
                       (forces_.accepted() ? 0.0 : forces_.dissipation());  // which accept_laws() books
  energy_.works.algorithmic += taken;
  taken_ += std::max(0.0, taken);
}

void CondensedMotion::predict(double t, double h, bool smoothed) {
  modal_.leave();
  factors_.follow_frames();
  if (fields_.h_last > 0) leave_explicit(t, h, smoothed);
  forces_.evaluate(t);
  if (!forces_.accepted()) energy_.accept_laws();
  factors_.use(h, starting_);
  factors_.begin_step();
  stored_ = forces_.stored();
  const int n = body_.dofs.size;
  VecX v(n), stiff(n), rhs(n), push = VecX::Zero(n);
  gather(body_.dofs, fields_.v, v);
  factors_.stiffness().multiply(v.data(), stiff.data());
  AlignedVector mean(fields_.f_ext);
  if (!body_.loads.empty()) {
    forces_.load(t + h);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5 * (mean[i] + fields_.f_ext[i]);
    forces_.load(t);
  }
  for (int d = 0; d < n; ++d)
    if (const double mass = body_.mass[body_.dofs.node(d)]; mass > 0)
      push[d] =
          h * (mean[body_.dofs.place[d]] - fields_.f_int[body_.dofs.place[d]] - body_.alpha * mass * v[d]);
  rhs = push / factors_.scale() - stiff / factors_.theta();
  v_hat_.resize(n);
  factors_.solve(rhs, v_hat_);
  v_hat_ += v;
  scatter(body_.dofs, v_hat_, fields_.v_hat);
  before_.clear();
  whole_.save(before_);
}

bool CondensedMotion::correct(double t, double h, std::span<const NodeImpulse> impulses) {
  factors_.push(impulses, v_hat_);
  const double stored_before = forces_.stored();
  const AlignedVector external_before(fields_.f_ext), internal_before(fields_.f_int);
  fields_.take_impulses(h, impulses);
  AlignedVector v_before(fields_.v);
  scatter(body_.dofs, v_hat_, fields_.v);
  const double theta = factors_.theta();
  for (std::size_t i = 0; i < fields_.u.size(); ++i)
    fields_.u[i] += h * ((1 - theta) * v_before[i] + theta * fields_.v[i]);
  fields_.time = t + h;
  forces_.moved();
  forces_.evaluate(t + h);
  if (!at_ease(h)) return false;

  double gained = 0, kinetic = 0, moving = 0, damping = 0, external = 0, whole = 0, contact = 0;
  double sprung = 0, begun = 0;  // s . K s, s . f_int(u_n) of the way s
  for (std::size_t node = 0; node < body_.mass.size(); ++node) {
    const double m = body_.mass[node];
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = 4 * node + k;
      if (body_.inverse_mass[i] == 0) continue;
      const double mean = 0.5 * (v_before[i] + fields_.v[i]),
                   load = 0.5 * (external_before[i] + fields_.f_ext[i]);
      const double moved = h * ((1 - theta) * v_before[i] + theta * fields_.v[i]);
      gained += m * (fields_.v[i] - v_before[i]) * mean;
      kinetic += 0.5 * m * fields_.v[i] * fields_.v[i];
      moving += 0.5 * m * mean * mean;
      damping += h * body_.alpha * m * mean * mean;
      whole += load * moved;
      external += (load - m * body_.gravity[k]) * moved;
      contact += fields_.contact_impulse[i] * mean;
      begun += internal_before[i] * moved;
      sprung += (load - internal_before[i] - body_.alpha * m * mean +
                 (fields_.contact_impulse[i] - m * (fields_.v[i] - v_before[i])) / h) /
                theta * moved;  // by (4)
    }
  }
  const double by_laws = forces_.stored() - stored_before + forces_.dissipation(),
               viscous = 0.5 * sprung + begun - by_laws;
  if (!viscosity_at_ease(h, viscous, damping, kinetic)) return false;
  taken_ += std::max(0.0, viscous);
  energy_.works.contact_work += contact;
  energy_.works.damping_work += damping;
  if (!body_.loads.empty()) energy_.works.external_work += external;
  energy_.works.algorithmic += whole + contact - damping - gained - by_laws;
  loads_.watch(t + h, h);
  loads_.watch_probes(t + h);
  starting_ = false;
  energy_.stored_half = forces_.stored();
  fields_.reference_kinetic = std::max(fields_.reference_kinetic, kinetic);
  // What the step does not resolve turns from step to step and moves nothing.
  fields_.judge(moving > 1e-8 * fields_.reference_kinetic && moving > 1e-14 * forces_.stored(), fields_.time);
  return true;
}

void CondensedMotion::undo() {
  whole_.restore(before_);
  forces_.evaluate(
      fields_.time);  // explicit steps go on from what the laws say here after a step of no length
  energy_.works.algorithmic += stored_ - forces_.stored() - forces_.dissipation();
}

}  // namespace talus::fem

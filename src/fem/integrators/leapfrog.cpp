#include "fem/integrators/leapfrog.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "fem/materials/material_simd.hpp"

namespace talus::fem {

namespace {

// Nodal vectors hold three components and a zero: one node is one vector of the processor.
using material::V4, material::load4, material::store4, material::sum_of;

}  // namespace

/// Works of a step [J], but for `power` and `own` [W], `spent` cells and `breaking` segments: of this rank's
/// part, then of all.
struct Leapfrog::StepWorks {
  double contact = 0, damping = 0, external = 0, viscous = 0, power = 0, kinetic = 0, internal = 0,
         gravity = 0, own = 0, plastic = 0, cracking = 0, stored = 0, spent = 0, breaking = 0, jumped = 0;
};

void Leapfrog::predict(double t, double h) {
  if (fields_.h_last == 0 && fields_.steps_taken > 0) begin(h);
  forces_.evaluate(t);
  find_jump(h);
  const double kick = 0.5 * (fields_.h_last > 0 ? fields_.h_last + h : h);
  const double a = 0.5 * body_.alpha * kick;
  const double keep = (1 - a) / (1 + a), push = kick / (1 + a);
  fields_.drag = 1 + a;
  const bool jumped = !jump_.empty();
  const double* visc = fields_.f_visc.empty() ? nullptr : fields_.f_visc.data();
  for (const auto& [first, last] : body_.own)
    for (int i = 4 * first; i < 4 * last; i += 4) {
      const V4 pushed = push * load4(&body_.inverse_mass[i]);
      V4 out = keep * load4(&fields_.v[i]) + pushed * (load4(&fields_.f_ext[i]) - load4(&fields_.f_int[i]));
      if (jumped) out -= load4(&jump_[i]);
      if (visc != nullptr) out -= pushed * load4(visc + i);
      store4(&fields_.v_hat[i], out);
    }
  body_.discretisation.distribute(fields_.v_hat);
  ++fields_.predictions;
}

/// Gravity's work in an uneven step beyond the potential lost between the half steps, this rank's part [J].
double Leapfrog::excess_of_gravity(double kick, double h) const {
  double excess = 0;
  for (const auto& [first, last] : body_.own)
    for (int node = first; node < last; ++node)
      for (int k = 0; k < 3; ++k) {
        const std::size_t i = 4 * static_cast<std::size_t>(node) + static_cast<std::size_t>(k);
        if (body_.inverse_mass[i] == 0) continue;
        excess += 0.5 * body_.mass[node] * body_.gravity[k] *
                  (kick * (fields_.v[i] + fields_.v_hat[i]) -
                   (fields_.h_last * fields_.v[i] + h * fields_.v_hat[i]));
      }
  return excess;
}

/// Acceleration of the step by the forces that are the structure's own, this rank's part [W/s].
double Leapfrog::power_of_own_forces(double kick) const {
  const V4 fall{body_.gravity[0], body_.gravity[1], body_.gravity[2], 0}, none{};
  V4 power{};
  for (const auto& [first, last] : body_.own)
    for (int node = first; node < last; ++node) {
      const int i = 4 * node;
      const V4 own = body_.mass[node] * fall - load4(&fields_.f_int[i]);
      power += material::select(load4(&body_.inverse_mass[i]) != none,
                                (load4(&fields_.v_hat[i]) - load4(&fields_.v[i])) * own, none);
    }
  return sum_of(power) / kick;
}

/// Of impulses on nodes of the whole those on nodes of this rank's part; what hangs gives its own to those
/// that it follows.
std::vector<NodeImpulse> Leapfrog::impulses_here(std::span<const NodeImpulse> given) const {
  if (!body_.mesh.hanging.empty()) return body_.discretisation.condense(given);
  std::vector<NodeImpulse> here(given.begin(), given.end());
  if (!body_.divided()) return here;
  for (NodeImpulse& p : here) p.node = body_.partition->node_here(p.node);
  std::erase_if(here, [](const NodeImpulse& p) { return p.node < 0; });
  return here;
}

void Leapfrog::take_impulses(double h, std::span<const NodeImpulse> impulses) {
  fields_.take_impulses(h, impulses);
  for (const NodeImpulse& p : impulses) {
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      fields_.v_hat[i] += body_.inverse_mass[i] * p.impulse[c] / fields_.drag;
    }
  }
  body_.discretisation.distribute(fields_.v_hat);
  fields_.drag = 1;
}

/// Moves all nodes known here; the works at own ones.
void Leapfrog::move_nodes(double h, double kick, StepWorks& works) {
  const bool loaded = !body_.loads.empty();
  const double* visc = fields_.f_visc.empty() ? nullptr : fields_.f_visc.data();
  const double* jump = jump_.empty() ? nullptr : jump_.data();
  const V4 fall{body_.gravity[0], body_.gravity[1], body_.gravity[2], 0}, none{};
  V4 damping{}, external{}, viscous{}, power{}, kinetic{}, internal{}, jumped{};
  for (const auto& [first, last] : body_.own)
    for (int node = first; node < last; ++node) {
      const int i = 4 * node;
      const double m = body_.mass[node];
      const V4 before = load4(&fields_.v[i]), after = load4(&fields_.v_hat[i]), f = load4(&fields_.f_int[i]);
      store4(&fields_.u[i], load4(&fields_.u[i]) + h * after);
      store4(&fields_.v[i], after);
      power += f * after;
      kinetic += m * after * after;
      const V4 mean = material::select(load4(&body_.inverse_mass[i]) != none, 0.5 * (before + after),
                                       none);  // what is held does no work
      internal += kick * mean * f;
      if (visc != nullptr) viscous += kick * mean * load4(visc + i);
      const V4 lost = jump != nullptr ? load4(jump + i) : none;
      jumped += m * mean * lost;
      if (body_.alpha != 0)
        damping -=
            mean * (m * (after - before + lost) -
                    kick * (load4(&fields_.f_ext[i]) - f - (visc != nullptr ? load4(visc + i) : none)) -
                    load4(&fields_.contact_impulse[i]));
      if (loaded) external += kick * mean * (load4(&fields_.f_ext[i]) - m * fall);
    }
  works.damping = sum_of(damping), works.external = sum_of(external), works.viscous = sum_of(viscous);
  works.power = sum_of(power), works.kinetic = 0.5 * sum_of(kinetic), works.internal = sum_of(internal);
  works.jumped = sum_of(jumped);
  if (!body_.partition) return;
  body_.partition->exchange(fields_.v_hat);
  for (const auto& [first, last] : body_.partition->border_nodes())
    for (int i = 4 * first; i < 4 * last; ++i) {
      fields_.u[i] += h * fields_.v_hat[i];
      fields_.v[i] = fields_.v_hat[i];
    }
}

/// Enters the works of a step of all ranks.
void Leapfrog::account(double h, double kick, const StepWorks& works) {
  energy_.works.contact_work += works.contact;
  energy_.works.damping_work += works.damping;
  energy_.works.external_work += works.external;
  energy_.works.bulk_viscosity_work += works.viscous;
  energy_.works.plastic_work += works.plastic;
  energy_.works.damage_work += works.cracking;
  const double stored_before = fields_.h_last == 0 ? works.stored : energy_.stored_half;
  energy_.stored_half = works.stored + 0.5 * h * works.power;
  // What the laws took in the last condensed step is in its own books; here they are accepted.
  energy_.works.algorithmic += works.jumped;
  jump_.clear();
  energy_.works.algorithmic += works.internal - (energy_.stored_half - stored_before) -
                               (fields_.h_last > 0 ? works.cracking + works.plastic : 0.0) - works.gravity;
  if (h != fields_.h_last)
    energy_.lengthen(h, works.own,
                     fields_.h_last > 0
                         ? (2 * works.internal / kick - works.power - energy_.power) / fields_.h_last
                         : 0.0);
  energy_.power = works.power;
  energy_.power_valid = true;
}

void Leapfrog::correct(double t, double h, std::span<const NodeImpulse> given) {
  const std::vector<NodeImpulse> impulses = impulses_here(given);
  const double kick = 0.5 * (fields_.h_last > 0 ? fields_.h_last + h : h);
  ++fields_.steps_taken;
  take_impulses(h, impulses);
  loads_.watch(t + h, h);  // by the forces of this step, before the displacements move on
  StepWorks works;
  if (h != fields_.h_last) works.gravity = excess_of_gravity(kick, h), works.own = power_of_own_forces(kick);
  for (const NodeImpulse& p : impulses) {
    if (!body_.own_node(p.node)) continue;
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      works.contact += p.impulse[c] * 0.5 * (fields_.v[i] + fields_.v_hat[i]);
    }
  }
  move_nodes(h, kick, works);
  if (!forces_.accepted()) {  // else a condensed step that was begun and dropped has booked them
    works.plastic = (body_.bars ? body_.bars->dissipation() : 0.0) +
                    (body_.bearings && body_.first_rank() ? body_.bearings->dissipation() : 0.0);
    works.cracking = body_.damage ? body_.damage->dissipation() : 0.0;
  }
  works.stored = forces_.stored();
  const std::vector<int> eroding = body_.damage ? spent_cells(body_) : std::vector<int>{};
  works.spent = static_cast<double>(eroding.size());
  works.breaking = body_.bars ? body_.bars->breaking() : 0.0;
  auto numbers = std::bit_cast<std::array<double, sizeof(StepWorks) / sizeof(double)>>(works);
  body_.sum(numbers);
  works = std::bit_cast<StepWorks>(numbers);
  account(h, kick, works);
  fields_.h_last = h;
  fields_.time = t + h;
  loads_.watch_probes(t + h);
  fields_.reference_kinetic = std::max(fields_.reference_kinetic, works.kinetic);
  // Rounding alone never wakes a structure at rest.
  fields_.judge((works.kinetic > 1e-8 * fields_.reference_kinetic && works.kinetic > 1e-14 * works.stored) ||
                    !given.empty(),
                fields_.time);
  if (body_.bars) {
    body_.bars->accept();
    if (body_.partition && works.breaking > 0) body_.bars->find_broken();
  }
  if (body_.bearings) body_.bearings->accept();
  if (body_.damage) {
    if (works.spent > 0) fracture_.erode(body_.joined(eroding));
    body_.damage->accept();
    if (body_.bars) body_.bars->see_cracks(*body_.damage, fields_.u.data(), body_.live);
  }
  forces_.moved();
}

void Leapfrog::advance(double t, double duration) {
  const long steps = std::max(1L, static_cast<long>(std::ceil(duration / body_.critical_step * (1 - 1e-12))));
  const double h = duration / static_cast<double>(steps);
  for (long i = 0; i < steps; ++i) {
    const double now = t + duration * (static_cast<double>(i) / static_cast<double>(steps));
    predict(now, h);
    correct(now, h, {});
  }
  fields_.time = t + duration;
}

/// Brings velocities from the last half step to the time of the displacements.
void Leapfrog::synchronise(double t) {
  if (fields_.h_last == 0) return;
  forces_.evaluate(t);
  const double half = 0.5 * fields_.h_last;
  std::array<double, 2> powers{};  // a . f of its own, and v . f_int by the velocities that come here
  for (const auto& [first, last] : body_.own)
    for (int i = 4 * first; i < 4 * last; ++i) {
      fields_.v_hat[i] =
          fields_.v[i] + half * (body_.inverse_mass[i] * (fields_.f_ext[i] - fields_.f_int[i]) -
                                 body_.alpha * (body_.inverse_mass[i] > 0 ? fields_.v[i] : 0.0));
      powers[1] += fields_.f_int[i] * fields_.v[i];
    }
  // What presses goes on pressing: a node in balance with it would be kicked by half a step of the reaction.
  const double pressed = half / (fields_.contact_step > 0 ? fields_.contact_step : 1.0);
  for (const int n : fields_.struck)
    if (body_.own_node(n))
      for (int i = 4 * n; i < 4 * n + 3; ++i)
        fields_.v_hat[i] += pressed * body_.inverse_mass[i] * fields_.contact_impulse[i];
  powers[0] = power_of_own_forces(half);
  body_.sum(powers);
  energy_.lengthen(0, powers[0], (powers[1] - energy_.power) / fields_.h_last);
  for (const auto& [first, last] : body_.own)
    std::copy(fields_.v_hat.begin() + 4L * first, fields_.v_hat.begin() + 4L * last,
              fields_.v.begin() + 4L * first);
  fields_.h_last = 0;
  ++fields_.revision;
}

}  // namespace talus::fem

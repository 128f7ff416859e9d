#include "fem/integrators/modal_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/sort_unique.hpp"

namespace talus::fem {

namespace {
/// Explicit steps that cost about as much as the search for so many modes, factor included. Both grow about
/// alike with the structure: 0.3 s for 24 modes of 9720 degrees of freedom, where a step takes 0.1 ms, of
/// which motion in modes with dense records saves two thirds.
inline double steps_worth(int modes) { return 3500 + 40.0 * modes + static_cast<double>(modes) * modes / 6; }

constexpr int most_modes = 384;
constexpr std::size_t most_values = 4'000'000;  // doubles in the modes
constexpr double truncated_energy = 1e-3;  // share of the energy in motion that modes left out may hold; or
constexpr double truncated_motion =
    5e-3;  // the largest displacement that they may bring, over the largest of one mode at the peak so far
constexpr double truncated_most =
    0.1;  // and even then no larger share of the energy, or of the peak's truncated_energy
constexpr double ringing_error = 3e-3;  // displacement by phases that are off, over the largest of the first
                                        // mode with the greatest kinetic energy
constexpr double longest_memory =
    100;  // 1 / omega_1: for which a phase is to be right where there is little damping
}  // namespace

ModalMotion::Basis& ModalMotion::basis() {
  if (basis_.modes.omega.size() == std::min(modes_, body_.dofs.size)) return basis_;
  basis_ = {};
  carried_ = {};
  running_ = false;
  Basis& l = basis_;
  const int n = body_.dofs.size, loads = static_cast<int>(body_.loads.size());
  l.mass = of_dofs(body_.dofs, body_.built_mass);
  l.gravity.resize(n);
  VecX weight(n);
  for (int d = 0; d < n; ++d) weight[d] = l.mass[d] * body_.gravity[body_.dofs.place[d] % 4];
  body_.elastic->factor().solve(weight.data(), l.gravity.data());
  factors_.drop();  // not both at a time: the search is the largest thing that a structure holds
  l.modes = lowest_modes(body_.elastic->factor(), l.mass, modes_);
  l.pattern = MatX::Zero(n, loads);
  MatX statics(n, loads);
  for (int k = 0; k < loads; ++k) {
    for (std::size_t i = 0; i < body_.loads[k].node.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = body_.dofs.number[body_.loads[k].node[i]][c]; d >= 0)
          l.pattern(d, k) += body_.loads[k].force[i][c];
    body_.elastic->factor().solve(l.pattern.col(k).data(), statics.col(k).data());
  }
  l.participation = l.modes.phi.transpose() * l.pattern;
  l.correction =
      statics - l.modes.phi * l.modes.omega.cwiseAbs2().cwiseInverse().asDiagonal() * l.participation;
  factor_.resize(loads);
  body_.report(fmt::format("structure {}: {} modes, {:.4g} to {:.4g} Hz", body_.spec.name,
                           l.modes.omega.size(), l.modes.omega[0] / (2 * M_PI),
                           l.modes.omega[l.modes.omega.size() - 1] / (2 * M_PI)));
  return l;
}

int ModalMotion::modes_at_most() const {
  return std::max(std::min(modes_, body_.dofs.size),
                  std::min({most_modes, body_.dofs.size,
                            static_cast<int>(most_values / static_cast<std::size_t>(body_.dofs.size))}));
}

bool ModalMotion::possible() const {
  const bool factorable = !body_.supports.none && !body_.divided() && body_.dofs.size > 0 &&
                          body_.dofs.size <= largest_factored_system;
  return !body_.finite && !body_.bars && !body_.bearings && factorable;
}

bool ModalMotion::due() const { return fields_.steps_taken >= std::max(try_, steps_worth(modes_)); }

/// Modes that a run of `duration` [s] may come to ask for. By choice of the integrator all of them; by
/// default each search waits for as many steps alone as it would cost (advance_alone), of which short
/// intervals may make twice as many as fit into the time.
int ModalMotion::modes_within(double duration) const {
  int modes = std::min(modes_, body_.dofs.size);
  if (!possible() || (body_.spec.integrator != "auto" && body_.spec.integrator != "modal")) return modes;
  const int most = modes_at_most();
  if (body_.spec.integrator == "modal") return most;
  const double steps = 2 * duration / body_.critical_step;
  while (modes < most && steps >= steps_worth(std::min(2 * modes, most))) modes = std::min(2 * modes, most);
  return modes;
}

double ModalMotion::memory(double duration) const {
  double bytes = body_.damage ? 6e6 + 4e3 * static_cast<double>(body_.mesh.hexes.size())
                              : 0.0;  // pieces; history of the law where it is needed
  if (body_.partition || body_.supports.none || body_.dofs.size == 0 ||
      body_.dofs.size > largest_factored_system)
    return bytes;
  const int modes = modes_within(duration);
  const double kept = sizeof(double) * static_cast<double>(body_.dofs.size) * modes;
  return bytes + kept + std::max(memory_of_search(body_.dofs.size, modes), factors_.memory());
}

bool ModalMotion::more_modes() {
  const int next = std::min(2 * modes_, modes_at_most());
  if (next <= modes_) return false;
  modes_ = next;
  return true;
}

/// The present state in the modes. Returns whether they hold it well enough to go on in them alone.
bool ModalMotion::project(double t) {
  Basis& l = basis();
  const int n = body_.dofs.size;
  for (int k = 0; k < factor_.size(); ++k) factor_[k] = body_.loads[k].factor(t);
  VecX u(n), v(n), stiff(n);
  gather(body_.dofs, fields_.u, u);
  gather(body_.dofs, fields_.v, v);
  // All modes see u - u_g - K^-1 P c as the motion about the static answer; those kept take P c into their
  // own equation.
  const VecX w = u - l.gravity - l.correction * factor_;
  q_ = l.modes.phi.transpose() * l.mass.cwiseProduct(w);
  rate_ = l.modes.phi.transpose() * l.mass.cwiseProduct(v);
  const VecX left = w - l.modes.phi * q_, left_rate = v - l.modes.phi * rate_;
  body_.elastic->stiffness().multiply(left.data(), stiff.data());
  rest_.energy = 0.5 * (left.dot(stiff) + left_rate.dot(l.mass.cwiseProduct(left_rate)));
  rest_.amplitude = 1;
  const VecX& omega = l.modes.omega;
  const double highest = omega[omega.size() - 1];
  rest_.velocity = left_rate + highest * left;
  const double whole = 0.5 * rest_.velocity.dot(l.mass.cwiseProduct(rest_.velocity));
  rest_.velocity *= whole > 0 ? std::sqrt(rest_.energy / whole) : 0.0;

  const VecX about = q_ - omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * factor_);
  const double kept = 0.5 * (rate_.squaredNorm() + omega.cwiseProduct(about).squaredNorm());
  rest_.excess = 1;
  if (rest_.energy <= std::max(truncated_energy * kept, 1e-12 * std::max(fields_.reference_kinetic, 1e-12)))
    return true;
  double motion = 0;
  for (int i = 0; i < omega.size(); ++i)
    motion = std::max(motion,
                      std::hypot(about[i], rate_[i] / omega[i]) * l.modes.phi.col(i).cwiseAbs().maxCoeff());
  const double at_peak = motion * std::sqrt(std::max(1.0, fields_.reference_kinetic / kept)),
               brought = left.cwiseAbs().maxCoeff() + left_rate.cwiseAbs().maxCoeff() / highest;
  rest_.excess = std::max(brought / (truncated_motion * at_peak),
                          rest_.energy <= truncated_most * kept
                              ? 0.0
                              : std::sqrt(rest_.energy / (truncated_energy * fields_.reference_kinetic)));
  return rest_.excess <= 1;
}

/// Modes did not hold the motion at the last try. When the next is due: with twice as many of them, or where
/// the last doubling did little and damping gets there, once what is left out has decayed.
void ModalMotion::put_off() {
  const double excess = rest_.excess,
               wait = body_.alpha > 0 ? 2 * std::log(excess) / (body_.alpha * body_.critical_step)
                                      : std::numeric_limits<double>::infinity();  // [steps]
  const bool flat = excess > 0.7 * last_excess_;
  last_excess_ = excess;
  if (std::isfinite(wait) && (flat || wait < steps_worth(2 * modes_))) {
    try_ = fields_.steps_taken + std::max(wait, 100.0);
    return;
  }
  more_modes();
  try_ = std::max(2 * fields_.steps_taken, steps_worth(modes_));
}

/// Starts modal motion from the present state, if modes enough for it can be had.
bool ModalMotion::enter(double t, bool forced) {
  const double before = energy_.mechanical(), read_less = energy_.works.step_dependence;
  leapfrog_.synchronise(t);
  const double expected = before - (energy_.works.step_dependence - read_less);  // by a step of no length
  body_.share(fields_.u, fields_.v);
  bool holds = project(t);
  while (forced && !holds && more_modes()) holds = project(t);
  const bool entered = holds || forced;
  if (entered) {
    running_ = true;
    fields_.time = t;
    fields_.clear_impulses();
    materialise();
    // The energy depends on the phases in which velocities are brought to full steps: the residual modes, the
    // fastest of all, take the difference.
    const double given = energy_.mechanical() - expected, kept = std::max(0.0, rest_.energy - given);
    rest_.velocity *= rest_.energy > 0 ? std::sqrt(kept / rest_.energy) : 0.0;
    rest_.energy = kept;
    materialise();
  }
  energy_.works.algorithmic += before - energy_.mechanical();
  if (!entered) put_off();
  return entered;
}

VecX ModalMotion::displacement(const VecX& q, const VecX& factor) const {
  return basis_.gravity + basis_.correction * factor + basis_.modes.phi * q;
}

/// Writes the modal motion to the nodes.
void ModalMotion::materialise() {
  Basis& l = basis_;
  scatter(body_.dofs, displacement(q_, factor_), fields_.u);
  scatter(body_.dofs, l.modes.phi * rate_ + rest_.amplitude * rest_.velocity, fields_.v);
  fields_.h_last = 0;
  forces_.moved();
}

void ModalMotion::advance(double t, double duration) {
  Basis& l = basis_;
  const int modes = static_cast<int>(q_.size()), loads = static_cast<int>(factor_.size());
  // Pieces between the break points of all time tables, where every load is linear.
  std::vector<double> times{t, t + duration};
  for (const PatchLoad& load : body_.loads)
    for (const auto& point : load.history)
      if (point.first > t && point.first < t + duration) times.push_back(point.first);
  sort_unique(times);
  const auto energy_in = [&] {
    return 0.5 * (rate_.squaredNorm() + l.modes.omega.cwiseProduct(q_).squaredNorm()) +
           rest_.energy * rest_.amplitude * rest_.amplitude;
  };
  const MatX answer = l.pattern.transpose() * l.correction;  // of the modes left out to the loads
  const VecX first = factor_;
  double work = 0;
  const double before = energy_in();
  for (std::size_t piece = 0; piece + 1 < times.size(); ++piece) {
    const double h = times[piece + 1] - times[piece];
    VecX next(loads);
    for (int k = 0; k < loads; ++k) next[k] = body_.loads[k].factor(times[piece + 1]);
    if (loads_.track().begun()) watch(times[piece], h, next);
    const VecX p = l.participation * factor_, p1 = l.participation * next;
    for (int i = 0; i < modes; ++i) {
      const double start = p[i] * q_[i];
      const double s = (p1[i] - p[i]) / h;
      const double area = advance_mode(l.modes.omega[i], body_.alpha, p[i], s, h, q_[i], rate_[i]);
      work += p1[i] * q_[i] - start - s * area;
    }
    factor_ = next;
  }
  rest_.amplitude *= std::exp(-0.5 * body_.alpha * duration);
  // What the loads put into the kept modes and does not show in their energy was damped. Those left out take
  // c . (P^T r) dc.
  energy_.works.external_work += work + 0.5 * (factor_.dot(answer * factor_) - first.dot(answer * first));
  energy_.works.damping_work += work - (energy_in() - before);
  fields_.time = t + duration;
  fields_.reference_kinetic = std::max(fields_.reference_kinetic, 0.5 * rate_.squaredNorm());
  // In modal motion the energy about the static answer says directly whether anything moves.
  const VecX about = q_ - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * factor_);
  const double moving = 0.5 * (rate_.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm()) +
                        rest_.energy * rest_.amplitude * rest_.amplitude;
  fields_.judge(moving > 1e-8 * fields_.reference_kinetic, t);
  materialise();
}

/// A mode of amplitude A is off by (omega h)^2 / 12 of its phase omega t, and rings for a time
/// m = 1 / (zeta omega_1): its displacement is wrong by at most A (omega h)^2 omega m / (12 e), and never by
/// more than 2 A.
double ModalMotion::ringing_step(double t, double within) {
  forces_.evaluate(t);
  double longest = std::numeric_limits<double>::infinity();
  if (!fields_.has_moved(forces_.stored())) return longest;  // it never moved
  const Basis& l = basis();
  const int n = body_.dofs.size;
  VecX v(n), f(n), push = VecX::Zero(n);
  gather(body_.dofs, fields_.v, v);
  gather(body_.dofs, fields_.f_ext, push);
  gather(body_.dofs, fields_.f_int, f);
  push -= f;
  if (fields_.contact_step > 0)  // what rests on it is in balance with it and does not ring
    for (const int node : fields_.struck)
      for (int k = 0; k < 3; ++k)
        if (const int d = body_.dofs.number[static_cast<std::size_t>(node)][k]; d >= 0)
          push[d] +=
              fields_.contact_impulse[4 * static_cast<std::size_t>(node) + static_cast<std::size_t>(k)] /
              fields_.contact_step;
  const VecX& omega = l.modes.omega;
  const VecX rate = l.modes.phi.transpose() * l.mass.cwiseProduct(v),
             acceleration = l.modes.phi.transpose() * push;
  const double memory =
      std::min(longest_memory, body_.spec.damping_ratio > 0 ? 1 / body_.spec.damping_ratio : longest_memory) /
      omega[0];
  const double wrong = within > 0 ? within
                                  : ringing_error * l.modes.phi.col(0).cwiseAbs().maxCoeff() *
                                        std::sqrt(2 * fields_.reference_kinetic) / omega[0];
  for (int i = 0; i < omega.size(); ++i) {
    const double amplitude = std::hypot(rate[i] / omega[i], acceleration[i] / (omega[i] * omega[i])) *
                             l.modes.phi.col(i).cwiseAbs().maxCoeff();
    if (2 * amplitude <= wrong) continue;
    longest = std::min(longest, std::sqrt(12 * M_E * wrong / (amplitude * omega[i] * memory)) / omega[i]);
  }
  return longest;
}

void ModalMotion::save(std::vector<double>& state) const {
  state.insert(state.end(), {static_cast<double>(modes_), try_, last_excess_, running_ ? 1.0 : 0.0});
  if (!running_) return;
  for (const VecX* x : {&q_, &rate_, &factor_, &rest_.velocity})
    state.insert(state.end(), x->data(), x->data() + x->size());
  state.insert(state.end(), {rest_.energy, rest_.amplitude});
}

void ModalMotion::restore(StateReader& state) {
  leave();
  modes_ = static_cast<int>(state.next()), try_ = state.next(), last_excess_ = state.next();
  if (state.next() == 0) return;
  const Basis& l = basis();
  q_.resize(l.modes.omega.size());
  rate_.resize(l.modes.omega.size());
  rest_.velocity.resize(body_.dofs.size);
  for (VecX* x : {&q_, &rate_, &factor_, &rest_.velocity}) {
    const auto size = static_cast<std::size_t>(x->size());
    std::copy_n(state.take(size), size, x->data());
  }
  rest_.energy = state.next(), rest_.amplitude = state.next();
  running_ = true;
}

}  // namespace talus::fem

// Modal propagation of a structure that rings on alone: exact in time for what the modes hold.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "fem/integrators/structure_linear.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

void LinearDynamicsDeleter::operator()(LinearDynamics* p) const { delete p; }

namespace {
constexpr int most_modes = 384;
constexpr std::size_t most_values = 4'000'000;  // doubles in the modes
constexpr double truncated_energy = 1e-3;  // share of the energy in motion that modes left out may hold; or
constexpr double truncated_motion =
    5e-3;  // the largest displacement that they may bring, over the largest of one mode at the peak so far
constexpr double truncated_most =
    0.1;  // and even then no larger share of the energy, or of the peak's truncated_energy
}  // namespace

LinearDynamics& FemStructure::linear_dynamics() {
  if (linear_ && linear_->modes.omega.size() == std::min(modes_, body_.dofs.size)) return *linear_;
  linear_.reset(new LinearDynamics);
  LinearDynamics& l = *linear_;
  const int n = body_.dofs.size, loads = static_cast<int>(body_.loads.size());
  l.mass.resize(n);
  l.gravity.resize(n);
  VecX weight(n);
  for (std::size_t i = 0; i < body_.built_mass.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = body_.dofs.number[i][c]; d >= 0)
        l.mass[d] = body_.built_mass[i], weight[d] = body_.built_mass[i] * body_.gravity[c];
  body_.elastic->factor().solve(weight.data(), l.gravity.data());
  drop_condensed_levels();  // not both at a time: the search is the largest thing that a structure holds
  l.modes = lowest_modes(body_.elastic->factor(), {l.mass.data(), l.mass.data() + n}, modes_);
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
  l.factor.resize(loads);
  body_.report(fmt::format("structure {}: {} modes, {:.4g} to {:.4g} Hz", body_.spec.name,
                           l.modes.omega.size(), l.modes.omega[0] / (2 * M_PI),
                           l.modes.omega[l.modes.omega.size() - 1] / (2 * M_PI)));
  return l;
}

std::vector<double> FemStructure::frequencies(int count) {
  if (body_.supports.none) return {};
  std::vector<double> m(body_.dofs.size);
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = body_.dofs.number[i][c]; d >= 0) m[d] = body_.mass[i];
  const ModalBasis modes = lowest_modes(body_.elastic->factor(), m, count);
  return {modes.omega.data(), modes.omega.data() + modes.omega.size()};
}

int FemStructure::modes_at_most() const {
  return std::max(std::min(modes_, body_.dofs.size),
                  std::min({most_modes, body_.dofs.size,
                            static_cast<int>(most_values / static_cast<std::size_t>(body_.dofs.size))}));
}

bool FemStructure::rings_in_modes() const {
  const bool factorable = !body_.supports.none && !body_.divided() && body_.dofs.size > 0 &&
                          body_.dofs.size <= largest_factored_system;
  return !body_.finite && !body_.bars && !body_.bearings && factorable;
}

/// Modes that a run of `duration` [s] may come to ask for. By choice of the integrator all of them; by
/// default each search waits for as many steps alone as it would cost (advance_alone), of which short
/// intervals may make twice as many as fit into the time.
int FemStructure::modes_within(double duration) const {
  int modes = std::min(modes_, body_.dofs.size);
  if (!rings_in_modes() || (body_.spec.integrator != "auto" && body_.spec.integrator != "modal"))
    return modes;
  const int most = modes_at_most();
  if (body_.spec.integrator == "modal") return most;
  const double steps = 2 * duration / body_.critical_step;
  while (modes < most && steps >= steps_worth(std::min(2 * modes, most))) modes = std::min(2 * modes, most);
  return modes;
}

double FemStructure::memory_of_steps(double duration) {
  double bytes = body_.damage ? 6e6 + 4e3 * static_cast<double>(body_.mesh.hexes.size())
                              : 0.0;  // pieces; history of the law where it is needed
  if (body_.partition || body_.supports.none || body_.dofs.size == 0 ||
      body_.dofs.size > largest_factored_system)
    return bytes;
  const int modes = modes_within(duration);
  const double kept = sizeof(double) * static_cast<double>(body_.dofs.size) * modes;
  return bytes + kept + std::max(memory_of_search(body_.dofs.size, modes), memory_of_condensed_steps());
}

bool FemStructure::more_modes() {
  const int next = std::min(2 * modes_, modes_at_most());
  if (next <= modes_) return false;
  modes_ = next;
  return true;
}

/// The present state in the modes. Returns whether they hold it well enough to go on in them alone.
bool FemStructure::project(double t) {
  LinearDynamics& l = linear_dynamics();
  const int n = body_.dofs.size;
  for (int k = 0; k < l.factor.size(); ++k) l.factor[k] = body_.loads[k].factor(t);
  VecX u(n), v(n), stiff(n);
  gather(body_.dofs, fields_.u, u);
  gather(body_.dofs, fields_.v, v);
  // All modes see u - u_g - K^-1 P c as the motion about the static answer; those kept take P c into their
  // own equation.
  const VecX w = u - l.gravity - l.correction * l.factor;
  l.q = l.modes.phi.transpose() * l.mass.cwiseProduct(w);
  l.rate = l.modes.phi.transpose() * l.mass.cwiseProduct(v);
  const VecX left = w - l.modes.phi * l.q, left_rate = v - l.modes.phi * l.rate;
  body_.elastic->stiffness().multiply(left.data(), stiff.data());
  l.rest_energy = 0.5 * (left.dot(stiff) + left_rate.dot(l.mass.cwiseProduct(left_rate)));
  l.rest_amplitude = 1;
  const VecX& omega = l.modes.omega;
  const double highest = omega[omega.size() - 1];
  l.rest = left_rate + highest * left;
  const double whole = 0.5 * l.rest.dot(l.mass.cwiseProduct(l.rest));
  l.rest *= whole > 0 ? std::sqrt(l.rest_energy / whole) : 0.0;

  const VecX about = l.q - omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * l.factor);
  const double kept = 0.5 * (l.rate.squaredNorm() + omega.cwiseProduct(about).squaredNorm());
  l.excess = 1;
  if (l.rest_energy <= std::max(truncated_energy * kept, 1e-12 * std::max(fields_.reference_kinetic, 1e-12)))
    return true;
  double motion = 0;
  for (int i = 0; i < omega.size(); ++i)
    motion = std::max(motion,
                      std::hypot(about[i], l.rate[i] / omega[i]) * l.modes.phi.col(i).cwiseAbs().maxCoeff());
  const double at_peak = motion * std::sqrt(std::max(1.0, fields_.reference_kinetic / kept)),
               brought = left.cwiseAbs().maxCoeff() + left_rate.cwiseAbs().maxCoeff() / highest;
  l.excess = std::max(brought / (truncated_motion * at_peak),
                      l.rest_energy <= truncated_most * kept
                          ? 0.0
                          : std::sqrt(l.rest_energy / (truncated_energy * fields_.reference_kinetic)));
  return l.excess <= 1;
}

/// Modes did not hold the motion at the last try. When the next is due: with twice as many of them, or where
/// the last doubling did little and damping gets there, once what is left out has decayed.
void FemStructure::put_off_modes() {
  const double excess = linear_->excess,
               wait = body_.alpha > 0 ? 2 * std::log(excess) / (body_.alpha * body_.critical_step)
                                      : std::numeric_limits<double>::infinity();  // [steps]
  const bool flat = excess > 0.7 * modal_excess_;
  modal_excess_ = excess;
  if (std::isfinite(wait) && (flat || wait < steps_worth(2 * modes_))) {
    modal_try_ = fields_.steps_taken + std::max(wait, 100.0);
    return;
  }
  more_modes();
  modal_try_ = std::max(2 * fields_.steps_taken, steps_worth(modes_));
}

/// Starts modal motion from the present state, if modes enough for it can be had.
bool FemStructure::enter_modal(double t, bool forced) {
  const double before = energy_.mechanical(), read_less = energy_.works.step_dependence;
  leapfrog_.synchronise(t);
  const double expected = before - (energy_.works.step_dependence - read_less);  // by a step of no length
  body_.share(fields_.u, fields_.v);
  bool holds = project(t);
  while (forced && !holds && more_modes()) holds = project(t);
  const bool entered = holds || forced;
  if (entered) {
    linear_->running = true;
    fields_.time = t;
    for (int n : fields_.struck)
      std::fill_n(&fields_.contact_impulse[4 * static_cast<std::size_t>(n)], 3, 0.0);
    fields_.struck.clear();
    materialise();
    // The energy depends on the phases in which velocities are brought to full steps: the residual modes, the
    // fastest of all, take the difference.
    const double given = energy_.mechanical() - expected, kept = std::max(0.0, linear_->rest_energy - given);
    linear_->rest *= linear_->rest_energy > 0 ? std::sqrt(kept / linear_->rest_energy) : 0.0;
    linear_->rest_energy = kept;
    materialise();
  }
  energy_.works.algorithmic += before - energy_.mechanical();
  return entered;
}

/// Writes the modal motion to the nodes.
void FemStructure::materialise() {
  LinearDynamics& l = *linear_;
  scatter(body_.dofs, l.gravity + l.correction * l.factor + l.modes.phi * l.q, fields_.u);
  scatter(body_.dofs, l.modes.phi * l.rate + l.rest_amplitude * l.rest, fields_.v);
  fields_.h_last = 0;
  forces_.moved();
}

void FemStructure::modal_motion(double t, double duration) {
  LinearDynamics& l = *linear_;
  const int modes = static_cast<int>(l.q.size()), loads = static_cast<int>(l.factor.size());
  // Pieces between the break points of all time tables, where every load is linear.
  std::vector<double> times{t, t + duration};
  for (const PatchLoad& load : body_.loads)
    for (const auto& point : load.history)
      if (point.first > t && point.first < t + duration) times.push_back(point.first);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const auto energy_in = [&] {
    return 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(l.q).squaredNorm()) +
           l.rest_energy * l.rest_amplitude * l.rest_amplitude;
  };
  const MatX answer = l.pattern.transpose() * l.correction;  // of the modes left out to the loads
  const VecX first = l.factor;
  double work = 0;
  const double before = energy_in();
  for (std::size_t piece = 0; piece + 1 < times.size(); ++piece) {
    const double h = times[piece + 1] - times[piece];
    VecX next(loads);
    for (int k = 0; k < loads; ++k) next[k] = body_.loads[k].factor(times[piece + 1]);
    const VecX p = l.participation * l.factor, p1 = l.participation * next;
    for (int i = 0; i < modes; ++i) {
      const double start = p[i] * l.q[i];
      const double s = (p1[i] - p[i]) / h;
      const double area = advance_mode(l.modes.omega[i], body_.alpha, p[i], s, h, l.q[i], l.rate[i]);
      work += p1[i] * l.q[i] - start - s * area;
    }
    l.factor = next;
  }
  l.rest_amplitude *= std::exp(-0.5 * body_.alpha * duration);
  // What the loads put into the kept modes and does not show in their energy was damped. Those left out take
  // c . (P^T r) dc.
  energy_.works.external_work += work + 0.5 * (l.factor.dot(answer * l.factor) - first.dot(answer * first));
  energy_.works.damping_work += work - (energy_in() - before);
  fields_.time = t + duration;
  fields_.reference_kinetic = std::max(fields_.reference_kinetic, 0.5 * l.rate.squaredNorm());
  // In modal motion the energy about the static answer says directly whether anything moves.
  const VecX about = l.q - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * l.factor);
  const double moving = 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm()) +
                        l.rest_energy * l.rest_amplitude * l.rest_amplitude;
  if (moving > 1e-8 * fields_.reference_kinetic)
    fields_.still = false;
  else if (!fields_.still)
    fields_.still = true, fields_.still_since = t;
  materialise();
  // Forces are no by-product here: not more often than their mean moves.
  if (!loads_.track().begun()) return;
  if (!loads_.track().due(duration, load_window)) return loads_.track().pass_unheard(duration);
  forces_.evaluate(fields_.time);
  loads_.watch(fields_.time, duration);
}

void FemStructure::leave_modal() {
  if (linear_) linear_->running = false;
}

void FemStructure::save_linear(std::vector<double>& state) const {
  const bool running = linear_ && linear_->running;
  state.insert(state.end(), {static_cast<double>(modes_), modal_try_, modal_excess_, running ? 1.0 : 0.0});
  if (!running) return;
  for (const VecX* x : {&linear_->q, &linear_->rate, &linear_->factor, &linear_->rest})
    state.insert(state.end(), x->data(), x->data() + x->size());
  state.insert(state.end(), {linear_->rest_energy, linear_->rest_amplitude});
}

std::size_t FemStructure::restore_linear(std::span<const double> state) {
  leave_modal();
  std::size_t at = 0;
  const auto take = [&](double* x, Eigen::Index size) {
    const auto count = static_cast<std::size_t>(size);
    if (state.size() < at + count)
      throw NumericalFailure("structure " + body_.spec.name +
                             ": the saved state belongs to another structure");
    std::copy_n(state.data() + at, count, x);
    at += count;
  };
  double head[4];
  take(head, 4);
  modes_ = static_cast<int>(head[0]);
  modal_try_ = head[1];
  modal_excess_ = head[2];
  if (head[3] == 0) return at;
  LinearDynamics& l = linear_dynamics();
  l.q.resize(l.modes.omega.size());
  l.rate.resize(l.modes.omega.size());
  l.rest.resize(body_.dofs.size);
  for (VecX* x : {&l.q, &l.rate, &l.factor, &l.rest}) take(x->data(), x->size());
  take(&l.rest_energy, 1);
  take(&l.rest_amplitude, 1);
  l.running = true;
  return at;
}

}  // namespace talus::fem

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
  if (linear_ && linear_->modes.omega.size() == std::min(modes_, dofs_.size)) return *linear_;
  linear_.reset(new LinearDynamics);
  LinearDynamics& l = *linear_;
  const int n = dofs_.size, loads = static_cast<int>(loads_.size());
  l.mass.resize(n);
  l.gravity.resize(n);
  VecX weight(n);
  for (std::size_t i = 0; i < built_mass_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0)
        l.mass[d] = built_mass_[i], weight[d] = built_mass_[i] * gravity_[c];
  elastic_->factor().solve(weight.data(), l.gravity.data());
  drop_condensed_levels();  // not both at a time: the search is the largest thing that a structure holds
  l.modes = lowest_modes(elastic_->factor(), {l.mass.data(), l.mass.data() + n}, modes_);
  l.pattern = MatX::Zero(n, loads);
  MatX statics(n, loads);
  for (int k = 0; k < loads; ++k) {
    for (std::size_t i = 0; i < loads_[k].node.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[loads_[k].node[i]][c]; d >= 0)
          l.pattern(d, k) += loads_[k].force[i][c];
    elastic_->factor().solve(l.pattern.col(k).data(), statics.col(k).data());
  }
  l.participation = l.modes.phi.transpose() * l.pattern;
  l.correction =
      statics - l.modes.phi * l.modes.omega.cwiseAbs2().cwiseInverse().asDiagonal() * l.participation;
  l.factor.resize(loads);
  report_(fmt::format("structure {}: {} modes, {:.4g} to {:.4g} Hz", spec_.name, l.modes.omega.size(),
                      l.modes.omega[0] / (2 * M_PI), l.modes.omega[l.modes.omega.size() - 1] / (2 * M_PI)));
  return l;
}

std::vector<double> FemStructure::frequencies(int count) {
  if (supports_.none) return {};
  std::vector<double> m(dofs_.size);
  for (std::size_t i = 0; i < mass_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) m[d] = mass_[i];
  const ModalBasis modes = lowest_modes(elastic_->factor(), m, count);
  return {modes.omega.data(), modes.omega.data() + modes.omega.size()};
}

int FemStructure::modes_at_most() const {
  return std::max(std::min(modes_, dofs_.size),
                  std::min({most_modes, dofs_.size,
                            static_cast<int>(most_values / static_cast<std::size_t>(dofs_.size))}));
}

bool FemStructure::rings_in_modes() const {
  const bool factorable =
      !supports_.none && !divided() && dofs_.size > 0 && dofs_.size <= largest_factored_system;
  return !finite_ && !bars_ && !bearings_ && factorable;
}

/// Modes that a run of `duration` [s] may come to ask for. By choice of the integrator all of them; by
/// default each search waits for as many steps alone as it would cost (advance_alone), of which short
/// intervals may make twice as many as fit into the time.
int FemStructure::modes_within(double duration) const {
  int modes = std::min(modes_, dofs_.size);
  if (!rings_in_modes() || (spec_.integrator != "auto" && spec_.integrator != "modal")) return modes;
  const int most = modes_at_most();
  if (spec_.integrator == "modal") return most;
  const double steps = 2 * duration / critical_step_;
  while (modes < most && steps >= steps_worth(std::min(2 * modes, most))) modes = std::min(2 * modes, most);
  return modes;
}

double FemStructure::memory_of_steps(double duration) {
  double bytes = damage_ ? 6e6 + 4e3 * static_cast<double>(mesh_.hexes.size())
                         : 0.0;  // pieces; history of the law where it is needed
  if (partition_ || supports_.none || dofs_.size == 0 || dofs_.size > largest_factored_system) return bytes;
  const int modes = modes_within(duration);
  const double kept = sizeof(double) * static_cast<double>(dofs_.size) * modes;
  return bytes + kept + std::max(memory_of_search(dofs_.size, modes), memory_of_condensed_steps());
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
  const int n = dofs_.size;
  for (int k = 0; k < l.factor.size(); ++k) l.factor[k] = loads_[k].factor(t);
  VecX u(n), v(n), stiff(n);
  gather(dofs_, u_, u);
  gather(dofs_, v_, v);
  // All modes see u - u_g - K^-1 P c as the motion about the static answer; those kept take P c into their
  // own equation.
  const VecX w = u - l.gravity - l.correction * l.factor;
  l.q = l.modes.phi.transpose() * l.mass.cwiseProduct(w);
  l.rate = l.modes.phi.transpose() * l.mass.cwiseProduct(v);
  const VecX left = w - l.modes.phi * l.q, left_rate = v - l.modes.phi * l.rate;
  elastic_->stiffness().multiply(left.data(), stiff.data());
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
  if (l.rest_energy <= std::max(truncated_energy * kept, 1e-12 * std::max(reference_kinetic_, 1e-12)))
    return true;
  double motion = 0;
  for (int i = 0; i < omega.size(); ++i)
    motion = std::max(motion,
                      std::hypot(about[i], l.rate[i] / omega[i]) * l.modes.phi.col(i).cwiseAbs().maxCoeff());
  const double at_peak = motion * std::sqrt(std::max(1.0, reference_kinetic_ / kept)),
               brought = left.cwiseAbs().maxCoeff() + left_rate.cwiseAbs().maxCoeff() / highest;
  l.excess = std::max(brought / (truncated_motion * at_peak),
                      l.rest_energy <= truncated_most * kept
                          ? 0.0
                          : std::sqrt(l.rest_energy / (truncated_energy * reference_kinetic_)));
  return l.excess <= 1;
}

/// Modes did not hold the motion at the last try. When the next is due: with twice as many of them, or where
/// the last doubling did little and damping gets there, once what is left out has decayed.
void FemStructure::put_off_modes() {
  const double excess = linear_->excess, wait = alpha_ > 0
                                                    ? 2 * std::log(excess) / (alpha_ * critical_step_)
                                                    : std::numeric_limits<double>::infinity();  // [steps]
  const bool flat = excess > 0.7 * modal_excess_;
  modal_excess_ = excess;
  if (std::isfinite(wait) && (flat || wait < steps_worth(2 * modes_))) {
    modal_try_ = steps_taken_ + std::max(wait, 100.0);
    return;
  }
  more_modes();
  modal_try_ = std::max(2 * steps_taken_, steps_worth(modes_));
}

/// Starts modal motion from the present state, if modes enough for it can be had.
bool FemStructure::enter_modal(double t, bool forced) {
  const double before = mechanical_energy(), read_less = books_.step_dependence;
  synchronise(t);
  const double expected = before - (books_.step_dependence - read_less);  // by a step of no length
  share_motion();
  bool holds = project(t);
  while (forced && !holds && more_modes()) holds = project(t);
  const bool entered = holds || forced;
  if (entered) {
    linear_->running = true;
    time_ = t;
    for (int n : struck_) std::fill_n(&contact_impulse_[4 * static_cast<std::size_t>(n)], 3, 0.0);
    struck_.clear();
    materialise();
    // The energy depends on the phases in which velocities are brought to full steps: the residual modes, the
    // fastest of all, take the difference.
    const double given = mechanical_energy() - expected, kept = std::max(0.0, linear_->rest_energy - given);
    linear_->rest *= linear_->rest_energy > 0 ? std::sqrt(kept / linear_->rest_energy) : 0.0;
    linear_->rest_energy = kept;
    materialise();
  }
  books_.algorithmic += before - mechanical_energy();
  return entered;
}

/// Writes the modal motion to the nodes.
void FemStructure::materialise() {
  LinearDynamics& l = *linear_;
  scatter(dofs_, l.gravity + l.correction * l.factor + l.modes.phi * l.q, u_);
  scatter(dofs_, l.modes.phi * l.rate + l.rest_amplitude * l.rest, v_);
  motion_changed();
  h_last_ = 0;
  moved();
}

void FemStructure::modal_motion(double t, double duration) {
  LinearDynamics& l = *linear_;
  const int modes = static_cast<int>(l.q.size()), loads = static_cast<int>(l.factor.size());
  // Pieces between the break points of all time tables, where every load is linear.
  std::vector<double> times{t, t + duration};
  for (const PatchLoad& load : loads_)
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
    for (int k = 0; k < loads; ++k) next[k] = loads_[k].factor(times[piece + 1]);
    const VecX p = l.participation * l.factor, p1 = l.participation * next;
    for (int i = 0; i < modes; ++i) {
      const double start = p[i] * l.q[i];
      const double s = (p1[i] - p[i]) / h;
      const double area = advance_mode(l.modes.omega[i], alpha_, p[i], s, h, l.q[i], l.rate[i]);
      work += p1[i] * l.q[i] - start - s * area;
    }
    l.factor = next;
  }
  l.rest_amplitude *= std::exp(-0.5 * alpha_ * duration);
  // What the loads put into the kept modes and does not show in their energy was damped. Those left out take
  // c . (P^T r) dc.
  books_.external_work += work + 0.5 * (l.factor.dot(answer * l.factor) - first.dot(answer * first));
  books_.damping_work += work - (energy_in() - before);
  time_ = t + duration;
  reference_kinetic_ = std::max(reference_kinetic_, 0.5 * l.rate.squaredNorm());
  // In modal motion the energy about the static answer says directly whether anything moves.
  const VecX about = l.q - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * l.factor);
  const double moving = 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm()) +
                        l.rest_energy * l.rest_amplitude * l.rest_amplitude;
  if (moving > 1e-8 * reference_kinetic_)
    still_ = false;
  else if (!still_)
    still_ = true, still_since_ = t;
  materialise();
  // Forces are no by-product here: not more often than their mean moves.
  if (!load_track_.begun()) return;
  if (!load_track_.due(duration, load_window)) return load_track_.pass_unheard(duration);
  forces(time_);
  watch_loads(time_, duration);
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
      throw NumericalFailure("structure " + spec_.name + ": the saved state belongs to another structure");
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
  l.rest.resize(dofs_.size);
  for (VecX* x : {&l.q, &l.rate, &l.factor, &l.rest}) take(x->data(), x->size());
  take(&l.rest_energy, 1);
  take(&l.rest_amplitude, 1);
  l.running = true;
  return at;
}

}  // namespace talus::fem

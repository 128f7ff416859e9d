// Long steps of a structure that stays elastic: modal propagation and generalized-alpha.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "core/error.hpp"
#include "fem/modal.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

struct LinearDynamics {
  ModalBasis modes;
  VecX mass;                          // per free degree of freedom
  VecX gravity;                       // u_g
  MatX pattern, correction, static_;  // P_l, r_l, K^-1 P_l
  MatX participation;                 // m x l
  // motion, valid while `running`
  bool running = false;
  VecX q, rate, factor;               // factor: c_l at the present time
  // generalized-alpha; its acceleration is part of the state while it runs
  bool stepping = false;
  VecX acceleration;
  std::unique_ptr<CholeskyFactor> effective;
  double effective_step = 0;
};

void LinearDynamicsDeleter::operator()(LinearDynamics* p) const { delete p; }

namespace {
constexpr int wanted_modes = 24;
constexpr double truncated_share = 1e-3;  // of the energy in motion; above it the modes left out matter
}  // namespace

LinearDynamics& FemStructure::linear_dynamics() {
  if (linear_) return *linear_;
  linear_.reset(new LinearDynamics);
  LinearDynamics& l = *linear_;
  const int n = dofs_.size, loads = static_cast<int>(loads_.size());
  l.mass.resize(n);
  l.gravity.resize(n);
  VecX weight(n);
  for (std::size_t i = 0; i < mass_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) l.mass[d] = mass_[i], weight[d] = mass_[i] * gravity_[c];
  factor().solve(weight.data(), l.gravity.data());
  l.modes = lowest_modes(factor(), {l.mass.data(), l.mass.data() + n}, wanted_modes);
  l.pattern = MatX::Zero(n, loads);
  l.static_.resize(n, loads);
  for (int k = 0; k < loads; ++k) {
    for (std::size_t i = 0; i < loads_[k].node.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[loads_[k].node[i]][c]; d >= 0) l.pattern(d, k) += loads_[k].force[i][c];
    factor().solve(l.pattern.col(k).data(), l.static_.col(k).data());
  }
  l.participation = l.modes.phi.transpose() * l.pattern;
  l.correction = l.static_ - l.modes.phi * l.modes.omega.cwiseAbs2().cwiseInverse().asDiagonal() * l.participation;
  l.factor.resize(loads);
  report_(fmt::format("structure {}: {} modes, {:.4g} to {:.4g} Hz", spec_.name, l.modes.omega.size(), l.modes.omega[0] / (2 * M_PI),
                      l.modes.omega[l.modes.omega.size() - 1] / (2 * M_PI)));
  return l;
}

std::vector<double> FemStructure::frequencies(int count) {
  if (supports_.nodes.empty()) return {};
  std::vector<double> m(dofs_.size);
  for (std::size_t i = 0; i < mass_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) m[d] = mass_[i];
  const ModalBasis modes = lowest_modes(factor(), m, count);
  return {modes.omega.data(), modes.omega.data() + modes.omega.size()};
}

/// Brings velocities from the last half step to the time of the displacements.
void FemStructure::synchronise(double t) {
  if (h_last_ == 0) return;
  forces(t);
  for (const auto& [first, last] : own_)
    for (int i = 4 * first; i < 4 * last; ++i) v_[i] += 0.5 * h_last_ * (inverse_mass_[i] * (f_ext_[i] - f_int_[i]) - alpha_ * (inverse_mass_[i] > 0 ? v_[i] : 0.0));
  h_last_ = 0;
  motion_changed();
  surface_stale_ = true;
}

/// Starts modal motion from the present state if the modes hold its energy.
bool FemStructure::enter_modal(double t, bool forced) {
  LinearDynamics& l = linear_dynamics();
  const int n = dofs_.size;
  const double before = mechanical_energy();
  synchronise(t);
  share_motion();
  for (int k = 0; k < l.factor.size(); ++k) l.factor[k] = loads_[k].factor(t);
  VecX u(n), v(n);
  gather(dofs_, u_, u);
  gather(dofs_, v_, v);
  // All modes see u - u_g - K^-1 P c as the motion about the static answer; those kept take P c into their own equation.
  const VecX w = u - l.gravity - l.correction * l.factor;
  const VecX q = l.modes.phi.transpose() * l.mass.cwiseProduct(w), rate = l.modes.phi.transpose() * l.mass.cwiseProduct(v);
  const VecX left = w - l.modes.phi * q, left_rate = v - l.modes.phi * rate;
  VecX stiff(n);
  stiffness_.multiply(left.data(), stiff.data());
  const double truncated = 0.5 * (left.dot(stiff) + left_rate.dot(l.mass.cwiseProduct(left_rate)));
  const VecX about = q - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * l.factor);
  const double kept = 0.5 * (rate.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm());
  if (!forced && truncated > truncated_share * kept && truncated > 1e-12 * std::max(reference_kinetic_, 1e-12)) {
    books_.damping_work += before - mechanical_energy();
    return false;
  }
  l.q = q;
  l.rate = rate;
  l.running = true;
  l.stepping = false;
  time_ = t;
  materialise();
  books_.damping_work += before - mechanical_energy();
  return true;
}

/// Writes the modal motion to the nodes.
void FemStructure::materialise() {
  LinearDynamics& l = *linear_;
  scatter(dofs_, l.gravity + l.correction * l.factor + l.modes.phi * l.q, u_);
  scatter(dofs_, l.modes.phi * l.rate, v_);
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
  double work = 0;
  const double before = 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(l.q).squaredNorm());
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
    // Loads on the static answer of the modes left out: integral of c . (P^T r) dc.
    const MatX g = l.pattern.transpose() * l.correction;
    work += 0.5 * (next.dot(g * next) - l.factor.dot(g * l.factor));
    l.factor = next;
  }
  const double after = 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(l.q).squaredNorm());
  // What the loads put into the kept modes and does not show in their energy was damped.
  const double correction_work = [&] {
    const MatX g = l.pattern.transpose() * l.correction;
    VecX first(loads);
    for (int k = 0; k < loads; ++k) first[k] = loads_[k].factor(t);
    return 0.5 * (l.factor.dot(g * l.factor) - first.dot(g * first));
  }();
  books_.external_work += work;
  books_.damping_work += work - correction_work - (after - before);
  time_ = t + duration;
  reference_kinetic_ = std::max(reference_kinetic_, 0.5 * l.rate.squaredNorm());
  // In modal motion the energy about the static answer says directly whether anything moves.
  const VecX about = l.q - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * l.factor);
  const double moving = 0.5 * (l.rate.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm());
  if (moving > 1e-8 * reference_kinetic_) still_ = false;
  else if (!still_) still_ = true, still_since_ = t;
  materialise();
}

void FemStructure::implicit_steps(double t, double duration) {
  LinearDynamics& l = linear_dynamics();
  const int n = dofs_.size;
  const double before = mechanical_energy();
  synchronise(t);
  share_motion();
  const GeneralizedAlpha g(0.8);
  const double largest = 2 * M_PI / l.modes.omega[0] / 100;
  const long steps = std::max(1L, static_cast<long>(std::ceil(duration / largest * (1 - 1e-12))));
  // Ten digits: intervals that differ by rounding share one factor, and a restart finds the same step.
  const double h = std::strtod(fmt::format("{:.9e}", duration / static_cast<double>(steps)).c_str(), nullptr);
  if (!l.effective || l.effective_step != h) {
    const double shift = ((1 - g.alpha_m) + (1 - g.alpha_f) * g.gamma * h * alpha_) / ((1 - g.alpha_f) * g.beta * h * h);
    l.effective = std::make_unique<CholeskyFactor>(stiffness_, shift, std::vector<double>(l.mass.data(), l.mass.data() + n));
    l.effective_step = h;
  }
  VecX u(n), v(n), a(n), external(n), internal(n), next_a(n), rhs(n), f(n);
  const auto loading = [&](double time) {
    external_force(time);
    gather(dofs_, f_ext_, f);
  };
  gather(dofs_, u_, u);
  gather(dofs_, v_, v);
  stiffness_.multiply(u.data(), internal.data());
  loading(t);
  external = f;
  a = l.stepping ? l.acceleration : VecX((external - internal).cwiseQuotient(l.mass) - alpha_ * v);
  VecX weight(n);
  for (std::size_t i = 0; i < mass_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) weight[d] = mass_[i] * gravity_[c];
  double work = 0;
  for (long k = 1; k <= steps; ++k) {
    loading(t + duration * (static_cast<double>(k) / static_cast<double>(steps)));
    const VecX u_free = u + h * v + h * h * (0.5 - g.beta) * a, v_free = v + h * (1 - g.gamma) * a;
    const VecX at = (1 - g.alpha_f) * u_free + g.alpha_f * u;
    stiffness_.multiply(at.data(), internal.data());
    rhs = (1 - g.alpha_f) * f + g.alpha_f * external - internal -
          l.mass.cwiseProduct(g.alpha_m * a + alpha_ * ((1 - g.alpha_f) * v_free + g.alpha_f * v));
    rhs /= (1 - g.alpha_f) * g.beta * h * h;
    l.effective->solve(rhs.data(), next_a.data());
    const VecX u_next = u_free + h * h * g.beta * next_a;
    v = v_free + h * g.gamma * next_a;
    work += (u_next - u).dot(0.5 * (f + external) - weight);
    u = u_next;
    a = next_a;
    external = f;
  }
  scatter(dofs_, u, u_);
  scatter(dofs_, v, v_);
  l.acceleration = a;
  l.running = false;
  l.stepping = true;
  time_ = t + duration;
  h_last_ = 0;
  moved();
  books_.external_work += work;
  books_.damping_work += before + work - mechanical_energy();
  const double kinetic = 0.5 * v.dot(l.mass.cwiseProduct(v));
  reference_kinetic_ = std::max(reference_kinetic_, kinetic);
  if (kinetic > 1e-8 * reference_kinetic_) still_ = false;
  else if (!still_) still_ = true, still_since_ = t;
}

double FemStructure::mechanical_energy() {
  const StructureEnergy e = energy();
  return e.kinetic + e.elastic + e.gravity_potential;
}

void FemStructure::leave_modal() {
  if (linear_) linear_->running = linear_->stepping = false;
}

void FemStructure::save_linear(std::vector<double>& state) const {
  const bool running = linear_ && linear_->running, stepping = linear_ && linear_->stepping;
  state.push_back(running ? 1.0 : stepping ? 2.0 : 0.0);
  if (running)
    for (const VecX* x : {&linear_->q, &linear_->rate, &linear_->factor}) state.insert(state.end(), x->data(), x->data() + x->size());
  if (stepping) state.insert(state.end(), linear_->acceleration.data(), linear_->acceleration.data() + linear_->acceleration.size());
}

std::size_t FemStructure::restore_linear(std::span<const double> state) {
  leave_modal();
  const auto need = [&](std::size_t count) {
    if (state.size() < count) throw NumericalFailure("structure " + spec_.name + ": the saved state belongs to another structure");
  };
  need(1);
  if (state[0] == 0) return 1;
  LinearDynamics& l = linear_dynamics();
  std::size_t at = 1;
  const auto take = [&](VecX& x, Eigen::Index size) {
    need(at + static_cast<std::size_t>(size));
    x = Eigen::Map<const VecX>(state.data() + at, size);
    at += static_cast<std::size_t>(size);
  };
  if (state[0] == 1) {
    take(l.q, l.modes.omega.size());
    take(l.rate, l.modes.omega.size());
    take(l.factor, static_cast<Eigen::Index>(loads_.size()));
    l.running = true;
  } else {
    take(l.acceleration, dofs_.size);
    l.stepping = true;
  }
  return at;
}

std::string FemStructure::advance_alone(double t, double duration) {
  if (!(duration > 0)) return "none";
  if (undisturbed(t, duration)) {
    time_ = t + duration;
    return "asleep";
  }
  const std::string& how = spec_.integrator;
  const bool linear = !finite_ && !bars_ && !bearings_ && !supports_.nodes.empty() && dofs_.size <= largest_factored_system;
  const double explicit_count = std::ceil(duration / critical_step_);
  if (!linear && ring_on(t, duration)) return "condensed";
  if (how == "explicit" || !linear || (how == "auto" && explicit_count < 8)) {
    explicit_steps(t, duration);
    return "explicit";
  }
  if (linear_ && linear_->running && how != "implicit") {
    modal_motion(t, duration);
    return "modal";
  }
  if (how == "auto" && !linear_) {
    // The modes cost about as much as some hundred explicit steps: not before it is clear that the structure rings on alone.
    lone_steps_ += explicit_count;
    if (reference_kinetic_ > 0 && lone_steps_ < 100) {
      explicit_steps(t, duration);
      return "explicit";
    }
  }
  if (how != "implicit" && enter_modal(t, how == "modal")) {
    modal_motion(t, duration);
    return "modal";
  }
  implicit_steps(t, duration);
  return "implicit";
}

}  // namespace talus::fem

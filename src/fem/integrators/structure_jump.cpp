// Leapfrogs whose step begins, or jumps.
//
// A mode swings with u = A cos(phi), w = -A omega sqrt(1 - x) sin(phi) at full steps, x = (omega h)^2 / 4; a
// step that changes slowly keeps A^2 sqrt(1 - x). Where it jumps from h0 to h1, u and w go on: A^2 becomes
// A^2 (cos^2 + r^2 sin^2), r^2 = (1 - x0) / (1 - x1), in the mean (1 + r^2) / 2, which is more than the r of
// a slow change, both ways. Modes near the stable limit gain a third whenever contacts halve the step and it
// grows back, and a slab on which a block hops rang up a hundred thousandfold. With c w in place of w, c^2 =
// (2 r - 1) / r^2, they keep what a slow change leaves them.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr double slow_change = 0.025;  // of a step from the last one
}

/// What a leapfrog begins with after other motion: v by (1 - x/2 - x^2/2), x = h^2/4 M^-1 K, which is at most
/// the sqrt(1 - x) by which a mode's amplitude goes on as it was, and exact to x. From v itself modes near
/// the stable limit went on with up to five times their energy, of whatever phase, and a structure that
/// changed between both kinds of steps rang up.
void FemStructure::begin_leapfrog(double h) {
  const bool cracked =
      damage_ && !damage_->cells().empty();  // softer than K, and what opens and closes there is slow
  if (cracked || partition_ || dofs_.size > largest_factored_system) return;
  const SymmetricMatrix& k = elastic_->stiffness();
  VecX v(dofs_.size), force(dofs_.size), x(dofs_.size), mass(dofs_.size);
  gather(dofs_, v_, v);
  for (std::size_t node = 0; node < mass_.size(); ++node)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[node][c]; d >= 0)
        mass[d] = 0.25 * h * h * inverse_mass_[4 * node + static_cast<std::size_t>(c)];
  k.multiply(v.data(), force.data());
  x = mass.cwiseProduct(force);
  k.multiply(x.data(), force.data());
  const VecX slower = v - 0.5 * (x + mass.cwiseProduct(force));
  double less = 0;  // kinetic energy, which the leapfrog's reading lacks for the length of its step
  for (std::size_t node = 0; node < mass_.size(); ++node)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[node][c]; d >= 0)
        less += 0.5 * mass_[node] * (v[d] * v[d] - slower[d] * slower[d]);
  books_.step_dependence += less;
  scatter(dofs_, slower, v_);
}

/// What a step that jumps to h takes from the velocities in it: 1 - c = a x^2 + b x^5 by the x of the longer
/// step. a is that of slow modes, b is right at the stable limit; between, more goes than must.
void FemStructure::find_jump(double h) {
  jump_.clear();
  if (h_last_ == 0 || std::abs(h - h_last_) <= slow_change * h_last_) return;
  if (largest(damage_ && !damage_->cells().empty() ? 1 : 0) > 0)
    return;  // anywhere, also where another rank computes
  const double longer = std::max(h, h_last_), rho_sq = std::pow(std::min(h, h_last_) / longer, 2);
  const double most = std::min(
      0.95, std::pow(longer / critical_step_ * spec_.critical_step_fraction, 2));  // x of the fastest mode
  const double r = std::pow((1 - most) / (1 - rho_sq * most), h < h_last_ ? 0.5 : -0.5),
               c = std::sqrt(std::max(0.0, 2 * r - 1)) / r;
  const double a = std::pow(1 - rho_sq, 2) / 8,
               b = std::max(0.0, (1 - c - a * most * most) / std::pow(most, 5));
  AlignedVector w(v_), force(v_.size(), 0.0);
  for (std::size_t i = 0; i < v_.size(); ++i)
    w[i] = inverse_mass_[i] == 0 ? 0.0 : v_[i] + 0.5 * h_last_ * inverse_mass_[i] * (f_ext_[i] - f_int_[i]);
  if (partition_) partition_->exchange(w);
  jump_.assign(v_.size(), 0.0);
  for (int power = 1; power <= 5; ++power) {
    std::fill(force.begin(), force.end(), 0.0);
    operator_->add_internal_force(w.data(), force.data(), false, false);
    for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.25 * longer * longer * inverse_mass_[i] * force[i];
    if (partition_) partition_->exchange(w);
    const double weight = power == 2 ? a : power == 5 ? b : 0.0;
    if (weight > 0)
      for (std::size_t i = 0; i < w.size(); ++i) jump_[i] += weight * w[i];
  }
  if (supports_.none) keep_momenta();
}

/// Of a structure that turned, K as built gives its rotation a little force: what the jump takes has no
/// momenta.
void FemStructure::keep_momenta() {
  const auto node = [](const AlignedVector& x, std::size_t i) {
    return Vec3(x[4 * i], x[4 * i + 1], x[4 * i + 2]);
  };
  const auto at = [&](std::size_t i) { return Vec3(mesh_.nodes[i] + node(u_, i)); };
  const auto each_own = [&](auto&& use) {
    for (const auto& [first, last] : own_)
      for (int i = first; i < last; ++i) use(static_cast<std::size_t>(i));
  };
  std::array<double, 7> first{};  // mass, its first moments, linear momentum
  each_own([&](std::size_t i) {
    const Vec3 x = mass_[i] * at(i), p = mass_[i] * node(jump_, i);
    first[0] += mass_[i];
    for (std::size_t k = 0; k < 3; ++k)
      first[1 + k] += x[static_cast<Eigen::Index>(k)], first[4 + k] += p[static_cast<Eigen::Index>(k)];
  });
  sum(first);
  const Vec3 centre = Vec3(first[1], first[2], first[3]) / first[0],
             linear = Vec3(first[4], first[5], first[6]) / first[0];
  std::array<double, 12> second{};  // angular momentum, inertia
  each_own([&](std::size_t i) {
    const Vec3 x = at(i) - centre;
    Eigen::Map<Vec3>(second.data()) += mass_[i] * x.cross(node(jump_, i));
    Eigen::Map<Mat3>(second.data() + 3) +=
        mass_[i] * (x.squaredNorm() * Mat3::Identity() - x * x.transpose());
  });
  sum(second);
  const Vec3 spin =
      Mat3(Eigen::Map<Mat3>(second.data() + 3)).ldlt().solve(Vec3(Eigen::Map<Vec3>(second.data())));
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    if (!(mass_[i] > 0)) continue;
    const Vec3 rigid = linear + spin.cross(at(i) - centre);
    for (int k = 0; k < 3; ++k) jump_[4 * i + static_cast<std::size_t>(k)] -= rigid[k];
  }
}

}  // namespace talus::fem

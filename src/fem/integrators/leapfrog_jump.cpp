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

#include "fem/integrators/leapfrog.hpp"

namespace talus::fem {

namespace {
constexpr double slow_change = 0.025;  // of a step from the last one
}

/// What a leapfrog begins with after other motion: v by (1 - x/2 - x^2/2), x = h^2/4 M^-1 K, which is at most
/// the sqrt(1 - x) by which a mode's amplitude goes on as it was, and exact to x. From v itself modes near
/// the stable limit went on with up to five times their energy, of whatever phase, and a structure that
/// changed between both kinds of steps rang up.
void Leapfrog::begin(double h) {
  const bool cracked =
      body_.damage &&
      !body_.damage->cells().empty();  // softer than K, and what opens and closes there is slow
  if (cracked || body_.partition || body_.dofs.size > largest_factored_system) return;
  const SymmetricMatrix& k = body_.elastic->stiffness();
  VecX v(body_.dofs.size), force(body_.dofs.size), x(body_.dofs.size), lightness(body_.dofs.size);
  gather(body_.dofs, fields_.v, v);
  gather(body_.dofs, body_.inverse_mass, lightness);
  lightness *= 0.25 * h * h;
  k.multiply(v.data(), force.data());
  x = lightness.cwiseProduct(force);
  k.multiply(x.data(), force.data());
  const VecX slower = v - 0.5 * (x + lightness.cwiseProduct(force));
  // Kinetic energy that the leapfrog's reading lacks for the length of its step.
  energy_.works.step_dependence +=
      0.5 * of_dofs(body_.dofs, body_.mass).dot(VecX(v.cwiseAbs2() - slower.cwiseAbs2()));
  scatter(body_.dofs, slower, fields_.v);
}

/// What a step that jumps to h takes from the velocities in it: 1 - c = a x^2 + b x^5 by the x of the longer
/// step. a is that of slow modes, b is right at the stable limit; between, more goes than must.
void Leapfrog::find_jump(double h) {
  jump_.clear();
  if (fields_.h_last == 0 || std::abs(h - fields_.h_last) <= slow_change * fields_.h_last) return;
  if (body_.largest(body_.damage && !body_.damage->cells().empty() ? 1 : 0) > 0)
    return;  // anywhere, also where another rank computes
  const double longer = std::max(h, fields_.h_last),
               rho_sq = std::pow(std::min(h, fields_.h_last) / longer, 2);
  const double most =
      std::min(0.95, std::pow(longer / body_.critical_step * body_.spec.critical_step_fraction,
                              2));  // x of the fastest mode
  const double r = std::pow((1 - most) / (1 - rho_sq * most), h < fields_.h_last ? 0.5 : -0.5),
               c = std::sqrt(std::max(0.0, 2 * r - 1)) / r;
  const double a = std::pow(1 - rho_sq, 2) / 8,
               b = std::max(0.0, (1 - c - a * most * most) / std::pow(most, 5));
  AlignedVector w(fields_.v), force(fields_.v.size(), 0.0);
  for (std::size_t i = 0; i < fields_.v.size(); ++i)
    w[i] = body_.inverse_mass[i] == 0 ? 0.0
                                      : fields_.v[i] + 0.5 * fields_.h_last * body_.inverse_mass[i] *
                                                           (fields_.f_ext[i] - fields_.f_int[i]);
  if (body_.partition) body_.partition->exchange(w);
  jump_.assign(fields_.v.size(), 0.0);
  for (int power = 1; power <= 5; ++power) {
    std::fill(force.begin(), force.end(), 0.0);
    body_.elements->add_internal_force(w.data(), force.data(), false, false);
    for (std::size_t i = 0; i < w.size(); ++i)
      w[i] = 0.25 * longer * longer * body_.inverse_mass[i] * force[i];
    if (body_.partition) body_.partition->exchange(w);
    const double weight = power == 2 ? a : power == 5 ? b : 0.0;
    if (weight > 0)
      for (std::size_t i = 0; i < w.size(); ++i) jump_[i] += weight * w[i];
  }
  if (body_.supports.none) keep_momenta();
}

/// Of a structure that turned, K as built gives its rotation a little force: what the jump takes has no
/// momenta.
void Leapfrog::keep_momenta() {
  const auto node = [](const AlignedVector& x, std::size_t i) {
    return Vec3(x[4 * i], x[4 * i + 1], x[4 * i + 2]);
  };
  const auto at = [&](std::size_t i) { return Vec3(body_.mesh.nodes[i] + node(fields_.u, i)); };
  const auto each_own = [&](auto&& use) {
    for (const auto& [first, last] : body_.own)
      for (int i = first; i < last; ++i) use(static_cast<std::size_t>(i));
  };
  std::array<double, 7> first{};  // mass, its first moments, linear momentum
  each_own([&](std::size_t i) {
    const Vec3 x = body_.mass[i] * at(i), p = body_.mass[i] * node(jump_, i);
    first[0] += body_.mass[i];
    for (std::size_t k = 0; k < 3; ++k)
      first[1 + k] += x[static_cast<Eigen::Index>(k)], first[4 + k] += p[static_cast<Eigen::Index>(k)];
  });
  body_.sum(first);
  const Vec3 centre = Vec3(first[1], first[2], first[3]) / first[0],
             linear = Vec3(first[4], first[5], first[6]) / first[0];
  std::array<double, 12> second{};  // angular momentum, inertia
  each_own([&](std::size_t i) {
    const Vec3 x = at(i) - centre;
    Eigen::Map<Vec3>(second.data()) += body_.mass[i] * x.cross(node(jump_, i));
    Eigen::Map<Mat3>(second.data() + 3) +=
        body_.mass[i] * (x.squaredNorm() * Mat3::Identity() - x * x.transpose());
  });
  body_.sum(second);
  const Vec3 spin =
      Mat3(Eigen::Map<Mat3>(second.data() + 3)).ldlt().solve(Vec3(Eigen::Map<Vec3>(second.data())));
  for (std::size_t i = 0; i < body_.mass.size(); ++i) {
    if (!(body_.mass[i] > 0)) continue;
    const Vec3 rigid = linear + spin.cross(at(i) - centre);
    for (int k = 0; k < 3; ++k) jump_[4 * i + static_cast<std::size_t>(k)] -= rigid[k];
  }
}

}  // namespace talus::fem

#include "fem/linear/elastic_system.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "fem/linear/lowest_eigenvalue.hpp"
#include "fem/linear/modal.hpp"
#include "fem/linear/reproducible_sum.hpp"
#include "fem/not_enough_memory.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_body.hpp"

namespace talus::fem {

void ElasticSystem::apply(const std::vector<Spring>& springs, AlignedVector& x, AlignedVector& y) const {
  std::fill(y.begin(), y.end(), 0.0);
  body_.discretisation.distribute(x);
  body_.elements->add_internal_force(x.data(), y.data(), false, false);
  for (const Spring& spring : springs) spring.add_force(x, y);
  body_.discretisation.condense(y);
}

std::vector<Spring> ElasticSystem::springs(const std::vector<Mat3>* frames) const {
  std::vector<Spring> list = body_.bearings ? body_.bearings->springs() : std::vector<Spring>{};
  if (body_.bars) {
    const std::vector<Spring> steel = springs_of(body_.bars->embedded(), frames);
    list.insert(list.end(), steel.begin(), steel.end());
  }
  return list;
}

const SymmetricMatrix& ElasticSystem::stiffness() {
  if (stiffness_.n == 0)
    stiffness_ = assemble_stiffness(body_.mesh, body_.dofs, body_.shear, body_.bulk, springs());
  return stiffness_;
}

const CholeskyFactor& ElasticSystem::factor() {
  if (factor_) return *factor_;
  try {
    factor_ = std::make_unique<CholeskyFactor>(stiffness(), 0.0, std::vector<double>{});
  } catch (const NotEnoughMemory& e) {
    bad(body_.spec, body_.spec.cell_size > 0 ? "cell_size" : "cells",
        fmt::format("{} cells", body_.mesh.hexes.size()), e.what(),
        "take larger cells, or fewer of them, or free memory");
  }
  return *factor_;
}

LinearSolver& ElasticSystem::multigrid() {
  if (!multigrid_)
    multigrid_ =
        make_multigrid(body_.discretisation, body_.dofs, *body_.elements, springs(), body_.partition.get());
  return *multigrid_;
}

double ElasticSystem::highest_frequency(const std::vector<double>& mass,
                                        const AlignedVector& inverse_mass) const {
  // Largest omega^2 of M^-1 K by Lanczos in the M inner product, then 2 % on top, since Ritz values come from
  // below. The bits are those of one rank on any number of them.
  const std::size_t n = inverse_mass.size();
  const int steps = 40;
  Partition* const partition = body_.partition.get();
  const std::vector<NodeRange> own =
      partition != nullptr ? partition->own_nodes() : std::vector<NodeRange>{{0, static_cast<int>(n / 4)}};
  const std::size_t nodes_in_all = partition != nullptr ? partition->nodes_in_all() : n / 4;
  const auto sum = [&](auto&& term) {
    return reproducible_sum(own, 4 * static_cast<double>(nodes_in_all), partition, term);
  };
  const std::vector<Spring> links = springs();
  AlignedVector x(n, 0.0), previous(n, 0.0), y(n, 0.0);
  std::uint64_t seed = 88172645463325252ull;
  for (std::size_t node = 0, i = 0; node < nodes_in_all; ++node) {
    const bool here = i < n && (partition == nullptr ||
                                partition->whole_node(static_cast<int>(i / 4)) == static_cast<int>(node));
    for (int c = 0; c < 4; ++c) {
      seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
      if (!here) continue;
      x[i] = inverse_mass[i] > 0 ? static_cast<double>(seed >> 11) * 0x1p-53 - 0.5 : 0.0;
      ++i;
    }
  }
  std::vector<double> diagonal, off;
  double beta = 0;
  const double start = 1 / std::sqrt(sum([&](std::size_t i) { return mass[i / 4] * x[i] * x[i]; }));
  for (double& a : x) a *= start;
  for (int k = 0; k < steps; ++k) {
    apply(links, x, y);
    const double a = sum([&](std::size_t i) { return y[i] * x[i]; });  // x is zero where it is held
    for (std::size_t i = 0; i < n; ++i) y[i] = inverse_mass[i] * y[i] - a * x[i] - beta * previous[i];
    diagonal.push_back(a);
    beta = std::sqrt(sum([&](std::size_t i) { return mass[i / 4] * y[i] * y[i]; }));
    if (!(beta > 1e-12 * std::abs(diagonal[0]))) break;
    off.push_back(beta);
    previous.swap(x);
    for (std::size_t i = 0; i < n; ++i) x[i] = y[i] / beta;
    if (partition != nullptr) partition->exchange(x);
  }
  const int size = static_cast<int>(diagonal.size());
  MatX t = MatX::Zero(size, size);
  for (int i = 0; i < size; ++i) {
    t(i, i) = diagonal[i];
    if (i + 1 < size) t(i, i + 1) = t(i + 1, i) = off[i];
  }
  return std::sqrt(1.02 *
                   Eigen::SelfAdjointEigenSolver<MatX>(t, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

double ElasticSystem::first_frequency(const std::vector<double>& mass) {
  const bool divided = body_.divided();
  VecX m = of_dofs(body_.dofs, mass), start(body_.dofs.size);
  constexpr int largest = 24;  // vectors of the basis
  if (body_.dofs.size <= largest_factored_system && !divided)
    return lowest_modes(factor(), m, 1, largest).omega[0];
  std::uint64_t seed = 1234567;
  for (int d = 0; d < body_.dofs.size; ++d) {
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    const double random = static_cast<double>(seed >> 11) * 0x1p-53 - 0.5;
    const bool own = body_.own_node(body_.dofs.node(d));
    start[d] = own ? 1 + 0.1 * random * (body_.dofs.place[d] % 4 + 1) : 0.0;
    if (!own) m[d] = 0;
  }
  constexpr double rough = 0.1;  // solutions are dear
  const std::vector<Spring> links = springs();
  AlignedVector u(4 * mass.size()), f(u.size());
  const auto stiffness = [&](const VecX& from, VecX& to) {
    scatter(body_.dofs, from, u);
    if (divided) body_.partition->exchange(u);
    apply(links, u, f);
    gather(body_.dofs, f, to);
    for (int d = 0; d < body_.dofs.size; ++d)
      if (!body_.own_node(body_.dofs.node(d))) to[d] = 0;
  };
  const auto inverse = [&](const VecX& r, VecX& w) { multigrid().solve(r.data(), w.data(), rough); };
  return std::sqrt(lowest_eigenvalue(m, stiffness, inverse, start, 1e-6,
                                     divided
                                         ? [this](std::span<double> values) { body_.partition->sum(values); }
                                         : std::function<void(std::span<double>)>{}));
}

}  // namespace talus::fem

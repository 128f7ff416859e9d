// Elastic concrete that the permanent load, weight and prestress, or later what strikes it stretches or
// presses beyond its strength.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>

#include "fem/materials/material_simd.hpp"
#include "fem/output/place_in_words.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

Mat3 FemStructure::strain_at_centre(int cell) const {
  const auto& hex = mesh_.hexes[static_cast<std::size_t>(cell)];
  const Mat3 inverse_t = jacobian(mesh_, cell, Vec3::Zero()).inverse().transpose();
  const std::array<Vec3, 8> g = shape_gradients(Vec3::Zero());
  Mat3 h = Mat3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    const std::size_t i = 4 * static_cast<std::size_t>(hex[a]);
    h += Vec3(u_[i], u_[i + 1], u_[i + 2]) * (inverse_t * g[a]).transpose();
  }
  Mat3 strain = 0.5 * (h + h.transpose());
  if (finite_) strain += 0.5 * h.transpose() * h;
  return strain;
}

namespace {

/// Where a permanent stress is beyond a strength: by how much volume, and worst where.
struct Beyond {
  double volume = 0, most = 0;  // [m^3], [Pa]
  int worst = -1;

  void look(double stress, double strength, double of, int cell) {
    if (stress > strength) volume += of;
    if (stress > most) most = stress, worst = cell;
  }
};

}  // namespace

/// Where the greatest of a quantity is, in words, of the ranks' own greatest ones and their cells.
std::string FemStructure::place_of_most(double most, int cell) const {
  double at[5] = {};  // centre, part, of how many ranks
  const bool mine = most == largest(most);
  if (cell >= 0 && mine) {
    for (const int n : mesh_.hexes[static_cast<std::size_t>(cell)])
      for (int c = 0; c < 3; ++c) at[c] += mesh_.nodes[static_cast<std::size_t>(n)][c] / 8;
    at[3] = mesh_.component.empty() ? -1 : mesh_.component[static_cast<std::size_t>(cell)], at[4] = 1;
  }
  sum(at);
  return place_in_words(spec_, Vec3(at) / at[4],
                        spec_.kind == "viaduct" ? static_cast<int>(at[3] / at[4]) : -1);
}

/// Warnings if more than a thousandth of the volume is, by the permanent load, elastically computed,
/// stretched beyond f_t where it hosts no bar, or pressed beyond f_cm along one axis alone (pressure from the
/// sides, which helps, is taken off).
void FemStructure::warn_of_cracks() const {
  constexpr double worth_saying = 1e-3;
  std::vector<char> barred(mesh_.hexes.size(), 0);
  if (bars_)
    for (std::size_t k = 0; k < bars_->segments(); ++k)
      if (const int host = bars_->host(k); host >= 0) barred[static_cast<std::size_t>(host)] = 1;
  Beyond tension, compression;
  double whole = 0;
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    if (!own_cell(cell)) continue;
    const double volume = cell_mass_[static_cast<std::size_t>(cell)] / spec_.density;
    whole += volume;
    const Mat3 strain = strain_at_centre(cell);
    const Mat3 stress = 2 * shear_ * strain + (bulk_ - 2.0 / 3 * shear_) * strain.trace() * Mat3::Identity();
    Eigen::SelfAdjointEigenSolver<Mat3> principal;
    principal.computeDirect(stress, Eigen::EigenvaluesOnly);
    const Vec3 sigma = principal.eigenvalues();  // rising
    if (!barred[static_cast<std::size_t>(cell)]) tension.look(sigma[2], concrete_->f_t, volume, cell);
    compression.look(std::min(sigma[2], 0.0) - sigma[0], concrete_->f_cm, volume, cell);
  }
  double volumes[3] = {tension.volume, compression.volume, whole};
  sum(volumes);
  tension.volume = volumes[0], compression.volume = volumes[1], whole = volumes[2];
  const std::string torn = place_of_most(tension.most, tension.worst),
                    pressed = place_of_most(compression.most, compression.worst);
  tension.most = largest(tension.most), compression.most = largest(compression.most);
  if (tension.volume >= worth_saying * whole)
    report_(
        fmt::format("warning: {:.2g} % of its concrete, without bars, is stretched beyond f_t = {:.3g} MPa "
                    "by the permanent load (up to {:.3g} MPa, {}) and cracks as the run begins; give it "
                    "bars (rebar, prestress in a deck), shorter spans, or damage = \"none\"",
                    100 * tension.volume / whole, concrete_->f_t / 1e6, tension.most / 1e6, torn));
  if (compression.volume >= worth_saying * whole)
    report_(fmt::format(
        "warning: {:.2g} % of its concrete is pressed beyond f_cm = {:.3g} MPa by the permanent load (up to "
        "{:.3g} MPa, {}) and is crushed as the run begins; larger sections, or less "
        "prestress",
        100 * compression.volume / whole, concrete_->f_cm / 1e6, compression.most / 1e6, pressed));
}

/// Cells that the range of their nodes' displacements shows to bear less than any strength are passed over:
/// |sigma_i| <= 3 (K + 4 G / 3) sqrt(3) |u range| / shortest edge.
void FemStructure::watch_stress(double t) {
  if (damage_ || !concrete_) return;
  StressPeak tension, compression;
  tension.time = compression.time = t;
  tension.strength = concrete_->f_t, compression.strength = concrete_->f_cm;
  using material::load4, material::V4;
  const double enough = std::min(concrete_->f_t, concrete_->f_cm),
               factor = 3 * std::sqrt(3.0) * (bulk_ + 4.0 / 3 * shear_);
  if (shortest_edge_.empty())
    for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell)
      shortest_edge_.push_back(2 / jacobian(mesh_, cell, Vec3::Zero()).inverse().rowwise().norm().maxCoeff());
  double beyond[2] = {}, whole = 0;
  int cell_of[2] = {-1, -1};
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    const auto c = static_cast<std::size_t>(cell);
    if (!live_[c] || !own_cell(cell)) continue;
    const double volume = cell_mass_[c] / spec_.density;
    whole += volume;
    V4 low = load4(&u_[4 * static_cast<std::size_t>(mesh_.hexes[c][0])]), high = low;
    for (const int n : mesh_.hexes[c]) {
      const V4 here = load4(&u_[4 * static_cast<std::size_t>(n)]);
      low = material::minimum(low, here), high = material::maximum(high, here);
    }
    const V4 range = high - low;
    if (factor * std::sqrt(range[0] * range[0] + range[1] * range[1] + range[2] * range[2]) <
        enough * shortest_edge_[c])
      continue;
    const Mat3 strain = strain_at_centre(cell);
    const Mat3 stress = 2 * shear_ * strain + (bulk_ - 2.0 / 3 * shear_) * strain.trace() * Mat3::Identity();
    Eigen::SelfAdjointEigenSolver<Mat3> principal;
    principal.computeDirect(stress, Eigen::EigenvaluesOnly);
    const Vec3 sigma = principal.eigenvalues();  // rising
    if (sigma[2] > tension.value) tension.value = sigma[2], cell_of[0] = cell;
    if (const double pressed = std::min(sigma[2], 0.0) - sigma[0]; pressed > compression.value)
      compression.value = pressed, cell_of[1] = cell;
    if (sigma[2] > tension.strength) beyond[0] += volume;
    if (std::min(sigma[2], 0.0) - sigma[0] > compression.strength) beyond[1] += volume;
  }
  double sums[3] = {beyond[0], beyond[1], whole};
  sum(sums);
  StressPeak* const peaks[2] = {&tension, &compression};
  for (int k = 0; k < 2; ++k) {
    const double most = largest(peaks[k]->value);
    double at[4] = {};  // of the ranks that have it, as many times
    if (cell_of[k] >= 0 && peaks[k]->value == most) {
      at[3] = 1;
      for (const int n : mesh_.hexes[static_cast<std::size_t>(cell_of[k])])
        for (int c = 0; c < 3; ++c) at[c] += mesh_.nodes[static_cast<std::size_t>(n)][c] / 8;
    }
    sum(at);
    peaks[k]->value = most;
    if (at[3] > 0) peaks[k]->at = Vec3(at[0], at[1], at[2]) / at[3];
    if (sums[2] > 0) peaks[k]->share = sums[k] / sums[2];
  }
  load_track_.strain(tension, compression);
}

}  // namespace talus::fem

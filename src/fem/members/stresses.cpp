// Elastic concrete that the permanent load, weight and prestress, or later what strikes it stretches or
// presses beyond its strength.
#include "fem/members/stresses.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>

#include "fem/kernels/law_points.hpp"
#include "fem/materials/material_simd.hpp"
#include "fem/output/place_in_words.hpp"

namespace talus::fem {

/// Displacement gradient at the middle of a cell.
Mat3 Stresses::gradient(int cell) const {
  const Mat3 inverse_t = jacobian(body_.mesh, cell, Vec3::Zero()).inverse().transpose();
  const std::array<Vec3, 8> g = shape_gradients(Vec3::Zero());
  Mat3 h = Mat3::Zero();
  for (int a = 0; a < 8; ++a) {
    const int n = 4 * body_.mesh.hexes[cell][a];
    h += Vec3(fields_.u[n], fields_.u[n + 1], fields_.u[n + 2]) * (inverse_t * g[a]).transpose();
  }
  return h;
}

Mat3 Stresses::strain(int cell) const {
  const Mat3 h = gradient(cell);
  Mat3 strain = 0.5 * (h + h.transpose());
  if (body_.finite) strain += 0.5 * h.transpose() * h;
  return strain;
}

/// Looks at a cell's principal stresses at its eight points, as if it could bear all.
void Stresses::look(int cell, Beyond& tension, Beyond& compression) const {
  const double volume = body_.cell_mass[static_cast<std::size_t>(cell)] / body_.spec.density / 8;
  PointStrains at;
  law_points().strains(law_geometry(body_.mesh, cell, body_.spec.poisson), fields_.u.data(), body_.finite,
                       at);
  for (int q = 0; q < 8; ++q) {
    const auto& e = at.strain;
    Mat3 stress;
    stress << 2 * e[0][q], e[5][q], e[4][q], e[5][q], 2 * e[1][q], e[3][q], e[4][q], e[3][q], 2 * e[2][q];
    stress = (body_.shear * stress +
              (body_.bulk - 2.0 / 3 * body_.shear) * (e[0][q] + e[1][q] + e[2][q]) * Mat3::Identity())
                 .eval();
    Eigen::SelfAdjointEigenSolver<Mat3> principal;
    principal.computeDirect(stress, Eigen::EigenvaluesOnly);
    const Vec3& sigma = principal.eigenvalues();  // rising
    tension.look(sigma[2], volume, cell);
    compression.look(std::min(sigma[2], 0.0) - sigma[0], volume, cell);
  }
}

/// Of the ranks whose own greatest `value` is that of all: sums of the middles of its cells, of their parts,
/// and how many they are.
std::array<double, 5> Stresses::middle_of_most(double value, double most, int cell) const {
  std::array<double, 5> at{};
  if (cell >= 0 && value == most) {
    Eigen::Map<Vec3>(at.data()) = cell_centre(body_.mesh, cell);
    at[3] = body_.mesh.component.empty() ? -1 : body_.mesh.component[static_cast<std::size_t>(cell)],
    at[4] = 1;
  }
  body_.sum(at);
  return at;
}

std::string Stresses::place_of_most(double most, int cell) const {
  const std::array<double, 5> at = middle_of_most(most, body_.largest(most), cell);
  return place_in_words(body_.spec, Vec3(at.data()) / at[4],
                        body_.spec.kind == "viaduct" ? static_cast<int>(at[3] / at[4]) : -1);
}

/// Warnings if more than a thousandth of the volume is, by the permanent load, elastically computed,
/// stretched beyond f_t where it hosts no bar, or pressed beyond f_cm along one axis alone (pressure from the
/// sides, which helps, is taken off).
void Stresses::warn_of_cracks() const {
  constexpr double worth_saying = 1e-3;
  std::vector<char> barred(body_.mesh.hexes.size(), 0);
  if (body_.bars)
    for (const rebar::Segment& segment : body_.bars->embedded().segments())
      if (segment.cell >= 0) barred[static_cast<std::size_t>(segment.cell)] = 1;
  Beyond tension{body_.concrete->f_t}, in_bars{body_.concrete->f_t}, compression{body_.concrete->f_cm};
  double whole = 0;
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell) {
    if (!body_.own_cell(cell)) continue;
    whole += body_.cell_mass[static_cast<std::size_t>(cell)] / body_.spec.density;
    look(cell, barred[static_cast<std::size_t>(cell)] ? in_bars : tension, compression);
  }
  double volumes[3] = {tension.volume, compression.volume, whole};
  body_.sum(volumes);
  tension.volume = volumes[0], compression.volume = volumes[1], whole = volumes[2];
  const std::string torn = place_of_most(tension.most, tension.worst),
                    pressed = place_of_most(compression.most, compression.worst);
  tension.most = body_.largest(tension.most), compression.most = body_.largest(compression.most);
  if (tension.volume >= worth_saying * whole)
    body_.report(
        fmt::format("warning: {:.2g} % of its concrete, without bars, is stretched beyond f_t = {:.3g} MPa "
                    "by the permanent load (up to {:.3g} MPa, {}) and cracks as the run begins; give it "
                    "bars (rebar, prestress in a deck), shorter spans, or damage = \"none\"",
                    100 * tension.volume / whole, body_.concrete->f_t / 1e6, tension.most / 1e6, torn));
  if (compression.volume >= worth_saying * whole)
    body_.report(fmt::format(
        "warning: {:.2g} % of its concrete is pressed beyond f_cm = {:.3g} MPa by the permanent load (up to "
        "{:.3g} MPa, {}) and is crushed as the run begins; larger sections, or less "
        "prestress",
        100 * compression.volume / whole, body_.concrete->f_cm / 1e6, compression.most / 1e6, pressed));
}

/// Cells that the range of their nodes' displacements shows to bear less than any strength are passed over:
/// |sigma_i| <= 3 (K + 4 G / 3) sqrt(3) |u range| / shortest edge.
std::array<StressPeak, 2> Stresses::peaks(double t) {
  std::array<StressPeak, 2> peaks;
  auto& [tension, compression] = peaks;
  tension.time = compression.time = t;
  tension.strength = body_.concrete->f_t, compression.strength = body_.concrete->f_cm;
  using material::load4, material::V4;
  const double enough = std::min(body_.concrete->f_t, body_.concrete->f_cm),
               factor = 3 * std::sqrt(3.0) * (body_.bulk + 4.0 / 3 * body_.shear);
  if (shortest_edge_.empty())
    for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell)
      shortest_edge_.push_back(
          2 / jacobian(body_.mesh, cell, Vec3::Zero()).inverse().rowwise().norm().maxCoeff());
  Beyond beyond[2] = {{tension.strength}, {compression.strength}};
  double whole = 0;
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell) {
    const auto c = static_cast<std::size_t>(cell);
    if (!body_.live[c] || !body_.own_cell(cell)) continue;
    whole += body_.cell_mass[c] / body_.spec.density;
    V4 low = load4(&fields_.u[4 * static_cast<std::size_t>(body_.mesh.hexes[c][0])]), high = low;
    for (const int n : body_.mesh.hexes[c]) {
      const V4 here = load4(&fields_.u[4 * static_cast<std::size_t>(n)]);
      low = material::minimum(low, here), high = material::maximum(high, here);
    }
    const V4 range = high - low;
    if (factor * std::sqrt(range[0] * range[0] + range[1] * range[1] + range[2] * range[2]) <
        enough * shortest_edge_[c])
      continue;
    look(cell, beyond[0], beyond[1]);
  }
  double sums[3] = {beyond[0].volume, beyond[1].volume, whole};
  body_.sum(sums);
  for (std::size_t k = 0; k < 2; ++k) {
    const double most = body_.largest(beyond[k].most);
    const std::array<double, 5> at = middle_of_most(beyond[k].most, most, beyond[k].worst);
    peaks[k].value = most;
    if (at[4] > 0) peaks[k].at = Vec3(at.data()) / at[4];
    if (sums[2] > 0) peaks[k].share = sums[k] / sums[2];
  }
  return peaks;
}

}  // namespace talus::fem

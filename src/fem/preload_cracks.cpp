// Concrete that the permanent load, weight and prestress, stretches or presses beyond its strength.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>

#include "fem/place_in_words.hpp"
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
  double volume = 0, most = 0;   // [m^3], [Pa]
  int worst = -1;

  void look(double stress, double strength, double of, int cell) {
    if (stress > strength) volume += of;
    if (stress > most) most = stress, worst = cell;
  }
};

}  // namespace

/// Warnings if more than a thousandth of the volume is, by the permanent load, elastically computed, stretched beyond f_t where it hosts no bar, or pressed
/// beyond f_cm along one axis alone (pressure from the sides, which helps, is taken off).
void FemStructure::warn_of_cracks() const {
  constexpr double worth_saying = 1e-3;
  std::vector<char> barred(mesh_.hexes.size(), 0);
  if (bars_)
    for (std::size_t k = 0; k < bars_->segments(); ++k) barred[static_cast<std::size_t>(bars_->host(k))] = 1;
  Beyond tension, compression;
  double whole = 0;
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    const double volume = cell_mass_[static_cast<std::size_t>(cell)] / spec_.density;
    whole += volume;
    const Mat3 strain = strain_at_centre(cell);
    const Mat3 stress = 2 * shear_ * strain + (bulk_ - 2.0 / 3 * shear_) * strain.trace() * Mat3::Identity();
    Eigen::SelfAdjointEigenSolver<Mat3> principal;
    principal.computeDirect(stress, Eigen::EigenvaluesOnly);
    const Vec3 sigma = principal.eigenvalues();   // rising
    if (!barred[static_cast<std::size_t>(cell)]) tension.look(sigma[2], concrete_->f_t, volume, cell);
    compression.look(std::min(sigma[2], 0.0) - sigma[0], concrete_->f_cm, volume, cell);
  }
  const auto where = [&](int cell) { return place_in_words(spec_, mesh_, cell); };
  if (tension.volume >= worth_saying * whole)
    report_(fmt::format("warning: {:.2g} % of its concrete, without bars, is stretched beyond f_t = {:.3g} MPa by the permanent load (up to {:.3g} MPa, {}) and cracks as the run begins; give it "
                        "bars (rebar, prestress in a deck), shorter spans, or damage = \"none\"",
                        100 * tension.volume / whole, concrete_->f_t / 1e6, tension.most / 1e6, where(tension.worst)));
  if (compression.volume >= worth_saying * whole)
    report_(fmt::format("warning: {:.2g} % of its concrete is pressed beyond f_cm = {:.3g} MPa by the permanent load (up to {:.3g} MPa, {}) and is crushed as the run begins; larger sections, or less "
                        "prestress",
                        100 * compression.volume / whole, concrete_->f_cm / 1e6, compression.most / 1e6, where(compression.worst)));
}

}  // namespace talus::fem

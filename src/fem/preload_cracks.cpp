// Concrete without bars that its own weight stretches beyond its strength.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>

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

/// A warning if more than a thousandth of the volume hosts no bar and is stretched beyond f_t by the permanent load, elastically computed.
void FemStructure::warn_of_cracks() const {
  constexpr double worth_saying = 1e-3;
  std::vector<char> barred(mesh_.hexes.size(), 0);
  if (bars_)
    for (std::size_t k = 0; k < bars_->segments(); ++k) barred[static_cast<std::size_t>(bars_->host(k))] = 1;
  double stretched = 0, whole = 0, most = 0;
  int worst = -1;
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    const double volume = cell_mass_[static_cast<std::size_t>(cell)] / spec_.density;
    whole += volume;
    if (barred[static_cast<std::size_t>(cell)]) continue;
    const Mat3 strain = strain_at_centre(cell);
    const Mat3 stress = 2 * shear_ * strain + (bulk_ - 2.0 / 3 * shear_) * strain.trace() * Mat3::Identity();
    Eigen::SelfAdjointEigenSolver<Mat3> principal;
    principal.computeDirect(stress, Eigen::EigenvaluesOnly);
    const double tension = principal.eigenvalues()[2];
    if (tension > concrete_->f_t) stretched += volume;
    if (tension > most) most = tension, worst = cell;
  }
  if (stretched < worth_saying * whole) return;
  Vec3 at = Vec3::Zero();
  for (const int node : mesh_.hexes[static_cast<std::size_t>(worst)]) at += mesh_.nodes[static_cast<std::size_t>(node)] / 8;
  report_(fmt::format("warning: {:.2g} % of its concrete, without bars, is stretched beyond f_t = {:.3g} MPa by the permanent load (up to {:.3g} MPa, at ({:.3g}, {:.3g}, {:.3g})) and cracks as "
                      "the run begins; give it bars (rebar, prestress in a deck), shorter spans, or damage = \"none\"",
                      100 * stretched / whole, concrete_->f_t / 1e6, most / 1e6, at.x(), at.y(), at.z()));
}

}  // namespace talus::fem

/// The element of the kernels once more, assembled by deal.II with its own quadrature and mapping: the reference the kernels are
/// tested against. Small strain, assumed_strain.hpp.
#pragma once
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

/// K u; u and the result hold three values per node [m], [N].
std::vector<double> reference_internal_force(const HexMesh& mesh, double shear, double bulk, const std::vector<double>& u);

}  // namespace talus::fem

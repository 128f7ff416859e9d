/// The functions behind fem/services.hpp.
#pragma once
#include "fem/services.hpp"

namespace talus::fem {

void disc_by_dealii(int levels, DiscMesh& mesh);
/// Trilinos: ML and conjugate gradients.
std::unique_ptr<LinearSolver> multigrid_by_trilinos(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction);

}  // namespace talus::fem

/// The functions behind fem/services.hpp.
#pragma once
#include "fem/services.hpp"

namespace talus::fem {

void disc_by_dealii(int levels, DiscMesh& mesh);
void refine_by_dealii(HexMesh& mesh, const std::vector<StructureSpec::Refinement>& zones);
/// Conjugate gradients preconditioned by Trilinos' ML.
std::unique_ptr<LinearSolver> multigrid_by_trilinos(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body);

}  // namespace talus::fem

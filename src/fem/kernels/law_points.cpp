#include "core/processor.hpp"
#include "fem/materials/material_simd.hpp"
// The body is written in terms of the vectors above.
#include "fem/kernels/law_points_body.inc"

namespace talus::fem {

const LawPoints& law_points_base() { return all_of<material::V44>; }

const LawPoints& law_points() {
  return instruction_set() == InstructionSet::avx512 ? law_points_avx512() : law_points_base();
}

LawGeometry law_geometry(const HexMesh& mesh, int cell, double poisson) {
  LawGeometry g{};
  g.assumed = AssumedStrain(mesh, cell, poisson);
  const TrilinearMap map(mesh.nodes, mesh.hexes[static_cast<std::size_t>(cell)]);
  for (int q = 0; q < 8; ++q) {
    const Mat3 j = map.jacobian(gauss_point(q));
    const Mat3 inverse = j.inverse();
    for (int i = 0; i < 9; ++i) g.inverse[i][q] = inverse(i / 3, i % 3);
    g.volume += j.determinant();
  }
  const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
  for (std::size_t a = 0; a < 8; ++a) g.node[a] = 4 * hex[a];
  const Mat3 centre = map.jacobian(Vec3::Zero());
  g.shortest_edge = 2 * std::sqrt(centre.colwise().squaredNorm().minCoeff());
  g.frame = material::CellFrame::of(2 * centre);
  return g;
}

}  // namespace talus::fem

/// The finite-element space of a structure, by deal.II: trilinear hexahedra with three displacements at each
/// vertex.
///
///   u_h(x) = sum_i N_i(x) u_i    dealii::FESystem(FE_Q(1), 3) on the active cells of a Triangulation<3>
///   u = C u_m,   f_m = C^T f     dealii::AffineConstraints: a hanging node is a mean of the nodes it hangs
///                                between; u = 0 at supports
///
/// Degree of freedom 3 n + c is component c of vertex n of the triangulation. The kernels, laws, bars and
/// contact read plain tables (HexMesh) that are taken once from the active cells of the DoFHandler; their
/// fields hold four numbers per node.
///
/// symbol   meaning                                             unit   shape
/// u        displacements, velocities                           any    nodes x 4 (padded)
/// f        forces                                              any    nodes x 4
#pragma once
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/kernels/aligned.hpp"

namespace dealii {
template <int, int>
class Triangulation;
template <int, int>
class DoFHandler;
template <typename>
class AffineConstraints;
}  // namespace dealii

namespace talus::fem {

/// Numbers of the free degrees of freedom: 3 per node, -1 where held or where the node is not part of the
/// structure any more.
struct DofMap {
  std::vector<std::array<int, 3>> number;
  std::vector<int> place;  // of each, in nodal fields (nodes x 4)
  int size = 0;
  int node(int d) const { return place[static_cast<std::size_t>(d)] / 4; }
};

/// Between nodal fields and free degrees of freedom.
inline void gather(const DofMap& dofs, const AlignedVector& from, VecX& to) {
  for (int d = 0; d < dofs.size; ++d) to[d] = from[static_cast<std::size_t>(dofs.place[d])];
}
inline void scatter(const DofMap& dofs, const VecX& from, AlignedVector& to) {
  for (int d = 0; d < dofs.size; ++d) to[static_cast<std::size_t>(dofs.place[d])] = from[d];
}
/// Of a number of each node, that of each degree of freedom.
inline VecX of_dofs(const DofMap& dofs, const std::vector<double>& of_nodes) {
  return VecX::NullaryExpr(dofs.size, [&](Eigen::Index d) {
    return of_nodes[static_cast<std::size_t>(dofs.node(static_cast<int>(d)))];
  });
}

class Discretisation {
 public:
  Discretisation();
  explicit Discretisation(HexMesh coarse, std::span<const StructureSpec::Refinement> zones = {});
  ~Discretisation();
  /// Cells of the coarse mesh are halved in every zone until they are as small as the zone asks for; cells
  /// that share a vertex differ by one halving at most. A zone that meets no cell changes nothing.
  void reinit(HexMesh coarse, std::span<const StructureSpec::Refinement> zones = {},
              double most = std::numeric_limits<double>::infinity());
  Discretisation(const Discretisation&) = delete;
  Discretisation& operator=(const Discretisation&) = delete;

  const HexMesh& mesh() const { return mesh_; }
  /// Of no further use once forget_cells() has been called.
  const dealii::Triangulation<3, 3>& triangulation() const { return *triangulation_; }
  const dealii::DoFHandler<3, 3>& dof_handler() const { return *dof_handler_; }
  /// Of the hanging nodes alone, by which motion is distributed and forces are condensed: a support bears
  /// what comes to it.
  const dealii::AffineConstraints<double>& hanging_node_constraints() const { return *hanging_; }
  /// Of hanging nodes and supports: the degrees of freedom that are left are those of K u = f.
  const dealii::AffineConstraints<double>& constraints() const { return *constraints_; }
  /// Supports: u = 0 where held[node][component].
  void hold(const std::vector<std::array<bool, 3>>& held);
  DofMap free_dofs() const;

  /// u := C u: what hangs follows.
  void distribute(AlignedVector& u) const;
  /// f := C^T f, zero at what hangs: the power of the forces is the same.
  void condense(AlignedVector& f) const;
  /// Impulses by the nodes that carry them.
  std::vector<NodeImpulse> condense(std::span<const NodeImpulse> impulses) const;

  /// The field `from` of a space on the same coarse mesh, whose cells are these or larger, as one of this
  /// space. Both keep their cells.
  void interpolate(const Discretisation& before, const AlignedVector& from, AlignedVector& to) const;

  /// Frees triangulation and DoFHandler, some 1.5 kB a cell, when no cell will be halved any more.
  void forget_cells();

 private:
  void take_new_nodes();
  void take_cells();
  void take_hanging_nodes();

  HexMesh mesh_;
  std::unique_ptr<dealii::Triangulation<3, 3>> triangulation_;
  std::unique_ptr<dealii::DoFHandler<3, 3>> dof_handler_;
  std::unique_ptr<dealii::AffineConstraints<double>> hanging_, constraints_;
};

}  // namespace talus::fem

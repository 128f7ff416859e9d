/// The finite-element space of a structure, by deal.II: trilinear hexahedra with three displacements at each vertex.
///
///   u_h(x) = sum_i N_i(x) u_i          dealii::FESystem(FE_Q(1), 3) on the active cells of a dealii::Triangulation<3>
///   u = C u_m,   f_m = C^T f           dealii::AffineConstraints: a hanging node is a mean of the nodes it hangs between
///
/// Degree of freedom 3 n + c is component c of vertex n of the triangulation. The kernels, laws, bars and contact read plain
/// tables (HexMesh) that are taken once from the active cells of the DoFHandler; their fields hold four numbers per node.
///
/// symbol   meaning                                             unit   shape
/// u        displacements, velocities                           any    nodes x 4 (padded)
/// f        forces                                              any    nodes x 4
#pragma once
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

class Discretisation {
 public:
  Discretisation();
  explicit Discretisation(HexMesh coarse, std::span<const StructureSpec::Refinement> zones = {});
  ~Discretisation();
  /// Cells of the coarse mesh are halved in every zone until they are as small as the zone asks for; cells that share a
  /// vertex differ by one halving at most. A zone that meets no cell changes nothing.
  void reinit(HexMesh coarse, std::span<const StructureSpec::Refinement> zones = {});
  Discretisation(const Discretisation&) = delete;
  Discretisation& operator=(const Discretisation&) = delete;

  const HexMesh& mesh() const { return mesh_; }
  /// Of no further use once forget_cells() has been called.
  const dealii::Triangulation<3, 3>& triangulation() const { return *triangulation_; }
  const dealii::DoFHandler<3, 3>& dof_handler() const { return *dof_handler_; }
  /// Of the hanging nodes alone: what a support holds still bears forces.
  const dealii::AffineConstraints<double>& hanging_node_constraints() const { return *constraints_; }

  /// u := C u: what hangs follows.
  void distribute(AlignedVector& u) const;
  /// f := C^T f, zero at what hangs: the power of the forces is the same.
  void condense(AlignedVector& f) const;
  /// Impulses by the nodes that carry them.
  std::vector<NodeImpulse> condense(std::span<const NodeImpulse> impulses) const;

  /// The field `from` of a space on the same coarse mesh, whose cells are these or larger, as one of this space. Both keep their cells.
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
  std::unique_ptr<dealii::AffineConstraints<double>> constraints_;
};

}  // namespace talus::fem

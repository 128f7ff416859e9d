/// The elements of a mesh packed for the kernels: groups of W elements, bricks, cells with one Jacobian, and
/// others apart.
///
/// A cell that is handed to a damage law, eroded or detached is switched off here (its lane is multiplied by
/// zero) and comes back with another list. All sums run in a fixed order: the result does not depend on the
/// number of threads.
#pragma once
#include <array>
#include <utility>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/kernels/kernel.hpp"

namespace talus::fem {

/// One packed list of elements.
struct ElementPack {
  CellShape shape = CellShape::general;
  std::vector<int> cells;  // cell of each lane, -1 for padding
  std::vector<int> nodes;  // groups x 8 x W, four times the node number
  AlignedVector geometry, scale, energy, bound;
  AlignedVector mean, volume, length;  // for the bulk viscosity; empty unless asked for
  long groups = 0;
  std::vector<std::pair<long, long>>
      busy;  // ranges of groups in which a cell is on: a structure that broke computes what is left of it
  bool stale = true;                       // `busy` is to be found again
  std::vector<char> own;                   // per lane: counts in sums here
  std::size_t memory_consumption() const;  // [bytes]
};

class ElementOperator {
 public:
  /// Where a cell stands in the lists of a mesh by shape.
  struct Lane {
    int pack = -1, lane = -1;
  };
  static std::vector<Lane> lanes_of(const HexMesh& mesh);

  ElementOperator(const HexMesh& mesh, double shear, double bulk, bool viscosity)
      : ElementOperator(mesh, shear, bulk, viscosity, lanes_of(mesh)) {}
  /// Of a part of a mesh: `lanes` of its cells in the lists of the whole, whose groups are kept as far as
  /// they hold one of these cells, so that the sums at a node whose cells are all here have the bits of the
  /// whole; what is added at other nodes is meaningless.
  ElementOperator(const HexMesh& mesh, double shear, double bulk, bool viscosity,
                  const std::vector<Lane>& lanes);

  /// Keeps from now on the groups that hold a local cell alone.
  void restrict_to(const std::vector<char>& local);
  /// Energies are those of own cells.
  void count_only(const std::vector<char>& own);
  /// Marks the nodes that forces are added to.
  void mark_nodes(std::vector<char>& touched) const;

  /// f += internal force of all cells that are on; measures: energies, and bounds that the limits of a law
  /// may rule out.
  void add_internal_force(const double* u, double* f, bool finite, bool measures,
                          const ElasticLimits* limits = nullptr);
  /// The same for a few cells, times `factor` (-1 takes out what was added). Measures are not touched.
  void add_internal_force_of(const std::vector<int>& cells, const double* u, double* f, bool finite,
                             double factor) const;
  /// Packed once for calls again and again, where `scale` says which lanes count.
  ElementPack pack_of(const std::vector<int>& cells) const {
    return make_pack(cells, CellShape::general, false);
  }
  void add_internal_force_of(const ElementPack& pack, const double* u, double* f, bool finite) const;
  void add_bulk_viscosity(const double* u, const double* v, double* f, double density, double wave_speed);

  void set_on(int cell, bool on);
  double energy(int cell) const { return pack_[where_[cell].pack].energy[where_[cell].lane]; }
  double bound(int cell) const { return pack_[where_[cell].pack].bound[where_[cell].lane]; }
  double total_energy() const;
  /// Local cells whose bound of the last call with measures exceeds `limit`, ascending.
  void cells_above(double limit, std::vector<int>& cells) const;
  double shear() const { return shear_; }
  double bulk() const { return bulk_; }
  const HexMesh& mesh() const { return *mesh_; }
  std::size_t memory_consumption() const;  // [bytes]

 private:
  void find_busy(ElementPack& pack) const;
  ElementPack make_pack(const std::vector<int>& cells, CellShape shape,
                        bool viscosity) const;  // -1: a lane that stays empty
  const HexMesh* mesh_;
  double shear_, bulk_;
  std::array<ElementPack, 3> pack_;  // by shape
  std::vector<Lane> where_;          // of each cell; pack -1: it is not here
};

/// J^-1 and weight at one point, ten numbers, as the kernels want them.
void point_geometry(const HexMesh& mesh, int cell, const Vec3& xi, double out[10]);
CellShape shape_of(const HexMesh& mesh, int cell);

}  // namespace talus::fem

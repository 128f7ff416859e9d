/// The cells in which concrete may damage: strains at eight points, the law, forces, erosion.
///
///   eps_q = dev(E_q) + theta/3 I,   theta = sum_q w_q tr(E_q) / V          mean dilatation, as in the elastic kernel
///   f_a = sum_q w_q F_q (dev sigma_q + p I) grad N_a,   p = sum_q w_q tr(sigma_q) / (3 V)
///
/// A cell enters when its law is first evaluated to grow; before, it is elastic and keeps no history. States are evaluated from the last
/// accepted ones into the next; accept() makes them the accepted ones, so that a rejected step leaves no trace.
///
/// symbol   meaning                                               unit     shape
/// G        grad N_a at the points                                1/m      8 x 3 x 8 (node, axis, point)
/// w        weights                                               m^3      8
///
/// The laws: material::ConcreteDamage ("concrete") and material::Cdpm2 ("concrete-cdpm2").
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fem/aligned.hpp"
#include "fem/hex_mesh.hpp"
#include "fem/kernel.hpp"
#include "fem/material_damage.hpp"

namespace talus::fem {

struct LawGeometry {
  double gradient[8][3][8];
  double weight[8];
  double volume;
  int node[8];  // four times the node number
  material::CellFrame frame;
};

LawGeometry law_geometry(const HexMesh& mesh, int cell);

/// What one evaluation of a cell says.
struct LawResult {
  double energy = 0, dissipation = 0;  // [J]
  double largest_strain = 0;           // Frobenius norm, a bound on the principal values
  bool grew = false;
};

class DamageField {
 public:
  virtual ~DamageField() = default;

  /// Within these no point of a cell without history can start to damage.
  virtual ElasticLimits elastic_limits() const = 0;
  bool has(int cell) const { return slot_[cell] >= 0; }
  const std::vector<int>& cells() const { return cells_; }

  /// Evaluates a cell that has no history; if damage would start, it joins with its force added to f, and true is returned.
  virtual bool try_cell(int cell, const double* u, const double* v, double* f) = 0;
  /// Adds the forces of all cells that were in before; results are kept for accept().
  virtual void add_forces(const double* u, const double* v, double* f) = 0;
  /// Force on the eight nodes of a cell with history (24 numbers, node by node) at u, from the accepted states; nothing is kept.
  virtual void force_of(int cell, const double* u, double* force) const = 0;
  virtual void accept() = 0;
  /// Cells to erode by the last evaluation: a strain (Frobenius norm) above `limit`, or all points at the cap and a strain that
  /// opens the cell by more than `opening` [m]; `kept` cells (hosts of bars that hold) only by the first.
  virtual std::vector<int> spent(double limit, double opening, const std::vector<char>& kept) const = 0;
  virtual void remove(int cell) = 0;

  double stored() const;               // of the last evaluation [J]
  double dissipation() const;          // of the last evaluation, since the last accepted states [J]
  double stored(int cell) const { return result_[slot_[cell]].energy; }
  /// Damage over the points of a cell, accepted states; zero without history.
  virtual double tension(int cell) const = 0;        // largest
  virtual double tension_least(int cell) const = 0;
  virtual double compression(int cell) const = 0;    // largest
  double largest() const;
  /// Crack band width times the largest principal value of the cell's mean inelastic strain at u; zero without damage in tension [m].
  virtual double crack_width(int cell, const double* u) const = 0;

  virtual void save(std::vector<double>& state) const = 0;
  virtual std::size_t restore(std::span<const double> state) = 0;

 protected:
  DamageField(const HexMesh& mesh, bool finite) : mesh_(&mesh), finite_(finite), slot_(mesh.hexes.size(), -1) {}

  const HexMesh* mesh_;
  bool finite_;
  std::vector<int> slot_;              // per cell, -1: no history
  std::vector<int> cells_;             // in the order of joining
  std::vector<LawGeometry> geometry_;
  std::vector<LawResult> result_;
};

/// The field of a structure's law. `finite`: Green-Lagrange strains. Throws InputError if a cell (largest_cell: the longest edge in
/// the mesh [m]) would snap back; `key` stands in the message.
std::unique_ptr<DamageField> make_damage_field(const std::string& law, const HexMesh& mesh, const material::Concrete& concrete, bool rate_effect, bool finite,
                                               double largest_cell, const std::string& key);

}  // namespace talus::fem

/// The cells in which concrete may damage: strains at eight points, the law, forces, erosion.
///
///   eps_q = dev(E_q) + theta/3 I,   theta = sum_q w_q tr(E_q) / V          mean dilatation, as in the elastic kernel
///   f_a = sum_q w_q F_q (dev sigma_q + p I) grad N_a,   p = sum_q w_q tr(sigma_q) / (3 V)
///
/// A cell enters when its law is first evaluated to grow; before, it is elastic and keeps no history. States are evaluated from the last
/// accepted ones into `next`; accept() makes them the accepted ones, so that a rejected step leaves no trace.
///
/// symbol   meaning                                               unit     shape
/// G        grad N_a at the points                                1/m      8 x 3 x 8 (node, axis, point)
/// w        weights                                               m^3      8
#pragma once
#include <vector>

#include "fem/aligned.hpp"
#include "fem/hex_mesh.hpp"
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
  double largest_strain = 0;           // principal, magnitude
  bool grew = false;
};

class DamageField {
 public:
  DamageField(const HexMesh& mesh, const material::ConcreteDamage::Parameters& p, bool finite);

  double elastic_bound() const { return law_.elastic_bound(); }
  bool has(int cell) const { return slot_[cell] >= 0; }
  const std::vector<int>& cells() const { return cells_; }

  /// Evaluates a cell that has no history; if damage would start, it joins with its force added to f, and true is returned.
  bool try_cell(int cell, const double* u, const double* v, double* f);
  /// Adds the forces of all cells that were in before; results are kept for accept().
  void add_forces(const double* u, const double* v, double* f);
  void accept();
  /// Cells to erode by the last evaluation: a strain (Frobenius norm) above `limit`, or all points at the cap and one above
  /// `open_limit`; `kept` cells (hosts of bars that hold) only by the first.
  std::vector<int> spent(double limit, double open_limit, const std::vector<char>& kept) const;
  void remove(int cell);

  double stored() const;               // of the last evaluation [J]
  double dissipation() const;          // of the last evaluation, since the last accepted states [J]
  double stored(int cell) const { return result_[slot_[cell]].energy; }
  /// Largest and mean damage over the points of a cell, accepted states; zero without history.
  double tension(int cell) const;
  double tension_least(int cell) const;
  double compression(int cell) const;
  double largest() const;

  void save(std::vector<double>& state) const;
  std::size_t restore(std::span<const double> state);

 private:
  LawResult evaluate(const LawGeometry& g, const double* u, const double* v, const material::DamageCell& old, material::DamageCell& next,
                     double* f) const;
  const HexMesh* mesh_;
  material::ConcreteDamage law_;
  double cap_;
  bool finite_;
  std::vector<int> slot_;              // per cell, -1: no history
  std::vector<int> cells_;             // in the order of joining
  std::vector<LawGeometry> geometry_;
  std::vector<material::DamageCell> old_, next_;
  std::vector<LawResult> result_;
};

}  // namespace talus::fem

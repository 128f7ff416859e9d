/// Bearings between decks and cap beams: each pad is a set of springs between nodes of the deck and points of the cap.
///
/// The law of one spring (unilateral, friction, seat) is material::Bearing; a pad's stiffness is shared evenly by its springs.
#pragma once
#include <vector>

#include "fem/hex_mesh.hpp"
#include "fem/linear_system.hpp"
#include "fem/material_steel.hpp"
#include "fem/viaduct.hpp"

namespace talus::fem {

class Bearings {
 public:
  struct Site {
    int deck, end;                   // which span, which end of it
    int deck_node, deck_cell, cap_cell;
    std::array<int, 8> cap_node;
    std::array<double, 8> weight;
  };
  Bearings(const StructureSpec& spec, const HexMesh& mesh, const ViaductPlan& plan);

  void add_forces(const double* u, const std::vector<char>& live, double* f);
  void accept() { old_ = next_; }
  double stored() const { return energy_; }
  /// Energy, by the last evaluation, of the springs at any of these cells, as long as both of a spring's cells are there [J].
  double stored_at(const std::vector<int>& cells, const std::vector<char>& live) const;
  double dissipation() const { return dissipation_; }
  const std::vector<Site>& sites() const { return sites_; }
  /// All nodes that springs act on.
  std::vector<int> nodes() const;
  bool holds(std::size_t site) const { return old_[site].lost == 0; }
  /// Linear springs for the stiffness matrix.
  std::vector<Spring> springs() const;
  void save(std::vector<double>& state) const;
  std::size_t restore(std::span<const double> state);

 private:
  std::vector<Site> sites_;
  std::vector<material::Bearing> law_;   // per site
  std::vector<material::Bearing::State> old_, next_;
  std::vector<double> site_energy_;
  Vec3 along_, across_, up_;
  double energy_ = 0, dissipation_ = 0;
};

}  // namespace talus::fem

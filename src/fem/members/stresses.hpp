/// Strains at the middles of cells, where they are most accurate, and where elastic concrete is stretched or
/// pressed beyond its strength at the points of cells where the laws are evaluated.
///
///   H = sum_a u_a (x) grad N_a,   E = (H + H^T)/2 + H^T H/2 (the last where rotations may be large)
///
/// At the outer points of n cells across a beam stands 1 - 0.42/n of the stress at its edge; at their middles
/// 1 - 1/n, with which three cells would hide what is half as much again as the strength.
#pragma once
#include "fem/integrators/nodal_fields.hpp"
#include "fem/structure_body.hpp"

namespace talus::fem {

class Stresses {
 public:
  Stresses(const StructureBody& body, const NodalFields& fields) : body_(body), fields_(fields) {}

  Mat3 gradient(int cell) const;  // H
  Mat3 strain(int cell) const;    // E
  /// Where the greatest of a quantity is, in words, of the ranks' own greatest ones and their cells.
  std::string place_of_most(double most, int cell) const;
  void warn_of_cracks() const;
  /// Greatest tension and compression at t [s].
  std::array<StressPeak, 2> peaks(double t);
  std::size_t memory_consumption() const { return shortest_edge_.capacity() * sizeof(double); }

 private:
  /// Of a stress: the volume in which it is beyond a strength, and its greatest value.
  struct Beyond {
    double strength = 0, volume = 0, most = 0;  // [Pa], [m^3], [Pa]
    int worst = -1;                             // cell
    void look(double stress, double of, int cell) {
      if (stress > strength) volume += of;
      if (stress > most) most = stress, worst = cell;
    }
  };
  void look(int cell, Beyond& tension, Beyond& compression) const;
  std::array<double, 5> middle_of_most(double value, double most, int cell) const;

  const StructureBody& body_;
  const NodalFields& fields_;
  std::vector<double> shortest_edge_;  // thickness of each cell, once it was asked for [m]
};

}  // namespace talus::fem

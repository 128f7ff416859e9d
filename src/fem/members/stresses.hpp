/// Strains at the middles of cells, where they are most accurate, and where elastic concrete is stretched or
/// pressed beyond its strength.
///
///   H = sum_a u_a (x) grad N_a,   E = (H + H^T)/2 + H^T H/2 (the last where rotations may be large)
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
  Vec3 principal(int cell) const;
  std::array<double, 5> middle_of_most(double value, double most, int cell) const;

  const StructureBody& body_;
  const NodalFields& fields_;
  std::vector<double> shortest_edge_;  // thickness of each cell, once it was asked for [m]
};

}  // namespace talus::fem

/// The permanent load, which comes slowly: the structure is in balance with it before the run begins,
///
///   f_int(u) = m g,   v = 0
///
/// first elastic, then with what it cracks. What varies in time is dynamics.
#pragma once
#include "fem/integrators/moving_structure.hpp"

namespace talus::fem {

class PermanentLoad : protected MovingStructure {
 public:
  explicit PermanentLoad(const MovingStructure& structure) : MovingStructure(structure) {}

  /// Brings the structure to rest under it; where there is no such state, that is reported.
  void apply();
  /// Remembers the state at rest, for a mesh whose cells may be halved later.
  void keep();
  /// The greatest loads of a coarser mesh, which were counted from its state at rest, count from this one.
  void shift_peaks(const PermanentLoad& coarser);

  AlignedVector u;    // at rest; empty unless kept [m]
  double energy = 0;  // elastic and of gravity [J]

 private:
  VecX at_free(const AlignedVector& field) const;
  double product_of(const VecX& a, const VecX& b) const;
  bool find_elastic(const VecX& left, double pressed);
  long cracked_cells() const;
  bool find_cracked(bool balanced, double pressed);
  void warn() const;

  std::vector<double> reaction_;
  std::vector<std::array<double, 2>> drift_;
};

}  // namespace talus::fem

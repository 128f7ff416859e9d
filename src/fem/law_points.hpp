/// Strains at the eight points of a cell (assumed_strain.hpp) and the nodal forces of stresses there, shared by all laws (equations: damage_field.hpp).
/// Components in the order of the laws: xx yy zz yz zx xy, shears engineering; arrays [component][point].
#pragma once
#include "fem/damage_field.hpp"

namespace talus::fem {

struct PointStrains {
  alignas(64) double strain[6][8];
  alignas(64) double rate[6][8];   // only with velocities
  double displacement_gradient[9][8];  // row = component of u
};

/// v may be null: no rates.
void point_strains(const LawGeometry& g, const double* u, const double* v, bool finite, PointStrains& out);

/// The strains at u - step v, v the velocities that `at` belongs to.
void strains_before(const LawGeometry& g, const PointStrains& at, const double* v, double step, bool finite, double (&before)[6][8]);

/// force[24] of the stresses, each of an eighth of the volume.
void nodal_force(const LawGeometry& g, const PointStrains& at, const double (*stress)[8], bool finite, double* force);

/// Greatest Frobenius norm of the strain over the points.
double largest_strain(const PointStrains& at);

}  // namespace talus::fem

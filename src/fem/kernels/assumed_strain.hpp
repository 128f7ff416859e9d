/// Strains of a trilinear hexahedron that bends without locking in one layer, also where it leans.
///
/// The strains that the displacements give at the eight points are expanded in functions of the reference
/// coordinates,
///
///   eps(q) = mean + sum_k E_k phi_k(q),   phi: xi_d, xi_a xi_b (a, b != d) at the points, +-1
///                                         (xi eta zeta is left out)
///
/// and each E_k is replaced by the strain that differs from it by what incompatible displacements could add,
/// and whose stress on the faces that the function grows towards vanishes:
///
///   xi_d       sigma n = 0:  E' = E - (q n + n q) + (n.q - nu tr E) / (1 - nu) n n,   q = E n
///   xi_a xi_b  uniaxial:     E' = (t.E t) ((1 + nu) t t - nu I)
///   n: unit normal of the faces xi_d = const; t: unit vector along the edges xi_d
///
/// n and t are those of the Jacobian at the centre. In a parallelepiped this is the element of [wilson1973,
/// taylor1976] with its internal unknowns eliminated in closed form; in a brick it is bending of a beam and
/// of a plate, whatever its lengths, and twist; dilatation does not lock. The mean is weighted by the volume,
/// the rest is counted alike at the eight points: a linear displacement has no rest, so that a patch of
/// distorted cells strains evenly. Green-Lagrange strains go the same way, and forces stay the derivative of
/// an energy. Where concrete is cracked the strains that Poisson's effect adds, those with nu above, count (1
/// - d) at each point: on the open side of a cell that hinges there is none, on the pressed side all of it.
/// The points are kept for the laws; [belytschko1993] uses the same strains to stabilise one point.
///
/// law_points.hpp applies them and their transpose for the laws, kernel.hpp for elastic cells.
#pragma once
#include "core/types.hpp"
#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

using ElementMatrix = Eigen::Matrix<double, 24, 24>;

struct AssumedStrain {
  alignas(64) double weight[8];        // of the mean, sum 1
  alignas(64) double direction[3][8];  // of the function whose bits (xi, eta, zeta) are the second index: n
                                       // of 1, 2, 4; t of 6, 5, 3; 0 of 0 and 7
  alignas(
      64) double lateral[8];  // share of the strains by Poisson's effect at the points, 1 in sound concrete
  double poisson;
  bool oblique, even;  // the directions are not those of the axes; the weights are all 1/8

  AssumedStrain() = default;
  AssumedStrain(const HexMesh& mesh, int cell, double poisson);
};

/// Unit normals n of the faces (columns), and unit vectors t along the edges, of the Jacobian at the centre;
/// exactly 1 where they differ from the axes by rounding.
struct CellDirections {
  Mat3 normal, edge;
};
CellDirections cell_directions(const HexMesh& mesh, int cell);

/// Whether two cells have the same stiffness: one is the other, shifted.
bool same_shape(const HexMesh& mesh, int a, int b);

/// Stiffness of an elastic cell, node by node xyz [N/m].
ElementMatrix element_stiffness(const HexMesh& mesh, int cell, double shear, double bulk);

}  // namespace talus::fem

/// Strains of a trilinear hexahedron that bends as it should, in one layer too.
///
/// The strains that the displacements give at the eight points are taken apart into functions of the reference coordinates, in the cell's own axes R:
///
///   eps(q) = mean + sum_k E_k phi_k(q),   phi: xi, eta, zeta, eta zeta, zeta xi, xi eta at the points, +-1
///   xi            keeps yy, zz and yz;   xx = -nu/(1-nu) (yy + zz),   xy = zx = 0
///   eta zeta      keeps xx;              yy = zz = -nu xx,            no shears
///   (xi eta zeta  goes)
///
/// and so on around. What trilinear displacements cannot give to a function takes the value at which its stress vanishes; what they give to it in bending, a shear that is not
/// there, goes. For a brick this is bending of a beam and of a plate in closed form, whatever its lengths, and twist; dilatation does not lock. The mean is weighted by the volume, the rest is
/// counted alike at the eight points: a linear displacement has no rest, so that a patch of distorted cells strains evenly. Green-Lagrange strains go the same way, and forces stay the
/// derivative of an energy. After [belytschko1993], whose stabilisation of one point this is, with the points kept for the laws.
///
/// law_points.hpp applies them and their transpose for the laws, kernel.hpp for elastic cells.
#pragma once
#include "core/types.hpp"
#include "fem/hex_mesh.hpp"

namespace talus::fem {

using ElementMatrix = Eigen::Matrix<double, 24, 24>;

struct AssumedStrain {
  double weight[8];      // of the mean, sum 1
  double axes[9];        // R, row major
  double poisson;
  bool turned, even;     // R is not 1; the weights are all 1/8

  AssumedStrain() = default;
  AssumedStrain(const HexMesh& mesh, int cell, double poisson);
};

/// Stiffness of an elastic cell, node by node xyz [N/m].
ElementMatrix element_stiffness(const HexMesh& mesh, int cell, double shear, double bulk);

}  // namespace talus::fem

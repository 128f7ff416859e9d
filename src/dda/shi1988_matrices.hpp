/// Matrices of one block in the paper's order, all in world axes.
///
///   T(x) = [ I | -[x^]_x | strain columns ],  x^ = x - c                                        Eq. (3)
///   M = integral rho T^T T dV = m T_0^T T_0 + sum_kl S_kl T_k^T T_l,   T = T_0 + sum_k x^_k T_k
///   Eq. (4): x^' = (I + E(eps) + C(r)) x^,
///     C = [cos ry + cos rz - 2, -sin rz, sin ry; sin rz, cos rx + cos rz - 2, -sin rx;
///          -sin ry, sin rx, cos rx + cos ry - 2]
///
/// symbol   meaning                                        unit     shape
/// S        second moment of mass about c, world axes      kg m^2   3 x 3
/// r, eps   rotation and strain increments of a step       rad, 1   3, 6
///
/// T is linear in x^, so M needs no more than mass and second moment, which the polyhedral (simplex)
/// integration gives exactly [shi2001]. Eq. (3) as printed has lost its shear columns; they are half the
/// engineering shear on each side.
#pragma once
#include "core/types.hpp"

namespace talus::dda::shi1988 {

using Mat3x12 = Eigen::Matrix<double, 3, 12>;
using Mat12x3 = Eigen::Matrix<double, 12, 3>;

/// T at x^ = x - c.
Mat3x12 transformation(const Vec3& x_hat);

/// M from mass [kg] and second moment of mass about the centroid, world axes [kg m^2].
Mat12 mass_matrix(double mass, const Mat3& second_moment);

/// C(r) of Eq. (4).
Mat3 post_correction(const Vec3& r);

/// Map of one step of the vertices, x^' = G x^; without `corrected` the first-order G = I + [r]_x + E(eps).
Mat3 step_map(const Vec3& r, const Vec6& eps, bool corrected);

/// Rotation nearest to A (polar decomposition A = R U). A must have a positive determinant.
Mat3 polar_rotation(const Mat3& A);

/// Components of a strain vector (engineering shears) after a change of axes: tensor Q E Q^T.
Vec6 rotate_strain(const Vec6& e, const Mat3& Q);

/// Strain energy per volume of an isotropic stress state [J/m^3].
double energy_density(const Vec6& stress, double young, double poisson);

}  // namespace talus::dda::shi1988

/// The element of the kernels by deal.II: FEValues, its own mapping and quadrature, assembled through
/// AffineConstraints on the DoFHandler of a Discretisation. Small strains.
///
/// Where the kernels take an assumed strain from a formula (assumed_strain.hpp), this one minimises the
/// energy over incompatible modes that open the faces of a cell, all at once and by static condensation
/// [wilson1973, taylor1976]:
///
///   W(u) = min over a of  V/8 sum_q 1/2 e_q : C : e_q
///   e_q = <eps(u)> + sum_k phi_k(q) (eps_k(u) + sum_m a_km G_m)
///   K = K_uu - K_ua K_aa^+ K_au
///
///   phi_k          xi, eta, zeta, xi eta, eta zeta, zeta xi
///   eps_k, <eps>   the part of the strains along phi_k, their mean by volume
///   G_m            sym(e_i (x) n_d) for the reference coordinates d that phi_k holds
///   n_d            normals at the centre
#pragma once
#include <vector>

#include "fem/discretisation/discretisation.hpp"

namespace talus::fem {

/// C^T K C u; u and the result hold three values per node [m], [N].
std::vector<double> reference_internal_force(const Discretisation& cells, double shear, double bulk,
                                             const std::vector<double>& u);

/// Row sums of the consistent mass, integral of rho N_a, per node [kg].
std::vector<double> reference_masses(const Discretisation& cells, double density);

}  // namespace talus::fem

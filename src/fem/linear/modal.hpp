/// Natural modes of the supported elastic structure, and their motion, exact in time.
///
///   K phi = omega^2 M phi,  phi_i^T M phi_j = delta_ij    shift-invert block Lanczos with full
///                                                         reorthogonalisation [parlett1998]
///   q'' + alpha q' + omega^2 q = p + s t                  closed form over each piece of the load's table
///   u = u_g + sum_l c_l r_l + Phi q,   r_l = K^-1 P_l - Phi Omega^-2 Phi^T P_l
///
/// r_l is the static answer of all modes left out to load l, so that a local load is not blurred by the
/// truncation.
///
/// symbol    meaning                                          unit     shape
/// omega     circular frequency, ascending                    rad/s    m
/// phi       modes on the free degrees of freedom             kg^-1/2  n x m
/// u_g       static displacement under gravity                m        n
/// P, c      load patterns and their factors in time          N, 1     n x l, l
#pragma once
#include "fem/linear/linear_system.hpp"
#include "fem/setup.hpp"

namespace talus::fem {

struct ModalBasis {
  VecX omega;
  MatX phi;
};

/// What `lowest_modes` holds at most while it looks for `count` modes of n degrees of freedom, beside these
/// [bytes].
double memory_of_search(int n, int count);

/// Vectors of the basis in which `count` modes of n degrees of freedom are sought, at most.
int largest_basis(int n, int count);

/// The `count` lowest modes (fewer if the system is smaller). mass: lumped, per free degree of freedom. A
/// basis that has grown to `largest` vectors (0: largest_basis; else at least count + 18) starts again from
/// those it has for the modes (thick restart [wu2000]).
ModalBasis lowest_modes(const CholeskyFactor& factor, const VecX& mass, int count, int largest = 0);

/// One mode over a time h under p + s t; q and rate are replaced. Returns the integral of q over h.
double advance_mode(double omega, double alpha, double p, double s, double h, double& q, double& rate);

}  // namespace talus::fem

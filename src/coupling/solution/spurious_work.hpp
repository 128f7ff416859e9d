/// Spurious work: what the residual of a contact problem does to bodies in motion, beyond Coulomb's law.
///
///   W = sum p_n |u_n| + max(0, p_t . u_t)   over contacts of what moves
///     + sum |p . u_R|                       where it meets what rests
///
/// What rests are the slowest bodies, all together of no more than a given kinetic energy. What residuals do
/// among them stays with them or goes through those contacts, at the velocity u_R that they have there: loads
/// of a thousand tonnes that sink by 1e-5 m/s drive nothing unless something above them moves on it. The sum
/// over all contacts is a bound, too; the less of both counts.
///
/// symbol   meaning                                            unit
/// p, u     impulse and velocity of a contact                  N s, m/s
/// u_R      part of u by the bodies at rest                    m/s
#pragma once
#include "contact/solver/problem.hpp"

namespace talus::coupling {

/// `at_rest`: kinetic energy of what counts as at rest, at most [J]. [J]
double spurious_work(const contact::ContactProblem& problem, double at_rest);

}  // namespace talus::coupling

/// Rolling and drilling resistance: couples about the tangents and about the normal of a contact.
///
///   |m_t| <= mu_r R p_n   m_t opposite to the rolling velocity (w_b - w_a)_t
///   |m_n| <= mu_d R p_n   m_n opposite to the drilling velocity (w_b - w_a)_n
///   |m_t| <= d p_n        of a face that bounces on springs, p_n over the face
///
/// R: equivalent radius, of two blocks R_a R_b / (R_a + R_b). d = 0.1 accuracy L: the part of the block size
/// that the place of the face's force is not known to.
#pragma once
#include <functional>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// R: of a block at what is fixed its equivalent radius, of two blocks half of their harmonic mean [m].
double rolling_arm(const IslandContext& in, const Touch& t);

/// The couples of all touches that resist rolling or drilling, after the rows of all touches, one for those
/// of a pair with the same normal; bounded by nothing yet.
void add_rolling_rows(const IslandContext& in, Step& step);

/// A couple for each pair whose springs press on a face and carry more motion than the accuracy may lose,
/// after all other rows: its work is the scheme's, as that of fixed points. Its bound goes by the impulses of
/// the pass before, of a contact that begins by what comes.
void add_rocking_rows(const IslandContext& in, Step& step, double h, bool first_pass);

/// Bounds the rolling rows by the normal impulses [N s] that `pressed` tells; by how much that changed them,
/// over what they are.
double limit_rolling(Step& step, const std::function<double(const Touch&)>& pressed);

}  // namespace talus::coupling

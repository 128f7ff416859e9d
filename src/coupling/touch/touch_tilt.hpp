/// How far apart the points are on which a part of a bed stands, so that tilting it meets what its columns
/// give.
#pragma once
#include <array>

#include "contact/skin/skin_bed.hpp"
#include "core/types.hpp"

namespace talus::coupling {

/// Offsets from the centre of pressure p, across the normal n, of four points that share the tangent
/// stiffness of the columns [m]:
///
///   1/4 sum_i r_i r_i^T = int k (x - p)(x - p)^T dA / int k dA
///   over what is pressed and does not yield (`limit`: compression at which it does [m])
///
/// All zero if nothing is.
std::array<Vec3, 4> tilt_points(const contact::Footprint& part, const Vec3& p, const Vec3& n, double limit);

}  // namespace talus::coupling

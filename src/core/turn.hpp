/// The turn of one direction onto another.
#pragma once
#include "core/types.hpp"

namespace talus {

/// The turn by the least angle that takes the direction of a to that of b, neither of them zero. With both of
/// length one q = (1 + a.b, a x b) / |.|, of half the angle between them; of opposite directions it is half a
/// turn about some axis across a. Eigen's FromTwoVectors finds that axis by a singular value decomposition,
/// which takes seconds to compile in each file.
Quat turn_between(const Vec3& a, const Vec3& b);

}  // namespace talus

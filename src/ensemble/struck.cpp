#include "ensemble/struck.hpp"

#include <algorithm>
#include <limits>

namespace talus::ensemble {

int struck_by(const Vec3& point, const std::vector<talus::Member>& members) {
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Vec3 axis = members[k].axis_x.cross(members[k].axis_y).normalized();
    const Vec3 from = point - members[k].base, x = members[k].axis_x, y = members[k].axis_y;
    const Vec3 inside =
        std::clamp(from.dot(axis), 0.0, members[k].length) * axis +
        std::clamp(from.dot(x), -0.5 * members[k].section[0], 0.5 * members[k].section[0]) * x +
        std::clamp(from.dot(y), -0.5 * members[k].section[1], 0.5 * members[k].section[1]) * y;
    if (const double d = (from - inside).norm(); d < least) least = d, best = static_cast<int>(k);
  }
  return best;
}

}  // namespace talus::ensemble

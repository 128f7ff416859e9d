// What of a system rests, and what has left it.
#include <algorithm>
#include <limits>

#include "coupling/system/system.hpp"

namespace talus::coupling {

int sleeping_blocks(const CoupledSystem& system) {
  return static_cast<int>(std::count(system.state().asleep.begin(), system.state().asleep.end(), 1));
}

bool at_rest(const CoupledSystem& system) {
  const std::vector<int> gone = departed(system);
  for (std::size_t i = 0; i < system.model().blocks.size(); ++i)
    if (system.model().blocks[i].ndof() > 0 && system.state().asleep[i] == 0 &&
        !std::binary_search(gone.begin(), gone.end(), static_cast<int>(i)))
      return false;
  for (const StructurePart& s : system.environment().structures)
    if (s.stepped() && !s.structure->quiet()) return false;
  return true;
}

std::vector<int> departed(const CoupledSystem& system) {
  std::vector<int> gone;
  if (system.model().gravity.isZero(0) || !system.environment().planes.empty()) return gone;
  const Vec3 up = -system.model().gravity.normalized();
  double lowest = std::numeric_limits<double>::infinity();
  const auto hold = [&](const Box3& box) {
    for (int corner = 0; corner < 8; ++corner)
      lowest = std::min(lowest, up.dot(box.corner(static_cast<Box3::CornerType>(corner))));
  };
  if (system.environment().terrain) hold(system.environment().terrain->bounds());
  for (const StructurePart& s : system.environment().structures) hold(s.index->bounds());
  for (std::size_t i = 0; i < system.model().blocks.size(); ++i)
    if (system.model().blocks[i].ndof() == 0)
      lowest = std::min(lowest, up.dot(system.state().blocks.c[i]) - system.model().blocks[i].shape->radius);
  if (!std::isfinite(lowest)) return gone;
  std::vector<char> hangs(system.model().blocks.size(), 0);  // by a bond, on whatever it may be
  for (std::size_t i = 0; i < system.state().contacts.size(); ++i)
    for (const ContactMemory& m : system.state().contacts[i]) {
      if (!m.glued) continue;
      hangs[i] = 1;
      if (static_cast<Partner::Kind>(m.partner >> 32) == Partner::Kind::block)
        hangs[m.partner & 0xffffffff] = 1;
    }
  for (std::size_t i = 0; i < system.model().blocks.size(); ++i)
    if (system.model().blocks[i].ndof() > 0 && hangs[i] == 0 &&
        system.model().blocks[i].fixed_points.empty() &&
        up.dot(system.state().blocks.c[i]) + 2 * system.model().blocks[i].shape->radius < lowest)
      gone.push_back(static_cast<int>(i));
  return gone;
}

}  // namespace talus::coupling


#include "coupling/step/context.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::coupling {

void IslandContext::begin(const Island& of) {
  for (const int b : placed) local[static_cast<std::size_t>(b)] = -1;
  placed = of.blocks;
  island = &of;
  time_stepping = condensed = false;  // or the search would depend on the island before
  unsolved = 0;
  local.resize(model.blocks.size(), -1);
  double& length = scale.length;
  double& speed = scale.speed;
  length = std::numeric_limits<double>::infinity();
  speed = 0;
  MassLength mass_length;
  for (std::size_t i = 0; i < of.blocks.size(); ++i) {
    const auto k = static_cast<std::size_t>(of.blocks[i]);
    local[k] = static_cast<int>(i);
    const double radius = model.blocks[k].shape->radius;
    length = std::min(length, radius);
    mass_length.add(model.blocks[k].mass, radius);
    speed = std::max(
        {speed, state.v[k].norm() + radius * state.w[k].norm(), std::sqrt(model.gravity.norm() * radius)});
  }
  if (of.blocks.empty())
    for (const int s : of.structures) {
      length = std::min(length, face_edge(surface(s)));
      for (const Vec3& v : surface(s).velocities) speed = std::max(speed, v.norm());
    }
  if (!(speed > 0)) speed = 1;
  scale.mass_length = of.blocks.empty() ? length : mass_length.value();
}

double IslandContext::fastest_surface() const {
  double fastest = 0;
  for (const int s : island->structures)
    for (const Vec3& v : surface(s).velocities) fastest = std::max(fastest, v.squaredNorm());
  return std::sqrt(fastest);
}

double IslandContext::gentle_speed() const {
  const contact::Tolerances& tol = contact::tolerances();
  return std::max(std::sqrt(2 * tol.gentle_height * settings.accuracy * model.gravity.norm() * scale.length),
                  tol.gentle_speed * settings.accuracy * scale.speed);
}

}  // namespace talus::coupling

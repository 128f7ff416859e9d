#include "coupling/moved_moments.hpp"

#include <algorithm>

namespace talus::coupling {

std::vector<Vec3> moved_moments(std::span<const MovedBody> bodies, std::span<const MovedPair> pairs) {
  constexpr double most = 4;   // of an impulse, over what was moved: wedges ask for more than their own
  double moved = 0, mass = 0;
  Vec3 momentum = Vec3::Zero();
  for (const MovedBody& b : bodies) {
    moved += b.mass * b.way.norm();
    mass += b.mass;
    momentum += b.mass * b.velocity;
  }
  std::vector<Vec3> moments(bodies.size(), Vec3::Zero());
  if (std::any_of(pairs.begin(), pairs.end(), [&](const MovedPair& p) { return p.impulse.norm() > most * moved; })) {
    for (std::size_t i = 0; i < bodies.size(); ++i) moments[i] = bodies[i].mass * bodies[i].way.cross(bodies[i].velocity - momentum / mass);
    return moments;
  }
  for (const MovedPair& p : pairs) {
    const auto a = static_cast<std::size_t>(p.a), b = static_cast<std::size_t>(p.b);
    const Vec3 gained = p.impulse.cross(bodies[b].velocity - bodies[a].velocity);
    const double share = bodies[b].inertia / (bodies[a].inertia + bodies[b].inertia);
    moments[b] += share * gained;
    moments[a] += (1 - share) * gained;
  }
  return moments;
}

}  // namespace talus::coupling

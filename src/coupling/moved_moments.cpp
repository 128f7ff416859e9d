#include "coupling/moved_moments.hpp"

#include <cstddef>
#include <numeric>
#include <utility>

namespace talus::coupling {

std::vector<Vec3> keep_momenta(std::span<MovedBody> bodies, std::span<const MovedPair> pairs) {
  const std::size_t fixed = bodies.size();   // the last member of `to`
  std::vector<std::size_t> to(fixed + 1);    // towards the body that stands for its cluster
  std::iota(to.begin(), to.end(), std::size_t{0});
  const auto cluster_of = [&](std::size_t i) {
    while (to[i] != i) i = to[i] = to[to[i]];
    return i;
  };
  const auto join = [&](std::size_t i, std::size_t k) { to[cluster_of(i)] = cluster_of(k); };
  for (const MovedPair& p : pairs) join(static_cast<std::size_t>(p.b), p.a < 0 ? fixed : static_cast<std::size_t>(p.a));
  for (std::size_t i = 0; i < fixed; ++i)
    if (bodies[i].held) join(i, fixed);

  struct Mean { double mass = 0; Vec3 way = Vec3::Zero(), velocity = Vec3::Zero(); };
  std::vector<Mean> means(fixed + 1);
  for (std::size_t i = 0; i < fixed; ++i) {
    Mean& m = means[cluster_of(i)];
    m.mass += bodies[i].mass;
    m.way += bodies[i].mass * bodies[i].way;
    m.velocity += bodies[i].mass * bodies[i].velocity;
  }
  std::vector<Vec3> moments(fixed, Vec3::Zero());
  for (std::size_t i = 0; i < fixed; ++i) {
    const std::size_t cluster = cluster_of(i);
    if (cluster == cluster_of(fixed)) continue;
    const Mean& m = means[cluster];
    bodies[i].way -= m.way / m.mass;
    moments[i] = bodies[i].mass * bodies[i].way.cross(bodies[i].velocity - m.velocity / m.mass);
  }
  return moments;
}

}  // namespace talus::coupling

#include "coupling/drift/moved_moments.hpp"

#include <cstddef>

#include "core/disjoint_sets.hpp"

namespace talus::coupling {

std::vector<Vec3> keep_momenta(std::span<MovedBody> bodies, std::span<const MovedPair> pairs) {
  const std::size_t fixed = bodies.size();  // stands for all that is
  const int at_fixed = static_cast<int>(fixed);
  DisjointSets clusters(at_fixed + 1);
  for (const MovedPair& p : pairs)
    if (p.a != MovedPair::free_structure) clusters.join(p.b, p.a < 0 ? at_fixed : p.a);
  for (int i = 0; i < at_fixed; ++i)
    if (bodies[static_cast<std::size_t>(i)].held) clusters.join(i, at_fixed);
  const auto cluster_of = [&](std::size_t i) {
    return static_cast<std::size_t>(clusters.root(static_cast<int>(i)));
  };

  struct Mean {
    double mass = 0;
    Vec3 way = Vec3::Zero(), velocity = Vec3::Zero();
  };
  std::vector<Mean> means(fixed + 1);
  for (std::size_t i = 0; i < fixed; ++i) {
    Mean& m = means[cluster_of(i)];
    m.mass += bodies[i].mass;
    m.way += bodies[i].mass * bodies[i].way;
    m.velocity += bodies[i].mass * bodies[i].velocity;
  }
  for (const MovedPair& p : pairs)
    if (p.a == MovedPair::free_structure) {
      Mean& m = means[cluster_of(static_cast<std::size_t>(p.b))];
      m.way = m.velocity = Vec3::Zero();
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

#include "contact/geometry/shape_pool.hpp"

#include <functional>

namespace talus {
namespace {

std::size_t hash(const Polyhedron& shape) {
  std::size_t seed = shape.triangles.size();
  for (const Vec3& x : shape.vertices)
    for (const double d : x) seed = 31 * seed + std::hash<double>{}(d);  // 0 and -0 alike, as they are equal
  return seed;
}

}  // namespace

std::shared_ptr<const Polyhedron> ShapePool::share(Polyhedron shape) {
  const std::size_t key = hash(shape);
  const auto [first, last] = by_hash_.equal_range(key);
  for (auto it = first; it != last; ++it)
    if (*it->second == shape) return it->second;
  return by_hash_.emplace(key, std::make_shared<const Polyhedron>(std::move(shape)))->second;
}

}  // namespace talus

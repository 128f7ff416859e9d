/// Shapes that blocks share: hundreds of blocks of one shape are searched in the memory of one.
#pragma once
#include <cstddef>
#include <memory>
#include <unordered_map>

#include "contact/geometry/polyhedron.hpp"

namespace talus {

class ShapePool {
 public:
  /// The first shape given that equals this one in every vertex and face.
  std::shared_ptr<const Polyhedron> share(Polyhedron shape);

 private:
  std::unordered_multimap<std::size_t, std::shared_ptr<const Polyhedron>> by_hash_;
};

}  // namespace talus

/// The section of a round pier, by deal.II's GridGenerator.
#pragma once
#include <array>
#include <vector>

namespace talus::fem {

/// A disc of diameter 1 about the origin: five blocks refined `levels` times, quadrilaterals
/// counter-clockwise.
struct DiscMesh {
  std::vector<std::array<double, 2>> nodes;
  std::vector<std::array<int, 4>> quads;
};
DiscMesh disc_mesh(int levels);

}  // namespace talus::fem

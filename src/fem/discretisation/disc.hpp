/// The section of a round pier.
#pragma once
#include <array>
#include <vector>

#include "core/round_section.hpp"

namespace talus::fem {

/// A disc about the origin, quadrilaterals counter-clockwise. Its border is a regular polygon with the area
/// of a circle of radius 1, its corners on one circle; inscribed, one of twenty sides would have 1.6 % less
/// area and 3.3 % less stiffness in bending. By that area the second moment is the circle's times
/// (theta / sin theta)(2 + cos theta) / 3, theta = 2 pi / sides: 1.0023 for eight, 1.00006 for twenty.
struct DiscMesh {
  std::vector<std::array<double, 2>> nodes;
  std::vector<std::array<int, 4>> quads;
  std::vector<int> rim;  // its nodes, counter-clockwise from -45 degrees
};
DiscMesh disc_mesh(const RoundSection& section);

}  // namespace talus::fem

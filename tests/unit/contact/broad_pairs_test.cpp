#include <gtest/gtest.h>

#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

std::vector<std::pair<int, int>> brute(const std::vector<Box3>& boxes) {
  std::vector<std::pair<int, int>> p;
  for (int i = 0; i < static_cast<int>(boxes.size()); ++i)
    for (int j = i + 1; j < static_cast<int>(boxes.size()); ++j)
      if (!boxes[i].isEmpty() && !boxes[j].isEmpty() && boxes[i].intersects(boxes[j])) p.emplace_back(i, j);
  return p;
}

TEST(BroadPhase, AgreesWithAllPairs) {
  std::mt19937 rng(1);
  for (const double spread : {1.0, 5.0, 30.0})
    for (const double longest : {0.1, 1.0, 20.0}) {
      std::uniform_real_distribution<double> at(-spread, spread), size(0, longest);
      std::vector<Box3> boxes;
      for (int i = 0; i < 400; ++i) {
        const Vec3 p(at(rng), at(rng), 0.1 * at(rng));
        boxes.emplace_back(p, p + Vec3(size(rng), size(rng), i % 7 ? size(rng) : 0.0));
      }
      boxes[17].setEmpty();
      boxes[33] = Box3(Vec3::Constant(-1e9), Vec3::Constant(1e9));  // one that covers all
      std::vector<std::pair<int, int>> pairs{{5, 6}};
      overlapping_pairs(boxes, pairs);
      EXPECT_EQ(pairs, brute(boxes));
    }
}

TEST(BroadPhase, TouchingBoxesAreAPair) {
  const std::vector<Box3> boxes{Box3(Vec3(0, 0, 0), Vec3(1, 1, 1)), Box3(Vec3(1, 0, 0), Vec3(2, 1, 1)),
                                Box3(Vec3(2.1, 0, 0), Vec3(3, 1, 1))};
  std::vector<std::pair<int, int>> pairs;
  overlapping_pairs(boxes, pairs);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0], std::pair(0, 1));
}

TEST(BroadPhase, RegularLatticeOfEqualCoordinates) {
  std::vector<Box3> boxes;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 8; ++k) boxes.emplace_back(Vec3(i, j, k), Vec3(i + 1, j + 1, k + 1));
  std::vector<std::pair<int, int>> pairs;
  overlapping_pairs(boxes, pairs);
  EXPECT_EQ(pairs, brute(boxes));
}

}  // namespace
}  // namespace talus::contact::testing

/// Contact points of a block with a surface or another block, as the tests of the local features take them.
#pragma once
#include <gtest/gtest.h>

#include <set>

#include "detect_shapes.hpp"

namespace talus::contact::testing {

inline void check(const std::vector<ContactPoint>& contacts, double margin) {
  std::set<FeatureKey> keys;
  for (const auto& c : contacts) {
    EXPECT_NEAR(c.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(c.gap, c.normal.dot(c.point_b - c.point_a), 1e-9);
    EXPECT_LE(c.gap, margin + 1e-12);
    EXPECT_GE(c.area, 0);
    EXPECT_TRUE(keys.insert(c.key).second) << "a key appears twice";
  }
}

inline std::vector<ContactPoint> on(const SurfaceIndex& s, const Polyhedron& b, const Pose& p,
                                    double margin) {
  std::vector<ContactPoint> out;
  surface_block(s, b, p, margin, out);
  check(out, margin);
  return out;
}

inline std::vector<ContactPoint> between(const Polyhedron& a, const Pose& pa, const Polyhedron& b,
                                         const Pose& pb, double margin) {
  std::vector<ContactPoint> out;
  block_block(a, pa, b, pb, margin, out);
  check(out, margin);
  return out;
}

}  // namespace talus::contact::testing

#include "contact/geometry/shape_pool.hpp"

#include <gtest/gtest.h>

#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

TEST(ShapePool, EqualShapesAreOneInMemory) {
  ShapePool pool;
  const auto first = pool.share(box(1, 2, 3));
  EXPECT_EQ(pool.share(box(1, 2, 3)), first);
  EXPECT_EQ(first->vertices.size(), 8u);
}

TEST(ShapePool, WhatDiffersInAVertexOrAFaceIsNotShared) {
  ShapePool pool;
  const auto first = pool.share(box(1, 2, 3));
  EXPECT_NE(pool.share(box(1, 2, 3 + 1e-15)), first);
  EXPECT_NE(pool.share(box(3, 2, 1)), first);
  Polyhedron cut = box(1, 2, 3);  // the same surface, of which a joint made a face
  cut.face_joint_set.assign(6, -1);
  cut.face_joint_set[2] = 1;
  const auto of_joint = pool.share(cut);
  EXPECT_NE(of_joint, first);
  EXPECT_EQ(of_joint->face_joint_set[2], 1);
  EXPECT_EQ(pool.share(cut), of_joint);
}

}  // namespace
}  // namespace talus::contact::testing

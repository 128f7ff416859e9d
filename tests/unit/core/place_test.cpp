#include "core/place.hpp"

#include <gtest/gtest.h>

using namespace talus;

/// A place 2 km from the origin, or in map coordinates, can be found by what a message says of it.
TEST(Place, IsToldToTheMillimetre) {
  EXPECT_EQ(place_text(Vec3(1234.5678, -0.0001, 5234567.25)), "[1234.568, 0, 5234567.25]");
  EXPECT_EQ(place_text(Vec3(-0.25, 1.0 / 3, 20)), "[-0.25, 0.333, 20]");
}

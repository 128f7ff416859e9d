#include <gtest/gtest.h>

#include "coupling/motion/node_places.hpp"

using talus::coupling::NodePlaces;

TEST(NodePlaces, EveryNodeHasOnePlaceUntilTheListBeginsAnew) {
  NodePlaces places;
  EXPECT_EQ(places.place(1, 7), std::pair(0, true));
  EXPECT_EQ(places.place(0, 7), std::pair(1, true));
  EXPECT_EQ(places.place(1, 7), std::pair(0, false));
  EXPECT_EQ(places.place(1, 900), std::pair(2, true));
  places.clear();
  EXPECT_EQ(places.place(1, 900), std::pair(0, true));
  EXPECT_EQ(places.place(1, 7), std::pair(1, true));
}

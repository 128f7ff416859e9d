// What a message says of contacts.
#include <gtest/gtest.h>

#include "coupling/touch/name_contacts.hpp"

namespace talus::coupling {
namespace {

Touch touch(Partner a, int b, double impulse, int row = 0) {
  Touch t;
  t.a = a;
  t.b = b;
  t.impulse = Vec3(impulse, 0, 0);
  t.row = row;
  return t;
}

TEST(NameContacts, TheMostLoadedPairsComeFirstAndEachOnce) {
  dda::Model model;
  for (const char* name : {"B1", "B2", "B3"}) model.blocks.emplace_back().name = name;
  using Kind = Partner::Kind;
  std::vector<Touch> touches{touch({Kind::plane, 0}, 0, 5), touch({Kind::plane, 0}, 0, 1),
                             touch({Kind::block, 0}, 1, 9), touch({Kind::terrain, 0}, 2, 99, -1)};
  EXPECT_EQ(name_contacts(model, touches),
            "B2 on B1, B1 on plane 1");  // what is listed without a row is no contact
  touches.push_back(touch({Kind::structure, 1}, 2, 7));
  touches.push_back(touch({Kind::terrain, 0}, 2, 2));
  EXPECT_EQ(name_contacts(model, touches), "B2 on B1, B3 on structure 2, B1 on plane 1 and 1 more");
  EXPECT_EQ(name_contacts(model, {}), "");
}

}  // namespace
}  // namespace talus::coupling

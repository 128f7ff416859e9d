// What springs of a pair hold where its features change: those that crush.
#include <gtest/gtest.h>

#include "coupling/springs/spring_carry.hpp"

namespace talus::coupling {
namespace {

constexpr double stiffness = 2e5, yields_at = 0.04, deep = 0.118;  // [N/m], [m]

/// A feature that appears deep inside, as another that held this much vanishes.
struct Appears {
  ContactLaw law;
  CandidatePair pair{{Partner::Kind::plane, 0}, 0};
  std::vector<Touch> touches{1};
  std::vector<ContactMemory> memory{1};
  std::vector<LooseSpring> loose;

  explicit Appears(double held, double crushed = 0) {
    law.kind = ContactLaw::Kind::crushing;
    Touch& t = touches[0];
    t.a = pair.a, t.law = t.normal_law.law = &law;
    t.stiffness = t.normal_law.stiffness = stiffness;
    t.normal_law.limit = stiffness * yields_at;
    t.normal_law.crushed = crushed;
    t.at.key = 2, t.at.gap = -deep, t.at.normal = Vec3::UnitZ();
    ContactMemory& m = memory[0];
    m.partner = pair.a.id(), m.feature = 1, m.normal = Vec3::UnitZ(), m.normal_energy = held,
    m.stiffness = stiffness, m.indentation = 0.03;
    carry_springs(pair, touches, memory, false, loose);
  }
  const contact::NormalLaw& spring() const { return touches[0].normal_law; }
  double depth() const { return -touches[0].at.gap; }
};

}  // namespace

/// As deep as it is, the columns below it were crushed for good by what vanished, but for what that left:
/// nothing is crushed again. With all of its depth to crush anew a block of 244 kJ was booked 493 kJ of it.
TEST(SpringCarry, WhatAppearsDeepInsideIsCrushed) {
  const Appears a(100);
  EXPECT_DOUBLE_EQ(a.depth(), deep);
  EXPECT_NEAR(a.spring().stored(a.depth()), 100, 1e-9);
  EXPECT_NEAR(a.spring().crushing(a.depth()), 0, 1e-9);
  EXPECT_NEAR(a.touches[0].stored, 100, 1e-9);
  EXPECT_TRUE(a.loose.empty());
}

TEST(SpringCarry, WhatItsColumnsDoNotHoldIsSetFree) {
  const double most = 0.5 * stiffness * yields_at * yields_at;
  const Appears a(5000);
  EXPECT_DOUBLE_EQ(a.depth(), deep);
  EXPECT_NEAR(a.spring().stored(a.depth()), most, 1e-9);
  EXPECT_NEAR(a.spring().crushing(a.depth()), 0, 1e-9);
  ASSERT_EQ(a.loose.size(), 1u);
  EXPECT_NEAR(a.loose[0].energy, 5000 - most, 1e-6);
}

TEST(SpringCarry, WhereNothingWasHeldItStartsUnloaded) {
  const Appears a(0);
  EXPECT_DOUBLE_EQ(a.depth(), deep);
  EXPECT_EQ(a.spring().force(a.depth()), 0);
}

}  // namespace talus::coupling

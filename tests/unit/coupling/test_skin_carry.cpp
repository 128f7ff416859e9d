// What springs at a skin that vanish leave to the others of their pair.
#include <gtest/gtest.h>

#include "coupling/springs/skin_carry.hpp"

namespace talus::coupling {
namespace {

constexpr std::uint64_t pier = 7;

struct TwoTouches {
  ContactLaw law;
  std::vector<Touch> touches;
  std::vector<ContactMemory> memory;

  TwoTouches() { law.kind = ContactLaw::Kind::linear, law.friction = 0.5; }
  void pressed(std::uint64_t feature, double depth, double approach, const Vec3& normal = Vec3::UnitX()) {
    Touch& t = touches.emplace_back();
    t.law = t.normal_law.law = &law;
    t.stiffness = t.normal_law.stiffness = 1e6;
    t.shear_stiffness = 1e6;
    t.at.key = t.goes_on_from = feature;
    t.at.normal = normal;
    t.at.gap = -depth;
    t.approach = approach;
    t.shear = Vec3(0, 1e-3, 0);
    t.sheared = 0.5;
    t.stored = 100;
    remember(feature, 99.5, 0.5, normal);
  }
  void remember(std::uint64_t feature, double normal_energy, double shear_energy,
                const Vec3& normal = Vec3::UnitX()) {
    ContactMemory& m = memory.emplace_back();
    m.partner = pier, m.feature = feature, m.normal = normal, m.normal_energy = normal_energy,
    m.shear_energy = shear_energy;
  }
  void leave(double before = 1e-3) {
    leave_to_others(pier, touches, memory, [before](const Touch&) { return before; });
  }
  /// As a half step has it.
  static double energy(const Touch& t, double before) {
    const double last = -t.at.gap + before * t.approach;
    return 0.25e6 * (t.at.gap * t.at.gap + last * last);
  }
};

}  // namespace

TEST(SkinCarry, EnergyGoesToTheOthers) {
  TwoTouches p;
  p.pressed(1, 0.010, -2);
  p.pressed(2, 0.006, 1);
  p.remember(3, 7, 1);
  const double normal = TwoTouches::energy(p.touches[0], 1e-3) + TwoTouches::energy(p.touches[1], 1e-3);
  p.leave();
  EXPECT_NEAR(TwoTouches::energy(p.touches[0], 1e-3) + TwoTouches::energy(p.touches[1], 1e-3), normal + 7,
              1e-9);
  EXPECT_NEAR(p.touches[0].at.gap / p.touches[1].at.gap, 10.0 / 6, 1e-12);  // by one factor
  EXPECT_NEAR(p.touches[0].stored + p.touches[1].stored, 200 + 7 + 1, 1e-9);
  EXPECT_NEAR(p.touches[0].sheared + p.touches[1].sheared, 2, 1e-12);
  EXPECT_NEAR(p.touches[0].shear.y(), 1e-3 * std::sqrt(2), 1e-15);
  EXPECT_NEAR(p.touches[0].offset, p.touches[0].at.gap + 0.010, 1e-15);
}

TEST(SkinCarry, NotToWhatPressesAnotherWay) {
  TwoTouches p;
  p.pressed(1, 0.010, -2, Vec3::UnitZ());
  p.remember(3, 7, 0);
  p.leave();
  EXPECT_EQ(p.touches[0].at.gap, -0.010);
  EXPECT_EQ(p.touches[0].stored, 100);
}

TEST(SkinCarry, NoMoreThanFourTimesAsDeep) {
  TwoTouches p;
  p.pressed(1, 0.001, 0);
  p.remember(3, 1000, 0);
  p.leave();
  EXPECT_DOUBLE_EQ(p.touches[0].at.gap, -0.004);
}

TEST(SkinCarry, WhatGoesOnKeepsItsOwn) {
  TwoTouches p;
  p.pressed(1, 0.010, -2);
  p.leave();
  EXPECT_EQ(p.touches[0].at.gap, -0.010);
  EXPECT_EQ(p.touches[0].offset, 0);
}

}  // namespace talus::coupling

// Restitution that falls with the speed of the approach, e(v) = e_0 / (1 + (v / v_h)^2): exact for one block,
// for many that bounce by themselves, for many in one island, and without any gain of energy.
#include <gtest/gtest.h>

#include <cmath>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double at_rest = 0.8, half_speed = 9.144;  // e_0, v_h [m/s]

/// Speed of the rebound from a normal speed v [m/s].
double rebound_speed(double v) { return at_rest * v / (1 + v * v / (half_speed * half_speed)); }

std::string law(double e0, double vh) {
  return fmt::format("normal_stiffness = \"hard\"\nrestitution = {}\nrestitution_half_speed = {}", e0, vh);
}

/// Cubes in a row, `spacing` from centre to centre, `gap` above a plane without gravity, each at its own
/// speed; rigid.
template <typename Speed>
Outcome row_of_cubes(int cubes, double spacing, double gap, const Speed& speed) {
  SceneText s(Method::by_accuracy(1e-3), 0.05, Vec3::Zero());
  s.material("rock", 2500).plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
  s.interface("rock", "rock", 0, law(at_rest, half_speed));
  for (int i = 0; i < cubes; ++i)
    s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(spacing * i, 0, 0.5 + gap),
          velocity(Vec3(0, 0, -speed(i))));
  return run_scene(s.str());
}

TEST(RestitutionBySpeed, OfOneBlockIsTheLaw) {
  for (const double v : {0.1, 1.0, 5.0, half_speed, 20.0, 50.0}) {
    const Outcome o = row_of_cubes(1, 2, 1e-3, [&](int) { return v; });
    ASSERT_TRUE(o.ok()) << o.result.message;
    const double back = rebound_speed(v);
    EXPECT_NEAR(o.last().velocity[0].z(), back, 1e-10 * v) << v;  // solved to round-off
    EXPECT_NEAR(o.last().ledger.damping_work, 0.5 * 2500 * (v * v - back * back), 1e-9 * 2500 * v * v) << v;
  }
}

/// Each is an island of its own with a speed of its own.
TEST(RestitutionBySpeed, OfManyBlocksApartIsTheLawOfEach) {
  for (const int cubes : {13, 130}) {
    const auto speed = [](int i) { return 1 + 0.25 * i; };
    const Outcome o = row_of_cubes(cubes, 2, 1e-3, speed);
    ASSERT_TRUE(o.ok()) << o.result.message;
    for (int i = 0; i < cubes; ++i)
      EXPECT_NEAR(o.last().velocity[static_cast<std::size_t>(i)].z(), rebound_speed(speed(i)),
                  1e-10 * speed(i))
          << i;
  }
}

/// Side by side they are one island: 13 are solved event by event; 130, with 520 contacts on the plane, are
/// time-stepped, and a step that begins with the contact keeps the restitution.
TEST(RestitutionBySpeed, OfOneIslandIsTheLaw) {
  for (const int cubes : {13, 130}) {
    const double v = 12, allowed = cubes == 13 ? 1e-10 : 1e-5;  // a large island: a hundredth of the accuracy
    const Outcome o = row_of_cubes(cubes, 1, 0, [&](int) { return v; });
    ASSERT_TRUE(o.ok()) << o.result.message;
    for (int i = 0; i < cubes; ++i)
      EXPECT_NEAR(o.last().velocity[static_cast<std::size_t>(i)].z(), rebound_speed(v), allowed * v) << i;
  }
}

/// Contacts of one impact that come on at different speeds have different restitutions, which Newton's law
/// may let gain energy even without friction; none is made.
TEST(RestitutionBySpeed, MakesNoEnergyWhereContactsDiffer) {
  for (const double friction : {0.0, 0.6}) {
    for (const int cubes : {1, 13, 130}) {
      SceneText s(Method::by_accuracy(1e-3), cubes == 130 ? 0.6 : 1.2);
      s.history(1e-3).material("rock", 2500).plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
      s.interface("rock", "rock", friction, law(1, 2));
      for (int i = 0; i < cubes; ++i)
        s.box(fmt::format("B{}", i), Vec3(1, 0.7, 0.5),
              Vec3(1.3 * (i % 12), 1.1 * (i / 12 % 6), 0.8 + 1.2 * (i / 72)),
              velocity(Vec3(0.3 * (i % 3 - 1), 0, -3)) + spin(Vec3(1 + i % 5, 2 - i % 4, 0.5)) +
                  turned(Vec3(0.02 * (i % 7), 0.03 * (i % 3), 0.1 * (i % 2))));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok()) << o.result.message;
      const auto energy = [](const sim::HistoryRow& r) { return r.ledger.kinetic + r.ledger.potential; };
      double most = 0, grown = 0;
      for (std::size_t i = 1; i < o.rows.size(); ++i) {
        most = std::max(most, o.rows[i].ledger.kinetic);
        grown = std::max(grown, energy(o.rows[i]) - energy(o.rows[i - 1]));
      }
      EXPECT_LT(grown, 1e-9 * most) << friction << " " << cubes;  // impacts: 1e-10 of the energy
    }
  }
}

/// A dashpot gives one restitution for all speeds: springs at a structure that deforms refuse the law; hard
/// contacts there do not use restitution at all.
TEST(RestitutionBySpeed, IsRefusedWhereADashpotWouldGiveIt) {
  const auto scene = [](const std::string& stiffness) {
    SceneText s(Method::by_accuracy(1e-3), 1e-3, Vec3::Zero());
    s.material("c", 2400, "young = 30e9\npoisson = 0.2").material("rock", 2500);
    s.interface("rock", "c", 0.5,
                "normal_stiffness = " + stiffness + "\nrestitution = 0.4\nrestitution_half_speed = 9.144");
    s.box("B", Vec3::Ones(), Vec3(0, 0, 3));
    s.raw(
        "[[structure]]\nname = \"slab\"\nkind = \"box\"\nmaterial = \"c\"\nposition = [0.0, 0.0, 0.0]\n"
        "size = [2.0, 2.0, 1.0]\ncells = [2, 2, 1]\nsupport = [\"-z\"]\npreload = \"none\"\n");
    return s.str();
  };
  try {
    run_scene(scene("1e8"));
    FAIL() << "was not refused";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("restitution_half_speed"), std::string::npos) << e.what();
  }
  EXPECT_TRUE(run_scene(scene("\"hard\"")).ok());
}

}  // namespace
}  // namespace talus::verify

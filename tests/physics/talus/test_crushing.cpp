// Contact laws that crush, away from structures: the energy is pressure times the volume that the block has
// come through.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double rock_density = 2500, pressure = 2e6, speed = 3;

std::string crushing(const std::string& stiffness) {
  return "normal_stiffness = \"" + stiffness +
         "\"\ncontact_law = { kind = \"crushing\", pressure = " + number(pressure) + " }";
}

/// A block thrown at the ground by 3 m/s without gravity.
Outcome thrown(SceneText& s, const std::string& stiffness) {
  s.history(2e-4)
      .material("rock", rock_density)
      .interface("rock", "ground", 0, crushing(stiffness))
      .plane(Vec3::UnitZ());
  return run_scene(s.str());
}

double lowest_corner(const Outcome& o) {
  double z = o.rows.front().position[0].z();
  for (const auto& r : o.rows) z = std::min(z, r.position[0].z());
  return z;
}

TEST(Crushing, FlatFaceSinksByItsEnergyOverForce) {
  SceneText s(Method::by_accuracy(1e-4), 0.1, Vec3::Zero());
  s.box("B", Vec3::Ones(), Vec3(0, 0, 0.501), velocity(Vec3(0, 0, -speed)));
  const Outcome o = thrown(s, "10 GPa/m");
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double deep =
      0.5 * rock_density * speed * speed / pressure +
      0.5 * pressure / 10e9;  // on the way down to the pressure springs take half of its energy
  EXPECT_NEAR(0.5 - lowest_corner(o), deep, 1e-3 * deep);
}

/// A pyramid on its tip, whose cut at depth d is 3 d^2, the area that a corner is taken for: p d^3 = m v^2
/// / 2. With the area of its first touch, whatever its depth, it went through the ground.
TEST(Crushing, TipSinksByItsEnergyOverThePressedVolume) {
  const double half = 0.5 * std::sqrt(3.0), mass = rock_density;  // a base of 3 m^2 a metre above the tip
  const double deep = std::cbrt(0.5 * mass * speed * speed / pressure);
  for (const char* stiffness : {"10 GPa/m", "1 GPa/m", "1 GN/m"}) {
    SceneText s(Method::by_accuracy(1e-4), 0.2, Vec3::Zero());
    s.hull("B",
           {Vec3(0, 0, 0.001), Vec3(half, half, 1.001), Vec3(half, -half, 1.001), Vec3(-half, half, 1.001),
            Vec3(-half, -half, 1.001)},
           Vec3(0, 0, 0.751), velocity(Vec3(0, 0, -speed)));
    const Outcome o = thrown(s, stiffness);
    ASSERT_TRUE(o.ok()) << o.result.message;
    EXPECT_NEAR(0.75 - lowest_corner(o), deep, 0.03 * deep) << stiffness;
    EXPECT_NEAR(o.last().ledger.damping_work, 0.5 * mass * speed * speed, 0.05 * 0.5 * mass * speed * speed)
        << stiffness;  // springs give next to nothing back
    EXPECT_NEAR(o.last().ledger.algorithmic, 0, 1e-3 * 0.5 * mass * speed * speed) << stiffness;
  }
}

struct Books {
  double moved = 0, scheme = 0, growth = 0;  // largest kinetic energy; numerical dissipation;
                                             // largest growth of mechanical energy in a row [J]
};

/// A block of 0.2 m^3 that comes down by 6 m/s on another of 0.5 m^3, which crush each other.
Books dropped_on(double duration, const std::string& below, const std::string& falling) {
  SceneText s(Method::by_accuracy(1e-3), duration);
  s.history(1e-3)
      .material("rock", rock_density)
      .interface("*", "*", 0.6, crushing("2e9 Pa/m"))
      .plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
  s.raw("[[block]]\nname = \"A\"\nmaterial = \"rock\"\nvolume = 0.5\nposition = [0, 0, 2]\n" + below +
        "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nvolume = 0.2\nvelocity = [0, 0, -6]\n" + falling);
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  Books books;
  double before = o.rows.front().ledger.kinetic + o.rows.front().ledger.potential;
  for (const auto& r : o.rows) {
    const double now = r.ledger.kinetic + r.ledger.potential + r.ledger.contact;
    books.moved = std::max(books.moved, r.ledger.kinetic);
    books.growth = std::max(books.growth, now - before);
    before = now;
  }
  books.scheme = o.last().ledger.algorithmic;
  return books;
}

// Corners take each other's place while they crush: what appears deep inside has been crushed already. Booked
// once more it made 37 % here. Of 40 such pairs the scheme takes 0.14 % in the mean and 0.55 % of the worst.
TEST(Crushing, WhatAppearsWhereOthersCrushedIsNotCrushedAgain) {
  const Books b = dropped_on(0.3,
                             "shape = \"random-concave\"\nseed = 49\nfixed = true\n" +
                                 turned(Vec3(-1.2733253258175852, 1.8742270973516089, -1.2124838242958695)),
                             "shape = \"box\"\nposition = [-0.12072666128767934, 0.1, 4]\n" +
                                 turned(Vec3(-0.5552402611104634, -1.3361757714810176, -1.41719236183727)));
  EXPECT_LE(std::abs(b.scheme), 1e-2 * b.moved);
  EXPECT_LE(b.growth, 1e-4 * b.moved);
}

// What shear springs of corners that are gone held slips away: without that the numerical dissipation was 8 %
// here.
TEST(Crushing, ShearOfCornersThatGoSlipsAway) {
  const Books b = dropped_on(0.3,
                             "shape = \"EOTA111\"\nfixed = true\n" +
                                 turned(Vec3(-0.07512645505254456, 0.818676536563637, -1.7719962818568402)),
                             "shape = \"box\"\nposition = [0.2850597378865412, 0.1, 4]\n" +
                                 turned(Vec3(-1.9085377469891172, 0.999180089165093, 1.3795235575525187)));
  EXPECT_LE(std::abs(b.scheme), 5e-3 * b.moved);
  EXPECT_LE(b.growth, 1e-4 * b.moved);
}

// One block slides on the ground and comes to rest as the other strikes it: the end of the slip was sought in
// a step of 12 ms, of half a millisecond asked for, in which the blow lost 13 %.
TEST(Crushing, ASlipThatEndsAsABlowFallsLengthensNoStep) {
  const Books b =
      dropped_on(0.6,
                 "shape = \"random-convex\"\nseed = 1\n" +
                     turned(Vec3(1.1509532159217368, -0.5352620966325579, 0.3140753162274983)),
                 "shape = \"random-concave\"\nseed = 15\nposition = [-0.028306647926298778, 0.1, 4]\n" +
                     turned(Vec3(0.8310330266034449, 0.4948521243089403, 1.817577904359152)));
  EXPECT_LE(std::abs(b.scheme), 5e-3 * b.moved);
  EXPECT_LE(b.growth, 5e-4 * b.moved);
}

}  // namespace
}  // namespace talus::verify

// What the impulses of a step bring together within it gets its rows in that step, though no search at the
// start made any.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double frame = 0.02;  // one step by the speeds below [s]

/// Cubes of 1 m side by side along x without gravity or friction. The first comes on at 2 m/s and meets the
/// second, 1 mm on, which has `gap` left to the third. The first two slide by at 1 m/s along y: the search of
/// a step reaches farther than the gap, and at their present speeds the second and the third do not come
/// nearer. From the third on they touch.
Outcome chain(double gap) {
  SceneText s(Method::by_accuracy(1e-3), frame, Vec3::Zero(), "sleeping = false\n");
  s.history(frame).material("rock", 2500).interface("rock", "rock", 0.0, "normal_stiffness = \"hard\"");
  constexpr int cubes = 14;
  double x = 0;
  for (int i = 0; i < cubes; ++i) {
    const Vec3 velocity(i == 0 ? 2 : 0, i < 2 ? 1 : 0, 0);
    s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(x, 0, 0),
          fmt::format("deformable = false\nvelocity = [{}, {}, {}]\n", velocity.x(), velocity.y(),
                      velocity.z()));
    x += 1 + (i == 0 ? 1e-3 : i == 1 ? gap : 0);
  }
  return run_scene(s.str());
}

TEST(MetByImpulses, GetsItsRowsInTheSameStep) {
  const Outcome o = chain(0.015);
  ASSERT_TRUE(o.ok());
  const sim::HistoryRow& end = o.last();
  const double left = end.position[2].x() - end.position[1].x() - 1;
  EXPECT_GT(end.velocity[2].x(), 0.02);  // the third is pushed on, and what touches it
  EXPECT_GE(left, -1e-6);                // the touch band at this accuracy, 1e-3 of it and the radius
  EXPECT_LT(left, 1e-6);                 // as far as the second came
}

TEST(MetByImpulses, WhatStaysApartGetsNone) {
  const Outcome o = chain(0.022);  // within the reach of the search, beyond that of the impulses
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.last().velocity[2].norm(), 0);
}

/// Cubes in a row on a smooth floor, 1 mm apart, e = 1, the first ones faster than the last: what one step of
/// a large island brings together lands without its rebound, and that is told.
TEST(MetByImpulses, ReboundThatIsLeftOutIsTold) {
  bool missing = false;
  for (const int cubes : {12, 40}) {
    SceneText s(Method::by_accuracy(1e-3), 0.5);
    s.material("rock", 2500)
        .interface("rock", "rock", 0, "normal_stiffness = \"hard\"\nrestitution = 1")
        .interface("rock", "ground", 0, "normal_stiffness = \"hard\"\nrestitution = 1")
        .plane(Vec3::UnitZ());
    for (int i = 0; i < cubes; ++i)
      s.box(fmt::format("b{:02}", i), Vec3::Ones(), Vec3(1.001 * i - (i == 0 ? 1e-3 : 0), 0, 0.5),
            velocity(Vec3(1 - 2.0 * i / (cubes - 1), 0, 0)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    const double given = o.rows.front().ledger.kinetic, gone = o.last().ledger.damping_work,
                 told = o.result.counters.restitution_lost;
    EXPECT_LE(gone, 0.05 * given) << cubes;  // nearly all where what closes within a step had no rebound
    EXPECT_LE(told, gone + 1e-4 * given) << cubes;
    EXPECT_GE(told, 0.25 * gone - 1e-4 * given) << cubes;
    missing = missing || gone > 2e-3 * given;
  }
  EXPECT_TRUE(missing);
}

/// Thirteen of 48 cubes that come down a slope of 45 deg onto level ground, in the instant before one of them
/// falls beside an edge that its neighbour's face goes on beyond: what is named an internal edge at the start
/// of the step is where it lands at its end.
struct Falling {
  Vec3 position;
  Eigen::Vector4d turn;
  Vec3 velocity, spin;
};  // turn: quaternion, w first
const std::vector<Falling> heap{
    {{-1.14752891399, -0.509097064088, 1.95729345959},
     {0.951131278971, -0.00182122704207, 0.308767225545, -0.00296204744892},
     {2.26524618647, -0.047334779179, -2.20318525663},
     {-0.242737155696, -0.0734101924747, -0.136376950079}},
    {{-3.07312541378, -0.510390217892, 3.86218811608},
     {0.324764978437, 0.000457811845986, 0.945794163155, -0.000948751987153},
     {3.44803981794, -0.00370372070958, -2.89522129761},
     {0.00754738088729, 0.896844552482, 0.0105812073048}},
    {{-0.366389159721, 0.503357792595, 1.25089039738},
     {0.491681525119, -0.00274106962776, 0.870769371574, -0.00157032552419},
     {1.53906184186, 0.000255520592563, -1.6878159175},
     {0.141633672595, 1.259220286, 0.382551075121}},
    {{-0.37589935858, 1.51398248124, 1.25255669139},
     {0.482944382101, -0.00218148125218, 0.875647288204, -0.00133850587484},
     {1.60519765244, 0.0779542914005, -1.48432148219},
     {0.0221966203399, 0.950424254623, -0.0317372514776}},
    {{-1.12783908066, 1.51654425852, 1.95500147985},
     {0.955805087486, -0.000101863203601, 0.294001004454, -0.000183682367544},
     {2.33696849053, -0.0282555961844, -1.87542182629},
     {0.148406790584, -0.809494856397, 0.152817622086}},
    {{0.469423017032, -1.51746045271, 1.9658012842},
     {0.54043226814, -0.00628174262409, 0.841355838646, 0.00372237003118},
     {4.24819431452, -0.179852693934, -4.55806841632},
     {-0.305775704925, 3.06253010648, -0.121919272598}},
    {{0.574235965477, -0.476019843296, 0.551054108443},
     {0.667858652388, 0.000980109086084, 0.744286947881, -0.000893885167825},
     {3.5002677584, -0.174506204252, -1.27266501071},
     {-0.00929357235967, -2.92401153991, 0.116814641166}},
    {{-1.93607245219, -0.502177509729, 2.66662782249},
     {0.929188592159, -0.00380766573147, 0.369580030544, -0.0021593764877},
     {0.543919822319, 0.142878845841, -2.33181770578},
     {-0.121967189078, 2.59848412093, -0.207086784188}},
    {{-2.07648801942, -0.503801792008, 4.24542090065},
     {0.276608920124, -0.001912900988, 0.960951589446, 0.00747588520708},
     {4.29675298221, -0.0011730061578, -4.16853612164},
     {0.0184138551836, 1.78275436016, 0.0132533118476}},
    {{0.451362172255, 1.54364393785, 0.689654813085},
     {0.48294622854, 0.000122716511504, 0.875649998971, -6.76844931346e-05},
     {2.56458303218, 0.0219690092905, 0.152206689582},
     {-0.00176223247255, 0.965247797367, -0.00915337308578}},
    {{0.43227298453, 1.5307955448, 1.95379899669},
     {0.504389939196, -0.00841171280945, 0.86337556268, 0.0101326251121},
     {4.13630240368, 0.0854909816836, -4.66424141026},
     {0.0954169065908, 3.27376152624, 0.330876334198}},
    {{-1.9512234796, 1.53036025715, 2.66247235576},
     {0.924994031067, -2.68413586006e-05, 0.379981619595, -0.000102665159535},
     {0.968661103308, 0.495537271433, -3.32738987008},
     {-2.52219662443, 2.54285671423, -1.29643733866}},
    {{0.820118746152, 1.52319243884, 2.9018331731},
     {0.522608785638, -0.00680366185535, 0.852507048114, 0.00809322404973},
     {5.86084459128, 0.173848442325, -4.86038497154},
     {0.0295613045118, 2.4631647419, 0.127122556147}},
};

TEST(MetByImpulses, AnEdgeWithinASurfaceThatBecomesAContactIsARowAtOnce) {
  SceneText s(Method::by_accuracy(1e-3), frame, {0, 0, -9.81});
  s.history(frame)
      .material("rock", 2500)
      .material("ground", 2500)
      .interface("*", "*", 0.5317, "restitution = 0.0\nnormal_stiffness = \"hard\"");
  s.plane(Vec3::UnitZ()).plane(Vec3(1, 0, 1) / std::sqrt(2.0));
  for (std::size_t i = 0; i < heap.size(); ++i) {
    const Falling& f = heap[i];
    s.box(fmt::format("B{}", i), Vec3::Ones(), f.position,
          fmt::format("deformable = false\norientation = {{ quaternion = [{}, {}, {}, {}] }}\n", f.turn[0],
                      f.turn[1], f.turn[2], f.turn[3]) +
              velocity(f.velocity) + spin(f.spin));
  }
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_LT(o.result.counters.worst_penetration, 1e-9);
}

}  // namespace
}  // namespace talus::verify

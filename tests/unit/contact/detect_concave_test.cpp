// Contact points of blocks that are not convex.
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "contact/narrow/narrow_features.hpp"
#include "local_contacts.hpp"

namespace talus::contact::testing {
namespace {

const Polyhedron ell = prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}},
                             {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 0, 1);

TEST(ConcaveContact, CubeInTheNotchOfAnL) {
  for (const double d : {-1e-12, 0.0, 1e-12}) {
    const auto c = between(ell, {Vec3::Zero()}, cube, {Vec3(1.5 + d, 1.5 - d, 0.5)}, 1e-3);
    EXPECT_EQ(c.size(), 8u);
    double x = 0, y = 0;
    for (const auto& p : c) (p.normal.x() > 0.5 ? x : y) += p.area;
    EXPECT_NEAR(x, 1, 1e-9);
    EXPECT_NEAR(y, 1, 1e-9);
  }
}

TEST(ConcaveContact, SameAsConvexWhereTheShapeIsConvex) {
  const auto c = between(ell, {Vec3::Zero()}, cube, {Vec3(0.4, 2.5, 0.6)}, 1e-3);
  ASSERT_EQ(c.size(), 4u);
  for (const auto& p : c) EXPECT_NEAR(p.normal.y(), 1, 1e-12);
  EXPECT_NEAR(total_area(c), 0.9 * 0.9, 1e-9);
}

TEST(ConcaveContact, MirrorsWhenTheRolesAreExchanged) {
  std::mt19937 rng(6);
  std::uniform_real_distribution<double> u(-1, 1);
  int met = 0;
  for (int i = 0; i < 400; ++i) {
    const Pose pa{Vec3::Zero(), random_rotation(rng)},
        pb{Vec3(u(rng), u(rng), u(rng)).normalized() * 2.2, random_rotation(rng)};
    const auto c = between(ell, pa, cube, pb, 0.1), r = between(cube, pb, ell, pa, 0.1);
    double g = 1, h = 1;
    for (const auto& p : c) g = std::min(g, p.gap);
    for (const auto& p : r) h = std::min(h, p.gap);
    EXPECT_NEAR(g, h, 1e-9);
    met += !c.empty();
  }
  EXPECT_GT(met, 20);
}

/// Away from overlap the least gap of the local features is the distance of the bodies: two convex parts of
/// the L.
TEST(ConcaveContact, LeastGapIsTheDistanceOfTheConvexParts) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u(-1, 1), d(0.9, 2.4);
  const auto foot = prism({{0, 0}, {2, 0}, {2, 1}, {0, 1}}, {{0, 1, 2}, {0, 2, 3}}, 0, 1);
  const auto stem = prism({{0, 0}, {1, 0}, {1, 2}, {0, 2}}, {{0, 1, 2}, {0, 2, 3}}, 0, 1);
  int met = 0;
  for (int i = 0; i < 3000; ++i) {
    const Pose pa{Vec3::Zero()},
        pb{Vec3(1, 1, 0.5) + d(rng) * Vec3(u(rng), u(rng), u(rng)).normalized(), random_rotation(rng)};
    const double margin = 0.12;
    std::vector<ContactPoint> c;
    block_block(foot, pa, cube, pb, margin, c);
    block_block(stem, pa, cube, pb, margin, c);
    double exact = 1e300;
    for (const auto& p : c) exact = std::min(exact, p.gap);
    if (exact < 1e-6) continue;
    const auto local = between(ell, pa, cube, pb, margin);
    if (exact > margin) {
      EXPECT_TRUE(local.empty());
      continue;
    }
    ++met;
    ASSERT_FALSE(local.empty()) << i << " " << exact;
    double g = 1e300;
    for (const auto& p : local) g = std::min(g, p.gap);
    EXPECT_NEAR(g, exact, 1e-9) << i;
  }
  EXPECT_GT(met, 150);
}

TEST(ConcaveContact, DovetailTouchesOnItsFlanksOnly) {
  // Socket: a block with a trapezoidal groove, open at the top; tenon: the matching trapezoid, sliding along
  // z.
  const auto socket = prism({{-3, 0}, {3, 0}, {3, 2}, {1, 2}, {1.5, 1}, {-1.5, 1}, {-1, 2}, {-3, 2}},
                            {{0, 1, 4}, {0, 4, 5}, {1, 2, 4}, {2, 3, 4}, {0, 5, 7}, {5, 6, 7}}, -2, 2);
  const auto tenon = prism({{-1.5, 1}, {1.5, 1}, {1, 2}, {-1, 2}}, {{0, 1, 2}, {0, 2, 3}}, -1, 1);
  ASSERT_FALSE(socket.convex);
  const auto c = between(socket, {Vec3::Zero()}, tenon, {Vec3(0, 0, 0.3)}, 1e-3);
  double floor = 0, left = 0, right = 0;
  for (const auto& p : c) {
    EXPECT_NEAR(p.gap, 0, 1e-12);
    if (p.normal.y() > 0.9)
      floor += p.area;
    else if (p.normal.x() > 0)
      left += p.area;
    else
      right += p.area;
    EXPECT_NEAR(p.normal.z(), 0, 1e-12);
  }
  EXPECT_NEAR(floor, 6, 1e-9);
  EXPECT_NEAR(left, 2 * std::sqrt(1.25), 1e-9);
  EXPECT_NEAR(right, 2 * std::sqrt(1.25), 1e-9);
}

TEST(ConcaveContact, StandingFlushOnAnLTouchesTheTopOnly) {
  // On the foot of an L laid on its back, one side flush with the outer wall.
  const auto c = between(ell, {Vec3::Zero()}, box(0.5, 1, 0.5), {Vec3(1.75, 1.5, 0.25)}, 1e-3);
  for (const auto& p : c) EXPECT_NEAR(p.normal.y(), 1, 1e-12);
  EXPECT_NEAR(total_area(c), 0.25, 1e-9);
}

TEST(ConcaveContact, NeighboursCutFromOneRockDoNotOverlap) {
  // Two blocks of a rock mass, joined of several cells each: a corner of the first lies on an edge of the
  // second, none of whose near faces it could press on; it is not inside as deep as the far side.
  const Polyhedron first = make_polyhedron({{1.1474771797357812, -1.2482032889260846, 0.9156222100480989},
                                            {1.1474859978289915, -0.695994903240277, 1.4672418419815045},
                                            {1.1167588014252505, -1.261723446636522, 1.7812336855385666},
                                            {-0.9282941064244001, -1.0936567737642409, -1.7023708778664997},
                                            {1.0083168208820572, -1.1954813737979535, -1.6834269089681158},
                                            {-1.0511659154217567, -1.1477366545124204, 1.7600270002767786},
                                            {0.6776271546580261, 2.8671752546377416, -3.927625186447699},
                                            {-0.7092034741556379, 2.9400930886240753, -3.941191192881476},
                                            {-0.8320752831529941, 2.886013207875897, -0.47879331473819775},
                                            {0.8631751576530249, 2.796879042794977, -0.4622103392046455}},
                                           {{0, 1, 2},
                                            {2, 5, 3},
                                            {3, 4, 0},
                                            {0, 2, 3},
                                            {6, 4, 3},
                                            {3, 7, 6},
                                            {8, 7, 3},
                                            {3, 5, 8},
                                            {4, 6, 9},
                                            {4, 9, 1},
                                            {0, 4, 1},
                                            {8, 5, 2},
                                            {1, 9, 8},
                                            {1, 8, 2},
                                            {8, 9, 6},
                                            {6, 7, 8}});
  const Polyhedron second = make_polyhedron({{1.14746517446088, -2.0, 0.1646270498853113},
                                             {1.253628615736611, -2.0, 2.1875700064366868},
                                             {1.193864823877056, -1.265777585640718, 1.7819879382749377},
                                             {1.1474771797357812, -1.2482032889260846, 0.9156222100480989},
                                             {1.196594260114816, -2.0, -1.2413888614760396},
                                             {1.2396306104226067, -1.2076435658883424, -1.6811641926046974},
                                             {-1.0974560726185167, -2.0, 2.2330519910952376},
                                             {-0.9775215789407379, -2.0, -1.1993303581275256},
                                             {-0.9282941064244001, -1.0936567737642409, -1.7023708778664997},
                                             {-1.0511659154217567, -1.1477366545124204, 1.7600270002767786}},
                                            {{0, 1, 6},
                                             {0, 6, 7},
                                             {7, 4, 0},
                                             {1, 0, 3},
                                             {3, 2, 1},
                                             {9, 6, 1},
                                             {1, 2, 9},
                                             {3, 5, 8},
                                             {3, 8, 9},
                                             {2, 3, 9},
                                             {4, 7, 8},
                                             {4, 8, 5},
                                             {4, 5, 3},
                                             {0, 4, 3},
                                             {9, 8, 7},
                                             {6, 9, 7}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_FALSE(c.empty());
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
}

TEST(ConcaveContact, EdgesOnTheFarSidesOfNeighboursDoNotCross) {
  // Two slabs beside each other, of one rock as well: the lower edge of the first and the upper edge of the
  // second pass each other.
  const Polyhedron first = make_polyhedron(
      {{-1.994069006125947, 2.2337626817920304, -0.5},
       {-1.8245946852448531, -1.0, -0.5},
       {-1.730849147867512, -1.0, 1.286319963508646},
       {-0.19003211310794788, -1.0, -0.5},
       {-0.2514497924374015, -1.0, 1.257700824810314},
       {-0.07944144390477659, 2.1669024140291526, -0.5}},
      {{0, 1, 2}, {2, 1, 3}, {3, 4, 2}, {1, 0, 5}, {5, 3, 1}, {3, 5, 4}, {5, 0, 2}, {2, 4, 5}});
  const Polyhedron second = make_polyhedron({{1.9999440496232406, -0.503735614206037, -0.5},
                                             {2.025952164019965, -1.0, -0.5},
                                             {2.115792493004622, -1.0, 1.2119062697086633},
                                             {1.999958849469116, 0.42306327584658554, 0.42581075524992684},
                                             {2.0905585560952242, 2.0911243442320755, -0.5},
                                             {-0.07944144390477659, 2.1669024140291526, -0.5},
                                             {-0.19003211310794788, -1.0, -0.5},
                                             {-0.2514497924374015, -1.0, 1.257700824810314}},
                                            {{5, 4, 0},
                                             {6, 5, 0},
                                             {0, 1, 6},
                                             {3, 2, 1},
                                             {0, 3, 1},
                                             {2, 7, 6},
                                             {1, 2, 6},
                                             {3, 4, 5},
                                             {3, 5, 7},
                                             {2, 3, 7},
                                             {0, 4, 3},
                                             {5, 6, 7}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_GE(c.size(), 3u);
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
}

TEST(ConcaveContact, LeaningKnifeCrossesAnEdgeWithNeitherOnesPointInTheOther) {
  // Along z an edge of the L, across it the edge of a knife that leans by 40 degrees: what of the one is
  // straight below the other is not inside it.
  const Vec3 out = Vec3(-1, -1, 0).normalized(), up = Vec3::UnitZ();
  for (const double lean : {-1.0, 1.0}) {
    const Polyhedron knife = prism({{0, 0}, {1.0, 1.0}, {0.6, 1.0}}, {{0, 1, 2}}, -1, 1);
    Mat3 R;
    R.col(0) = lean * up, R.col(1) = out, R.col(2) = R.col(0).cross(R.col(1));
    for (const double overlap : {1e-6, 1e-4, 1e-2}) {
      const auto contacts = between(ell, {Vec3::Zero()}, knife, {Vec3(0, 0, 0.5) - overlap * out, R}, 1e-7);
      ASSERT_EQ(contacts.size(), 1u) << "overlap " << overlap;
      EXPECT_NEAR(contacts[0].gap, -overlap, 1e-12);
      EXPECT_NEAR((contacts[0].normal - out).norm(), 0, 1e-12);
    }
  }
}

/// A ball of 1280 faces with dents.
Polyhedron dented_ball(std::mt19937& rng) {
  std::vector<Vec3> x;
  const double g = (1 + std::sqrt(5.0)) / 2;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g}) {
      x.emplace_back(s, t, 0);
      x.emplace_back(0, s, t);
      x.emplace_back(t, 0, s);
    }
  const Polyhedron icosahedron = hull(x);
  std::vector<std::array<int, 3>> triangles = icosahedron.triangles;
  x = icosahedron.vertices;
  for (Vec3& v : x) v.normalize();
  for (int round = 0; round < 3; ++round) {
    std::map<std::pair<int, int>, int> middle;
    const auto between = [&](int i, int j) {
      const auto [at, fresh] = middle.emplace(std::minmax(i, j), static_cast<int>(x.size()));
      if (fresh) x.push_back((x[static_cast<std::size_t>(i)] + x[static_cast<std::size_t>(j)]).normalized());
      return at->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const int ab = between(a, b), bc = between(b, c), ca = between(c, a);
      for (const auto& t : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
        finer.push_back(t);
    }
    triangles = finer;
  }
  std::vector<double> radius(x.size(), 1.0);
  for (int dent = 0; dent < 8; ++dent) {
    const Vec3 at = sphere_points(1, 1, rng).front();
    for (std::size_t v = 0; v < x.size(); ++v) radius[v] -= 0.2 * std::exp(-(1 - at.dot(x[v])) / 0.12);
  }
  for (std::size_t v = 0; v < x.size(); ++v) x[v] *= radius[v];
  return make_polyhedron(x, triangles);
}

/// Inside is where the faces fill the whole sky.
TEST(ConcaveContact, InsideOfAScanIsWhereItsFacesFillTheSky) {
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1.1, 1.1);
  const Polyhedron ball = dented_ball(rng);
  const auto sky = [](const Polyhedron& p, const Vec3& x) {
    double angle = 0;
    for (const auto& t : p.triangles) {
      const Vec3 a = p.vertices[static_cast<std::size_t>(t[0])] - x,
                 b = p.vertices[static_cast<std::size_t>(t[1])] - x,
                 c = p.vertices[static_cast<std::size_t>(t[2])] - x;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      angle +=
          2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle;
  };
  int in = 0;
  for (const Polyhedron* body : {&ball, &ell}) {
    for (int i = 0; i < 2000; ++i) {
      const Mat3 F = random_rotation(rng);
      const Vec3 centre(u(rng), u(rng), u(rng));
      // Of the L half of the places are in rows with each other, and with its edges' middles.
      Vec3 x(u(rng), u(rng), u(rng));
      if (body == &ell && i % 2 == 0) x = (4 * x).array().round() / 4 + 0.625;
      const double angle = sky(*body, x);
      if (angle > 0.1 && angle < 4 * M_PI - 0.1) continue;  // on the surface
      const bool inside = angle > 2 * M_PI;
      EXPECT_EQ((narrow::Whole{*body, centre, F}.holds(centre + F * x)), inside) << x.transpose();
      in += inside ? 1 : 0;
    }
  }
  EXPECT_GT(in, 500);
}

/// What two scans touch with is a matter of how they lie to each other, not of the axes of the world.
TEST(ConcaveContact, ScansTouchAlikeByAnyAxes) {
  std::mt19937 rng(11);
  const Polyhedron a = dented_ball(rng), b = dented_ball(rng);
  ASSERT_FALSE(a.convex || b.convex);
  const double margin = 0.01;
  std::size_t points = 0;
  for (int i = 0; i < 40; ++i) {
    const Pose pa{Vec3::Zero(), random_rotation(rng)};
    const Mat3 turned = random_rotation(rng);
    const Vec3 way = sphere_points(1, 1, rng).front();
    double apart = 0.5, in = 3;  // where they just touch, by halving
    for (int k = 0; k < 30; ++k) {
      const double middle = 0.5 * (apart + in);
      std::vector<ContactPoint> c;
      block_block(a, pa, b, {middle * way, turned}, margin, c);
      (c.empty() ? in : apart) = middle;
    }
    const Pose pb{(apart - 0.9 * margin) * way, turned};
    const auto names = [](const std::vector<ContactPoint>& c) {
      std::map<FeatureKey, double> gaps;
      for (const auto& p : c) gaps[p.key] = p.gap;
      return gaps;
    };
    const auto here = names(between(a, pa, b, pb, margin));
    points += here.size();
    for (int turns = 0; turns < 4; ++turns) {
      const Mat3 R = random_rotation(rng);
      const auto there = names(between(a, {R * pa.c, R * pa.F}, b, {R * pb.c, R * pb.F}, margin));
      ASSERT_EQ(here.size(), there.size());
      for (const auto& [key, gap] : here) {
        ASSERT_TRUE(there.contains(key));
        EXPECT_NEAR(there.at(key), gap, 1e-12);
      }
    }
  }
  EXPECT_GT(points, 40u);
}

TEST(ConcaveContact, NotchIsFilledWithoutOverlap) {
  // Of a rock mass whose slivers were merged: the second block has a notch that an edge of the first fills.
  // Its vertices there lie on the first one's surface, below the notch's roof, which runs over the first
  // block's lower edge; between them is no matter of both.
  const Polyhedron first = make_polyhedron({{-0.9317315163096964, -1.0, -1.0},
                                            {-0.7749965716118368, -0.8684837657114315, -1.0},
                                            {-4.59582254724279, -1.0, -1.0},
                                            {-4.266234645543278, -1.0, 1.5543775927122283},
                                            {-4.81746347813862, -1.0, 0.9406720441003245},
                                            {-5.407609028522074, -0.032550544515999036, -1.0},
                                            {-3.100697203194045, 1.9031783172752625, -1.0},
                                            {-2.3239278490308664, 0.6297889165867048, 1.5543775927122567}},
                                           {{2, 0, 3},
                                            {3, 4, 2},
                                            {5, 6, 1},
                                            {2, 5, 1},
                                            {2, 1, 0},
                                            {7, 3, 0},
                                            {0, 1, 7},
                                            {1, 6, 7},
                                            {2, 4, 5},
                                            {7, 6, 5},
                                            {3, 7, 5},
                                            {3, 5, 4}});
  const Polyhedron second =
      make_polyhedron({{-0.7749965716118368, -0.8684837657114315, -1.0},
                       {-0.9317315163096964, -1.0, -1.0},
                       {-1.0737013281155612, -1.0, -0.8912448145754865},
                       {-0.8409438727337317, -0.8046933050353289, -0.8912448145754865},
                       {-0.874015606288367, -0.7504774754005155, -1.0},
                       {1.4328962190396624, 1.1852513863907745, -1.0},
                       {3.0, -1.0, -1.0},
                       {3.0, -1.0, 0.6552904006764493},
                       {1.4096487468684415, -1.0, 1.873570140745187},
                       {3.0, -0.6823501745366798, -1.0},
                       {3.0, -0.9178558456986536, 0.7302827741672786},
                       {2.3067299187782737, -0.24725951951435832, 1.873570140745187}},
                      {{3, 0, 1},  {1, 2, 3},   {4, 5, 9},  {4, 9, 6},  {6, 1, 0},  {0, 4, 6},  {7, 8, 2},
                       {1, 6, 7},  {1, 7, 2},   {11, 5, 4}, {8, 11, 4}, {3, 2, 8},  {8, 4, 3},  {0, 3, 4},
                       {9, 5, 11}, {11, 10, 9}, {7, 6, 9},  {9, 10, 7}, {11, 8, 7}, {7, 10, 11}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_GE(c.size(), 3u);
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
  // Pushed into the first block it overlaps by some part of the way.
  for (const double way : {1e-6, 1e-4, 1e-3}) {
    double deepest = 0;
    for (const auto& p : between(first, {Vec3::Zero()}, second, {way * Vec3(-0.493, 0.587, -0.643)}, 1e-3))
      deepest = std::max(deepest, -p.gap);
    EXPECT_GT(deepest, 0.3 * way) << way;
    EXPECT_LT(deepest, 1.3 * way) << way;
  }
}

TEST(ConcaveContact, SpikesBesideAnLAreNotInIt) {
  // About a sharp corner the sum of its faces' normals does not tell before from behind; with a wide margin
  // corners far off are looked at as well.
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1, 1);
  const Polyhedron left = box(1, 2, 1), right = box(1, 1, 1);  // what the L is made of
  int beside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Polyhedron spike = hull({{0, 0, 0},
                                   {1, 0.1 * u(rng), 0.3 * u(rng)},
                                   {1, 0.3 + 0.2 * u(rng), 0.4 * u(rng)},
                                   {0.9, 0.1 * u(rng), 0.5 + 0.3 * u(rng)}});
    const Pose p{Vec3(1, 1, 0.5) + 1.4 * Vec3(u(rng), u(rng), u(rng)), random_rotation(rng)};
    std::vector<ContactPoint> parts;
    block_block(left, {Vec3(0.5, 1, 0.5)}, spike, p, 1e-3, parts);
    block_block(right, {Vec3(1.5, 0.5, 0.5)}, spike, p, 1e-3, parts);
    if (!parts.empty()) continue;
    ++beside;
    for (const auto& c : between(ell, {Vec3::Zero()}, spike, p, 0.4)) EXPECT_GT(c.gap, 0) << i;
  }
  EXPECT_GT(beside, 1000);
}

}  // namespace
}  // namespace talus::contact::testing

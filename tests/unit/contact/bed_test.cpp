// Law of the columns of a bed: volume, crushing, unloading, and the halves that a leapfrog counts; Hertz's
// law at a cell.
#include "contact/laws/bed.hpp"
#include "contact/geometry/surface_index.hpp"
#include "contact/laws/normal_law.hpp"
#include "contact/skin/skin_bed.hpp"
#include "detect_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace talus::contact {
namespace {

constexpr double k = 5e7, p = 5e5, yield = p / k;
const Vec3 up = Vec3::UnitZ();

std::vector<Column> wedge() {  // four columns of 0.1 m^2, the deepest at 0.04 m
  std::vector<Column> c;
  for (const double depth : {0.01, 0.02, 0.03, 0.04})
    c.push_back({0.1, {depth, depth, depth}, {depth, depth, depth}, {}, up});
  return c;
}

std::vector<Column> wedge_pressed_by(double most) {
  std::vector<Column> c = wedge();
  for (Column& q : c) q.spring.fill(std::min(q.mean(), most));
  return c;
}

TEST(Bed, ElasticForceIsStiffnessTimesVolume) {
  const Bed bed(wedge(), up, 0.04, k, std::numeric_limits<double>::infinity(), 0.04, 0);
  EXPECT_DOUBLE_EQ(bed.force(0.04), k * 0.1 * (0.01 + 0.02 + 0.03 + 0.04));
  EXPECT_DOUBLE_EQ(bed.stored(0.04), 0.5 * k * 0.1 * (1 + 4 + 9 + 16) * 1e-4);
  EXPECT_DOUBLE_EQ(bed.force(0.035), k * 0.1 * (0.005 + 0.015 + 0.025 + 0.035));
  EXPECT_DOUBLE_EQ(bed.force(0.0), 0);
  EXPECT_DOUBLE_EQ(bed.work(0.05), bed.stored(0.05));
  EXPECT_DOUBLE_EQ(bed.before(0.03), bed.stored(0.03));
}

TEST(Bed, CrushingForceIsPressureTimesArea) {
  const Bed bed(wedge_pressed_by(yield), up, 0.04, k, yield, 0.04, 0.04 - yield);
  EXPECT_DOUBLE_EQ(bed.force(0.04), p * 0.4);
  EXPECT_DOUBLE_EQ(bed.force(0.041), p * 0.4);
  EXPECT_NEAR(bed.work(0.041) - bed.stored(0.041), p * 0.4 * 0.001, 1e-9);
  EXPECT_NEAR(bed.crushing_before(0.039), -p * 0.4 * 0.001, 1e-9);
  EXPECT_DOUBLE_EQ(bed.crushed_after(0.041), 0.041 - yield);
  // On the way back all give way together, and nothing is left after p / k.
  EXPECT_NEAR(bed.force(0.035), 0.5 * p * 0.4, 1e-6);
  EXPECT_NEAR(bed.force(0.03), 0, 1e-6);
}

TEST(Bed, CraterCarriesNothingAboveItsFloor) {
  const Bed bed(wedge_pressed_by(-0.01), up, 0.04, k, yield, 0.04, 0.05);
  EXPECT_DOUBLE_EQ(bed.force(0.04), 0);
  EXPECT_DOUBLE_EQ(bed.force(0.049), 0);
  EXPECT_GT(bed.force(0.051), 0);
}

TEST(Bed, WhatRisesOutOfItsCraterCarriesNothing) {
  std::vector<Column> c = wedge();
  for (Column& q : c)
    q.spring.fill(q.mean() > 0.02 ? yield
                                  : -0.003);  // the shallow ones have risen 3 mm out of what they crushed
  const Bed bed(c, up, 0.04, k, yield, 0.04, 0);
  EXPECT_DOUBLE_EQ(bed.force(0.04), p * 0.2);
  EXPECT_DOUBLE_EQ(bed.force(0.042), p * 0.2);
  EXPECT_NEAR(bed.force(0.044), p * 0.2 + k * 0.2 * 0.001, 1e-6);
}

TEST(Bed, WhatLiesUnloadedComesBackAsFoundOnly) {
  const Bed bed(wedge(), up, 0.04, k, std::numeric_limits<double>::infinity(), 0.04, 0.05);
  EXPECT_DOUBLE_EQ(bed.crushed_after(0.02), 0.04);  // not by the step's own way
}

/// A bed that was found late and lies unloaded down to y, but is loaded beyond: on its way out, too, the mean
/// of its force is one of its forces, and the way there and back does no work. Taken as if it had held
/// nothing above x_0, the mean grew without bound as the way became short.
TEST(Bed, WhatIsLoadedBelowItsFloorKeepsItsEnergyOnItsWayOut) {
  NormalLaw law;
  law.bed = std::make_shared<const Bed>(wedge_pressed_by(0.02), up, 0.04, k,
                                        std::numeric_limits<double>::infinity(), 0.04, 0.02);
  double slope = 0;
  for (const double end : {0.0405, 0.0409, 0.04099, 0.0409999, 0.0410001, 0.042}) {
    const double mean = law.secant(0.041, end, slope);
    EXPECT_GE(mean, law.force(std::min(0.041, end)) * (1 - 1e-9)) << end;
    EXPECT_LE(mean, law.force(std::max(0.041, end)) * (1 + 1e-9)) << end;
    EXPECT_NEAR(mean * (end - 0.041), law.bed->stored(end) - law.bed->stored(0.041),
                1e-9 * law.bed->stored(end))
        << end;
  }
}

/// What held nothing came with the block: its way begins where it lies, and no way makes its mean force
/// greater than its force.
TEST(Bed, WhatLayUnloadedBeginsItsWayWhereItLies) {
  NormalLaw law;
  law.bed = std::make_shared<const Bed>(wedge_pressed_by(0), up, 0.04, k,
                                        std::numeric_limits<double>::infinity(), 0.04, 0.04, true);
  double slope = 0;
  EXPECT_EQ(law.secant(0.041, 0.039, slope), 0);
  for (const double end : {0.0405, 0.0409999, 0.0410001, 0.042})
    EXPECT_NEAR(law.secant(0.041, end, slope), law.bed->stored(end) / (end - 0.04), 1e-9 * law.force(end))
        << end;
}

/// Area sunk in below a square face at z = 0, x and y from 0 to 1, by a cube of 0.5 m that lies 0.3 m deep
/// and reaches `over` its rim.
double sunk_area(double over) {
  TriangleSurface skin;
  skin.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0}};
  for (int i = 0; i < 4; ++i) skin.triangles.push_back({i, (i + 1) % 4, 4});
  const SurfaceIndex index(skin);
  std::vector<Footprint> parts;
  skin_bed(index, testing::box(0.5, 0.5, 0.5), {Vec3(over - 0.25, 0.5, -0.05), Mat3::Identity()}, 1e-3,
           std::numeric_limits<double>::infinity(), parts);
  double area = 0;
  for (const Footprint& part : parts)
    for (const Column& c : part.columns) area += c.mean() > 0 ? c.area : 0;
  return area;
}

/// Middles of the parts, by sector, below a box sunk into the middle of a face of 1 x 1 m whose normal leans
/// by (x, y).
std::vector<Vec3> middles_below_box(double x, double y) {
  TriangleSurface skin;
  skin.vertices = {{0, 0, 0}, {1, 0, -x}, {1, 1, -x - y}, {0, 1, -y}, {0.5, 0.5, -0.5 * (x + y)}};
  for (int i = 0; i < 4; ++i) skin.triangles.push_back({i, (i + 1) % 4, 4});
  const SurfaceIndex index(skin);
  std::vector<Footprint> parts;
  skin_bed(index, testing::box(0.5, 0.3, 0.5), {Vec3(0.5, 0.5, 0.2), Mat3::Identity()}, 0.01,
           std::numeric_limits<double>::infinity(), parts);
  std::vector<Vec3> middles(4, Vec3::Zero());
  for (const Footprint& part : parts) {
    double area = 0;
    Vec3& middle = middles[static_cast<std::size_t>(part.sector)];
    for (const Column& c : part.columns)
      middle += c.area * (c.place[0] + c.place[1] + c.place[2]) / 3, area += c.area;
    middle /= area;
  }
  return middles;
}

/// The most common normals lie along an axis but for round-off. Whichever of the other two this makes the
/// smaller one, the parts are the same and go on with their own shear springs.
TEST(Bed, FacesAlongTheAxesKeepTheirLines) {
  const std::vector<Vec3> one = middles_below_box(1e-9, 2e-9), other = middles_below_box(2e-9, -1e-9);
  for (std::size_t sector = 0; sector < 4; ++sector) {
    EXPECT_GT((one[sector] - Vec3(0.5, 0.5, 0)).norm(), 0.1) << sector;
    EXPECT_LT((one[sector] - other[sector]).norm(), 1e-6) << sector;
  }
}

/// Sums over the bed below the corner of a turned cube, over the middle of a face, that was found with the
/// corner `deep` below it and has moved down by `down` since.
struct Corner {
  double force = 0, energy = 0;
};
Corner corner_bed(double deep, double down) {
  TriangleSurface skin;
  skin.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}};
  for (int i = 0; i < 4; ++i) skin.triangles.push_back({i, (i + 1) % 4, 4});
  const SurfaceIndex index(skin);
  const Polyhedron cube = testing::box(0.5, 0.5, 0.5);
  const Mat3 turned = Eigen::AngleAxisd(0.4, Vec3(1, 0.5, 0.2).normalized()).toRotationMatrix();
  double lowest = 0;
  for (const Vec3& v : cube.vertices) lowest = std::min(lowest, (turned * v).z());
  std::vector<Footprint> parts;
  skin_bed(index, cube, {Vec3(0, 0, -lowest - deep), turned}, 0.01, std::numeric_limits<double>::infinity(),
           parts);
  Corner sum;
  for (const Footprint& part : parts) {
    const Bed bed(part.columns, up, part.deepest, k, std::numeric_limits<double>::infinity(), part.deepest,
                  0);
    sum.force += bed.force(part.deepest + down), sum.energy += bed.stored(part.deepest + down);
  }
  return sum;
}

/// Columns that come into contact, or out of it, on the way of a step: what was found before it tells what
/// will be found after it. Three points to a triangle missed 3 % of the energy.
TEST(Bed, MovedIsAsFoundThere) {
  for (const double down : {0.004, -0.003, -0.012}) {
    const Corner moved = corner_bed(0.01, down), found = corner_bed(0.01 + down, 0);
    EXPECT_NEAR(moved.force, found.force, 1e-12 * corner_bed(0.01, 0).force);
    EXPECT_NEAR(moved.energy, found.energy, 1e-12 * corner_bed(0.01, 0).energy);
  }
}

/// Sums over the bed of a box's top and sides below a block whose corner has come down at `place`, past an
/// edge of the box and with a facet that leans over.
struct AtEdge {
  double energy = 0;
  Vec3 force = Vec3::Zero();
  bool edge = false;
};
AtEdge bed_at_edge(const Vec3& place) {
  TriangleSurface skin;
  const auto face = [&](const Vec3& a, const Vec3& b, const Vec3& c,
                        const Vec3& d) {  // counter-clockwise from outside
    const int first = static_cast<int>(skin.vertices.size());
    for (const Vec3& x : {a, b, c, d, Vec3(0.25 * (a + b + c + d))}) skin.vertices.push_back(x);
    for (int i = 0; i < 4; ++i) skin.triangles.push_back({first + i, first + (i + 1) % 4, first + 4});
  };
  face({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  face({0, 0, -1}, {1, 0, -1}, {1, 0, 0}, {0, 0, 0});
  const SurfaceIndex index(skin);
  const Polyhedron block = testing::box(0.5, 0.5, 0.5);
  Mat3 turned;  // edges from the lowest corner
  turned.col(0) = Vec3(0.8, 0.1, 0.1), turned.col(1) = Vec3(-0.1, 0.8, 0.15),
  turned.col(2) = Vec3(0.5, -0.3, 0.9);
  Vec3 lowest = Vec3::Constant(INFINITY);
  for (const Vec3& v : block.vertices)
    if ((turned * v).z() < lowest.z()) lowest = turned * v;
  std::vector<Footprint> parts;
  skin_bed(index, block, {place - lowest, turned}, 0.01, std::numeric_limits<double>::infinity(), parts);
  AtEdge sum;
  for (const Footprint& part : parts) {
    Vec3 lift = Vec3::Zero();
    for (const Column& c : part.columns) lift += c.area * std::max(0.0, c.mean()) * c.lift;
    const Bed bed(part.columns, part.edge ? Vec3(lift.normalized()) : part.normal, part.deepest, k,
                  std::numeric_limits<double>::infinity(), part.deepest, 0);
    sum.edge = sum.edge || part.edge;
    sum.energy += bed.stored(part.deepest);
    sum.force += bed.force(part.deepest) * (part.edge ? Vec3(lift.normalized()) : part.normal);
  }
  return sum;
}

/// What the columns push a block with across the face's normal, where the block reaches past an edge, is what
/// their energy falls by as it moves. By its facets, of which one is not seen from the face, it was pushed
/// along the edge, too.
TEST(Bed, AtAnEdgeTheForceIsTheEnergysGradient) {
  const Vec3 place(0.3, -0.1, -0.05);
  const AtEdge here = bed_at_edge(place);
  ASSERT_TRUE(here.edge);
  for (int i = 0; i < 2; ++i) {
    const Vec3 step = 1e-5 * Vec3::Unit(i);
    const double slope = (bed_at_edge(place + step).energy - bed_at_edge(place - step).energy) / 2e-5;
    EXPECT_NEAR(here.force[i], -slope, 2e-3 * here.force.norm()) << i;
  }
}

TEST(Bed, ForceIsTheWorksDerivativeWhereATriangleYieldsInPart) {
  const Column c{0.1, {-0.004, 0.003, 0.012}, {-0.004, 0.003, 0.008}, {}, up};
  const Bed bed({c}, up, 0.012, k, yield, 0.012, 0);
  for (const double x : {0.005, 0.01, 0.0125, 0.016, 0.03}) {
    const double d = 1e-6;
    EXPECT_NEAR(bed.force(x), (bed.work(x + d) - bed.work(x - d)) / (2 * d), 1e-6 * bed.force(0.03));
    EXPECT_NEAR(bed.slope(x), (bed.force(x + d) - bed.force(x - d)) / (2 * d), 1e-3 * k * c.area);
  }
  EXPECT_NEAR(bed.force(0.03), p * c.area, 1e-6);
}

TEST(Bed, StripOverlappedFromTheSideIsNoColumn) {
  EXPECT_EQ(sunk_area(5e-4), 0);
  EXPECT_NEAR(sunk_area(0.1), 0.05, 1e-12);
}

TEST(Hertz, TakesOffWhatTheTouchedCellGivesItself) {
  ContactLaw hertz;
  hertz.kind = ContactLaw::Kind::hertz;
  NormalLaw law;
  law.law = &hertz;
  law.stiffness = 1.6e10;
  law.relief = 3e-9;
  for (const double f : {0.1, 1.0, 5.0, 50.0}) {
    const double s = std::pow(f / law.stiffness, 2.0 / 3),
                 x = s - law.relief * f;  // the cell's own way is not the spring's
    EXPECT_NEAR(law.force(x), f, 1e-9 * f);
    const double d = 1e-5 * x;
    EXPECT_NEAR(law.slope(x), (law.force(x + d) - law.force(x - d)) / (2 * d), 1e-6 * law.slope(x));
    EXPECT_NEAR(law.force(x), (law.work(x + d) - law.work(x - d)) / (2 * d), 1e-6 * f);
  }
  // Far beyond, where the cell would give more than Hertz's law itself, half of the tangent is left, and
  // force goes on being the work's derivative.
  for (const double x : {1e-4, 1e-3}) {
    const double d = 1e-6 * x;
    EXPECT_NEAR(law.slope(x), (law.force(x + d) - law.force(x - d)) / (2 * d), 1e-5 * law.slope(x));
    EXPECT_NEAR(law.force(x), (law.work(x + d) - law.work(x - d)) / (2 * d), 1e-5 * law.force(x));
  }
}

TEST(Bed, WorkIsTheIntegralOfTheForceAlongAFacet) {
  std::vector<Column> c = wedge();
  const Vec3 lift = Vec3(0.5, 0, 1), normal = lift.normalized();
  for (Column& q : c) q.lift = lift;
  const Bed bed(c, normal, 0.04, k, yield, 0.04, 0);
  const int n = 2000;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += bed.force(0.04 + 0.01 * (i + 0.5) / n) * 0.01 / n;
  EXPECT_NEAR(bed.work(0.05) - bed.work(0.04), sum, 1e-6 * sum);
}

}  // namespace
}  // namespace talus::contact

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "fem/rebar/rebar_embed.hpp"
#include "fem/rebar/rebar_geometry.hpp"

namespace talus::rebar {
namespace {

const char* const good = R"(# two bars
bar,diameter,x,y,z,grade,prestress
A, 0.025, 0.1, 0.1, 0.05, B500B, 0
A, 0.025, 0.1, 0.1, 1.95, B500B, 0

T1,0.016,0.5,0.5,0.05,Y1860,1e9
T1,0.016,0.6,0.5,1.00,Y1860,1e9
T1,0.016,0.5,0.5,1.95,Y1860,1e9
)";

std::vector<Problem> problems_of(const std::string& text) {
  try {
    parse_bars(text, "bars.csv");
  } catch (const InputError& e) { return e.problems(); }
  return {};
}

TEST(RebarFile, ReadsPolylines) {
  const auto bars = parse_bars(good, "bars.csv");
  ASSERT_EQ(bars.size(), 2u);
  EXPECT_EQ(bars[0].name, "A");
  EXPECT_NEAR(bars[0].length(), 1.9, 1e-12);
  EXPECT_EQ(bars[1].points.size(), 3u);
  EXPECT_EQ(bars[1].steel.prestress, 1e9);
  EXPECT_EQ(bars[1].line, 6);
  EXPECT_NEAR(bars[0].area(), 4.9087e-4, 1e-8);
}

TEST(RebarFile, DialectsOfTablesAreOne) {
  const auto expected = parse_bars(good, "bars.csv");
  const auto same = [&](const std::string& text) {
    const auto bars = parse_bars(text, "bars.csv");
    ASSERT_EQ(bars.size(), expected.size());
    for (std::size_t i = 0; i < bars.size(); ++i) {
      EXPECT_EQ(bars[i].points, expected[i].points);
      EXPECT_EQ(bars[i].diameter, expected[i].diameter);
      EXPECT_EQ(bars[i].steel.prestress, expected[i].steel.prestress);
    }
  };
  std::string semicolons, quoted, capitals = good;
  for (const char c : std::string(good)) {
    semicolons += c == ',' ? ';' : c == '.' ? ',' : c;
    quoted += c == ',' ? std::string("\",\"") : c == '.' ? std::string(",") : std::string(1, c);
  }
  std::string in_quotes;
  std::istringstream lines(quoted);
  for (std::string line; std::getline(lines, line);)
    in_quotes += line.empty() || line[0] == '#' ? line + "\n" : "\"" + line + "\"\n";
  capitals.replace(capitals.find("bar,diameter,x"), 14, "Bar,Diameter,X");
  same(semicolons);
  same(in_quotes);
  same(capitals);
  // Commas both between numbers and within them: as many as a reader would cut.
  const auto p = problems_of("bar,diameter,x,y,z,grade\nA,0,025,0,1,0,1,0,05,B500\n");
  ASSERT_EQ(p.size(), 1u);
  EXPECT_NE(p[0].remedy.find("are the commas decimal ones?"), std::string::npos);
  // A table of something else is one mistake.
  const auto other = problems_of("these are\nno bars\n");
  ASSERT_EQ(other.size(), 1u);
  EXPECT_NE(other[0].value.find("bar, diameter, x, y, z, grade"), std::string::npos);
}

TEST(RebarFile, EveryBadLineIsNamed) {
  const auto p = problems_of(
      "bar,diameter,x,y,z,grade\nA,25,0,0,0,B500\nB,0.02,0,0,zero,B500\nC,0.02,0,0,0,Q9\nC,0.02,0,0,1,Q9\nD,"
      "0.02,0,0,0,B500\nE,0.02,0,0,0,B500\nE,0.02,0,0\n");
  ASSERT_GE(p.size(), 5u);
  EXPECT_EQ(p[0].line, 2);
  EXPECT_NE(p[0].remedy.find("metres"), std::string::npos);
  EXPECT_EQ(p[1].line, 3);
  EXPECT_EQ(p[1].column, 12);
  EXPECT_EQ(p[2].line, 4);
  EXPECT_NE(p[2].remedy.find("B500"), std::string::npos);
  EXPECT_EQ(p[3].line, 8);
  bool named = false;
  for (const auto& x : p) named = named || x.key == "bar D";
  EXPECT_TRUE(named);  // a bar of one point
}

TEST(RebarFile, PrestressBeyondYieldIsToldByItsColumn) {
  const auto p =
      problems_of("bar,diameter,x,y,z,grade,prestress\nA,0.02,0,0,0,B500B,9e8\nA,0.02,0,0,1,B500B,9e8\n");
  ASSERT_GE(p.size(), 1u);
  EXPECT_EQ(p[0].key, "bar A prestress");
  EXPECT_EQ(p[0].line, 2);
  EXPECT_EQ(p[0].column, 20);
}

TEST(RebarFile, HeaderAndOrder) {
  EXPECT_EQ(problems_of("bar,diameter,x,y,grade\n").size(), 1u);
  EXPECT_EQ(problems_of("bar,diameter,x,y,z,grade,colour\n")[0].value, "colour");
  EXPECT_FALSE(problems_of("").empty());
  EXPECT_FALSE(problems_of("bar,diameter,x,y,z,grade\n").empty());
  const auto split = problems_of(
      "bar,diameter,x,y,z,grade\nA,.02,0,0,0,B500\nA,.02,0,0,1,B500\nB,.02,0,0,0,B500\nB,.02,0,0,1,B500\nA,."
      "02,0,0,2,B500\n");
  ASSERT_EQ(split.size(), 1u);
  EXPECT_EQ(split[0].line, 6);
  EXPECT_THROW(read_bars("/nonexistent/bars.csv"), InputError);
}

TEST(RebarRules, RectangularSection) {
  Member m;
  m.width = 0.8;
  m.depth = 0.5;
  m.length = 6;
  m.base = {1, 2, 3};
  const auto bars = longitudinal_bars(m, {12, 0.025, 0.04, 0.010, {}});
  ASSERT_EQ(bars.size(), 12u);
  const double x = 0.4 - 0.0625, y = 0.25 - 0.0625;
  Vec3 centre = Vec3::Zero();
  std::set<std::pair<long, long>> distinct;
  for (const Bar& b : bars) {
    const Vec3 r = b.points[0] - m.base;
    EXPECT_LE(std::abs(r.x()), x + 1e-12);
    EXPECT_LE(std::abs(r.y()), y + 1e-12);
    EXPECT_TRUE(std::abs(std::abs(r.x()) - x) < 1e-12 || std::abs(std::abs(r.y()) - y) < 1e-12);
    centre += r / 12;
    distinct.insert({std::lround(r.x() * 1e6), std::lround(r.y() * 1e6)});
  }
  EXPECT_EQ(distinct.size(), 12u);
  EXPECT_NEAR(centre.head<2>().norm(), 0, 1e-12);  // symmetric
  const auto ties = stirrups(m, {0.010, 0.04, 0.2, {}});
  EXPECT_EQ(ties.size(), 30u);
  EXPECT_NEAR(ties[0].length(), 2 * (0.71 + 0.41), 1e-12);
  EXPECT_NEAR(ties[0].points[0].z() - 3, 0.1, 1e-12);
  EXPECT_NEAR(ties.back().points[0].z() - 3, 5.9, 1e-12);
}

TEST(RebarRules, RoundSectionAndErrors) {
  Member m;
  m.section = Member::Section::round;
  m.width = 1.2;
  m.length = 10;
  const auto bars = longitudinal_bars(m, {16, 0.028, 0.05, 0.012, {}});
  ASSERT_EQ(bars.size(), 16u);
  for (const Bar& b : bars) EXPECT_NEAR(b.points[0].head<2>().norm(), 0.6 - 0.05 - 0.012 - 0.014, 1e-12);
  EXPECT_THROW(longitudinal_bars(m, {3, 0.028, 0.05, 0, {}}), InputError);
  EXPECT_THROW(longitudinal_bars(m, {8, 0.028, 0.6, 0, {}}), InputError);
  EXPECT_THROW(stirrups(m, {0.012, 0.05, 0, {}}), InputError);
}

// 2 r sin(pi / n) apart on a circle of r = 0.524 m: 0.0284 m for 116 bars, 0.0279 m for 118.
TEST(RebarRules, BarsDoNotLieInOneAnother) {
  Member m;
  m.section = Member::Section::round;
  m.width = 1.2;
  m.length = 10;
  EXPECT_NO_THROW(longitudinal_bars(m, {116, 0.028, 0.05, 0.012, {}}));
  EXPECT_THROW(longitudinal_bars(m, {118, 0.028, 0.05, 0.012, {}}), InputError);
  m.section = Member::Section::rectangular;  // sides of 0.9 m between the outer bars: 22 gaps of 40.9 mm
                                             // each, and 23 of 39.1 mm
  m.width = m.depth = 1.04;
  EXPECT_NO_THROW(longitudinal_bars(m, {4 * 22, 0.040, 0.05, 0, {}}));
  EXPECT_THROW(longitudinal_bars(m, {4 * 23, 0.040, 0.05, 0, {}}), InputError);
}

struct Mesh {
  std::vector<Vec3> nodes;
  std::vector<std::array<int, 8>> hexes;
};

/// Box of n cells, interior nodes displaced.
Mesh box(int nx, int ny, int nz, const Vec3& size, double distortion) {
  Mesh m;
  const auto id = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) {
        Vec3 p(size.x() * i / nx, size.y() * j / ny, size.z() * k / nz);
        const bool inner = i > 0 && i < nx && j > 0 && j < ny && k > 0 && k < nz;
        if (inner)
          p += distortion *
               Vec3(std::sin(3.0 * id(i, j, k)), std::cos(5.0 * id(i, j, k)), std::sin(7.0 * id(i, j, k)));
        m.nodes.push_back(p);
      }
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        m.hexes.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                           id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                           id(i, j + 1, k + 1)});
  return m;
}

Bar straight(const Vec3& a, const Vec3& b, const std::string& name = "A") {
  Bar bar;
  bar.name = name;
  bar.diameter = 0.02;
  bar.points = {a, b};
  bar.steel.rate_effect = false;
  return bar;
}

TEST(Embed, PiecesCoverTheBarAndLieWhereTheyShould) {
  for (const double distortion : {0.0, 0.03}) {
    const Mesh m = box(4, 3, 5, {1, 1, 2}, distortion);
    const auto host = host_search(m.nodes, m.hexes);
    const std::vector<Bar> bars{
        straight({0.1, 0.15, 0}, {0.93, 0.7, 2}),
        straight({0.25, 1.0 / 3, 0.0}, {0.25, 1.0 / 3, 2}, "along an edge of the cells"),
        straight({0, 0, 0}, {1, 0, 0}, "on the surface"), straight({0, 0, 0}, {1, 1, 2}, "diagonal")};
    const auto segments = embed(bars, host);
    std::vector<double> covered(bars.size(), 0.0);
    for (const Segment& s : segments) {
      Vec3 a = Vec3::Zero(), b = Vec3::Zero();
      for (int i = 0; i < 8; ++i) {
        a += s.start[i] * m.nodes[m.hexes[s.cell][i]];
        b += s.end[i] * m.nodes[m.hexes[s.cell][i]];
      }
      const Vec3 p = bars[s.bar].points[0], e = (bars[s.bar].points[1] - p).normalized();
      EXPECT_LE((p + e * s.arc - a).norm(), 3e-6);
      EXPECT_LE((p + e * (s.arc + s.length) - b).norm(), 3e-6);
      covered[s.bar] += s.length;
    }
    for (std::size_t i = 0; i < bars.size(); ++i)
      EXPECT_NEAR(covered[i] / bars[i].length(), 1, 1e-7) << bars[i].name;
  }
  const Mesh regular = box(4, 1, 1, {1, 1, 1}, 0);
  const auto segments =
      embed({straight({0.05, 0.5, 0.5}, {0.95, 0.5, 0.5})}, host_search(regular.nodes, regular.hexes));
  ASSERT_EQ(segments.size(), 4u);
  EXPECT_NEAR(segments[0].length, 0.20, 1e-8);
  EXPECT_NEAR(segments[1].length, 0.25, 1e-8);
}

TEST(Embed, CoordinatesFarFromTheOrigin) {
  for (const double far : {200.4, 1e6}) {
    Mesh m = box(8, 8, 8, {2, 2, 2}, 0);
    const Vec3 shift(far, 210.4, 66.5);
    for (Vec3& x : m.nodes) x += shift;
    double covered = 0;
    for (const Segment& s : embed({straight(shift + Vec3(0.1, 0.1, 0.02), shift + Vec3(0.1, 0.1, 1.98))},
                                  host_search(m.nodes, m.hexes)))
      covered += s.length;
    EXPECT_NEAR(covered, 1.96, 1e-6) << far;
  }
}

TEST(Embed, BarsOutsideAreNamed) {
  const Mesh m = box(4, 3, 5, {1, 1, 2}, 0);
  try {
    Bar poking = straight({0.5, 0.5, 0.5}, {0.5, 0.5, 2.5}, "P7");
    poking.file = "bars.csv";
    poking.line = 12;
    embed({straight({0.1, 0.1, 0.1}, {0.9, 0.9, 1.9}), poking, straight({5, 5, 5}, {6, 6, 6}, "far")},
          host_search(m.nodes, m.hexes), "structure.P1.rebar");
    FAIL() << "accepted";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 2u);
    EXPECT_EQ(e.problems()[0].key, "structure.P1.rebar bar P7");
    EXPECT_EQ(e.problems()[0].line, 12);
    EXPECT_EQ(e.problems()[1].key, "structure.P1.rebar bar far");
  }
}

/// From the nodes of the mesh to these places, four components a node.
std::vector<double> displacement(const Mesh& m, const std::vector<Vec3>& at) {
  std::vector<double> u(4 * at.size(), 0.0);
  for (std::size_t i = 0; i < at.size(); ++i)
    for (int c = 0; c < 3; ++c) u[4 * i + static_cast<std::size_t>(c)] = at[i][c] - m.nodes[i][c];
  return u;
}

TEST(EmbeddedBars, ForceIsTheGradientOfTheEnergyAndBalances) {
  const Mesh m = box(2, 2, 3, {1, 1, 2}, 0.05);
  std::vector<Bar> bars{straight({0.1, 0.15, 0.1}, {0.93, 0.7, 1.9}),
                        straight({0.2, 0.8, 0.05}, {0.7, 0.3, 1.7}, "B")};
  bars[1].steel.prestress = 200e6;
  const EmbeddedBars embedded(bars, embed(bars, host_search(m.nodes, m.hexes)), m.nodes, m.hexes);
  const std::size_t n = embedded.segments().size();
  std::vector<Vec3> x = m.nodes;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] += 5e-4 * Vec3(std::sin(1.0 * i), std::cos(2.0 * i), std::sin(3.0 * i));
  const auto run = [&](const std::vector<Vec3>& at, std::vector<double>* force) {
    auto state = embedded.initial_states();
    std::vector<double> strain(n, 0.0), f(4 * at.size(), 0.0);
    std::vector<int> changed;
    const auto sums =
        embedded.forces(displacement(m, at).data(), 0, state, strain, state, strain, changed, f.data());
    EXPECT_TRUE(changed.empty());
    if (force) *force = f;
    return sums.energy;
  };
  std::vector<double> force;
  run(x, &force);
  Vec3 total = Vec3::Zero(), moment = Vec3::Zero();
  double scale = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 f(force[4 * i], force[4 * i + 1], force[4 * i + 2]);
    total += f;
    moment += x[i].cross(f);
    scale = std::max(scale, f.norm());
    for (int c = 0; c < 3; ++c) {
      auto up = x, down = x;
      up[i][c] += 1e-7;
      down[i][c] -= 1e-7;
      EXPECT_NEAR((run(up, nullptr) - run(down, nullptr)) / 2e-7, f[c], 1e-4 * 1e5);
    }
  }
  EXPECT_LE(total.norm(), 1e-10 * scale);
  EXPECT_LE(moment.norm(), 1e-10 * scale);
  // A rigid rotation leaves only the prestress: the same energy as at rest.
  std::vector<Vec3> turned = m.nodes;
  const Mat3 rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (Vec3& p : turned) p = rotation * p + Vec3(1, 2, 3);
  EXPECT_NEAR(run(turned, nullptr) / run(m.nodes, nullptr), 1, 1e-9);
}

TEST(EmbeddedBars, WhatIsNotDeformedHasNoStrainToTheLastBit) {
  const Mesh m = box(2, 2, 2, {1, 1, 1}, 0.05);
  std::vector<Bar> bars;
  for (int i = 0; i < 200; ++i)
    bars.push_back(straight(
        {0.5 + 0.3 * std::sin(1.0 * i), 0.5 + 0.3 * std::cos(2.0 * i), 0.2 + 0.1 * std::sin(3.0 * i)},
        {0.5 + 0.3 * std::cos(5.0 * i), 0.5 + 0.3 * std::sin(7.0 * i), 0.8 + 0.1 * std::cos(11.0 * i)}));
  const EmbeddedBars embedded(bars, embed(bars, host_search(m.nodes, m.hexes)), m.nodes, m.hexes);
  auto state = embedded.initial_states();
  const std::vector<double> still(4 * m.nodes.size(), 0.0);
  std::vector<double> strain(state.size(), 0.0), host, force(still);
  std::vector<int> changed;
  embedded.forces(still.data(), 0, state, strain, state, strain, changed, force.data());
  EXPECT_EQ(strain, std::vector<double>(state.size(), 0.0));
  EXPECT_EQ(force, still);
  embedded.host_strains(still.data(), host);
  EXPECT_EQ(host, std::vector<double>(state.size(), 0.0));
}

TEST(EmbeddedBars, UniformStretchYieldsAndMassIsComplete) {
  const Mesh m = box(1, 1, 4, {0.4, 0.4, 2}, 0);
  const std::vector<Bar> bars{straight({0.1, 0.1, 0}, {0.1, 0.1, 2})};
  const EmbeddedBars embedded(bars, embed(bars, host_search(m.nodes, m.hexes)), m.nodes, m.hexes);
  auto state = embedded.initial_states();
  std::vector<double> strain(state.size(), 0.0), force(4 * m.nodes.size(), 0.0);
  std::vector<int> changed;
  std::vector<Vec3> x = m.nodes;
  for (Vec3& p : x) p.z() *= 1.001;
  embedded.forces(displacement(m, x).data(), 0, state, strain, state, strain, changed, force.data());
  double top = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (m.nodes[i].z() == 2) top += force[4 * i + 2];
  EXPECT_NEAR(top, 200e9 * 0.001 * bars[0].area(), 1);
  for (Vec3& p : x) p.z() *= 1.01;
  EXPECT_TRUE(changed.empty());
  embedded.forces(displacement(m, x).data(), 0, state, strain, state, strain, changed, force.data());
  EXPECT_EQ(changed, (std::vector<int>{0, 1, 2, 3}));
  std::vector<double> mass(m.nodes.size(), 0.0);
  embedded.add_mass(7850, mass);
  double sum = 0;
  for (const double v : mass) sum += v;
  EXPECT_NEAR(sum, 7850 * bars[0].area() * 2, 1e-7);  // cuts are found to 1e-9 of the bar
}

}  // namespace
}  // namespace talus::rebar

// Springs whose contact features take each other's place: over a ridge between two triangles, over the edge
// of a table, from corner to corner, from an edge to a face. Energy is made at no change, and the ledger
// names what becomes of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::stress {
namespace {

using verify::SceneText;

struct Swap {
  const char* name;
  const char* stiffness;
  double friction;
  std::string bodies;
  double taken = 1;    // largest numerical energy error, of the energy in motion
  double made = 1e-4;  // the same, between two rows; a table's edge that springs leave within a step is a
                       // stated limit (docs/theory/contact.md)
  double chord = 0;    // of strains that oscillate faster than steps in flight a row within a step knows the
                       // chord alone, whose energy is less: part of the energy in motion that they hold
};

const std::string ridge =
    "[site]\nmaterial = \"ground\"\ncrest = [-4.0, 0.0, 2.0]\ndip_direction = \"90 deg\"\nwidth = 20.0\n"
    "[[site.face]]\ndip = \"20 deg\"\nlength = 4.0\n[[site.face]]\ndip = \"5 deg\"\nlength = "
    "3.0\n[[site.face]]\ndip = \"35 deg\"\nlength = 6.0\n"
    "[[block]]\nname = \"box\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.0, 0.8, 0.6]\nposition = "
    "[-2.2, 0.1, 1.75]\nvelocity = [2.0, 0.0, -0.7]\n"
    "orientation = { rotation_vector = [0.0, 0.349, 0.0] }\n";
const std::string table =
    "[[block]]\nname = \"table\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [2.0, 2.0, 1.0]\nposition = "
    "[0.0, 0.0, -0.5]\nfixed = true\n"
    "[[plane]]\npoint = [0.0, 0.0, -1.0]\nnormal = [0.0, 0.0, 1.0]\nmaterial = \"ground\"\n"
    "[[block]]\nname = \"bar\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.2, 0.3, 0.3]\nposition = "
    "[0.5, 0.2, 0.151]\nvelocity = [1.0, 0.3, 0.0]\n"
    "orientation = { rotation_vector = [0.0, 0.0, 0.3] }\n";
const std::string level =
    "[[plane]]\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\nmaterial = \"ground\"\n";
const std::string roller = level +
                           "[[block]]\nname = \"roller\"\nmaterial = \"rock\"\nshape = "
                           "\"dodecahedron\"\nvolume = 0.5\nposition = [0.0, 0.0, 0.6]\n"
                           "velocity = [4.0, 0.0, 0.0]\nspin = [0.0, 6.0, 1.0]\n";
// Lands on an edge, which becomes a face: its tributary area grows by the hundred.
const std::string edge_first = level +
                               "[[block]]\nname = \"hit\"\nmaterial = \"rock\"\nshape = "
                               "\"icosahedron\"\nmass = 4000.0\nposition = [0.0, -5.06, 1.577]\n"
                               "velocity = [0.0, -3.064, -9.232]\nspin = [-3.033, 0.0, 2.309]\norientation = "
                               "{ quaternion = [-0.4561059818521242, -0.8899254650355332, 0.0, 0.0] }\n";

// Lands flat on another's corner: that corner and its edges press on the falling one's face, which turns over
// them a depth inside.
const std::string overhang =
    "[[block]]\nname = \"below\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [2.0, 2.0, 2.0]\nposition = "
    "[0.0, 0.0, 1.0]\nfixed = true\n" +
    level +
    "[[block]]\nname = \"hit\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.6, 0.6, 0.6]\nposition = "
    "[1.05, 1.05, 2.4]\nvelocity = [0.0, 0.0, -7.0]\n"
    "orientation = { rotation_vector = [0.0, 0.0, 0.5] }\n";

std::ostream& operator<<(std::ostream& out, const Swap& swap) { return out << swap.name; }

class SpringSwaps : public testing::TestWithParam<Swap> {};

TEST_P(SpringSwaps, MakeNoEnergy) {
  const Swap& swap = GetParam();
  SceneText text(verify::Method::by_accuracy(1e-3), 1.0);
  text.history(0.002).material("rock", 2600, "young = 30e9\npoisson = 0.25\n").material("ground", 2600);
  text.interface("*", "*", swap.friction, swap.stiffness).raw(swap.bodies);
  const verify::Outcome o = verify::run_scene(text.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  double in_motion = 0, growth = 0, residual = 0, friction_back = 0;
  for (const sim::HistoryRow& r : o.rows) in_motion = std::max(in_motion, r.ledger.kinetic);
  const auto energy = [](const sim::HistoryRow& r) {
    return r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
  };
  for (std::size_t i = 0; i < o.rows.size(); ++i) {
    residual = std::max(residual, std::abs(o.rows[i].ledger.residual));
    if (i == 0) continue;
    growth = std::max(growth, energy(o.rows[i]) - energy(o.rows[i - 1]));
    friction_back =
        std::max(friction_back, o.rows[i - 1].ledger.friction_work - o.rows[i].ledger.friction_work);
  }
  EXPECT_LE(growth, (swap.made + swap.chord) * in_motion);
  if (swap.chord > 0) {
    EXPECT_LE(o.result.counters.gained, swap.made * in_motion);  // from step to step
  }
  EXPECT_LE(residual, 1e-4 * in_motion);
  EXPECT_LE(friction_back, 1e-4 * in_motion);
  EXPECT_LE(std::abs(o.last().ledger.numerical_dissipation()), swap.taken * in_motion);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, SpringSwaps,
    testing::Values(Swap{"RidgePerPoint", "normal_stiffness = \"1e7 N/m\"", 0, ridge, 1e-3},
                    Swap{"RidgePerArea", "normal_stiffness = \"1e8 Pa/m\"", 0, ridge, 1e-2},
                    Swap{"RidgePerAreaRough", "normal_stiffness = \"1e8 Pa/m\"", 0.5, ridge, 0.2},
                    Swap{"TableEdgePerPoint", "normal_stiffness = \"1e7 N/m\"", 0, table, 0.03, 0.03},
                    Swap{"TableEdgePerArea", "normal_stiffness = \"1e8 Pa/m\"", 0, table, 0.2, 0.03},
                    Swap{"RollingPerArea", "normal_stiffness = \"1e8 Pa/m\"", 1, roller, 1e-3},
                    Swap{"RollingPerPoint", "normal_stiffness = \"1e7 N/m\"", 1, roller, 0.05},
                    Swap{"EdgeFirst", "", 0.6, edge_first, 0.05, 1e-4, 2e-3},
                    Swap{"OverhangPerArea", "normal_stiffness = \"2e8 Pa/m\"", 5, overhang, 2e-3},
                    Swap{"OverhangStiffShear",
                         "normal_stiffness = \"2e8 Pa/m\"\nshear_stiffness = \"2e9 Pa/m\"", 0.6, overhang,
                         2e-3},
                    Swap{"OverhangPerPoint", "normal_stiffness = \"5e7 N/m\"", 0.6, overhang, 2e-3}),
    [](const auto& info) { return std::string(info.param.name); });

// A cube that tumbles over its edges on springs that steps do not resolve: what these leave between the
// springs and their geometry is led out. At a thousandth of the speeds that is 0.1 mm in a long step; springs
// pressed by as much would hold 4 and 40 kJ, out of nothing.
TEST(SpringSwaps, StiffSpringsAreLedOutQuietly) {
  for (const char* stiffness : {"7.4e11 N/m", "7.4e12 N/m"}) {
    SceneText text(verify::Method::by_accuracy(1e-3), 2.5);
    text.history(0.05)
        .material("rock", 2600)
        .material("ground", 2600)
        .interface("*", "*", 10,
                   "normal_stiffness = \"" + std::string(stiffness) +
                       "\"\ndamping_ratio = 1.0\nrestitution = 0.00944");
    text.raw(level).box(
        "B", Vec3::Constant(0.51999139202540545),
        Vec3(0.042224847211226546, -0.0054227393131504043, 2.9451489471578149),
        verify::turned(Vec3(-0.53212839959550784, -0.19009272671223698, 0.89048326697320845)));
    const verify::Outcome o = verify::run_scene(text.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    double in_motion = 0, growth = 0;
    const auto energy = [](const sim::HistoryRow& r) {
      return r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
    };
    for (std::size_t i = 0; i < o.rows.size(); ++i) {
      in_motion = std::max(in_motion, o.rows[i].ledger.kinetic);
      if (i > 0) growth = std::max(growth, energy(o.rows[i]) - energy(o.rows[i - 1]));
    }
    EXPECT_LE(growth, 1e-4 * in_motion) << stiffness;
  }
}

// Soft springs without friction or damping give back what a drop puts into them, whatever comes down first.
std::string drop_shape(int shape) {
  const auto hull = [](int points, const auto& at) {
    std::string list;
    for (int i = 0; i < points; ++i) list += (i > 0 ? ", " : "") + verify::vector(at(i));
    return "shape = \"convex\"\nvertices = [" + list + "]\n";
  };
  switch (shape) {
    case 0: return "shape = \"box\"\nsize = [1.0, 1.0, 1.0]\n";
    case 1: return "shape = \"box\"\nsize = [1.5, 1.0, 0.4]\n";
    case 2: return "shape = \"icosahedron\"\nvolume = 1.0\n";
    case 3: return "shape = \"tetrahedron\"\nvolume = 1.0\n";
    case 4:
      return hull(12, [](int i) {
        return Vec3(0.6 * std::cos(M_PI * i / 3), 0.6 * std::sin(M_PI * i / 3), i < 6 ? -0.6 : 0.6);
      });
    default:  // near to a ball
      return hull(60, [](int i) {
        const double z = 1 - (2 * i + 1) / 60.0, a = i * M_PI * (3 - std::sqrt(5.0)),
                     r = std::sqrt(1 - z * z);
        return Vec3(0.6 * r * std::cos(a), 0.6 * r * std::sin(a), 0.6 * z);
      });
  }
}

class SoftDrops : public testing::TestWithParam<const char*> {};

TEST_P(SoftDrops, GiveTheirEnergyBack) {
  const Vec3 turns[] = {Vec3(0, 0, 0), Vec3(0.7, 0.4, -0.2), Vec3(-1.1, 0.9, 0.3), Vec3(0.3, -2.1, 1.2),
                        Vec3(M_PI / 4, 0, 0)};
  const std::string ground =
      "[[plane]]\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\nmaterial = \"ground\"\n";
  for (int shape = 0; shape < 6; ++shape)
    for (const Vec3& turn : turns) {
      SceneText text(verify::Method::by_accuracy(1e-3), 0.9);
      text.history(0.01).material("rock", 2600).material("ground", 2600).interface("*", "*", 0, GetParam());
      text.raw(ground + "[[block]]\nname = \"B\"\nmaterial = \"rock\"\n" + drop_shape(shape) +
               "position = [0.0, 0.0, 1.4]\n" + verify::velocity(Vec3(0.5, 0, -5)) + verify::turned(turn));
      const verify::Outcome o = verify::run_scene(text.str());
      ASSERT_TRUE(o.ok()) << o.result.message;
      double in_motion = 0, lost = 0;
      for (const sim::HistoryRow& r : o.rows) {
        in_motion = std::max(in_motion, r.ledger.kinetic);
        lost = std::max(lost,
                        std::abs(r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact -
                                 o.rows.front().ledger.kinetic - o.rows.front().ledger.potential));
      }
      EXPECT_LE(lost, 2e-3 * in_motion) << "shape " << shape << " turned by " << turn.transpose();
    }
}

INSTANTIATE_TEST_SUITE_P(Stiffness, SoftDrops,
                         testing::Values("normal_stiffness = \"2e6 Pa/m\"", "normal_stiffness = \"1e7 Pa/m\"",
                                         "normal_stiffness = \"1e8 Pa/m\"", "normal_stiffness = \"1e9 Pa/m\"",
                                         "normal_stiffness = \"1e6 N/m\"", "normal_stiffness = \"1e8 N/m\""));

}  // namespace
}  // namespace talus::stress

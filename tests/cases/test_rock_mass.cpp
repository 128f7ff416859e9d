// Rock masses and terrain as a scene gives them, run.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "geometry/block_output.hpp"
#include "verify/suite.hpp"

namespace talus::verify {
namespace {

constexpr double pi = 3.14159265358979323846;

/// A file beside the test, removed at the end.
struct File {
  File(const std::string& name, const std::string& text)
      : path((std::filesystem::temp_directory_path() /
              ("talus_mass_" + std::to_string(::getpid()) + "_" + name))
                 .string()) {
    std::ofstream(path) << text;
  }
  ~File() { std::filesystem::remove(path); }
  std::string path;
};

std::string head(double duration, const Vec3& gravity) {
  return "schema = 1\n[simulation]\nduration = " + std::to_string(duration) + "\ngravity = [" +
         std::to_string(gravity.x()) + ", " + std::to_string(gravity.y()) + ", " +
         std::to_string(gravity.z()) +
         "]\n[output]\nhistory_interval = \"0.01 s\"\n[[material]]\nname = \"rock\"\ndensity = 2500\n";
}

/// Two slabs of 1 x 1 x 0.5 m, one on the other, on a level plane that holds the lower one. The joint between
/// them is a disc of radius 0.3 m; the rock around it, 1 - 0.09 pi m2 (the disc's polygon has its area), is a
/// bridge.
std::string bridged(const Vec3& gravity, double tension, double shear) {
  return head(0.1, gravity) +
         "[[plane]]\nnormal = [0, 0, 1]\nmaterial = \"ground\"\n"
         "[[interface]]\nbetween = [\"rock\", \"rock\"]\nfriction = 0.3\nnormal_stiffness = \"hard\"\n"
         "[[interface]]\nbetween = [\"rock\", \"ground\"]\nfriction = 5.0\ncohesion = \"10 MPa\"\ntension = "
         "\"10 MPa\"\nnormal_stiffness = \"hard\"\n"
         "[rock_mass]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\nmaterial = \"rock\"\n"
         "[[rock_mass.joint]]\norientation = \"0/0\"\nthrough = [0.5, 0.5, 0.5]\nradius = 0.3\nbond_tension "
         "= " +
         std::to_string(tension) + "\nbond_shear = " + std::to_string(shear) + "\n";
}

constexpr double bridge = 1 - 0.09 * pi, upper_mass = 1250;

/// Path of the upper slab and its mean acceleration over the second half of the run: a bridge that fails
/// holds to the end of its step.
struct Motion {
  double path, acceleration;
};
Motion of_upper(const std::string& scene) {
  const Outcome o = run_scene(scene);
  EXPECT_TRUE(o.ok());
  EXPECT_EQ(o.last().position.size(), 2u);
  const sim::HistoryRow &start = o.rows.front(), &middle = o.rows[o.rows.size() / 2], &end = o.rows.back();
  return {(end.position[1] - start.position[1]).norm(),
          (end.velocity[1] - middle.velocity[1]).norm() / (end.time - middle.time)};
}

}  // namespace

TEST(RockBridge, ShearsAtItsStrengthAndSlidesAfterwards) {
  // At rest while m g sin a <= c A + mu m g cos a, with a = 30 degrees.
  const double c = 1e4, s = std::sin(pi / 6), k = std::cos(pi / 6),
               limit = c * bridge / (upper_mass * (s - 0.3 * k));
  for (const double share : {0.98, 1.02}) {
    const double g = share * limit;
    const Motion m = of_upper(bridged({g * s, 0, -g * k}, 1e6, c));
    if (share < 1) {
      EXPECT_LT(m.path, 1e-6);
    } else {
      EXPECT_NEAR(m.acceleration, g * (s - 0.3 * k), 1e-6 * g);  // the bridge's strength is gone
    }
  }
}

TEST(RockBridge, TearsAtItsStrengthAndFallsAfterwards) {
  const double t = 1e4, limit = t * bridge / upper_mass;  // gravity upwards
  for (const double share : {0.98, 1.02}) {
    const Motion m = of_upper(bridged({0, 0, share * limit}, t, 1e6));
    if (share < 1) {
      EXPECT_LT(m.path, 1e-6);
    } else {
      EXPECT_NEAR(m.acceleration, share * limit, 1e-6 * limit);
    }
  }
}

TEST(BlockSystem, FromAFileIsTheOneThatWasCut) {
  const std::string rest =
      "[[plane]]\nnormal = [0, 0, 1]\nmaterial = \"ground\"\n[[interface]]\nbetween = [\"*\", "
      "\"*\"]\nfriction = 0.5\nnormal_stiffness = \"hard\"\n";
  const std::string joints =
      "[rock_mass]\nbox = { min = [0, 0, 0.01], max = [2, 2, 1] }\nmaterial = "
      "\"rock\"\n[[rock_mass.joint_set]]\norientation = \"267/60\"\nspacing = 0.9\n";
  geometry::CutSpec spec;
  spec.box = Box3(Vec3(0, 0, 0.01), Vec3(2, 2, 1));
  geometry::CutJointSet set;
  set.name = "J1", set.dip_direction = 267 * pi / 180, set.dip = 60 * pi / 180, set.spacing = 0.9;
  spec.joint_sets.push_back(set);
  const File file("blocks.obj", "");
  geometry::write_mesh(file.path, geometry::block_system(geometry::cut(spec)));
  const Outcome cut = run_scene(head(0.05, {0, 0, -9.81}) + rest + joints);
  const Outcome read = run_scene(head(0.05, {0, 0, -9.81}) + rest + "[rock_mass]\nblocks = \"" + file.path +
                                 "\"\nmaterial = \"rock\"\n");
  ASSERT_GT(cut.last().position.size(), 2u);
  ASSERT_EQ(cut.last().position.size(), read.last().position.size());
  for (std::size_t i = 0; i < cut.last().position.size(); ++i)
    EXPECT_LT((cut.last().position[i] - read.last().position[i]).norm(), 1e-6);
}

TEST(Ground, BlocksOfAReleaseAreaStartAboveTheSlopeOfFaces) {
  const File area("area.geojson",
                  R"({"type": "Polygon", "coordinates": [[[-5, 2], [5, 2], [5, 12], [-5, 12], [-5, 2]]]})");
  const std::string scene =
      head(0.02, {0, 0, -9.81}) +
      "[site]\ncrest = [0, 0, 50]\ndip_direction = \"0 deg\"\nwidth = 30\nmaterial = \"slope\"\nface = [{ "
      "dip = \"45 deg\", length = 20 }, { dip = \"10 deg\", length = 30 }]\n"
      "[[interface]]\nbetween = [\"*\", \"*\"]\nfriction = 0.6\nnormal_stiffness = \"hard\"\n"
      "[[block]]\nname = \"stone\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 0.6, 0.4]\nrelease = { "
      "polygon = \"" +
      area.path + "\", count = 12, height = \"0.05 m\", seed = 3 }\n";
  const Outcome first = run_scene(scene), again = run_scene(scene);
  const auto& start = first.rows.front().position;
  ASSERT_EQ(start.size(), 12u);
  EXPECT_EQ(first.simulation->header().blocks[11].name, "stone-12");
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(start[i], again.rows.front().position[i]);
    EXPECT_TRUE(start[i].x() > -5 && start[i].x() < 5 && start[i].y() > 2 && start[i].y() < 12);
    const double above = start[i].z() - (50 - start[i].y());  // the face falls at 45 degrees to the north
    EXPECT_GT(above, 0.2);                                    // half the smallest extent is least
    EXPECT_LT(above, 2.5);
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT((start[i] - start[j]).norm(), 0.8);
  }
}

}  // namespace talus::verify

/// A small scene to change, and what reading it gives.
#pragma once
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "core/error.hpp"
#include "scene/scene.hpp"

namespace talus::scene {

/// A directory with the files a scene names; removed at the end.
class Place {
 public:
  Place()
      : path_(std::filesystem::temp_directory_path() /
              ("talus-scene-" + std::to_string(::getpid()) + "-" + std::to_string(count()++))) {
    std::filesystem::create_directories(path_);
    put("slope.stl", "solid s\nendsolid s\n");
    put("mass.obj", "v 0 0 0\n");
    put("rock.obj", "v 0 0 0\n");
    put("bars.csv", "x,y,z\n");
    put("law.csv", "indentation,force\n0,0\n0.01,1e6\n0.02,1.5e6\n");
    put("turning.csv", "x,y,z,vx,vy,vz,mass,wx,wy,wz,qw,qx,qy,qz\n0,0,5,10,0,-1,2500,1,2,3,3,0,0,4\n");
    put("twice.csv", "x,y,z,vx,vy,vx,vz,mass\n0,0,5,10,0,20,-1,2500\n");
    put("half.csv", "x,y,z,vx,vy,vz,mass,wx\n0,0,5,10,0,-1,2500,1\n");
    put("paths.csv", "x,y,z,vx,vy,vz,mass\n0,0,5,10,0,-1,2500\n0,1,5,12,0,-2,3000\n");
    // As talus convert writes histories.
    put("histories.csv",
        "time [s],B1.position.x [m],B1.position.y [m],B1.position.z [m],\"B 2.position.x [m]\",B "
        "2.position.y [m],B 2.position.z [m],B1.velocity.x [m/s],B1.velocity.y [m/s],B1.velocity.z [m/s],"
        "B 2.velocity.x [m/s],B 2.velocity.y [m/s],B 2.velocity.z [m/s],B 2.spin.x [rad/s],B 2.spin.y "
        "[rad/s],B 2.spin.z [rad/s],B 2.orientation.w,B 2.orientation.x,B 2.orientation.y,B 2.orientation.z\n"
        "0,1,2,3,4,5,6,7,8,9,10,11,12,1,2,3,3,0,0,4\n0.5,-1,-2,-3,-4,-5,-6,-7,-8,-9,-10,-11,-12,0,0,0,1,0,0,"
        "0\n");
    put("still.csv", "x,y,z,vx,vy,vz,mass\n0,0,5,0,0,0,2500\n");
    put("odd.csv",
        "# rows that cannot "
        "be\nx,y,z,vx,vy,vz,wx,wy,wz,mass\n0,0,5,1e7,0,0,0,0,0,1\n0,0,5,1,0,0,0,1e200,0,1\n0,0,5,1,0,0,0,0,0,"
        "1e300\n0,0,5,1,0,0,0,0,0,1e-300\n0,-2e9,5,1,0,0,0,0,0,1\n");
    put("both.csv", "x,y,z,vx,vy,vz,mass,volume\n0,0,5,10,0,-1,2500,7\n0,0,5,10,0,-1,2500,1\n");
    put("area.geojson", "{}\n");
    std::filesystem::create_directories(path_ / "folder");
  }
  ~Place() { std::filesystem::remove_all(path_); }
  void put(const std::string& name, const std::string& text) const { std::ofstream(path_ / name) << text; }
  std::string scene() const { return (path_ / "scene.toml").string(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  static int& count() {
    static int n = 0;
    return n;
  }
  std::filesystem::path path_;
};

/// The text with the first `from` put as `to`; fails the test if it is not there.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "not in the scene: " << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

/// Everything at once: what every test starts from.
inline const std::string full = R"(schema = 1
title = "Boulder against pier P2"

[simulation]
duration = "30 s"
accuracy = 1e-3

[site]
terrain = "slope.stl"
material = "slope"

[[plane]]
point = [0.0, 0.0, -5.0]
normal = [0.0, 0.0, 2.0]
material = "slope"

[[material]]
name = "rock"
density = "2.5 t/m^3"
young = "3 GPa"
poisson = 0.3

[[material]]
name = "C40"
f_cm = "48 MPa"

[[interface]]
between = ["rock", "slope"]
friction = "28 deg"
normal_stiffness = "30 GN/m"
shear_stiffness = "3.5 GN/m"
restitution = 0.4

[[interface]]
between = ["rock", "*"]
friction = 0.5

[[interface]]
between = ["*", "*"]
friction = 0.6
normal_stiffness = "20 GPa/m"

[[block]]
name = "B1"
material = "rock"
shape = "box"
size = [4.0, 5.0, "575 cm"]
position = [0.0, 0.0, 120.0]
orientation = { dip_direction = "2 deg", dip = "29 deg" }
velocity = [0.0, 0.0, -1.0]

[rock_mass]
region = "mass.obj"
material = "rock"
[[rock_mass.joint_set]]
name = "J3"
orientation = "267/87"
spacing = "3.84 m"
[[rock_mass.joint]]
orientation = "2/29"
through = [1.0, 2.0, 3.0]

[[structure]]
name = "P2"
kind = "column"
base = [20.0, 0.0, 0.0]
section = [2.0, 2.0]
height = "12 m"
material = "C40"
cell_size = "0.25 m"
support = ["-z"]
damage = "concrete"
rebar = "bars.csv"
[[structure.probe]]
name = "top"
at = [20.0, 0.0, 12.0]
[[structure.load]]
region = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }
traction = ["2 MPa", 0.0, 0.0]
history = [[0.0, 0.0], ["5 ms", 1.0]]

[coupling]
scheme = "two-way"
audit = "strict"

[output]
interval = "0.05 s"
history_interval = "1 ms"
)";

inline constexpr double degree = std::numbers::pi / 180;

/// Place of a material in the scene.
inline int index(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.materials.size(); ++i)
    if (scene.materials[i].name == name) return static_cast<int>(i);
  ADD_FAILURE() << "no material " << name;
  return 0;
}

inline std::string text_of(const std::vector<Problem>& problems) {
  std::string all;
  for (const Problem& p : problems) all += p.str() + "\n";
  return all;
}

}  // namespace talus::scene

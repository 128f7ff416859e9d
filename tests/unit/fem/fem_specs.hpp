#pragma once
#include <array>
#include <fstream>
#include <string>
#include <vector>

#include "fem/structure_fem.hpp"

namespace talus::fem::test {

inline const Report silent = [](const std::string&) {};

/// The cells of a structure that nothing halves, with their neighbours.
inline HexMesh active_cells(const StructureSpec& spec) { return Discretisation(make_mesh(spec)).mesh(); }

/// Verification pier: 12 x 1.5 x 1.5 m, E 33.55 GPa, nu 0.2, 2450 kg/m^3.
inline StructureSpec cantilever(int across, int along) {
  StructureSpec s;
  s.name = "pier";
  s.kind = "column";
  s.young = 33.55e9;
  s.poisson = 0.2;
  s.density = 2450;
  s.size = Vec3(1.5, 1.5, 12);
  s.cells = {across, across, along};
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.gravity_preload = false;
  s.probes.push_back({"top", Vec3(0, 0, 12)});
  return s;
}

/// The table of straight bars of 20 mm, each given by its ends, in a file named after the test; its path.
inline std::string bars_of_20_mm(const std::string& test, const std::vector<std::array<Vec3, 2>>& bars) {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/" + test + ".csv";
  std::ofstream out(path);
  out << "bar,diameter,x,y,z,grade\n";
  for (std::size_t i = 0; i < bars.size(); ++i)
    for (const Vec3& x : bars[i])
      out << i + 1 << ",0.02," << x.x() << ',' << x.y() << ',' << x.z() << ",B500B\n";
  return path;
}

/// A beam of 6 x 0.3 x 0.4 m of concrete that cracks, between walls, with a bar of 20 mm in each corner.
/// Elastic, its weight w brings w L^2 / (12 W) at the walls: 1.1 MPa at 9.81 m/s^2, beyond f_t = 2.9 MPa from
/// 26 m/s^2 on.
inline StructureSpec beam_between_walls(const std::string& test, int cells_high) {
  std::vector<std::array<Vec3, 2>> bars;
  for (const double y : {-0.1, 0.1})
    for (const double z : {0.05, 0.35}) bars.push_back({Vec3(-3, y, z), Vec3(3, y, z)});
  StructureSpec s;
  s.name = "beam";
  s.kind = "box";
  s.f_cm = 38e6;
  s.poisson = 0.2;
  s.density = 2450;
  s.damage = "concrete";
  s.aggregate = 0.016;
  s.damping_ratio = 0.02;
  s.size = Vec3(6, 0.3, 0.4);
  s.cells = {40, 2, cells_high};
  s.position = Vec3(0, 0, 0.2);
  s.rebar_file = bars_of_20_mm(test, bars);
  s.supports = {{"-x", "", {}, {true, true, true}}, {"+x", "", {}, {true, true, true}}};
  return s;
}

}  // namespace talus::fem::test

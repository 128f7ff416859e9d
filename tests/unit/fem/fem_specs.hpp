#pragma once
#include "fem/structure_fem.hpp"

namespace talus::fem::test {

inline const Report silent = [](const std::string&) {};

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

}  // namespace talus::fem::test

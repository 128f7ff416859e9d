#include "fem/dealii/parts.hpp"

extern "C" __attribute__((visibility("default"))) const talus::fem::Services* talus_dealii_services() {
  static const talus::fem::Services services{talus::fem::disc_by_dealii, talus::fem::multigrid_by_trilinos, talus::fem::refine_by_dealii};
  return &services;
}

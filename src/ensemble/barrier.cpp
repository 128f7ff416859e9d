#include "ensemble/barrier.hpp"

namespace talus::ensemble {

std::vector<BarrierValue> barrier_values(const AtLine& at) {
  std::vector<BarrierValue> values;
  // Trajectories not calibrated on site, ground of good precision, block volume surveyed roughly, damage of
  // ordinary consequence.
  constexpr double trajectories = 1.10, topography = 1.02, volume = 1.10, density = 1.00, risk = 1.05;
  const double v = at.speed_95 * trajectories * topography, m = at.mass_95 * volume * density;
  values.push_back({"UNI 11211-4:2018",
                    "speed p95, mass p95, height p95",
                    {{"gamma_Tr", trajectories},
                     {"gamma_Dp", topography},
                     {"gamma_VolF", volume},
                     {"gamma_gamma", density},
                     {"gamma_R", risk}},
                    0.5 * m * v * v * risk,
                    at.height_95 * trajectories * topography});
  struct Class {
    const char* name;
    double energy, height;
  };
  for (const Class& c : {Class{"CC1", 1.00, 1.05}, Class{"CC2", 1.05, 1.10}, Class{"CC3", 1.15, 1.30}})
    values.push_back({std::string("ONR 24810:2021, ") + c.name,
                      "energy p99, height p95",
                      {{"gamma_E_kin", c.energy}, {"gamma_h", c.height}},
                      at.energy_99 * c.energy,
                      at.height_95 * c.height});
  return values;
}

}  // namespace talus::ensemble

/// Design values of a rockfall barrier at a line, by partial factors.
///
///   UNI 11211-4:2018  v_d = v_95 gamma_Tr gamma_Dp,  m_d = m_95 gamma_vol gamma_dens,
///                     E_d = m_d v_d^2 / 2 gamma_R,  h_d = h_95 gamma_Tr gamma_Dp
///   ONR 24810:2021    E_d = E_95 gamma_E,  h_d = h_95 gamma_h,  by consequence class CC1 to CC3
///
/// The factors are those commonly cited, unverified against the standards themselves; each is given by its
/// name with the results.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace talus::ensemble {

struct BarrierValue {
  std::string standard;  // "UNI 11211-4:2018", "ONR 24810:2021, CC2"
  std::vector<std::pair<std::string, double>> factors;
  double energy = 0, height = 0;  // [J], [m]
};

/// From 95th percentiles at a line of speed [m/s], mass [kg], energy [J] and height [m].
std::vector<BarrierValue> barrier_values(double speed, double mass, double energy, double height);

}  // namespace talus::ensemble

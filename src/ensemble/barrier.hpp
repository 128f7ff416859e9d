/// Design values of a rockfall barrier at a line, by partial factors.
///
///   UNI 11211-4:2018   v_d = v_95 gamma_Tr gamma_Dp,   m_d = m_95 gamma_VolF gamma_gamma,
///                      E_d = gamma_R m_d v_d^2 / 2,   h_d = h_95 gamma_Tr gamma_Dp
///   ONR 24810:2021     E_d = E_99 gamma_E_kin,   h_d = h_95 gamma_h,   by consequence class CC1 to CC3
///
/// The characteristic values of these standards are 95th and 99th percentiles of trajectories [Marchelli
/// 2022]. Which percentile goes with which quantity, and the factors, are as commonly cited, unverified
/// against the standards themselves; each is given by its name with the results.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace talus::ensemble {

/// Percentiles at a line.
struct AtLine {
  double speed_95 = 0;   // [m/s]
  double mass_95 = 0;    // [kg]
  double energy_99 = 0;  // [J]
  double height_95 = 0;  // [m]
};

struct BarrierValue {
  std::string standard;  // "UNI 11211-4:2018", "ONR 24810:2021, CC2"
  std::string from;      // the percentiles that it is made of
  std::vector<std::pair<std::string, double>> factors;
  double energy = 0, height = 0;  // [J], [m]
};

std::vector<BarrierValue> barrier_values(const AtLine& at);

}  // namespace talus::ensemble

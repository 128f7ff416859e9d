/// Timoshenko's cantilever in closed form [timoshenko1921], the reference for slender piers.
///
///   (kappa G A (w' - psi))' = rho A w_tt,   (E I psi')' + kappa G A (w' - psi) = rho I psi_tt
///   clamped at 0, free at L
///   u_tip(t) = sum_n w_n(L)^2 q_n(t),   q_n'' + omega_n^2 q_n = F(t),   with modes of unit modal mass
///
/// Frequencies are the roots of the determinant of the transfer matrix; modes follow from it. F(t) is
/// piecewise linear, so each q_n is exact.
#pragma once
#include <utility>
#include <vector>

namespace talus::verify {

struct Beam {
  double length = 0, young = 0, poisson = 0, density = 0;  // [m], [Pa], -, [kg/m^3]
  double side = 0;                                         // of the square section [m]
  double kappa = 5.0 / 6;

  double area() const { return side * side; }
  double inertia() const { return side * side * side * side / 12; }
  double shear_modulus() const { return young / (2 * (1 + poisson)); }
  /// Static deflection of the tip under a force at the tip [m].
  double tip_deflection(double force) const;
  /// Static deflection of the tip under a force per length [m].
  double uniform_deflection(double load) const;
};

struct BeamMode {
  double omega = 0;  // [rad/s]
  double tip = 0;    // w(L) at unit modal mass [kg^-1/2]
};
std::vector<BeamMode> cantilever_modes(const Beam& beam, int count);

/// Tip displacement at the given times under a tip force whose factor is piecewise linear in `history` (time,
/// force [N]) and constant after its end; at rest at the first time.
std::vector<double> tip_response(const std::vector<BeamMode>& modes,
                                 const std::vector<std::pair<double, double>>& history,
                                 const std::vector<double>& times);

/// Frequencies [Hz] of a sum of undamped sinusoids sampled with step dt, by the matrix pencil [hua1990].
/// Those above half the sampling rate must be absent.
std::vector<double> frequencies_of(const std::vector<double>& samples, double dt);

}  // namespace talus::verify

/// Laws in one dimension for steel and for what lies between steel, concrete and supports.
///
/// Bar (bilinear J2, uniaxial):
///   sigma = sigma_0 + E (eps - eps_p),  |sigma - X| <= f_y,  dX = H deps_p
///   f_y(rate) = f_y + 6 MPa ln(rate / 5e-5 1/s), at least f_y, frozen when yielding starts       [ceb187]
///   broken once the total strain beyond the initial one exceeds eps_u
///
/// symbol    meaning                                                                  unit
/// sigma_0   initial stress (prestress)                                               Pa
/// H         hardening modulus, all of it kinematic (Bauschinger effect)              Pa
/// energy    sigma^2 / (2 E) + X^2 / (2 H)                                            J/m^3
///
/// Bond (slip s of the bar against the concrete) [mc2010, 6.1.1, pull-out failure]:
///   tau = tau_max (s/s_1)^0.4, s <= s_1;  tau_max, s <= s_2;  falling to tau_f = 0.4 tau_max at s_3; tau_f
///   beyond; good conditions: tau_max = 2.5 sqrt(f_cm / MPa) MPa, s_1 = 1 mm, s_2 = 2 mm, s_3 = 10 mm (clear
///   rib spacing); unloading with 200 MPa/mm, friction in reverse 0.25 of the envelope
///
/// Bearing: N = k_n max(0, delta); horizontal t = k_t (u - u_p) with |t - N s| <= mu N, s the slope of what
/// it stands on: where the foot rises by s du_p as it slides, N takes its part of the work. Friction
/// dissipates (t - N s) du_p; delta follows with the foot, N = k_n max(0, delta + s du_p), within the step:
/// with N of before, a foot on a steep seat slid away from below by many times its depth. Once u leaves the
/// seat, along or across, the deck has lost its support there and the bearing carries nothing any more.
#pragma once
#include <array>
#include <cmath>
#include <string>

namespace talus::material {

class Steel {
 public:
  struct Parameters {
    double young = 200e9;           ///< [Pa]
    double yield = 500e6;           ///< f_y [Pa]
    double ultimate = 540e6;        ///< stress at the fracture strain [Pa]
    double fracture_strain = 0.05;  ///< eps_u
    double prestress = 0;           ///< sigma_0 [Pa]
    bool rate_effect = true;
  };
  struct State {
    double plastic = 0, accumulated = 0, back_stress = 0;
    double yield = 0;   ///< frozen with its rate factor when yielding starts; 0 before
    double broken = 0;  ///< 1 once broken
  };
  struct Result {
    double stress = 0;       ///< [Pa]
    double energy = 0;       ///< stored [J/m^3]; a bar that breaks gives it up as dissipation
    double dissipation = 0;  ///< this call [J/m^3]
    double tangent = 0;      ///< d stress / d strain [Pa]
  };
  explicit Steel(const Parameters& p);
  const Parameters& parameters() const { return p_; }
  /// strain: since the bar was placed (without the initial one); rate: its magnitude matters [1/s].
  Result operator()(double strain, double rate, const State& old, State& next) const;
  /// True if it stays elastic at this strain, whatever the rate (which only raises f_y): stress and stored
  /// energy are then these, and its state stays.
  bool elastic(double strain, const State& old, double& stress, double& energy) const {
    const double e = p_.young;
    stress = p_.prestress + e * (strain - old.plastic);
    energy = stored(stress, old.back_stress);
    return old.broken == 0 && std::abs(stress - old.back_stress) <= (old.yield == 0 ? p_.yield : old.yield) &&
           strain + p_.prestress / e <= p_.fracture_strain;
  }

 private:
  double stored(double stress, double back) const {
    return 0.5 * stress * stress / p_.young + (hardening_ > 0 ? 0.5 * back * back / hardening_ : 0.0);
  }
  Parameters p_;
  double hardening_ = 0;
};

/// CEB: f_y + 6 MPa ln(rate / 5e-5), at least f_y [Pa].
double steel_yield_at_rate(double yield, double rate);

/// "B500A/B/C", "B400", "B450", "S235", "S355", "Y1770", "Y1860", or "f_y/f_u/eps_u" in MPa, MPa, 1
/// ("464/630/0.1"). Throws InputError.
Steel::Parameters steel_grade(const std::string& grade, const std::string& key = "grade",
                              const std::string& file = {}, int line = 0);

class BondSlip {
 public:
  struct State {
    double plastic = 0, largest = 0;  ///< slip [m]
  };
  struct Result {
    double stress = 0, energy = 0, dissipation = 0;  ///< per area of the bar's surface: Pa, J/m^2, J/m^2
  };
  explicit BondSlip(double f_cm) : tau_max_(2.5 * std::sqrt(f_cm / 1e6) * 1e6) {}
  double envelope(double slip) const;
  /// d tau / d s at this slip, at least 0 and at most the unloading stiffness [Pa/m].
  double tangent(double slip, const State& old) const;
  double strength() const { return tau_max_; }
  Result operator()(double slip, const State& old, State& next) const;

 private:
  static constexpr double s_1 = 1e-3, s_2 = 2e-3, s_3 = 10e-3, unloading = 200e9;  // [m], [Pa/m]
  double tau_max_;
};

class Bearing {
 public:
  struct Parameters {
    double normal_stiffness = 1e9;  ///< [N/m]
    double shear_stiffness = 1e7;   ///< [N/m]
    double friction = 0.3;
    std::array<double, 2> seat_along{
        -0.5,
        0.5};  ///< travel along the first axis within which the deck's end has the cap beam below it [m]
    std::array<double, 2> seat_across{-INFINITY, INFINITY};  ///< the same across [m]
  };
  struct State {
    std::array<double, 2> slip{};  ///< plastic part of the horizontal displacement [m]
    double lost = 0;               ///< 1 once off its seat
  };
  struct Result {
    double normal = 0;                   ///< compression [N]
    std::array<double, 2> shear{};       ///< on the deck, along and across [N]
    double energy = 0, dissipation = 0;  ///< [J]
  };
  explicit Bearing(const Parameters& p) : p_(p) {}
  const Parameters& parameters() const { return p_; }
  /// closing > 0 compresses; u: horizontal displacement of the deck against the pier since it was placed,
  /// slope: rise of the seat, along and across [m, -].
  Result operator()(double closing, const std::array<double, 2>& u, const State& old, State& next,
                    const std::array<double, 2>& slope = {}) const;

 private:
  /// Normal force [N] and way of the foot [m] of a step.
  struct Slide {
    double normal = 0;
    std::array<double, 2> way{};
  };
  /// From a closing [m] and spring forces [N] with the foot where it was.
  Slide slides(double closing, const std::array<double, 2>& t, const std::array<double, 2>& slope) const;
  double stored(double depth, const std::array<double, 2>& t) const;  // [J]

  Parameters p_;
};

}  // namespace talus::material

/// Section checks of EN 1992-1-1:2004 [en1992-1-1], as commonly cited, not verified against the standard's
/// text; static values.
///
/// Shear
///   V_Rd,c = [0.18/gamma_c k (100 rho_l f_ck)^(1/3) + 0.15 s_cp] b_w d                                 6.2.2
///            >= (0.035 k^1.5 f_ck^0.5 + 0.15 s_cp) b_w d;  k = 1 + sqrt(0.2 m/d) <= 2, rho_l <= 0.02
///   V_Rd,s = A_sw/s z f_ywd cot t,   V_Rd,max = a_cw b_w z nu_1 f_cd / (cot t + tan t)                 6.2.3
///            1 <= cot t <= 2.5, s_cp <= 0.2 f_cd, nu_1 = 0.6 (1 - f_ck/250 MPa), z = 0.9 d; f_ck in MPa
/// Axial force and bending: plane sections, the top fibre at eps_cu2 or, where all of the section is pressed,
/// the one at (1 - eps_c2/eps_cu2) of its height at eps_c2                                              6.1
///   concrete  s_c = f_cd [1 - (1 - eps/eps_c2)^n] up to eps_c2, f_cd from there                        3.1.7
///   eps_c2    = 2 per mille, above 50 MPa 2 + 0.085 (f_ck - 50)^0.53                             table 3.1
///   eps_cu2   = 3.5 per mille, above 50 MPa 2.6 + 35 ((90 - f_ck)/100)^4                         table 3.1
///   n         = 2, above 50 MPa 1.4 + 23.4 ((90 - f_ck)/100)^4                                   table 3.1
///   steel     s_s = E_s eps - s_p between -f_yd and f_yd, without hardening              3.2.7, 3.3.6, 5.10
/// The table ends at 90 MPa, whose values are taken above it.
///
/// symbol    meaning                                                         unit
/// eps, s_c  strain, stress of concrete, compression positive                -, Pa
/// s_s, s_p  stress of a bar, compression positive; its prestress, tensile,
///           where the concrete has no strain                                Pa
/// N         axial force, compression positive, at the centre                N
/// angle     direction in the section in which the compressed side lies,
///           from axis_x towards axis_y                                      rad
/// s_cp      N / A_c                                                         Pa
#pragma once
#include <array>
#include <vector>

#include "core/types.hpp"
#include "fem/rebar/rebar_geometry.hpp"

namespace talus::rebar {

/// Design strengths: gamma 1 with mean values answers "what can it take", gamma 1.5/1.15 (or 1.2/1.0,
/// accidental) "what may be counted on".
struct Strengths {
  double f_ck = 30e6;  ///< or f_cm, if mean resistances are wanted [Pa]
  double gamma_c = 1.2, gamma_s = 1.0, alpha_cc = 1.0;
  double grade = 0;  ///< f_ck of the strength class, by which strains go; 0: f_ck above [Pa]
  double f_cd() const { return alpha_cc * f_ck / gamma_c; }
};

struct ShearInput {
  double width = 0, effective_depth = 0;  ///< b_w, d [m]
  double tension_area = 0;                ///< A_sl [m^2]
  double stirrup_area_per_length = 0;     ///< A_sw / s [m]
  double stirrup_yield = 500e6;           ///< [Pa]
  double axial = 0, gross_area = 0;       ///< N [N], A_c [m^2]
};
struct ShearResistance {
  double concrete = 0, stirrups = 0, strut = 0;  ///< V_Rd,c, V_Rd,s, V_Rd,max [N]
  double cot_theta = 0;
  double governing = 0;  ///< V_Rd [N]
};
ShearResistance shear_resistance(const ShearInput& in, const Strengths& s);

struct SectionBar {
  double x = 0, y = 0, area = 0, yield = 500e6, young = 200e9, prestress = 0;
};

/// Concrete in compression of the strength class f_ck [Pa], 3.1.7 and table 3.1.
struct ParabolaRectangle {
  explicit ParabolaRectangle(double f_ck);
  double stress(double eps) const;  ///< over f_cd, compression positive
  double eps_c2, eps_cu2, n;
};

/// Fibre model of a cross-section.
class Section {
 public:
  /// wall 0: solid. Throws InputError if dimensions or bars do not fit.
  Section(Member::Section kind, double width, double depth, double wall, std::vector<SectionBar> bars,
          const Strengths& s);
  /// Of a member and the bars that cross the plane at `position` along it.
  Section(const Member& member, double wall, const std::vector<Bar>& bars, double position,
          const Strengths& s);

  double area() const { return area_; }  ///< concrete, gross [m^2]
  double axial_compression() const;      ///< N_Rd of pure compression [N]
  double axial_tension() const;          ///< positive [N]
  /// M_Rd at a given N [N m]; 0 outside [-axial_tension, axial_compression].
  double moment(double axial, double angle) const;
  struct Point {
    double axial, moment;
  };
  /// Interaction curve from pure tension to pure compression.
  std::vector<Point> interaction(double angle, int points = 33) const;

 private:
  Point at_depth(double neutral, double angle) const;  ///< neutral axis depth from the most compressed fibre
  double bar_stress(const SectionBar& bar, double eps) const;  ///< compression positive [Pa]
  struct Fibre {
    double x, y, area;
  };
  std::vector<Fibre> fibres_;
  std::vector<SectionBar> bars_;
  Strengths strengths_;
  ParabolaRectangle concrete_;
  bool round_ = false;
  std::array<double, 2> extents_{};  ///< width, depth [m]
  double area_ = 0;
};

}  // namespace talus::rebar

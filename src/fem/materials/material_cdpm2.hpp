/// CDPM2: concrete as plasticity in effective stress with damage in tension and compression [grassl2013]. For
/// impact patches, where confinement decides: the damage law alone knows almost none.
///
///   sigma = (1 - w_t) s+ + (1 - w_c) s-,  s = C : (eps - eps_p), split by the sign of its principal values
///
/// Yield (eq. 7), with v = s_V/f_c, r = rho/f_c:
///   f = { (1 - q1) (r/sqrt6 + v)^2 + sqrt(3/2) r }^2 + m_0 q1^2 q2 (r/sqrt6 rho(theta) + v) - q1^2 q2^2
///   m_0 = 3 (f_c^2 - f_t^2)/(f_c f_t) e/(e + 1)
/// Potential (eq. 22): the same braces squared + q1^2 (m_0 r/sqrt6 + m_g(v)), non-associated, independent of
/// theta Hardening (eq. 28-33): q1 from q_h0 to 1 over kappa in [0, 1], q2 = 1 + H_p (kappa - 1) beyond,
///   dkappa = |deps_p| / x_h(s_V) (2 cos theta)^2
/// Damage (eq. 37-53): equivalent strain from the yield function, inelastic strain kappa_1 + w kappa_2,
/// exponential softening
///   (1 - w_t) E kappa_t = f_t exp(-h (kappa_t1 + w_t kappa_t2)/w_f), w_f = G_F/f_t;
///   in compression eps_fc in place of w_f/h
///
/// symbol       meaning                                                               unit    shape
/// s_V rho      mean effective stress, length of its deviator sqrt(2 J2)              Pa      1
/// theta        Lode angle, 0 on the tensile meridian, 60 deg on the compressive one  rad     1
/// e            eccentricity of the deviatoric section, from f_bc/f_c                 -       1
/// h            extent of the cell along the crack normal, frozen at onset            m       1
///
/// Rate: both strengths are scaled by the Model Code factor, mixed by the share of compression, frozen when
/// damage starts. Return mapping: Newton on (s_V, rho, kappa, dlambda) at the Lode angle of the trial stress,
/// return to the apex where that is admissible. Near the tensile apex kappa grows from 0 to 1 within a strain
/// of 1e-5 and Newton can fail: then kappa is found by bisection, with a return to the surface of that kappa
/// inside; then by halved strain increments (up to 1024 parts).
///
/// In cells that lean strain and stress go through the crack's row (crack_row.hpp). The share is the damage
/// that came in tension, int (1 - alpha_c) dw_t, since w_t grows in compression, too, without any crack; the
/// normal is the principal direction where the first of it came, of increments that are more than all before.
/// A normal that went on turning as the crack opened would make energy.
#pragma once
#include "fem/materials/material_damage.hpp"
#include "fem/materials/material_eigen.hpp"
#include "fem/materials/material_mc2010.hpp"
#include "fem/materials/material_types.hpp"

namespace talus::material {

class Cdpm2 {
 public:
  struct Parameters {
    Concrete concrete;
    CellFrame cell = CellFrame::cube(0.1);
    bool rate_effect = true;
    bool damage = true;  ///< false: plasticity alone
  };
  static constexpr double initial_hardening = 0.3, hardening = 0.01;     ///< q_h0, H_p
  static constexpr double a_h = 0.08, b_h = 0.003, c_h = 2, d_h = 1e-6;  ///< hardening ductility
  static constexpr double dilation = 0.85;                               ///< D_f
  static constexpr double a_s = 15, eps_fc = 1e-4;                       ///< softening ductility, strain
  static constexpr double cap = 1 - 1e-5, rate_cap_compression = 1.25;
  struct State {  ///< plain doubles; all zero: virgin
    double strain[6]{}, plastic[6]{};
    double kappa = 0;                         ///< hardening
    double equivalent = 0, equivalent_c = 0;  ///< equivalent strains, last value
    double t = 0, t1 = 0, t2 = 0;             ///< kappa_t, kappa_t1, kappa_t2
    double c = 0, c1 = 0, c2 = 0;
    double w_t = 0, w_c = 0;
    double size = 0, factor = 0;      ///< h and rate factor, 0 until damage starts
    double cracked = 0, normal[3]{};  ///< w_t that came in tension; normal of the crack
    double fallbacks = 0;             ///< substeps that ended on the surface by scaling, since Newton failed
  };
  static_assert(sizeof(State) % sizeof(double) == 0);

  explicit Cdpm2(const Parameters& p);
  const Parameters& parameters() const { return p_; }
  Response operator()(const Sym& strain, const Sym& rate, const State& old, State& next) const {
    return respond(strain, rate, p_.cell, old, next);
  }
  /// The same in a given cell.
  Response respond(const Sym& strain, const Sym& rate, const CellFrame& cell, const State& old,
                   State& next) const;
  /// Eight points of one element, one after the other; layouts as in ConcreteDamage::stress8, old and next: 8
  /// states each. dissipation: less what is returned. Returns true if a point yielded or its damage grew.
  bool stress8(const double* strain, StrainRates* rates, const CellFrame& cell, const State* old, State* next,
               double* stress, double* energy, double* dissipation) const;

  /// Yield function of an effective stress at given q_h1, q_h2 (dimensionless, negative inside).
  double yield(const Sym& effective, double q1, double q2) const;
  double eccentricity() const { return e_; }
  double friction() const { return m0_; }  ///< m_0
  /// No virgin point yields while eps : C : eps stays below this [J/m^3] (found over a fan of directions, 5 %
  /// off for safety).
  double elastic_bound() const { return elastic_bound_; }
  /// E G_F / f_t^2: half that of the pure damage law, because here the softening variable contains the
  /// elastic strain.
  double largest_cell() const;

 private:
  struct Haigh {
    double v, r, cos_theta;
  };
  struct Gradient {
    double v, r;
  };
  double yield_at(double v, double r, double shape, double q1, double q2) const;
  Gradient flow(double v, double r, double q1, double q2) const;
  double shape(double cos_theta) const;
  double q1(double kappa) const;
  double q2(double kappa) const;
  double ductility(double v) const;
  double ductility_slope(double v) const;
  double flow_width(double q2) const;  ///< b_g
  static Haigh haigh(const Sym& s, double f_c);
  bool regular(const Haigh& trial, double f_c, double kappa_n, double& v, double& r, double& kappa) const;
  bool fixed(const Haigh& trial, double q1, double q2, double& v, double& r) const;
  bool nested(const Haigh& trial, double f_c, double kappa_n, double& v, double& r, double& kappa) const;
  bool apex(const Haigh& trial, double f_c, double kappa_n, double& v, double& kappa) const;
  bool plastic_step(const Sym& strain, double f_c, bool last_resort, State& s, Sym& effective) const;
  void damage_step(const Sym& effective, const Principal<double>& values, const Sym& plastic_before,
                   const CellFrame& cell, double factor, State& s) const;
  static double compressive_share(const Principal<double>& effective);
  double rate_factor(const Sym& effective, const Sym& rate, const CellFrame& cell) const;

  Parameters p_;
  double e_ = 0, m0_ = 0, lambda_ = 0, mu_ = 0, bulk_ = 0, b_g_ = 0, elastic_bound_ = 0;
};
static_assert(Law<Cdpm2>);

}  // namespace talus::material

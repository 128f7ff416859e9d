/// Two-scalar damage of concrete with permanent strain, crack band and unilateral effect [faria1998,
/// cervera2017].
///
///   s = C(E, nu (1 - d_t)) : (eps - eps_p) = s+ + s-       effective stress, split by the sign of its
///       principal values; an open crack takes Poisson's effect away, or concrete between cracks would not
///       bear along them
///   sigma = (1 - d_t) s+ + (1 - d_c) s- + d_c (t - p I)
///   tau_t = sqrt(E s+ : C^-1 : s+), C with the same nu                     uniaxial: E (eps - eps_p)
///   tau_c = 3 (K s_oct + t_oct) / (sqrt2 - K) of s-,  K = sqrt2 (beta - 1) / (2 beta - 1)  the same
///   sigma_t(q) = f_t exp(-(q - f_t) / (E eps')),  eps' = G_F / (l f_t) - f_t / (2 E),  q = E eps
///   sigma_c(q): elastic to f_c0; then as in [mc2010, 5.1-26]
///         f_c0 + (f_c - f_c0) (k x - x^2) / (1 + (k - 2) x),  x = (eps - eps_0) / (eps_c1 - eps_0),
///         k = E (eps_c1 - eps_0) / (f_c - f_c0), which leaves the elastic line smoothly and peaks at
///         (eps_c1, f_c);
///         beyond it f_c exp(-(eps - eps_c1) l f_c / G_c)
///
/// These are the curves of a test without unloading. What stays of its inelastic strain is the share rho, 0.1
/// in tension and 0.7 in compression [birtel2006]:
///   E eps_p = rho (q - sigma(q)),  r = q - E eps_p,  d = 1 - sigma(q) / r,
/// of which r and d are kept: q = r (1 + rho d / (1 - rho)). A point grows when tau > r,
///   q_1 = q_0 + (tau - r_0),  eps_p grows by C^-1 : (1 - r_1 / tau) s+  (s- likewise),
/// after which s+ is r_1 / tau times what it was, with the same axes, and tau is r_1: in closed form, exact
/// in a uniaxial test for steps of any size. Where strains grow in proportion stresses are those of rho = 0.
/// At the cap nothing grows.
///
/// symbol   meaning                                                             unit    shape
/// l        extent of the cell along the crack normal, frozen when damage starts  m       1
/// d_t d_c  damage, at most 1 - 1e-5 (a cap of 0.999 loses 6 to 15 % of G_F)      -       1
/// eps_p    permanent strain                                                      -       6
/// r q      tau from which on damage grows; E eps of the test that has come as    Pa      1
///          far
/// beta     equibiaxial over uniaxial compressive strength                        -       1
///
/// The crushed part and the faces of cracks are bodies of their own between the same ends: they see eps, not
/// eps - eps_p.
///
/// Crushed concrete between concrete carries pressure: p = K <-tr eps - theta>, at most the confinement c =
/// <-(lambda tr eps + 2 G eps_1)>, the least principal pressure of the sound concrete at that strain; what is
/// above it compacts, theta grows, and the work p dtheta is dissipated. In uniaxial and biaxial compression
/// with free sides c is 0, and the law above stands alone; in an oedometer the crushed concrete is half as
/// stiff in volume as the sound. The rubble rubs: its deviator t = 2 G (e - e_f) is at most |t| = sqrt(2/3) M
/// p, M = 6 sin phi / (3 - sin phi) with tan phi 0.7 (that of a rough face by EN 1992-1-1, 6.2.5), by radial
/// return, without change of volume; the work of e_f is dissipated.
///
/// In cells that lean strain and stress go through the crack's row (crack_row.hpp), so that pure opening is
/// neither slip nor compression along the crack. Cells with right angles are left as they are: there the row
/// and the crack differ only where the crack steps.
///
/// Interlock: the faces of a crack carry shear beside the damage law, and press each other apart. While
/// damage grows the crack's plane follows the principal direction; at an opening of 5 G_F / f_t, where the
/// softening stress is 0.7 % of f_t, the plane is fixed, and slip counts from there: pure opening mobilises
/// nothing. With the strain w = <eps_nn> of the opening, gamma that of the slip beyond what has slid, w' =
/// sqrt(w^2 + w_c^2), w_c = tau_0 / G, and psi = gamma / w', the faces are a body of their own of the energy
///   Phi = tau_m w' (psi - atan psi):  tau = tau_m psi^2 / (1 + psi^2),
///                                     sigma_n = -tau_m (atan psi - psi / (1 + psi^2)) w / w'      [li1989]
///   tau_m = tau_0 (1 - l w* / a) / (1 + 24 l w* / (0.31 (a + 16))),  tau_0 = 0.18 sqrt(f_c) / 0.31,  MPa, mm
///   w* the widest so far, a the largest grain                                   [vecchio1986, walraven1981]
/// w_c keeps faces that close again no stiffer than the sound concrete in shear. At psi = 3, or where tau and
/// what the law carries along the same direction reach tau_m, the faces slide and rub; as the crack opens
/// beyond w* what they store falls with tau_m: both are dissipated.
///
/// Rate: strength is multiplied by the Model Code factor at the moment damage starts, and the factor then
/// stays (MC2010 gives none for G_F, which is kept). In tension it is limited so that the cell does not snap
/// back; in compression to 1.25, since the inertia of the model already gives the rest. Compression scales
/// stress and strain together, so that E stays.
///
/// Energy: stored energy 1/2 sigma : (eps - eps_p); dissipation what it loses at constant strain when damage
/// and permanent strain grow, times the ratio of the two in a uniaxial test over the same step, 2 int sigma
/// dq - [sigma r] over (1 - d_0) tau^2 - (1 - d_1) r_1^2: exact in tension where strains grow in proportion,
/// to second order in compression. For nu > 0 the split stress is not the gradient of an energy when both
/// signs meet in one point with different damage [carol1996]: a closed strain path can then return a little
/// more or less work than it took. A ledger that has to close books internal work minus the change of stored
/// energy.
#pragma once
#include "core/processor.hpp"
#include "core/types.hpp"
#include "fem/materials/material_mc2010.hpp"
#include "fem/materials/material_types.hpp"

namespace talus::material {

/// Edge vectors of a hexahedron between opposite faces [m]; its extent along n is sum |e_k . n|. Where its
/// edges lean against each other by more than 3 degrees a crack of normal n runs along the row of cells k
/// with the largest |n . g_k|, and its band is that row along n, 1 / |n . g_k|.
struct CellFrame {
  double edge[3][3];
  double dual[3][3];  // g_k: normals of the rows over their thicknesses [1/m]
  bool leans;
  /// Of edges that are the columns.
  static CellFrame of(const Mat3& edges);
  static CellFrame cube(double h) { return of(h * Mat3::Identity()); }
  double extent(const std::array<double, 3>& n) const;
};

/// History of eight points, one array per quantity (1792 bytes, plain doubles, one vector of the processor
/// each). All zero: never damaged.
struct alignas(64) DamageCell {
  double r_t[8], f_t[8], b_t[8], d_t[8];  // threshold [Pa], strength at onset [Pa], 1/(E eps') [1/Pa], damage
  double r_c[8], dif_c[8], b_c[8],
      d_c[8];  // threshold [Pa], rate factor at onset, l f_c dif^2/(E G_c) [1/Pa], damage
  double normal[3][8], slip[3][8];    // of the crack; shear strain at which its faces hold nothing, and along
                                      // the normal the largest that opened it
  double compaction[8], pressure[8];  // theta, p [Pa] of the crushed part
  double flow[6][8];                  // e_f, as Sym, engineering shears
  double permanent[6][8];             // eps_p
};
static_assert(sizeof(DamageCell) == 224 * sizeof(double));

class ConcreteDamage {
 public:
  struct Parameters {
    Concrete concrete;
    CellFrame cell =
        CellFrame::cube(0.1);  ///< used by the call for one point; stress8 takes the cell of the element
    double permanent_tension = 0.1, permanent_compression = 0.7;  ///< rho, [0, 1)
    bool rate_effect = true;
    double aggregate = 0;  ///< largest grain [m]; 0: faces of cracks do not interlock
  };
  /// One point, as in DamageCell.
  struct State {
    double r_t = 0, f_t = 0, b_t = 0, d_t = 0, r_c = 0, dif_c = 0, b_c = 0, d_c = 0;
    std::array<double, 3> normal{}, slip{};
    double compaction = 0, pressure = 0;
    Sym flow{}, permanent{};
  };

  static constexpr double elastic_limit = 0.2;  ///< f_c0 / f_c: follows the Model Code's curve within 5 %
  static constexpr double cap = 1 - 1e-5;       ///< largest damage
  static constexpr double rate_cap_compression = 1.25;

  explicit ConcreteDamage(const Parameters& p);
  const Parameters& parameters() const { return p_; }

  Response operator()(const Sym& strain, const Sym& rate, const State& old, State& next) const;

  /// Eight points of one element, in vectors of four, or of eight with AVX-512. strain, stress: [6][8],
  /// component by component; rates may be null (quasi-static); energy, dissipation: [8] or null. Returns true
  /// if damage grew anywhere. `next` may be `old`.
  bool stress8(const double* strain, StrainRates* rates, const CellFrame& cell, const DamageCell& old,
               DamageCell& next, double* stress, double* energy, double* dissipation,
               InstructionSet with = instruction_set()) const;

  /// No undamaged point can reach a threshold while eps : C : eps stays below this [J/m^3]: such an element
  /// need not call the law.
  double elastic_bound() const { return elastic_bound_; }
  /// Largest extent for which tension does not snap back, quasi-static [m].
  double largest_cell() const;
  /// Extent l that a damaged point has frozen [m]; 0 if undamaged.
  double crack_length(double f_t, double b_t) const;

 private:
  template <class R>
  struct Lanes;
  bool stress8_avx512(const double* strain, StrainRates* rates, const CellFrame& cell, const DamageCell& old,
                      DamageCell& next, double* stress, double* energy, double* dissipation) const;
  template <class R>
  bool stress_by(const double* strain, StrainRates* rates, const CellFrame& cell, const DamageCell& old,
                 DamageCell& next, double* stress, double* energy, double* dissipation) const;
  template <class R, class Rate>
  bool point(const R (&strain)[6], Lanes<R>& s, const CellFrame& cell, const Rate& rate, R (&stress)[6],
             R& energy, R& dissipation) const;
  template <class R, class Rate>
  void start_points(const R (&effective)[6], const R& largest, const R& least, const R& tau_t, const R& tau_c,
                    const CellFrame& cell, const Rate& rate, Lanes<R>& s) const;
  template <class R>
  void effective_stress(const R (&strain)[6], R poisson, R (&stress)[6]) const;
  void start_tension(const Sym& stress, double tau, double largest, const Sym* rate, const CellFrame& cell,
                     State& s) const;
  void start_compression(const Sym& stress, double tau, double least, const Sym* rate, const CellFrame& cell,
                         State& s) const;
  template <class R, class Mask>
  void interlock(const R (&strain)[6], const R (&effective)[6], R largest, Mask grows, Lanes<R>& s,
                 R (&stress)[6], R& energy, R& dissipation) const;
  template <class R>
  void crushed(const R (&strain)[6], R old_d_c, Lanes<R>& s, R (&stress)[6], R& energy, R& dissipation) const;
  /// 1 - sigma / q of the uniaxial curves.
  template <class R>
  R missing_tension(R q, R f_t, R b_t) const;
  template <class R>
  R missing_compression(R q, R dif, R b_c) const;
  template <class R>
  R reaches_cap(const R& f, const R& start, const R& b, double missing) const;

  Parameters p_;
  double young_ = 0, poisson_ = 0, f_t_ = 0, f_c_ = 0, f_c0_ = 0,
         stress_peak_ = 0;          // stress_peak_ = E eps_c1
  double bulk_ = 0, friction_ = 0;  // K [Pa]; |t| / p
  double shear_ = 0, interlock_ = 0, widen_ = 0, part_ = 0,
         closed_ = 0;  // G; the limit at w = 0 [Pa]; its fall with w [1/m]; 1/a; w_c
  double ratio_t_ = 0, ratio_c_ = 0, missing_cap_t_ = 0,
         missing_cap_c_ = 0;  // rho / (1 - rho); 1 - sigma / q at the cap
  double k_oct_ = 0, tau_scale_ = 0, k_curve_ = 0, inverse_span_ = 0, elastic_bound_ = 0;
};
static_assert(Law<ConcreteDamage>);

/// Crack width by the crack band, for any law: l times the largest principal value of the strain that is not
/// elastic, eps - C^-1 sigma [m].
double crack_width(double l, const Sym& strain, const Sym& stress, double young, double poisson);

/// Largest and least principal value of a strain rate (engineering shears).
std::array<double, 2> extreme_rates(const Sym& rate);

}  // namespace talus::material

/// Concrete from its mean compressive strength alone, fib Model Code for Concrete Structures 2010 [mc2010].
///
///   f_ck = f_cm - 8 MPa                                   5.1-1
///   E    = 21.5 GPa (f_cm / 10 MPa)^(1/3)                 5.1-20 (quartzite aggregate, tangent modulus)
///   f_t  = 0.3 f_ck^(2/3), f_ck <= 50 MPa; 2.12 ln(1 + 0.1 f_cm) above   5.1-3a, b
///   G_F  = 73 f_cm^0.18 N/m                               5.1-9
///   eps_c1  by table 5.1-8, linear in between
///   G_c  = 250 G_F     crushing energy beyond the peak; not in the Model Code [rtd2017, after nakamura2001]
///   f_bc = 1.16 f_cm                                      [kupfer1969]
///
/// symbol   meaning                                    unit
/// f_cm     mean cylinder strength, 20 to 130 MPa      Pa
/// G_F      fracture energy per crack area             N/m
///
/// Rate factors on strength [mc2010, 5.1.11.2]: tension (rate/1e-6)^0.018 up to 10 1/s, 0.0062
/// (rate/1e-6)^(1/3) above; compression (rate/3e-5)^0.014 up to 30 1/s, 0.012 (rate/3e-5)^(1/3) above; 1
/// below the quasi-static rate.
#pragma once
#include <string>
#include <vector>

namespace talus::material {

struct Concrete {
  double f_cm = 0;   ///< mean compressive strength [Pa]
  double f_ck = 0;   ///< characteristic [Pa]
  double young = 0;  ///< [Pa]
  double poisson = 0.2;
  double density = 2450;            ///< [kg/m^3]
  double f_t = 0;                   ///< mean tensile strength [Pa]
  double fracture_energy = 0;       ///< G_F [N/m]
  double eps_c1 = 0;                ///< strain at the compressive peak
  double crushing_energy = 0;       ///< G_c [N/m]
  double biaxial_ratio = 1.16;      ///< f_bc / f_cm
  double aggregate = 0;             ///< largest grain of crack faces that interlock [m]; 0: they do not
  std::vector<std::string> report;  ///< one line per value: given, or derived and from what
};

/// What the user may give besides f_cm; zero means "derive it", but for Poisson's ratio.
struct ConcreteInput {
  double f_cm = 0, young = 0, poisson = 0.2, density = 0, f_t = 0, fracture_energy = 0;
};

/// Throws InputError with every value outside its range (f_cm 20 to 130 MPa, f_t 0.02 to 0.2 f_cm, and values
/// that contradict each other).
Concrete mc2010(const ConcreteInput& input, const std::string& key = "material");
inline Concrete mc2010(double f_cm) {
  ConcreteInput input;
  input.f_cm = f_cm;
  return mc2010(input);
}

double rate_factor_tension(double rate);  ///< rate: magnitude of the principal strain rate [1/s]
double rate_factor_compression(double rate);

/// Largest cell size [m] for which the softening branch does not snap back: 2 E G_F / f_t^2.
double snapback_limit(double young, double f_t, double fracture_energy);
/// The longest edge and the longest diagonal of the cells of a mesh; 0: not known [m].
struct CellSize {
  double edge = 0, diagonal = 0;
};
/// Throws InputError that names the size needed if an edge reaches the law's `limit`, or if a crack across a
/// diagonal would cost more than 1.05 G_F (its band is cut to 0.98 of the limit); `formula` says where the
/// limit comes from.
void check_cell_size(double limit, const std::string& formula, const CellSize& largest,
                     const std::string& key = "structure.cell_size");

}  // namespace talus::material

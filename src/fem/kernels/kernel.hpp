/// Internal forces of trilinear hexahedra, many elements at a time; raw pointers only, so that each
/// instruction set can have its own translation unit.
///
///   f_a = sum_q w_q P_q grad N_a,   P = sigma (small strain)   or   P = F S (total Lagrangian),
///
/// the strains at the 2 x 2 x 2 points taken as assumed_strain.hpp says, and sigma its transpose of their
/// elastic stresses: as both are sums of few functions, which are orthogonal, a stress is found for each
/// function and not for each point. With eps replaced by the Green-Lagrange strain the same formula is the
/// derivative of an energy, hence conserves it, and forces and moments sum to zero under any rotation.
///
/// symbol     meaning                                                     unit     shape
/// nodes      four times the node number (VTK order), lane innermost      -        groups x 8 x W
/// geometry   brick: diagonal of J^-1, w                                  1/m, m^3 groups x 4 x W
///            else n (9, vector by vector), t (9), J^-1 (row: reference            groups x (18 + Q 10) x W,
///            axis), w                                                             Q = 1 if affine, else 8
/// scale      1 for a lane that counts, 0 for padding and lanes elsewhere -        groups x W
/// u          displacement, padded to four per node                       m        nodes x 4
/// f          internal force, added to                                    N        nodes x 4
/// energy     strain energy                                               J        groups x W
/// bound      max over the points of eps : C : eps; 0 if               Pa       groups x W
///            the limits rule out that a damage law has anything to say
#pragma once

namespace talus::fem {

enum class CellShape { brick, affine, general };  // edges along the axes; one Jacobian; any

/// Sufficient conditions for a point without history to stay elastic under a damage law: eps : C : eps <=
/// energy, or
///   sigma_1 <= principal   and   pressure_share min(tr sigma / 3, 0) + |dev sigma| / sqrt 3 <= octahedral.
/// The first is nearly free, the second is asked where the first fails.
struct ElasticLimits {
  double energy = 0;          // [J/m^3]
  double principal = -1e300;  // [Pa]; the default never holds
  double octahedral = 0;      // [Pa]
  double pressure_share = 0;
};

struct KernelArguments {
  const int* nodes = nullptr;
  const double* geometry = nullptr;
  const double* scale = nullptr;
  const double* u = nullptr;
  double* f = nullptr;
  double* energy = nullptr;               // null: not wanted
  double* bound = nullptr;                // null: not wanted
  const ElasticLimits* limits = nullptr;  // null: no law
  long first = 0, last = 0;               // groups
  double shear = 0, bulk = 0;             // [Pa]
  CellShape shape = CellShape::general;
  bool finite = false;  // total Lagrangian
};

/// Linear and quadratic bulk viscosity, a pressure from the mean rate of dilatation d (one per element):
///   q = rho l (b1 c |d| + b2^2 l d^2) against compression, b1 alone against expansion,   f_a -= q V F g_a,
///   d = sum v_a . F g_a
/// F, the mean deformation gradient, turns it with the element: no moment, and no pressure from turning.
/// `mean` holds V g_a (the integral of grad N_a), groups x 24 x W; `length` the cell size per lane.
struct ViscosityArguments {
  const int* nodes = nullptr;
  const double* mean = nullptr;
  const double* volume = nullptr;
  const double* length = nullptr;
  const double* scale = nullptr;
  const double* u = nullptr;  // [m], padded to four per node
  const double* v = nullptr;  // [m/s], as u
  double* f = nullptr;
  long first = 0, last = 0;
  double density = 0, wave_speed = 0, linear = 0.06, quadratic = 1.2;
};

/// One instruction set's set of kernels.
struct Kernels {
  int width;  // W
  const char* name;
  void (*internal_force)(const KernelArguments&);
  void (*bulk_viscosity)(const ViscosityArguments&);
};

const Kernels& kernels_generic();
const Kernels& kernels_avx2();
const Kernels& kernels_avx512();

/// That of core/processor.hpp.
const Kernels& kernels();

}  // namespace talus::fem

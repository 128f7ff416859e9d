/// Strains at the eight points of a cell (assumed_strain.hpp) and the nodal forces of stresses there, shared
/// by all laws (equations: damage_field.hpp). Components in the order of the laws: xx yy zz yz zx xy, shears
/// engineering; arrays [component][point], points in lexicographic order, xi fastest. The points of a cell
/// are one vector of the processor, or two of half the length.
#pragma once
#include "fem/kernels/assumed_strain.hpp"
#include "fem/materials/material_damage.hpp"

namespace talus::fem {

/// What strains and forces need of a cell.
///
/// symbol   meaning                                         unit     shape
/// inverse  J^-1 at the points                              1/m      9 x 8 (3 * reference axis + axis, point)
/// node     four times the node number, VTK order           -        8
struct LawGeometry {
  alignas(64) double inverse[9][8];
  AssumedStrain assumed;
  double volume;
  double shortest_edge;  // between opposite faces [m]
  int node[8];
  material::CellFrame frame;
};

LawGeometry law_geometry(const HexMesh& mesh, int cell, double poisson);

using PointTensors = double[6][8];

struct PointStrains {
  alignas(64) PointTensors strain;
  alignas(64) double displacement_gradient[9][8];  // row = component of u
  double largest;                                  // Frobenius norm of the strain over the points
  double dilation;                                 // mean trace of the strain
};

/// One instruction set's functions. Fields are nodes x 4 [m], [m/s], [N]; tensors are aligned to 64 bytes.
struct LawPoints {
  void (*strains)(const LawGeometry& g, const double* u, bool finite, PointStrains& out);
  /// The rates of the strains `at` at velocities v.
  void (*rates)(const LawGeometry& g, const PointStrains& at, const double* v, bool finite,
                PointTensors& rate);
  /// The strains at u - step v, and the way from them to `at`.
  void (*before)(const LawGeometry& g, const PointStrains& at, const double* v, double step, bool finite,
                 PointTensors& before, PointTensors& way);
  /// Not less than what any point of the cell strained by in a step at velocities v, but for the change of
  /// length by rotations in it.
  double (*largest_way)(const LawGeometry& g, const double* v, double step);
  /// The share of `way`, from `strain` on, in which no point strains by more than `part` of its strain and
  /// `peak`; 1 or more: all of it.
  double (*path_share)(const PointTensors& strain, const PointTensors& way, double peak, double part);
  /// Adds the forces of the stresses, each of an eighth of the volume.
  void (*add_forces)(const LawGeometry& g, const PointStrains& at, const PointTensors& stress, bool finite,
                     double* f);
};

const LawPoints& law_points_base();
const LawPoints& law_points_avx512();
/// That of core/processor.hpp.
const LawPoints& law_points();

}  // namespace talus::fem

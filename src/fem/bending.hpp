/// How much too stiff or too soft members bend whose depth has few layers of cells, or whose cells are long.
///
///   K / K_beam = 1 + (f - 1) / n^2,   f = (2/3 + (a/b)^2 / 2) / (1 + nu)
///
/// Within a cell the strain of bending is that of a trilinear hexahedron with mean dilatation: its dilatation, linear over the depth, is averaged out
/// (4 mu / 3 in place of E), and it bends only by shearing (mu (a/b)^2 / 2). Its share of the whole is 1/n^2.
///
/// symbol   meaning                                                  unit   shape
/// n        layers of cells over the depth                           -      1
/// a, b     length of a cell along the member, its depth             m      1
#pragma once
#include <optional>

#include "fem/hex_mesh.hpp"

namespace talus::fem {

struct PoorBending {
  double sag = 1;       // computed over the beam's
  int layers = 0;
  double depth = 0;     // of the member [m]
  double length = 0;    // of a cell along it [m]
  double share = 0;     // of the structure's volume that bends at least so wrongly
};

/// The worst of what a tenth of the volume bends by, if that is off by more than a tenth. Members: three times as long as deep.
std::optional<PoorBending> poor_bending(const HexMesh& mesh, double poisson);

/// Longest cell along a member of this depth that keeps the sag within 5 % [m], with three layers or more.
double longest_bending_cell(double depth, double poisson);

}  // namespace talus::fem

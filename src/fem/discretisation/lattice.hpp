/// Hexahedra between three families of parallel planes, graded towards zones of finer cells.
///
///   s(x) = min(h, min over zones (h_z + growth dist(x, zone)))        wanted cell edge at x
///
/// Between two fixed planes there are ceil(integral dx / s) cells, cut where the integral is a multiple of
/// its n-th part: no edge is longer than wanted at its middle, and neighbours differ by a factor of about 1 +
/// growth.
#pragma once
#include <array>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

using Lines = std::array<std::vector<double>, 3>;

/// A zone of finer cells along one axis.
struct FineZone {
  double low, high, size;
};  // [m]

constexpr double growth = 0.3;

/// Ascending plane positions; `fixed` (two or more, any order) are among them, and so are the ends of zones
/// between them.
std::vector<double> graded_lines(std::vector<double> fixed, double size, const std::vector<FineZone>& zones);

/// How many cells graded_lines() makes between two of its fixed planes.
double graded_count(std::vector<double> fixed, double size, const std::vector<FineZone>& zones, double low,
                    double high);

/// n equal cells from low to high.
std::vector<double> even_lines(double low, double high, int n);

/// Where boxes begin and end along each axis.
Lines ends_of(const std::vector<Box3>& boxes);

/// The cells of the lattice whose middles lie in a box, x fastest.
HexMesh lattice(const Lines& lines, const std::vector<Box3>& boxes);

/// The zones of a specification in the structure's own axes.
std::vector<StructureSpec::Refinement> local_refinements(const StructureSpec& spec);
std::vector<FineZone> zones_along(const std::vector<StructureSpec::Refinement>& refinements, int axis);

/// Whether the zones end at their borders, by hanging nodes, and do not go on through
/// the structure; the specification of the mesh that is refined.
bool refines_locally(const StructureSpec& spec);
StructureSpec of_coarse_mesh(const StructureSpec& spec);

/// How many cells bricks() makes; where boxes overlap they count more than once.
double brick_count(const std::vector<Box3>& boxes, double cell_size,
                   const std::vector<StructureSpec::Refinement>& refinements);

/// Cells of the lattice of all planes of the boxes that lie in any of them.
HexMesh bricks(const std::vector<Box3>& boxes, double cell_size,
               const std::vector<StructureSpec::Refinement>& refinements = {});

}  // namespace talus::fem

/// Eight-node hexahedra as plain arrays: the coarse cells of a triangulation, as they are generated or read,
/// and the tables that kernels, laws, bars and contact use of its active cells (discretisation.hpp).
///
/// symbol   meaning                                                         shape
/// nodes    reference positions, world axes [m]                             n x 3
/// hexes    VTK order: bottom face counter-clockwise seen from +zeta, top   m x 8
/// local    the same nodes in the body's own axes (faces of the bounding    n x 3
///          box, "-z" and the like, are meant in these)
#pragma once
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "contact/structures/structure.hpp"
#include "fem/discretisation/trilinear.hpp"

namespace talus::fem {

/// A node in the middle of an edge or a face of a larger cell, with which it moves: u = sum weight u(master).
/// Masters do not hang.
struct HangingNode {
  int node = 0;
  std::vector<std::pair<int, double>> masters;
};

struct HexMesh {
  std::vector<Vec3> nodes;
  std::vector<Vec3> local;
  std::vector<std::array<int, 8>> hexes;
  std::map<std::string, std::vector<int>> node_groups;  // sorted node numbers
  std::vector<int> component;  // per hex: 0 unless the kind has several parts (viaduct)
  std::vector<long> number;    // per hex, from a file: its number there, less than 0 for a quarter of a
                               // tetrahedron; else empty
  // Of active cells:
  std::vector<HangingNode> hanging;  // where cells of two sizes meet, ascending
  std::map<std::pair<int, int>, int>
      middle;  // of edges of larger cells, ends ascending, the node between smaller ones
  std::vector<std::array<int, 6>>
      across;          // per hex and face the cell across it, -1: none; of four smaller ones the first
  std::string remark;  // of the reader: what the file holds beside its cells
};

/// Bounds of a cell by its corners, which name it among cells of all sizes.
using CellBox = std::array<double, 6>;
CellBox numbers_of(const Box3& box);
CellBox box_about(const std::array<Vec3, 8>& corners);
std::array<Vec3, 8> corners_of(const HexMesh& mesh, int cell);

/// How a message names a cell: by its number in the file, or by its place from 1.
std::string cell_name(const HexMesh& mesh, int cell);

/// A quadrilateral of the skin, outward, with the cell it bounds.
struct SkinQuad {
  std::array<int, 4> node;
  int cell;
  int face;
};

/// The corners of quads as vertices of a closed surface in which every edge has two quads: where a part
/// touches itself along an edge or in a point, the node becomes several vertices, one for each sheet. `node`:
/// of each vertex; `quad`: vertices of each quad.
struct ClosedSurface {
  std::vector<int> node;
  std::vector<std::array<int, 4>> quad;
};
ClosedSurface close_surface(const std::vector<SkinQuad>& quads);

/// The six faces of a hexahedron, outward, in VTK numbering.
extern const int hex_faces[6][4];

/// Faces of active cells that belong to exactly one live cell, in the order of (cell, face). `live` empty:
/// all cells.
std::vector<SkinQuad> skin(const HexMesh& mesh, const std::vector<char>& live);

/// Mean of the corners.
Vec3 cell_centre(const HexMesh& mesh, int cell);
/// Jacobian dx/dxi at a reference point in [-1, 1]^3; rows x, y, z, columns xi, eta, zeta.
Mat3 jacobian(const HexMesh& mesh, int cell, const Vec3& xi);
/// The rotation nearest to a matrix of positive determinant, R of its polar decomposition R U.
Mat3 nearest_rotation(Mat3 m);

/// Whether more than the border of a cell lies in a zone and one of its edges is longer than the zone asks
/// for. Corners in VTK order.
bool to_be_halved(const std::array<Vec3, 8>& corners, const StructureSpec::Refinement& zone);

/// Throws InputError for a cell with a Jacobian that is not positive at a point of integration or a corner
/// (relative to its size), naming the first twenty, for repeated nodes, and for nodes of a cell in one place.
void check_cells(const HexMesh& mesh, const std::string& key, const std::string& file);

/// Throws InputError for faces that more than two cells share, or two cells of one side: cells that are there
/// twice, or lie in one another.
void check_faces(const HexMesh& mesh, const std::string& key, const std::string& file);

/// Two cells of parts that share no node, of which one has a point of integration well inside the other; the
/// first such found. Not looked for where one cell is twenty times as large as they are in the mean.
std::optional<std::pair<int, int>> overlapping_cells(const HexMesh& mesh);

/// Volume of each cell by its integration points, which is what mass and stiffness use; and what of it each
/// corner stands for, int N_a dV by the same points.
std::vector<double> cell_volumes(const HexMesh& mesh);
std::array<double, 8> corner_volumes(const HexMesh& mesh, int cell);

/// The mesh of a structure: boxes, columns and viaducts by generation, meshes from file.
HexMesh make_mesh(const StructureSpec& spec);

/// Reads Gmsh .msh (2.2 and 4.1 ASCII) or Abaqus/CalculiX .inp.
HexMesh read_mesh(const StructureSpec& spec);

}  // namespace talus::fem

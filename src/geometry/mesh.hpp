/// Triangle meshes from files: reading, writing, checking, and repair on request.
///
///   read     STL (text, binary), OBJ (groups), PLY (text, binary), OFF, VTU (text; cell data "block")
///   written  OBJ (groups), STL (binary), PLY (binary), OFF, VTU (text)
///
/// Every reader returns vertices that are shared: points with the same coordinates (bit for bit) are one
/// vertex, since STL repeats each corner. Polygons are triangulated by ear clipping, so concave planar
/// polygons are right.
///
/// A block must be a closed surface: each edge used by exactly two triangles, once in each direction, no
/// triangle of no area, no two triangles that cross, and a volume above 1e-12 of the bounding box.
/// `read_closed_mesh` states every violation with the edge or face and what to do. Nothing is repaired
/// silently: `repair` is a separate call, and it reports what it did.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/types.hpp"

namespace talus::geometry {

struct Mesh {
  std::vector<Vec3> vertices;                 // V x 3 [m]
  std::vector<std::array<int, 3>> triangles;  // T
  std::vector<int> group;                     // T, index into group_names; empty: all one group
  std::vector<std::string> group_names;       // names of OBJ groups or objects
  Box3 bounds() const;
};

/// Reads by the file's name ending (and, for STL, its contents). Throws InputError naming the file and the
/// line.
Mesh read_mesh(const std::string& path);

/// The same, from memory; `name` is used in messages and chooses the format.
Mesh read_mesh_text(const std::string& text, const std::string& name);

/// True if the ending is one that `read_mesh` knows.
bool is_mesh_file(const std::string& path);

/// Writes by the name's ending: .obj, .stl, .ply, .off, .vtu. Throws InputError if the file cannot be
/// written.
void write_mesh(const std::string& path, const Mesh& mesh);

/// Makes vertices closer than `tolerance` [m] one vertex (0: identical coordinates only), drops triangles
/// that collapse. Returns the number of vertices removed.
int weld(Mesh& mesh, double tolerance);

/// What is wrong with the mesh as the boundary of a block; empty if it is closed, oriented outward and
/// simple. `check_crossings` adds the exact test for triangles that cross.
std::vector<Problem> closed_mesh_problems(const Mesh& mesh, const std::string& file,
                                          bool check_crossings = true);

/// `read_mesh` and `closed_mesh_problems`; throws InputError with all problems. A mesh that is closed and
/// consistent but inside out is an error too: which side is rock is never guessed.
Mesh read_closed_mesh(const std::string& path);
/// Parts of a closed surface that are connected by vertices and enclose matter; cavities do not count.
int body_count(const Mesh& mesh);

/// Signed volume enclosed by a closed mesh [m^3].
double signed_volume(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles);

/// What `repair` changed, for the person who asked for it.
struct RepairReport {
  int vertices_welded = 0, triangles_dropped = 0, triangles_turned = 0, holes_filled = 0, triangles_added = 0;
  bool turned_inside_out = false;
  std::vector<Problem> remaining;  // what could not be repaired
};

/// Welds vertices (1e-9 of the size unless `weld_tolerance` is given), drops degenerate and repeated
/// triangles, orients the surface consistently and outward, fills holes. For `talus convert --repair`.
Mesh repair(const Mesh& mesh, RepairReport& report, double weld_tolerance = -1);

/// Pairs of triangles that cross or overlap (not just share a vertex or an edge), by exact predicates.
std::vector<std::pair<int, int>> self_intersections(const Mesh& mesh);

/// Convex hull, outward triangles; points inside are dropped. Throws InputError if the points do not span a
/// volume.
Mesh convex_hull(const std::vector<Vec3>& points);

/// Triangulates a planar polygon with holes by ear clipping. `loops[0]` is the outer loop, counter-clockwise
/// about `normal`; the others are holes, clockwise. Indices into `vertices`. Returns no triangles if no ear
/// can be found.
std::vector<std::array<int, 3>> triangulate_polygon(const std::vector<Vec3>& vertices,
                                                    const std::vector<std::vector<int>>& loops,
                                                    const Vec3& normal);

}  // namespace talus::geometry

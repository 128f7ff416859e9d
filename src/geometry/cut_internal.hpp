/// Steps of the block cutting (private): the region as cells, the joints applied, the cells glued to blocks.
#pragma once
#include <vector>

#include "geometry/cell_complex.hpp"
#include "geometry/cut.hpp"

namespace talus::geometry::cutting {

/// What a face of the complex is. `Face::mark` is an index into a table of these.
struct Mark {
  int joint = -1;       // -1: the region's surface, or a division for convexity
  bool intact = false;  // rock on both sides: the cells are glued
  bool bonded = false;  // rock bridge with a strength
  double tension = 0, shear = 0;
};
constexpr int mark_surface = 0, mark_division = 1;  // the first two entries of the table

/// A complex of cells that need not be convex (exact_complex.hpp), empty. `sliver`: thinner cells are
/// round-off of what was given [m].
std::unique_ptr<CellComplex> exact_complex(double sliver);

/// Solid angle of a triangle seen from the origin.
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c);

/// Adds the region as one cell: it must be convex, unless the complex is exact. Faces become planes and are
/// marked as surface.
void add_region(CellComplex& complex, const Polyhedron& region);
/// Fills the complex with convex cells that make up the region, divided along its own faces.
void add_convex_parts(CellComplex& complex, const Polyhedron& region);
/// Divides these cells by the faces of a closed body into parts within and without. Divisions are marked
/// `mark_division`.
struct Parts {
  std::vector<int> inside, outside;
};
Parts divide_by(CellComplex& complex, const std::vector<int>& cells, const Polyhedron& body);

/// A plane to cut with, in the order of application.
struct JointPlane {
  Vec3 normal;
  double offset;
  int joint;  // as in CutBlock::body.face_joint_set
};
std::vector<JointPlane> set_planes(const CutJointSet& set, int joint, const Box3& region,
                                   const std::vector<Vec3>& corners);

/// A bounded joint: its polygon in its plane, counter-clockwise about the normal.
std::vector<Vec3> joint_polygon(const CutJoint& joint, const Vec3& normal);

void cut_with_plane(CellComplex& complex, std::vector<Mark>& marks, const JointPlane& plane, int open_mark,
                    int mark);
void cut_with_polygon(CellComplex& complex, std::vector<Mark>& marks, const JointPlane& plane,
                      const std::vector<Vec3>& polygon, int open_mark, int bridge_mark);

/// Glues cells to blocks, merges slivers, and writes blocks and interfaces.
void make_blocks(const CellComplex& complex, const std::vector<Mark>& marks, double least_volume,
                 CutResult& result);

}  // namespace talus::geometry::cutting

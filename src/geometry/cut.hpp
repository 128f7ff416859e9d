/// Cutting of a rock mass into blocks by joint sets and single joints.
///
///   normal of a joint of dip direction a and dip b (upward):  n = (sin a sin b, cos a sin b, cos b)
///   planes of a set:  n . (x - o) = t_k,   t_0 = 0, t_{k+1} - t_k = spacing
///
/// symbol  meaning                                                    unit
/// a, b    dip direction (clockwise from +y, north) and dip           rad
/// o       origin of a set: one plane passes through it; default the middle of the region's box
/// kappa   Fisher's concentration of the normals about the mean       1
///
/// A region is a box or any closed mesh, convex or not, or a mass that is taken out of the ground. The joints
/// divide it into cells; cells that no joint separates are glued, so that blocks may be concave. All
/// decisions are taken once for vertices shared by all blocks, those of a region that is not convex exactly
/// (see cell_complex.hpp, exact_complex.hpp): volumes add up to the region's to round-off, and what two
/// blocks share is the same polygon for both. What touches itself in an edge alone is two blocks.
///
/// Persistence p < 1 of a set is the chance that a block lying across a joint is cut by it, as in 3DEC's
/// joint sets [itasca3dec]. A single joint may be bounded: a disc (a regular 32-gon of the same area) or a
/// polygon. Rock beyond its border is a bridge. Where a bond strength is given, the joint's plane divides the
/// blocks it enters, and the bridge is a bond of that area; without a strength the bridge is intact rock that
/// does not break, and blocks it joins are one.
///
/// The same spec gives the same blocks, bit for bit, on any machine and number of threads.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "core/error.hpp"
#include "core/types.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {

class CellComplex;

constexpr double one_plane = 1e-7;  // sine between faces of a block that are one

struct CutJointSet {
  std::string name;
  double dip_direction = 0, dip = 0;              // [rad]
  double spacing = 0;                             // mean, along the normal [m]
  std::optional<Vec3> origin;                     // [m]
  double persistence = 1;                         // (0, 1]
  double fisher = 0;                              // concentration; 0: no scatter
  std::string spacing_distribution = "constant";  // constant, exponential, normal, lognormal
  double spacing_deviation = 0;                   // standard deviation of normal and lognormal [m]
  unsigned seed = 1;
  double bond_tension = 0, bond_shear = 0;  // strength of rock bridges [Pa]; 0: they do not break
};

struct CutJoint {
  std::string name;
  double dip_direction = 0, dip = 0;        // [rad]
  Vec3 through = Vec3::Zero();              // [m]
  double radius = 0;                        // disc about `through` [m]; 0: unbounded
  std::vector<Vec3> polygon{};              // or a simple polygon, projected onto the plane [m]
  double bond_tension = 0, bond_shear = 0;  // [Pa]
};

struct CutSpec {
  std::string region;  // closed mesh file; empty: box
  std::shared_ptr<const CellComplex>
      mass;  // taken out of the ground (take_out.hpp), in place of file and box
  std::optional<Box3> box;
  std::vector<CutJointSet> joint_sets;
  std::vector<CutJoint> joints;
  double least_volume = 0;            // smaller blocks join the neighbour they share most area with [m^3]
  std::size_t most_blocks = 1000000;  // stop with an error beyond
  std::function<void(const std::string&)> report{};  // gets "progress: ..." before each set and joint
};

/// One block, in body axes about its centroid. `body.face_joint_set`: -1 on the surface of the region, k <
/// number of sets for joint set k, (number of sets + j) for single joint j.
struct CutBlock {
  Polyhedron body;
  Vec3 centroid = Vec3::Zero();  // [m]
  double volume = 0;             // [m^3]
  int cells = 1;                 // convex cells it was glued from
};

/// What two blocks share on one plane.
struct CutInterface {
  int a = 0, b = 0;              // blocks, a < b
  int joint = 0;                 // numbered as in face_joint_set
  double area = 0;               // whole shared area [m^2]
  double bonded_area = 0;        // part of it that is rock bridge [m^2]
  Vec3 centroid = Vec3::Zero();  // of the shared area
  Vec3 bond_centroid = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();              // out of a
  double tension = 0, shear = 0;            // strength of the bridge [Pa]
  std::vector<std::vector<Vec3>> polygons;  // its parts [m], counter-clockwise about the normal
};

struct CutResult {
  std::vector<CutBlock> blocks;          // ordered by centroid: z, then y, then x, from below
  std::vector<CutInterface> interfaces;  // ordered by a, b
  std::vector<std::string> joint_names;  // sets, then single joints
  struct PlaneCut {
    Vec3 normal;
    double offset;
    int joint;
  };
  std::vector<PlaneCut> planes;  // every joint plane, as scattered
  double region_volume = 0;      // [m^3]
  int merged = 0;                // slivers that joined a neighbour
  std::vector<Problem> warnings;
};

/// Upward unit normal of a plane.
Vec3 joint_normal(double dip_direction, double dip);

/// Everything that is wrong with the spec (dip beyond 90 degrees, no spacing, ...) and warnings (sets that
/// are nearly parallel). Does not read the region.
std::vector<Problem> cut_problems(const CutSpec& spec);

/// The region as a closed mesh: the box, or what the file holds. Throws InputError.
Mesh region_mesh(const std::string& file, const std::optional<Box3>& box);

/// Throws InputError with all problems.
CutResult cut(const CutSpec& spec);

}  // namespace talus::geometry

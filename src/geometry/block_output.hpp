/// What `talus cut` writes: the blocks as files, their table, the curve of block sizes, and the stereonet.
#pragma once
#include <string>
#include <vector>

#include "geometry/cut.hpp"
#include "geometry/key_blocks.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {

/// All blocks in world coordinates as one mesh, a group per block: prefix + "1", prefix + "2", ...
Mesh block_system(const CutResult& cut, const std::string& prefix = "R");

/// Blocks of another program: every group of a mesh file is a closed block of one piece, its name one that a
/// block may have (`is_name`). Throws InputError naming file, line and group.
struct NamedBlock {
  std::string name;
  Polyhedron body;               // about its centroid
  Vec3 centroid = Vec3::Zero();  // [m]
  double volume = 0;             // [m^3]
};
std::vector<NamedBlock> read_block_system(const std::string& path);

/// Line of an OBJ file, from 1, that begins this group or, where there are several, the last of them; 0:
/// there is none. For messages.
int group_line(const std::string& path, const std::string& name);

/// Polygons with cell data block, volume, joint_set and, where given, removability and factor_of_safety.
void write_blocks_vtu(const std::string& path, const CutResult& cut,
                      const std::vector<KeyBlock>& key_blocks = {});

/// block,volume_m3,x_m,y_m,z_m,faces,convex,cells[,type,mode,factor_of_safety]
void write_blocks_csv(const std::string& path, const CutResult& cut, const std::string& prefix = "R",
                      const std::vector<KeyBlock>& key_blocks = {});

/// Interfaces: block_a,block_b,joint,area_m2,bonded_area_m2,tension_pa,shear_pa,x_m,y_m,z_m
void write_interfaces_csv(const std::string& path, const CutResult& cut, const std::string& prefix = "R");

/// Share of the volume in blocks up to a size: the block-size distribution curve.
struct SizeCurve {
  std::vector<double> volume;                 // ascending [m^3]
  std::vector<double> passing;                // share of the whole volume in blocks up to `volume` [1]
  double v25 = 0, v50 = 0, v75 = 0, v90 = 0;  // volume at which 25, 50, 75, 90 % pass [m^3]
};
SizeCurve size_curve(const CutResult& cut);
void write_size_curve_csv(const std::string& path, const SizeCurve& curve);
std::string size_curve_svg(const SizeCurve& curve);

/// Lower-hemisphere equal-area stereonet (Schmidt): great circles of the mean planes, poles of every plane as
/// scattered, and, if a slope is given, its great circle and the friction circle.
///
///   pole or line of trend t, plunge p:  r = R sqrt(2) sin((90 deg - p)/2)
///   x = r sin t, y = r cos t  (north up)
struct StereonetOptions {
  double slope_dip_direction = -1, slope_dip = 0;  // [rad]; negative: none
  double friction = 0;                             // [rad]; 0: none
  std::string title = "Joint sets, lower hemisphere, equal area";
};
/// Coordinates on the unit disc of a line given by any vector along it.
Eigen::Vector2d equal_area(const Vec3& line);
std::string stereonet_svg(const CutSpec& spec, const CutResult& cut, const StereonetOptions& options = {});

}  // namespace talus::geometry

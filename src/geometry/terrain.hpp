/// Terrain as a fixed triangle surface, from meshes (STL, OBJ, PLY, OFF) and rasters (ESRI ASCII grid,
/// GeoTIFF).
///
///   scene coordinates = map coordinates - origin
///
/// Grid nodes are cell centres; each quad is split from its lower left to its upper right node. A triangle
/// with a NODATA corner does not exist, and the place is remembered: `over_hole` reports a block over a hole
/// from one beside the terrain. Solid lies on one side unless `two_sided`: the faces of a mesh are oriented
/// by connectivity, each sheet so that most of its plan area faces up, and overhanging faces keep that
/// orientation (terrain_sheets.hpp).
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact/geometry/surface.hpp"
#include "core/error.hpp"
#include "core/types.hpp"
#include "geometry/mesh.hpp"
#include "geometry/roughen.hpp"

namespace talus::geometry {

class CellComplex;

struct TerrainOptions {
  bool two_sided = false;
  int default_material = 0;
  Vec3 origin = Vec3::Zero();   // map coordinates of the scene origin [m]
  std::optional<Box3> crop;     // scene coordinates; x and y count [m]
  double decimation_error = 0;  // largest vertical error allowed [m]; 0: all triangles are kept
  double widen = 0;             // lateral limits moved outward by this much, level with the edge [m]
  std::string crs;  // the scene's; a file in another system is an error; empty: the first that a file names
  std::string breaklines;  // GeoJSON lines with heights, map coordinates; empty: none
  struct MaterialArea {
    std::string polygon_file;  // GeoJSON, map coordinates; empty: raster
    std::string raster_file;   // classes of ground; the cells that hold `value` are the area
    double value = 0;
    int material = 0;         // later areas win
    std::string part{};       // solid of an STL file, or group or object of an OBJ file, of the terrain
    std::string mesh_file{};  // a mesh that is a part of the terrain
  };
  std::vector<MaterialArea> material_areas;
  char up = 'z';                     // of mesh files: their axis that points up, 'x', 'y' or 'z'
  std::vector<Roughness> roughness;  // by material
  /// Of mesh files: the name of the solid, group or file nearest to a place in scene coordinates; empty: no
  /// parts.
  std::function<const std::string&(const Vec3&)> part_at;
  /// A second surface, which is decimated with the terrain where it has the same triangles in plan.
  const TriangleSurface* beside = nullptr;
};

/// Where a grid has data; empty for meshes.
struct GridHoles {
  double x0 = 0, y0 = 0, dx = 0, dy = 0;  // node (0, 0) is the south-west one [m]
  int columns = 0, rows = 0;
  std::vector<char> has_data;  // rows x columns, south first
};

struct Terrain {
  TriangleSurface surface;
  std::string crs;  // the scene's, or the first that one of its files names; empty: not known
  GridHoles grid;
  double decimation_reached = 0;                 // bound of the decimated surface's vertical error [m]
  std::size_t triangles_read = 0;                // before decimation
  std::size_t triangles_kept = 0;                // after it
  std::vector<Problem> warnings;                 // holes, dropped triangles
  std::optional<TriangleSurface> beside;         // the second surface, decimated with this one
  std::shared_ptr<const CellComplex> taken_out;  // the rock mass whose place the surface leaves out

  /// True if (x, y) lies within the grid's limits but no triangle covers it.
  bool over_hole(double x, double y) const;
};

/// Throws InputError naming the file and what to do. Without a path: of `options.breaklines` alone.
Terrain load_terrain(const std::string& path, const TerrainOptions& options = {});

/// Terrain surface from a mesh in memory (orientation, crop, materials and decimation as above).
Terrain make_terrain(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles,
                     const TerrainOptions& options, const std::string& name);

/// A slope in words: planar sub-faces one below the other, each going down along `dip_direction` at its dip
/// for its length; the profile is extruded sideways by `width`.
struct SlopeFace {
  double dip = 0;     // [rad]; negative: rises
  double length = 0;  // along the face [m]
};
TriangleSurface slope_from_faces(const Vec3& crest, double dip_direction, const std::vector<SlopeFace>& faces,
                                 double width);

/// What to do about map coordinates that can be degrees of longitude and latitude, as those of a polygon that
/// lies nowhere on the terrain; empty if they cannot.
std::string remedy_for_degrees(const Eigen::AlignedBox2d& limits);

/// What to do about a terrain (scene coordinates) that lies farther from the scene's origin (map coordinates)
/// than positions bear; empty if it does not.
std::string remedy_for_origin(const Box3& terrain, const Vec3& origin);

/// Areas of a GeoJSON file, a shapefile or a GeoPackage: polygons and multipolygons, rings of [x, y] in map
/// coordinates. A place belongs to a polygon if it lies within its first ring and in none of the others, its
/// holes. Of a ring that crosses itself that is within which it goes around an odd number of times, as in the
/// repair of GIS programs.
struct Area {
  using Polygon = std::vector<std::vector<Eigen::Vector2d>>;  // the outer ring, then those of its holes
  std::vector<Polygon> polygons;                              // which may overlap
  std::string crs;                                            // of the file, if it names one
  std::vector<Problem> warnings;  // of rings that cross themselves, of geometries that are no polygons
  bool contains(double x, double y) const;
  Eigen::AlignedBox2d limits() const;
};
/// Throws InputError at `key`, also for a hole that lies outside.
Area read_area(const std::string& path, const std::string& key);

/// How large an area is in plan, and the share of it that lies over ground, by the middles of a hundred by a
/// hundred cells of its bounds. `over_ground`: whether there is ground below a place, in coordinates about
/// `origin`, as `limits`, the area's bounds, are. An area narrower than a cell counts as 0 m^2, all over
/// ground.
struct AreaExtent {
  Eigen::AlignedBox2d limits;
  double area = 0, over_ground = 1;  ///< [m^2], 0 to 1
  std::string span() const;          ///< "x 0 to 9, y 0 to 5"
};
AreaExtent extent_of(const Area& area, const Vec3& origin,
                     const std::function<bool(double x, double y)>& over_ground);
/// What is to be said of an area that lies in part beside the ground; `key` is that of its file.
std::vector<Problem> beside_ground(const AreaExtent& extent, const std::string& key);

/// Lines of such a file, points [x, y, z] in map coordinates.
struct BreakLines {
  std::vector<std::vector<Vec3>> lines;
  std::string crs;
  std::vector<Problem> warnings;  // of geometries that are no lines
};
BreakLines read_breaklines(const std::string& path, const std::string& key);

/// Lines of such a file in plan, map coordinates; heights are left out.
struct PlanLines {
  std::vector<std::vector<Eigen::Vector2d>> lines;
  std::string crs;
  std::vector<Problem> warnings;  // of geometries that are no lines
};
PlanLines read_plan_lines(const std::string& path, const std::string& key);

/// Surface whose edges hold the given lines: a constrained Delaunay triangulation in plan of the surface's
/// vertices and the lines'. Without a surface, of the lines alone. Vertices nearer to a line (in plan) than
/// half the mean edge of the surface give way to it. `fixed` is set for the lines' vertices. Lines may meet
/// at their points only; throws InputError naming the place where they cross.
void insert_lines(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles,
                  const std::vector<std::vector<Vec3>>& lines, const std::string& name,
                  std::vector<char>& fixed);

/// Sets the material of each triangle by the areas; throws InputError where an area lies in another
/// coordinate system or off the terrain.
void assign_materials(TriangleSurface& surface, const TerrainOptions& options, std::string& crs,
                      std::vector<Problem>& warnings);

/// One coordinate system for all files of a scene: `known`, or the first that a file names, which it takes.
/// Throws InputError where the file's differs, or cannot be a scene's. `place`: any of the file's, on the
/// map.
void agree_on_crs(std::string& known, const std::string& file_crs, const Eigen::Vector2d& place,
                  const std::string& file, const std::string& key);

/// Height of the highest point of the surface, above overhangs, within a rectangle in plan; -infinity if none
/// lies there.
double highest_within(const TriangleSurface& surface, const Eigen::AlignedBox2d& rectangle);

/// Removes vertices while the surface stays within `error` [m] of the given one, measured vertically,
/// everywhere. Border vertices stay, and those that `fixed` marks (empty: none), with the edges between them.
/// `error_reached` is a bound of the largest difference of the result, at most `error`. Vertices of
/// overhanging and upright faces stay, since a vertical error means nothing there. `beside`: heights of a
/// second surface on the same triangles, NaN where it has none [m]; it stays within `error` too, and its
/// border as it is.
void decimate(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles, double error,
              double& error_reached, const std::vector<char>& fixed = {},
              const std::vector<double>& beside = {});

}  // namespace talus::geometry

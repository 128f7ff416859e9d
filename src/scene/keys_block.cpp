#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

namespace {
constexpr double turn = 6.2831853071795865, quarter = 1.5707963267948967;

void add_shape(std::vector<Key>& keys, const std::string& at) {
  const auto add = [&](Key key) {
    key.path = at + "." + key.path;
    keys.push_back(std::move(key));
  };
  add({.path = "shape",
       .type = Type::choice,
       .doc = "Form of the block. EOTA111 and EOTA221 are the standard test bodies; random-convex and "
              "random-concave need volume or mass, and a seed.",
       .required = "unless file is given",
       .choices = {"box", "tetrahedron", "dodecahedron", "icosahedron", "sphere", "EOTA111", "EOTA221",
                   "convex", "random-convex", "random-concave", "file"},
       .source = "EOTA: EAD 340059, vertices (+-a/2, +-b/4, +-c/4) and permutations, V = 17/24 abc"});
  add({.path = "file",
       .type = Type::path,
       .doc = "Closed mesh (OBJ, STL, PLY, OFF) in place of a shape. With `position` its volume centroid is "
              "moved there, without, its coordinates are the world's.",
       .required = "if shape is \"file\""});
  add({.path = "size",
       .type = Type::vector,
       .dimension = length,
       .doc = "Full extents along the body axes.",
       .required = "for a box, unless volume or mass is given (a cube)",
       .min = 0,
       .above = true});
  add({.path = "diameter",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Diameter of a sphere.",
       .min = 0,
       .above = true});
  add({.path = "longitudes",
       .type = Type::integer,
       .fallback = "12",
       .doc = "Sphere: meridians, equally spaced.",
       .min = 3,
       .max = 100});
  add({.path = "latitudes",
       .type = Type::integer,
       .fallback = "5",
       .doc = "Sphere: circles between the poles.",
       .min = 1,
       .max = 100});
  add({.path = "vertices",
       .type = Type::vectors,
       .dimension = length,
       .doc = "Convex: the block is the hull of these points.",
       .required = "if shape is \"convex\""});
  add({.path = "volume",
       .type = Type::quantity,
       .dimension = volume,
       .doc = "Scales the shape to this volume. Not together with mass.",
       .min = 0,
       .above = true});
  add({.path = "mass",
       .type = Type::quantity,
       .dimension = mass,
       .doc = "Scales the shape to this mass. Not together with volume.",
       .min = 0,
       .above = true});
  add({.path = "seed",
       .type = Type::integer,
       .fallback = "1",
       .doc = "Random shapes: the same seed gives the same rock.",
       .min = 0,
       .max = 4294967295.0});
  add({.path = "aspect",
       .type = Type::vector,
       .dimension = number,
       .fallback = "[1.0, 1.0, 1.0]",
       .doc = "Random shapes: ratio of the extents.",
       .min = 0.01,
       .max = 100});
}

void add_orientation(std::vector<Key>& keys, const std::string& at) {
  const auto add = [&](Key key) {
    key.path = at + "." + key.path;
    keys.push_back(std::move(key));
  };
  add({.path = "orientation",
       .type = Type::table,
       .doc = "One of { quaternion = [w, x, y, z] }, { rotation_vector = [x, y, z] }, { dip_direction = , "
              "dip = }. Omitted: body axes are the world's."});
  add({.path = "orientation.quaternion",
       .type = Type::quaternion,
       .dimension = number,
       .doc = "[w, x, y, z], Hamilton, body to world; its length does not matter."});
  add({.path = "orientation.matrix",
       .type = Type::vectors,
       .dimension = number,
       .doc = "Three rows, body to world; written by the program into scene.resolved.json, where every bit "
              "counts."});
  add({.path = "orientation.rotation_vector",
       .type = Type::vector,
       .dimension = angle,
       .doc = "Axis times angle, rad."});
  add({.path = "orientation.dip_direction",
       .type = Type::quantity,
       .dimension = angle,
       .doc = "Body x points down dip; clockwise from north (+y).",
       .min = -turn,
       .max = turn});
  add({.path = "orientation.dip",
       .type = Type::quantity,
       .dimension = angle,
       .doc = "Body z is the upward normal of the plane with this dip.",
       .min = 0,
       .max = quarter});
}
}  // namespace

std::vector<Key> block_keys() {
  std::vector<Key> keys{
      {.path = "block", .type = Type::tables, .doc = "Single blocks."},
      {.path = "block.enabled",
       .type = Type::boolean,
       .fallback = "true",
       .doc = "false: as if the block were not in the scene."},
      {.path = "block.name",
       .type = Type::text,
       .doc = "Name in histories and reports. Omitted: B and its place, from 1."},
      {.path = "block.material",
       .type = Type::text,
       .doc = "Material of the block.",
       .required = "always in block"},
  };
  add_shape(keys, "block");
  keys.push_back({.path = "block.position",
                  .type = Type::vector,
                  .dimension = length,
                  .doc = "Centroid at t = 0.",
                  .required = "unless the block has a file or a release"});
  keys.insert(keys.end(),
              {{.path = "block.release",
                .type = Type::table,
                .doc = "A release area in place of a position: copies NAME-1, NAME-2, ... start at random "
                       "places, apart from each other."},
               {.path = "block.release.polygon",
                .type = Type::path,
                .doc = "Polygons (GeoJSON, shapefile, GeoPackage), map coordinates: centroids start within.",
                .required = "always in block.release"},
               {.path = "block.release.count",
                .type = Type::integer,
                .fallback = "1",
                .doc = "Number of copies.",
                .min = 1,
                .max = 100000},
               {.path = "block.release.height",
                .type = Type::quantity,
                .dimension = length,
                .fallback = "0.1 m",
                .doc = "Of the lowest point of the block above the highest ground in its plan.",
                .min = 0,
                .above = true},
               {.path = "block.release.at",
                .type = Type::section,
                .dimension = length,
                .doc = "One place in plan, scene coordinates, in place of random ones: the block keeps its "
                       "name and its orientation, and starts at `height` there."},
               {.path = "block.release.turn",
                .type = Type::boolean,
                .fallback = "true",
                .doc = "Each copy is turned at random, uniformly over all orientations."},
               {.path = "block.release.seed",
                .type = Type::integer,
                .fallback = "1",
                .doc = "The same seed gives the same places and orientations.",
                .min = 0,
                .max = 4294967295.0}});
  add_orientation(keys, "block");
  keys.insert(
      keys.end(),
      {{.path = "block.velocity",
        .type = Type::vector,
        .dimension = velocity,
        .fallback = "[0.0, 0.0, 0.0]",
        .doc = "Velocity of the centroid at t = 0."},
       {.path = "block.spin",
        .type = Type::vector,
        .dimension = angular_velocity,
        .fallback = "[0.0, 0.0, 0.0]",
        .doc = "Angular velocity at t = 0, in world axes."},
       {.path = "block.fixed",
        .type = Type::boolean,
        .fallback = "false",
        .doc = "The block does not move at all."},
       {.path = "block.fixed_points",
        .type = Type::vectors,
        .dimension = length,
        .doc = "Points of the block, in world coordinates at t = 0, that stay where they are."},
       {.path = "block.deformable",
        .type = Type::boolean,
        .doc = "12 degrees of freedom (with strain) in place of 6; strains are damped, the slowest at 2 % of "
               "critical. Omitted: true where the material has `young`. With `dda-1988` always true."}});

  keys.push_back({.path = "impact",
                  .type = Type::table,
                  .doc = "For `talus impact`: one block that strikes a structure."});
  keys.push_back({.path = "impact.structure",
                  .type = Type::text,
                  .doc = "The structure that is hit.",
                  .required = "if the scene has more than one"});
  keys.push_back({.path = "impact.material",
                  .type = Type::text,
                  .doc = "Material of the block.",
                  .required = "always in impact"});
  add_shape(keys, "impact");
  add_orientation(keys, "impact");
  keys.insert(keys.end(),
              {{.path = "impact.velocity",
                .type = Type::velocity,
                .dimension = velocity,
                .doc = "A vector, or a speed with `angle` and `direction`.",
                .required = "unless trajectories is given"},
               {.path = "impact.angle",
                .type = Type::quantity,
                .dimension = angle,
                .fallback = "0 deg",
                .doc = "Angle of the velocity below the horizontal, with a speed.",
                .min = -quarter,
                .max = quarter},
               {.path = "impact.direction",
                .type = Type::quantity,
                .dimension = angle,
                .fallback = "90 deg",
                .doc = "Azimuth that the block flies towards, clockwise from north (+y), with a speed.",
                .min = -turn,
                .max = turn},
               {.path = "impact.spin",
                .type = Type::vector,
                .dimension = angular_velocity,
                .fallback = "[0.0, 0.0, 0.0]",
                .doc = "Angular velocity, in world axes."},
               {.path = "impact.point",
                .type = Type::vector,
                .dimension = length,
                .doc = "Where the block touches first.",
                .required = "unless trajectories is given"},
               {.path = "impact.clearance",
                .type = Type::quantity,
                .dimension = length,
                .fallback = "0.01 m",
                .doc = "Gap along the velocity at t = 0.",
                .min = 0},
               {.path = "impact.deformable", .type = Type::boolean, .doc = "As block.deformable."},
               {.path = "impact.trajectories",
                .type = Type::path,
                .doc = "CSV with a header row; columns x, y, z, vx, vy, vz, and if they are there mass or "
                       "volume (not both, unless they agree, and not beside the key), the spin wx, wy, wz "
                       "and the orientation qw, qx, qy, qz, in SI or in units that the first row names (vx "
                       "[km/h]); spin and orientation of the scene go "
                       "before those of the file. Or the histories of blocks by `talus convert "
                       "results.h5#/history/blocks FILE.csv`: then the block's size is the scene's."},
               {.path = "impact.block",
                .type = Type::text,
                .fallback = "\"\"",
                .doc = "Of a trajectories file with the histories of several blocks the one that strikes."},
               {.path = "impact.row",
                .type = Type::integer,
                .fallback = "1",
                .doc = "Row of the trajectories file, 1 the first below the header.",
                .min = 1,
                .max = 1e9}});
  return keys;
}

}  // namespace talus::scene

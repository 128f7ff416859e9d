#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

std::vector<Key> rock_mass_keys() {
  constexpr double turn = 6.2831853071795865, quarter = 1.5707963267948967;
  return {
      {.path = "rock_mass", .type = Type::table, .doc = "A rock mass that joints cut into blocks."},
      {.path = "rock_mass.region", .type = Type::path, .doc = "Closed mesh of the region, convex or not.", .required = "unless box or blocks are given"},
      {.path = "rock_mass.box", .type = Type::table, .doc = "The region as a box, in place of a mesh."},
      {.path = "rock_mass.box.min", .type = Type::vector, .dimension = length, .doc = "Lower corner.", .required = "always in rock_mass.box"},
      {.path = "rock_mass.box.max", .type = Type::vector, .dimension = length, .doc = "Upper corner.", .required = "always in rock_mass.box"},
      {.path = "rock_mass.blocks", .type = Type::path, .doc = "Blocks that are cut already, in place of region and joints: OBJ with a group for each block, or VTU with the cell data \"block\", as `talus cut` writes them. They keep the names of their groups."},
      {.path = "rock_mass.material", .type = Type::text, .doc = "Material of the blocks.", .required = "always in rock_mass"},
      {.path = "rock_mass.deformable", .type = Type::boolean, .doc = "As block.deformable."},
      {.path = "rock_mass.least_volume", .type = Type::quantity, .dimension = volume, .fallback = "0 m^3", .doc = "Blocks below this volume are merged with a neighbour; the mass is kept.", .min = 0},
      {.path = "rock_mass.prefix", .type = Type::text, .fallback = "\"R\"", .doc = "The blocks are named by it and their number, from 1."},
      {.path = "rock_mass.joint_set", .type = Type::tables, .doc = "Parallel joints."},
      {.path = "rock_mass.joint_set.name", .type = Type::text, .doc = "Name in the stereonet and in the list of faces. Omitted: J and its place, from 1."},
      {.path = "rock_mass.joint_set.orientation", .type = Type::joint, .doc = "\"dip direction/dip\" in degrees, e.g. \"267/87\".", .required = "unless dip_direction and dip are given"},
      {.path = "rock_mass.joint_set.dip_direction", .type = Type::quantity, .dimension = angle, .doc = "In place of orientation.", .min = -turn, .max = turn},
      {.path = "rock_mass.joint_set.dip", .type = Type::quantity, .dimension = angle, .doc = "In place of orientation.", .min = 0, .max = quarter},
      {.path = "rock_mass.joint_set.spacing", .type = Type::quantity, .dimension = length, .doc = "Mean distance of neighbours along the normal.", .required = "always in rock_mass.joint_set", .min = 0, .above = true},
      {.path = "rock_mass.joint_set.origin", .type = Type::vector, .dimension = length, .doc = "One joint of the set passes through this point. Omitted: through the centre of the region's bounding box."},
      {.path = "rock_mass.joint_set.persistence", .type = Type::quantity, .dimension = number, .fallback = "1.0", .doc = "Share of each plane that is open; the rest are rock bridges, bonds that can break.", .min = 0, .max = 1, .above = true},
      {.path = "rock_mass.joint_set.fisher", .type = Type::quantity, .dimension = number, .fallback = "0.0", .doc = "Concentration of the Fisher scatter of the poles; 0: no scatter.", .min = 0, .source = "Fisher 1953"},
      {.path = "rock_mass.joint_set.spacing_distribution", .type = Type::choice, .fallback = "\"constant\"", .doc = "Distribution of the spacing.", .choices = {"constant", "exponential", "normal", "lognormal"}},
      {.path = "rock_mass.joint_set.spacing_deviation", .type = Type::quantity, .dimension = length, .fallback = "0 m", .doc = "Standard deviation of the spacing.", .required = "if spacing_distribution is \"normal\" or \"lognormal\"", .min = 0},
      {.path = "rock_mass.joint_set.seed", .type = Type::integer, .fallback = "1", .doc = "The same seed gives the same joints.", .min = 0, .max = 4294967295.0},
      {.path = "rock_mass.joint_set.bond_tension", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Tensile strength of the rock bridges; 0 with bond_shear 0: they do not break.", .min = 0},
      {.path = "rock_mass.joint_set.bond_shear", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Shear strength of the rock bridges.", .min = 0},
      {.path = "rock_mass.joint_set.friction", .type = Type::friction, .doc = "Friction of the set's faces. Omitted: the interface's.", .min = 0},
      {.path = "rock_mass.joint_set.cohesion", .type = Type::quantity, .dimension = pressure, .doc = "Cohesion of the set's faces. Omitted: the interface's.", .min = 0},
      {.path = "rock_mass.joint_set.tension", .type = Type::quantity, .dimension = pressure, .doc = "Tension cut-off of the set's faces. Omitted: the interface's.", .min = 0},
      {.path = "rock_mass.joint", .type = Type::tables, .doc = "Single joints: a plane, a disc (radius) or a polygon."},
      {.path = "rock_mass.joint.name", .type = Type::text, .doc = "Name. Omitted: K and its place, from 1."},
      {.path = "rock_mass.joint.orientation", .type = Type::joint, .doc = "\"dip direction/dip\" in degrees.", .required = "unless dip_direction and dip are given"},
      {.path = "rock_mass.joint.dip_direction", .type = Type::quantity, .dimension = angle, .doc = "In place of orientation.", .min = -turn, .max = turn},
      {.path = "rock_mass.joint.dip", .type = Type::quantity, .dimension = angle, .doc = "In place of orientation.", .min = 0, .max = quarter},
      {.path = "rock_mass.joint.through", .type = Type::vector, .dimension = length, .doc = "A point of the joint; the centre of the disc.", .required = "always in rock_mass.joint"},
      {.path = "rock_mass.joint.radius", .type = Type::quantity, .dimension = length, .doc = "Radius of a disc. Omitted: unbounded.", .min = 0, .above = true},
      {.path = "rock_mass.joint.polygon", .type = Type::vectors, .dimension = length, .doc = "Corners of a bounded joint, in its plane."},
      {.path = "rock_mass.joint.bond_tension", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Bounded joints: tensile strength of the rock beyond the border; 0 with bond_shear 0: it does not break.", .min = 0},
      {.path = "rock_mass.joint.bond_shear", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Bounded joints: shear strength of the rock beyond the border.", .min = 0},
  };
}

}  // namespace talus::scene

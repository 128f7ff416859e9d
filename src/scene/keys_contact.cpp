#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

std::vector<Key> contact_keys() {
  return {
      {.path = "material", .type = Type::tables, .doc = "Materials of blocks, terrain, planes and structures."},
      {.path = "material.name", .type = Type::text, .doc = "Name that blocks, terrain and interfaces use.", .required = "always in material"},
      {.path = "material.density", .type = Type::quantity, .dimension = density, .doc = "Mass per volume.",
       .required = "if a block, a rock mass or an elastic structure is made of it; 2450 kg/m^3 for concrete (f_cm)", .min = 0, .above = true},
      {.path = "material.young", .type = Type::quantity, .dimension = pressure,
       .doc = "Young's modulus. Blocks of a material without it are rigid.", .required = "for an elastic structure without f_cm, and for deformable blocks", .min = 0, .above = true},
      {.path = "material.poisson", .type = Type::quantity, .dimension = number, .doc = "Poisson's ratio. Omitted: 0.25, or 0.2 for concrete (f_cm).", .min = -1, .max = 0.5, .above = true, .below = true},
      {.path = "material.f_cm", .type = Type::quantity, .dimension = pressure,
       .doc = "Mean compressive strength: makes the material a concrete. Modulus, tensile strength and fracture energy follow from it where they are not given.",
       .required = "for a structure with damage", .min = 8e6, .max = 140e6, .source = "fib Model Code 2010, 5.1.4 to 5.1.7"},
      {.path = "material.tensile_strength", .type = Type::quantity, .dimension = pressure, .doc = "Omitted: from f_cm.", .min = 0, .above = true},
      {.path = "material.fracture_energy", .type = Type::quantity, .dimension = fracture_energy, .doc = "Energy per crack area (N/m = J/m^2). Omitted: from f_cm.", .min = 0, .above = true},

      {.path = "material.roughness", .type = Type::table, .doc = "Ground of this material is rougher than its mesh: the terrain is divided to a third of length, and its vertices are moved up and down by a random surface, the same for all that pass there."},
      {.path = "material.roughness.amplitude", .type = Type::quantity, .dimension = length, .doc = "Standard deviation of the heights.", .required = "always in material.roughness", .min = 0, .above = true},
      {.path = "material.roughness.length", .type = Type::quantity, .dimension = length, .doc = "Distance over which heights lose their likeness: of the lattice of random values between which the surface is smooth.", .required = "always in material.roughness", .min = 0, .above = true},
      {.path = "material.roughness.seed", .type = Type::integer, .fallback = "1", .doc = "Of the random values; heights depend on it and the map coordinates alone.", .min = 0, .max = 4294967295.0},

      {.path = "interface", .type = Type::tables,
       .doc = "What two materials do when they touch. An entry with exact names goes before one with one \"*\", that before [\"*\", \"*\"]. A pair that can meet and has no entry is an error."},
      {.path = "interface.between", .type = Type::texts, .doc = "The two materials; \"*\" stands for any.", .required = "always in interface"},
      {.path = "interface.preset", .type = Type::choice, .doc = "Ground by name: fills what the interface leaves out of friction, restitution, rolling_resistance, slip_friction and vegetation; the run reports the values and their ranges.",
       .choices = {"rock", "talus", "compact soil", "soft soil", "forest"}, .source = "docs/theory/ground.md; for want of measurements on site, to be calibrated"},
      {.path = "interface.friction", .type = Type::friction, .doc = "Friction: an angle with a unit (\"28 deg\"), or the coefficient as a bare number.", .required = "in interface, unless preset is given", .min = 0},
      {.path = "interface.slip_friction", .type = Type::table, .doc = "Friction that grows with the way slid, mu(s) = friction + (most - friction) 2/pi atan(s/length), and falls back in flight: ground that is heaped up before a block. A way belongs to a block.", .source = "Leine et al. 2014"},
      {.path = "interface.slip_friction.most", .type = Type::friction, .doc = "What it grows to, above friction.", .required = "always in interface.slip_friction", .min = 0},
      {.path = "interface.slip_friction.length", .type = Type::quantity, .dimension = length, .doc = "Way slid after which it has grown by half.", .required = "always in interface.slip_friction", .min = 0, .above = true},
      {.path = "interface.slip_friction.recovery", .type = Type::quantity, .dimension = rate, .fallback = "0 1/s", .doc = "Rate at which the way is forgotten out of contact: ds/dt = -recovery s.", .min = 0},
      {.path = "interface.vegetation", .type = Type::table, .doc = "What grows on the ground: drag on a block whose centroid is lower than height above it, force = drag times speed."},
      {.path = "interface.vegetation.height", .type = Type::quantity, .dimension = length, .doc = "Above the ground, plumb; above a plane along its normal.", .required = "always in interface.vegetation", .min = 0, .above = true},
      {.path = "interface.vegetation.drag", .type = Type::quantity, .dimension = mass_rate, .doc = "Force over speed.", .required = "always in interface.vegetation", .min = 0, .above = true},
      {.path = "interface.cohesion", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Cohesion, times the tributary area.", .min = 0},
      {.path = "interface.tension", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "Tension cut-off, times the tributary area.", .min = 0},
      {.path = "interface.normal_stiffness", .type = Type::stiffness,
       .doc = "\"hard\", a spring in N/m per contact point (a bare number is this), or Pa/m times the tributary area. Omitted: chosen from the materials and reported: "
              "hard where neither has a Young's modulus, else the softer modulus over the size of the smallest block of the two materials, per area (`dda-1988`: the softer modulus times that size, per contact point).",
       .min = 0, .above = true},
      {.path = "interface.shear_stiffness", .type = Type::stiffness, .doc = "Spring along the surface, in the unit of normal_stiffness. Omitted: normal_stiffness / 2.5.", .min = 0, .above = true},
      {.path = "interface.normal_stiffness_chosen", .type = Type::boolean, .fallback = "false", .doc = "Written by the program into scene.resolved.json: the stiffness was chosen, not given."},
      {.path = "interface.restitution", .type = Type::quantity, .dimension = number, .doc = "Newton's normal restitution. Omitted: what compliance and damping give. At a deformable structure springs get the dashpots that give it; hard contacts do not use it.", .min = 0, .max = 1},
      {.path = "interface.restitution_tangential", .type = Type::quantity, .dimension = number, .doc = "Restitution along the surface. Omitted: what friction gives.", .min = -1, .max = 1},
      {.path = "interface.rolling_resistance", .type = Type::quantity, .dimension = number, .fallback = "0.0", .doc = "Resistance to rolling: lever arm of the normal force over the equivalent radius.", .min = 0, .max = 1},
      {.path = "interface.drilling_resistance", .type = Type::quantity, .dimension = number,
       .doc = "Resistance to spin about the contact normal: moment over normal force and equivalent radius. Omitted: 2/3 friction rolling_resistance, that of uniform pressure on a patch as wide as the lever arm of rolling.", .min = 0, .max = 1},
      {.path = "interface.damping_ratio", .type = Type::quantity, .dimension = number, .fallback = "0.0", .doc = "Damping of the contact spring, relative to critical.", .min = 0, .max = 10},
      {.path = "interface.contact_law", .type = Type::text_or_table, .fallback = "\"linear\"",
       .doc = "\"linear\", or a table with `kind` and what that kind needs: { kind = \"hertz\", radius = }, { kind = \"crushing\", pressure = , and of layers gradient, thickness, ploughing, ploughing_density }, { kind = \"table\", file = }.", .choices = {"linear"}},
      {.path = "interface.contact_law.kind", .type = Type::choice, .doc = "Form of the law.", .required = "always in interface.contact_law", .choices = {"linear", "hertz", "crushing", "table"}},
      {.path = "interface.contact_law.radius", .type = Type::quantity, .dimension = length, .doc = "Equivalent radius of the Hertz contact.", .required = "if kind is \"hertz\"", .min = 0, .above = true},
      {.path = "interface.contact_law.pressure", .type = Type::quantity, .dimension = pressure, .doc = "Pressure at which the contact crushes.", .required = "if kind is \"crushing\"", .min = 0, .above = true},
      {.path = "interface.contact_law.gradient", .type = Type::quantity, .dimension = stiffness_per_area, .fallback = "0 Pa/m", .doc = "With crushing: by which the pressure grows with the depth crushed. Needs a normal_stiffness in Pa/m; not at a structure that deforms.", .min = 0},
      {.path = "interface.contact_law.thickness", .type = Type::quantity, .dimension = length, .doc = "With crushing: of the layer that crushes. What is crushed through is as stiff as normal_stiffness, and the run says so. Omitted: without end.", .min = 0, .above = true},
      {.path = "interface.contact_law.ploughing", .type = Type::quantity, .dimension = pressure, .fallback = "0 Pa", .doc = "With crushing: resistance of the ground in the way of what slides in it, over the area in the way.", .min = 0},
      {.path = "interface.contact_law.ploughing_density", .type = Type::quantity, .dimension = density, .fallback = "0 kg/m^3", .doc = "With crushing: the part of that resistance that grows with the speed, ploughing_density u^2/2; the density of the ground times a drag coefficient.", .min = 0},
      {.path = "interface.contact_law.file", .type = Type::path, .doc = "CSV with two columns, indentation in m and force in N, from 0, 0 on; both grow, and beyond the last point its slope goes on.", .required = "if kind is \"table\", unless points is given"},
      {.path = "interface.contact_law.points", .type = Type::pair_list, .dimension = force, .doc = "The same table in place: [[indentation, force], ...].", .min = 0, .first = length},
  };
}

}  // namespace talus::scene

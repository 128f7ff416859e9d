#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

std::vector<Key> general_keys() {
  return {
      {.path = "schema", .type = Type::integer, .doc = "Version of the scene format. This program reads 1.", .required = "always", .min = 1, .max = 1},
      {.path = "title", .type = Type::text, .fallback = "\"\"", .doc = "One line that heads the report."},

      {.path = "simulation", .type = Type::table, .doc = "How long, how exactly, and by which method."},
      {.path = "simulation.duration", .type = Type::quantity, .dimension = time, .fallback = "10 s",
       .doc = "Simulated time. The last step ends exactly there. With `until = \"rest\"` it is the bound.", .min = 0, .above = true},
      {.path = "simulation.until", .type = Type::choice, .fallback = "\"duration\"",
       .doc = "`rest` ends the run when every block has come to rest, `duration` runs to the end.", .choices = {"duration", "rest"}},
      {.path = "simulation.gravity", .type = Type::vector, .dimension = acceleration, .fallback = "[0.0, 0.0, -9.81]",
       .doc = "Acceleration of gravity in scene axes (x east, y north, z up)."},
      {.path = "simulation.accuracy", .type = Type::quantity, .dimension = number, .fallback = "1e-3",
       .doc = "Error control: the position error allowed, relative to the block size. The step follows from it. Not together with `step`.",
       .min = 1e-12, .max = 0.5},
      {.path = "simulation.step", .type = Type::quantity, .dimension = time,
       .doc = "Fixed step in place of error control. Not together with `accuracy`.", .required = "if method is \"dda-1988\"", .min = 0, .above = true},
      {.path = "simulation.min_step", .type = Type::quantity, .dimension = time, .fallback = "1e-9 s",
       .doc = "The smallest step a rejected step may shrink to; below it the run stops with its state saved.", .min = 0, .above = true},
      {.path = "simulation.method", .type = Type::choice, .fallback = "\"talus\"",
       .doc = "`talus`: one convex contact problem per step. `dda-1988`: the original scheme with penalty springs, a fixed step and open-close iteration; always 12 degrees of freedom a block.",
       .choices = {"talus", "dda-1988"}, .source = "dda-1988: Shi 1988"},
      {.path = "simulation.threads", .type = Type::integer, .fallback = "0",
       .doc = "Threads; 0 takes all cores. The result does not depend on it.", .min = 0, .max = 4096},
      {.path = "simulation.sleeping", .type = Type::boolean, .fallback = "true",
       .doc = "Resting blocks with a static certificate cost nothing until something reaches them."},
      {.path = "simulation.initial_state", .type = Type::path,
       .doc = "`results.h5` of an earlier run: blocks and structures of the same names start from its last state, damage included."},

      {.path = "site", .type = Type::table, .doc = "The terrain. Solid lies below it."},
      {.path = "site.terrain", .type = Type::path,
       .doc = "Terrain surface: STL, OBJ, PLY, OFF, ESRI ASCII grid or GeoTIFF. Grid nodes are cell centres; each quad is split from lower left to upper right.",
       .required = "always in [site]"},
      {.path = "site.material", .type = Type::text, .doc = "Material of the terrain.", .required = "always in [site]"},
      {.path = "site.two_sided", .type = Type::boolean, .fallback = "false",
       .doc = "The terrain is a sheet that blocks can touch from both sides. Otherwise its outside has n_z > 0 whatever the winding."},
      {.path = "site.decimation", .type = Type::quantity, .dimension = length, .fallback = "0 m",
       .doc = "Vertical error that thinning of the terrain may cause; 0 keeps every triangle.", .min = 0},
      {.path = "site.widen", .type = Type::quantity, .dimension = length, .fallback = "0 m",
       .doc = "Draws the border of the terrain out horizontally by this length.", .min = 0},
      {.path = "site.crop", .type = Type::table, .doc = "Keeps only the terrain inside this box, in scene coordinates."},
      {.path = "site.crop.min", .type = Type::plan_vector, .dimension = length, .doc = "Lower corner, [x, y] or [x, y, z].", .required = "always in site.crop"},
      {.path = "site.crop.max", .type = Type::plan_vector, .dimension = length, .doc = "Upper corner, [x, y] or [x, y, z].", .required = "always in site.crop"},
      {.path = "site.crs", .type = Type::text, .fallback = "\"\"", .doc = "Coordinate reference system of the terrain, e.g. \"EPSG:31254\"; kept for output. Empty: the file's own."},
      {.path = "site.origin", .type = Type::vector, .dimension = length, .fallback = "[0.0, 0.0, 0.0]",
       .doc = "Map coordinates of the scene's origin. They are taken from the terrain's coordinates when it is read."},
      {.path = "site.area", .type = Type::tables, .doc = "Parts of the terrain with a material of their own; the last that covers a place holds."},
      {.path = "site.area.polygon", .type = Type::path, .doc = "GeoJSON with polygons, in the terrain's map coordinates.", .required = "always in site.area"},
      {.path = "site.area.material", .type = Type::text, .doc = "Material inside the polygons.", .required = "always in site.area"},

      {.path = "plane", .type = Type::tables, .doc = "Unbounded fixed planes, solid below."},
      {.path = "plane.point", .type = Type::vector, .dimension = length, .fallback = "[0.0, 0.0, 0.0]", .doc = "A point of the plane."},
      {.path = "plane.normal", .type = Type::vector, .dimension = number, .doc = "Outward normal; its length does not matter.",
       .required = "unless dip_direction and dip are given"},
      {.path = "plane.dip_direction", .type = Type::quantity, .dimension = angle, .doc = "Direction of steepest descent, clockwise from north (+y).", .min = -6.2831853071795865, .max = 6.2831853071795865},
      {.path = "plane.dip", .type = Type::quantity, .dimension = angle, .doc = "Angle below the horizontal.", .min = 0, .max = 1.5707963267948967},
      {.path = "plane.material", .type = Type::text, .doc = "Material of the plane.", .required = "always in plane"},

      {.path = "coupling", .type = Type::table, .doc = "How blocks and structures act on each other. Only in a scene with a structure."},
      {.path = "coupling.scheme", .type = Type::choice, .fallback = "\"two-way\"",
       .doc = "`two-way`: one system. `one-way`: blocks strike a rigid surface, the recorded loads are put on the structure afterwards. `rigid`: the structure is a fixed surface.",
       .choices = {"two-way", "one-way", "rigid"}},
      {.path = "coupling.audit", .type = Type::choice, .fallback = "\"report\"",
       .doc = "`strict` fails the run when a gate of the interface audit is broken; `report` only says so.", .choices = {"strict", "report"}},
      {.path = "coupling.exchanges_per_rise", .type = Type::integer, .fallback = "20",
       .doc = "Least number of exchanges while a contact force rises.", .min = 1, .max = 100000},
      {.path = "coupling.fragments", .type = Type::boolean, .fallback = "true",
       .doc = "Parts of a structure that lose their support go on as blocks."},

      {.path = "output", .type = Type::table, .doc = "What is written, and how often."},
      {.path = "output.interval", .type = Type::quantity, .dimension = time, .fallback = "0.05 s", .doc = "Between fields (frames of the playback).", .min = 0, .above = true},
      {.path = "output.history_interval", .type = Type::quantity, .dimension = time, .fallback = "0.01 s",
       .doc = "Between history rows. Every island hits these times exactly.", .min = 0, .above = true},
      {.path = "output.checkpoint_steps", .type = Type::integer, .fallback = "0", .doc = "Steps between checkpoints; 0 lets the program choose.", .min = 0, .max = 1e9},
      {.path = "output.report", .type = Type::boolean, .fallback = "true", .doc = "Writes report.html at the end."},

      {.path = "resolved", .type = Type::table, .doc = "Written by the program into scene.resolved.json; not for scenes written by hand."},
      {.path = "resolved.version", .type = Type::text, .fallback = "\"\"", .doc = "Program version that wrote the file."},
      {.path = "resolved.scene", .type = Type::text, .fallback = "\"\"", .doc = "The scene file it came from."},
      {.path = "resolved.file", .type = Type::tables, .doc = "Every file the scene names, with its hash. A file that has changed is an error."},
      {.path = "resolved.file.path", .type = Type::text, .doc = "Absolute path.", .required = "always in resolved.file"},
      {.path = "resolved.file.sha256", .type = Type::text, .doc = "SHA-256 of the contents.", .required = "always in resolved.file"},
      {.path = "resolved.note", .type = Type::texts, .doc = "What was chosen for the user, one line per fact."},

      {.path = "line", .type = Type::planned, .doc = "Lines (nets, cables, roads) are planned."},
      {.path = "ensemble", .type = Type::planned, .doc = "Ensembles of perturbed runs are planned."},
  };
}

}  // namespace talus::scene

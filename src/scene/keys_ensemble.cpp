#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

std::vector<Key> ensemble_keys() {
  return {
      {.path = "line", .type = Type::tables, .doc = "Lines in plan. `talus ensemble` records a row each time that the path of a block's centroid crosses one, either way."},
      {.path = "line.name", .type = Type::text, .doc = "Name in results.", .required = "always in line"},
      {.path = "line.points", .type = Type::plan_points, .dimension = length, .doc = "Its points in plan, scene coordinates, joined by straight segments.", .required = "unless file is given"},
      {.path = "line.file", .type = Type::path, .doc = "GeoJSON with lines in map coordinates, in place of points; `site.origin` is taken off.", .required = "unless points are given"},

      {.path = "ensemble", .type = Type::table, .doc = "For `talus ensemble`: many members, each a run of this scene with some of its keys drawn at random. `talus run` leaves it out."},
      {.path = "ensemble.members", .type = Type::integer, .doc = "Number of members. With `precision` the most there may be; with design \"factorial\" a multiple of the number of combinations.",
       .required = "unless precision is given or design is \"factorial\"", .min = 1, .max = 10000000, .otherwise = "100000 with precision, every combination once with factorial"},
      {.path = "ensemble.precision", .type = Type::table, .doc = "Members are added, 256 at a time, until a percentile at a line is known well enough."},
      {.path = "ensemble.precision.line", .type = Type::text, .doc = "Name of the line.", .required = "always in ensemble.precision"},
      {.path = "ensemble.precision.quantity", .type = Type::choice, .fallback = "\"energy\"", .doc = "What is looked at there.", .choices = {"energy", "speed", "height"}},
      {.path = "ensemble.precision.percentile", .type = Type::quantity, .dimension = number, .fallback = "95", .doc = "Which percentile of the members' largest values.", .min = 0, .max = 100, .above = true, .below = true},
      {.path = "ensemble.precision.within", .type = Type::quantity, .dimension = number, .fallback = "0.1", .doc = "Half the width of its 95 % interval over its value, at which members are enough.", .min = 0, .max = 10, .above = true},
      {.path = "ensemble.seed", .type = Type::integer, .fallback = "1", .doc = "Member i draws from (seed, i) alone: the same values for any number of threads and ranks and any order.", .min = 0, .max = 4294967295.0},
      {.path = "ensemble.step_limit", .type = Type::integer, .fallback = "200000", .doc = "Steps of one member; over it the member is stopped, counted and reported.", .min = 1, .max = 1e12},
      {.path = "ensemble.design", .type = Type::choice, .fallback = "\"random\"",
       .doc = "`random`: independent members. `sobol`: 16 replicates of a low-discrepancy sequence, each scrambled on its own; intervals are over the replicates. `factorial`: every combination of the `list`s, other variables at random.",
       .choices = {"random", "sobol", "factorial"}, .source = "Sobol' sequence by Joe & Kuo 2008, nested uniform scrambling by Owen 1995"},
      {.path = "ensemble.map_cell", .type = Type::quantity, .dimension = length, .fallback = "2 m", .doc = "Edge of the cells of the maps.", .min = 0, .above = true},
      {.path = "ensemble.releases_per_year", .type = Type::quantity, .dimension = number, .doc = "Blocks of this kind that come loose in a year; return periods and probabilities per year need it.", .min = 0, .max = 1e6, .above = true},
      {.path = "ensemble.vary", .type = Type::tables, .doc = "The variables. Each takes one of lognormal, normal, uniform, power_law, list, table, rotation; a block's release needs none."},
      {.path = "ensemble.vary.key", .type = Type::text, .doc = "Any key that --set takes, e.g. block.B1.volume. block.B1.release draws one place of that block's release area for each member.", .required = "always in ensemble.vary"},
      {.path = "ensemble.vary.lognormal", .type = Type::amounts, .doc = "[mean, standard deviation], of the quantity itself."},
      {.path = "ensemble.vary.normal", .type = Type::amounts, .doc = "[mean, standard deviation]."},
      {.path = "ensemble.vary.uniform", .type = Type::amounts, .doc = "[low, high]; of whole numbers both can be drawn."},
      {.path = "ensemble.vary.power_law", .type = Type::amounts,
       .doc = "[exponent a, min, max]: probability density proportional to x^-|a|. A cumulative frequency N(>= x) proportional to x^-b has a = b + 1."},
      {.path = "ensemble.vary.list", .type = Type::values, .doc = "Values, each as likely as the others."},
      {.path = "ensemble.vary.table", .type = Type::path, .doc = "CSV file of one column: measured values, each as likely as the others."},
      {.path = "ensemble.vary.rotation", .type = Type::choice, .doc = "For an orientation: `uniform` over all.", .choices = {"uniform"}, .source = "Shoemake 1992"},
      {.path = "ensemble.vary.min", .type = Type::amount, .doc = "The distribution is cut off below: what remains keeps its shape."},
      {.path = "ensemble.vary.max", .type = Type::amount, .doc = "The distribution is cut off above: what remains keeps its shape."},
      {.path = "ensemble.vary.like", .type = Type::integer, .doc = "Draws with an earlier variable, by its place from 0: full correlation.", .min = 0, .max = 10000},
  };
}

}  // namespace talus::scene

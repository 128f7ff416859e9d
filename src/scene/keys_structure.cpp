#include "scene/key_tables.hpp"

namespace talus::scene {

using namespace dimension;

std::vector<Key> structure_keys() {
  std::vector<Key> keys{
      {.path = "structure", .type = Type::tables, .doc = "Deformable structures, as finite elements."},
      {.path = "structure.enabled",
       .type = Type::boolean,
       .fallback = "true",
       .doc = "false: as if the structure were not in the scene; for options that are compared, by --set "
              "structure.NAME.enabled=false."},
      {.path = "structure.name",
       .type = Type::text,
       .doc = "Name in histories and reports, which no block and no other structure has. Omitted: S and its "
              "place, from 1."},
      {.path = "structure.kind",
       .type = Type::choice,
       .doc = "Parametric viaduct, column (base, section, height), box (position, size), or a mesh file.",
       .required = "always in structure",
       .choices = {"viaduct", "column", "box", "mesh"}},
      {.path = "structure.material",
       .type = Type::text,
       .doc = "A material with f_cm, or with young and density.",
       .required = "always in structure"},
      {.path = "structure.position",
       .type = Type::vector,
       .dimension = length,
       .doc = "Box: centroid. Viaduct: base of the first pier (of the first bent, at its middle); the axis "
              "runs along +x unless `orientation` turns it. Mesh: where its volume centroid goes; omitted: "
              "the file's coordinates are the world's.",
       .required = "if kind is \"box\" or \"viaduct\""},
      {.path = "structure.size",
       .type = Type::vector,
       .dimension = length,
       .doc = "Box: full extents.",
       .required = "if kind is \"box\"",
       .min = 0,
       .above = true},
      {.path = "structure.base",
       .type = Type::vector,
       .dimension = length,
       .doc = "Column: centre of its base.",
       .required = "if kind is \"column\""},
      {.path = "structure.section",
       .type = Type::section,
       .dimension = length,
       .fallback = "\"rectangular\"",
       .doc = "Column: [x, y] of a rectangle, or \"round\" with `diameter` or \"hollow\" with "
              "`section_size` and `wall_thickness`. Viaduct: the same for its piers.",
       .min = 0,
       .above = true,
       .choices = {"rectangular", "round", "hollow"}},
      {.path = "structure.section_size",
       .type = Type::plan_vector,
       .dimension = length,
       .doc = "Outer extents [x, y] of a named section.",
       .min = 0,
       .above = true},
      {.path = "structure.diameter",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Diameter of a round section.",
       .min = 0,
       .above = true},
      {.path = "structure.wall_thickness",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Wall of a hollow section.",
       .required = "if section is \"hollow\"",
       .min = 0,
       .above = true},
      {.path = "structure.height",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Column: from base to top.",
       .required = "if kind is \"column\"",
       .min = 0,
       .above = true},
      {.path = "structure.file",
       .type = Type::path,
       .doc = "Mesh: Gmsh .msh, or Abaqus/CalculiX .inp; hexahedra or tetrahedra, one of the two in each "
              "connected part. Hexahedra alone: .vtk and .unv too, whose groups are \"material 1\" and "
              "\"boundary 1\" by the numbers in the file.",
       .required = "if kind is \"mesh\""},
      {.path = "structure.orientation", .type = Type::table, .doc = "As block.orientation."},
      {.path = "structure.orientation.quaternion",
       .type = Type::quaternion,
       .dimension = number,
       .doc = "[w, x, y, z], Hamilton, body to world."},
      {.path = "structure.orientation.matrix",
       .type = Type::vectors,
       .dimension = number,
       .doc = "Three rows, body to world; written by the program into scene.resolved.json, where every bit "
              "counts."},
      {.path = "structure.orientation.rotation_vector",
       .type = Type::vector,
       .dimension = angle,
       .doc = "Axis times angle, rad."},
      {.path = "structure.orientation.dip_direction",
       .type = Type::quantity,
       .dimension = angle,
       .doc = "Body x points down dip; clockwise from north (+y).",
       .min = -6.2831853071795865,
       .max = 6.2831853071795865},
      {.path = "structure.orientation.dip",
       .type = Type::quantity,
       .dimension = angle,
       .doc = "Body z is the upward normal of the plane with this dip.",
       .min = 0,
       .max = 1.5707963267948967},
      {.path = "structure.cell_size",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Edge of the finite elements. Round sections: facets no longer than that around (8 at least), "
              "rings inside about as thick; `talus check` says how many. The polygon has the circle's area, "
              "and what is halved later (`local`, `where`) stays on its flat facets.",
       .required = "unless cells is given (a mesh file brings its own)",
       .min = 0,
       .above = true},
      {.path = "structure.cells",
       .type = Type::counts,
       .doc = "[nx, ny, nz] elements, for box and column (round: as cell_size = diameter / nx). Not together "
              "with "
              "cell_size.",
       .min = 1,
       .max = 10000},
      {.path = "structure.refine",
       .type = Type::tables,
       .doc = "Zones of finer cells, for box, column and viaduct with cell_size. The planes of the mesh "
              "crowd there and widen by about 1.3 from cell to cell outside."},
      {.path = "structure.refine.region",
       .type = Type::table,
       .doc = "Box that holds the zone, in scene coordinates.",
       .required = "unless where is \"impact\""},
      {.path = "structure.refine.region.min",
       .type = Type::vector,
       .dimension = length,
       .doc = "Lower corner.",
       .required = "always in structure.refine.region"},
      {.path = "structure.refine.region.max",
       .type = Type::vector,
       .dimension = length,
       .doc = "Upper corner.",
       .required = "always in structure.refine.region"},
      {.path = "structure.refine.cell_size",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Edge of the cells in the zone.",
       .required = "always in structure.refine",
       .min = 0,
       .above = true},
      {.path = "structure.refine.where",
       .type = Type::choice,
       .fallback = "\"region\"",
       .doc =
           "In the region, from the start; or where blocks are about to strike, found from their paths "
           "before each blow (again before later ones elsewhere that bring a twentieth of the strongest): "
           "cells are halved there until they are as small as asked, and end there in hanging nodes; those "
           "that have cracked stay (a structure with supports, coupling.scheme = \"two-way\").",
       .choices = {"region", "impact"}},
      {.path = "structure.refine.reach",
       .type = Type::quantity,
       .dimension = length,
       .doc = "where = \"impact\": how far around the first contact. Omitted: half of the block's size.",
       .min = 0,
       .above = true},
      {.path = "structure.refine.local",
       .type = Type::boolean,
       .fallback = "false",
       .doc = "The finer cells end at the border of the zone: cells that it cuts are halved until they are "
              "as small as asked, with hanging nodes between two sizes (for every kind, file meshes too). "
              "false: the mesh's planes crowd in the zone and go on along each axis to the far side."},
      {.path = "structure.support",
       .type = Type::supports,
       .fallback = "[\"-z\"]",
       .doc = "Faces held (\"-x\" to \"+z\"), mesh groups by name, or tables { face = }, { group = }, { "
              "point = }, { line = [[..], [..]] }, { region = { min, max } } with `held = \"xyz\"` (the "
              "directions). [] leaves it free."},
      {.path = "structure.support.face",
       .type = Type::choice,
       .doc = "Face of the bounding box.",
       .choices = {"-x", "+x", "-y", "+y", "-z", "+z"}},
      {.path = "structure.support.group", .type = Type::text, .doc = "Group of the mesh file."},
      {.path = "structure.support.point",
       .type = Type::vector,
       .dimension = length,
       .doc = "Node at this point."},
      {.path = "structure.support.line",
       .type = Type::vectors,
       .dimension = length,
       .doc = "Nodes along the axis-parallel line between two points."},
      {.path = "structure.support.region", .type = Type::table, .doc = "Nodes inside a box."},
      {.path = "structure.support.region.min",
       .type = Type::vector,
       .dimension = length,
       .doc = "Lower corner.",
       .required = "always in structure.support.region"},
      {.path = "structure.support.region.max",
       .type = Type::vector,
       .dimension = length,
       .doc = "Upper corner.",
       .required = "always in structure.support.region"},
      {.path = "structure.support.held",
       .type = Type::text,
       .fallback = "\"xyz\"",
       .doc = "Directions held: some of x, y, z."},
      {.path = "structure.preload",
       .type = Type::choice,
       .fallback = "\"gravity\"",
       .doc = "State before t = 0: at rest under its own weight, or unstressed.",
       .choices = {"gravity", "none"}},
      {.path = "structure.damage",
       .type = Type::choice,
       .fallback = "\"none\"",
       .doc = "Damage law: d+/d- damage with crack band, or CDPM2.",
       .choices = {"none", "concrete", "concrete-cdpm2"},
       .source = "Faria and Oliver 1998; Grassl et al. 2013"},
      {.path = "structure.rate_effect",
       .type = Type::boolean,
       .fallback = "true",
       .doc = "Strength grows with the strain rate.",
       .source = "fib Model Code 2010, 5.1.11"},
      {.path = "structure.erosion",
       .type = Type::boolean,
       .fallback = "true",
       .doc = "Elements that carry nothing in any direction (cracked and crushed, and open) are removed, and "
              "those that a crack holds open by 5 mm once a piece comes off beside them. Mass at nodes that "
              "other elements hold stays; the rest leaves as dust. Without, only those torn to 1.7 times "
              "their length or flat are."},
      {.path = "structure.aggregate",
       .type = Type::quantity,
       .dimension = length,
       .fallback = "16 mm",
       .doc = "Largest grain of the concrete: faces of cracks interlock up to the shear limit of the "
              "modified compression field theory (damage = \"concrete\" alone). 0: they carry what the "
              "damage law leaves.",
       .min = 0,
       .max = 0.1},
      {.path = "structure.rebar",
       .type = Type::path_or_tables,
       .doc = "CSV of bars as polylines, or rules as [[structure.rebar]]."},
      {.path = "structure.rebar.kind",
       .type = Type::choice,
       .doc = "What the rule lays out.",
       .required = "always in structure.rebar",
       .choices = {"longitudinal", "stirrups"}},
      {.path = "structure.rebar.part",
       .type = Type::choice,
       .fallback = "\"pier\"",
       .doc = "Viaduct: the piers, the cap beams on them, or the decks (longitudinal bars along the lower "
              "side of every girder, or of the solid deck).",
       .choices = {"pier", "cap", "deck"}},
      {.path = "structure.rebar.bars",
       .type = Type::integer,
       .fallback = "0",
       .doc = "Number of longitudinal bars: of a pier, of a cap beam (around its section), of a girder, or "
              "of a solid deck. They run up a column, and along the longest side of a box; bars across need "
              "a CSV file.",
       .required = "if kind is \"longitudinal\"",
       .min = 0,
       .max = 100000},
      {.path = "structure.rebar.diameter",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Diameter of a bar.",
       .required = "always in structure.rebar",
       .min = 0,
       .max = 0.1,
       .above = true},
      {.path = "structure.rebar.cover",
       .type = Type::quantity,
       .dimension = length,
       .doc = "Concrete outside of the stirrups, in rules for longitudinal bars too: these lie within the "
              "stirrups of their part, at cover and stirrup's diameter from the surface. Without stirrups: "
              "concrete outside the bar.",
       .required = "always in structure.rebar",
       .min = 0,
       .above = true},
      {.path = "structure.rebar.spacing",
       .type = Type::quantity,
       .dimension = length,
       .fallback = "0 m",
       .doc = "Distance of stirrups.",
       .required = "if kind is \"stirrups\"",
       .min = 0},
      {.path = "structure.rebar.yield",
       .type = Type::quantity,
       .dimension = pressure,
       .fallback = "500 MPa",
       .doc = "Yield stress.",
       .min = 0,
       .above = true},
      {.path = "structure.rebar.prestress",
       .type = Type::quantity,
       .dimension = pressure,
       .fallback = "0 Pa",
       .doc = "Initial stress of the bars, below the yield stress.",
       .min = 0},
      {.path = "structure.rebar.ultimate_strain",
       .type = Type::quantity,
       .dimension = number,
       .fallback = "0.05",
       .doc = "Strain at fracture.",
       .min = 0,
       .max = 1,
       .above = true},
      {.path = "structure.bond",
       .type = Type::choice,
       .fallback = "\"perfect\"",
       .doc =
           "Bars move with the concrete, or slip by the law of the Model Code (good conditions, pull-out).",
       .choices = {"perfect", "mc2010"},
       .source = "fib Model Code 2010, 6.1.1"},
      {.path = "structure.damping_ratio",
       .type = Type::quantity,
       .dimension = number,
       .fallback = "0.0",
       .doc = "Damping of the first mode, relative to critical.",
       .min = 0,
       .max = 1,
       .below = true},
      {.path = "structure.integrator",
       .type = Type::choice,
       .fallback = "\"auto\"",
       .doc = "Time integration; auto takes the cheapest that is accurate. While blocks are at it: explicit "
              "sub-steps, or condensed long steps (auto: where no damage grows, no block is about to strike "
              "and all blocks at it rest; implicit, modal: also where blocks move at it; explicit: never).",
       .choices = {"auto", "explicit", "implicit", "modal"}},
      {.path = "structure.critical_step_fraction",
       .type = Type::quantity,
       .dimension = number,
       .fallback = "0.9",
       .doc = "Explicit step over the stable one.",
       .min = 1e-3,
       .max = 1},
      {.path = "structure.initial_velocity",
       .type = Type::vector,
       .dimension = velocity,
       .fallback = "[0.0, 0.0, 0.0]",
       .doc = "Velocity of the whole structure at t = 0 (free bodies)."},
      {.path = "structure.probe", .type = Type::tables, .doc = "Points whose displacement is recorded."},
      {.path = "structure.probe.name",
       .type = Type::text,
       .doc = "Name in the histories.",
       .required = "always in structure.probe"},
      {.path = "structure.probe.at",
       .type = Type::vector,
       .dimension = length,
       .doc = "The point, in scene coordinates; the nearest material point is followed.",
       .required = "unless offset is given"},
      {.path = "structure.probe.offset",
       .type = Type::vector,
       .dimension = length,
       .doc =
           "In place of at: the point from the structure's base (column) or position (box, viaduct), along "
           "its own axes, so that it moves with the structure: [0, 0, height] is the top of a column."},
      {.path = "structure.load",
       .type = Type::tables,
       .doc = "Prescribed traction on a patch of the surface."},
      {.path = "structure.load.region",
       .type = Type::table,
       .doc = "Box that holds the patch.",
       .required = "always in structure.load"},
      {.path = "structure.load.region.min",
       .type = Type::vector,
       .dimension = length,
       .doc = "Lower corner.",
       .required = "always in structure.load.region"},
      {.path = "structure.load.region.max",
       .type = Type::vector,
       .dimension = length,
       .doc = "Upper corner.",
       .required = "always in structure.load.region"},
      {.path = "structure.load.traction",
       .type = Type::vector,
       .dimension = pressure,
       .doc = "Force per area, in scene axes.",
       .required = "always in structure.load"},
      {.path = "structure.load.history",
       .type = Type::pair_list,
       .dimension = number,
       .fallback = "[[0.0, 1.0]]",
       .doc = "[[time, factor], ...] with growing times; straight in between, the first factor holds before, "
              "the last one after.",
       .first = time},
  };
  // The viaduct's own measures become StructureSpec::parameters under the last part of their path.
  const auto viaduct = [&](const char* name, Dimension dimension, const char* otherwise, const char* doc,
                           double min = 0, bool above = true) {
    keys.push_back({.path = std::string("structure.") + name,
                    .type = Type::quantity,
                    .dimension = dimension,
                    .doc = doc,
                    .min = min,
                    .above = above,
                    .otherwise = otherwise});
  };
  viaduct("spans", number, "3",
          "Viaduct: number of spans, a whole number. The axis runs along +x from the first pier (turned by "
          "`orientation`); supports stand every span_length.");
  viaduct("span_length", length, "20 m", "Viaduct: length of a span, from support to support.");
  keys.push_back(
      {.path = "structure.span_lengths",
       .type = Type::pair_list,
       .dimension = length,
       .doc = "Viaduct: spans of other lengths, [[number from 1, length], ...]; the others keep span_length.",
       .min = 0,
       .above = true,
       .otherwise = "none",
       .first = number});
  viaduct("pier_height", length, "10 m",
          "Viaduct: from base to the lower side of the cap beam. Not together with deck_level.");
  viaduct("deck_level", length, "none: pier_height holds",
          "Viaduct: height (z) of the deck's upper side. Each pier then stands on the terrain under it, and "
          "z of `position` does not count where there is terrain.",
          -1e9);
  viaduct("pier_spacing", length, "4 m", "Viaduct: distance of the piers of one bent across the axis.");
  viaduct("piers_per_bent", number, "1", "Viaduct: piers side by side under one cap beam, a whole number.");
  viaduct("pier_width", length, "1.5 m", "Viaduct: pier section along the axis.");
  viaduct("pier_depth", length, "1.5 m", "Viaduct: pier section across the axis.");
  viaduct("pier_diameter", length, "none",
          "Viaduct: diameter of round piers (section = \"round\"); the same as `diameter`, in place of "
          "pier_width and pier_depth.");
  viaduct("cap_height", length, "1 m", "Viaduct: height of the cap beams, at least 0.1 m.", 0.1, false);
  viaduct("cap_width", length, "pier_width + 0.5 m", "Viaduct: cap beam along the axis.");
  viaduct("cap_length", length, "deck_width", "Viaduct: cap beam across the axis.");
  viaduct("deck_width", length, "8 m", "Viaduct: deck across the axis.");
  viaduct("deck_depth", length, "1.5 m", "Viaduct: depth of the deck.");
  viaduct("slab_thickness", length, "0.3 m", "Viaduct: slab of a girder or box deck.");
  viaduct("girders", number, "0", "Viaduct: number of T-girders; 0 is a solid deck.", 0, false);
  viaduct(
      "bottom_slab", length, "0 m",
      "Viaduct: slab between the lower ends of the outermost girders, which makes them a box; 0: T-girders.",
      0, false);
  viaduct("girder_width", length, "0.5 m", "Viaduct: web width of a girder or box.");
  viaduct("bearing_height", length, "0.1 m", "Viaduct: height of the bearings.");
  viaduct("bearing_stiffness", stiffness, "10 MN/m", "Viaduct: stiffness of a bearing along the deck.");
  viaduct("bearing_friction", number, "0.3", "Viaduct: friction coefficient of the bearings.", 0, false);
  viaduct("bearing_seat", length, "0.5 m",
          "Viaduct: length a deck end can slide along the axis towards its span before it falls, at most "
          "what rests on the cap beam; across, a girder falls off the ends of the cap beam. Omitted: what "
          "rests there, where that is less.");
  viaduct("abutments", number, "0", "Viaduct: 1 with abutments at both ends, 0 without.", 0, false);
  viaduct("skew", angle, "0 deg",
          "Viaduct: angle from the square across the axis to the lines of supports, anticlockwise seen from "
          "above, at most 75 degrees. Piers, cap beams and abutments are turned by it, the decks sheared; "
          "cap_length and pier_spacing are along the supports, deck_width is square to the axis.",
          -1e9);
  viaduct("grade", number, "0",
          "Viaduct: rise of the deck over its length along the axis, 0.04 for four in a hundred; negative "
          "where it falls. pier_height and deck_level are those at the first pier; along the supports the "
          "deck is level.",
          -1e9);
  keys.push_back(
      {.path = "structure.parameters",
       .type = Type::free_table,
       .doc = "Further measures of the parametric kinds by name, each a number or a quantity with a unit."});
  return keys;
}

}  // namespace talus::scene

/// A viaduct from a few numbers: bents of piers under cap beams, simply supported spans on bearings, abutments.
///
/// Body axes: x along the axis, y across, z up; the origin is the base of the first pier (of the first bent, at its middle). Supports
/// stand at i * span_length; with abutments the first and the last are abutments, and the first pier stands at span_length from the first.
///
/// parameter         default   meaning                                                  unit
/// spans             3         number of spans                                          -
/// span_length       20                                                                 m
/// pier_height       10        base of the first pier to the cap beam (or deck_level)   m
/// deck_level        -         world z of the deck's upper side, in place of pier_height  m
/// piers_per_bent    1         side by side across the axis, pier_spacing apart         -
/// pier_spacing      4                                                                  m
/// pier_width        1.5       section along the axis; pier_depth across                m
/// pier_depth        1.5                                                                m
/// cap_height        1.0       cap_width (pier_width + 0.5) along, cap_length (deck_width) across  m
/// deck_width        8         deck_depth 1.5, slab_thickness 0.3, girders 0 (solid), girder_width 0.5   m
/// bearing_height    0.1       bearing_stiffness 1e7 N/m, bearing_friction 0.3, bearing_seat 0.5 m
/// abutments         0         1: abutments at both ends                                -
#pragma once
#include <vector>

#include "fem/hex_mesh.hpp"
#include "fem/rebar_geometry.hpp"

namespace talus::fem {

struct ViaductPlan {
  struct Part { std::vector<Box3> boxes; bool founded = false; int deck = -1; };   // founded: its lowest nodes are held
  struct Pad { Vec3 at; int deck, end; double length, width; };                     // at: on the cap, body axes
  std::vector<Part> parts;
  std::vector<Pad> pads;
  std::vector<rebar::Member> piers;      // world axes
  double bearing_height = 0.1, bearing_stiffness = 1e7, bearing_friction = 0.3, bearing_seat = 0.5;
};

/// Throws InputError for measures that do not fit together.
ViaductPlan viaduct_plan(const StructureSpec& spec);
HexMesh viaduct_mesh(const StructureSpec& spec);

}  // namespace talus::fem

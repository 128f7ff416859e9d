/// A viaduct from a few numbers: bents of piers under cap beams, simply supported spans on bearings,
/// abutments.
///
/// Piers are rectangular, hollow (section "hollow", wall_thickness) or round (section "round", diameter), and
/// solid in the cap beam.
///
/// Body axes: x along the axis, y across, z up; the origin is the base of the first pier (of the first bent,
/// at its middle). Supports stand at i * span_length; with abutments the first and the last are abutments,
/// and the first pier stands at span_length from the first.
///
/// Skew and grade: each part is laid out square and level in axes of its own, and placed by an affine map to
/// body axes. With the skew s, the grade g and the support x_i,
///   bent i:  x = x_i + R_z(s) (X - x_i),                                    cap beams stay level
///   span i:  x = X - Y tan s,  y = Y,  z = Z + g (X - x_i),                 sheared, level along the
///   supports
///
/// parameter         default   meaning                                                  unit
/// spans             3         number of spans                                          -
/// span_length       20                                                                 m
/// pier_height       10        base of the first pier to the cap beam (or deck_level)   m
/// deck_level        -         world z of the deck's upper side, in place of pier_height  m
/// piers_per_bent    1         side by side across the axis, pier_spacing apart         -
/// pier_spacing      4                                                                  m
/// pier_width        1.5       section along the axis; pier_depth across                m
/// pier_depth        1.5       round piers: pier_diameter in place of both              m
/// cap_height        1.0       cap_width (pier_width + 0.5) along, cap_length (deck_width) across  m
/// deck_width        8         deck_depth 1.5, slab_thickness 0.3, girders 0 (solid), girder_width 0.5   m
/// bottom_slab       0         thickness of a slab that closes the girders to a box          m
/// bearing_height    0.1       bearing_stiffness 1e7 N/m, bearing_friction 0.3, bearing_seat 0.5  m
/// abutments         0         1: abutments at both ends                                -
/// skew              0         from the square across the axis to the lines of supports, anticlockwise  rad
/// grade             0         rise of the deck along the axis; the level is that at the first pier     m/m
#pragma once
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/members/members.hpp"

namespace talus::fem {

struct ViaductPlan {
  struct Round {
    Vec3 foot;
    double radius, top;
  };
  struct Part {
    std::vector<Box3> boxes;    // of a bent: piers first, the cap beam last
    std::vector<Round> rounds;  // round piers in place of boxes
    bool founded = false;       // its feet are held
    int deck = -1;
    Mat3 turn = Mat3::Identity();  // from its own axes to body axes: x = turn X + shift
    Vec3 shift = Vec3::Zero();
    Vec3 placed(const Vec3& own) const { return turn * own + shift; }
    Vec3 own(const Vec3& placed) const { return turn.inverse() * (placed - shift); }
  };
  struct Pad {
    Vec3 at;
    int deck, end;
    double length, width;
  };  // at: under the deck, in the axes of its part
  std::vector<Part> parts;
  std::vector<Pad> pads;
  std::vector<Pier> piers, spans;  // world axes
  struct Soffit {
    Vec3 start, end, across;
    double width;
  };  // lower side of a girder or solid deck, world axes; across: along the supports, per metre of width
  std::vector<Soffit> soffits;
  double bearing_height = 0.1, bearing_stiffness = 1e7, bearing_friction = 0.3, bearing_seat = 0.5;
};

/// Throws InputError for measures that do not fit together.
ViaductPlan viaduct_plan(const StructureSpec& spec);
/// `mesh.local`: in the axes of the parts.
HexMesh viaduct_mesh(const StructureSpec& spec);
/// The zones of finer cells in the axes of a part.
std::vector<StructureSpec::Refinement> zones_of(const ViaductPlan::Part& part, const StructureSpec& spec);

/// Round piers under a cap beam: in plan a disc of quadrilaterals inside a square of the cap beam's grid,
/// extruded; `feet` gets the nodes at the feet. The polygon has the area of the circle.
HexMesh round_bent(const Box3& cap, const std::vector<ViaductPlan::Round>& piers, double cell_size,
                   const std::vector<StructureSpec::Refinement>& refinements, std::vector<int>& feet);

/// The cap beams on piers as members along the deck's transverse axis (axis_x up), for bars by rule.
std::vector<rebar::Member> cap_members(const StructureSpec& spec);

/// Bars along the lower side of every girder (or solid deck), evenly over its width. Throws InputError if
/// they do not fit.
std::vector<rebar::Bar> deck_bars(const StructureSpec& spec, const StructureSpec::RebarRule& rule,
                                  const material::Steel::Parameters& steel);

}  // namespace talus::fem

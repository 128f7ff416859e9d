/// What the design formulas ask of a structure's section, from its measures and its bars.
#pragma once
#include "contact/structures/structure.hpp"
#include "sim/frame.hpp"

namespace talus::sim {

/// Sets form (a box is a slab if its vertical extent is the least by half, a beam if its longest is level,
/// else a column), young, axes, effective_depth and reinforcement_ratio. For a blow along an axis of a box's
/// or column's section, with h its extent along the blow and w across:
///
///   d = h - cover - diameter / 2,   rho = sqrt(rho_l rho_w),   rho_l = n w / (2 (w + h)) A_bar / (w d),
///   rho_w = A_stirrup / (spacing d)
///
/// n bars evenly along the perimeter, so that the share of the far side is tensioned. Bars of a file count as
/// layers: those that run along one of the two axes across the blow and lie in an outer quarter of h, half of
/// them tensioned; d and rho are the mean and the root of the product of both directions. Where bars do not
/// say, d = 0.9 h and no ratio. A viaduct and a mesh have no one section: young alone.
void describe_section(const StructureSpec& spec, const Structure& structure, RunHeader::StructureInfo& info);

}  // namespace talus::sim

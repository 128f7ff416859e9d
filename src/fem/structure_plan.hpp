/// What a structure will be, from its measures alone.
#pragma once
#include "contact/structures/structure_plan.hpp"

namespace talus::fem {

/// Throws InputError as plan_structure() does.
StructurePlan plan_of(const StructureSpec& spec, const Vec3& gravity);

/// Of memory, while it is made and stepped, at most [bytes].
double bytes_of_cell(const StructureSpec& spec);
/// Cells of a structure that is generated, about. Throws InputError where they are too many for this machine.
double cell_count(const StructureSpec& spec);
/// Cells of it that the memory of this machine holds, at most 20 million.
double most_cells(const StructureSpec& spec);

}  // namespace talus::fem

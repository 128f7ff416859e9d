/// What a structure will be and what it will take, from its measures alone: said before any cell is made.
#pragma once
#include <string>

#include "contact/structures/structure.hpp"

namespace talus {

struct StructurePlan {
  double cells = 0;   // about; 0: of a mesh file, not known yet
  double memory = 0;  // while it is made and solved, at most about [bytes]
  std::string text;   // one line: cells, what is solved for and how, memory, time
};

/// Throws InputError for measures that do not fit together, for cells that the law of the concrete cannot
/// have, and for more cells than there is memory for.
StructurePlan plan_structure(const StructureSpec& spec, const Vec3& gravity);

/// Signature of the function that the finite-element module exports as "talus_plan_structure".
using PlanStructure = void (*)(const StructureSpec&, const Vec3& gravity, StructurePlan&);

}  // namespace talus

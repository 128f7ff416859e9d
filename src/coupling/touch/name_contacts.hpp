/// Contacts in words, for messages: "B3 on B2, B2 on plane 1, B7 on the terrain and 12 more".
#pragma once
#include <string>
#include <vector>

#include "coupling/touch/touch.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

/// The pairs that touch with a row in the contact problem, those with the largest impulses first, three by
/// name. Planes and structures are numbered from 1.
std::string name_contacts(const dda::Model& model, const std::vector<Touch>& touches);

}  // namespace talus::coupling

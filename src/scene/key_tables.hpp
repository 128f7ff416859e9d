/// The parts of the key table, one source file each.
#pragma once
#include <vector>

#include "scene/keys.hpp"

namespace talus::scene {

std::vector<Key> general_keys();    // root, simulation, site, plane, coupling, output
std::vector<Key> contact_keys();    // material, interface
std::vector<Key> block_keys();      // block, impact
std::vector<Key> rock_mass_keys();  // rock_mass
std::vector<Key> structure_keys();  // structure
std::vector<Key> ensemble_keys();   // line, ensemble

}  // namespace talus::scene

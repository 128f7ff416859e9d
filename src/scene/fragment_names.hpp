/// Names that pieces of structures get when they come off.
#pragma once
#include <string>

#include "scene/scene.hpp"

namespace talus::scene {

/// The structure of which a piece may get this name; empty: none. A run that goes on from another
/// (`initial_state`) may have blocks of the names that pieces had there, and numbers its own past them.
std::string structure_of_fragment(const Scene& scene, const std::string& name);

}  // namespace talus::scene

#pragma once
#include <string>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

/// The part of a structure that a cell belongs to, and its centre: "pier P2 at (20, 0, 1.5)", "cap beam over
/// P2 at ...", "deck of span 3 at ..."; of what has no parts the centre alone.
std::string place_in_words(const StructureSpec& spec, const HexMesh& mesh, int cell);
/// The same of a place as built, and the part of a viaduct that it lies in, -1: of what has none.
std::string place_in_words(const StructureSpec& spec, const Vec3& at, int component);

}  // namespace talus::fem

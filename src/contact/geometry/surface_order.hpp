/// Order of a surface's triangles and vertices in memory: beside each other what a contact query reads
/// together.
#pragma once
#include "contact/geometry/surface.hpp"

namespace talus::contact {

/// Renumbers a surface without motion: triangles in the order of the search tree's leaves, vertices in the
/// order of their first use. A query then reads a few short runs of each array instead of a line of memory
/// for every row of a grid. Only for surfaces without `nodes` and `velocities`.
void put_in_search_order(TriangleSurface& surface);

}  // namespace talus::contact

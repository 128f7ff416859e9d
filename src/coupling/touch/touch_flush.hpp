/// Internal edges between neighbours: faces that lie in one plane act as one face.
#pragma once
#include <vector>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// Removes from `touches` the contacts of a block with the edge or vertex of a neighbour across which it
/// merely slides.
///
/// A block q is in contact with some partner on a plane P (any entry with gap <= `flush`). If q lies above P
/// and the body r of another entry (q, r) below it, both within `flush`, then P is the last entrance plane of
/// the pair: the edge of r is no obstacle, whatever direction its closest points suggest. Where q has sunk
/// into the spring of its partner, r has to lie below q, or to be flush with that partner. Of a terrain or a
/// structure the triangles around the touched one stand for r. Contacts that share an area are never removed,
/// P does not part them; but those at a moving skin, whose area is that of its node, where nothing has sunk
/// in by more than a step. Skins that move stand a little above or below each other: what carries a block has
/// sunk, what it comes to has not, and both ring. `flush`: height of a step that is none [m]; `at_skins`: the
/// same where the skin of a deformable structure is one of the two sides.
void drop_internal_edges(const dda::Model&, const dda::State&, const Environment&, double flush,
                         double at_skins, std::vector<Touch>& touches);

}  // namespace talus::coupling

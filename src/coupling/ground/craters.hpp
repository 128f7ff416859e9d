/// What a block has crushed of a face of a structure's skin: in each cell of the face, below each facet of
/// the block that presses there, a plane.
///
///   y = y_0 + y_a a + y_b b     crushed for good at (a, b) along the face's axes from its middle [m]
///   s = d - max(0, y)           compression of the columns (contact/laws/bed.hpp) [m]
///   d                           depth below a facet, linear as y is [m]
///
/// With y the energy 1/2 k int s^2 dA is one of where the block lies: however it turns, the columns give back
/// what they took. Beyond L = p/k they are crushed, and the plane goes along. Over the columns C that were
/// crushed or are, with g = s - L and g_0 the least of it,
///
///   dy = g                                          if g_0 >= 0: all of them yield
///   dy = a (g - g_0) >= 0                           where one side sinks and the other rises,
///        a = int g (g - g_0) dA / int (g - g_0)^2 dA, over what presses
///
/// dy is nowhere negative, makes the mean pressure of C at most p, and takes k int s dy dA = p int dy dA from
/// the springs but for order two: that is what is crushed. Again without motion it is nil.
#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "contact/skin/skin_bed.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// How many features a face's craters may have, from its first on.
constexpr std::uint64_t craters_of_a_face = std::uint64_t{contact::crater_cells * contact::crater_cells}
                                            << 16;

/// Compresses the columns of one face's parts by what its craters leave of their depth, and crushes what that
/// is too much for; triangles are cut so that what presses is linear over each. `known`: craters from before,
/// with features from `first` on; `limit`: L [m]; `late`: what is found starts unloaded; `comes_to`: so does
/// what lies more than that below a crater, of a face that did not press a step ago [m]. Returns the craters
/// as they are now.
std::vector<Crater> crush(std::span<contact::Footprint> parts, std::uint64_t first,
                          std::span<const ContactMemory> known, double limit, bool late,
                          double comes_to = std::numeric_limits<double>::infinity());

/// Columns of an elastic bed that are compressed by no more than `most` [m].
void compress_at_most(contact::Footprint& part, double most);

}  // namespace talus::coupling

/// Parts of a structure that its supports leave free to move as rigid bodies.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "fem/linear/linear_system.hpp"
#include "fem/setup.hpp"

namespace talus::fem {

/// Cells joined by common nodes, or by springs, that can move as a rigid body.
struct LoosePart {
  int cells = 0, first = 0;  // how many, and the first of them
  bool held = false;         // some of its nodes are
  bool hinged = false;       // to other cells by edges or corners alone
  std::string motion;        // in words, such as "turn about [1, 0, 0]"
};

/// The first such part. A rigid motion x -> t + r x (x - c) is held if it moves a held degree of freedom: the
/// part is loose if, of the quadratic form sum over those of (their displacement)^2, lengths measured by the
/// part's radius of gyration, the smallest eigenvalue is 1e-12 of the largest or less. Cells that share no
/// more than an edge or a corner are pieces of a part, each with a rigid motion of its own: the form then
/// also has the squares of the differences between the displacements that two pieces give a common node.
std::optional<LoosePart> loose_part(const HexMesh& mesh, const Supports& supports,
                                    const std::vector<Spring>& springs);

}  // namespace talus::fem

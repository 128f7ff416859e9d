/// What the structure takes from deal.II and Trilinos. They map two hundred libraries, which costs 0.3 s at the start of a process, so
/// they are a module of their own (libtalus_dealii.so), loaded by the first structure that needs one of these.
#pragma once
#include <array>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/linear/linear_system.hpp"

namespace talus::fem {

/// A disc of diameter 1 about the origin: five blocks refined `levels` times, quadrilaterals counter-clockwise.
struct DiscMesh {
  std::vector<std::array<double, 2>> nodes;
  std::vector<std::array<int, 4>> quads;
};

struct Services {
  void (*disc)(int levels, DiscMesh& mesh);
  std::unique_ptr<LinearSolver> (*multigrid)(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body);
  void (*refine)(HexMesh& mesh, const std::vector<StructureSpec::Refinement>& zones);
};

/// Throws InputError if the module is not there.
const Services& services();

/// Halves the edges of every cell that a zone cuts, until they are as small as the zone asks for; cells that share a vertex differ by one halving at most (deal.II's Triangulation), and
/// nodes that hang between larger cells follow those (DoFTools::make_hanging_node_constraints). A zone that meets no cell changes nothing.
inline void refine_locally(HexMesh& mesh, const std::vector<StructureSpec::Refinement>& zones) { services().refine(mesh, zones); }

/// The same for several bodies that springs alone hold together: `body` numbers that of each degree of freedom.
std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body);

}  // namespace talus::fem

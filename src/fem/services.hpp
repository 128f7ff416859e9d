/// What the structure takes from deal.II and Trilinos. They map two hundred libraries, which costs 0.3 s at the start of a process, so
/// they are a module of their own (libtalus_dealii.so), loaded by the first structure that needs one of these.
#pragma once
#include <array>
#include <vector>

#include "fem/linear_system.hpp"

namespace talus::fem {

/// A disc of diameter 1 about the origin: five blocks refined `levels` times, quadrilaterals counter-clockwise.
struct DiscMesh {
  std::vector<std::array<double, 2>> nodes;
  std::vector<std::array<int, 4>> quads;
};

struct Services {
  void (*disc)(int levels, DiscMesh& mesh);
  std::unique_ptr<LinearSolver> (*multigrid)(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body);
};

/// Throws InputError if the module is not there.
const Services& services();

/// The same for several bodies that springs alone hold together: `body` numbers that of each degree of freedom.
std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body);

}  // namespace talus::fem

#include "core/solid_mesh_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <unordered_map>
#include <vector>

#include "core/disjoint_sets.hpp"

namespace talus {
namespace {

/// Points by the cell of a grid that they lie in, to find those within `reach` of a place; reach is far below
/// the cell's size.
class Places {
 public:
  Places(double cell, double reach) : cell_(cell), reach_(reach) {}
  void add(const Vec3& x, int index) { at_[key(x)].push_back(index); }
  template <class Use>
  void near(const Vec3& x, const Use& use) const {
    std::uint64_t seen[8];
    int count = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const std::uint64_t k =
          key(x + reach_ * Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1));
      bool again = false;
      for (int i = 0; i < count; ++i) again = again || seen[i] == k;
      if (again) continue;
      seen[count++] = k;
      if (const auto found = at_.find(k); found != at_.end())
        for (const int index : found->second) use(index);
    }
  }

 private:
  std::uint64_t key(const Vec3& x) const {
    std::uint64_t hash = 0;
    for (int k = 0; k < 3; ++k)
      hash = (hash ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x[k] / cell_)))) *
             0x9E3779B97F4A7C15ull;
    return hash;
  }
  double cell_, reach_;
  std::unordered_map<std::uint64_t, std::vector<int>> at_;  // for look-up only
};

/// Shortest edge at the first node of a cell [m].
double shortest_edge(const SolidMesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](const auto& c, std::initializer_list<std::size_t> neighbours) {
    for (const std::size_t k : neighbours)
      least = std::min(
          least,
          (mesh.nodes[static_cast<std::size_t>(c[k])] - mesh.nodes[static_cast<std::size_t>(c[0])]).norm());
  };
  for (const auto& c : mesh.hexes) look(c, {1, 3, 4});
  for (const auto& c : mesh.tets) look(c, {1, 2, 3});
  return least;
}

}  // namespace

UnmergedNodes unmerged_nodes(const SolidMesh& mesh) {
  constexpr double same = 1e-6, cell = 1e-3, of_edge = 5e-3;  // of the size; of the shortest edge
  DisjointSets sets(static_cast<int>(mesh.nodes.size()));
  std::vector<char> used(mesh.nodes.size(), 0);
  const auto add = [&](const auto& cells) {
    for (const auto& c : cells)
      for (const int n : c) sets.join(c[0], n), used[static_cast<std::size_t>(n)] = 1;
  };
  add(mesh.hexes);
  add(mesh.tets);
  UnmergedNodes out;
  Box3 box;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (!used[n]) continue;
    out.parts += sets.root(static_cast<int>(n)) == static_cast<int>(n);
    box.extend(mesh.nodes[n]);
  }
  if (out.parts < 2) return out;
  const double size = box.diagonal().norm(), reach = std::max(same * size, of_edge * shortest_edge(mesh));
  Places places(std::max(cell * size, 4 * reach), reach);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (!used[n]) continue;
    const Vec3& x = mesh.nodes[n];
    const int part = sets.root(static_cast<int>(n));
    bool meets = false;
    places.near(x, [&](int other) {
      meets = meets ||
              (sets.root(other) != part && (mesh.nodes[static_cast<std::size_t>(other)] - x).norm() <= reach);
    });
    if (meets && out.count++ == 0) out.first = x;
    places.add(x, static_cast<int>(n));
  }
  return out;
}

}  // namespace talus

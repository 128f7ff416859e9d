#include <algorithm>

#include "core/disjoint_sets.hpp"
#include "fem/discretisation/hex_mesh.hpp"
#include "fem/discretisation/trilinear.hpp"
#include "fem/rebar/rebar_embed.hpp"

namespace talus::fem {
std::optional<std::pair<int, int>> overlapping_cells(const HexMesh& mesh) {
  const std::size_t count = mesh.hexes.size();
  DisjointSets sets(static_cast<int>(mesh.nodes.size()));
  for (const auto& hex : mesh.hexes)
    for (const int n : hex) sets.join(hex[0], n);
  const auto part = [&](std::size_t cell) { return sets.root(mesh.hexes[cell][0]); };
  bool apart = false;
  for (std::size_t cell = 1; cell < count && !apart; ++cell) apart = part(cell) != part(0);
  if (!apart) return {};
  // A search gives the first cell about a point: from behind it finds what the cell itself hides from before.
  for (const bool reversed : {false, true}) {
    std::vector<std::array<int, 8>> hexes = mesh.hexes;
    if (reversed) std::reverse(hexes.begin(), hexes.end());
    const rebar::HostSearch search = rebar::host_search(mesh.nodes, hexes, 0);
    for (std::size_t cell = 0; cell < count; ++cell)
      for (int q = 0; q < 8; ++q) {
        const auto shape = shape_values(gauss_point(q));
        Vec3 point = Vec3::Zero();
        for (std::size_t a = 0; a < 8; ++a)
          point += shape[a] * mesh.nodes[static_cast<std::size_t>(mesh.hexes[cell][a])];
        const auto host = search(point);
        if (!host || host->xi.cwiseAbs().maxCoeff() > 0.99) continue;
        const auto found = static_cast<std::size_t>(host->cell), other = reversed ? count - 1 - found : found;
        if (part(other) != part(cell)) return std::pair(static_cast<int>(cell), static_cast<int>(other));
      }
  }
  return {};
}

}  // namespace talus::fem

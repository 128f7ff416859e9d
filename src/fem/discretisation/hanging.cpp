#include "fem/discretisation/hanging.hpp"

#include <map>
#include <set>
#include <utility>

namespace talus::fem {

std::vector<int> carriers(const HexMesh& mesh, int cell) {
  const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
  std::vector<int> nodes(hex.begin(), hex.end());
  if (mesh.hanging.empty()) return nodes;
  for (const int n : hex)
    if (const HangingNode* h = hanging_node(mesh, n))
      for (const auto& [master, weight] : h->masters) nodes.push_back(master);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<SkinQuad> cut_at_middles(const HexMesh& mesh, const std::vector<SkinQuad>& quads) {
  if (mesh.hanging.empty()) return quads;
  std::set<int> there;
  for (const SkinQuad& q : quads) there.insert(q.node.begin(), q.node.end());
  std::vector<SkinQuad> out;
  for (const SkinQuad& q : quads) {
    // From a middle on, so that no triangle of a fan about it has its corners on one line.
    std::vector<int> rim;
    std::size_t first = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const int a = q.node[k], b = q.node[(k + 1) % 4];
      rim.push_back(a);
      const auto found = mesh.middle.find({std::min(a, b), std::max(a, b)});
      if (found == mesh.middle.end() || there.count(found->second) == 0) continue;
      first = rim.size();
      rim.push_back(found->second);
    }
    if (rim.size() == 4) {
      out.push_back(q);
      continue;
    }
    std::rotate(rim.begin(), rim.begin() + static_cast<std::ptrdiff_t>(first), rim.end());
    for (std::size_t k = 1; k + 1 < rim.size(); ++k)
      out.push_back({{rim[0], rim[k], rim[k + 1], rim[k + 1]}, q.cell, q.face});
  }
  return out;
}

}  // namespace talus::fem

#include "fem/discretisation/hanging.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/error.hpp"
#include "core/sort_unique.hpp"

namespace talus::fem {

std::vector<int> carriers(const HexMesh& mesh, int cell) {
  const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
  std::vector<int> nodes(hex.begin(), hex.end());
  if (mesh.hanging.empty()) return nodes;
  for (const int n : hex)
    if (const HangingNode* h = hanging_node(mesh, n))
      for (const auto& [master, weight] : h->masters) nodes.push_back(master);
  sort_unique(nodes);
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

namespace {

/// The mean of nodes; none if they follow too many.
std::optional<TriangleSurface::NodeWeights> mean_of(const HexMesh& mesh, std::initializer_list<int> nodes) {
  TriangleSurface::NodeWeights out;
  const auto add = [&](int node, double weight) {
    const auto end = out.node.begin() + out.count, at = std::find(out.node.begin(), end, node);
    if (at == out.node.end()) return false;
    const auto k = static_cast<std::size_t>(at - out.node.begin());
    if (at == end) out.node[k] = node, out.weight[k] = 0, ++out.count;
    out.weight[k] += weight;
    return true;
  };
  const double share = 1.0 / static_cast<double>(nodes.size());
  for (const int node : nodes) {
    const HangingNode* h = hanging_node(mesh, node);
    if (h == nullptr) {
      if (!add(node, share)) return {};
      continue;
    }
    for (const auto& [master, weight] : h->masters)
      if (!add(master, share * weight)) return {};
  }
  return out;
}

}  // namespace

TriangleSurface::NodeWeights followed_by_node(const HexMesh& mesh, int node) {
  if (const auto w = mean_of(mesh, {node})) return *w;
  throw NumericalFailure(fmt::format("node {} of a structure follows more than four nodes", node));
}

TriangleSurface::NodeWeights followed_by_face(const HexMesh& mesh, const std::array<int, 4>& corner) {
  if (const auto w = mean_of(mesh, {corner[0], corner[1], corner[2], corner[3]})) return *w;
  if (const auto w = mean_of(mesh, {corner[0], corner[2]})) return *w;
  if (const auto w = mean_of(mesh, {corner[1], corner[3]})) return *w;
  throw NumericalFailure(fmt::format("the face of nodes {} of a structure follows more than four nodes",
                                     fmt::join(corner, ", ")));
}

}  // namespace talus::fem

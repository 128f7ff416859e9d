#include "fem/bearings/bearing_pads.hpp"

#include <algorithm>
#include <limits>
#include <set>

namespace talus::fem {
namespace {

constexpr double thinnest = 1e-3;  // [m]

/// Faces at the level of the seated nodes, as built, with nothing but them for corners, ascending; of a node
/// that has no such face, the one with most of them.
std::set<std::size_t> faces_above(const HexMesh& mesh, const std::vector<SkinQuad>& quads,
                                  const std::map<int, SeatedNode>& nodes) {
  const auto level = [&](int n) { return mesh.local[static_cast<std::size_t>(n)].z(); };
  const double bottom = level(nodes.begin()->first);
  std::map<int, std::pair<std::size_t, std::ptrdiff_t>>
      best;  // of each node: face, how many of its corners are seated
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& corners = quads[q].node;
    if (std::any_of(corners.begin(), corners.end(),
                    [&](int n) { return std::abs(level(n) - bottom) > 1e-6; }))
      continue;
    const auto count =
        std::count_if(corners.begin(), corners.end(), [&](int n) { return nodes.count(n) > 0; });
    for (const int n : corners)
      if (nodes.count(n) > 0 && (best.count(n) == 0 || count > best[n].second)) best[n] = {q, count};
  }
  std::set<std::size_t> faces;
  for (std::size_t q = 0; q < quads.size(); ++q)
    if (std::all_of(quads[q].node.begin(), quads[q].node.end(), [&](int n) { return nodes.count(n) > 0; }))
      faces.insert(q);
  for (const auto& [n, face] : best)
    if (face.second < 4) faces.insert(face.first);
  return faces;
}

}  // namespace

void stand_on_pads(const HexMesh& mesh, std::span<const SeatedNode> seated, std::vector<SkinQuad>& quads,
                   std::map<int, std::size_t>& at, std::vector<Vec3>& points) {
  std::map<int, std::map<int, SeatedNode>> ends;
  for (const SeatedNode& s : seated)
    if (at.count(s.node) > 0) ends[s.end].emplace(s.node, s);
  int fresh = static_cast<int>(mesh.nodes.size());
  for (const auto& [end, nodes] : ends) {
    const std::set<std::size_t> faces = faces_above(mesh, quads, nodes);
    const auto place = [&](int n) { return points[at.at(n)]; };
    Vec3 outward = Vec3::Zero();
    std::set<std::pair<int, int>> edges;
    for (const std::size_t q : faces) {
      const auto& c = quads[q].node;
      outward += (place(c[2]) - place(c[0])).cross(place(c[3]) - place(c[1]));
      for (std::size_t k = 0; k < 4; ++k) edges.emplace(c[k], c[(k + 1) % 4]);
    }
    if (faces.empty() || outward.isZero()) continue;
    outward.normalize();
    double gap = std::numeric_limits<double>::infinity();
    for (const auto& [n, s] : nodes) gap = std::min({gap, s.height, outward.dot(s.foot - place(n))});
    if (!(gap > thinnest)) continue;
    std::map<int, int> below;
    for (const std::size_t q : faces)
      for (const int n : quads[q].node)
        if (below.emplace(n, fresh).second) {
          at.emplace(fresh++, points.size());
          points.push_back(place(n) + gap * outward);
        }
    for (const std::size_t q : faces) {
      const SkinQuad top = quads[q];
      for (std::size_t k = 0; k < 4; ++k) {
        quads[q].node[k] = below.at(top.node[k]);
        const int a = top.node[k], b = top.node[(k + 1) % 4];
        if (edges.count({b, a}) == 0) quads.push_back({{a, b, below.at(b), below.at(a)}, top.cell, top.face});
      }
    }
  }
}

}  // namespace talus::fem

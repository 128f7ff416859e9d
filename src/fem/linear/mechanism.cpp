#include "fem/linear/mechanism.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/disjoint_sets.hpp"

namespace talus::fem {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// The direction of a vector, its largest component positive.
std::string direction(Vec3 v) {
  Eigen::Index most = 0;
  v.cwiseAbs().maxCoeff(&most);
  v /= v[most] < 0 ? -v.norm() : v.norm();
  for (double& x : v) x = std::abs(x) < 5e-4 ? 0.0 : x;
  return fmt::format("[{:.3g}, {:.3g}, {:.3g}]", v.x(), v.y(), v.z());
}

/// A rigid motion in words; `length` turns the rotation's part into one.
std::string in_words(const Vec6& motion) {
  const Vec3 move = motion.head<3>(), turn = motion.tail<3>();
  return turn.norm() < 1e-3 * move.norm() ? "move along " + direction(move)
                                          : "turn about an axis along " + direction(turn);
}

/// How a set of nodes is held, as a quadratic form of its rigid motions (translation, rotation times
/// `length`) about its centre.
struct Hold {
  std::vector<int> nodes;
  int cells = 0, first = 0;

  Mat6 form(const HexMesh& mesh, const Supports& supports, bool& held) const {
    Vec3 centre = Vec3::Zero();
    for (const int n : nodes)
      centre += mesh.nodes[static_cast<std::size_t>(n)] / static_cast<double>(nodes.size());
    double length_sq = 0;
    for (const int n : nodes)
      length_sq += (mesh.nodes[static_cast<std::size_t>(n)] - centre).squaredNorm() /
                   static_cast<double>(nodes.size());
    const double length = std::sqrt(length_sq);
    Mat6 a = Mat6::Zero();
    for (const int n : nodes)
      for (int c = 0; c < 3; ++c) {
        if (!supports.held[static_cast<std::size_t>(n)][static_cast<std::size_t>(c)]) continue;
        const Vec3 axis = Vec3::Unit(c);
        Vec6 row;
        row << axis, (mesh.nodes[static_cast<std::size_t>(n)] - centre).cross(axis) / length;
        a += row * row.transpose();
        held = true;
      }
    return a;
  }
};

}  // namespace

std::optional<LoosePart> loose_part(const HexMesh& mesh, const Supports& supports,
                                    const std::vector<Spring>& springs) {
  DisjointSets sets(static_cast<int>(mesh.nodes.size()));
  for (const auto& hex : mesh.hexes)
    for (const int n : hex) sets.join(hex[0], n);
  for (const HangingNode& h : mesh.hanging)
    for (const auto& [master, weight] : h.masters) sets.join(h.node, master);
  for (const Spring& spring : springs)
    for (const int n : spring.node) sets.join(spring.node.front(), n);
  std::map<int, Hold> parts;
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    const auto [at, fresh] = parts.try_emplace(sets.root(mesh.hexes[static_cast<std::size_t>(cell)][0]));
    if (fresh) at->second.first = cell;
    ++at->second.cells;
  }
  for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n)
    if (const auto at = parts.find(sets.root(n)); at != parts.end()) at->second.nodes.push_back(n);
  for (const auto& [root, part] : parts) {
    LoosePart loose{part.cells, part.first, false, ""};
    const Eigen::SelfAdjointEigenSolver<Mat6> motions(part.form(mesh, supports, loose.held));
    if (motions.eigenvalues()[0] > 1e-12 * motions.eigenvalues()[5]) continue;
    loose.motion = in_words(motions.eigenvectors().col(0));
    return loose;
  }
  return std::nullopt;
}

}  // namespace talus::fem

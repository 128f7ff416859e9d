#include "fem/bending.hpp"

#include <algorithm>
#include <cmath>

namespace talus::fem {
namespace {

constexpr int most_layers = 4;      // beyond it the layers do not matter
constexpr double slender = 3;       // a member: so many times as long as deep
constexpr double tolerated = 0.1, least_share = 0.1;

struct Walker {
  const HexMesh& mesh;
  std::vector<std::array<int, 6>> next;
  std::vector<std::array<double, 3>> extent;   // of each cell along its axes

  explicit Walker(const HexMesh& m) : mesh(m), next(neighbours(m)) {
    extent.reserve(m.hexes.size());
    for (int cell = 0; cell < static_cast<int>(m.hexes.size()); ++cell) {
      const Mat3 j = jacobian(m, cell, Vec3::Zero());
      extent.push_back({2 * j.col(0).norm(), 2 * j.col(1).norm(), 2 * j.col(2).norm()});
    }
  }

  /// Cells and length through `cell` along its axis, from surface to surface; stops beyond `cells` of them or beyond `length`.
  std::pair<int, double> run(int cell, int axis, int cells, double length) const {
    int count = 1;
    double sum = extent[static_cast<std::size_t>(cell)][static_cast<std::size_t>(axis)];
    for (int side = 0; side < 2; ++side) {
      int at = cell, face = 2 * axis + side;
      while (count <= cells && sum < length) {
        const int other = next[static_cast<std::size_t>(at)][static_cast<std::size_t>(face)];
        if (other < 0 || other == cell) break;
        const auto& back = next[static_cast<std::size_t>(other)];
        const auto entered = static_cast<int>(std::find(back.begin(), back.end(), at) - back.begin());
        ++count;
        sum += extent[static_cast<std::size_t>(other)][static_cast<std::size_t>(entered / 2)];
        at = other;
        face = entered ^ 1;
      }
    }
    return {count, sum};
  }
};

double stiffness(double length, double depth, int layers, double poisson) {
  const double aspect = length * layers / depth, f = (2.0 / 3 + 0.5 * aspect * aspect) / (1 + poisson);
  return 1 + (f - 1) / (layers * layers);
}

}  // namespace

std::optional<PoorBending> poor_bending(const HexMesh& mesh, double poisson) {
  const Walker walker(mesh);
  std::vector<std::pair<PoorBending, double>> found;   // with the volume
  double whole = 0;
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    const auto& size = walker.extent[static_cast<std::size_t>(cell)];
    const double volume = size[0] * size[1] * size[2];
    whole += volume;
    PoorBending worst;
    for (int across = 0; across < 3; ++across) {
      const auto [layers, depth] = walker.run(cell, across, most_layers, INFINITY);
      if (layers > most_layers) continue;
      for (int along = 0; along < 3; ++along) {
        if (along == across || walker.run(cell, along, 1 << 20, slender * depth).second < slender * depth) continue;
        const double sag = 1 / stiffness(size[static_cast<std::size_t>(along)], depth, layers, poisson);
        if (std::abs(std::log(sag)) > std::abs(std::log(worst.sag))) worst = {sag, layers, depth, size[static_cast<std::size_t>(along)], 0};
      }
    }
    if (std::abs(worst.sag - 1) > tolerated) found.emplace_back(worst, volume);
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return std::abs(std::log(a.first.sag)) > std::abs(std::log(b.first.sag)); });
  double sum = 0;
  for (const auto& [poor, volume] : found) {
    sum += volume;
    if (sum < least_share * whole) continue;
    PoorBending result = poor;
    result.share = sum / whole;
    return result;
  }
  return std::nullopt;
}

double longest_bending_cell(double depth, double poisson) { return depth * std::sqrt(2 * 0.05 * (1 + poisson)); }

}  // namespace talus::fem

#include "fem/discretisation/disc.hpp"

#include <cmath>
#include <utility>

namespace talus::fem {
namespace {

using Point = std::array<double, 2>;

constexpr double bulge = 0.4;  // share of the disc in the shape of the core, the rest is a square

/// The square [-1, 1]^2 onto the core, a blend of a square and a disc of equal areas: corners of a square
/// would leave thin cells to the ring, and those of a disc have no angle.
Point core(double u, double v) {
  const double square = (1 - bulge) * std::sqrt(M_PI) / 2;
  return {core_of_round_section * u * (square + bulge * std::sqrt(1 - v * v / 2)),
          core_of_round_section * v * (square + bulge * std::sqrt(1 - u * u / 2))};
}

}  // namespace

DiscMesh disc_mesh(const RoundSection& section) {
  const int n = section.side, m = section.rings, around = section.facets();
  const double sector = 2 * M_PI / around, radius = std::sqrt(sector / std::sin(sector));
  DiscMesh mesh;
  const auto along = [n](int i) { return 2.0 * i / n - 1; };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.nodes.push_back(core(along(i), along(j)));
  const auto in_core = [n](int i, int j) { return j * (n + 1) + i; };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      mesh.quads.push_back({in_core(i, j), in_core(i + 1, j), in_core(i + 1, j + 1), in_core(i, j + 1)});
  std::vector<int> inner;  // counter-clockwise around the core, from its corner at -45 degrees
  for (int k = 0; k < n; ++k) inner.push_back(in_core(n, k));
  for (int k = 0; k < n; ++k) inner.push_back(in_core(n - k, n));
  for (int k = 0; k < n; ++k) inner.push_back(in_core(0, n - k));
  for (int k = 0; k < n; ++k) inner.push_back(in_core(k, 0));
  const std::vector<int> start = inner;
  for (int level = 1; level <= m; ++level) {
    std::vector<int> outer;
    for (int k = 0; k < around; ++k) {
      const Point a = mesh.nodes[static_cast<std::size_t>(start[static_cast<std::size_t>(k)])];
      const double angle = k * sector - M_PI / 4, share = static_cast<double>(level) / m;
      outer.push_back(static_cast<int>(mesh.nodes.size()));
      mesh.nodes.push_back({a[0] + share * (radius * std::cos(angle) - a[0]),
                            a[1] + share * (radius * std::sin(angle) - a[1])});
    }
    for (int k = 0; k < around; ++k) {
      const auto here = static_cast<std::size_t>(k), next = static_cast<std::size_t>((k + 1) % around);
      mesh.quads.push_back({inner[here], outer[here], outer[next], inner[next]});
    }
    inner = std::move(outer);
  }
  mesh.rim = std::move(inner);
  return mesh;
}

}  // namespace talus::fem

#include "fem/discretisation/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace talus::fem {
namespace {

constexpr double same_plane = 1e-9;  // [m]

void sort_planes(std::vector<double>& planes) {
  std::sort(planes.begin(), planes.end());
  planes.erase(
      std::unique(planes.begin(), planes.end(), [](double a, double b) { return b - a < same_plane; }),
      planes.end());
}

constexpr int samples = 400;

/// Between two planes: the integral of 1 / s from the lower one to each of its even parts.
struct Wanted {
  std::array<double, samples + 1> sum{};
  bool even = true;  // s is the same everywhere
  double cells() const { return std::max(1.0, std::ceil(sum[samples] - 1e-9)); }
};

Wanted wanted_between(double a, double b, double size, const std::vector<FineZone>& zones) {
  const auto wanted = [&](double x) {
    double s = size;
    for (const FineZone& z : zones) s = std::min(s, z.size + growth * std::max({0.0, z.low - x, x - z.high}));
    return s;
  };
  Wanted out;
  for (int i = 0; i < samples; ++i) {
    const double s = wanted(a + (b - a) * (i + 0.5) / samples);
    out.even = out.even && s == wanted(a + (b - a) * 0.5 / samples);
    out.sum[i + 1] = out.sum[i] + (b - a) / samples / s;
  }
  return out;
}

/// Cuts (a, b] into cells of the wanted size and appends their upper planes.
void cut(double a, double b, double size, const std::vector<FineZone>& zones, std::vector<double>& lines) {
  const Wanted wanted = wanted_between(a, b, size, zones);
  const auto& sum = wanted.sum;
  const int n = static_cast<int>(wanted.cells());
  for (int m = 1, i = 0; m < n; ++m) {
    if (wanted.even) {
      lines.push_back(a + (b - a) * m / n);
      continue;
    }
    const double target = sum[samples] * m / n;
    while (sum[i + 1] < target) ++i;
    lines.push_back(a + (b - a) * (i + (target - sum[i]) / (sum[i + 1] - sum[i])) / samples);
  }
  lines.push_back(b);
}

/// The fixed planes, and the ends of zones: a zone's end makes a plane of its own unless one is near: no
/// slivers.
std::vector<double> planes_of(std::vector<double> fixed, const std::vector<FineZone>& zones) {
  sort_planes(fixed);
  std::vector<double> planes = fixed;
  for (const FineZone& z : zones)
    for (double end : {z.low, z.high}) {
      const bool inside = end > fixed.front() && end < fixed.back();
      const bool free = std::none_of(planes.begin(), planes.end(),
                                     [&](double p) { return std::abs(p - end) < 0.5 * z.size; });
      if (inside && free) planes.push_back(end);
    }
  sort_planes(planes);
  return planes;
}

}  // namespace

std::vector<double> graded_lines(std::vector<double> fixed, double size, const std::vector<FineZone>& zones) {
  const std::vector<double> planes = planes_of(std::move(fixed), zones);
  std::vector<double> lines{planes[0]};
  for (std::size_t k = 0; k + 1 < planes.size(); ++k) cut(planes[k], planes[k + 1], size, zones, lines);
  return lines;
}

double graded_count(std::vector<double> fixed, double size, const std::vector<FineZone>& zones, double low,
                    double high) {
  const std::vector<double> planes = planes_of(std::move(fixed), zones);
  double count = 0;
  for (std::size_t k = 0; k + 1 < planes.size(); ++k)
    if (const double middle = 0.5 * (planes[k] + planes[k + 1]); middle > low && middle < high)
      count += wanted_between(planes[k], planes[k + 1], size, zones).cells();
  return count;
}

Lines ends_of(const std::vector<Box3>& boxes) {
  Lines planes;
  for (int axis = 0; axis < 3; ++axis)
    for (const Box3& b : boxes) planes[axis].push_back(b.min()[axis]), planes[axis].push_back(b.max()[axis]);
  return planes;
}

double brick_count(const std::vector<Box3>& boxes, double cell_size,
                   const std::vector<StructureSpec::Refinement>& refinements) {
  const Lines planes = ends_of(boxes);
  double count = 0;
  for (const Box3& b : boxes) {
    double cells = 1;
    for (int axis = 0; axis < 3; ++axis)
      cells *=
          graded_count(planes[axis], cell_size, zones_along(refinements, axis), b.min()[axis], b.max()[axis]);
    count += cells;
  }
  return count;
}

std::vector<double> even_lines(double low, double high, int n) {
  std::vector<double> lines;
  for (int i = 0; i < n; ++i) lines.push_back(low + (high - low) * i / n);
  lines.push_back(high);
  return lines;
}

HexMesh lattice(const Lines& lines, const std::vector<Box3>& boxes) {
  const std::array<int, 3> n{static_cast<int>(lines[0].size()) - 1, static_cast<int>(lines[1].size()) - 1,
                             static_cast<int>(lines[2].size()) - 1};
  const auto place = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * (n[1] + 1) + j) * (n[0] + 1) + i;
  };
  std::vector<int> number(place(0, 0, n[2] + 1), -1);
  HexMesh mesh;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Vec3 centre(0.5 * (lines[0][i] + lines[0][i + 1]), 0.5 * (lines[1][j] + lines[1][j + 1]),
                          0.5 * (lines[2][k] + lines[2][k + 1]));
        if (std::none_of(boxes.begin(), boxes.end(), [&](const Box3& b) { return b.contains(centre); }))
          continue;
        static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                         {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
        std::array<int, 8> hex;
        for (int a = 0; a < 8; ++a) {
          const int x = i + corner[a][0], y = j + corner[a][1], z = k + corner[a][2];
          int& node = number[place(x, y, z)];
          if (node < 0) {
            node = static_cast<int>(mesh.nodes.size());
            mesh.nodes.emplace_back(lines[0][x], lines[1][y], lines[2][z]);
          }
          hex[a] = node;
        }
        mesh.hexes.push_back(hex);
      }
  return mesh;
}

std::vector<StructureSpec::Refinement> local_refinements(const StructureSpec& spec) {
  std::vector<StructureSpec::Refinement> local;
  for (const StructureSpec::Refinement& r : spec.refinements) {
    Box3 box;
    for (int corner = 0; corner < 8; ++corner)
      box.extend(spec.rotation.transpose() *
                 (r.region.corner(static_cast<Box3::CornerType>(corner)) - spec.position));
    local.push_back({box, r.cell_size});
  }
  return local;
}

std::vector<FineZone> zones_along(const std::vector<StructureSpec::Refinement>& refinements, int axis) {
  std::vector<FineZone> zones;
  for (const auto& r : refinements)
    zones.push_back({r.region.min()[axis], r.region.max()[axis], r.cell_size});
  return zones;
}

HexMesh bricks(const std::vector<Box3>& boxes, double cell_size,
               const std::vector<StructureSpec::Refinement>& refinements) {
  Lines lines = ends_of(boxes);
  for (int axis = 0; axis < 3; ++axis)
    lines[axis] = graded_lines(std::move(lines[axis]), cell_size, zones_along(refinements, axis));
  return lattice(lines, boxes);
}

bool refines_locally(const StructureSpec& spec) {
  return std::any_of(spec.parameters.begin(), spec.parameters.end(),
                     [](const auto& p) { return p.first == "local_refinement" && p.second != 0; });
}

StructureSpec of_coarse_mesh(const StructureSpec& spec) {
  StructureSpec coarse = spec;
  if (refines_locally(spec)) coarse.refinements.clear();
  return coarse;
}

}  // namespace talus::fem

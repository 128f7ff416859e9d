#include "geometry/raster_outliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace talus::geometry {
namespace {

constexpr double least_in_cells = 5, least_in_roughness = 20;
constexpr std::size_t least_neighbours = 5, alike = 2;  // neighbours that may be as wrong as the node itself
constexpr std::size_t most_named = 5;

double median(std::vector<double>& x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

/// Heights of a node over its neighbours that have data, lowest first.
void differences(const HeightGrid& g, int i, int j, std::vector<double>& out) {
  out.clear();
  const auto at = [&](int a, int b) {
    return g
        .z[static_cast<std::size_t>(a) * static_cast<std::size_t>(g.columns) + static_cast<std::size_t>(b)];
  };
  for (int a = std::max(i - 1, 0); a <= std::min(i + 1, g.rows - 1); ++a)
    for (int b = std::max(j - 1, 0); b <= std::min(j + 1, g.columns - 1); ++b)
      if ((a != i || b != j) && std::isfinite(at(a, b))) out.push_back(at(i, j) - at(a, b));
  std::sort(out.begin(), out.end());
}

/// By how much a node stands above or below all but a few of its neighbours.
double standing_out(const std::vector<double>& d) {
  return std::max({0.0, d[alike], -d[d.size() - 1 - alike]});
}

}  // namespace

std::vector<std::size_t> height_outliers(const HeightGrid& g) {
  std::vector<double> d, rough;
  std::vector<std::pair<double, std::size_t>> found;
  const double cell = std::max(g.dx, g.dy);
  for (int i = 0; i < g.rows; ++i)
    for (int j = 0; j < g.columns; ++j) {
      const std::size_t k =
          static_cast<std::size_t>(i) * static_cast<std::size_t>(g.columns) + static_cast<std::size_t>(j);
      if (!std::isfinite(g.z[k])) continue;
      differences(g, i, j, d);
      if (d.size() < least_neighbours) continue;
      rough.push_back(std::abs(d[d.size() / 2]));
      if (const double out = standing_out(d); out > least_in_cells * cell) found.emplace_back(out, k);
    }
  if (found.empty()) return {};
  const double least = least_in_roughness * median(rough);
  std::erase_if(found, [&](const auto& f) { return f.first <= least; });
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::pair(-a.first, a.second) < std::pair(-b.first, b.second);
  });
  std::vector<std::size_t> nodes;
  for (const auto& f : found) nodes.push_back(f.second);
  return nodes;
}

std::vector<Problem> outlier_warning(const HeightGrid& g, const std::string& file) {
  const std::vector<std::size_t> nodes = height_outliers(g);
  if (nodes.empty()) return {};
  std::string places;
  for (std::size_t n = 0; n < std::min(nodes.size(), most_named); ++n) {
    const auto columns = static_cast<std::size_t>(g.columns);
    places += fmt::format("{}z = {:.6g} m at x = {:.10g}, y = {:.10g}", n ? "; " : "", g.z[nodes[n]],
                          g.x0 + static_cast<double>(nodes[n] % columns) * g.dx,
                          g.y0 + static_cast<double>(nodes[n] / columns) * g.dy);
  }
  if (nodes.size() > most_named) places += fmt::format("; {} more", nodes.size() - most_named);
  return {
      {.severity = Problem::Severity::warning,
       .file = file,
       .key = "site.terrain",
       .value = fmt::format("{} node{}", nodes.size(), nodes.size() == 1 ? "" : "s"),
       .rule = fmt::format(
           "the height stands out from the neighbours as no terrain does (map coordinates): {}", places),
       .remedy = "correct the grid or set these nodes to NODATA and fill them; if they are real, leave it"}};
}

}  // namespace talus::geometry

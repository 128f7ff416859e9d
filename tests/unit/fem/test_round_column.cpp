// Round columns: their cells follow cell_size, the polygon of them has the circle's area and second moment.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {
namespace {

StructureSpec round_pier(double cell) {
  StructureSpec s;
  s.name = "pier";
  s.kind = "column";
  s.section = "round";
  s.size = Vec3(1.5, 1.5, 6);
  s.cell_size = cell;
  s.density = 2450;
  s.young = 30e9;
  s.supports.resize(1);
  s.supports[0].face = "-z";
  return s;
}

TEST(RoundColumn, WeighsWhatTheCircleDoes) {
  for (const double cell : {0.12, 0.3, 0.5, 1.5}) {
    const FemStructure column(round_pier(cell), Vec3(0, 0, -9.81), [](const std::string&) {});
    EXPECT_NEAR(column.loads().base_force().z() / (-2450 * 9.81 * M_PI * 0.75 * 0.75 * 6), 1, 1e-6) << cell;
  }
}

/// Facets are no longer than cell_size along the arc (eight are the least), and cells of a slightly smaller
/// size are not four times as many.
TEST(RoundColumn, FacetsFollowTheCellSize) {
  double before = 0;
  for (double cell = 1.2; cell > 0.06; cell *= 0.98) {
    const HexMesh mesh = make_mesh(round_pier(cell));
    std::set<std::pair<int, int>> sides;  // of the section's border: edges at the foot of one cell alone
    int section = 0;
    double area = 0, second_x = 0, second_y = 0, product = 0;
    for (const auto& hex : mesh.hexes) {
      if (mesh.nodes[static_cast<std::size_t>(hex[0])].z() > 1e-9) continue;
      ++section;
      for (int a = 0; a < 4; ++a) {
        const int p = hex[static_cast<std::size_t>(a)], q = hex[static_cast<std::size_t>((a + 1) % 4)];
        if (sides.erase({q, p}) == 0) sides.insert({p, q});
      }
    }
    double longest = 0;
    for (const auto& [p, q] : sides) {
      const Vec3 &a = mesh.nodes[static_cast<std::size_t>(p)], &b = mesh.nodes[static_cast<std::size_t>(q)];
      longest = std::max(longest, (b - a).norm());
      const double cross = a.x() * b.y() - b.x() * a.y();
      area += cross / 2;
      second_x += cross / 12 * (a.y() * a.y() + a.y() * b.y() + b.y() * b.y());
      second_y += cross / 12 * (a.x() * a.x() + a.x() * b.x() + b.x() * b.x());
      product += cross / 24 * (a.x() * b.y() + 2 * a.x() * a.y() + 2 * b.x() * b.y() + b.x() * a.y());
    }
    const double n = static_cast<double>(sides.size()), r = 0.75, theta = 2 * M_PI / n;
    const double circle = M_PI / 4 * std::pow(r, 4),
                 polygon = circle * theta / std::sin(theta) * (2 + std::cos(theta)) / 3;
    EXPECT_EQ(n, std::max(8.0, 4 * std::ceil(M_PI / 2 * r / cell - 1e-9))) << cell;
    if (n > 8) { EXPECT_LE(longest, 1.02 * cell) << cell; }
    EXPECT_NEAR(area / (M_PI * r * r), 1, 1e-12) << cell;
    for (const double second : {second_x, second_y}) EXPECT_NEAR(second / polygon, 1, 1e-12) << cell;
    EXPECT_NEAR(product / circle, 0, 1e-12) << cell;
    if (n >= 20) { EXPECT_NEAR(second_x / circle, 1, 1e-4) << cell; }
    const double across = std::sqrt(section);
    if (before > 0) {
      EXPECT_LE(across / before, 1.33) << cell;  // 12 to 21 cells, from 8 to 12 facets
    }
    before = across;
    for (const double v : cell_volumes(mesh)) EXPECT_GT(v, 0);
  }
}

}  // namespace
}  // namespace talus::fem

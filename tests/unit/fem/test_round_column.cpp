// Round columns: the polygon of their cells has the circle's area, however coarse.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/structure_fem.hpp"

namespace talus::fem {
namespace {

TEST(RoundColumn, WeighsWhatTheCircleDoes) {
  for (const double cell : {0.12, 0.3, 0.5, 1.5}) {
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
    const FemStructure column(s, Vec3(0, 0, -9.81), [](const std::string&) {});
    EXPECT_NEAR(column.loads().base_force().z() / (-2450 * 9.81 * M_PI * 0.75 * 0.75 * 6), 1, 1e-6) << cell;
  }
}

}  // namespace
}  // namespace talus::fem

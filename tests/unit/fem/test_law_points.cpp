#include <gtest/gtest.h>

#include <random>

#include "core/processor.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/kernels/law_points.hpp"

namespace talus::fem {
namespace {

/// A cell of 0.2 x 0.3 x 0.25 m, turned and with its corners moved by up to a tenth of that; or the brick.
HexMesh one_cell(bool distorted) {
  HexMesh mesh;
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> off(-0.02, 0.02);
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (int a = 0; a < 8; ++a) {
    Vec3 x(a == 1 || a == 2 || a == 5 || a == 6 ? 0.2 : 0, a == 2 || a == 3 || a == 6 || a == 7 ? 0.3 : 0,
           a >= 4 ? 0.25 : 0);
    if (distorted) x = turned * (x + Vec3(off(generator), off(generator), off(generator)));
    mesh.nodes.push_back(x);
  }
  mesh.hexes.push_back({0, 1, 2, 3, 4, 5, 6, 7});
  return mesh;
}

AlignedVector random_cell_field(double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> u(-size, size);
  AlignedVector field(32, 0.0);
  for (std::size_t n = 0; n < 8; ++n)
    for (std::size_t c = 0; c < 3; ++c) field[4 * n + c] = u(generator);
  return field;
}

std::vector<const LawPoints*> all_sets() {
  std::vector<const LawPoints*> sets{&law_points_base()};
  if (instruction_set() == InstructionSet::avx512) sets.push_back(&law_points_avx512());
  return sets;
}

/// Virtual work: f . v = V / 8 sum_q sigma_q : rate_q for any stresses, displacements, velocities and shares
/// of Poisson's effect.
TEST(LawPoints, ForcesDoTheWorkOfTheStresses) {
  for (const bool distorted : {false, true})
    for (const bool finite : {false, true}) {
      LawGeometry g = law_geometry(one_cell(distorted), 0, 0.2);
      const AlignedVector u = random_cell_field(0.05, 1), v = random_cell_field(1, 2);
      alignas(64) PointTensors stress, rate;
      std::mt19937 generator(3);
      for (double& share : g.assumed.lateral) share = std::uniform_real_distribution<double>(0, 1)(generator);
      std::uniform_real_distribution<double> any(-1e6, 1e6);
      for (auto& row : stress)
        for (double& x : row) x = any(generator);
      for (const LawPoints* set : all_sets()) {
        PointStrains at;
        set->strains(g, u.data(), finite, at);
        set->rates(g, at, v.data(), finite, rate);
        AlignedVector f(32, 0.0);
        set->add_forces(g, at, stress, finite, f.data());
        double power = 0, work = 0, scale = 0;
        for (std::size_t i = 0; i < 32; ++i) power += f[i] * v[i], scale += std::abs(f[i] * v[i]);
        for (int k = 0; k < 6; ++k)
          for (int q = 0; q < 8; ++q) work += g.volume / 8 * stress[k][q] * rate[k][q];
        EXPECT_NEAR(power, work, 1e-12 * scale) << distorted << finite;
      }
    }
}

/// A brick of depth 0.25 m bent to the curvature k: eps_x = k z, and eps_z = -nu / (1 - nu) eps_x, but for
/// what cracks have taken of it at each point.
TEST(LawPoints, CracksTakePoissonsEffectAwayWhereTheyAre) {
  const HexMesh mesh = one_cell(false);
  LawGeometry g = law_geometry(mesh, 0, 0.2);
  for (int q = 0; q < 8; ++q) g.assumed.lateral[q] = q < 4 ? 0.1 * q : 1.0;
  const double k = 1e-3;
  AlignedVector u(32, 0.0);
  for (std::size_t n = 0; n < 8; ++n) u[4 * n] = k * mesh.nodes[n].x() * (mesh.nodes[n].z() - 0.125);
  for (const LawPoints* set : all_sets()) {
    PointStrains at;
    set->strains(g, u.data(), false, at);
    for (int q = 0; q < 8; ++q) {
      const double along = k * 0.125 / std::sqrt(3.0) * (q < 4 ? -1 : 1);
      EXPECT_NEAR(at.strain[0][q], along, 1e-15);
      EXPECT_NEAR(at.strain[1][q], 0, 1e-15);
      EXPECT_NEAR(at.strain[2][q], -0.25 * g.assumed.lateral[q] * along, 1e-15);
    }
  }
}

/// Rates are the derivative of the strains, the strains before those at u - h v, and a displacement that is
/// linear strains evenly.
TEST(LawPoints, RatesAndTheStepBeforeFollowTheStrains) {
  for (const bool distorted : {false, true}) {
    const HexMesh mesh = one_cell(distorted);
    const LawGeometry g = law_geometry(mesh, 0, 0.2);
    const AlignedVector u = random_cell_field(0.05, 1), v = random_cell_field(1, 2);
    const double h = 1e-4;
    AlignedVector before = u, after = u, linear(32, 0.0);
    for (std::size_t i = 0; i < 32; ++i) before[i] -= h * v[i], after[i] += h * v[i];
    Mat3 gradient;
    gradient << 1e-3, 2e-3, -1e-3, 3e-3, -2e-3, 1e-3, 4e-3, 0.5e-3, 2e-3;
    for (std::size_t n = 0; n < 8; ++n) {
      const Vec3 x = gradient * mesh.nodes[n];
      for (std::size_t c = 0; c < 3; ++c) linear[4 * n + c] = x[static_cast<long>(c)];
    }
    for (const LawPoints* set : all_sets()) {
      PointStrains at, low, high, even;
      set->strains(g, u.data(), true, at);
      set->strains(g, before.data(), true, low);
      set->strains(g, after.data(), true, high);
      set->strains(g, linear.data(), false, even);
      alignas(64) PointTensors rate, old, way;
      set->rates(g, at, v.data(), true, rate);
      set->before(g, at, v.data(), h, true, old, way);
      const double expected[6] = {1e-3, -2e-3, 2e-3, 1.5e-3, 3e-3, 5e-3};
      for (int k = 0; k < 6; ++k)
        for (int q = 0; q < 8; ++q) {
          EXPECT_NEAR(rate[k][q], (high.strain[k][q] - low.strain[k][q]) / (2 * h),
                      1e-8);  // quadratic in u: exact but for rounding
          EXPECT_NEAR(old[k][q], low.strain[k][q], 1e-13);
          EXPECT_NEAR(way[k][q], at.strain[k][q] - low.strain[k][q], 1e-13);
          EXPECT_NEAR(even.strain[k][q], expected[k], 1e-15);
        }
      double largest = 0;
      for (int q = 0; q < 8; ++q) {
        double sum = 0;
        for (int k = 0; k < 6; ++k) sum += (k < 3 ? 1 : 0.5) * at.strain[k][q] * at.strain[k][q];
        largest = std::max(largest, std::sqrt(sum));
      }
      EXPECT_NEAR(at.largest, largest, 1e-14);
      EXPECT_NEAR(even.dilation, 1e-3, 1e-15);
    }
  }
}

TEST(LawPoints, SetsOfInstructionsAgree) {
  if (all_sets().size() < 2) GTEST_SKIP() << "this processor has no AVX-512";
  const LawGeometry g = law_geometry(one_cell(true), 0, 0.2);
  const AlignedVector u = random_cell_field(0.05, 1), v = random_cell_field(1, 2);
  PointStrains at[2];
  alignas(64) PointTensors stress[2];
  AlignedVector f[2];
  double way[2], share[2];
  for (std::size_t s = 0; s < 2; ++s) {
    const LawPoints& set = *all_sets()[s];
    set.strains(g, u.data(), true, at[s]);
    for (int k = 0; k < 6; ++k)
      for (int q = 0; q < 8; ++q) stress[s][k][q] = 30e9 * at[s].strain[k][q];
    f[s].assign(32, 0.0);
    set.add_forces(g, at[s], stress[s], true, f[s].data());
    way[s] = set.largest_way(g, v.data(), 1e-5);
    alignas(64) PointTensors before, along;
    set.before(g, at[s], v.data(), 1e-2, true, before, along);
    share[s] = set.path_share(before, along, 1e-4, 0.25);
  }
  for (std::size_t i = 0; i < 32; ++i) EXPECT_NEAR(f[0][i], f[1][i], 1e-12 * 30e9 * 0.06);
  EXPECT_NEAR(way[0], way[1], 1e-12 * way[0]);
  EXPECT_NEAR(share[0], share[1], 1e-12 * share[0]);
}

}  // namespace
}  // namespace talus::fem

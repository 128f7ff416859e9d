// The one step against closed forms, for one cube and for many that share an island.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "coupling/step/one_step.hpp"

namespace talus::coupling {
namespace {

constexpr double g = 9.81;

std::shared_ptr<const Polyhedron> cube() {
  std::vector<Vec3> x;
  for (int k = 0; k < 8; ++k) x.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  return std::make_shared<Polyhedron>(make_polyhedron(x, {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}}));
}

/// Cubes of 1 m over the plane z = 0, all in one island.
struct Cubes {
  dda::Model model;
  dda::State state;
  Environment env;
  ContactHistory history;
  Island island;
  StepSettings settings;
  Ledger ledger;
  Counters counters;
  double hint = 0;

  explicit Cubes(const ContactLaw& law) {
    env.planes = {Plane{}};
    env.laws = {1, {law}};
  }
  void add(const Vec3& c, const Vec3& v) {
    dda::Model::Block& block = model.blocks.emplace_back();
    block.shape = cube();
    block.volume = 1;
    block.mass = 2500;
    block.second_moment = 2500.0 / 12 * Mat3::Identity();
    block.inertia = 2500.0 / 6 * Mat3::Identity();
    const int i = state.size();
    state.c.push_back(c);
    state.v.push_back(v);
    state.w.push_back(Vec3::Zero());
    state.q.push_back(Quat::Identity());
    state.eps.push_back(Vec6::Zero());
    state.eps_rate.push_back(Vec6::Zero());
    history.emplace_back();
    island.blocks.push_back(i);
    island.pairs.push_back({{Partner::Kind::plane, 0}, i});
    for (int j = 0; j < i; ++j) island.pairs.push_back({{Partner::Kind::block, j}, i});
  }
  IslandReport run(double time, double stretch) {
    IslandReport r;
    const int stretches = static_cast<int>(std::lround(time / stretch));
    for (int i = 0; i < stretches; ++i) {
      r = step::OneStep(model, state, env, history, settings).advance(island, i * stretch, stretch, hint);
      EXPECT_TRUE(r.failure.empty()) << r.failure;
      ledger += r.ledger;
      counters += r.counters;
      hint = r.next_step;
    }
    return r;
  }
  double energy() const {
    double e = 0;
    for (int i = 0; i < state.size(); ++i) {
      const dda::BlockEnergy of = dda::energy(model, state, i);
      e += of.translational + of.rotational + of.potential;
    }
    return e;
  }
};

ContactLaw rock(double friction, double restitution) {
  ContactLaw law;
  law.friction = friction;
  law.restitution = restitution;
  return law;
}

/// Dropped by 0.3 m, e = 0.8: the first apex lies 0.192 m above the plane, whatever number of cubes is in the island.
TEST(OneStep, ReboundsAsHighWhateverTheNumber) {
  const double fall = std::sqrt(2 * 0.3 / g), apex = fall * (1 + 0.8);
  for (const int n : {1, 13}) {
    Cubes cubes(rock(0.5, 0.8));
    for (int i = 0; i < n; ++i) cubes.add(Vec3(1.02 * i, 0, 0.8), Vec3::Zero());
    cubes.run(apex, apex / 10);
    for (int i = 0; i < n; ++i) EXPECT_NEAR(cubes.state.c[static_cast<std::size_t>(i)].z(), 0.5 + 0.192, 1e-4) << n << " cubes, cube " << i;
  }
}

/// A cube that slides stops after v^2 / (2 mu g), to the accuracy asked for, whatever the stretch; the ledger knows where its energy went.
TEST(OneStep, SlidesAsFarAsCoulombSays) {
  for (const double stretch : {0.002, 0.05}) {
    Cubes cubes(rock(0.3, 0));
    cubes.add(Vec3(0, 0, 0.5), Vec3(2.4, 1.8, 0));
    const double before = cubes.energy();
    const IslandReport last = cubes.run(1.2, stretch);
    const double way = 9 / (2 * 0.3 * g);
    EXPECT_NEAR(cubes.state.c[0].x(), 0.8 * way, 1e-3) << stretch;
    EXPECT_NEAR(cubes.state.c[0].y(), 0.6 * way, 1e-3) << stretch;
    EXPECT_TRUE(last.at_rest) << stretch;
    EXPECT_NEAR(cubes.ledger.friction_work + cubes.ledger.damping_work + cubes.ledger.algorithmic, before - cubes.energy(), 1e-9 * before);
    EXPECT_NEAR(cubes.ledger.friction_work, before - cubes.energy(), 1e-3 * before);
  }
}

/// A tower stands: it is certified to rest, and moves by no more than the residual of its contacts lets it until then.
TEST(OneStep, TowerStands) {
  const double creep = step::Tolerances(StepSettings{}.accuracy, 1, g).residual * 0.5;
  Cubes cubes(rock(0.5, 0));
  for (int i = 0; i < 5; ++i) cubes.add(Vec3(0, 0, 0.5 + i), Vec3::Zero());
  const IslandReport last = cubes.run(0.5, 0.05);
  EXPECT_TRUE(last.at_rest);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(cubes.state.c[static_cast<std::size_t>(i)].z(), 0.5 + i, creep);
}

/// A free cluster keeps its momenta to round-off: two cubes that meet off-centre, with friction and restitution, no gravity.
TEST(OneStep, KeepsMomenta) {
  Cubes cubes(rock(0.4, 0.5));
  cubes.model.gravity.setZero();
  cubes.add(Vec3(0, 0, 5), Vec3(1, 0.2, 0));
  cubes.add(Vec3(1.3, 0.4, 5.3), Vec3(-1, 0, 0.1));
  const auto momenta = [&] {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    for (int i = 0; i < 2; ++i) {
      Vec3 p, l;
      dda::momentum(cubes.model, cubes.state, i, p, l);
      linear += p;
      angular += l;
    }
    return std::pair(linear, angular);
  };
  const auto [p0, l0] = momenta();
  const double e0 = cubes.energy();
  cubes.run(0.5, 0.05);
  const auto [p1, l1] = momenta();
  EXPECT_GT(cubes.counters.impacts, 0);
  EXPECT_LT((p1 - p0).norm(), 1e-12 * 2500);
  EXPECT_LT((l1 - l0).norm(), 1e-11 * l0.norm());
  EXPECT_LE(cubes.energy(), e0 * (1 + 1e-12));
}

}  // namespace
}  // namespace talus::coupling

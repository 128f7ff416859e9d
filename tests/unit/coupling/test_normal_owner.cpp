// Which body turns the normal of a contact.
#include <gtest/gtest.h>

#include <memory>

#include "contact/narrow/narrow_math.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "helpers/shapes.hpp"

namespace talus::coupling {
namespace {

/// A ridge along y whose flanks fall by 0.01, and a cube on it with one edge across, its lower face leaning
/// by 0.005: within the angle at which faces press on an area.
struct OnRidge {
  dda::Model model;
  dda::State state;
  Environment env;
  std::vector<Touch> touches;

  explicit OnRidge(bool zones) {
    TriangleSurface s;
    for (const double x : {-2.0, 0.0, 2.0})
      for (const double y : {-2.0, 2.0}) s.vertices.emplace_back(x, y, -0.01 * std::abs(x));
    for (const int k : {0, 2})
      s.triangles.push_back({k, k + 2, k + 3}), s.triangles.push_back({k, k + 3, k + 1});
    if (zones) s.material.assign(s.triangles.size(), 0);
    env.terrain = std::make_shared<contact::SurfaceIndex>(s);
    env.laws = {1, {ContactLaw{}}};
    dda::Model::Block block;
    block.shape = std::make_shared<Polyhedron>(test::unit_cube());
    model.blocks = {block};
    const Quat turn(Eigen::AngleAxisd(0.005, Vec3::UnitX()));
    state.c = {-(turn * Vec3(0, -0.5, -0.5))};
    state.v = state.w = {Vec3::Zero()};
    state.q = {turn};
    state.eps = state.eps_rate = {Vec6::Zero()};
    find_touches(model, state, env, {{Partner::Kind::terrain, 0}, 0}, 0.01, ContactHistory(1), touches);
  }
};

TEST(NormalOwner, EdgesAcrossEachOtherTurnTheirNormalThoughAFacePressesWithThem) {
  for (const bool zones : {false, true}) {
    const OnRidge on(zones);
    int crossings = 0;
    for (const Touch& t : on.touches) {
      if (contact::form_of(t.at.key) != contact::Form::edge_edge || std::abs(t.at.gap) > 1e-9) continue;
      ++crossings;
      EXPECT_GE(t.at.face_b, 0);  // the lower face, on whose area the ends of the edge press
      EXPECT_EQ(normal_owner(t, on.model, on.env, nullptr), NormalOwner::edges) << zones;
    }
    EXPECT_EQ(crossings, 1);
  }
}

}  // namespace
}  // namespace talus::coupling

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "fem/bearings/bearings.hpp"
#include "fem_specs.hpp"

namespace talus::fem {
namespace {

StructureSpec spans_on_bearings() {
  StructureSpec s;
  s.name = "V";
  s.kind = "viaduct";
  s.young = 30e9;
  s.density = 2450;
  s.cell_size = 0.75;
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.parameters = {{"spans", 2}, {"span_length", 12}, {"pier_height", 6}};
  return s;
}

/// Supports stand at the sums of the spans, and every deck reaches from one to the next.
TEST(Bearings, SpansOfTheirOwnLengths) {
  StructureSpec s = spans_on_bearings();
  s.parameters = {
      {"spans", 3}, {"span_length", 12}, {"span_length.2", 18}, {"pier_height", 6}, {"abutments", 1}};
  const ViaductPlan plan = viaduct_plan(s);
  ASSERT_EQ(plan.soffits.size(), 3u);
  const double start[] = {-12, 0, 18}, end[] = {0, 18, 30};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(plan.soffits[k].start.x(), start[k] + 0.025, 1e-12);
    EXPECT_NEAR(plan.soffits[k].end.x(), end[k] - 0.025, 1e-12);
  }
  ASSERT_EQ(plan.piers.size(), 2u);
  EXPECT_NEAR(plan.piers[1].shape.base.x(), 18, 1e-12);
  const FemStructure bridge(s, Vec3(0, 0, -9.81), test::silent);
  double weight = 0;
  for (const double v : cell_volumes(bridge.mesh())) weight += 2450 * 9.81 * v;
  EXPECT_NEAR(bridge.loads().base_force().z(), -weight, 1e-6 * weight);  // every deck finds its bearings
  for (const auto& [key, value] : std::vector<std::pair<std::string, double>>{
           {"span_length.4", 18}, {"span_length.0", 18}, {"span_length.x", 18}, {"span_length.1", 0.5}}) {
    StructureSpec wrong = spans_on_bearings();
    wrong.parameters.emplace_back(key, value);
    EXPECT_THROW(viaduct_plan(wrong), InputError) << key;
  }
}

/// Decks rest under their weight, whatever of a pad lifts off as their ends turn, slides or bears stiffly,
/// and however far a slender deck sags: a stiffness as built alone came no nearer than 1e-5 to 200 times the
/// load.
TEST(Bearings, DecksRestUnderTheirWeight) {
  const std::vector<std::pair<std::string, double>> girders = {
      {"girders", 3}, {"slab_thickness", 0.25}, {"girder_width", 0.4}};
  const auto with = [&](std::vector<std::pair<std::string, double>> more) {
    more.insert(more.end(), girders.begin(), girders.end());
    return more;
  };
  const std::vector<std::vector<std::pair<std::string, double>>> kinds = {
      girders,
      with({{"bearing_stiffness", 1e8}}),
      with({{"bearing_friction", 0.02}}),
      with({{"bearing_friction", 0.001}}),  // the feet follow the slide only from where it came nearest
      {{"bearing_friction", 0.01}, {"skew", 0.35}, {"grade", 0.03}, {"span_length.1", 8}},
      {{"span_length.1", 30}},
  };
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    StructureSpec s = spans_on_bearings();
    s.cell_size = 0.25;
    s.parameters = {{"spans", 2},       {"span_length", 16}, {"pier_height", 5},
                    {"pier_width", 1},  {"pier_depth", 1},   {"cap_height", 0.8},
                    {"cap_width", 1.6}, {"deck_width", 4},   {"deck_depth", 0.8}};
    s.parameters.insert(s.parameters.end(), kinds[k].begin(), kinds[k].end());
    std::string said;
    FemStructure bridge(s, Vec3(0, 0, -9.81), [&](const std::string& line) { said += line + '\n'; });
    EXPECT_EQ(said.find("no state at rest"), std::string::npos) << k << ": " << said;
    EXPECT_TRUE(bridge.quiet()) << k;
    double weight = 0;
    for (const double v : cell_volumes(bridge.mesh())) weight += 2450 * 9.81 * v;
    EXPECT_NEAR(bridge.loads().base_force().z(), -weight, 1e-8 * weight) << k;
  }
}

/// Decks on bearings without friction slide off a seat that leans by ever so little: the search for a state
/// of rest ends where it came nearest, and names the friction.
TEST(Bearings, WithoutFrictionDecksBeginWhereTheyNearlyRest) {
  StructureSpec s = spans_on_bearings();
  s.parameters = {{"spans", 3},        {"span_length", 20}, {"pier_height", 8},     {"deck_width", 6},
                  {"deck_depth", 1.5}, {"abutments", 1},    {"bearing_friction", 0}};
  std::string said;
  const FemStructure bridge(s, Vec3(0, 0, -9.81), [&](const std::string& line) { said += line + '\n'; });
  EXPECT_NE(said.find("whose friction is 0"), std::string::npos) << said;
  double weight = 0;
  for (const double v : cell_volumes(bridge.mesh())) weight += 2450 * 9.81 * v;
  EXPECT_NEAR(bridge.loads().base_force().z(), -weight, 0.01 * weight);
}

/// What is asked of the integrator and cannot be stands in the plan: bearings have no modes, and take
/// explicit steps as they slide.
TEST(Bearings, ThePlanSaysWhatTheIntegratorCannotDo) {
  const auto plan = [](const char* integrator) {
    StructureSpec s = spans_on_bearings();
    s.integrator = integrator;
    return FemStructure(s, Vec3(0, 0, -9.81), test::silent).plan();
  };
  const std::string slides = "explicit sub-steps wherever bearings slide",
                    no_modes = "integrator = \"modal\" finds no modes (bearings)";
  for (const char* integrator : {"auto", "implicit", "modal"}) {
    EXPECT_NE(plan(integrator).find(slides), std::string::npos) << plan(integrator);
    EXPECT_EQ(plan(integrator).find(no_modes) != std::string::npos, std::string(integrator) == "modal")
        << plan(integrator);
  }
  EXPECT_EQ(plan("explicit").find(slides), std::string::npos);  // they are all the time
}

/// A deck that is pressed 1 mm into its bearings and pushed across its cap beams, which are 4 m to each side:
/// its forces act on the caps where it lies. Between deck and cap there is no couple but those of friction
/// over the height between node and foot, and of the weight on springs that lean.
TEST(Bearings, ForcesActWhereTheDeckHasSlipped) {
  const StructureSpec s = spans_on_bearings();
  const HexMesh mesh = make_mesh(s);
  const ViaductPlan plan = viaduct_plan(s);
  Bearings bearings(s, mesh, plan);
  const std::vector<char> live(mesh.hexes.size(), 1);
  AlignedVector u(4 * mesh.nodes.size(), 0.0), f(u.size(), 0.0);
  std::vector<char> in_deck(mesh.nodes.size(), 0);
  for (std::size_t cell = 0; cell < mesh.hexes.size(); ++cell)
    if (mesh.component[cell] == 3)  // after three bents
      for (const int n : mesh.hexes[cell]) in_deck[static_cast<std::size_t>(n)] = 1;
  const auto settle = [&](double across) {
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
      if (in_deck[n]) u[4 * n + 1] = across, u[4 * n + 2] = -1e-3;
    std::fill(f.begin(), f.end(), 0.0);
    bearings.add_forces(u.data(), live, f.data());
    bearings.accept();
  };
  const auto moment_on = [&](bool deck) {  // about the axis of the bridge, of the forces on it, which are -f
    double moment = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
      if (static_cast<bool>(in_deck[n]) != deck) continue;
      const double y = mesh.nodes[n].y() + u[4 * n + 1], z = mesh.nodes[n].z() + u[4 * n + 2];
      moment -= y * f[4 * n + 2] - z * f[4 * n + 1];
    }
    return moment;
  };
  double slip = 0;
  for (; slip < 1.5; slip += 0.01) settle(slip);
  settle(slip), settle(slip);
  double normal = 0, friction = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    if (in_deck[n]) normal -= f[4 * n + 2], friction -= f[4 * n + 1];
  ASSERT_GT(normal, 1e6);
  EXPECT_NEAR(friction, -0.3 * normal, 1e-6 * normal);
  const double elastic = 0.3 * normal / (4 * plan.bearing_stiffness);  // four pads: what the springs lean by
  EXPECT_NEAR(moment_on(true) + moment_on(false), normal * elastic - friction * (plan.bearing_height - 1e-3),
              1e-6 * normal);
  // The cap feels the deck's weight eccentric by what has slipped.
  const double top = mesh.local[static_cast<std::size_t>(bearings.sites()[0].built.node[6])].z();
  EXPECT_NEAR(moment_on(false), -normal * (slip - elastic) + top * friction, 1e-3 * normal);
  // Stopped and gone on with, the same bits.
  std::vector<double> state;
  bearings.save(state);
  Bearings again(s, mesh, plan);
  StateReader reader(state);
  again.restore(reader);
  EXPECT_TRUE(reader.empty());
  AlignedVector before(u.size(), 0.0), after(u.size(), 0.0);
  bearings.add_forces(u.data(), live, before.data());
  again.add_forces(u.data(), live, after.data());
  EXPECT_EQ(before, after);
}

}  // namespace
}  // namespace talus::fem

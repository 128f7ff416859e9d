#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"

namespace talus::scene {
namespace {

TEST(ReadScene, NamesOfPiecesAreKeptForThem) {
  const Place place;
  const std::string scene = changed(full, "name = \"B1\"", "name = \"P2.fragment1\"");
  EXPECT_THROW(read_scene_text(scene, place.scene()), InputError);
  EXPECT_NO_THROW(read_scene_text(changed(full, "name = \"B1\"", "name = \"P2.fragments\""), place.scene()));
  // A run that goes on from another may have its pieces as blocks.
  EXPECT_NO_THROW(read_scene_text(
      changed(scene, "accuracy = 1e-3", "accuracy = 1e-3\ninitial_state = \"slope.stl\""), place.scene()));
  EXPECT_NO_THROW(read_scene_text(scene, place.scene(), {{"coupling.fragments", "false"}}));
}

TEST(ReadScene, PresetsFillWhatIsLeftOut) {
  const Place place;
  const auto law_of = [&](const std::string& lines) {
    const Scene s = read_scene_text(
        "schema = 1\n[simulation]\nduration = 1\n[[plane]]\nnormal = [0, 0, 1]\nmaterial = "
        "\"ground\"\n[[material]]\nname = \"rock\"\ndensity = 2600\n[[interface]]\nbetween = [\"rock\", "
        "\"*\"]\nnormal_stiffness = \"hard\"\n" +
            lines +
            "\n[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = "
            "[0, 0, 1]\n",
        place.scene());
    EXPECT_EQ(std::any_of(s.notes.begin(), s.notes.end(),
                          [](const std::string& n) {
                            return n.find("preset \"") != std::string::npos &&
                                   n.find("to be calibrated") != std::string::npos;
                          }),
              lines.find("preset") != std::string::npos);
    return s.laws(index(s, "rock"), index(s, "ground"));
  };
  for (const char* name : {"rock", "talus", "compact soil", "soft soil", "forest"}) {
    const ContactLaw law = law_of("preset = \"" + std::string(name) + "\"");
    EXPECT_GT(law.friction, 0.2) << name;
    EXPECT_LT(law.friction, 0.9) << name;
    EXPECT_TRUE(law.restitution.has_value()) << name;
    EXPECT_GT(law.rolling_resistance, 0) << name;
    EXPECT_EQ(law.changes_with_way(), std::string(name) != "rock" && std::string(name) != "talus") << name;
    EXPECT_EQ(law.vegetation_drag > 0, std::string(name) == "forest") << name;
  }
  // What is given holds.
  const ContactLaw own = law_of(
      "preset = \"soft soil\"\nfriction = 0.5\nrestitution = 0.3\nrolling_resistance = 0\nslip_friction = { "
      "most = 1.0, length = 2.0 }");
  EXPECT_EQ(own.friction, 0.5);
  EXPECT_EQ(own.restitution, 0.3);
  EXPECT_EQ(own.rolling_resistance, 0);
  EXPECT_EQ(own.friction_most, 1);
  EXPECT_EQ(own.friction_way, 2);
  EXPECT_EQ(own.friction_recovery, 0);
  EXPECT_FALSE(law_of("friction = 0.5").restitution.has_value());
}

TEST(ReadScene, WhatIsSwitchedOffIsNotThere) {
  const Place place;
  const Scene all = read_scene_text(full, place.scene());
  const Scene without =
      read_scene_text(full, place.scene(), {{"structure.P2.enabled", "false"}, {"plane.0.enabled", "false"}});
  ASSERT_FALSE(all.structures.empty());
  EXPECT_EQ(without.structures.size(), all.structures.size() - 1);
  EXPECT_EQ(without.planes.size(), all.planes.size() - 1);
  EXPECT_EQ(read_scene_text(full, place.scene(), {{"structure.P2.enabled", "true"}}).structures.size(),
            all.structures.size());
  EXPECT_THROW(read_scene_text(full, place.scene(), {{"structure.P2.enabled", "0"}}), InputError);
}

TEST(ReadScene, FillsTheStructs) {
  const Place place;
  const Scene s = read_scene_text(full, place.scene());
  EXPECT_EQ(s.title, "Boulder against pier P2");
  EXPECT_EQ(s.simulation.duration, 30);
  EXPECT_EQ(s.simulation.accuracy, 1e-3);
  EXPECT_FALSE(s.simulation.step);
  EXPECT_EQ(s.simulation.gravity, Vec3(0, 0, -9.81));
  ASSERT_TRUE(s.site);
  EXPECT_EQ(s.site->terrain, (place.path() / "slope.stl").string());
  ASSERT_EQ(s.planes.size(), 1u);
  EXPECT_EQ(s.planes[0].normal, Vec3::UnitZ());
  ASSERT_EQ(s.blocks.size(), 1u);
  EXPECT_EQ(s.blocks[0].shape.size, Vec3(4, 5, 5.75));
  EXPECT_TRUE(s.blocks[0].deformable);  // the material has young
  EXPECT_EQ(s.blocks[0].velocity, Vec3(0, 0, -1));
  ASSERT_TRUE(s.rock_mass);
  EXPECT_NEAR(s.rock_mass->joint_sets[0].dip_direction, 267 * degree, 1e-15);
  EXPECT_NEAR(s.rock_mass->joint_sets[0].dip, 87 * degree, 1e-15);
  EXPECT_EQ(s.rock_mass->joints[0].through, Vec3(1, 2, 3));
  ASSERT_EQ(s.structures.size(), 1u);
  const StructureSpec& p = s.structures[0];
  EXPECT_EQ(p.size, Vec3(2, 2, 12));
  EXPECT_EQ(p.position, Vec3(20, 0, 0));
  EXPECT_EQ(p.density, 2450);  // concrete, none given
  EXPECT_EQ(p.poisson, 0.2);
  EXPECT_EQ(p.f_cm, 48e6);
  EXPECT_EQ(p.supports[0].face, "-z");
  EXPECT_EQ(p.loads[0].traction, Vec3(2e6, 0, 0));
  EXPECT_EQ(p.loads[0].history[1], std::pair(0.005, 1.0));
  EXPECT_TRUE(s.coupling.strict);
  EXPECT_EQ(s.output.history_interval, 1e-3);
  EXPECT_EQ(s.files.size(), 3u);
}

TEST(ReadScene, ExactInterfaceBeforeOneStarBeforeTwo) {
  const Place place;
  const Scene s = read_scene_text(full, place.scene());
  const int rock = index(s, "rock"), slope = index(s, "slope"), concrete = index(s, "C40");
  EXPECT_EQ(s.laws(rock, slope).friction, std::tan(28 * degree));
  EXPECT_EQ(s.laws(slope, rock).friction, std::tan(28 * degree));
  EXPECT_EQ(s.laws(rock, rock).friction, 0.5);
  EXPECT_EQ(s.laws(rock, concrete).friction, 0.5);
  EXPECT_EQ(s.laws(concrete, slope).friction, 0.6);  // fragments of the pier
  EXPECT_EQ(s.laws(concrete, slope).stiffness, ContactLaw::Stiffness::per_area);
  EXPECT_EQ(s.laws(concrete, slope).normal_stiffness, 20e9);
}

TEST(ReadScene, PiecesOfAStructureAloneRubLikeConcrete) {
  const Place place;
  const Scene s = read_scene_text(R"(schema = 1
[[material]]
name = "C30"
f_cm = "38 MPa"
[[structure]]
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [1, 1]
height = 2
cells = [1, 1, 2]
damage = "concrete"
)",
                                  place.scene());
  EXPECT_EQ(s.laws(0, 0).friction, 0.7);
  EXPECT_TRUE(s.laws(0, 0).chosen);
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_NE(s.warnings[0].str().find("friction 0.7"), std::string::npos);
}

/// What has no effect in the scene at hand.
TEST(ReadScene, IdleKeysAreWarnedOf) {
  const Place place;
  const std::string scene =
      "schema = 1\n[simulation]\nduration = 1\n[[material]]\nname = \"rock\"\ndensity = 2500\n[[material]]\n"
      "name = \"ground\"\n{}[[plane]]\nmaterial = \"ground\"\nnormal = [0, 0, 1]\n[[interface]]\nbetween = "
      "[\"rock\", \"{}\"]\nfriction = 0.3\n{}\n[[interface]]\nbetween = [\"rock\", \"{}\"]\nfriction = "
      "0.3\n[[block]]\nname = \"a\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = [0, "
      "0, 2]\n[[block]]\nname = \"b\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = "
      "[2, 0, 2]\n";
  const auto said = [&](const char* material, const char* keys, const char* with, const char* other) {
    std::string all;
    for (const Problem& p :
         read_scene_text(fmt::format(fmt::runtime(scene), material, with, keys, other), place.scene())
             .warnings)
      all += p.str() + "\n";
    return all;
  };
  const auto at_ground = [&](const char* material, const char* keys) {
    return said(material, keys, "ground", "rock");
  };
  EXPECT_EQ(at_ground("", ""), "");
  EXPECT_NE(at_ground("roughness = { amplitude = 0.1, length = 1 }\n", "").find("only faces of a terrain"),
            std::string::npos);
  EXPECT_NE(at_ground("poisson = 0.3\n", "").find("without Young's modulus is rigid"), std::string::npos);
  EXPECT_NE(at_ground("", "damping_ratio = 0.5").find("without a spring"), std::string::npos);
  EXPECT_EQ(at_ground("young = 1e9\n", "damping_ratio = 0.5"), "");
  EXPECT_EQ(at_ground("", "damping_ratio = 0.5\nnormal_stiffness = \"1 GN/m\""), "");
  EXPECT_NE(at_ground("", "restitution = 0\nrestitution_half_speed = 9").find("0 at all speeds"),
            std::string::npos);
  EXPECT_NE(at_ground("", "restitution_tangential = 0.4\nnormal_stiffness = \"1 GN/m\"")
                .find("a spring without restitution"),
            std::string::npos);
  EXPECT_EQ(at_ground("", "restitution_tangential = 0.4"), "");
  EXPECT_NE(at_ground("young = 1e9\n",
                      "normal_stiffness = \"hard\"\ncontact_law = { kind = \"hertz\", radius = 1 }")
                .find("contact_law gives the force"),
            std::string::npos);
  const char* const plants = "vegetation = { height = 2, drag = 500 }";
  EXPECT_EQ(at_ground("", plants), "");
  EXPECT_NE(said("", plants, "rock", "ground").find("it grows on the ground"), std::string::npos);
}

/// Measures of parts that a viaduct does not have.
TEST(ReadScene, IdleMeasuresOfAViaductAreWarnedOf) {
  const Place place;
  const auto said = [&](const std::string& keys) {
    const std::string text = full.substr(0, full.find("[[structure]]")) +
                             "[[structure]]\nmaterial = \"C40\"\nkind = \"viaduct\"\nposition = [9, 0, "
                             "0]\ncell_size = 0.5\n" +
                             keys + "\n";
    std::string all;
    for (const Problem& p : read_scene_text(text, place.scene()).warnings)
      if (p.str().find("structure.") != std::string::npos) all += p.str() + "\n";
    return all;
  };
  EXPECT_NE(said("slab_thickness = 0.3").find("a solid deck has no girders"), std::string::npos);
  EXPECT_NE(said("girder_width = 0.4\ngirders = 0").find("a solid deck has no girders"), std::string::npos);
  EXPECT_EQ(said("slab_thickness = 0.3\ngirder_width = 0.4\ngirders = 3").find("no effect"),
            std::string::npos);
  EXPECT_NE(said("pier_spacing = 3").find("a bent has one pier"), std::string::npos);
  EXPECT_EQ(said("pier_spacing = 3\npiers_per_bent = 2").find("no effect"), std::string::npos);
}

/// What is allowed and hardly meant, each with the number of the sentence that it gives.
TEST(ReadScene, SlipsOfUnitsAreWarnedOf) {
  const Place place;
  const auto warnings = [&](const std::string& text) {
    std::string all;
    for (const Problem& p : read_scene_text(text, place.scene()).warnings) all += p.str() + "\n";
    return all;
  };
  const auto expect = [&](const std::string& from, const std::string& to, const std::string& said) {
    const std::string before = warnings(full), after = warnings(changed(full, from, to));
    EXPECT_EQ(before.find(said), std::string::npos) << before;
    EXPECT_NE(after.find(said), std::string::npos) << "no word of " << said << " in\n" << after;
  };
  expect("young = \"3 GPa\"", "young = 30", "did you mean \"30 GPa\"?");
  expect("f_cm = \"48 MPa\"", "f_cm = \"48 MPa\"\ntensile_strength = 3.5", "did you mean \"3.5 MPa\"?");
  expect("f_cm = \"48 MPa\"", "f_cm = \"48 MPa\"\nfracture_energy = 0.15",
         "0.15 N/m is the fracture energy of no rock or concrete");
  expect("friction = \"28 deg\"", "friction = \"28 deg\"\ncohesion = 0.5", "did you mean \"0.5 MPa\"?");
  expect("friction = \"28 deg\"", "friction = \"28 deg\"\ncohesion = 50", "did you mean \"50 kPa\"?");
  expect("dip = \"29 deg\" }", "dip = 1 }", "this is 57.3 deg; write \"1 deg\"");
  const std::string
      bars = "rebar = \"bars.csv\"",
      rule =
          "rebar = [{ kind = \"stirrups\", diameter = \"12 mm\", cover = \"40 mm\", spacing = \"150 mm\" }]";
  EXPECT_EQ(warnings(changed(full, bars, rule)).find("rebar"), std::string::npos);
  expect(bars, changed(rule, "150 mm", "3 m"), "wider than the section's least side (2 m)");
  expect(bars, changed(rule, "40 mm", "60 cm"), "puts the bars deep within the section, of 2 m");
  const auto both = [](const char* bars_cover) {
    return std::string("rebar = [{ kind = \"longitudinal\", bars = 8, diameter = \"25 mm\", cover = \"") +
           bars_cover +
           "\" }, { kind = \"stirrups\", diameter = \"12 mm\", cover = \"40 mm\", spacing = \"150 mm\" }]";
  };
  expect(bars, both("28 mm"),
         "structure.P2.rebar.0.cover = \"28 mm\": is less than that of the stirrups, 0.04 m");
  EXPECT_EQ(warnings(changed(full, bars, both("40 mm"))).find("stirrups"), std::string::npos);
  expect("cell_size = \"0.25 m\"", "cell_size = 250",
         "is larger than the structure, of 2 x 2 x 12 m; a bare number is in m: did you mean \"250 mm\"?");
  expect(bars, changed(rule, "40 mm", "0.5 mm"), "is next to no concrete outside of the bars");
  expect("friction = \"28 deg\"", "friction = \"35\"", "if it is an angle, write \"35 deg\"");
  expect("friction = \"28 deg\"", "friction = 400", "write an angle with its unit");
  expect("friction = \"28 deg\"", "friction = \"89 deg\"",
         "89 deg is beyond the friction of any rock or soil");
  const Scene s = read_scene_text(changed(full, "dip = \"29 deg\" }", "dip = 0.6 }"), place.scene());
  EXPECT_TRUE(std::any_of(s.notes.begin(), s.notes.end(), [](const std::string& n) {
    return n.find("block.B1.orientation.dip = 0.6, a bare number in radians: 34.38 deg.") == 0;
  }));
}

/// A probe that is given from the base moves and turns with its structure.
TEST(ReadScene, ProbesMayBeGivenFromTheBase) {
  const Place place;
  const auto probe = [&](const std::string& base) {
    std::string text = changed(changed(full, "at = [20.0, 0.0, 12.0]", "offset = [0.5, 0, \"12 m\"]"),
                               "base = [20.0, 0.0, 0.0]", base);
    return read_scene_text(text, place.scene()).structures.at(0).probes.at(0).at;
  };
  EXPECT_LT((probe("base = [20.0, 0.0, 0.0]") - Vec3(20.5, 0, 12)).norm(), 1e-12);
  EXPECT_LT((probe("base = [-7.0, 3.0, 2.0]") - Vec3(-6.5, 3, 14)).norm(), 1e-12);
  EXPECT_LT(
      (probe("base = [0, 0, 0]\norientation = { rotation_vector = [0, 0, \"90 deg\"] }") - Vec3(0, 0.5, 12))
          .norm(),
      1e-12);
}

/// Where a problem that shows when the world is built stands in the file.
TEST(ReadScene, PlacesOfKeysAreKept) {
  const Place place;
  const std::string unnamed =
      "[[block]]\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = [9.0, 9.0, 99.0]\n";
  const std::string text = full + unnamed;
  const Scene s = read_scene_text(text, place.scene());
  const auto line = [&](const std::string& needle) {
    return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.rfind(needle)), '\n');
  };
  const auto found = [&](const std::string& key) {
    const Where* where = place_of(s, key);
    return where ? where->line : 0;
  };
  EXPECT_EQ(found("block.B1.position"), line("position = [0.0, 0.0, 120.0]"));
  EXPECT_EQ(found("block.B2.position"), line("position = [9.0, 9.0, 99.0]"));
  EXPECT_EQ(found("block.B1.no_such_key"), line("[[block]]\nname"));
  EXPECT_EQ(found("structure.P2.cell_size"), line("cell_size"));
  EXPECT_EQ(found("structure.P2.probe.top.at"), line("at = [20.0, 0.0, 12.0]"));
  EXPECT_EQ(found("interface.slope/rock.normal_stiffness"),
            line("normal_stiffness = \"30 GN/m\""));  // the scene has it the other way round
  EXPECT_EQ(found("interface.C40/slope.friction"), line("friction = 0.6"));  // by its stars
  EXPECT_EQ(found("block.R12.position"), line("[rock_mass]"));
  EXPECT_EQ(found("nothing.of.this"), 0);
  EXPECT_TRUE(std::string(place_of(s, "block.B1.position")->file).ends_with("scene.toml"));
}

TEST(ReadScene, StiffnessFormsAndDefaults) {
  const Place place;
  const Scene s = read_scene_text(full, place.scene());
  const int rock = index(s, "rock"), slope = index(s, "slope");
  const ContactLaw& given = s.laws(rock, slope);
  EXPECT_EQ(given.stiffness, ContactLaw::Stiffness::per_contact);
  EXPECT_EQ(given.normal_stiffness, 30e9);
  EXPECT_EQ(given.shear_stiffness, 3.5e9);
  EXPECT_FALSE(given.chosen);
  const ContactLaw& chosen = s.laws(rock, rock);  // softer modulus over the smallest block
  EXPECT_TRUE(chosen.chosen);
  EXPECT_EQ(chosen.stiffness, ContactLaw::Stiffness::per_area);
  EXPECT_EQ(chosen.normal_stiffness, 3e9 / 3.84);
  EXPECT_EQ(chosen.shear_stiffness, chosen.normal_stiffness / 2.5);
  EXPECT_FALSE(s.notes.empty());

  const Scene hard =
      read_scene_text(changed(full, "normal_stiffness = \"30 GN/m\"\nshear_stiffness = \"3.5 GN/m\"",
                              "normal_stiffness = \"hard\""),
                      place.scene());
  EXPECT_EQ(hard.laws(rock, slope).stiffness, ContactLaw::Stiffness::hard);
  const Scene bare =
      read_scene_text(changed(full, "\"30 GN/m\"\nshear_stiffness = \"3.5 GN/m\"", "3e10"), place.scene());
  EXPECT_EQ(bare.laws(rock, slope).stiffness, ContactLaw::Stiffness::per_contact);
  EXPECT_EQ(bare.laws(rock, slope).shear_stiffness, 3e10 / 2.5);
  std::string rigid = changed(full, "young = \"3 GPa\"\n", "");
  rigid = changed(rigid, "[[structure]]", "[[unused]]");
  rigid = rigid.substr(0, rigid.find("[[unused]]"));
  const Scene r = read_scene_text(rigid, place.scene());
  EXPECT_EQ(r.laws(rock, rock).stiffness, ContactLaw::Stiffness::hard);
  EXPECT_TRUE(r.laws(rock, rock).chosen);
  EXPECT_FALSE(r.blocks[0].deformable);
}

TEST(ReadScene, OrientationForms) {
  const Place place;
  const auto rotation = [&](const std::string& form) {
    return read_scene_text(changed(full, "{ dip_direction = \"2 deg\", dip = \"29 deg\" }", form),
                           place.scene())
        .blocks[0]
        .rotation;
  };
  // Body x down dip, body z the upward normal; dip direction clockwise from north.
  const Mat3 east = rotation("{ dip_direction = \"90 deg\", dip = \"30 deg\" }");
  EXPECT_TRUE(east.col(0).isApprox(Vec3(std::cos(30 * degree), 0, -0.5), 1e-15));
  EXPECT_TRUE(east.col(2).isApprox(Vec3(0.5, 0, std::cos(30 * degree)), 1e-15));
  EXPECT_NEAR(east.determinant(), 1, 1e-15);
  const Mat3 north = rotation("{ dip_direction = 0, dip = \"30 deg\" }");
  EXPECT_TRUE(north.col(0).isApprox(Vec3(0, std::cos(30 * degree), -0.5), 1e-15));
  // Hamilton: a quarter turn about z takes body x to world y. The length does not matter.
  const Mat3 quarter = rotation("{ quaternion = [2.0, 0.0, 0.0, 2.0] }");
  EXPECT_TRUE(quarter.col(0).isApprox(Vec3::UnitY(), 1e-15));
  EXPECT_TRUE(rotation("{ rotation_vector = [0.0, 0.0, \"90 deg\"] }").isApprox(quarter, 1e-15));
  EXPECT_EQ(rotation("{ rotation_vector = [0.0, 0.0, 0.0] }"), Mat3::Identity());
  EXPECT_EQ(rotation("{ quaternion = [1, 0, 0, 0] }"), Mat3::Identity());
}

TEST(ReadScene, FrictionTakesAnAngleOrACoefficient) {
  const Place place;
  const auto friction = [&](const std::string& form) {
    const Scene s =
        read_scene_text(changed(full, "friction = \"28 deg\"", "friction = " + form), place.scene());
    return s.laws(index(s, "rock"), index(s, "slope")).friction;
  };
  EXPECT_EQ(friction("0.45"), 0.45);
  EXPECT_EQ(friction("1"), 1);
  EXPECT_EQ(friction("\"0.45\""), 0.45);
  EXPECT_DOUBLE_EQ(friction("\"0.5 rad\""), std::tan(0.5));
  EXPECT_NEAR(friction("\"45 deg\""), 1, 1e-15);
}

TEST(ReadScene, ContactLawForms) {
  const Place place;
  const auto law = [&](const std::string& form) {
    const Scene s =
        read_scene_text(changed(full, "restitution = 0.4", "contact_law = " + form), place.scene());
    return s.laws(index(s, "rock"), index(s, "slope"));
  };
  EXPECT_EQ(law("\"linear\"").kind, ContactLaw::Kind::linear);
  EXPECT_EQ(law("{ kind = \"hertz\", radius = \"1.5 m\" }").hertz_radius, 1.5);
  EXPECT_EQ(law("{ kind = \"crushing\", pressure = \"10 MPa\" }").crushing_pressure, 10e6);
  const ContactLaw table = law("{ kind = \"table\", file = \"law.csv\" }");
  ASSERT_EQ(table.table.size(), 3u);
  EXPECT_EQ(table.table[2], std::pair(0.02, 1.5e6));
  EXPECT_EQ(law("{ kind = \"table\", points = [[0, 0], [\"1 cm\", \"1 MN\"]] }").table[1],
            std::pair(0.01, 1e6));
  const Scene s = read_scene_text(
      changed(full, "restitution = 0.4", "contact_law = { kind = \"table\", file = \"law.csv\" }"),
      place.scene());
  EXPECT_TRUE(std::any_of(s.notes.begin(), s.notes.end(), [](const std::string& n) {
    return n ==
           "contact rock/slope: force by a table of 3 points, up to 1.5e+06 N at 0.02 m; beyond, its last "
           "slope goes on";
  }));
  const Scene h = read_scene_text(
      changed(full, "restitution = 0.4", "contact_law = { kind = \"hertz\", radius = \"1.5 m\" }"),
      place.scene());
  EXPECT_EQ(std::count_if(h.notes.begin(), h.notes.end(),
                          [](const std::string& n) { return n.starts_with("contact rock/slope: "); }),
            1);
  EXPECT_TRUE(std::any_of(h.notes.begin(), h.notes.end(), [](const std::string& n) {
    return n.starts_with("contact rock/slope: Hertz's law, 4/3 E* sqrt(R) with E* = ") &&
           n.ends_with(" and R = 1.5 m");
  }));
}

TEST(ReadScene, HertzsLawOfOneMaterialNamesItOnce) {
  const Place place;
  const std::string text = R"(schema = 1
title = "two cubes"
simulation = { duration = 1 }
material = [{ name = "z", density = 2650 }]
interface = [{ between = ["z", "z"], friction = 0.5, contact_law = { kind = "hertz", radius = 1 } }]
block = [{ name = "A", material = "z", shape = "box", size = [1, 1, 1], position = [0, 0, 0] },
         { name = "B", material = "z", shape = "box", size = [1, 1, 1], position = [0, 0, 3] }]
)";
  try {
    read_scene_text(text, place.scene());
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems().front().rule, "\"z\" has no Young's modulus, and Hertz's law needs one");
  }
}

TEST(ReadScene, SetReplacesByNameAndPlace) {
  const Place place;
  const Overrides set{{"simulation.step", "1e-4 s"},
                      {"block.B1.velocity", "[0,0,-5]"},
                      {"block.0.spin", "[1, 0, 0]"},
                      {"interface.slope/rock.friction", "30 deg"},
                      {"rock_mass.joint_set.J3.spacing", "2.5"},
                      {"site.crs", "EPSG:31254"}};
  const Scene s = read_scene_text(full, place.scene(), set);
  EXPECT_EQ(s.simulation.step, 1e-4);
  EXPECT_FALSE(s.simulation.accuracy);  // the override chose
  EXPECT_EQ(s.blocks[0].velocity, Vec3(0, 0, -5));
  EXPECT_EQ(s.blocks[0].spin, Vec3(1, 0, 0));
  EXPECT_EQ(s.laws(index(s, "rock"), index(s, "slope")).friction, std::tan(30 * degree));
  EXPECT_EQ(s.rock_mass->joint_sets[0].spacing, 2.5);
  EXPECT_EQ(s.site->crs, "EPSG:31254");
  try {
    read_scene_text(full, place.scene(), {{"block.B2.velocity", "[0,0,1]"}});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean \"B1\"?"), std::string::npos) << e.what();
  }
  EXPECT_THROW(
      read_scene_text(full, place.scene(), {{"simulation.step", "1e-4 s"}, {"simulation.accuracy", "1e-3"}}),
      InputError);
}

TEST(ReadScene, SetKnowsTheNamesThatPlacesGive) {
  const Place place;
  const std::string text = changed(full, "name = \"B1\"\n", "");
  EXPECT_EQ(read_scene_text(text, place.scene(), {{"block.B1.velocity", "[0,0,-5]"}}).blocks[0].velocity,
            Vec3(0, 0, -5));
  try {
    read_scene_text(text, place.scene(), {{"block.B2.velocity", "[0,0,1]"}});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean \"B1\"?"), std::string::npos) << e.what();
  }
}

TEST(ReadScene, ResolvedReadsBackToTheSameBits) {
  const Place place;
  std::string text = changed(full, "{ dip_direction = \"2 deg\", dip = \"29 deg\" }",
                             "{ quaternion = [0.3, 0.1, -0.7, 0.2] }");
  text = changed(text, "restitution = 0.4",
                 "restitution = 0.1\nrestitution_half_speed = \"33 km/h\"\nrestitution_tangential = "
                 "0.3\nrolling_resistance = 0.07\ncontact_law = "
                 "{ kind = \"table\", file = \"law.csv\" }");
  text = changed(text, "normal = [0.0, 0.0, 2.0]", "normal = [0.1, 0.2, 0.7]");
  text = changed(text, "support = [\"-z\"]",
                 "support = [{ face = \"-z\", held = \"xz\" }, { point = [20.0, 1.0, 12.0] }, { line = "
                 "[[19.0, 0.0, 3.0], [19.0, 1.0, 3.0]], held = \"y\" }]");
  const Scene first = read_scene_text(text, place.scene());
  place.put("scene.resolved.json", first.resolved_json);
  const Scene second = read_scene((place.path() / "scene.resolved.json").string());
  EXPECT_TRUE(second.resolved_json == first.resolved_json);
  EXPECT_EQ(second.file, first.file);
  EXPECT_EQ(second.blocks[0].rotation, first.blocks[0].rotation);
  EXPECT_EQ(second.planes[0].normal, first.planes[0].normal);
  EXPECT_EQ(second.laws(0, 2).friction, first.laws(0, 2).friction);
  EXPECT_EQ(second.laws(0, 2), first.laws(0, 2));
  EXPECT_EQ(second.laws(0, 0).chosen, true);
  EXPECT_EQ(second.laws(0, 0).shear_stiffness, first.laws(0, 0).shear_stiffness);
  ASSERT_EQ(second.structures[0].supports.size(), 3u);
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(second.structures[0].supports[i].region.min(), first.structures[0].supports[i].region.min());
    EXPECT_EQ(second.structures[0].supports[i].held, first.structures[0].supports[i].held);
  }
  // A file that changes in between is not the same run.
  place.put("slope.stl", "solid other\nendsolid other\n");
  try {
    read_scene((place.path() / "scene.resolved.json").string());
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("has changed since the scene was resolved"), std::string::npos)
        << e.what();
  }
}

TEST(ReadScene, EveryKindResolves) {
  const Place place;
  const std::string base = full.substr(0, full.find("[[structure]]"));
  const std::vector<std::string> kinds{
      "kind = \"box\"\nposition = [9, 0, 1]\nsize = [1, 2, 3]\ncells = [2, 4, 6]\norientation = { "
      "rotation_vector = [0.1, 0.2, 0.3] }",
      "kind = \"column\"\nbase = [9, 0, 0]\nsection = \"round\"\ndiameter = 2\nheight = 9\ncell_size = 0.5",
      "kind = \"column\"\nbase = [9, 0, 0]\nsection = \"hollow\"\nsection_size = [2, 3]\nwall_thickness = "
      "0.3\nheight = 9\ncell_size = 0.5",
      "kind = \"viaduct\"\nposition = [9, 0, 0]\nsection = \"round\"\ndiameter = 1.5\nspans = 3\nspan_length "
      "= \"30 m\"\ndeck_width = 12\ncell_size = 0.5\nparameters = { kerb = \"20 cm\" }",
      "kind = \"mesh\"\nfile = \"mass.obj\"\nsupport = [\"foot\"]",
      "kind = \"mesh\"\nfile = \"mass.obj\"\nposition = [1, 2, 3]\nsupport = []\npreload = \"none\""};
  for (const std::string& kind : kinds) {
    const Scene first =
        read_scene_text(base + "[[structure]]\nmaterial = \"C40\"\n" + kind + "\n", place.scene());
    const Scene second = read_scene_text(first.resolved_json, place.scene());
    EXPECT_TRUE(second.resolved_json == first.resolved_json) << kind;
    EXPECT_EQ(second.structures[0].parameters, first.structures[0].parameters) << kind;
    EXPECT_EQ(second.structures[0].size, first.structures[0].size) << kind;
    EXPECT_EQ(second.structures[0].rotation, first.structures[0].rotation) << kind;
  }
}

// `diameter` and `pier_diameter` say the same of a viaduct; given both, or with another width, neither holds.
TEST(ReadScene, RoundPiersByTheirDiameter) {
  const Place place;
  const auto viaduct = [&](const std::string& section) {
    const std::string text =
        full.substr(0, full.find("[[structure]]")) +
        "[[structure]]\nmaterial = \"C40\"\nkind = \"viaduct\"\nposition = [9, 0, 0]\ncell_size = 0.5\n" +
        section + "\n";
    try {
      return read_scene_text(text, place.scene()).structures[0].parameters;
    } catch (const InputError& e) { return std::vector<std::pair<std::string, double>>{{e.what(), 0}}; }
  };
  const auto one = viaduct("section = \"round\"\ndiameter = 1.2");
  EXPECT_EQ(viaduct("section = \"round\"\npier_diameter = 1.2"), one);
  EXPECT_EQ(viaduct("section = \"round\"\npier_diameter = 1.2\npier_width = 1.2\npier_depth = 1.2"), one);
  const auto refused = [&](const std::string& section, const std::string& rule) {
    const std::string said = viaduct(section)[0].first;
    EXPECT_NE(said.find(rule), std::string::npos) << section << "\n" << said;
  };
  refused("section = \"round\"\ndiameter = 1.2\npier_diameter = 1.2", "the section has its diameter already");
  refused("section = \"round\"\npier_diameter = 1.2\npier_width = 1.5", "differs from pier_diameter");
  refused("section = \"round\"\npier_diameter = 1.2\npier_depth = 1.5", "differs from pier_diameter");
  refused("section = \"round\"\npier_diameter = 1.2\nsection_size = [1.2, 1.2]",
          "the section has its diameter already");
  refused("pier_diameter = 1.2", "only a round section has a diameter");
}

TEST(ReadScene, PaperMethodAlwaysDeforms) {
  const Place place;
  const std::string both_ways = changed(full, "accuracy = 1e-3", "method = \"dda-1988\"\nstep = \"1e-4 s\""),
                    paper = changed(both_ways, "scheme = \"two-way\"\n", "");
  EXPECT_THROW(read_scene_text(both_ways, place.scene()), InputError);
  const Scene s = read_scene_text(paper, place.scene());
  EXPECT_EQ(s.coupling.scheme,
            Coupling::Scheme::one_way);  // what is taken there, and what the resolved scene says
  EXPECT_NE(s.resolved_json.find("\"scheme\": \"one-way\""), std::string::npos);
  EXPECT_TRUE(s.blocks[0].deformable);
  EXPECT_EQ(s.laws(0, 0).stiffness, ContactLaw::Stiffness::per_contact);
  EXPECT_EQ(s.laws(0, 0).normal_stiffness, 3e9 * 3.84);
}

}  // namespace
}  // namespace talus::scene

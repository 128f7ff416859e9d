// Files as other programs write them: encodings, decimal commas, names that differ by case.
#include <algorithm>

#include "fixture.hpp"

namespace talus::scene {
namespace {

const std::string impact = R"(schema = 1
[simulation]
duration = 0.1
[[material]]
name = "rock"
density = 2500
[[material]]
name = "C"
density = 2500
young = "30 GPa"
poisson = 0.2
[[interface]]
between = ["rock", "C"]
friction = 0.5
[[structure]]
name = "p"
kind = "column"
material = "C"
base = [0, 0, 0]
section = [1, 1]
height = 4
cell_size = 0.25
support = ["-z"]
damage = "none"
[impact]
material = "rock"
shape = "EOTA111"
trajectories = "rows.csv"
)";

std::string refusal(const Place& place, const std::string& text) {
  try {
    read_scene_text(text, place.scene());
  } catch (const InputError& e) { return e.what(); }
  return {};
}

bool warned(const Scene& scene, const std::string& part) {
  return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                     [&](const Problem& p) { return p.str().find(part) != std::string::npos; });
}

std::string wide(const std::string& text, bool little) {
  std::string out = little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) out += little ? std::string({c, '\0'}) : std::string({'\0', c});
  return out;
}

}  // namespace

TEST(Dialects, DecimalCommasBetweenSemicolonsAndTabs) {
  const Place place;
  for (const char separator : {';', '\t'}) {
    std::string text = "x;y;z;vx;vy;vz;mass\n-6,0;0,1;2,2;20,5;0,0;-2,0;500,0\n";
    std::replace(text.begin(), text.end(), ';', separator);
    place.put("rows.csv", text);
    const Scene s = read_scene_text(impact, place.scene());
    EXPECT_EQ(s.impact->velocity, Vec3(20.5, 0, -2));
    EXPECT_EQ(s.impact->point, Vec3(-6, 0.1, 2.2));
    EXPECT_EQ(s.impact->shape.mass, 500);
  }
}

TEST(Dialects, DecimalPointsBetweenSemicolons) {
  const Place place;
  place.put("rows.csv", "x;y;z;vx;vy;vz;mass;\n-6.0;0.1;2.2;20.5;0;-2;500;\n");
  EXPECT_EQ(read_scene_text(impact, place.scene()).impact->velocity, Vec3(20.5, 0, -2));
}

TEST(Dialects, DecimalCommasBetweenCommasAreRefused) {
  const Place place;
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\n-6,0,0,1,2,2,20,5,0,0,-2,0,500,0\n");
  EXPECT_NE(refusal(place, impact)
                .find("line 2 of the file has 14 numbers where 7 are expected; are the commas decimal ones?"),
            std::string::npos)
      << refusal(place, impact);
  place.put("rows.csv", "x;y;z;vx;vy;vz;mass\n1.234,5;0;2;20;0;-2;500\n");
  EXPECT_NE(refusal(place, impact).find("\"1.234,5\" is not a number"), std::string::npos)
      << refusal(place, impact);
}

TEST(Dialects, AFirstRowThatIsMeantAsNumbersIsNoRowOfNames) {
  const Place place;
  const std::string rest = "\n-6,0.1,2.2,20.5,0,-2,500\n";
  for (const std::string first : {"inf,0,2,20,0,-2,500", "nan,0,2,20,0,-2,500", "=1+1,0,2,20,0,-2,500"}) {
    place.put("rows.csv", first + rest);
    EXPECT_NE(refusal(place, impact).find("is not a number"), std::string::npos) << refusal(place, impact);
  }
  place.put("rows.csv", "\"x,y,z,vx,vy,vz,mass" + rest);
  EXPECT_NE(refusal(place, impact).find("line 1 of the file has a quote that does not end"),
            std::string::npos)
      << refusal(place, impact);
  place.put("rows.csv", "sep=,\nx,y,z,vx,vy,vz,mass" + rest);
  EXPECT_EQ(refusal(place, impact), "");
}

TEST(Dialects, CellsHoldNumbersAlone) {
  const Place place;
  for (const std::string cell : {"500%", "500 %", "500 kg", "35 deg"}) {
    place.put("rows.csv", "x,y,z,vx,vy,vz,mass\n-6,0.1,2.2,20.5,0,-2," + cell + "\n");
    EXPECT_NE(refusal(place, impact).find("\"" + cell + "\" is not a number"), std::string::npos)
        << refusal(place, impact);
  }
}

TEST(Dialects, LettersThatOnlyLookLatinAreNamed) {
  const Place place;
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\n-6,0.1,2.2,20.5,0,-2,500\n");
  std::string text = impact;
  text.replace(text.rfind("\"rock\""), 6, "\"r\u043Eck\"");  // a Cyrillic o
  EXPECT_NE(refusal(place, text).find("(\"\u043E\" in it is U+043E)"), std::string::npos)
      << refusal(place, text);
  text = impact;
  text.replace(text.find("duration = 0.1"), 14, "duration = \"1\u00A0s\"");  // a blank that does not break
  EXPECT_NE(refusal(place, text).find("is U+00A0"), std::string::npos) << refusal(place, text);
}

TEST(Dialects, LinksToNothingAreNoFiles) {
  const Place place;
  std::filesystem::create_symlink("nothing.csv",
                                  std::filesystem::path(place.scene()).parent_path() / "rows.csv");
  EXPECT_NE(refusal(place, impact).find("there is no file"), std::string::npos);
  EXPECT_EQ(refusal(place, impact).find("did you mean"), std::string::npos) << refusal(place, impact);
}

TEST(Dialects, TablesOfContactLaws) {
  const Place place;
  const std::string scene = R"(schema = 1
[simulation]
duration = 0.1
[[material]]
name = "rock"
density = 2500
[[plane]]
point = [0, 0, 0]
normal = [0, 0, 1]
material = "g"
[[interface]]
between = ["rock", "g"]
friction = 0.5
contact_law = { kind = "table", file = "table.csv" }
[[block]]
name = "b"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 2]
)";
  place.put("table.csv", "s [m];F [N]\n0;0\n0,01;1e6\n0,02;2,5e6\n");
  const Scene s = read_scene_text(scene, place.scene());
  EXPECT_NEAR(s.laws(0, 1).table.at(2).first, 0.02, 1e-15);
  EXPECT_NEAR(s.laws(0, 1).table.at(2).second, 2.5e6, 1e-6);
  for (const char* text : {"indentation [mm];force [kN]\n0;0\n10;1000\n20;2500\n",
                           "u,F\nmm,kN\n0,0\n10,1000\n20,2500\n", "mm;MN\n0;0\n10;1\n20;2,5\n"}) {
    place.put("table.csv", text);
    const Scene of_units = read_scene_text(scene, place.scene());
    EXPECT_NEAR(of_units.laws(0, 1).table.at(2).first, 0.02, 1e-15) << text;
    EXPECT_NEAR(of_units.laws(0, 1).table.at(2).second, 2.5e6, 1e-6) << text;
  }
  place.put("table.csv", "force [N],indentation [m]\n0,0\n1e6,0.01\n");
  EXPECT_NE(refusal(place, scene).find("is a length in m"), std::string::npos) << refusal(place, scene);
  for (const char* text :
       {"s,F\nmm,kip\n0,0\n10,50\n50,200\n", "s,F\nmm,kN\nm,N\n0,0\n10,50\n50,200\n",
        "s [mm],F [kip]\n0,0\n10,50\n50,200\n", "s,F\nas,measured\n0,0\n10,50\n50,200\n",
        "kN,mm\n0,0\n10,50\n50,200\n", "F,s\n0,0\n10,50\n50,200\n", "Force,indentation\n0,0\n10,50\n50,200\n",
        "s,F\n0,0\n10,\"1,000\"\n50,\"2,000\"\n"}) {
    place.put("table.csv", text);
    EXPECT_FALSE(refusal(place, scene).empty()) << text;
  }
  place.put("table.csv", "s,F\nmm,kip\n0,0\n10,50\n");
  EXPECT_NE(
      refusal(place, scene).find("line 2 of the file, below the names of the columns: unknown unit \"kip\""),
      std::string::npos)
      << refusal(place, scene);
  place.put("table.csv", "s,F\n0,0\n\"0,125\",\"1000,5\"\n");
  EXPECT_EQ(read_scene_text(scene, place.scene()).laws(0, 1).table.at(1).second, 1000.5);
  place.put("table.csv", "0,0\n0,01,1000000\n");
  EXPECT_NE(refusal(place, scene).find("3 numbers where 2 are expected"), std::string::npos)
      << refusal(place, scene);
}

TEST(Dialects, UnitsOfTheColumnOfADistribution) {
  const Place place;
  const std::string scene = changed(full, "[output]", R"([ensemble]
members = 8
[[ensemble.vary]]
key = "block.B1.volume"
table = "table.csv"
[output])");
  const auto first = [&](const char* text) {
    place.put("table.csv", text);
    return read_scene_text(scene, place.scene()).ensemble->vary[0].table.at(0);
  };
  EXPECT_EQ(first("V [l]\n2000\n3000\n"), 2);
  EXPECT_EQ(first("V\nl\n2000\n3000\n"), 2);
  EXPECT_EQ(first("l\n2000\n3000\n"), 2);
  EXPECT_EQ(first("V (measured)\n2\n3\n"), 2);
  for (const char* litres : {"V / l\n2000\n3000\n", "V in dm3\n2000\n3000\n", "V_dm3\n2000\n3000\n",
                             "volume l\n2000\n3000\n", "dm3\n2000\n3000\n"})
    EXPECT_EQ(first(litres), 2) << litres;
  EXPECT_EQ(first("s / l\n2000\n3000\n"), 2);  // a name that is a unit as well
  for (const char* name : {"V_t\n2\n3\n", "V_max\n2\n3\n", "V of block B\n2\n3\n", "V/x\n2\n3\n"})
    EXPECT_EQ(first(name), 2) << name;
  for (const char* text :
       {"V [ft^3]\n35\n70\n", "V [yd3]\n35\n70\n", "V [bogus]\n35\n70\n", "V\nft^3\n35\n70\n",
        "V [kN]\n35\n70\n", "kg\n35\n70\n", "[kg]\n35\n70\n", "t\n35\n70\n", "mass_kg\n35\n70\n",
        "m / t\n35\n70\n", "m in kg\n35\n70\n", "V_ft\n35\n70\n", "\u22122\n3\n", "<2\n3\n", "V\n2-3\n5-8\n",
        "V\n2021-01-01\n", "V\n1 105\n"}) {
    place.put("table.csv", text);
    EXPECT_FALSE(refusal(place, scene).empty()) << text;
  }
}

// A friction is a coefficient or an angle: a unit says which.
TEST(Dialects, UnitsOfTheColumnOfAFriction) {
  const Place place;
  const std::string scene = changed(full, "[output]", R"([ensemble]
members = 8
[[ensemble.vary]]
key = "interface.rock/slope.friction"
table = "table.csv"
[output])");
  for (const char* head : {"deg", "[deg]", "\u00b0", "phi_deg", "phi in deg", "phi / deg", "phi [deg]"}) {
    place.put("table.csv", std::string(head) + "\n30\n45\n");
    const Vary v = read_scene_text(scene, place.scene()).ensemble->vary[0];
    EXPECT_EQ(v.unit, "rad") << head;
    EXPECT_NEAR(v.table.at(1), M_PI / 4, 1e-15) << head;
  }
  for (const char* head : {"mu", "mu_s", "m", "mu (static)"}) {
    place.put("table.csv", std::string(head) + "\n0.5\n0.6\n");
    EXPECT_EQ(read_scene_text(scene, place.scene()).ensemble->vary[0].unit, "") << head;
  }
}

TEST(Dialects, UnitsThatTheHeadOfATableNames) {
  const Place place;
  const auto expect_read = [&](const char* text) {
    place.put("rows.csv", text);
    const Scene s = read_scene_text(impact, place.scene());
    EXPECT_TRUE(s.impact->velocity.isApprox(Vec3(20, 0, -2), 1e-12)) << text;
    EXPECT_TRUE(s.impact->point.isApprox(Vec3(-6, 0.1, 2.2), 1e-12)) << text;
    EXPECT_NEAR(s.impact->shape.mass, 500, 1e-9) << text;
  };
  expect_read("x [m];y [m];z [m];vx [km/h];vy [km/h];vz [km/h];mass [t]\n-6;0,1;2,2;72;0;-7,2;0,5\n");
  expect_read("x,y,z,vx (m/s),vy (m/s),vz (m/s),mass (measured)\n-6,0.1,2.2,20,0,-2,500\n");
  expect_read("x;y;z;vx;vy;vz;mass\ncm;cm;cm;m/s;m/s;m/s;t\n-600;10;220;20;0;-2;0.5\n");
  expect_read("x / m;y / m;z / m;vx / (km/h);vy / (km/h);vz / (km/h);mass_t\n-6;0,1;2,2;72;0;-7,2;0,5\n");
  expect_read("x;y;z;vx;vy;vz;mass\n[m];[m];[m];[m/s];[m/s];[m/s];[kg]\n-6;0.1;2.2;20;0;-2;500\n");
  place.put("rows.csv", "x [ft],y,z,vx,vy,vz,mass\n-6,0.1,2.2,20,0,-2,500\n");
  EXPECT_NE(refusal(place, impact).find("1 ft = 0.3048 m"), std::string::npos) << refusal(place, impact);
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\nm,m,m,km/h,km/h,km/h,to\n-6,0.1,2.2,20,0,-2,500\n");
  EXPECT_NE(refusal(place, impact).find("unknown unit \"to\""), std::string::npos) << refusal(place, impact);
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\nshot,0,0,20,0,-2,300\n-6,0.1,2.2,20,0,-2,500\n");
  EXPECT_NE(refusal(place, impact).find("unknown unit \"shot\""), std::string::npos)
      << refusal(place, impact);
  expect_read("x,y,z,vx,vy,vz,mass,remark\nm,m,m,m/s,m/s,m/s,kg,none\n-6,0.1,2.2,20,0,-2,500,1\n");
  place.put("rows.csv", "x,y,z,vx [kN],vy,vz,mass\n-6,0.1,2.2,20,0,-2,500\n");
  EXPECT_NE(refusal(place, impact).find("vx is a velocity in m/s"), std::string::npos)
      << refusal(place, impact);
}

TEST(Dialects, PointsThatGroupDigitsAreRefused) {
  const Place place;
  place.put("rows.csv", "x;y;z;vx;vy;vz;mass\n-6;0,1;2,2;20;0;-2;1.500\n");
  EXPECT_NE(refusal(place, impact).find("decimal commas in some numbers and points in others"),
            std::string::npos)
      << refusal(place, impact);
}

TEST(Dialects, SceneFilesInOtherEncodings) {
  const Place place;
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\n-6,0,2,20,0,-2,500\n");
  for (const std::string& bytes :
       {"\xEF\xBB\xBF" + impact, wide(impact, true), wide(impact, false), wide(impact, true).substr(2)}) {
    std::ofstream(place.path() / "scene.toml", std::ios::binary) << bytes;
    EXPECT_EQ(read_scene(place.scene()).structures.size(), 1u);
  }
  std::ofstream(place.path() / "scene.toml", std::ios::binary) << impact;
  place.put("rows.csv", wide("x;y;z;vx;vy;vz;mass\r\n-6;0;2;20,5;0;-2;500\r\n", true));
  EXPECT_EQ(read_scene(place.scene()).impact->velocity.x(), 20.5);
}

TEST(Dialects, NamesThatDifferByCaseAreWarnedOf) {
  const Place place;
  place.put("rows.csv", "x,y,z,vx,vy,vz,mass\n-6,0,2,20,0,-2,500\n");
  const Scene s = read_scene_text(impact + "[[material]]\nname = \"Rock\"\ndensity = 2500\n", place.scene());
  EXPECT_TRUE(warned(s, "differs from \"rock\" by case only"));
  EXPECT_FALSE(warned(read_scene_text(impact, place.scene()), "by case only"));
}

}  // namespace talus::scene

// Mesh files that are read but cannot stand: what is wrong is named by the file's own numbers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/error.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

constexpr const char* sixteen_nodes =  // of two cubes, the second 3 m aside, numbered from 101 on
    "*NODE\n101,0,0,0\n102,1,0,0\n103,1,1,0\n104,0,1,0\n105,0,0,1\n106,1,0,1\n107,1,1,1\n108,0,1,1\n"
    "109,3,0,0\n110,4,0,0\n111,4,1,0\n112,3,1,0\n113,3,0,1\n114,4,0,1\n115,4,1,1\n116,3,1,1\n";
constexpr const char* first_cell = "*ELEMENT, TYPE=C3D8\n701,101,102,103,104,105,106,107,108\n";

StructureSpec from_text(const std::string& text) {
  StructureSpec s;
  s.name = "M";
  s.kind = "mesh";
  s.young = 30e9;
  s.poisson = 0.2;
  s.density = 2500;
  s.file = std::string(TALUS_BINARY_DIR) + "/bad_mesh_" +
           testing::UnitTest::GetInstance()->current_test_info()->name() + ".inp";  // tests run side by side
  std::ofstream(s.file) << text;
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  return s;
}

/// The first problem that building the structure reports, as text.
std::string refused(const StructureSpec& s) {
  try {
    FemStructure body(s, Vec3(0, 0, -9.81), silent);
  } catch (const InputError& e) { return e.what(); }
  return "accepted";
}

void expect_in(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
}

}  // namespace

TEST(BadMesh, NodesOfACellInOnePlace) {
  // A wedge written as a hexahedron: node 104 lies on node 101.
  std::string text = std::string(sixteen_nodes) + first_cell;
  text.replace(text.find("104,0,1,0"), 9, "104,0,0,0");
  expect_in(refused(from_text(text)), {"cell 701", "degenerate"});
}

TEST(BadMesh, CellsThatAreThereTwice) {
  const std::string text = std::string(sixteen_nodes) + first_cell +
                           "702,102,103,104,101,106,107,108,105\n703,101,102,103,104,105,106,107,108\n";
  expect_in(refused(from_text(text)), {"cell 703", "cell 701", "cell 702", "two cells at the most"});
}

TEST(BadMesh, TetrahedraByTheirNumberInTheFile) {
  const std::string text =
      std::string(sixteen_nodes) + "*ELEMENT, TYPE=C3D4\n801,101,102,104,105\n802,103,102,104,107\n";
  expect_in(refused(from_text(text)), {"cell 802 (tetrahedron)", "inverted"});
}

/// What a set leaves out a support would not hold.
TEST(BadMesh, SetsHoldOnlyWhatIsInTheFile) {
  const std::string mesh = std::string(sixteen_nodes) + first_cell;
  expect_in(refused(from_text(mesh + "*ELSET, ELSET=foot\n701, 702\n")),
            {".inp:21: error", "element 702", "not defined"});
  expect_in(refused(from_text(mesh + "*NSET, NSET=foot\n101, feet\n")), {".inp:21: error", "feet", "no set"});
  expect_in(refused(from_text(mesh + "701,109,110,111,112,113,114,115,116\n")),
            {".inp:20: error", "element 701", "another element"});
}

TEST(BadMesh, ASetOfNodesMayBeThatOfElements) {
  StructureSpec s = from_text(std::string(sixteen_nodes) + first_cell +
                              "702,109,110,111,112,113,114,115,116\n*ELSET, ELSET=second\n702\n"
                              "*NSET, NSET=foot, ELSET=second\n");
  s.supports.push_back({"", "foot", {}, {true, true, true}});
  EXPECT_EQ(refused(s), "accepted");
}

// A tetrahedron is cut at midpoints that a hexahedron on the same face or edge does not have: they would hang
// free between its corners.
TEST(BadMesh, TetrahedraOnHexahedra) {
  const std::string text =
      std::string(sixteen_nodes) + first_cell + "*NODE\n117,0.5,0.5,2\n118,1.5,-1,2\n*ELEMENT, TYPE=C3D4\n";
  expect_in(refused(from_text(text + "801,105,106,107,117\n802,105,107,108,117\n")),
            {"cell 801 (tetrahedron) and cell 701 (hexahedron) meet in 3 nodes", "2 tetrahedra", "midpoints",
             "hexahedra alone or tetrahedra alone"});
  expect_in(refused(from_text(text + "801,105,106,118,117\n")), {"meet in 2 nodes"});
  EXPECT_EQ(refused(from_text(text + "801,109,110,112,113\n")), "accepted");  // each in its own part
}

TEST(BadMesh, ANodeThatIsGivenTwoPlaces) {
  expect_in(refused(from_text(std::string(sixteen_nodes) + "103,1,1,0.5\n" + first_cell)),
            {"node 103", ":18"});
  EXPECT_EQ(refused(from_text(std::string(sixteen_nodes) + "103,1,1,0\n" + first_cell)), "accepted");
}

TEST(BadMesh, InstancesThatAreMoved) {
  const std::string part =
      std::string("*PART, NAME=P\n") + sixteen_nodes + first_cell + "*END PART\n*INSTANCE, NAME=I, PART=P\n";
  expect_in(refused(from_text(part + "0, 0, 5\n*END INSTANCE\n")), {"0, 0, 5", "moved"});
  EXPECT_EQ(refused(from_text(part + "0, 0, 0\n*END INSTANCE\n")), "accepted");
}

TEST(BadMesh, NodesThatStandElsewhereThanTheirLinesSay) {
  const std::string cells = first_cell;
  expect_in(refused(from_text(std::string("*SYSTEM\n0, 0, 5, 0, 1, 5\n") + sixteen_nodes + cells)),
            {"0, 0, 5, 0, 1, 5", "*SYSTEM"});
  std::string round = sixteen_nodes;
  round.insert(round.find('\n'), ", SYSTEM=C");
  expect_in(refused(from_text(round + cells)), {"SYSTEM=C", "Cartesian"});
  EXPECT_EQ(refused(from_text(round.replace(round.find("=C"), 2, "=R") + cells)), "accepted");
  for (const std::string line : {"*NMAP, NSET=N\n1, 2.0\n", "*NCOPY, CHANGE NUMBER=100, OLD SET=N\n",
                                 "*ELGEN\n701, 5, 1, 1\n", "*ELEMENT, TYPE=C3D8, INPUT=cells.inp\n"})
    expect_in(refused(from_text(sixteen_nodes + cells + line)),
              {line.substr(0, line.find('\n')).c_str(), "each element with its line"});
}

/// An element that is a node short would take the number of the next one, which then is no more.
TEST(BadMesh, ElementsHaveTheNodesOfTheirType) {
  const std::string second = "702,109,110,111,112,113,114,115,116\n",
                    text = std::string(sixteen_nodes) + first_cell;
  EXPECT_EQ(refused(from_text(text + "702,109,110,111,112,\n113,114,115,116\n")), "accepted");
  expect_in(refused(from_text(text + "702,109,110,111,112,113,114,115\n" + second)),
            {"702,109,110,111,112,113,114,115: 7 nodes", "C3D8 has 8"});
  expect_in(refused(from_text(text + "702,109,110,111,112,113,114,115,116,117\n")),
            {"9 nodes", "C3D8 has 8"});
}

TEST(BadMesh, LinesAndSurfacesAreSaidToCarryNothing) {
  const FemStructure body(
      from_text(std::string(sixteen_nodes) + first_cell +
                "*ELEMENT, TYPE=B31\n901,101,102\n902,102,103\n*ELEMENT, TYPE=S4\n903,101,102,103,104\n"),
      Vec3(0, 0, -9.81), silent);
  expect_in(body.plan(), {"2 B31, 1 S4", "carry nothing"});
}

// A second cube that shares no node with the first, its nodes not at the lowest level: nothing holds it.
// Moved down to it, both stand.
TEST(BadMesh, PartsThatNothingHolds) {
  std::string text = std::string(sixteen_nodes) + first_cell + "702,109,110,111,112,113,114,115,116\n";
  EXPECT_EQ(refused(from_text(text)), "accepted");
  for (const char* low : {"109,3,0,0", "110,4,0,0", "111,4,1,0", "112,3,1,0"})
    text.replace(text.find(low) + 8, 1, "0.5");
  expect_in(refused(from_text(text)), {"support", "1 cells", "cell 702", "shares no node"});
  StructureSpec s = from_text(text);
  s.gravity_preload = false;  // it would fall through the other, whatever begins the run
  expect_in(refused(s),
            {"support", "1 cells", "cell 702", "do not meet in contact", "a structure of its own"});
}

// Cells that share an edge or a corner with what is held turn about it; one more face in common holds them.
TEST(BadMesh, CellsThatHangByAnEdgeOrACorner) {
  const std::string text = std::string(sixteen_nodes) +
                           "117,2,1,0\n118,2,2,0\n119,1,2,0\n120,2,1,1\n121,2,2,1\n122,1,2,1\n" +
                           "123,1,1,2\n124,2,1,2\n125,2,2,2\n126,1,2,2\n127,2,0,0\n128,2,0,1\n" + first_cell;
  const auto held_below_the_first = [](StructureSpec s) {
    s.supports[0] = {"", "", Box3(Vec3(0, 0, 0), Vec3(1, 1, 0)), {true, true, true}};
    return s;
  };
  StructureSpec s = held_below_the_first(from_text(text + "702,103,117,118,119,107,120,121,122\n"));
  expect_in(refused(s), {"support", "1 cells", "cell 702", "no face", "turn about an axis along [0, 0, 1]"});
  s.gravity_preload = false;  // it may turn then, and does so by any angle
  EXPECT_EQ(refused(s), "accepted");
  expect_in(refused(held_below_the_first(from_text(text + "702,107,120,121,122,123,124,125,126\n"))),
            {"1 cells", "cell 702", "no face", "turn about an axis"});
  EXPECT_EQ(refused(held_below_the_first(from_text(text + "702,103,117,118,119,107,120,121,122\n" +
                                                   "703,102,127,117,103,106,128,120,107\n"))),
            "accepted");
}

// Held along a line it turns about it, in a point about any axis, on rollers it moves along them; what swings
// without preload is free to.
TEST(BadMesh, SupportsThatLeaveAMotion) {
  StructureSpec s = from_text(std::string(sixteen_nodes) + first_cell);
  s.supports[0] = {"", "", Box3(Vec3(0, 0, 0), Vec3(1, 0, 0)), {true, true, true}};
  expect_in(refused(s), {"turn about an axis along [1, 0, 0]"});
  s.supports[0].region = Box3(Vec3(0, 0, 0), Vec3(0, 0, 0));
  expect_in(refused(s), {"turn about an axis"});
  s.supports[0] = {"-z", "", {}, {false, true, true}};
  expect_in(refused(s), {"move along [1, 0, 0]"});
  s.gravity_preload = false;
  EXPECT_EQ(refused(s), "accepted");
  s.damping_ratio = 0.02;
  expect_in(refused(s), {"move along [1, 0, 0]", "damping_ratio"});
}

// Two cells on one face are neighbours only if they lie on either side of it.
TEST(BadMesh, ACellThatIsThereTwice) {
  const std::string text = std::string(sixteen_nodes) + first_cell;
  expect_in(refused(from_text(text + "702,101,102,103,104,105,106,107,108\n")),
            {"cell 702", "the nodes of cell 701", "once"});
  expect_in(refused(from_text(text + "702,102,103,104,101,106,107,108,105\n")),
            {"cell 702", "the nodes of cell 701"});  // counted from another corner
  const std::string taller = "*NODE\n117,0,0,2\n118,1,0,2\n119,1,1,2\n120,0,1,2\n";
  expect_in(refused(from_text(text + taller + "*ELEMENT, TYPE=C3D8\n702,101,102,103,104,117,118,119,120\n")),
            {"cell 702", "same side of a face as cell 701"});
  EXPECT_EQ(refused(from_text(text + taller + "*ELEMENT, TYPE=C3D8\n702,105,106,107,108,117,118,119,120\n")),
            "accepted");
}

// Parts that lie in one another without a common node are told of, whichever comes first; parts that only
// touch are not.
TEST(BadMesh, CellsThatOverlapWithoutACommonNode) {
  const auto said = [](const std::string& low, const std::string& high) {
    std::string text = std::string(sixteen_nodes) + first_cell + "702,109,110,111,112,113,114,115,116\n";
    for (const char* x : {"109,3,", "112,3,", "113,3,", "116,3,"}) text.replace(text.find(x) + 4, 1, low);
    for (const char* x : {"110,4,", "111,4,", "114,4,", "115,4,"}) text.replace(text.find(x) + 4, 1, high);
    std::string all;
    FemStructure body(from_text(text), Vec3(0, 0, -9.81),
                      [&](const std::string& line) { all += line + "\n"; });
    return all;
  };
  expect_in(said("0.5", "1.5"), {"warning: ", "cell 701", "cell 702", "overlap"});
  expect_in(said("-9", "9"), {"warning: ", "overlap"});
  EXPECT_EQ(said("1", "2").find("overlap"), std::string::npos);
}

/// A cell of 4 m over one of 160 of 0.1 m: meshes of so different cells were not searched.
TEST(BadMesh, ALargeCellOverManySmallOnes) {
  constexpr int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  std::string nodes, cells;
  int node = 0, cell = 0;
  const auto add = [&](const Vec3& low, double size) {
    cells += fmt::format("{}", ++cell);
    for (const auto& c : corner) {
      const Vec3 x = low + size * Vec3(c[0], c[1], c[2]);
      nodes += fmt::format("{},{},{},{}\n", ++node, x.x(), x.y(), x.z());
      cells += fmt::format(",{}", node);
    }
    cells += "\n";
  };
  for (int k = 0; k < 160; ++k) add(Vec3(0.2 * k, 0, 0), 0.1);
  add(Vec3(31.75, -2, 0), 4);
  StructureSpec spec = from_text("*NODE\n" + nodes + "*ELEMENT, TYPE=C3D8\n" + cells);
  std::string all;
  FemStructure body(spec, Vec3::Zero(), [&](const std::string& line) { all += line + "\n"; });
  expect_in(all, {"warning: ", "cell 160", "cell 161", "overlap"});
}

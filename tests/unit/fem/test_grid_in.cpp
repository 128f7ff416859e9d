// Meshes that deal.II's GridIn reads.
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_out.h>
#include <deal.II/grid/tria.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>

#include "core/error.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using talus::fem::test::silent;

namespace {

StructureSpec from_grid_file(const std::string& name) {
  StructureSpec s;
  s.name = "pier", s.kind = "mesh", s.file = std::string(TALUS_BINARY_DIR) + "/" + name;
  s.young = 33.55e9, s.poisson = 0.2, s.density = 2450, s.gravity_preload = false;
  return s;
}

}  // namespace

TEST(GridIn, ReadsVtkWithItsBoundaries) {
  StructureSpec s = from_grid_file("grid_in.vtk");
  {
    dealii::Triangulation<3> grid;
    dealii::GridGenerator::subdivided_hyper_rectangle(grid, {2, 2, 6}, dealii::Point<3>(0, 0, 0),
                                                      dealii::Point<3>(1, 1, 6), true);
    std::ofstream out(s.file);
    dealii::GridOut().write_vtk(grid, out);
  }
  s.position = Vec3(10, 0, 5);
  s.supports.push_back({"", "boundary 4", {}, {true, true, true}});  // colorize: z = 0
  const FemStructure pier(s, Vec3::Zero(), silent);
  EXPECT_EQ(pier.elements(), 24);
  double volume = 0;
  for (const double v : cell_volumes(pier.mesh())) volume += v;
  EXPECT_NEAR(volume, 6, 1e-12);
  int held = 0;
  for (int n = 0; n < static_cast<int>(pier.mesh().nodes.size()); ++n) {
    const Vec3 x = pier.skin().node_position(n);
    EXPECT_GE(x.x(), 10 - 1e-12);
    const bool foot = std::abs(x.z() - 5) < 1e-12;
    EXPECT_EQ(pier.skin().node_held(n)[2], foot);
    held += foot ? 1 : 0;
  }
  EXPECT_EQ(held, 9);
}

namespace {
/// Two cubes, one on the other, as a universal file; numbers with an exponent of C or of Fortran.
void write_unv(const StructureSpec& s, const char* exponent) {
  std::ofstream out(s.file);
  out << "    -1\n  2411\n";
  for (int k = 0; k < 12; ++k) {
    out << k + 1 << " 1 1 11\n";
    for (const int x : {int{k % 4 == 1 || k % 4 == 2}, int{k % 4 > 1}, k / 4})
      out << x << ".0000000000000000" << exponent << "+00 ";
    out << '\n';
  }
  out << "    -1\n    -1\n  2412\n";
  for (int c = 0; c < 2; ++c) {
    out << c + 1 << " 115 1 1 7 8\n";
    for (int a = 0; a < 8; ++a) out << 4 * c + a + 1 << ' ';
    out << '\n';
  }
  out << "    -1\n";
}
}  // namespace

TEST(GridIn, ReadsUnv) {
  const StructureSpec s = from_grid_file("grid_in.unv");
  for (const char* exponent : {"E", "D"}) {
    write_unv(s, exponent);
    const HexMesh mesh = make_mesh(s);
    ASSERT_EQ(mesh.hexes.size(), 2u) << exponent;
    double volume = 0;
    for (const double v : cell_volumes(mesh)) volume += v;
    EXPECT_NEAR(volume, 2, 1e-12);
  }
  std::filesystem::resize_file(s.file, std::filesystem::file_size(s.file) - 30);
  try {
    make_mesh(s);
    ADD_FAILURE();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("cut short"), std::string::npos) << e.what();
    EXPECT_LT(std::string(e.what()).size(), 400u) << e.what();
  }
}

/// A cell with a node that is not there names its line: GridIn would follow it out of its memory, or take the
/// first node.
TEST(GridIn, NodesOfCellsAreInTheFile) {
  StructureSpec s = from_grid_file("grid_in_nodes.unv");
  write_unv(s, "E");
  std::string unv;
  std::getline(std::ifstream(s.file), unv, '\0');
  const std::string vtk =
      "# vtk DataFile Version 3.0\npier\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n0 0 0 1 0 0 1 1 "
      "0 "
      "0 1 0\n0 0 1 1 0 1 1 1 1 0 1 1\nCELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n";
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string cell = "5 6 7 8 9 10 11 12";
  for (const auto& [name, text, line] :
       {std::tuple{"grid_in_nodes.vtk", with(vtk, "6 7\n", "6 8\n"), ":9:"},
        {"grid_in_nodes.vtk", with(vtk, "6 7\n", "6 99999999\n"), ":9:"},
        {"grid_in_nodes.vtk", with(vtk, "6 7\n", "-6 7\n"), ":9:"},
        {"grid_in_nodes.unv", with(unv, cell, "5 6 7 8 9 10 11 888"), ":33:"}}) {
    s.file = std::string(TALUS_BINARY_DIR) + "/" + name;
    std::ofstream(s.file) << text;
    try {
      make_mesh(s);
      ADD_FAILURE() << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(name + std::string(line)), std::string::npos) << e.what();
    }
  }
  std::ofstream(s.file) << unv;
  EXPECT_EQ(make_mesh(s).hexes.size(), 2u);
}

/// What is no mesh of hexahedra is an error that names the file and the way out.
TEST(GridIn, SaysWhatItDoesNotRead) {
  for (const char* text :
       {"", "# vtk DataFile Version 3.0\npier\nASCII\nDATASET POLYDATA\n",
        "# vtk DataFile Version 3.0\npier\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n0 0 0 1 0\n"}) {
    StructureSpec s = from_grid_file("no_grid.vtk");
    std::ofstream(s.file) << text;
    try {
      make_mesh(s);
      ADD_FAILURE() << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("no_grid.vtk"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(".msh"), std::string::npos) << e.what();
    }
  }
  StructureSpec s = from_grid_file("not_there.unv");
  EXPECT_THROW(make_mesh(s), InputError);
}

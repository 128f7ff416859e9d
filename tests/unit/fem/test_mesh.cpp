// Meshes by generation with zones of finer cells, and from files that the Gmsh API writes.
#include <gtest/gtest.h>

#include <gmsh.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/solid_mesh.hpp"
#include "fem/discretisation/discretisation.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/kernels/element_operator.hpp"
#include "fem/linear/linear_system.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

/// A bar 2 x 1 x 1 m by Gmsh, its ends the groups "left" and "right"; written in every format that is read.
std::vector<std::string> gmsh_bar(bool hexahedra) {
  gmsh::initialize();
  gmsh::option::setNumber("General.Terminal", 0);
  gmsh::model::add("bar");
  gmsh::model::occ::addBox(0, 0, 0, 2, 1, 1);
  gmsh::model::occ::synchronize();
  std::vector<std::pair<int, int>> faces;
  gmsh::model::getEntities(faces, 2);
  for (const auto& [dimension, tag] : faces) {
    double x, y, z;
    gmsh::model::occ::getCenterOfMass(dimension, tag, x, y, z);
    if (x < 1e-9) gmsh::model::setPhysicalName(2, gmsh::model::addPhysicalGroup(2, {tag}), "left");
    if (x > 2 - 1e-9) gmsh::model::setPhysicalName(2, gmsh::model::addPhysicalGroup(2, {tag}), "right");
  }
  gmsh::model::setPhysicalName(3, gmsh::model::addPhysicalGroup(3, {1}), "body");
  gmsh::option::setNumber("Mesh.MeshSizeMin", 0.4);
  gmsh::option::setNumber("Mesh.MeshSizeMax", 0.4);
  if (hexahedra) {
    std::vector<std::pair<int, int>> lines;
    gmsh::model::getEntities(lines, 1);
    for (const auto& [dimension, tag] : lines) {
      double x0, y0, z0, x1, y1, z1;
      gmsh::model::getBoundingBox(dimension, tag, x0, y0, z0, x1, y1, z1);
      gmsh::model::mesh::setTransfiniteCurve(tag, x1 - x0 > 1.5 ? 9 : 5);
    }
    for (const auto& face : faces)
      gmsh::model::mesh::setTransfiniteSurface(face.second), gmsh::model::mesh::setRecombine(2, face.second);
    gmsh::model::mesh::setTransfiniteVolume(1);
  }
  gmsh::model::mesh::generate(3);
  std::vector<std::string> files;
  for (const auto& [version, name] :
       {std::pair(4.1, "41.msh"), std::pair(2.2, "22.msh"), std::pair(0.0, "abaqus.inp")}) {
    if (version > 0) gmsh::option::setNumber("Mesh.MshFileVersion", version);
    files.push_back(std::string(TALUS_BINARY_DIR) + (hexahedra ? "/gmsh_hexahedra_" : "/gmsh_tetrahedra_") +
                    name);
    gmsh::write(files.back());
  }
  gmsh::finalize();
  return files;
}

StructureSpec from_file(const std::string& file) {
  StructureSpec s;
  s.name = "bar";
  s.kind = "mesh";
  s.file = file;
  s.young = 30e9;
  s.poisson = 0;
  s.density = 2500;
  s.supports.push_back({"", "left", {}, {true, true, true}});
  s.gravity_preload = true;
  s.probes.push_back({"end", Vec3(2, 0.5, 0.5)});
  return s;
}

}  // namespace

TEST(MeshFile, GmshBarsHangFromTheirGroup) {
  for (bool hexahedra : {true, false})
    for (const std::string& file : gmsh_bar(hexahedra)) {
      const FemStructure bar(from_file(file), Vec3(10, 0, 0), silent);
      double volume = 0;
      for (double v : cell_volumes(bar.mesh())) volume += v;
      EXPECT_NEAR(volume, 2, 1e-12) << file;
      if (hexahedra) { EXPECT_EQ(bar.mesh().hexes.size(), 4u * 4 * 8) << file; }
      for (int n : bar.mesh().node_groups.at("left")) EXPECT_NEAR(bar.mesh().nodes[n].x(), 0, 1e-12) << file;
      EXPECT_GE(bar.mesh().node_groups.at("right").size(), 9u) << file;
      EXPECT_NEAR(bar.loads().base_force().x(), 2500 * 2 * 10, 1e-6) << file;
      // Pulled by its own weight: u = rho g L^2 / (2 E) at the free end. The nodes of linear bars are exact.
      EXPECT_NEAR(bar.skin().probe_displacements()[0].x(), 2500 * 10 * 4 / (2 * 30e9),
                  (hexahedra ? 1e-9 : 0.01) * 2500 * 10 * 4 / (2 * 30e9))
          << file;
    }
}

TEST(MeshFile, ConvertedIsTheSameMesh) {
  for (bool hexahedra : {true, false})
    for (const std::string& file : gmsh_bar(hexahedra)) {
      const SolidMesh mesh = read_solid_mesh(file);
      double volume = 0;
      for (const auto& [a, b, c] : outer_triangles(mesh))
        volume += mesh.nodes[a].cross(mesh.nodes[b]).dot(mesh.nodes[c]) / 6;
      EXPECT_NEAR(volume, 2, 1e-12) << file;
      for (const char* ending : {".converted.msh", ".converted.inp"}) {
        const std::string converted = file + ending;
        std::ofstream(converted) << solid_mesh_text(converted, mesh);
        const SolidMesh again = read_solid_mesh(converted);
        EXPECT_TRUE(again.nodes == mesh.nodes) << converted;  // to the last bit
        EXPECT_TRUE(again.hexes == mesh.hexes) << converted;
        EXPECT_TRUE(again.tets == mesh.tets) << converted;
        for (const auto& [name, nodes] : mesh.groups) {
          EXPECT_TRUE(again.groups.contains(name) && again.groups.at(name) == nodes)
              << converted << ": " << name;
        }
      }
      // Gmsh itself reads what is written for it.
      gmsh::initialize();
      gmsh::option::setNumber("General.Terminal", 0);
      gmsh::open(file + ".converted.msh");
      std::vector<std::size_t> cells, nodes;
      gmsh::model::mesh::getElementsByType(hexahedra ? 5 : 4, cells, nodes);
      EXPECT_EQ(cells.size(), hexahedra ? mesh.hexes.size() : mesh.tets.size()) << file;
      std::vector<std::pair<int, int>> groups;
      gmsh::model::getPhysicalGroups(groups, 0);
      EXPECT_EQ(groups.size(), mesh.groups.size()) << file;
      gmsh::finalize();
    }
  SolidMesh named;
  named.groups["left end"] = {};
  EXPECT_THROW(solid_mesh_text("a.inp", named), InputError);
  EXPECT_NO_THROW(solid_mesh_text("a.msh", named));
}

TEST(Lattice, PlanesCrowdInAZoneAndWidenOutside) {
  const std::vector<double> lines = graded_lines({0, 10}, 0.5, {{4, 5, 0.1}});
  EXPECT_EQ(lines.front(), 0);
  EXPECT_EQ(lines.back(), 10);
  double before = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const double size = lines[i] - lines[i - 1], middle = 0.5 * (lines[i] + lines[i - 1]);
    EXPECT_LT(size, 0.5 * (1 + 1e-9));
    if (middle > 4 && middle < 5) { EXPECT_NEAR(size, 0.1, 1e-9); }
    if (before > 0) { EXPECT_LT(std::max(size / before, before / size), 1.5) << lines[i]; }
    before = size;
  }
  EXPECT_LT(lines.size(), 45u);  // 100 cells if all were fine
  EXPECT_EQ(graded_lines({0, 1, 3}, 0.5, {}).size(), 7u);
}

TEST(Lattice, RefinedColumnKeepsItsVolumeAndTurnsWithItsAxes) {
  StructureSpec s = cantilever(2, 16);
  s.cells = {0, 0, 0};
  s.cell_size = 0.75;
  s.rotation = Eigen::AngleAxisd(0.5 * M_PI, Vec3::UnitY()).toRotationMatrix();  // its axis along +x
  s.refinements.push_back({Box3(Vec3(5, -0.5, 0.2), Vec3(6, 0.5, 0.75)), 0.1});
  const HexMesh mesh = make_mesh(s);
  double volume = 0;
  for (double v : cell_volumes(mesh)) volume += v;
  EXPECT_NEAR(volume, 27, 1e-11);
  double finest = 1, coarsest = 0;
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    Vec3 low = mesh.nodes[mesh.hexes[cell][0]], high = low, centre = Vec3::Zero();
    for (int n : mesh.hexes[cell])
      low = low.cwiseMin(mesh.nodes[n]), high = high.cwiseMax(mesh.nodes[n]), centre += mesh.nodes[n] / 8;
    coarsest = std::max(coarsest, (high - low).maxCoeff());
    const bool inside =
        centre.x() > 5 && centre.x() < 6 && centre.y() > -0.5 && centre.y() < 0.5 && centre.z() > 0.2;
    if (!inside) continue;
    finest = std::min(finest, (high - low).minCoeff());
    EXPECT_LT((high - low).maxCoeff(), 0.101);
  }
  EXPECT_GT(finest, 0.08);
  EXPECT_GT(coarsest, 0.6);
  s.refinements[0].region.translate(Vec3(100, 0, 0));
  EXPECT_THROW(make_mesh(s), InputError);
}

// The number of cells is told before any is made, so that zones too fine are refused at once.
TEST(Lattice, ZonesThatAreTooFineAreRefused) {
  const std::vector<Box3> boxes{Box3(Vec3(0, 0, 0), Vec3(1, 1, 4)), Box3(Vec3(-1, 0, 4), Vec3(3, 1, 5))};
  const std::vector<StructureSpec::Refinement> zones{{Box3(Vec3(0, 0, 2), Vec3(1, 1, 3)), 0.1}};
  EXPECT_EQ(brick_count(boxes, 0.5, zones), static_cast<double>(bricks(boxes, 0.5, zones).hexes.size()));
  StructureSpec s = cantilever(2, 16);
  s.cells = {0, 0, 0};
  s.cell_size = 0.5;
  for (const char* section : {"rectangular", "round", "hollow"})
    for (const double size : {3e-3, 1e-6, 1e-200}) {
      s.section = section;
      s.wall_thickness = s.section == "hollow" ? 0.3 : 0;
      s.refinements = {{Box3(Vec3(-1, -1, 0), Vec3(1, 1, 12)), 0.25},
                       {Box3(Vec3(-1, -1, 5), Vec3(1, 1, 12)), size}};
      try {
        make_mesh(s);
        ADD_FAILURE() << section << ' ' << size;
      } catch (const InputError& e) {
        EXPECT_NE(std::string(e.what()).find("structure.pier.refine.1.cell_size"), std::string::npos)
            << e.what();
      }
    }
}

TEST(Lattice, RoundPiersOfAViaductAreRefinedWhereTheyMeetAZone) {
  StructureSpec s;
  s.name = "V";
  s.kind = "viaduct";
  s.section = "round";
  s.cell_size = 0.6;
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.parameters = {
      {"spans", 2}, {"span_length", 12}, {"pier_height", 6}, {"pier_diameter", 1.2}, {"abutments", 1}};
  const auto volume_of = [](const HexMesh& mesh) {
    double sum = 0;
    for (double v : cell_volumes(mesh)) sum += v;
    return sum;
  };
  const HexMesh coarse = make_mesh(s);
  Vec3 foot = Vec3::Zero();  // of the pier: the lowest nodes
  int count = 0;
  for (const Vec3& x : coarse.nodes)
    if (x.z() < 1e-9) foot += x, ++count;
  ASSERT_GT(count, 0);
  foot /= count;
  const Box3 zone(foot + Vec3(-0.7, -0.7, 2), foot + Vec3(0.7, 0.7, 3));
  s.refinements.push_back({zone, 0.2});
  const HexMesh fine = make_mesh(s);
  EXPECT_NEAR(volume_of(fine), volume_of(coarse),
              1e-9 * volume_of(coarse));  // the polygon keeps the circle's area
  double highest = 0, far = 0;            // cells' heights in the zone, and well above it
  for (int cell = 0; cell < static_cast<int>(fine.hexes.size()); ++cell) {
    const auto& hex = fine.hexes[cell];
    const double low = fine.nodes[hex[0]].z(), height = fine.nodes[hex[4]].z() - low;
    if (low > 2 - 1e-9 && low + height < 3 + 1e-9 && (fine.nodes[hex[0]] - foot).head<2>().norm() < 0.7)
      highest = std::max(highest, height);
    if (low > 4.5 && low < 5.5) far = std::max(far, height);
  }
  EXPECT_GT(highest, 0.1);
  EXPECT_LT(highest, 0.201);
  EXPECT_GT(far, 0.4);
}

TEST(Multigrid, AgreesWithTheFactor) {
  // Gravity along x on a pier with a shaft held in all directions: both solvers of the preload.
  StructureSpec s = cantilever(5, 40);
  Discretisation cells(make_mesh(s));
  std::vector<std::array<bool, 3>> held(cells.mesh().nodes.size());
  for (std::size_t n = 0; n < held.size(); ++n) held[n].fill(!(cells.mesh().nodes[n].z() > 1e-9));
  cells.hold(held);
  const DofMap dofs = cells.free_dofs();
  std::vector<double> b(dofs.size), x(dofs.size), y(dofs.size);
  for (const auto& number : dofs.number)
    if (number[0] >= 0) b[number[0]] = 1e3, b[number[2]] = -2e3;
  CholeskyFactor(assemble_stiffness(cells.mesh(), dofs, 14e9, 18e9), 0, {}).solve(b.data(), x.data());
  ElementOperator elements(cells.mesh(), 14e9, 18e9, false);
  const int iterations = make_multigrid(cells, dofs, elements, {})->solve(b.data(), y.data(), 1e-10);
  EXPECT_LT(iterations, 60);
  double difference = 0, scale = 0;
  for (int d = 0; d < dofs.size; ++d) difference += (x[d] - y[d]) * (x[d] - y[d]), scale += x[d] * x[d];
  EXPECT_LT(std::sqrt(difference / scale), 1e-7);
}

TEST(ClosedSurface, PartThatTouchesItselfAlongAnEdgeIsClosedEverywhere) {
  StructureSpec s;
  s.kind = "box";
  s.size = Vec3(2, 2, 2);
  s.cells = {2, 2, 2};
  const HexMesh mesh = test::active_cells(s);
  // Two cells below that meet along the middle edge alone, all four above: six cells in one piece.
  std::vector<char> live(8, 0);
  for (int cell = 0; cell < 8; ++cell) {
    Vec3 centre = Vec3::Zero();
    for (int n : mesh.hexes[cell]) centre += mesh.nodes[n] / 8;
    live[cell] = centre.z() > 0 || centre.x() * centre.y() > 0;
  }
  const std::vector<SkinQuad> quads = skin(mesh, live);
  const ClosedSurface surface = close_surface(quads);
  std::map<std::pair<int, int>, int> runs;  // how often each edge is run through, by direction
  for (const auto& q : surface.quad)
    for (int k = 0; k < 4; ++k) ++runs[{q[k], q[(k + 1) % 4]}];
  for (const auto& [edge, count] : runs) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(runs.count({edge.second, edge.first}), 1u);
  }
  std::set<int> nodes(surface.node.begin(), surface.node.end());
  EXPECT_EQ(surface.node.size(),
            nodes.size() + 1);  // the lower node of the edge is there twice; the upper one joins all sheets
  double volume = 0;
  for (const auto& q : surface.quad) {
    const auto x = [&](int k) { return mesh.nodes[surface.node[q[k]]]; };
    volume += (x(0).dot(x(1).cross(x(2))) + x(0).dot(x(2).cross(x(3)))) / 6;
  }
  EXPECT_NEAR(volume, 6, 1e-12);
}

// Pieces that come off: planar faces again, and few of them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "contact/geometry/polyhedron.hpp"
#include "core/error.hpp"
#include "fem/discretisation/hex_mesh.hpp"
#include "fem/fracture/piece_shape.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

struct Shape {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Skin of a box 4 x 3 x 2 m of cells of 0.5 m, without the cells whose centre `leaves` names.
template <class Leaves>
Shape box_without(Leaves&& leaves) {
  StructureSpec s;
  s.kind = "box";
  s.size = Vec3(4, 3, 2);
  s.cells = {8, 6, 4};
  const HexMesh mesh = test::active_cells(s);
  std::vector<char> live(mesh.hexes.size(), 1);
  for (std::size_t c = 0; c < live.size(); ++c) {
    Vec3 centre = Vec3::Zero();
    for (const int n : mesh.hexes[c]) centre += mesh.nodes[n] / 8;
    live[c] = leaves(centre) ? 0 : 1;
  }
  const ClosedSurface surface = close_surface(skin(mesh, live));
  Shape shape;
  for (const int n : surface.node) shape.vertices.push_back(mesh.nodes[n]);
  for (const auto& q : surface.quad) {
    shape.triangles.push_back({q[0], q[1], q[2]});
    shape.triangles.push_back({q[0], q[2], q[3]});
  }
  return shape;
}

double volume_of(const Shape& s) {
  double sum = 0;
  for (const auto& t : s.triangles) sum += s.vertices[t[0]].dot(s.vertices[t[1]].cross(s.vertices[t[2]])) / 6;
  return sum;
}

double area_of(const Shape& s) {
  double sum = 0;
  for (const auto& t : s.triangles)
    sum += 0.5 * (s.vertices[t[1]] - s.vertices[t[0]]).cross(s.vertices[t[2]] - s.vertices[t[0]]).norm();
  return sum;
}

}  // namespace

TEST(PieceShape, PlanarPartsBecomeFewTriangles) {
  Shape box = box_without([](const Vec3&) { return false; });
  merge_planar(box.vertices, box.triangles);
  EXPECT_EQ(box.vertices.size(), 8u);
  EXPECT_EQ(box.triangles.size(), 12u);
  EXPECT_NEAR(volume_of(box), 24, 1e-12);

  Shape ell = box_without([](const Vec3& x) { return x.x() > 0 && x.z() > 0; });
  merge_planar(ell.vertices, ell.triangles);
  EXPECT_EQ(ell.triangles.size(), 20u);  // an L of 12 corners
  EXPECT_NEAR(volume_of(ell), 18, 1e-12);
  EXPECT_EQ(make_polyhedron(ell.vertices, ell.triangles).faces(), 8);

  const auto through = [](const Vec3& x) { return std::abs(x.x()) < 1 && std::abs(x.y()) < 0.5; };
  Shape ring = box_without(through);
  const double before = area_of(ring);
  merge_planar(ring.vertices, ring.triangles);
  EXPECT_EQ(ring.triangles.size(), 32u);  // 16 corners, Euler's characteristic 0
  EXPECT_NEAR(volume_of(ring), 24 - 4, 1e-12);
  EXPECT_NEAR(area_of(ring), before, 1e-12 * before);
}

TEST(PieceShape, BentPiecesStaySoOnlyBeyondTheTolerance) {
  std::vector<Vec3> reference, present;
  std::vector<double> weight;
  const Eigen::AngleAxisd turn(0.3, Vec3(1, 2, 3).normalized());
  for (int i = 0; i < 40; ++i) {
    const Vec3 x(0.5 * (i % 20), i / 20, 0.1 * (i % 3));
    reference.push_back(x);
    weight.push_back(1 + i % 2);
    present.push_back(turn * (x + Vec3(0, 0, 1e-4 * (x.x() - 5) * (x.x() - 5))) +
                      Vec3(7, 8, 9));  // sags by 2.5 mm
  }
  present[19] += Vec3(0, 0, 0.2);  // a crushed corner
  const std::vector<Vec3> points = straightened(reference, present, weight, 0.02);
  for (int i = 0; i < 40; ++i) {
    if (i == 19) continue;
    EXPECT_LT((points[i] - present[i]).norm(), 3e-3);
    EXPECT_NEAR((points[i] - points[0]).norm(), (reference[i] - reference[0]).norm(), 1e-12);
  }
  EXPECT_EQ(points[19], present[19]);
  EXPECT_EQ(straightened(reference, present, weight, 1e-6),
            present);  // less than half is near: nothing moves
}

/// Two cells that meet along an edge alone, between two layers that join them at both of its ends: six faces
/// round each tunnel, one edge with four.
TEST(PieceShape, SheetsThatMeetAlongAnEdgeAndAreOneAtItsEndsArePart) {
  StructureSpec s;
  s.kind = "box";
  s.size = Vec3(2, 2, 3);
  s.cells = {2, 2, 3};
  const HexMesh mesh = test::active_cells(s);
  std::vector<char> live(mesh.hexes.size(), 1);
  for (std::size_t c = 0; c < live.size(); ++c) {
    Vec3 centre = Vec3::Zero();
    for (const int n : mesh.hexes[c]) centre += mesh.nodes[n] / 8;
    live[c] =
        std::abs(centre.z() - mesh.nodes[mesh.hexes[0][0]].z() - 1.5) > 0.6 || centre.x() * centre.y() > 0;
  }
  const std::vector<SkinQuad> quads = skin(mesh, live);
  const ClosedSurface surface = close_surface(quads);
  Shape piece;
  std::vector<int> cell;
  for (const int n : surface.node) piece.vertices.push_back(mesh.nodes[n]);
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& v = surface.quad[q];
    piece.triangles.push_back({v[0], v[1], v[2]});
    piece.triangles.push_back({v[0], v[2], v[3]});
    cell.insert(cell.end(), {quads[q].cell, quads[q].cell});
  }
  EXPECT_THROW(make_polyhedron(piece.vertices, piece.triangles), InputError);
  part_touching_edges(piece.vertices, piece.triangles, cell);
  EXPECT_NEAR(volume_of(piece), 10, 1e-12);
  merge_planar(piece.vertices, piece.triangles);
  EXPECT_NEAR(volume_of(piece), 10, 1e-12);
  EXPECT_NO_THROW(make_polyhedron(piece.vertices, piece.triangles));
}

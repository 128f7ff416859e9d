#include "fem/discretisation/hex_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/disjoint_sets.hpp"
#include "core/error.hpp"
#include "core/place.hpp"

namespace talus::fem {

const int hex_faces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                             {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};

namespace {
struct FaceKey {
  std::array<int, 4> node;  // sorted
  int cell, face;
  bool operator<(const FaceKey& o) const {
    return node != o.node ? node < o.node : std::pair(cell, face) < std::pair(o.cell, o.face);
  }
};

std::vector<FaceKey> sorted_faces(const HexMesh& mesh) {
  std::vector<FaceKey> faces;
  faces.reserve(mesh.hexes.size() * 6);
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell)
    for (int face = 0; face < 6; ++face) {
      FaceKey key{{}, cell, face};
      for (int i = 0; i < 4; ++i) key.node[i] = mesh.hexes[cell][hex_faces[face][i]];
      std::sort(key.node.begin(), key.node.end());
      faces.push_back(key);
    }
  std::sort(faces.begin(), faces.end());
  return faces;
}
}  // namespace

namespace {
/// Of a face between cells of two sizes: whether this cell is the smaller one (1), the larger one (-1), or
/// neither (0).
int smaller_side(const HexMesh& mesh, int cell, int face, int other) {
  if (mesh.hanging.empty()) return 0;
  const auto &mine = mesh.hexes[cell], &theirs = mesh.hexes[other];
  if (std::all_of(hex_faces[face], hex_faces[face] + 4,
                  [&](int k) { return std::find(theirs.begin(), theirs.end(), mine[k]) != theirs.end(); }))
    return 0;
  const auto size = [&](const std::array<int, 8>& hex) {
    return (mesh.nodes[hex[6]] - mesh.nodes[hex[0]]).squaredNorm();
  };
  return size(mine) < size(theirs) ? 1 : -1;
}
}  // namespace

std::vector<SkinQuad> skin(const HexMesh& mesh, const std::vector<char>& live) {
  std::vector<SkinQuad> quads;
  const auto there = [&](int cell) { return live.empty() || live[cell]; };
  const auto add = [&](int cell, int face, int of, bool turned) {
    SkinQuad quad{{}, of, turned ? face ^ 1 : face};
    for (int k = 0; k < 4; ++k) quad.node[k] = mesh.hexes[cell][hex_faces[face][turned ? 3 - k : k]];
    quads.push_back(quad);
  };
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell)
    for (int face = 0; face < 6; ++face) {
      const int other = mesh.across[cell][face];
      if (there(cell) && other < 0) add(cell, face, cell, false);
      if (other < 0 || there(cell) == there(other)) continue;
      const int smaller = smaller_side(mesh, cell, face, other);
      if (smaller < 0) continue;  // bared by quarters, as the smaller cells go
      if (there(cell))
        add(cell, face, cell, false);
      else if (smaller > 0)
        add(cell, face, other, true);
    }
  return quads;
}

ClosedSurface close_surface(const std::vector<SkinQuad>& quads) {
  struct Side {
    int low, high, quad, k;
  };  // edge k of a quad
  std::vector<Side> sides;
  for (int q = 0; q < static_cast<int>(quads.size()); ++q)
    for (int k = 0; k < 4; ++k) {
      const int a = quads[q].node[k], b = quads[q].node[(k + 1) % 4];
      sides.push_back({std::min(a, b), std::max(a, b), q, k});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.quad, a.k) < std::tie(b.low, b.high, b.quad, b.k);
  });
  DisjointSets corners(static_cast<int>(4 * quads.size()));
  const auto forward = [&](const Side& s) { return quads[s.quad].node[s.k] == s.low; };
  const auto join = [&](const Side& a, const Side& b) {
    const int a0 = 4 * a.quad + a.k, a1 = 4 * a.quad + (a.k + 1) % 4, b0 = 4 * b.quad + b.k,
              b1 = 4 * b.quad + (b.k + 1) % 4;
    corners.join(a0, b1);
    corners.join(a1, b0);
  };
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t j = i;
    while (j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high) ++j;
    // Quads of one cell belong together; any two that run against each other otherwise.
    std::vector<Side> open(sides.begin() + static_cast<std::ptrdiff_t>(i),
                           sides.begin() + static_cast<std::ptrdiff_t>(j));
    while (!open.empty()) {
      const Side first = open.front();
      open.erase(open.begin());
      auto mate = std::find_if(open.begin(), open.end(), [&](const Side& s) {
        return forward(s) != forward(first) && quads[s.quad].cell == quads[first.quad].cell;
      });
      if (mate == open.end())
        mate = std::find_if(open.begin(), open.end(),
                            [&](const Side& s) { return forward(s) != forward(first); });
      if (mate == open.end()) continue;
      join(first, *mate);
      open.erase(mate);
    }
    i = j;
  }
  for (int q = 0; q < static_cast<int>(quads.size()); ++q)  // of a triangle, whose last corner is there twice
    if (quads[q].node[2] == quads[q].node[3]) corners.join(4 * q + 2, 4 * q + 3);
  ClosedSurface out;
  std::vector<int> vertex(4 * quads.size(), -1);
  for (std::size_t q = 0; q < quads.size(); ++q) {
    out.quad.emplace_back();
    for (int k = 0; k < 4; ++k) {
      int& v = vertex[corners.root(static_cast<int>(4 * q) + k)];
      if (v < 0) v = static_cast<int>(out.node.size()), out.node.push_back(quads[q].node[k]);
      out.quad.back()[k] = v;
    }
  }
  return out;
}

Mat3 nearest_rotation(Mat3 m) {
  for (int i = 0; i < 50; ++i) {  // Newton's iteration
    const Mat3 next = 0.5 * (m + m.inverse().transpose());
    const double change = (next - m).norm();
    m = next;
    if (change < 1e-14) break;
  }
  return m;
}

Vec3 cell_centre(const HexMesh& mesh, int cell) {
  Vec3 centre = Vec3::Zero();
  for (const int n : mesh.hexes[cell]) centre += mesh.nodes[n] / 8;
  return centre;
}

Mat3 jacobian(const HexMesh& mesh, int cell, const Vec3& xi) {
  return TrilinearMap(mesh.nodes, mesh.hexes[cell]).jacobian(xi);
}

CellBox numbers_of(const Box3& box) {
  CellBox all;
  Eigen::Map<Vec3>(all.data()) = box.min(), Eigen::Map<Vec3>(all.data() + 3) = box.max();
  return all;
}

CellBox box_about(const std::array<Vec3, 8>& corners) {
  Box3 box;
  for (const Vec3& x : corners) box.extend(x);
  return numbers_of(box);
}

std::array<Vec3, 8> corners_of(const HexMesh& mesh, int cell) {
  std::array<Vec3, 8> corners;
  for (std::size_t a = 0; a < 8; ++a) corners[a] = mesh.nodes[mesh.hexes[cell][a]];
  return corners;
}

std::string cell_name(const HexMesh& mesh, int cell) {
  if (mesh.number.empty()) return fmt::format("cell {}", cell + 1);
  const long number = mesh.number[static_cast<std::size_t>(cell)];
  return number < 0 ? fmt::format("cell {} (tetrahedron)", -number) : fmt::format("cell {}", number);
}

namespace {

/// Problems of cells, the first twenty, each cell of a file once.
class CellProblems {
 public:
  CellProblems(const HexMesh& mesh, const std::string& key, const std::string& file)
      : mesh_(mesh), key_(key), file_(file) {}
  void add(int cell, const std::string& value, const std::string& rule, const std::string& remedy) {
    Problem p;
    p.file = file_;
    p.key = key_ + ": " + cell_name(mesh_, cell);
    p.value = value;
    p.rule = rule;
    p.remedy = remedy;
    if (problems_.size() < 20 && (problems_.empty() || problems_.back().key != p.key)) problems_.push_back(p);
  }
  void raise() const {
    if (!problems_.empty()) throw InputError(problems_);
  }

 private:
  const HexMesh& mesh_;
  const std::string& key_;
  const std::string& file_;
  std::vector<Problem> problems_;
};

constexpr int edge_ends[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                  {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

double shortest_edge(const HexMesh& mesh, int cell) {
  const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
  double least = INFINITY;
  for (const auto& [a, b] : edge_ends)
    least = std::min(least, (mesh.nodes[static_cast<std::size_t>(hex[static_cast<std::size_t>(a)])] -
                             mesh.nodes[static_cast<std::size_t>(hex[static_cast<std::size_t>(b)])])
                                .norm());
  return least;
}

}  // namespace

namespace {

/// Whether two cells see a face they share from one side: the cyclic order of its nodes, outward, is the
/// same.
bool same_side(const HexMesh& mesh, const FaceKey& a, const FaceKey& b) {
  const auto at = [&](const FaceKey& f, int k) {
    return mesh.hexes[static_cast<std::size_t>(f.cell)][static_cast<std::size_t>(hex_faces[f.face][k % 4])];
  };
  int start = 0;
  while (at(b, start) != at(a, 0)) ++start;
  return at(b, start + 1) == at(a, 1);
}

bool same_nodes(const HexMesh& mesh, int a, int b) {
  auto one = mesh.hexes[static_cast<std::size_t>(a)], other = mesh.hexes[static_cast<std::size_t>(b)];
  std::sort(one.begin(), one.end());
  std::sort(other.begin(), other.end());
  return one == other;
}

}  // namespace

void check_faces(const HexMesh& mesh, const std::string& key, const std::string& file) {
  CellProblems problems(mesh, key, file);
  const std::vector<FaceKey> faces = sorted_faces(mesh);
  for (std::size_t i = 0; i + 2 < faces.size(); ++i)
    if (faces[i].node == faces[i + 2].node)
      problems.add(
          faces[i + 2].cell,
          "the same face as " + cell_name(mesh, faces[i].cell) + " and " + cell_name(mesh, faces[i + 1].cell),
          "a face has two cells at the most",
          "remove cells that are in the mesh twice or lie in one another");
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    if (faces[i].node != faces[i + 1].node || !same_side(mesh, faces[i], faces[i + 1])) continue;
    const bool twice = same_nodes(mesh, faces[i].cell, faces[i + 1].cell);
    problems.add(
        faces[i + 1].cell,
        (twice ? "the nodes of " : "on the same side of a face as ") + cell_name(mesh, faces[i].cell),
        twice ? "a cell is in the mesh once" : "the cells of a face lie on either side of it",
        "remove cells that are in the mesh twice or lie in one another");
  }
  problems.raise();
}

bool to_be_halved(const std::array<Vec3, 8>& corners, const StructureSpec::Refinement& zone) {
  double longest = 0;
  for (const auto& [a, b] : edge_ends)
    longest = std::max(longest,
                       (corners[static_cast<std::size_t>(a)] - corners[static_cast<std::size_t>(b)]).norm());
  if (longest <= zone.cell_size * (1 + 1e-6)) return false;
  Box3 box;
  for (const Vec3& x : corners) box.extend(x);
  const Vec3 common = box.max().cwiseMin(zone.region.max()) - box.min().cwiseMax(zone.region.min());
  return (common.array() > 1e-9 * box.sizes().array()).all();
}

void check_cells(const HexMesh& mesh, const std::string& key, const std::string& file) {
  CellProblems problems(mesh, key, file);
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    std::array<int, 8> sorted = mesh.hexes[cell];
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      problems.add(cell, "", "a hexahedron needs eight different nodes",
                   "wedges and collapsed hexahedra are not supported: remesh with hexahedra or tetrahedra");
      continue;
    }
    double longest = 0;
    for (int a = 1; a < 8; ++a)
      longest = std::max(longest, (mesh.nodes[mesh.hexes[cell][a]] - mesh.nodes[mesh.hexes[cell][0]]).norm());
    if (!(shortest_edge(mesh, cell) > 1e-6 * longest)) {
      problems.add(cell, "near " + place_text(mesh.nodes[mesh.hexes[cell][0]]),
                   "two nodes of an edge lie in one place: the cell is degenerate",
                   "remesh there with hexahedra of eight corners or with tetrahedra");
      continue;
    }
    double least = INFINITY;
    const TrilinearMap map(mesh.nodes, mesh.hexes[cell]);
    for (int q = 0; q < 8; ++q) least = std::min(least, map.jacobian(gauss_point(q)).determinant());
    double corner = INFINITY;
    for (int a = 0; a < 8; ++a)
      corner = std::min(
          corner, map.jacobian(Vec3(corner_sign[a][0], corner_sign[a][1], corner_sign[a][2])).determinant());
    const double scale = longest * longest * longest / 8;
    const bool solid = least > 1e-9 * scale;
    if (solid && corner >= -1e-9 * scale) continue;
    const std::string where = fmt::format("Jacobian {:.3g} m^3 near {}", std::min(least, corner),
                                          place_text(mesh.nodes[mesh.hexes[cell][0]]));
    if (!solid)
      problems.add(cell, where, "the cell is inverted or has no volume",
                   "give the nodes in the order of the format, or repair the mesh there");
    else
      problems.add(cell, where, "the cell folds over at a corner",
                   "repair the mesh there: every corner angle must be below 180 degrees");
  }
  problems.raise();
}

std::vector<double> cell_volumes(const HexMesh& mesh) {
  std::vector<double> volume(mesh.hexes.size(), 0.0);
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    const TrilinearMap map(mesh.nodes, mesh.hexes[cell]);
    for (int q = 0; q < 8; ++q) volume[cell] += map.jacobian(gauss_point(q)).determinant();
  }
  return volume;
}

std::array<double, 8> corner_volumes(const HexMesh& mesh, int cell) {
  const TrilinearMap map(mesh.nodes, mesh.hexes[cell]);
  std::array<double, 8> share{};
  for (int q = 0; q < 8; ++q) {
    const std::array<double, 8> shape = shape_values(gauss_point(q));
    const double w = map.jacobian(gauss_point(q)).determinant();
    for (int a = 0; a < 8; ++a) share[a] += w * shape[a];
  }
  return share;
}

}  // namespace talus::fem

/// Complex of cells that fill a region, cut by planes (private to the block cutting). Here cells are convex,
/// and decisions are taken within a snapping distance; in an ExactComplex (exact_complex.hpp) they need not
/// be convex, and every decision is exact.
///
///   side of vertex v against plane (n, d):   s = n . x_v - d;
///   + if s > e,  - if s < -e,  on the plane otherwise
///
/// symbol  meaning                                          unit
/// n, d    unit normal and offset of a plane                1, m
/// e       snapping distance: closer vertices are on it     m
///
/// Vertices, edges and faces are shared by all cells around them, and an edge or face is split once for all
/// of them. So neighbours always have the same vertices on what they share: faces match across a joint
/// because they are one face, and the volumes of the cells add up to that of the region to round-off. A
/// vertex is decided against a plane once, whatever cell asks, and e is far above round-off, so that the
/// decisions of a cell never contradict each other. A face may be one of several coplanar ones of a cell,
/// where only the neighbour was cut.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/types.hpp"

namespace talus::geometry {

class CellComplex {
 public:
  struct CutPlane {
    Vec3 normal;
    double offset;  // [m]
  };
  struct Face {
    std::vector<int> loop;   // counter-clockwise seen from outside cell[0]
    int cell[2] = {-1, -1};  // the normal points from cell[0] to cell[1]; -1: outside of the complex
    int plane = -1;          // into planes()
    int mark = 0;            // the caller's: what this face is; inherited by its parts
  };
  struct Cell {
    std::vector<int> faces;
    Vec3 centre = Vec3::Zero();  // of the vertices
    double radius = 0;
    bool alive = true;
  };

  explicit CellComplex(double snap) : snap_(snap) {}
  virtual ~CellComplex() = default;
  virtual std::unique_ptr<CellComplex> clone() const { return std::make_unique<CellComplex>(*this); }

  virtual int add_vertex(const Vec3& x);
  int add_plane(const Vec3& normal, double offset);
  /// One cell from its faces: loops outward, a plane and a mark for each.
  int add_cell(const std::vector<std::vector<int>>& loops, const std::vector<int>& planes, int mark);
  /// A cell without faces, and faces of cells; `bound` when a cell has all of them.
  int add_cell();
  int add_face(Face face);
  void bound(int cell);
  /// Divides a cell whose faces are not connected through common edges; the parts, the cell itself first. A
  /// convex cell is connected.
  virtual std::vector<int> separate(int cell) { return {cell}; }

  struct Split {
    std::vector<int> caps;         // new faces; cell[0] lies on the positive side
    std::vector<int> plus, minus;  // the parts; the first positive one keeps the number of the cell
    int side = 0;                  // of a cell that is not crossed; 0: thinner than the snapping distance
    bool crossed() const { return !minus.empty(); }
  };
  Split split_cell(int cell, int plane, int mark);
  /// Splits a face within its plane along another plane. Returns the new face on the negative side, or -1.
  int split_face(int face, const CutPlane& along);
  /// Takes a cell out; its faces keep the other side.
  void remove_cell(int cell);
  /// Makes a cell part of another.
  void hand_over(int cell, int to);

  const std::vector<Vec3>& vertices() const { return x_; }
  const std::vector<Face>& faces() const { return faces_; }
  std::vector<Face>& faces() { return faces_; }
  const std::vector<Cell>& cells() const { return cells_; }
  const std::vector<CutPlane>& planes() const { return planes_; }
  double snap() const { return snap_; }

  double volume(int cell) const;
  /// Of all its faces [m^2].
  double surface(int cell) const;
  double area(int face) const;
  Vec3 centroid(int face) const;
  Vec3 area_vector(int face) const;  // along the normal out of cell[0]
  /// The other face of `cell` at the edge (a, b) beside `face`; of a cell with several wedges at that edge,
  /// the other face of the same wedge.
  virtual int neighbour_at_edge(int cell, int face, int a, int b) const;

 protected:
  static std::uint64_t key(int a, int b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<std::uint64_t>(std::max(a, b));
  }
  virtual int side(int v, const CutPlane& p) const {
    const double s = p.normal.dot(x_[v]) - p.offset;
    return s > snap_ ? 1 : s < -snap_ ? -1 : 0;
  }
  /// A new vertex where the plane crosses an edge, a < b.
  virtual int crossing(int a, int b, const CutPlane& p);
  /// Where a face of `cell` that lies in the plane belongs: on the positive side?
  virtual bool bounds_plus(int, int, const CutPlane&) const { return false; }
  /// Polygons in the plane that close the positive part of a cell, outward of it. Nothing if they do not: the
  /// cell is thinner there than the snapping distance. `on_plane`: of a vertex of the cell.
  using Sides = std::unordered_map<int, int>;
  virtual std::optional<std::vector<std::vector<int>>> close(int cell, const std::vector<int>& plus_faces,
                                                             const Sides& sides, const CutPlane& p);
  template <class Visit>
  void directed_edges(int cell, int face, Visit&& visit) const {
    const auto& loop = faces_[face].loop;
    const bool forward = faces_[face].cell[0] == cell;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const int a = loop[k], b = loop[(k + 1) % loop.size()];
      forward ? visit(a, b) : visit(b, a);
    }
  }
  void link(int face);
  void unlink(int face);
  int split_edge(int a, int b, const CutPlane& p);
  bool split_loop(int face, const std::vector<int>& sides, int& negative);

  double snap_;
  std::vector<Vec3> x_;
  std::vector<CutPlane> planes_;
  std::vector<Face> faces_;
  std::vector<Cell> cells_;
  std::unordered_map<std::uint64_t, std::vector<int>> edge_faces_;  // looked up, never walked
};

}  // namespace talus::geometry

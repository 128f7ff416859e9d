/// Cells that need not be convex, with exact points (private to the block cutting; pays for CGAL's headers).
///
///   side of vertex v against plane (n, d):   sign(n . x_v - d), exact for n and d as they are stored
///   cap of a cell in a plane: where the winding number of the border of its positive part is one
///
/// Every point is exact from the surfaces that the rock comes from to the last joint; `vertices` holds it
/// rounded once. So the faces of a block are parts of the very triangles of the ground that it was cut from,
/// however thin it tapers out, and a decision can contradict none before. What only touches itself, at an
/// edge, is divided there.
#pragma once
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <map>
#include <utility>

#include "geometry/cell_complex.hpp"

namespace talus::geometry {

using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactNumber = ExactKernel::FT;
using ExactPoint = ExactKernel::Point_3;

/// Nearest number but for the last digit; evaluates it.
double rounded(const ExactNumber& x);

/// Edges of a planar figure, each as often as it runs from the first vertex to the second, less the other
/// way.
using EdgeCounts = std::map<std::pair<int, int>, int>;
void count_edge(EdgeCounts& counts, int from, int to);

/// Triangles of where the winding number of these edges is one, with all the edges and points given.
/// `at`: the places, counter-clockwise is positive. Edges may meet at their ends alone.
std::vector<std::vector<int>> fill(const EdgeCounts& border, const std::vector<std::pair<int, int>>& inner,
                                   const std::vector<int>& points,
                                   const std::map<int, ExactKernel::Point_2>& at);

class ExactComplex final : public CellComplex {
 public:
  /// `sliver`: thinner cells are round-off of what was given [m].
  explicit ExactComplex(double sliver) : CellComplex(sliver) {}
  std::unique_ptr<CellComplex> clone() const override { return std::make_unique<ExactComplex>(*this); }

  int add_vertex(const Vec3& x) override;
  int add_point(const ExactPoint& x);
  const ExactPoint& point(int v) const { return exact_[static_cast<std::size_t>(v)]; }
  std::vector<int> separate(int cell) override;
  int neighbour_at_edge(int cell, int face, int a, int b) const override;

 protected:
  int side(int v, const CutPlane& p) const override;
  int crossing(int a, int b, const CutPlane& p) override;
  bool bounds_plus(int cell, int face, const CutPlane& p) const override;
  std::optional<std::vector<std::vector<int>>> close(int cell, const std::vector<int>& plus_faces,
                                                     const Sides& sides, const CutPlane& p) override;

 private:
  ExactNumber height(const ExactPoint& x, const CutPlane& p) const;
  /// A vertex of the face that is not in line with the edge.
  int apex(int face, int a, int b) const;
  std::pair<int, int> line_of(int a, int b) const;

  std::vector<ExactPoint> exact_;
  // Of parts of edges: the ends of the whole, so that points on it do not rest on each other.
  std::map<std::pair<int, int>, std::pair<int, int>> lines_;
};

}  // namespace talus::geometry

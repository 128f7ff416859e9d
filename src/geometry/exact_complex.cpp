#include "geometry/exact_complex.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/disjoint_sets.hpp"
#include "core/error.hpp"
#include "geometry/cut_internal.hpp"

namespace talus::geometry {
namespace {

using Point2 = ExactKernel::Point_2;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, ExactKernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<ExactKernel>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<ExactKernel,
                                               CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;

/// The axis that a plane is seen along, and the two others so that counter-clockwise about the normal is
/// counter-clockwise.
struct View {
  int u, v;
  explicit View(const Vec3& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
  }
  Point2 of(const ExactPoint& p) const { return {p[u], p[v]}; }
};

/// The loop of a border that is one convex polygon; empty if it is not. Points within a side are allowed.
std::vector<int> convex_loop(const EdgeCounts& border, const std::map<int, Point2>& at) {
  std::map<int, int> next;
  for (const auto& [edge, count] : border) {
    if (count == 0) continue;
    const auto [a, b] = count > 0 ? edge : std::pair(edge.second, edge.first);
    if (std::abs(count) != 1 || !next.emplace(a, b).second) return {};
  }
  if (next.empty()) return {};
  std::vector<int> loop;
  const int first = next.begin()->first;
  for (int v = first; loop.size() < next.size();) {
    loop.push_back(v);
    const auto it = next.find(v);
    if (it == next.end()) return {};
    v = it->second;
    if (v == first) break;
  }
  if (loop.size() != next.size() || loop.size() < 3) return {};
  // Convex, and once around: the direction turns past +u once.
  int turns = 0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Point2 &a = at.at(loop[k]), &b = at.at(loop[(k + 1) % loop.size()]),
                 &c = at.at(loop[(k + 2) % loop.size()]);
    if (CGAL::orientation(a, b, c) == CGAL::RIGHT_TURN) return {};
    turns += CGAL::compare_y(a, b) != CGAL::SMALLER && CGAL::compare_y(b, c) == CGAL::SMALLER;
  }
  return turns == 1 ? loop : std::vector<int>{};
}

}  // namespace

double rounded(const ExactNumber& x) {
  // What was given has an interval without width.
  const auto [low, high] = CGAL::to_interval(x);
  return low == high ? low : CGAL::to_double(x.exact());
}

void count_edge(EdgeCounts& counts, int from, int to) {
  const bool forward = from < to;
  counts[forward ? std::pair(from, to) : std::pair(to, from)] += forward ? 1 : -1;
}

std::vector<std::vector<int>> fill(const EdgeCounts& border, const std::vector<std::pair<int, int>>& inner,
                                   const std::vector<int>& points, const std::map<int, Point2>& at) {
  if (inner.empty() && points.empty())
    if (auto loop = convex_loop(border, at); !loop.empty()) return {std::move(loop)};
  Triangulation mesh;
  std::map<int, Triangulation::Vertex_handle> handle;
  Triangulation::Face_handle near;
  const auto insert = [&](int v) {
    const auto [it, is_new] = handle.try_emplace(v);
    if (!is_new) return;
    it->second = mesh.insert(at.at(v), near);
    it->second->info() = v;
    near = it->second->face();
  };
  for (const auto& [edge, count] : border)
    if (count != 0) insert(edge.first), insert(edge.second);
  for (const auto& [a, b] : inner) insert(a), insert(b);
  for (const int v : points) insert(v);
  try {
    for (const auto& [edge, count] : border)
      if (count != 0) mesh.insert_constraint(handle.at(edge.first), handle.at(edge.second));
    for (const auto& [a, b] : inner) mesh.insert_constraint(handle.at(a), handle.at(b));
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    throw InputError(Problem{.key = "rock_mass",
                             .rule = "its surface, or the ground that it is cut out of, crosses itself",
                             .remedy =
                                 "repair it (talus convert --repair), or give ground that has one height "
                                 "at each place"});
  }

  std::map<Triangulation::Face_handle, int> winding;
  std::vector<Triangulation::Face_handle> work{mesh.infinite_face()};
  winding[work[0]] = 0;
  std::vector<std::vector<int>> out;
  while (!work.empty()) {
    const auto f = work.back();
    work.pop_back();
    const int own = winding.at(f);
    if (!mesh.is_infinite(f) && own == 1) {
      std::vector<int> t{f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()};
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      out.push_back(std::move(t));
    }
    for (int i = 0; i < 3; ++i) {
      const auto g = f->neighbor(i);
      if (winding.count(g) > 0) continue;
      int across = 0;  // how often the border has f on its left
      if (f->is_constrained(i)) {
        const int p = f->vertex(Triangulation::ccw(i))->info(), q = f->vertex(Triangulation::cw(i))->info();
        const auto it = border.find(std::minmax(p, q));
        if (it != border.end()) across = p < q ? it->second : -it->second;
      }
      winding[g] = own - across;
      work.push_back(g);
    }
  }
  std::sort(out.begin(), out.end());  // its handles have no order of their own
  return out;
}

int ExactComplex::add_vertex(const Vec3& x) { return add_point(ExactPoint(x.x(), x.y(), x.z())); }

int ExactComplex::add_point(const ExactPoint& p) {
  const int v = CellComplex::add_vertex(Vec3(rounded(p.x()), rounded(p.y()), rounded(p.z())));
  // Evaluated at once: what is computed from it does not rest on how it was computed.
  if (CGAL::to_interval(p.x()).first != CGAL::to_interval(p.x()).second ||
      CGAL::to_interval(p.y()).first != CGAL::to_interval(p.y()).second ||
      CGAL::to_interval(p.z()).first != CGAL::to_interval(p.z()).second)
    p.exact();
  exact_.push_back(p);
  return v;
}

ExactNumber ExactComplex::height(const ExactPoint& x, const CutPlane& p) const {
  return ExactNumber(p.normal.x()) * x.x() + ExactNumber(p.normal.y()) * x.y() +
         ExactNumber(p.normal.z()) * x.z() - ExactNumber(p.offset);
}

int ExactComplex::side(int v, const CutPlane& p) const {
  const Vec3& x = vertices()[static_cast<std::size_t>(v)];
  const double s = p.normal.dot(x) - p.offset;
  // Rounding of x, of three products and of three sums.
  const double bound = 8 * std::numeric_limits<double>::epsilon() *
                       (p.normal.cwiseProduct(x).cwiseAbs().sum() + std::abs(p.offset));
  if (std::abs(s) > bound) return s > 0 ? 1 : -1;
  return static_cast<int>(CGAL::sign(height(point(v), p)));
}

std::pair<int, int> ExactComplex::line_of(int a, int b) const {
  const auto it = lines_.find(std::minmax(a, b));
  return it == lines_.end() ? std::pair(a, b) : it->second;
}

int ExactComplex::crossing(int a, int b, const CutPlane& p) {
  const std::pair<int, int> line = line_of(a, b);
  const ExactPoint &from = point(line.first), &to = point(line.second);
  const ExactNumber hf = height(from, p), t = hf / (hf - height(to, p));
  const int m = add_point(from + t * (to - from));
  lines_[std::minmax(a, m)] = line;
  lines_[std::minmax(m, b)] = line;
  return m;
}

int ExactComplex::apex(int face, int a, int b) const {
  // The farthest from the edge, of the rounded points, is beside it unless the face is thinner than these
  // say.
  const auto& loop = faces()[static_cast<std::size_t>(face)].loop;
  const auto& x = vertices();
  const Vec3 along = x[static_cast<std::size_t>(b)] - x[static_cast<std::size_t>(a)];
  std::vector<std::pair<double, int>> order;
  for (const int v : loop)
    if (v != a && v != b)
      order.emplace_back(
          -along.cross(x[static_cast<std::size_t>(v)] - x[static_cast<std::size_t>(a)]).squaredNorm(), v);
  std::sort(order.begin(), order.end());
  for (const auto& [distance, v] : order)
    if (!CGAL::collinear(point(a), point(b), point(v))) return v;
  return order.front().second;
}

bool ExactComplex::bounds_plus(int cell, int face, const CutPlane& p) const {
  const auto& f = faces()[static_cast<std::size_t>(face)];
  const int a = f.loop[0], b = f.loop[1], c = apex(face, a, b);
  const View view(p.normal);
  // The rock lies behind a face.
  const bool along =
      CGAL::orientation(view.of(point(a)), view.of(point(b)), view.of(point(c))) == CGAL::LEFT_TURN;
  return along != (f.cell[0] == cell);
}

std::optional<std::vector<std::vector<int>>> ExactComplex::close(int cell, const std::vector<int>& plus_faces,
                                                                 const Sides& sides, const CutPlane& p) {
  EdgeCounts border;
  for (const int f : plus_faces)
    directed_edges(cell, f, [&](int a, int b) {
      if (sides.at(a) == 0 && sides.at(b) == 0) count_edge(border, b, a);
    });
  const View view(-p.normal);
  std::map<int, Point2> at;
  std::vector<std::pair<int, int>> inner;  // where the cell touches the plane
  std::vector<int> loose;
  for (const int f : cells()[static_cast<std::size_t>(cell)].faces)
    directed_edges(cell, f, [&](int a, int b) {
      if (sides.at(a) != 0) return;
      if (at.try_emplace(a, view.of(point(a))).second) loose.push_back(a);
      if (sides.at(b) == 0) border.try_emplace(std::minmax(a, b), 0);
    });
  for (auto it = border.begin(); it != border.end();)
    if (it->second == 0) {
      inner.push_back(it->first);
      it = border.erase(it);
    } else {
      ++it;
    }
  if (border.empty()) return std::vector<std::vector<int>>{};
  std::set<int> met;
  for (const auto& [edge, count] : border) met.insert({edge.first, edge.second});
  for (const auto& [a, b] : inner) met.insert({a, b});
  std::erase_if(loose, [&](int v) { return met.contains(v); });
  return fill(border, inner, loose, at);
}

int ExactComplex::neighbour_at_edge(int cell, int face, int a, int b) const {
  std::vector<int> around;
  for (const int f : edge_faces_.at(key(a, b)))
    if (f != face && (faces()[static_cast<std::size_t>(f)].cell[0] == cell ||
                      faces()[static_cast<std::size_t>(f)].cell[1] == cell))
      around.push_back(f);
  if (around.size() <= 1) return around.empty() ? -1 : around[0];
  // Of a face that runs from a to b, seen from outside the cell, rock lies clockwise about that direction.
  bool forward = false;
  directed_edges(cell, face, [&](int u, int v) { forward |= u == a && v == b; });
  if (!forward) std::swap(a, b);
  const ExactPoint &o = point(a), &e = point(b), r = point(apex(face, a, b));
  const auto past_half = [&](const ExactPoint& x) {  // of the angle from r, clockwise
    const auto turn = CGAL::orientation(o, e, r, x);
    if (turn != CGAL::COPLANAR) return turn == CGAL::POSITIVE ? 2 : 0;
    const auto across = CGAL::cross_product(e - o, r - o);
    return CGAL::sign(across * CGAL::cross_product(e - o, x - o)) == CGAL::NEGATIVE ? 1 : 3;
  };
  int best = -1, best_half = 4;
  ExactPoint best_at;
  for (const int f : around) {
    bool backward = false;
    directed_edges(cell, f, [&](int u, int v) { backward |= u == b && v == a; });
    if (!backward) continue;
    const ExactPoint& x = point(apex(f, a, b));
    const int half = past_half(x);
    if (best < 0 || half < best_half ||
        (half == best_half && CGAL::orientation(o, e, best_at, x) == CGAL::POSITIVE))
      best = f, best_half = half, best_at = x;
  }
  return best;
}

std::vector<int> ExactComplex::separate(int cell) {
  const std::vector<int> own = cells_[static_cast<std::size_t>(cell)].faces;
  std::map<int, int> place;  // face -> its number here
  for (const int f : own) place.emplace(f, static_cast<int>(place.size()));
  DisjointSets parts(static_cast<int>(own.size()));
  for (const int f : own)
    directed_edges(cell, f, [&](int a, int b) {
      if (const int other = neighbour_at_edge(cell, f, a, b); other >= 0)
        parts.join(place.at(f), place.at(other));
    });
  std::map<int, std::vector<int>> of_part;
  for (std::size_t k = 0; k < own.size(); ++k) of_part[parts.root(static_cast<int>(k))].push_back(own[k]);
  if (of_part.size() == 1) return {cell};
  // A part that encloses nothing bounds a cavity of another.
  std::vector<std::vector<int>> bodies, cavities;
  for (auto& [root, faces] : of_part) {
    double six = 0, area_sum = 0;
    for (const int f : faces) {
      const auto& loop = faces_[static_cast<std::size_t>(f)].loop;
      const Vec3 a = area_vector(f) * (faces_[static_cast<std::size_t>(f)].cell[0] == cell ? 1 : -1);
      area_sum += a.norm();
      six += 2 * a.dot(x_[static_cast<std::size_t>(loop[0])] - cells_[static_cast<std::size_t>(cell)].centre);
    }
    (six / 6 < -0.5 * snap() * area_sum ? cavities : bodies).push_back(std::move(faces));
  }
  for (const auto& cavity : cavities) {
    const Vec3 inside = x_[static_cast<std::size_t>(faces_[static_cast<std::size_t>(cavity[0])].loop[0])];
    std::size_t home = 0;
    double most = -1;
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      double angle = 0;
      for (const int f : bodies[k]) {
        const auto& loop = faces_[static_cast<std::size_t>(f)].loop;
        const double sign = faces_[static_cast<std::size_t>(f)].cell[0] == cell ? 1 : -1;
        for (std::size_t i = 1; i + 1 < loop.size(); ++i)
          angle += sign * cutting::solid_angle(x_[static_cast<std::size_t>(loop[0])] - inside,
                                               x_[static_cast<std::size_t>(loop[i])] - inside,
                                               x_[static_cast<std::size_t>(loop[i + 1])] - inside);
      }
      if (angle > most) most = angle, home = k;
    }
    bodies[home].insert(bodies[home].end(), cavity.begin(), cavity.end());
  }
  std::vector<int> cells{cell};
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const int c = k == 0 ? cell : add_cell();
    if (k > 0) {
      cells.push_back(c);
      for (const int f : bodies[k])
        for (int& side : faces_[static_cast<std::size_t>(f)].cell)
          if (side == cell) side = c;
    }
    cells_[static_cast<std::size_t>(c)].faces = std::move(bodies[k]);
    bound(c);
  }
  return cells;
}

namespace cutting {
std::unique_ptr<CellComplex> exact_complex(double sliver) { return std::make_unique<ExactComplex>(sliver); }
}  // namespace cutting

}  // namespace talus::geometry

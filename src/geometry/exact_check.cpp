#include "geometry/exact_check.hpp"

#include <CGAL/Exact_rational.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/cut_internal.hpp"

namespace talus::geometry {
namespace {

using Rational = CGAL::Exact_rational;

/// A convex set in the world: a piece of a body, or a triangle.
struct Convex {
  std::vector<Vec3> x;
  std::vector<Vec3> normals;     // outward, any length
  std::vector<Vec3> directions;  // of edges
  Box3 box;
};

Convex place(const CheckedBody::Piece& piece, const Pose& pose) {
  Convex c;
  for (const Vec3& v : piece.vertices) c.x.push_back(pose.world(v)), c.box.extend(c.x.back());
  for (const auto& f : piece.faces) c.normals.push_back((c.x[f[1]] - c.x[f[0]]).cross(c.x[f[2]] - c.x[f[0]]));
  for (const auto& e : piece.edges) {
    const Vec3 d = c.x[e[1]] - c.x[e[0]];
    bool known = false;
    for (const Vec3& o : c.directions) known |= d.cross(o).norm() <= 1e-14 * d.norm() * o.norm();
    if (!known) c.directions.push_back(d);
  }
  return c;
}

Rational dot(const Vec3& n, const Vec3& x) {
  return Rational(n.x()) * Rational(x.x()) + Rational(n.y()) * Rational(x.y()) +
         Rational(n.z()) * Rational(x.z());
}

/// max_A n.x - min_B n.x <= tol |n| ?  Also gives the value in floating point, over |n|.
bool separates(const Convex& a, const Convex& b, const Vec3& n, double tolerance, double& overlap) {
  const double length = n.norm();
  double hi = -std::numeric_limits<double>::infinity(), lo = -hi, reach = 0;
  for (const Vec3& v : a.x) hi = std::max(hi, n.dot(v)), reach = std::max(reach, v.cwiseAbs().maxCoeff());
  for (const Vec3& v : b.x) lo = std::min(lo, n.dot(v)), reach = std::max(reach, v.cwiseAbs().maxCoeff());
  overlap = (hi - lo) / length;
  const double error = 16 * std::numeric_limits<double>::epsilon() * length * (reach + tolerance);
  const double excess = hi - lo - tolerance * length;
  if (excess < -error) return true;
  if (excess > error) return false;
  Rational exact_hi = dot(n, a.x[0]), exact_lo = dot(n, b.x[0]);
  for (const Vec3& v : a.x) exact_hi = std::max(exact_hi, dot(n, v));
  for (const Vec3& v : b.x) exact_lo = std::min(exact_lo, dot(n, v));
  const Rational gap = exact_hi - exact_lo, t(tolerance);
  if (gap <= Rational(0)) return true;
  return gap * gap <= t * t *
                          (Rational(n.x()) * Rational(n.x()) + Rational(n.y()) * Rational(n.y()) +
                           Rational(n.z()) * Rational(n.z()));
}

/// Least overlap of two convex sets over all candidate directions. `one_sided`: b is a triangle with solid
/// behind it, and only moves of the body that lift it off the triangle's plane count as its depth: sideways
/// the next triangle waits. A direction that proves the sets apart counts whatever it is.
Overlap least_overlap(const Convex& a, const Convex& b, double tolerance, bool one_sided = false) {
  Overlap best;
  best.intersect = true;
  best.depth = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vec3& n) {  // b moves along n
    if (!(n.squaredNorm() > 0)) return false;
    double overlap;
    const bool apart = separates(a, b, n, tolerance, overlap);
    const bool through = one_sided && n.dot(b.normals[0]) > -1e-9 * n.norm() * b.normals[0].norm();
    if (overlap < best.depth && (apart || !through)) {
      best.depth = overlap;
      best.direction = n.normalized();
    }
    if (apart) best.intersect = false;
    return apart && overlap < 0;  // no need to look further
  };
  for (const Vec3& n : a.normals)
    if (consider(n)) return best;
  for (const Vec3& n : b.normals) {
    if (consider(-n)) return best;
    if (b.normals.size() == 1 && consider(n)) return best;
  }
  for (const Vec3& d : a.directions)
    for (const Vec3& e : b.directions) {
      const Vec3 n = d.cross(e);
      if (n.norm() <= 1e-12 * d.norm() * e.norm()) continue;  // parallel: a face normal says as much
      if (consider(n) || consider(-n)) return best;
    }
  return best;
}

double winding(const Polyhedron& body, const Vec3& x) {
  double sum = 0;
  for (const auto& t : body.triangles) {
    const Vec3 a = body.vertices[t[0]] - x, b = body.vertices[t[1]] - x, c = body.vertices[t[2]] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * 3.14159265358979323846);
}

double distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  if (n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
      n.dot((a - c).cross(p - c)) >= 0 && n.squaredNorm() > 0)
    return std::abs(n.dot(p - a)) / n.norm();
  const auto segment = [&](const Vec3& u, const Vec3& v) {
    const Vec3 d = v - u;
    const double t = d.squaredNorm() > 0 ? std::clamp((p - u).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
    return (p - u - t * d).norm();
  };
  return std::min({segment(a, b), segment(b, c), segment(c, a)});
}

/// How deep the deepest vertex of a lies under the surface of b.
double vertex_depth(const Polyhedron& a, const Pose& pa, const Polyhedron& b, const Pose& pb, double least) {
  Polyhedron w;
  w.triangles = b.triangles;
  Box3 box;
  for (const Vec3& v : b.vertices) w.vertices.push_back(pb.world(v)), box.extend(w.vertices.back());
  double deepest = 0;
  for (const Vec3& v : a.vertices) {
    const Vec3 p = pa.world(v);
    if (!box.contains(p)) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& t : w.triangles)
      nearest = std::min(nearest, distance(p, w.vertices[t[0]], w.vertices[t[1]], w.vertices[t[2]]));
    if (nearest > std::max(deepest, least) && winding(w, p) > 0.5) deepest = nearest;
  }
  return deepest;
}

}  // namespace

CheckedBody::CheckedBody(const Polyhedron& body) : body_(body) {
  Box3 box;
  for (const Vec3& v : body.vertices) box.extend(v);
  CellComplex complex(1e-12 * box.diagonal().norm());
  cutting::add_convex_parts(complex, body);
  for (const auto& cell : complex.cells()) {
    if (!cell.alive) continue;
    Piece piece;
    std::map<int, int> number;
    const auto local = [&](int v) {
      const auto [it, is_new] = number.emplace(v, static_cast<int>(piece.vertices.size()));
      if (is_new) piece.vertices.push_back(complex.vertices()[v]);
      return it->second;
    };
    std::map<std::pair<int, int>, int> edges;
    for (int f : cell.faces) {
      const auto& face = complex.faces()[f];
      std::vector<int> loop;
      for (int v : face.loop) loop.push_back(local(v));
      if (&complex.cells()[face.cell[0]] != &cell) std::reverse(loop.begin(), loop.end());
      // The three corners that span the largest triangle give the best normal.
      std::array<int, 3> best{loop[0], loop[1], loop[2]};
      double area = -1;
      for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
        const double a = (piece.vertices[loop[k]] - piece.vertices[loop[0]])
                             .cross(piece.vertices[loop[k + 1]] - piece.vertices[loop[0]])
                             .norm();
        if (a > area) area = a, best = {loop[0], loop[k], loop[k + 1]};
      }
      piece.faces.push_back(best);
      for (std::size_t k = 0; k < loop.size(); ++k)
        edges[std::minmax(loop[k], loop[(k + 1) % loop.size()])] = 1;
    }
    for (const auto& [e, unused] : edges) piece.edges.push_back({e.first, e.second});
    pieces_.push_back(std::move(piece));
  }
}

Overlap deepest_intersection(const CheckedBody& a, const Pose& pa, const CheckedBody& b, const Pose& pb,
                             double tolerance) {
  Overlap deepest;
  deepest.depth = -std::numeric_limits<double>::infinity();
  std::vector<Convex> pieces_b;
  for (const auto& p : b.pieces()) pieces_b.push_back(place(p, pb));
  for (const auto& p : a.pieces()) {
    const Convex ca = place(p, pa);
    for (const Convex& cb : pieces_b) {
      if (ca.box.intersection(cb.box).isEmpty()) continue;
      const Overlap o = least_overlap(ca, cb, tolerance);
      if (o.depth > deepest.depth || (o.intersect && !deepest.intersect)) deepest = o;
    }
  }
  if (a.pieces().size() > 1 || b.pieces().size() > 1) {
    const double depth = std::max(vertex_depth(a.body(), pa, b.body(), pb, tolerance),
                                  vertex_depth(b.body(), pb, a.body(), pa, tolerance));
    if (depth > deepest.depth) deepest.depth = depth;
    if (depth > tolerance) deepest.intersect = true;
  }
  return deepest;
}

Overlap deepest_intersection(const Polyhedron& a, const Pose& pa, const Polyhedron& b, const Pose& pb,
                             double tolerance) {
  return deepest_intersection(CheckedBody(a), pa, CheckedBody(b), pb, tolerance);
}

/// Boxes around triangles, halved along the longest side.
struct CheckedSurface::Tree {
  TriangleSurface surface;
  std::vector<int> order;
  struct Node {
    Box3 box;
    int begin, end, left = -1, right = -1;
  };
  std::vector<Node> nodes;

  Box3 box_of(int t) const {
    Box3 b;
    for (int v : surface.triangles[t]) b.extend(surface.vertices[v]);
    return b;
  }
  int build(int begin, int end) {
    const int id = static_cast<int>(nodes.size());
    nodes.push_back({Box3(), begin, end});
    Box3 centres;
    for (int i = begin; i < end; ++i)
      nodes[id].box.extend(box_of(order[i])), centres.extend(box_of(order[i]).center());
    if (end - begin > 4) {
      int axis;
      centres.sizes().maxCoeff(&axis);
      const int middle = (begin + end) / 2;
      std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end, [&](int a, int b) {
        const double p = box_of(a).center()[axis], q = box_of(b).center()[axis];
        return p != q ? p < q : a < b;
      });
      const int left = build(begin, middle), right = build(middle, end);
      nodes[id].left = left;
      nodes[id].right = right;
    }
    return id;
  }
  template <class Visit>
  void visit(const Box3& box, Visit&& f) const {
    std::vector<int> stack;
    if (!nodes.empty()) stack.push_back(0);
    while (!stack.empty()) {
      const Node& n = nodes[stack.back()];
      stack.pop_back();
      if (n.box.intersection(box).isEmpty()) continue;
      if (n.left < 0) {
        for (int i = n.begin; i < n.end; ++i) f(order[i]);
      } else {
        stack.push_back(n.right);
        stack.push_back(n.left);
      }
    }
  }
};

CheckedSurface::CheckedSurface(const TriangleSurface& surface) : tree_(std::make_unique<Tree>()) {
  tree_->surface = surface;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) tree_->order.push_back(t);
  if (!tree_->order.empty()) tree_->build(0, static_cast<int>(tree_->order.size()));
}
CheckedSurface::~CheckedSurface() = default;
CheckedSurface::CheckedSurface(CheckedSurface&&) noexcept = default;
CheckedSurface& CheckedSurface::operator=(CheckedSurface&&) noexcept = default;
int CheckedSurface::triangles() const { return static_cast<int>(tree_->surface.triangles.size()); }

namespace {
/// Twice the signed area of (a, b, p) in plan; exact sign by rationals where floating point does not decide,
/// ties broken by the order of a and b so that a point over a common edge belongs to one of its two
/// triangles.
bool left_of(const Vec3& a, const Vec3& b, double x, double y) {
  const double s = (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  const double scale =
      std::abs(b.x() - a.x()) * std::abs(y - a.y()) + std::abs(b.y() - a.y()) * std::abs(x - a.x());
  if (std::abs(s) > 8 * std::numeric_limits<double>::epsilon() * scale) return s > 0;
  const Rational r = (Rational(b.x()) - Rational(a.x())) * (Rational(y) - Rational(a.y())) -
                     (Rational(b.y()) - Rational(a.y())) * (Rational(x) - Rational(a.x()));
  if (r != 0) return r > 0;
  return a.y() != b.y() ? a.y() < b.y() : a.x() < b.x();
}
bool above_in_plan(const Vec3& a, const Vec3& b, const Vec3& c, double x, double y) {
  const bool p = left_of(a, b, x, y), q = left_of(b, c, x, y), r = left_of(c, a, x, y);
  return p == q && q == r;
}
}  // namespace

bool CheckedSurface::solid_at(const Vec3& p) const {
  if (tree_->surface.two_sided) return false;
  double first = std::numeric_limits<double>::infinity();  // height of the first face above
  bool faces_up = false;
  const Box3 ray(p, Vec3(p.x(), p.y(), 1e300));
  tree_->visit(ray, [&](int t) {
    const auto& c = tree_->surface.triangles[t];
    const Vec3 &a = tree_->surface.vertices[c[0]], &b = tree_->surface.vertices[c[1]],
               &d = tree_->surface.vertices[c[2]];
    if (!above_in_plan(a, b, d, p.x(), p.y())) return;
    const Vec3 n = (b - a).cross(d - a);
    if (n.z() == 0) return;
    const double z = p.z() - n.dot(p - a) / n.z();
    if (z > p.z() && z < first) first = z, faces_up = n.z() > 0;
  });
  return faces_up;
}

bool CheckedSurface::covers(double x, double y) const {
  bool found = false;
  tree_->visit(Box3(Vec3(x, y, -1e300), Vec3(x, y, 1e300)), [&](int t) {
    const auto& c = tree_->surface.triangles[t];
    const auto& v = tree_->surface.vertices;
    found = found || above_in_plan(v[c[0]], v[c[1]], v[c[2]], x, y);
  });
  return found;
}

Overlap CheckedSurface::crossing(const CheckedBody& body, const Pose& pose, double tolerance) const {
  Overlap deepest;
  deepest.depth = -std::numeric_limits<double>::infinity();
  Box3 whole;
  for (const auto& p : body.pieces()) {
    const Convex piece = place(p, pose);
    whole.extend(piece.box);
    tree_->visit(piece.box, [&](int t) {
      Convex triangle;
      for (int v : tree_->surface.triangles[t])
        triangle.x.push_back(tree_->surface.vertices[v]), triangle.box.extend(triangle.x.back());
      if (piece.box.intersection(triangle.box).isEmpty()) return;
      triangle.normals.push_back((triangle.x[1] - triangle.x[0]).cross(triangle.x[2] - triangle.x[0]));
      for (int k = 0; k < 3; ++k) triangle.directions.push_back(triangle.x[(k + 1) % 3] - triangle.x[k]);
      // The triangle is the second set: moving the body out along +n is moving the triangle along -n.
      Overlap o = least_overlap(piece, triangle, tolerance, !tree_->surface.two_sided);
      o.direction = -o.direction;  // of the body
      if (o.depth > deepest.depth || (o.intersect && !deepest.intersect)) deepest = o;
    });
  }
  if (!deepest.intersect && body.pieces().size() > 0) {
    // No crossing: the body is wholly on one side, and a point well within it shows which.
    Vec3 within = Vec3::Zero();
    for (const Vec3& v : body.pieces()[0].vertices)
      within += pose.world(v) / static_cast<double>(body.pieces()[0].vertices.size());
    if (solid_at(within)) {
      deepest.intersect = true;
      deepest.depth = whole.sizes().z();
      deepest.direction = Vec3::UnitZ();
    }
  }
  return deepest;
}

double depth_below_plane(const Polyhedron& body, const Pose& pose, const Plane& plane) {
  double depth = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : body.vertices) depth = std::max(depth, -plane.normal.dot(pose.world(v) - plane.point));
  return depth;
}

std::vector<Finding> find_intersections(const std::vector<const CheckedBody*>& bodies,
                                        const std::vector<Pose>& poses,
                                        const std::vector<const CheckedSurface*>& surfaces,
                                        const std::vector<Plane>& planes, double tolerance) {
  std::vector<Finding> out;
  const int n = static_cast<int>(bodies.size());
  std::vector<Box3> boxes(n);
  for (int i = 0; i < n; ++i)
    for (const Vec3& v : bodies[i]->body().vertices) boxes[i].extend(poses[i].world(v));
  std::vector<int> order(n);
  for (int i = 0; i < n; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return boxes[a].min().x() != boxes[b].min().x() ? boxes[a].min().x() < boxes[b].min().x() : a < b;
  });
  for (int p = 0; p < n; ++p)
    for (int q = p + 1; q < n && boxes[order[q]].min().x() <= boxes[order[p]].max().x(); ++q) {
      const int a = std::min(order[p], order[q]), b = std::max(order[p], order[q]);
      if (boxes[a].intersection(boxes[b]).isEmpty()) continue;
      const Overlap o = deepest_intersection(*bodies[a], poses[a], *bodies[b], poses[b], tolerance);
      if (o.intersect) out.push_back({Finding::With::body, a, b, o.depth});
    }
  for (int i = 0; i < n; ++i) {
    for (int s = 0; s < static_cast<int>(surfaces.size()); ++s) {
      const Overlap o = surfaces[s]->crossing(*bodies[i], poses[i], tolerance);
      if (o.intersect) out.push_back({Finding::With::surface, i, s, o.depth});
    }
    for (int s = 0; s < static_cast<int>(planes.size()); ++s) {
      const double depth = depth_below_plane(bodies[i]->body(), poses[i], planes[s]);
      if (depth > tolerance) out.push_back({Finding::With::plane, i, s, depth});
    }
  }
  std::sort(out.begin(), out.end(), [](const Finding& l, const Finding& r) {
    return l.with != r.with ? l.with < r.with : l.a != r.a ? l.a < r.a : l.b < r.b;
  });
  return out;
}

}  // namespace talus::geometry

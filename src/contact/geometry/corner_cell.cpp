#include "contact/geometry/corner_cell.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "contact/geometry/plumb.hpp"
#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_math.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {
namespace {

/// Gathers the triangles of a cell, given in the body's loops.
class Gathered {
 public:
  Gathered(const Vec3& foot, const Vec3& n) : foot_(foot), n_(n) {}
  void add(const Vec3& x, const Vec3& y, const Vec3& z) {
    const double area = -0.5 * n_.dot((y - x).cross(z - x));  // a loop runs about the normal that looks out
    CornerArea::Triangle t{area, {n_.dot(x - foot_), n_.dot(y - foot_), n_.dot(z - foot_)}};
    area_ += area;
    moment_ += area * (t.height[0] + t.height[1] + t.height[2]) / 3;
    for (double& h : t.height) h = std::max(0.0, h);
    rising_ += area * (t.height[0] + t.height[1] + t.height[2]) / 3;
    triangles_.push_back(t);
  }
  /// The third of triangle x, y, z that belongs to x.
  void add_third(const Vec3& x, const Vec3& y, const Vec3& z) {
    const Vec3 middle = (x + y + z) / 3;
    add(x, 0.5 * (x + y), middle);
    add(x, middle, 0.5 * (x + z));
  }
  /// Heights of round-off are none: of a face that lies flat.
  CornerCell cell(double radius) const {
    if (!(area_ > 0)) return {};
    CornerCell cell{area_, {}};
    if (!(moment_ > tolerances().same_place * radius * area_)) return cell;
    cell.triangles = triangles_;
    for (CornerArea::Triangle& t : cell.triangles)
      for (double& h : t.height) h *= moment_ / rising_;
    return cell;
  }

 private:
  Vec3 foot_, n_;
  double area_ = 0, moment_ = 0, rising_ = 0;
  std::vector<CornerArea::Triangle> triangles_;
};

Vec3 vertex(const Polyhedron& body, int v) { return body.vertices[static_cast<std::size_t>(v)]; }

bool is_large(const Polyhedron& body, const std::array<int, 3>& t) {
  const auto square = [&](int k) {
    return (vertex(body, t[static_cast<std::size_t>(k)]) -
            vertex(body, t[static_cast<std::size_t>((k + 1) % 3)]))
        .squaredNorm();
  };
  return std::max({square(0), square(1), square(2)}) > body.radius * body.radius;
}

/// Calls use(triangle) for the large triangles of the body whose face looks at the ground.
template <class Use>
void each_large(const Polyhedron& body, const Vec3& n, const Use& use) {
  for (std::size_t i = 0; i < body.triangles.size(); ++i)
    if (n.dot(body.face_normals[static_cast<std::size_t>(body.triangle_face[i])]) < 0 &&
        is_large(body, body.triangles[i]))
      use(body.triangles[i]);
}

bool has_large(const Polyhedron& body, int face) {
  const auto first = static_cast<std::size_t>(body.face_offset[static_cast<std::size_t>(face)]);
  if (body.face_offset[static_cast<std::size_t>(face) + 1] == static_cast<int>(first) + 3)
    return is_large(
        body, {body.face_vertices[first], body.face_vertices[first + 1], body.face_vertices[first + 2]});
  for (std::size_t i = 0; i < body.triangles.size(); ++i)
    if (body.triangle_face[i] == face && is_large(body, body.triangles[i])) return true;
  return false;
}

/// Of the large triangles of a face each corner's third of the quarter at it, of the others of theirs.
void add_divided(const Polyhedron& body, int face, int corner, Gathered& sum) {
  for (std::size_t i = 0; i < body.triangles.size(); ++i) {
    if (body.triangle_face[i] != face) continue;
    const std::array<int, 3>& t = body.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (t[k] != corner) continue;
      const Vec3 x = vertex(body, corner), y = vertex(body, t[(k + 1) % 3]), z = vertex(body, t[(k + 2) % 3]);
      if (is_large(body, t))
        sum.add_third(x, 0.5 * (x + y), 0.5 * (x + z));
      else
        sum.add_third(x, y, z);
    }
  }
}

/// Of a face that is not divided what lies between a corner, the middles of its edges and of the face.
void add_share(const Polyhedron& body, int face, int corner, Gathered& sum) {
  const int first = body.face_offset[static_cast<std::size_t>(face)],
            count = body.face_offset[static_cast<std::size_t>(face) + 1] - first;
  const auto at = [&](int k) -> Vec3 {
    return vertex(body, body.face_vertices[static_cast<std::size_t>(first + (k + count) % count)]);
  };
  Vec3 middle = Vec3::Zero();
  for (int k = 0; k < count; ++k) middle += at(k) / count;
  for (int k = 0; k < count; ++k) {
    if (body.face_vertices[static_cast<std::size_t>(first + k)] != corner) continue;
    const Vec3 x = at(k);
    sum.add(x, 0.5 * (x + at(k + 1)), middle);
    sum.add(x, middle, 0.5 * (x + at(k - 1)));
  }
}

/// The nearest point of a surface within a distance, and the sum of the normals of what meets there.
struct Foot {
  int triangle = -1;
  Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
};

Foot nearest_foot(const SurfaceIndex& surface, const Vec3& x, double within) {
  const SurfaceIndex::Impl& s = surface.impl();
  const double same = tolerances().same_place * within;
  Foot foot;
  double least = within;
  s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (x - x.cwiseMax(lo).cwiseMin(hi)).squaredNorm() <= (least + same) * (least + same);
      },
      [&](int t) {
        const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
        const Vec3 &a = s.surface.vertices[static_cast<std::size_t>(v[0])],
                   &b = s.surface.vertices[static_cast<std::size_t>(v[1])],
                   &c = s.surface.vertices[static_cast<std::size_t>(v[2])];
        const Vec3 y = narrow::closest_on(a, b, c, x), n = (b - a).cross(c - a).normalized();
        const double d = (x - y).norm();
        if (d > least + same) return true;
        if (d < least - same || foot.triangle < 0)
          foot = {t, y, n};
        else
          foot.normal += n, foot.triangle = std::min(foot.triangle, t);
        least = std::min(least, d);
        return true;
      });
  return foot;
}

}  // namespace

CornerCell corner_cell(const Polyhedron& body, int corner, const Vec3& n, bool divided) {
  Gathered sum(vertex(body, corner), n);
  thread_local std::vector<int> seen;
  seen.clear();
  const auto take = [&](int face) {
    if (std::find(seen.begin(), seen.end(), face) != seen.end()) return;
    seen.push_back(face);
    if (!(n.dot(body.face_normals[static_cast<std::size_t>(face)]) < 0)) return;  // looks away
    if (divided && has_large(body, face))
      add_divided(body, face, corner, sum);
    else
      add_share(body, face, corner, sum);
  };
  const auto v = static_cast<std::size_t>(corner);
  for (int i = body.vertex_edge_offset[v]; i < body.vertex_edge_offset[v + 1]; ++i) {
    const Polyhedron::Edge& e =
        body.edges[static_cast<std::size_t>(body.vertex_edges[static_cast<std::size_t>(i)])];
    take(e.left);
    take(e.right);
  }
  return sum.cell(body.radius);
}

void surface_points(const SurfaceIndex& terrain, const Polyhedron& body, const Pose& pose, double margin,
                    std::vector<ContactPoint>& out) {
  const auto take = [&](int low, int high) {
    const FeatureKey key = make_key(Form::surface_point, low, high);
    const Vec3 x = pose.world(0.5 * (vertex(body, low) + vertex(body, high)));
    Foot foot = nearest_foot(terrain, x, margin);
    const bool near = foot.triangle >= 0;
    if (!near && (!plumb_at(terrain, x).solid || (foot = nearest_foot(terrain, x, body.radius)).triangle < 0))
      return;
    const Vec3 way = x - foot.place;
    const bool inside = way.dot(foot.normal) < 0;
    const double distance = way.norm(), none = tolerances().same_place * body.radius;
    if (near && inside && distance > none && !plumb_at(terrain, x).solid)
      return;  // past the terrain's border
    ContactPoint c;
    c.gap = inside ? -distance : distance;
    c.normal = distance > none ? Vec3(way / c.gap) : foot.normal.normalized();
    c.point_b = x;
    c.point_a = foot.place;
    c.area = 0;
    c.key = key;
    c.face_a = foot.triangle;
    if (cell_of_point(body, key, pose.F.transpose() * c.normal).area > 0) out.push_back(c);
  };
  for (int v = 0; v < static_cast<int>(body.vertices.size()); ++v) take(v, v);
  thread_local std::vector<std::pair<int, int>> edges;
  edges.clear();
  for (const std::array<int, 3>& t : body.triangles)
    if (is_large(body, t))
      for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [low, high] : edges) take(low, high);
}

bool is_surface_point(FeatureKey key) { return form_of(key) == Form::surface_point; }

CornerCell cell_of_point(const Polyhedron& body, FeatureKey key, const Vec3& n) {
  const auto [low, high] = features_of(key);
  if (low == high) return corner_cell(body, low, n, true);
  const Vec3 x = 0.5 * (vertex(body, low) + vertex(body, high));
  Gathered sum(x, n);
  each_large(body, n, [&](const std::array<int, 3>& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::pair(std::minmax(t[k], t[(k + 1) % 3])) != std::pair(std::minmax(low, high))) continue;
      const Vec3 a = vertex(body, t[k]), b = vertex(body, t[(k + 1) % 3]), c = vertex(body, t[(k + 2) % 3]),
                 bc = 0.5 * (b + c), ca = 0.5 * (c + a);
      sum.add_third(x, ca, a);
      sum.add_third(x, bc, ca);
      sum.add_third(x, b, bc);
    }
  });
  return sum.cell(body.radius);
}

}  // namespace talus::contact

#include "fem/fracture/piece_shape.hpp"

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/sort_unique.hpp"

namespace talus::fem {
namespace {

using Triangle = std::array<int, 3>;

struct RigidMotion {
  Mat3 rotation;
  Vec3 from, to;  // centroids
  Vec3 operator()(const Vec3& x) const { return to + rotation * (x - from); }
};

RigidMotion best_motion(std::span<const Vec3> from, std::span<const Vec3> to,
                        const std::vector<double>& weight) {
  RigidMotion m{Mat3::Identity(), Vec3::Zero(), Vec3::Zero()};
  double sum = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    sum += weight[i];
    m.from += weight[i] * from[i];
    m.to += weight[i] * to[i];
  }
  m.from /= sum;
  m.to /= sum;
  Mat3 product = Mat3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    product += weight[i] * (to[i] - m.to) * (from[i] - m.from).transpose();
  const Eigen::JacobiSVD<Mat3> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  m.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  return m;
}

/// Edge collapses on a closed triangulation.
class Collapser {
 public:
  Collapser(const std::vector<Vec3>& vertices, std::vector<Triangle>& triangles)
      : x_(vertices), t_(triangles), around_(vertices.size()) {
    for (int t = 0; t < static_cast<int>(t_.size()); ++t)
      for (const int v : t_[t]) around_[v].push_back(t);
  }

  void run() {
    for (bool changed = true; changed;) {
      changed = false;
      for (int v = 0; v < static_cast<int>(x_.size()); ++v)
        if (const std::optional<int> into = best_neighbour(v)) {
          collapse(v, *into);
          changed = true;
        }
    }
    std::erase_if(t_, [](const Triangle& t) { return t[0] < 0; });
  }

 private:
  static constexpr double same_plane = 1e-7;  // sine of the angle
  static constexpr double slimmest = 2e-3;    // twice the area over the square of the longest side

  Vec3 twice_area(const Triangle& t) const { return (x_[t[1]] - x_[t[0]]).cross(x_[t[2]] - x_[t[0]]); }

  static bool has(const Triangle& t, int v) { return t[0] == v || t[1] == v || t[2] == v; }

  std::vector<int> ring(int v) const {
    std::vector<int> list;
    for (const int t : around_[v])
      for (const int u : t_[t])
        if (u != v) list.push_back(u);
    sort_unique(list);
    return list;
  }

  /// More than two planes meet there: nothing can be taken out.
  bool corner(int v) const {
    std::array<Vec3, 2> plane;
    int planes = 0;
    for (const int t : around_[v]) {
      const Vec3 n = twice_area(t_[t]).normalized();
      bool known = false;
      for (int k = 0; k < planes; ++k)
        known = known || (plane[k].dot(n) > 0 && plane[k].cross(n).norm() < same_plane);
      if (known) continue;
      if (planes == 2) return true;
      plane[planes++] = n;
    }
    return false;
  }

  /// Where v can go so that no plane changes: the neighbour that leaves the best triangles.
  std::optional<int> best_neighbour(int v) const {
    if (around_[v].empty() || corner(v)) return {};
    const std::vector<int> near = ring(v);
    std::optional<int> best;
    double quality = slimmest;
    for (const int u : near) {
      const std::vector<int> beyond = ring(u);
      std::vector<int> common;
      std::set_intersection(near.begin(), near.end(), beyond.begin(), beyond.end(),
                            std::back_inserter(common));
      if (common.size() != 2) continue;  // else an edge would have four triangles
      double worst = 1;
      for (const int t : around_[v]) {
        if (has(t_[t], u)) continue;
        Triangle moved = t_[t];
        std::replace(moved.begin(), moved.end(), v, u);
        const Vec3 n = twice_area(t_[t]).normalized(), m = twice_area(moved);
        double longest = 0;
        for (int k = 0; k < 3; ++k)
          longest = std::max(longest, (x_[moved[k]] - x_[moved[(k + 1) % 3]]).squaredNorm());
        const bool kept = n.dot(m) > 0 && n.cross(m).norm() < same_plane * m.norm();
        worst = kept ? std::min(worst, m.norm() / longest) : 0.0;
        if (worst <= quality) break;
      }
      if (worst > quality) best = u, quality = worst;
    }
    return best;
  }

  void collapse(int v, int u) {
    for (const int t : around_[v]) {
      if (!has(t_[t], u)) {
        std::replace(t_[t].begin(), t_[t].end(), v, u);
        around_[u].push_back(t);
        continue;
      }
      for (const int w : t_[t])
        if (w != v) std::erase(around_[w], t);
      t_[t] = {-1, -1, -1};
    }
    around_[v].clear();
  }

  const std::vector<Vec3>& x_;
  std::vector<Triangle>& t_;
  std::vector<std::vector<int>> around_;  // triangles at each vertex
};

}  // namespace

std::vector<Vec3> straightened(std::span<const Vec3> reference, std::span<const Vec3> present,
                               std::span<const double> weight, double tolerance) {
  std::vector<Vec3> points(present.begin(), present.end());
  std::vector<double> used(weight.begin(), weight.end());
  double all = 0;
  for (const double w : weight) all += w;
  constexpr int fits = 4;  // what lies beyond the tolerance leaves the fit
  for (int fit = 0; fit < fits; ++fit) {
    const RigidMotion motion = best_motion(reference, present, used);
    double within = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 x = motion(reference[i]);
      const bool near = (x - present[i]).norm() <= tolerance;
      points[i] = near ? x : present[i];
      used[i] = near ? weight[i] : 0;
      within += used[i];
    }
    if (within == all) return points;
    if (within < 0.5 * all && fit + 1 < fits) {  // a poor start: the nearer half counts
      std::vector<std::pair<double, std::size_t>> off(points.size());
      for (std::size_t i = 0; i < off.size(); ++i) off[i] = {(motion(reference[i]) - present[i]).norm(), i};
      std::sort(off.begin(), off.end());
      std::fill(used.begin(), used.end(), 0.0);
      for (double sum = 0; const auto& [d, i] : off) {
        if (sum >= 0.5 * all) break;
        sum += used[i] = weight[i];
      }
    } else if (within < 0.5 * all) {
      return {present.begin(), present.end()};
    }
  }
  return points;
}

void part_touching_edges(std::vector<Vec3>& vertices, std::vector<Triangle>& triangles,
                         std::vector<int> cell) {
  std::map<std::pair<int, int>, std::vector<int>> at;  // triangles at each edge
  const auto edge = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
    for (std::size_t k = 0; k < 3; ++k) at[edge(triangles[t][k], triangles[t][(k + 1) % 3])].push_back(t);
  std::vector<std::pair<int, int>> touching;
  for (const auto& [ends, list] : at)
    if (list.size() > 2) touching.push_back(ends);
  for (const auto& ends : touching) {
    std::map<int, int> middle;  // by cell
    for (const int t : std::vector<int>(at[ends])) {
      const auto [v, fresh] =
          middle.try_emplace(cell[static_cast<std::size_t>(t)], static_cast<int>(vertices.size()));
      if (fresh)
        vertices.push_back(0.5 * (vertices[static_cast<std::size_t>(ends.first)] +
                                  vertices[static_cast<std::size_t>(ends.second)]));
      // (a, b, c) becomes (a, m, c) and (m, b, c), which takes over what was known of its edge (b, c).
      Triangle& whole = triangles[static_cast<std::size_t>(t)];
      while (edge(whole[0], whole[1]) != ends) std::rotate(whole.begin(), whole.begin() + 1, whole.end());
      const int other = static_cast<int>(triangles.size());
      const Triangle half{v->second, whole[1], whole[2]};
      std::replace(at[edge(whole[1], whole[2])].begin(), at[edge(whole[1], whole[2])].end(), t, other);
      whole[1] = v->second;
      triangles.push_back(half);
      cell.push_back(cell[static_cast<std::size_t>(t)]);
    }
  }
}

void merge_planar(std::vector<Vec3>& vertices, std::vector<Triangle>& triangles) {
  Collapser(vertices, triangles).run();
  std::vector<int> number(vertices.size(), -1);
  for (const Triangle& t : triangles)
    for (const int v : t) number[v] = 0;
  std::vector<Vec3> used;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<int>(used.size());
    used.push_back(vertices[v]);
  }
  vertices = std::move(used);
  for (Triangle& t : triangles)
    for (int& v : t) v = number[v];
}

}  // namespace talus::fem

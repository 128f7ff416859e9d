#include "geometry/slivers.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace talus::geometry {
namespace {

class Slivers {
 public:
  Slivers(const std::vector<Vec3>& x, std::vector<std::array<int, 3>>& triangles, double least)
      : x_(x), triangles_(triangles), least_(least), source_(triangles.size()) {
    std::iota(source_.begin(), source_.end(), 0);
  }

  std::vector<int> remove() {
    std::vector<int> work;
    for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
      if (height(triangles_[t]) <= least_) work.push_back(t);
    if (work.empty()) return source_;
    for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
      for (const int v : triangles_[t]) star_[v].insert(t);
    gone_.assign(triangles_.size(), 0);
    // Each step takes a sliver away; a side that was turned may leave another for the next round.
    for (bool changed = true; changed;) {
      changed = false;
      for (const int t : work)
        if (gone_[t] == 0 && height(triangles_[t]) <= least_ && (collapse(t) || turn(t))) changed = true;
    }
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (gone_[t] == 0) triangles_[kept] = triangles_[t], source_[kept++] = source_[t];
    triangles_.resize(kept);
    source_.resize(kept);
    return source_;
  }

 private:
  double side(const std::array<int, 3>& t, int k) const { return (x_[t[(k + 1) % 3]] - x_[t[k]]).norm(); }
  double height(const std::array<int, 3>& t) const {
    const double longest = std::max({side(t, 0), side(t, 1), side(t, 2)});
    return longest > 0 ? (x_[t[1]] - x_[t[0]]).cross(x_[t[2]] - x_[t[0]]).norm() / longest : 0;
  }
  std::vector<int> at_edge(int a, int b) const {
    std::vector<int> found;
    for (const int t : star_.at(a))
      if (star_.at(b).contains(t)) found.push_back(t);
    return found;
  }
  int opposite(int t, int a, int b) const {
    for (const int v : triangles_[t])
      if (v != a && v != b) return v;
    return -1;
  }
  std::set<int> neighbours(int v) const {
    std::set<int> out;
    for (const int t : star_.at(v)) out.insert(triangles_[t].begin(), triangles_[t].end());
    out.erase(v);
    return out;
  }
  void put(int t, const std::array<int, 3>& corners) {
    for (const int v : triangles_[t]) star_[v].erase(t);
    triangles_[t] = corners;
    for (const int v : corners) star_[v].insert(t);
  }

  bool collapse(int t) {
    int k = 0;
    for (int i = 1; i < 3; ++i)
      if (side(triangles_[t], i) < side(triangles_[t], k)) k = i;
    if (side(triangles_[t], k) > least_) return false;
    const int a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
    const std::vector<int> beside = at_edge(a, b);
    if (beside.size() != 2) return false;
    // The ends have the two corners beside in common and no other, else the surface would touch itself.
    const std::set<int> of_a = neighbours(a), of_b = neighbours(b);
    std::vector<int> common;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(common));
    if (common.size() != 2 || star_.at(b).size() < 3 || star_.at(a).size() < 3) return false;
    for (const int u : common)
      if (star_.at(u).size() < 4) return false;
    for (const int s : beside) {
      for (const int v : triangles_[s]) star_[v].erase(s);
      gone_[s] = 1;
    }
    const std::set<int> moved = star_.at(b);
    for (const int s : moved) {
      std::array<int, 3> c = triangles_[s];
      std::replace(c.begin(), c.end(), b, a);
      put(s, c);
    }
    return true;
  }

  bool turn(int t) {
    int k = 0;
    for (int i = 1; i < 3; ++i)
      if (side(triangles_[t], i) > side(triangles_[t], k)) k = i;
    const int p = triangles_[t][k], q = triangles_[t][(k + 1) % 3], v = triangles_[t][(k + 2) % 3];
    const std::vector<int> beside = at_edge(p, q);
    if (beside.size() != 2) return false;
    const int s = beside[0] == t ? beside[1] : beside[0], d = opposite(s, p, q);
    if (d == v || !at_edge(v, d).empty()) return false;
    const std::array<int, 3> first{p, d, v}, second{d, q, v};
    if (std::min(height(first), height(second)) <= least_) return false;
    put(t, first);
    put(s, second);
    source_[t] = source_[s];
    return true;
  }

  const std::vector<Vec3>& x_;
  std::vector<std::array<int, 3>>& triangles_;
  double least_;
  std::vector<int> source_;
  std::map<int, std::set<int>> star_;
  std::vector<char> gone_;
};

}  // namespace

std::vector<int> remove_slivers(const std::vector<Vec3>& x, std::vector<std::array<int, 3>>& triangles,
                                double least) {
  return Slivers(x, triangles, least).remove();
}

}  // namespace talus::geometry

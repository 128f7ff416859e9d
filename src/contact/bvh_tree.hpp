/// Static bounding-volume tree over boxes, in Morton order: built once, refitted when the boxes move. Internal to src/contact.
///
/// Nodes lie in depth-first order: the left child follows its parent, every child comes after its parent, so one backward
/// sweep refits. Leaves hold up to four primitives.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/types.hpp"

namespace talus::contact {

class BoxTree {
 public:
  struct Node {
    Vec3 lo, hi;
    int right;   // second child; -1 for a leaf
    int first, count;
  };

  /// box(i) gives the box of primitive i.
  template <class BoxOf>
  void build(int count, BoxOf&& box) {
    nodes_.clear();
    order_.resize(static_cast<std::size_t>(count));
    if (count == 0) return;
    Box3 all;
    std::vector<Vec3> centre(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      centre[i] = box(i).center();
      all.extend(centre[i]);
    }
    const double scale = 2097151.0 / std::max(all.sizes().maxCoeff(), 1e-300);
    std::vector<std::pair<std::uint64_t, int>> code(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      const Vec3 u = (centre[i] - all.min()) * scale;
      code[i] = {spread(u.x()) | spread(u.y()) << 1 | spread(u.z()) << 2, i};
    }
    std::sort(code.begin(), code.end());
    for (int i = 0; i < count; ++i) order_[i] = code[i].second;
    nodes_.reserve(static_cast<std::size_t>(count));
    split(0, count);
    refit(box);
  }

  template <class BoxOf>
  void refit(BoxOf&& box) {
    for (int k = static_cast<int>(nodes_.size()) - 1; k >= 0; --k) {
      Node& n = nodes_[k];
      if (n.right < 0) {
        Box3 b;
        for (int i = n.first; i < n.first + n.count; ++i) b.extend(box(order_[i]));
        n.lo = b.min(), n.hi = b.max();
      } else {
        const Node &l = nodes_[k + 1], &r = nodes_[n.right];
        n.lo = l.lo.cwiseMin(r.lo), n.hi = l.hi.cwiseMax(r.hi);
      }
    }
  }

  /// Calls visit(primitive) for every primitive of every leaf that `touches(lo, hi)`; stops early if visit returns false.
  template <class Touches, class Visit>
  bool traverse(Touches&& touches, Visit&& visit) const {
    if (nodes_.empty()) return true;
    int stack[64];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const int k = stack[--top];
      const Node& n = nodes_[k];
      if (!touches(n.lo, n.hi)) continue;
      if (n.right < 0) {
        for (int i = n.first; i < n.first + n.count; ++i)
          if (!visit(order_[i])) return false;
      } else {
        stack[top++] = n.right;
        stack[top++] = k + 1;
      }
    }
    return true;
  }

  Box3 bounds() const { return nodes_.empty() ? Box3() : Box3(nodes_[0].lo, nodes_[0].hi); }
  bool empty() const { return nodes_.empty(); }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<int>& order() const { return order_; }

 private:
  static constexpr int leaf_size = 4;

  static std::uint64_t spread(double u) {
    std::uint64_t x = static_cast<std::uint64_t>(std::clamp(u, 0.0, 2097151.0));
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    x = (x | x << 2) & 0x1249249249249249ull;
    return x;
  }

  void split(int first, int count) {
    const int self = static_cast<int>(nodes_.size());
    nodes_.push_back({Vec3::Zero(), Vec3::Zero(), -1, first, count});
    if (count <= leaf_size) return;
    const int half = (count / 2 + leaf_size - 1) / leaf_size * leaf_size;  // full leaves on the left
    split(first, half);
    nodes_[self].right = static_cast<int>(nodes_.size());
    split(first + half, count - half);
  }

  std::vector<Node> nodes_;
  std::vector<int> order_;
};

}  // namespace talus::contact

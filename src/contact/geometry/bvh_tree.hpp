/// Static bounding-volume tree over boxes, split at the median along the longer side: built once, refitted
/// when the boxes move.
///
/// Made for queries that find it in memory rather than in the cache: boxes in single precision, rounded
/// outward; the two children of a node beside each other in one line of memory; subtrees in one piece. Leaves
/// hold up to four primitives.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "contact/geometry/large_pages.hpp"
#include "core/types.hpp"

namespace talus::contact {

class BoxTree {
 public:
  /// box(i) gives the box of primitive i. The order of the primitives depends on their boxes, and on their
  /// numbers only where centres coincide.
  template <class BoxOf>
  void build(int count, BoxOf&& box, int bundle = 1) {
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    build(std::span<const int>(all), box, bundle);
  }

  /// Over some primitives. `bundle` (1, 2 or 4): so many that follow each other in the list always share a
  /// leaf.
  template <class BoxOf>
  void build(std::span<const int> primitives, BoxOf&& box, int bundle = 1) {
    pairs_.clear();
    bundle_ = bundle;
    const int count = static_cast<int>(primitives.size());
    reserve_on_large_pages(order_, primitives.size());
    order_.resize(primitives.size());
    bounds_.setEmpty();
    if (count == 0) return;
    const int bundles = count / bundle;
    std::vector<Centre> centres(static_cast<std::size_t>(bundles));
    for (int i = 0; i < bundles; ++i) {
      Box3 all;
      for (int k = 0; k < bundle; ++k) all.extend(box(primitives[static_cast<std::size_t>(bundle * i + k)]));
      centres[static_cast<std::size_t>(i)] = {all.center(), i};
    }
    reserve_on_large_pages(pairs_, static_cast<std::size_t>(count) / 2 + 1);
    pairs_.resize(1);  // the root has no sibling
    split({0, 0}, centres.data(), 0, bundles);
    for (int i = 0; i < count; ++i)
      order_[static_cast<std::size_t>(i)] = primitives[static_cast<std::size_t>(
          bundle * centres[static_cast<std::size_t>(i / bundle)].bundle + i % bundle)];
    refit(box);
  }

  template <class BoxOf>
  void refit(BoxOf&& box) {
    bounds_.setEmpty();
    for (std::size_t k = pairs_.size(); k-- > 0;)
      for (Node& n : pairs_[k].node) fit(n, box);
  }

  /// Calls visit(primitive) for every primitive of every leaf that `touches(lo, hi)`, whose box may be larger
  /// than that of its primitives by the rounding; stops early if visit returns false.
  template <class Touches, class Visit>
  bool traverse(Touches&& touches, Visit&& visit) const {
    const auto leaf = [&](const Node& n) {
      for (int i = n.first; i < n.first + n.count; ++i)
        if (!visit(order_[static_cast<std::size_t>(i)])) return false;
      return true;
    };
    return walk(touches, leaf);
  }

  /// The same, all leaves known before the first visit: what a primitive needs is on its way from memory
  /// meanwhile, if announce(primitive) asks for it.
  template <class Touches, class Announce, class Visit>
  void traverse_ahead(Touches&& touches, Announce&& announce, Visit&& visit) const {
    thread_local std::vector<int> found;
    found.clear();
    walk(touches, [&](const Node& n) {
      for (int i = n.first; i < n.first + n.count; ++i)
        announce(found.emplace_back(order_[static_cast<std::size_t>(i)]));
      return true;
    });
    for (const int i : found) visit(i);
  }

  const Box3& bounds() const { return bounds_; }
  /// The primitives as they lie in the leaves.
  const std::vector<int>& order() const { return order_; }

 private:
  using Vec3f = Eigen::Vector3f;
  static constexpr int leaf_size = 4;
  static constexpr int inner = 0;
  struct Node {
    Vec3f lo = Vec3f::Constant(std::numeric_limits<float>::infinity()), hi = -lo;
    int first = 0;   // of its primitives in `order_`; of an inner node, the pair of its children
    int count = -1;  // primitives of a leaf
  };
  struct alignas(64) Pair {
    Node node[2];
  };
  struct Place {
    std::size_t pair;
    int side;
  };
  struct Centre {
    Vec3 x;
    int bundle;
  };

  static float rounded_down(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
  }

  Node& at(Place p) { return pairs_[p.pair].node[p.side]; }

  template <class BoxOf>
  void fit(Node& n, BoxOf& box) {
    if (n.count == inner) {
      const Pair& children = pairs_[static_cast<std::size_t>(n.first)];
      n.lo = children.node[0].lo.cwiseMin(children.node[1].lo),
      n.hi = children.node[0].hi.cwiseMax(children.node[1].hi);
      return;
    }
    Box3 b;
    for (int i = n.first; i < n.first + n.count; ++i) b.extend(box(order_[static_cast<std::size_t>(i)]));
    bounds_.extend(b);
    for (int d = 0; d < 3 && n.count > 0; ++d)
      n.lo[d] = rounded_down(b.min()[d]), n.hi[d] = -rounded_down(-b.max()[d]);
  }

  /// The bundles from `first` on.
  void split(Place self, Centre* centres, int first, int count) {
    at(self).first = bundle_ * first, at(self).count = bundle_ * count;
    const int leaf = leaf_size / bundle_;
    Centre *begin = centres + first, *end = begin + count;
    if (count <= leaf) {
      std::sort(begin, end, [](const Centre& a, const Centre& b) { return a.bundle < b.bundle; });
      return;
    }
    Box3 box;
    for (const Centre* c = begin; c != end; ++c) box.extend(c->x);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const int half = (count / 2 + leaf - 1) / leaf * leaf;  // full leaves on the left
    std::nth_element(begin, begin + half, end, [axis](const Centre& a, const Centre& b) {
      for (int k = 0; k < 3; ++k)
        if (const int d = (axis + k) % 3; a.x[d] != b.x[d]) return a.x[d] < b.x[d];
      return a.bundle < b.bundle;
    });
    const std::size_t pair = pairs_.size();
    at(self).first = static_cast<int>(pair), at(self).count = inner;
    pairs_.emplace_back();
    split({pair, 0}, centres, first, half);
    split({pair, 1}, centres, first + half, count - half);
  }

  /// Calls leaf(node) for the leaves that touch, from the first to the last; stops where it returns false.
  template <class Touches, class Leaf>
  bool walk(Touches& touches, Leaf&& leaf) const {
    if (pairs_.empty()) return true;
    const auto meets = [&](const Node& n) {
      return touches(Vec3(n.lo.cast<double>()), Vec3(n.hi.cast<double>()));
    };
    const Node* stack[64];
    int top = 0;
    if (meets(pairs_[0].node[0])) stack[top++] = &pairs_[0].node[0];
    while (top > 0) {
      const Node& n = *stack[--top];
      if (n.count != inner) {
        if (!leaf(n)) return false;
        continue;
      }
      const Pair& children = pairs_[static_cast<std::size_t>(n.first)];
      for (int side = 1; side >= 0; --side) {
        const Node& child = children.node[side];
        if (!meets(child)) continue;
        if (child.count == inner) __builtin_prefetch(&pairs_[static_cast<std::size_t>(child.first)]);
        stack[top++] = &child;
      }
    }
    return true;
  }

  std::vector<Pair> pairs_;
  std::vector<int> order_;
  Box3 bounds_;
  int bundle_ = 1;
};

}  // namespace talus::contact

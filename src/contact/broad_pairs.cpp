/// Broad phase: sort and sweep along the axis on which the boxes spread most.
#include <algorithm>
#include <cstdint>
#include <limits>

#include "contact/detect.hpp"

namespace talus::contact {
namespace {

struct Entry {
  double lo, hi, a0, a1, b0, b1;
  int id;
};

}  // namespace

void overlapping_pairs(std::span<const Box3> boxes, std::vector<std::pair<int, int>>& pairs) {
  pairs.clear();
  const int n = static_cast<int>(boxes.size());
  if (n < 2) return;
  thread_local std::vector<Entry> list;
  list.clear();
  list.reserve(boxes.size());
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero(), extent = Vec3::Zero();
  Vec3 origin = Vec3::Zero();
  bool first = true;
  int used = 0;
  for (int i = 0; i < n; ++i) {
    if (boxes[i].isEmpty()) continue;
    const Vec3 c = boxes[i].center();
    if (!c.allFinite()) continue;
    if (first) origin = c, first = false;
    sum += c - origin;
    squares += (c - origin).cwiseAbs2();
    extent += boxes[i].sizes();
    ++used;
  }
  if (used < 2) return;
  // Fewest boxes overlap along the axis where the spread is largest against the mean width.
  const Vec3 variance = squares / used - (sum / used).cwiseAbs2();
  const Vec3 measure = variance.cwiseMax(0).cwiseSqrt().array() / (extent / used).array().max(1e-300);
  int k;
  measure.maxCoeff(&k);
  const int u = (k + 1) % 3, w = (k + 2) % 3;
  for (int i = 0; i < n; ++i) {
    const Box3& b = boxes[i];
    if (b.isEmpty()) continue;
    list.push_back({b.min()[k], b.max()[k], b.min()[u], b.max()[u], b.min()[w], b.max()[w], i});
  }
  std::sort(list.begin(), list.end(), [](const Entry& l, const Entry& r) { return l.lo != r.lo ? l.lo < r.lo : l.id < r.id; });
  const std::size_t count = list.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Entry& a = list[i];
    for (std::size_t j = i + 1; j < count && list[j].lo <= a.hi; ++j) {
      const Entry& b = list[j];
      if (b.a0 <= a.a1 && b.a1 >= a.a0 && b.b0 <= a.b1 && b.b1 >= a.b0)
        pairs.emplace_back(std::min(a.id, b.id), std::max(a.id, b.id));
    }
  }
  std::sort(pairs.begin(), pairs.end());
}

}  // namespace talus::contact

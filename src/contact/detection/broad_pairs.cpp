/// Broad phase: sort along one axis, sweep in strips along a second.
#include <algorithm>
#include <limits>

#include "contact/detection/detect.hpp"

namespace talus::contact {
namespace {

struct Entry {
  double lo, hi, a0, a1, b0, b1;
  int id;
};

struct SweepScratch {
  std::vector<Entry> sorted, strip;
  std::vector<int> first, at;
};

constexpr int most_strips = 64;

}  // namespace

void overlapping_pairs(std::span<const Box3> boxes, std::vector<std::pair<int, int>>& pairs) {
  pairs.clear();
  thread_local SweepScratch s;
  auto& list = s.sorted;
  list.clear();
  list.reserve(boxes.size());
  // Spread of the centres against the mean width tells along which axes boxes overlap least.
  const int n = static_cast<int>(boxes.size());
  Vec3 origin = Vec3::Zero(), sum = Vec3::Zero(), squares = Vec3::Zero(), extent = Vec3::Zero();
  int used = 0;
  for (int i = 0; i < n; ++i) {
    if (boxes[i].isEmpty()) continue;
    const Vec3 c = boxes[i].center();
    if (used++ == 0) origin = c;
    sum += c - origin;
    squares += (c - origin).cwiseAbs2();
    extent += boxes[i].sizes();
  }
  if (used < 2) return;
  const Vec3 variance = squares / used - (sum / used).cwiseAbs2();
  const Vec3 measure = variance.cwiseMax(0).cwiseSqrt().array() / (extent / used).array().max(1e-300);
  int k;
  measure.maxCoeff(&k);
  int u = (k + 1) % 3, w = (k + 2) % 3;
  if (measure[w] > measure[u]) std::swap(u, w);
  double low = std::numeric_limits<double>::infinity(), high = -low, width = 0;
  for (int i = 0; i < n; ++i) {
    const Box3& b = boxes[i];
    if (b.isEmpty()) continue;
    list.push_back({b.min()[k], b.max()[k], b.min()[u], b.max()[u], b.min()[w], b.max()[w], i});
    low = std::min(low, b.min()[u]);
    high = std::max(high, b.min()[u]);
    width += b.max()[u] - b.min()[u];
  }
  std::sort(list.begin(), list.end(),
            [](const Entry& l, const Entry& r) { return l.lo != r.lo ? l.lo < r.lo : l.id < r.id; });

  const double mean = width / used;
  const int strips =
      high > low && mean > 0 ? std::clamp(static_cast<int>((high - low) / (2 * mean)), 1, most_strips) : 1;
  const double scale = high > low ? strips / (high - low) : 0;
  const auto strip_of = [&](double a) {
    return std::clamp(static_cast<int>((a - low) * scale), 0, strips - 1);
  };
  s.first.assign(static_cast<std::size_t>(strips) + 1, 0);
  for (const Entry& e : list)
    for (int i = strip_of(e.a0); i <= strip_of(e.a1); ++i) ++s.first[i + 1];
  for (int i = 0; i < strips; ++i) s.first[i + 1] += s.first[i];
  s.strip.resize(static_cast<std::size_t>(s.first[strips]));
  s.at.assign(s.first.begin(), s.first.end() - 1);
  for (const Entry& e : list)
    for (int i = strip_of(e.a0); i <= strip_of(e.a1); ++i) s.strip[s.at[i]++] = e;

  for (int strip = 0; strip < strips; ++strip)
    for (int i = s.first[strip]; i < s.first[strip + 1]; ++i) {
      const Entry& a = s.strip[i];
      for (int j = i + 1; j < s.first[strip + 1] && s.strip[j].lo <= a.hi; ++j) {
        const Entry& b = s.strip[j];
        if (b.a0 <= a.a1 && b.a1 >= a.a0 && b.b0 <= a.b1 && b.b1 >= a.b0 &&
            strip_of(std::max(a.a0, b.a0)) ==
                strip)  // both lie in several strips: reported in the first common one
          pairs.emplace_back(std::min(a.id, b.id), std::max(a.id, b.id));
      }
    }
  std::sort(pairs.begin(), pairs.end());
}

}  // namespace talus::contact

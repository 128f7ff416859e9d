#include "coupling/touch_flush.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact/surface_index.hpp"

namespace talus::coupling {
namespace {

constexpr double parallel_cosine = 0.9998;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double x) { low = std::min(low, x), high = std::max(high, x); }
};

/// Heights of a block's vertices along n.
Range heights(const dda::Model& m, const dda::State& s, int block, const Vec3& n) {
  const Pose pose = dda::pose(s, block);
  const Vec3 in_body = pose.F.transpose() * n;
  Range r;
  for (const Vec3& X : m.blocks[static_cast<std::size_t>(block)].shape->vertices) r.add(in_body.dot(X));
  const double centre = n.dot(pose.c);
  return {r.low + centre, r.high + centre};
}

/// Heights of the triangles that share a vertex with the given one.
Range heights_around(const contact::SurfaceIndex& index, int triangle, const Vec3& n) {
  const contact::SurfaceIndex::Impl& s = index.impl();
  Range r;
  for (const int v : s.surface.triangles[static_cast<std::size_t>(triangle)])
    for (int i = s.vertex_offset[static_cast<std::size_t>(v)]; i < s.vertex_offset[static_cast<std::size_t>(v) + 1]; ++i)
      for (const int w : s.surface.triangles[static_cast<std::size_t>(s.vertex_triangle[static_cast<std::size_t>(i)])])
        r.add(n.dot(s.surface.vertices[static_cast<std::size_t>(w)]));
  return r;
}

/// The plane of a contact as seen by one of its two blocks: n towards the block, the two sides' levels.
struct Support {
  Vec3 n;
  double block_level, partner_level;   // n . x [m]
  double step = 0;                     // height of one that is none [m]
  std::size_t touch = 0;
};

class EdgeFilter {
 public:
  EdgeFilter(const dda::Model& m, const dda::State& s, const Environment& env, double flush, double at_skins, const std::vector<Touch>& touches)
      : model_(m), state_(s), env_(env), flush_(flush), at_skins_(at_skins), touches_(touches), dropped_(touches.size(), 0) {
    const auto each_side = [&](auto&& use) {
      for (std::size_t i = 0; i < touches.size(); ++i) {
        const Touch& t = touches[i];
        if (const double none = step_at(t); t.at.gap > none || (t.stiffness == 0 && t.at.gap < -none)) continue;   // pressed into each other, no plane parts them
        if (t.b >= 0) use(static_cast<std::size_t>(t.b), i);
        if (t.a.kind == Partner::Kind::block) use(static_cast<std::size_t>(t.a.index), i);
      }
    };
    first_.assign(m.blocks.size() + 1, 0);
    each_side([&](std::size_t block, std::size_t) { ++first_[block + 1]; });
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    resting_.resize(first_.back());   // in one row: a piece of a deck has hundreds, and each is asked about each
    lowest_.assign(resting_.size(), std::numeric_limits<double>::quiet_NaN());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each_side([&](std::size_t block, std::size_t i) { resting_[next[block]++] = support(i, static_cast<int>(block)); });
  }

  /// In ascending order: what was dropped supports nothing, so that no two contacts drop each other.
  bool internal(std::size_t i) {
    const Touch& t = touches_[i];
    if ((t.at.area > 0 && !at_skin(t)) || t.a.kind == Partner::Kind::plane) return false;
    dropped_[i] = slides(t, t.b) || (t.a.kind == Partner::Kind::block && slides(t, t.a.index)) ? 1 : 0;
    return dropped_[i] != 0;
  }

 private:
  bool at_skin(const Touch& t) const { return t.a.kind == Partner::Kind::structure && !env_.structures[static_cast<std::size_t>(t.a.index)].fixed_surface; }
  /// Height of a step that is none, on this side.
  double step_at(const Touch& t) const { return at_skin(t) ? at_skins_ : flush_; }
  Support support(std::size_t touch, int block) const {
    const Touch& s = touches_[touch];
    const Vec3& n = s.at.normal;
    if (s.b == block) return {n, n.dot(s.at.point_b), n.dot(s.at.point_a), step_at(s), touch};
    return {-n, -n.dot(s.at.point_a), -n.dot(s.at.point_b), step_at(s), touch};
  }

  /// True if block q of t rests on a plane that parts it from the other body of t.
  bool slides(const Touch& t, int q) const {
    const double step = step_at(t);
    for (std::size_t k = first_[static_cast<std::size_t>(q)]; k < first_[static_cast<std::size_t>(q) + 1]; ++k) {
      const Support& s = resting_[k];
      if (dropped_[s.touch] == 0 && std::abs(s.n.dot(t.at.normal)) <= parallel_cosine && parts(s, t, q, std::max(s.step, step), lowest_[k])) return true;
    }
    return false;
  }

  /// True if the plane has block q above and the other body of t below it, but for a `step` that is none. `lowest`: height of q's lowest vertex along the plane's normal, NaN before it was asked for.
  bool parts(const Support& p, const Touch& t, int q, double step, double& lowest) const {
    if (t.at.area > 0 && std::abs(p.block_level - p.partner_level) > step) return false;   // what has sunk in overlaps the other side's faces, too
    const double low = std::min(p.block_level, p.partner_level) - step, high = std::max(p.block_level, p.partner_level) + step;
    const bool q_is_b = t.b == q;
    // Most are told apart by the touched points alone.
    if (p.n.dot(q_is_b ? t.at.point_b : t.at.point_a) < low || p.n.dot(q_is_b ? t.at.point_a : t.at.point_b) > high) return false;
    if (std::isnan(lowest)) lowest = heights(model_, state_, q, p.n).low;
    if (lowest < low) return false;
    if (!q_is_b) return heights(model_, state_, t.b, p.n).high <= high;
    switch (t.a.kind) {
      case Partner::Kind::block: return heights(model_, state_, t.a.index, p.n).high <= high;
      case Partner::Kind::terrain: {
        const int face = t.at.face_a >= 0 ? t.at.face_a : env_.terrain->triangle_at(t.at.point_a);
        return heights_around(*env_.terrain, face, p.n).high <= high;
      }
      case Partner::Kind::structure:
        return heights_around(*env_.structures[static_cast<std::size_t>(t.a.index)].index, t.at.face_a, p.n).high <= high;
      case Partner::Kind::plane: break;
    }
    return false;
  }

  const dda::Model& model_;
  const dda::State& state_;
  const Environment& env_;
  double flush_, at_skins_;
  const std::vector<Touch>& touches_;
  std::vector<char> dropped_;
  mutable std::vector<double> lowest_;         // of each of resting_
  std::vector<std::size_t> first_;
  std::vector<Support> resting_;               // contacts of every block, ascending, from first_[block] on
};

}  // namespace

void drop_internal_edges(const dda::Model& m, const dda::State& s, const Environment& env, double flush, double at_skins, std::vector<Touch>& touches) {
  EdgeFilter filter(m, s, env, flush, at_skins, touches);
  thread_local std::vector<char> drop;
  drop.assign(touches.size(), 0);
  bool any = false;
  for (std::size_t i = 0; i < touches.size(); ++i) any |= (drop[i] = filter.internal(i) ? 1 : 0) != 0;
  if (!any) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (drop[i] != 0) continue;
    if (kept != i) touches[kept] = std::move(touches[i]);
    ++kept;
  }
  touches.resize(kept);
}

}  // namespace talus::coupling

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

/// Planes that a block rests on at one partner, `first` to `last` of all, and a cosine from which on a normal against `axis` is parallel to each of them.
struct SupportGroup {
  std::size_t first, last;
  Vec3 axis;
  double parallel;
};

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
    planes_.resize(static_cast<Eigen::Index>(resting_.size()), 6);
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      const Support& r = resting_[k];
      planes_.row(static_cast<Eigen::Index>(k)) << r.n.x(), r.n.y(), r.n.z(), std::min(r.block_level, r.partner_level), std::max(r.block_level, r.partner_level), r.step;
    }
    group();
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

  /// Touches of a pair lie one after the other; most of their planes are nearly one.
  void group() {
    const double cone = std::acos(parallel_cosine);
    first_group_.assign(1, 0);
    for (std::size_t b = 0; b + 1 < first_.size(); ++b) {
      for (std::size_t k = first_[b]; k < first_[b + 1];) {
        SupportGroup g{k, k, Vec3::Zero(), 2};
        const Touch& one = touches_[resting_[k].touch];
        const auto same = [&](const Touch& t) { return t.b == one.b && t.a == one.a; };
        for (; g.last < first_[b + 1] && same(touches_[resting_[g.last].touch]); ++g.last) g.axis += (resting_[g.last].n.dot(resting_[k].n) < 0 ? -1.0 : 1.0) * resting_[g.last].n;
        g.axis.normalize();
        double least = 1;
        for (; k < g.last; ++k) least = std::min(least, std::abs(resting_[k].n.dot(g.axis)));
        if (const double spread = std::acos(least); spread < cone) g.parallel = std::cos(cone - spread);
        groups_.push_back(g);
      }
      first_group_.push_back(groups_.size());
    }
  }

  /// True if block q of t rests on a plane that parts it from the other body of t.
  bool slides(const Touch& t, int q) const {
    for (std::size_t g = first_group_[static_cast<std::size_t>(q)]; g < first_group_[static_cast<std::size_t>(q) + 1]; ++g)
      if (std::abs(t.at.normal.dot(groups_[g].axis)) < groups_[g].parallel && slides_on(groups_[g], t, q)) return true;
    return false;
  }

  bool slides_on(const SupportGroup& group, const Touch& t, int q) const {
    // Most are told apart by normals and touched points alone: all at once.
    const auto count = static_cast<Eigen::Index>(group.last - group.first);
    const auto of = planes_.middleRows(static_cast<Eigen::Index>(group.first), count);
    const auto along = [&](const Vec3& x) { return of.col(0) * x.x() + of.col(1) * x.y() + of.col(2) * x.z(); };
    const bool q_is_b = t.b == q;
    const Vec3 &above = q_is_b ? t.at.point_b : t.at.point_a, &below = q_is_b ? t.at.point_a : t.at.point_b;
    const double step = step_at(t);
    room_ = (parallel_cosine - along(t.at.normal).abs()).min(along(above) - of.col(3) + of.col(5).max(step)).min(of.col(4) + of.col(5).max(step) - along(below));
    for (Eigen::Index k = 0; k < count; ++k) {
      if (room_[k] < 0) continue;
      const std::size_t at = group.first + static_cast<std::size_t>(k);
      if (dropped_[resting_[at].touch] == 0 && parts(resting_[at], t, q, std::max(resting_[at].step, step), lowest_[at])) return true;
    }
    return false;
  }

  /// True if the plane, which has the touched points on either side, has all of block q above and the other body of t below it, but for a `step` that is none. `lowest`: height of q's lowest vertex along the plane's normal, NaN before it was asked for.
  bool parts(const Support& p, const Touch& t, int q, double step, double& lowest) const {
    if (t.at.area > 0 && std::abs(p.block_level - p.partner_level) > step) return false;   // what has sunk in overlaps the other side's faces, too
    const double low = std::min(p.block_level, p.partner_level) - step, high = std::max(p.block_level, p.partner_level) + step;
    const bool q_is_b = t.b == q;
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
  std::vector<std::size_t> first_group_;       // of every block, into
  std::vector<SupportGroup> groups_;
  Eigen::Array<double, Eigen::Dynamic, 6> planes_;   // of each of them: n, the lower and the upper of its levels, its step
  mutable Eigen::ArrayXd room_;                // of those of one group: negative where the plane parts nothing
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

#include "coupling/touch/touch_flush.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "contact/geometry/corner_cell.hpp"
#include "contact/geometry/surface_index.hpp"
#include "contact/tolerances.hpp"

namespace talus::coupling {
namespace {

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
    for (int i = s.vertex_offset[static_cast<std::size_t>(v)];
         i < s.vertex_offset[static_cast<std::size_t>(v) + 1]; ++i)
      for (const int w :
           s.surface.triangles[static_cast<std::size_t>(s.vertex_triangle[static_cast<std::size_t>(i)])])
        r.add(n.dot(s.surface.vertices[static_cast<std::size_t>(w)]));
  return r;
}

/// The plane of a contact as seen by one of its two blocks: n towards the block, the two sides' levels.
struct Support {
  Vec3 n;
  double block_level, partner_level;  // n . x [m]
  double step = 0;                    // height of one that is none [m]
  std::size_t touch = 0;
  double low() const { return std::min(block_level, partner_level); }
  double high() const { return std::max(block_level, partner_level); }
};

/// Planes of one normal that a block rests on, `first` to `last` of all: a face has many corners. Between
/// `low` and `high` lie the levels of all of them.
struct Facing {
  Vec3 n;
  double low, high, step;
  std::size_t first, last;
  double lowest = std::numeric_limits<double>::quiet_NaN();  // height of the block's lowest vertex along n;
                                                             // NaN before it was asked for
};

class EdgeFilter {
 public:
  EdgeFilter(const dda::Model& m, const dda::State& s, const Environment& env, double flush, double at_skins,
             const std::vector<Touch>& touches)
      : model_(m),
        state_(s),
        env_(env),
        flush_(flush),
        at_skins_(at_skins),
        touches_(touches),
        dropped_(touches.size(), 0) {
    const auto each_side = [&](auto&& use) {
      for (std::size_t i = 0; i < touches.size(); ++i) {
        const Touch& t = touches[i];
        if (const double none = step_at(t); t.at.gap > none || (t.stiffness == 0 && t.at.gap < -none))
          continue;  // pressed into each other, no plane parts them
        if (t.b >= 0) use(static_cast<std::size_t>(t.b), i);
        if (t.a.kind == Partner::Kind::block) use(static_cast<std::size_t>(t.a.index), i);
      }
    };
    first_.assign(m.blocks.size() + 1, 0);
    each_side([&](std::size_t block, std::size_t) { ++first_[block + 1]; });
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    resting_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each_side([&](std::size_t block, std::size_t i) {
      resting_[next[block]++] = support(i, static_cast<int>(block));
    });
    gather_facings();
  }

  /// In ascending order: what was dropped supports nothing, so that no two contacts drop each other.
  bool internal(std::size_t i) {
    const Touch& t = touches_[i];
    if ((t.at.area > 0 && !at_skin(t)) || t.normal_law.bed || t.a.kind == Partner::Kind::plane ||
        contact::is_surface_point(t.at.key))
      return false;
    dropped_[i] = slides(t, t.b) || (t.a.kind == Partner::Kind::block && slides(t, t.a.index)) ? 1 : 0;
    return dropped_[i] != 0;
  }

 private:
  bool at_skin(const Touch& t) const {
    return t.a.kind == Partner::Kind::structure &&
           !env_.structures[static_cast<std::size_t>(t.a.index)].fixed_surface;
  }
  /// Height of a step that is none, on this side.
  double step_at(const Touch& t) const { return at_skin(t) ? at_skins_ : flush_; }
  Support support(std::size_t touch, int block) const {
    const Touch& s = touches_[touch];
    const Vec3& n = s.at.normal;
    if (s.b == block) return {n, n.dot(s.at.point_b), n.dot(s.at.point_a), step_at(s), touch};
    return {-n, -n.dot(s.at.point_a), -n.dot(s.at.point_b), step_at(s), touch};
  }

  /// A piece of a deck rests on hundreds of planes, and each of its touches is asked about each: those of one
  /// normal are separated together.
  void gather_facings() {
    const auto normal = [](const Support& p) { return std::tuple(p.n.x(), p.n.y(), p.n.z()); };
    first_facing_.assign(1, 0);
    for (std::size_t b = 0; b + 1 < first_.size(); ++b) {
      const auto begin = resting_.begin() + static_cast<std::ptrdiff_t>(first_[b]),
                 end = resting_.begin() + static_cast<std::ptrdiff_t>(first_[b + 1]);
      std::sort(begin, end, [&](const Support& p, const Support& q) {
        return std::pair(normal(p), p.touch) < std::pair(normal(q), q.touch);
      });
      for (std::size_t k = first_[b]; k < first_[b + 1]; ++k) {
        const Support& p = resting_[k];
        if (k == first_[b] || normal(p) != normal(resting_[k - 1]))
          facings_.push_back({p.n, p.low(), p.high(), p.step, k, k});
        Facing& f = facings_.back();
        f.low = std::min(f.low, p.low()), f.high = std::max(f.high, p.high()),
        f.step = std::max(f.step, p.step), f.last = k + 1;
      }
      first_facing_.push_back(facings_.size());
    }
  }

  /// True if block q of t rests on a plane that parts it from the other body of t.
  bool slides(const Touch& t, int q) {
    for (std::size_t k = first_facing_[static_cast<std::size_t>(q)];
         k < first_facing_[static_cast<std::size_t>(q) + 1]; ++k)
      if (std::abs(facings_[k].n.dot(t.at.normal)) <= contact::tolerances().parallel_cosine() &&
          parts(facings_[k], t, q))
        return true;
    return false;
  }

  /// True if one of the planes has block q above and the other body of t below it, but for a step that is
  /// none.
  bool parts(Facing& f, const Touch& t, int q) const {
    const bool q_is_b = t.b == q;
    const double none = step_at(t), widest = std::max(f.step, none),
                 below = f.n.dot(q_is_b ? t.at.point_a : t.at.point_b);
    double above = f.n.dot(q_is_b ? t.at.point_b : t.at.point_a);
    // Most are separated by the touched points alone.
    if (above < f.low - widest || below > f.high + widest) return false;
    if (std::isnan(f.lowest)) f.lowest = heights(model_, state_, q, f.n).low;
    above = std::min(above, f.lowest);
    if (above < f.low - widest) return false;
    double highest = std::numeric_limits<double>::quiet_NaN();  // of the other body
    for (std::size_t k = f.first; k < f.last; ++k) {
      const Support& p = resting_[k];
      const double step = std::max(p.step, none);
      if (dropped_[p.touch] != 0 || above < p.low() - step || below > p.high() + step) continue;
      const bool sunk = p.high() - p.low() > step;  // on a spring: between the two levels both lie
      if (t.at.area > 0 && sunk) continue;          // it overlaps the other side's faces, too
      if (std::isnan(highest)) highest = highest_of_other(t, q, f.n);
      // What reaches up into q is met there, unless it is flush with what q has sunk into.
      if (highest <= (sunk ? above : p.high()) + step) return true;
      if (sunk && std::abs(highest - p.partner_level) <= step) return true;
    }
    return false;
  }

  /// Height along n of what t touches beside block q; of terrain and structures, of the triangles about the
  /// touched one.
  double highest_of_other(const Touch& t, int q, const Vec3& n) const {
    if (t.b != q) return heights(model_, state_, t.b, n).high;
    switch (t.a.kind) {
      case Partner::Kind::block: return heights(model_, state_, t.a.index, n).high;
      case Partner::Kind::terrain:
        return heights_around(*env_.terrain,
                              t.at.face_a >= 0 ? t.at.face_a : env_.terrain->triangle_at(t.at.point_a), n)
            .high;
      case Partner::Kind::structure:
        return heights_around(*env_.structures[static_cast<std::size_t>(t.a.index)].index, t.at.face_a, n)
            .high;
      case Partner::Kind::plane: break;
    }
    return std::numeric_limits<double>::infinity();
  }

  const dda::Model& model_;
  const dda::State& state_;
  const Environment& env_;
  double flush_, at_skins_;
  const std::vector<Touch>& touches_;
  std::vector<char> dropped_;
  std::vector<std::size_t> first_;
  std::vector<Support> resting_;  // contacts of every block, from first_[block] on, by their normals
  std::vector<std::size_t> first_facing_;
  std::vector<Facing> facings_;  // of every block, from first_facing_[block] on
};

}  // namespace

void drop_internal_edges(const dda::Model& m, const dda::State& s, const Environment& env, double flush,
                         double at_skins, std::vector<Touch>& touches) {
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

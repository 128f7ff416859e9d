#include "contact/skin/skin_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::contact {
namespace {

constexpr double along = 0.985;  // cosine up to which faces press on each other (10 degrees)

class Cover {
 public:
  explicit Cover(const SkinNear& at) : at_(at) {}

  void run(std::vector<SkinPatch>& patches) {
    // A triangle is taken by its nearest corner, along the normal of the block's face.
    double beside = 0;
    for (const int t : at_.triangles) beside = std::max(beside, at_.skin.triangle_box(t).diagonal().norm());
    beside += std::max(at_.margin, at_.deepest);
    BoxTree tree;
    tree.build(static_cast<int>(at_.triangles.size()), [&](int i) {
      Box3 box = at_.skin.triangle_box(at_.triangles[static_cast<std::size_t>(i)]);
      box.min().array() -= beside;
      box.max().array() += beside;
      return box;
    });
    std::vector<int> over;
    for (int f = 0; f < at_.block.faces(); ++f) {
      SkinPatch p;
      p.face = f;
      p.point = at_.corner[static_cast<std::size_t>(at_.block.face_vertices[static_cast<std::size_t>(
          at_.block.face_offset[static_cast<std::size_t>(f)])])];
      p.normal = -at_.normal[static_cast<std::size_t>(f)];
      find_over(f, tree, over);
      for (const int i : over)
        if (at_.triangle_normal[static_cast<std::size_t>(i)].dot(p.normal) >= along)
          cover(p, at_.triangles[static_cast<std::size_t>(i)]);
      std::sort(p.shares.begin(), p.shares.end(),
                [](const SkinShare& a, const SkinShare& b) { return a.vertex < b.vertex; });
      if (!p.shares.empty() && !across(p)) patches.push_back(std::move(p));
    }
  }

 private:
  /// Near triangles that face f may lie over, ascending. `tree` holds their boxes.
  void find_over(int f, const BoxTree& tree, std::vector<int>& over) const {
    over.clear();
    Box3 box;
    for (int i = at_.block.face_offset[static_cast<std::size_t>(f)];
         i < at_.block.face_offset[static_cast<std::size_t>(f) + 1]; ++i)
      box.extend(at_.corner[static_cast<std::size_t>(at_.block.face_vertices[static_cast<std::size_t>(i)])]);
    tree.traverse(
        [&](const Vec3& lo, const Vec3& hi) {
          return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
        },
        [&](int i) {
          over.push_back(i);
          return true;
        });
    std::sort(over.begin(), over.end());
  }

  /// True for a strip of a face that is deeper than wide: there the block lies across another face of the
  /// structure, and not on this one. A face that sank in as a whole, however small it is beside the depth (a
  /// sphere's), is no strip.
  bool across(const SkinPatch& p) const {
    double area = 0, depth = 0;
    for (const SkinShare& share : p.shares)
      area += share.area, depth += p.normal.dot(share.moment - share.area * p.point);
    if (depth <= 0.1 * at_.block.inradius * area || depth * depth <= area * area * area) return false;
    return area < 0.5 * at_.face_area(p.face);
  }

  void cover(SkinPatch& p, int t) {
    const double cosine = at_.skin.normal[static_cast<std::size_t>(t)].dot(p.normal);
    const auto& v = at_.skin.surface.triangles[static_cast<std::size_t>(t)];
    const Vec3 corner[3] = {at_.skin.surface.vertices[static_cast<std::size_t>(v[0])],
                            at_.skin.surface.vertices[static_cast<std::size_t>(v[1])],
                            at_.skin.surface.vertices[static_cast<std::size_t>(v[2])]};
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& x : corner) nearest = std::min(nearest, p.normal.dot(p.point - x));
    if (nearest > at_.margin || nearest < -at_.deepest) return;
    for (const std::size_t k : at_.triangles_of(p.face)) {
      polygon_.assign(corner, corner + 3);
      for (int side = 0; side < 3 && !polygon_.empty(); ++side) clip(k, side);
      if (polygon_.size() < 3) continue;
      p.straightest = std::min(p.straightest, cosine);
      for (std::size_t i = 1; i + 1 < polygon_.size(); ++i)
        share(p, t, polygon_[0], polygon_[i], polygon_[i + 1]);
    }
  }

  void clip(std::size_t triangle, int side) {
    next_.clear();
    for (std::size_t i = 0; i < polygon_.size(); ++i) {
      const Vec3 &a = polygon_[i], &b = polygon_[(i + 1) % polygon_.size()];
      const double da = at_.inside(triangle, a, side), db = at_.inside(triangle, b, side);
      if (da >= 0) next_.push_back(a);
      if ((da >= 0) != (db >= 0)) next_.push_back(a + da / (da - db) * (b - a));
    }
    polygon_.swap(next_);
  }

  /// Adds a covered piece of triangle t to its vertices; the centre of a face hands a quarter to each of its
  /// nodes.
  void share(SkinPatch& p, int t, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double area = 0.5 * std::abs(p.normal.dot((b - a).cross(c - a)));
    if (!(area > 0)) return;
    const auto& v = at_.skin.surface.triangles[static_cast<std::size_t>(t)];
    for (const Vec3& x :
         {Vec3(0.5 * (a + b)), Vec3(0.5 * (b + c)), Vec3(0.5 * (c + a))}) {  // exact for N_i x
      const Vec3 l = at_.barycentric(t, x);
      for (int k = 0; k < 3; ++k) {
        const int vertex = v[static_cast<std::size_t>(k)];
        const double part = area / 3 * l[k];
        if (k < 2) {  // the third is the face's centre
          give(p, vertex, t, part, x);
        } else {
          for (int q = 0; q < 4; ++q) {  // the four triangles of a face follow each other
            const int sibling = 4 * (t / 4) + q;
            give(p, at_.skin.surface.triangles[static_cast<std::size_t>(sibling)][0], sibling, 0.25 * part,
                 x);
          }
        }
      }
    }
  }

  static void give(SkinPatch& p, int vertex, int t, double part, const Vec3& x) {
    auto share = std::find_if(p.shares.rbegin(), p.shares.rend(),
                              [vertex](const SkinShare& q) { return q.vertex == vertex; });
    if (share == p.shares.rend()) {
      p.shares.emplace_back().vertex = vertex;
      share = p.shares.rbegin();
    }
    share->area += part;
    share->moment += part * x;
    share->triangle = t;
  }

  const SkinNear& at_;
  std::vector<Vec3> polygon_, next_;
};

}  // namespace

void cover_skin(const SkinNear& at, std::vector<SkinPatch>& patches) { Cover(at).run(patches); }

}  // namespace talus::contact

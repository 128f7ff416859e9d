#include "contact/skin/skin_patch.hpp"
#include "contact/tolerances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace talus::contact {
namespace {

constexpr double one_plane =
    0.97;  // faces of the block that press on one node are one contact up to this cosine (14 degrees)
constexpr double one_level = 0.1;  // and as far apart as this share of a skin triangle
constexpr double beside = 0.02;    // contacts of one plane as near as this share of a skin triangle are one

/// A share of a patch as a contact of its own.
struct Pressed {
  const SkinPatch* patch;
  const SkinShare* share;
  double gap;  // at the centroid of the share
};

class Press {
 public:
  explicit Press(const SkinNear& at) : at_(at) {}

  void run(const std::vector<SkinPatch>& patches, std::vector<ContactPoint>& out) {
    thread_local std::vector<Pressed> pressed, together;
    pressed.clear();
    for (const SkinPatch& p : patches)
      for (const SkinShare& share : p.shares)
        if (share.area > 0)
          pressed.push_back({&p, &share, p.normal.dot(p.point - share.moment / share.area)});
    std::stable_sort(pressed.begin(), pressed.end(),
                     [](const Pressed& a, const Pressed& b) { return a.share->vertex < b.share->vertex; });
    const std::size_t first = out.size();
    for (std::size_t i = 0; i < pressed.size(); ++i) {
      if (pressed[i].patch == nullptr) continue;  // taken
      together.clear();
      const Pressed leader = pressed[i];
      for (std::size_t k = i; k < pressed.size() && pressed[k].share->vertex == leader.share->vertex; ++k) {
        Pressed& q = pressed[k];
        if (q.patch == nullptr || q.patch->normal.dot(leader.patch->normal) < one_plane ||
            std::abs(q.gap - leader.gap) > one_level * at_.size(leader.share->triangle))
          continue;
        together.push_back(q);
        q.patch = nullptr;
      }
      if (together.size() == 1)
        add(*leader.patch, *leader.share, out);
      else
        add_together(together, out);
    }
    join_neighbours(out, first);
  }

 private:
  void add(const SkinPatch& p, const SkinShare& share, std::vector<ContactPoint>& out) const {
    const Vec3& node = at_.skin.surface.vertices[static_cast<std::size_t>(share.vertex)];
    ContactPoint c;
    c.face_a = share.triangle;
    c.point_a = node;
    if (!at_.covers(p.face, node)) put_at(share.moment / share.area, share.vertex, c);
    finish(c, p.normal, p.normal.dot(p.point - c.point_a), share.area, p.face, share.vertex, out);
  }

  /// One contact at the centroid of all, with the mean gap.
  void add_together(std::span<const Pressed> together, std::vector<ContactPoint>& out) const {
    double area = 0, gap = 0;
    Vec3 moment = Vec3::Zero(), normal = Vec3::Zero();
    int face = together.front().patch->face;
    for (const Pressed& q : together) {
      area += q.share->area;
      gap += q.share->area * q.gap;
      moment += q.share->moment;
      normal += q.share->area * q.patch->normal;
      face = std::min(face, q.patch->face);
    }
    ContactPoint c;
    put_at(moment / area, together.front().share->vertex, c);
    finish(c, normal.normalized(), gap / area, area, face, together.front().share->vertex, out);
  }

  void finish(ContactPoint& c, const Vec3& normal, double gap, double area, int face, int vertex,
              std::vector<ContactPoint>& out) const {
    if (gap > at_.margin) return;
    c.normal = normal;
    c.gap = gap;
    c.point_b = c.point_a + gap * normal;
    c.area = area;
    c.key = make_key(Form::skin_face, face, vertex);
    c.face_b = face;
    out.push_back(c);
  }

  /// Puts the contact at x on the nearest triangle around the vertex.
  void put_at(const Vec3& x, int vertex, ContactPoint& c) const {
    double nearest = std::numeric_limits<double>::infinity();
    const auto k = static_cast<std::size_t>(vertex);
    for (int i = at_.skin.vertex_offset[k]; i < at_.skin.vertex_offset[k + 1]; ++i) {
      const int t = at_.skin.vertex_triangle[static_cast<std::size_t>(i)];
      for (int q = 4 * (t / 4); q < 4 * (t / 4) + 4; ++q) {  // the four triangles of a face follow each other
        const Vec3 y = at_.on_triangle(q, x);
        const double d = (y - x).squaredNorm();
        if (d < nearest * (1 - tolerances().same_place) ||
            (d <= nearest * (1 + tolerances().same_place) && q < c.face_a))
          nearest = d, c.face_a = q, c.point_a = y;
      }
    }
  }

  void join_neighbours(std::vector<ContactPoint>& out, std::size_t first) const {
    std::size_t kept = first;
    for (std::size_t i = first; i < out.size(); ++i) {
      ContactPoint* host = nullptr;
      for (std::size_t j = first; j < kept && host == nullptr; ++j)
        if ((out[j].point_a - out[i].point_a).norm() < beside * at_.size(out[i].face_a) &&
            out[j].normal.dot(out[i].normal) > one_plane)
          host = &out[j];
      if (host == nullptr) {
        out[kept++] = out[i];
        continue;
      }
      const double area = host->area + out[i].area;
      if (out[i].area > host->area) *host = out[i];
      host->area = area;
    }
    out.resize(kept);
  }

  const SkinNear& at_;
};

}  // namespace

void press_on_nodes(const SkinNear& at, const std::vector<SkinPatch>& patches,
                    std::vector<ContactPoint>& out) {
  Press(at).run(patches, out);
}

}  // namespace talus::contact

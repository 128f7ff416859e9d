#include "contact/skin_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "contact/narrow_math.hpp"
#include "contact/surface_index.hpp"

namespace talus::contact {
namespace {

constexpr double along = 0.985;       // cosine up to which faces press on each other (10 degrees)
constexpr double parallel = 0.9998;   // up to which single vertices and edges add nothing to that
constexpr double one_plane = 0.97;     // faces of the block that press on one node are one contact up to this cosine (14 degrees)
constexpr double one_level = 0.1;     // and as far apart as this share of a skin triangle
constexpr double beside = 0.02;       // contacts of one plane as near as this share of a skin triangle are one
constexpr double facing = -0.3;       // skin's normal against the direction of a vertex: a cube's corner faces three planes by -0.58

/// What of the skin's shape function of one vertex is covered: area and first moment.
struct Share {
  int vertex = 0;
  double area = 0;
  Vec3 moment = Vec3::Zero();
  int triangle = -1;
};

/// One face of the block that lies on the skin.
struct Patch {
  int face = 0;
  Vec3 point, normal;   // a point of the block's face; out of the structure
  double straightest = 1;   // least cosine between both sides' normals
  std::vector<Share> shares;   // by skin vertex, ascending once complete
};

/// A share of a patch as a contact of its own.
struct Pressed {
  const Patch* patch;
  const Share* share;
  double gap;   // at the centroid of the share
};

class Finder {
 public:
  Finder(const SurfaceIndex& index, const Polyhedron& block, const Pose& pose, double margin) : s_(index.impl()), index_(index), block_(block), margin_(margin), deepest_((block.convex ? 1.9 : 0.5) * block.inradius) {
    for (const Vec3& x : block.vertices) x_.push_back(pose.world(x));
    const Mat3 cof = narrow::cofactor(pose.F);
    for (const Vec3& n : block.face_normals) normal_.push_back((cof * n).normalized());
    into_.resize(3 * block.triangles.size());
    for (std::size_t k = 0; k < block.triangles.size(); ++k)
      for (std::size_t side = 0; side < 3; ++side) {
        const Vec3& a = x_[static_cast<std::size_t>(block.triangles[k][side])];
        const Vec3& b = x_[static_cast<std::size_t>(block.triangles[k][(side + 1) % 3])];
        into_[3 * k + side] = normal_[static_cast<std::size_t>(block.triangle_face[k])].cross(b - a).normalized();
      }
    // In the world's axes, and in the block's own: a tilted slab fills little of the first. Seen along a face's normal a skin triangle may
    // leave the box by its own slope.
    const Box3 box = bounds(block, pose, margin);
    const Mat3 back = pose.F.inverse();
    Box3 own;
    for (const Vec3& x : block.vertices) own.extend(x);
    s_.tree.traverse([&](const Vec3& lo, const Vec3& hi) { return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all(); },
                     [&](int t) {
                       const Box3 of_triangle = s_.triangle_box(t);
                       if (!of_triangle.intersects(box)) return true;
                       Box3 seen;
                       for (const int v : s_.surface.triangles[static_cast<std::size_t>(t)]) seen.extend(back * (s_.surface.vertices[static_cast<std::size_t>(v)] - pose.c));
                       const double about = (margin + deepest_ + 0.2 * of_triangle.diagonal().norm()) * back.norm();
                       seen.min().array() -= about;
                       seen.max().array() += about;
                       if (seen.intersects(own)) near_.push_back(t);
                       return true;
                     });
    std::sort(near_.begin(), near_.end());
    for (const int t : near_) near_normal_.push_back(s_.normal[static_cast<std::size_t>(t)]);
  }

  bool nothing_near() const { return near_.empty(); }

  void run(std::vector<Patch>& patches) {
    order_triangles();
    // A triangle is taken by its nearest corner, along the normal of the block's face.
    double beside = 0;
    for (const int t : near_) beside = std::max(beside, s_.triangle_box(t).diagonal().norm());
    beside += std::max(margin_, deepest_);
    BoxTree tree;
    tree.build(static_cast<int>(near_.size()), [&](int i) {
      Box3 box = s_.triangle_box(near_[static_cast<std::size_t>(i)]);
      box.min().array() -= beside;
      box.max().array() += beside;
      return box;
    });
    std::vector<int> over;
    for (int f = 0; f < block_.faces(); ++f) {
      Patch p;
      p.face = f;
      p.point = x_[static_cast<std::size_t>(block_.face_vertices[static_cast<std::size_t>(block_.face_offset[static_cast<std::size_t>(f)])])];
      p.normal = -normal_[static_cast<std::size_t>(f)];
      find_over(f, tree, over);
      for (const int i : over)
        if (near_normal_[static_cast<std::size_t>(i)].dot(p.normal) >= along) cover(p, near_[static_cast<std::size_t>(i)]);
      std::sort(p.shares.begin(), p.shares.end(), [](const Share& a, const Share& b) { return a.vertex < b.vertex; });
      if (!p.shares.empty() && !across(p)) patches.push_back(std::move(p));
    }
  }

  /// Contacts of the patches on the nodes of the skin. Faces of the block that press on a node side by side (triangles of a bent face) are
  /// one contact, and so are shares of several nodes at one place: else a piece with a rough face has ten contacts where it has one.
  void press(const std::vector<Patch>& patches, std::vector<ContactPoint>& out) {
    thread_local std::vector<Pressed> pressed, together;
    pressed.clear();
    for (const Patch& p : patches)
      for (const Share& share : p.shares)
        if (share.area > 0) pressed.push_back({&p, &share, p.normal.dot(p.point - share.moment / share.area)});
    std::stable_sort(pressed.begin(), pressed.end(), [](const Pressed& a, const Pressed& b) { return a.share->vertex < b.share->vertex; });
    const std::size_t first = out.size();
    for (std::size_t i = 0; i < pressed.size(); ++i) {
      if (pressed[i].patch == nullptr) continue;   // taken
      together.clear();
      const Pressed leader = pressed[i];
      for (std::size_t k = i; k < pressed.size() && pressed[k].share->vertex == leader.share->vertex; ++k) {
        Pressed& q = pressed[k];
        if (q.patch == nullptr || q.patch->normal.dot(leader.patch->normal) < one_plane || std::abs(q.gap - leader.gap) > one_level * size(leader.share->triangle)) continue;
        together.push_back(q);
        q.patch = nullptr;
      }
      if (together.size() == 1) add(*leader.patch, *leader.share, out);
      else add_together(together, out);
    }
    join_neighbours(out, first);
  }

  /// Vertices of the block over faces of the skin that they face: the nearest one, and others of another direction that are as near
  /// (inner corners). Not vertices of a face that lies flat on the skin.
  void add_vertices(const std::vector<Patch>& patches, std::vector<ContactPoint>& out) {
    struct Candidate { int triangle; double gap; bool beside; };
    std::vector<Candidate> found;
    for (std::size_t v = 0; v < x_.size(); ++v) {
      const int first = block_.vertex_edge_offset[v], last = block_.vertex_edge_offset[v + 1];
      Vec3 outward = Vec3::Zero();
      bool flat = false;
      for (int i = first; i < last; ++i) {
        const auto& e = block_.edges[static_cast<std::size_t>(block_.vertex_edges[static_cast<std::size_t>(i)])];
        for (const int f : {e.left, e.right}) {
          outward += normal_[static_cast<std::size_t>(f)];
          for (const Patch& p : patches) flat = flat || (p.face == f && p.straightest > parallel);
        }
      }
      if (flat || first == last || !(outward.norm() > 1e-6)) continue;
      outward.normalize();
      found.clear();
      double before = std::numeric_limits<double>::infinity(), behind = before;   // how far it lies before a face, behind one
      for (const int t : near_) {
        const Vec3& n = s_.normal[static_cast<std::size_t>(t)];
        const double gap = n.dot(x_[v] - s_.surface.vertices[static_cast<std::size_t>(s_.surface.triangles[static_cast<std::size_t>(t)][0])]);
        const bool faces = n.dot(outward) <= facing && gap <= margin_ && gap >= -deepest_;
        const bool nearer = gap > 0 ? gap < std::min(before, deepest_) : -gap < behind;
        if (!faces && !nearer) continue;
        const double within = barycentric(t, x_[v]).minCoeff();
        if (nearer && within >= -1e-9) (gap > 0 ? before : behind) = std::abs(gap);
        // Below an edge of the skin the faces' normals part: a vertex inside may lie over none of them by as much as it is deep.
        if (faces && within >= -1e-9 - 0.2 * std::max(0.0, -gap) / size(t)) found.push_back({t, gap, within < -1e-9});
      }
      // One before a face next to it is not inside, though it lies lower than another.
      // Nor is one that came out on the other side: it went round the structure's rim.
      std::erase_if(found, [&](const Candidate& q) { return q.gap < 0 && before < (q.beside ? -q.gap : behind); });
      std::stable_sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return std::abs(a.gap) < std::abs(b.gap); });
      std::vector<Vec3> taken;
      for (const Candidate& q : found) {
        const Vec3& n = s_.normal[static_cast<std::size_t>(q.triangle)];
        if (!taken.empty() && std::abs(q.gap) > 2 * std::abs(found[0].gap) + 1e-6 * block_.radius) break;
        if (std::any_of(taken.begin(), taken.end(), [&](const Vec3& m) { return m.dot(n) > 0.8; })) continue;
        ContactPoint c;
        c.face_a = q.triangle;
        c.point_a = on_triangle(q.triangle, x_[v]);
        c.point_b = x_[v];
        c.normal = n;
        c.gap = n.dot(c.point_b - c.point_a);
        c.area = 0;
        c.key = (std::uint64_t{8} << 60) | (static_cast<std::uint64_t>(taken.size()) << 30) | static_cast<std::uint64_t>(v);
        taken.push_back(n);
        out.push_back(c);
      }
      if (!taken.empty()) handled_.push_back(static_cast<int>(v));
    }
  }

  /// True if a contact of the general search is at a vertex that has been dealt with.
  bool at_handled_vertex(const ContactPoint& c) const {
    for (const int v : handled_)
      if ((c.point_b - x_[static_cast<std::size_t>(v)]).norm() < 2 * std::max(0.0, -c.gap) + 1e-5 * block_.radius) return true;
    return false;
  }

  /// True if a vertex or edge contact says nothing that the patch does not.
  bool contained(const Patch& p, const ContactPoint& c) const {
    const double deep = std::max(0.0, -c.gap) + 1e-6 * block_.radius;
    if (std::abs(p.normal.dot(c.point_b - p.point)) > deep) return false;   // not of this face
    const double aligned = c.normal.dot(p.normal);
    if (aligned > 0.866) return p.straightest > parallel;
    if (std::abs(aligned) > 0.5) return false;
    // Beside the face: an obstacle only if it rises above the skin that the face lies on.
    const auto& tri = s_.surface.triangles[static_cast<std::size_t>(c.face_a >= 0 ? c.face_a : index_.triangle_at(c.point_a))];
    for (const int v : tri)
      if (p.normal.dot(s_.surface.vertices[static_cast<std::size_t>(v)] - p.point) > 2 * deep) return false;
    return true;
  }

 private:
  /// Triangles of the block by face.
  void order_triangles() {
    first_.assign(static_cast<std::size_t>(block_.faces()) + 1, 0);
    for (const int f : block_.triangle_face) ++first_[static_cast<std::size_t>(f) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    by_face_.resize(block_.triangles.size());
    std::vector<std::size_t> at(first_.begin(), first_.end() - 1);
    for (std::size_t k = 0; k < by_face_.size(); ++k) by_face_[at[static_cast<std::size_t>(block_.triangle_face[k])]++] = k;
  }
  std::span<const std::size_t> triangles_of(int face) const {
    const std::size_t first = first_[static_cast<std::size_t>(face)];
    return std::span(by_face_).subspan(first, first_[static_cast<std::size_t>(face) + 1] - first);
  }

  /// Near triangles that face f may lie over, ascending. `tree` holds their boxes.
  void find_over(int f, const BoxTree& tree, std::vector<int>& over) const {
    over.clear();
    Box3 box;
    for (int i = block_.face_offset[static_cast<std::size_t>(f)]; i < block_.face_offset[static_cast<std::size_t>(f) + 1]; ++i)
      box.extend(x_[static_cast<std::size_t>(block_.face_vertices[static_cast<std::size_t>(i)])]);
    tree.traverse([&](const Vec3& lo, const Vec3& hi) { return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all(); },
                  [&](int i) {
                    over.push_back(i);
                    return true;
                  });
    std::sort(over.begin(), over.end());
  }

  /// True for a strip of a face that is deeper than wide: there the block lies across another face of the structure, and not on this one. A
  /// face that sank in as a whole, however small it is beside the depth (a sphere's), is no strip.
  bool across(const Patch& p) const {
    double area = 0, depth = 0;
    for (const Share& share : p.shares) area += share.area, depth += p.normal.dot(share.moment - share.area * p.point);
    if (depth <= 0.1 * block_.inradius * area || depth * depth <= area * area * area) return false;
    return area < 0.5 * face_area(p.face);
  }

  double face_area(int face) const {
    double area = 0;
    for (const std::size_t k : triangles_of(face)) {
      const auto& t = block_.triangles[k];
      const Vec3 &a = x_[static_cast<std::size_t>(t[0])], &b = x_[static_cast<std::size_t>(t[1])], &c = x_[static_cast<std::size_t>(t[2])];
      area += 0.5 * (b - a).cross(c - a).norm();
    }
    return area;
  }

  void add(const Patch& p, const Share& share, std::vector<ContactPoint>& out) const {
    const Vec3& node = s_.surface.vertices[static_cast<std::size_t>(share.vertex)];
    ContactPoint c;
    c.face_a = share.triangle;
    c.point_a = node;
    if (!covers(p, node)) put_at(share.moment / share.area, share.vertex, c);
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

  void finish(ContactPoint& c, const Vec3& normal, double gap, double area, int face, int vertex, std::vector<ContactPoint>& out) const {
    if (gap > margin_) return;
    c.normal = normal;
    c.gap = gap;
    c.point_b = c.point_a + gap * normal;
    c.area = area;
    c.key = (std::uint64_t{7} << 60) | (static_cast<std::uint64_t>(face) << 30) | static_cast<std::uint64_t>(vertex);
    c.face_b = face;
    out.push_back(c);
  }

  /// Puts the contact at x on the nearest triangle around the vertex.
  void put_at(const Vec3& x, int vertex, ContactPoint& c) const {
    double nearest = std::numeric_limits<double>::infinity();
    const auto k = static_cast<std::size_t>(vertex);
    for (int i = s_.vertex_offset[k]; i < s_.vertex_offset[k + 1]; ++i) {
      const int t = s_.vertex_triangle[static_cast<std::size_t>(i)];
      for (int q = 4 * (t / 4); q < 4 * (t / 4) + 4; ++q) {   // the four triangles of a face follow each other
        const Vec3 y = on_triangle(q, x);
        const double d = (y - x).squaredNorm();
        if (d < nearest * (1 - 1e-9) || (d <= nearest * (1 + 1e-9) && q < c.face_a)) nearest = d, c.face_a = q, c.point_a = y;
      }
    }
  }

  void join_neighbours(std::vector<ContactPoint>& out, std::size_t first) const {
    std::size_t kept = first;
    for (std::size_t i = first; i < out.size(); ++i) {
      ContactPoint* host = nullptr;
      for (std::size_t j = first; j < kept && host == nullptr; ++j)
        if ((out[j].point_a - out[i].point_a).norm() < beside * size(out[i].face_a) && out[j].normal.dot(out[i].normal) > one_plane) host = &out[j];
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

  /// Inward distances of x from the sides of a triangle of the block's face, seen along it.
  double inside(std::size_t triangle, const Vec3& x, int side) const {
    const Vec3& a = x_[static_cast<std::size_t>(block_.triangles[triangle][static_cast<std::size_t>(side)])];
    return into_[3 * triangle + static_cast<std::size_t>(side)].dot(x - a);
  }

  bool covers(const Patch& p, const Vec3& x) const {
    const double slack = -1e-6 * block_.radius;
    for (const std::size_t k : triangles_of(p.face)) {
      bool all = true;
      for (int side = 0; side < 3 && all; ++side) all = inside(k, x, side) >= slack;
      if (all) return true;
    }
    return false;
  }

  Vec3 on_triangle(int t, const Vec3& x) const {
    const Vec3 l = barycentric(t, x).cwiseMax(0.0);
    const auto& v = s_.surface.triangles[static_cast<std::size_t>(t)];
    Vec3 p = Vec3::Zero();
    for (int k = 0; k < 3; ++k) p += l[k] / l.sum() * s_.surface.vertices[static_cast<std::size_t>(v[static_cast<std::size_t>(k)])];
    return p;
  }

  double size(int t) const {
    const auto& v = s_.surface.triangles[static_cast<std::size_t>(t)];
    return (s_.surface.vertices[static_cast<std::size_t>(v[1])] - s_.surface.vertices[static_cast<std::size_t>(v[0])]).norm();
  }

  Vec3 barycentric(int t, const Vec3& x) const {
    const auto& v = s_.surface.triangles[static_cast<std::size_t>(t)];
    const Vec3 &a = s_.surface.vertices[static_cast<std::size_t>(v[0])], &b = s_.surface.vertices[static_cast<std::size_t>(v[1])],
               &c = s_.surface.vertices[static_cast<std::size_t>(v[2])];
    const Vec3 n = (b - a).cross(c - a);
    return Vec3(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x))) / n.squaredNorm();
  }

  void cover(Patch& p, int t) {
    const double cosine = s_.normal[static_cast<std::size_t>(t)].dot(p.normal);
    const auto& v = s_.surface.triangles[static_cast<std::size_t>(t)];
    const Vec3 corner[3] = {s_.surface.vertices[static_cast<std::size_t>(v[0])], s_.surface.vertices[static_cast<std::size_t>(v[1])], s_.surface.vertices[static_cast<std::size_t>(v[2])]};
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& x : corner) nearest = std::min(nearest, p.normal.dot(p.point - x));
    if (nearest > margin_ || nearest < -deepest_) return;
    for (const std::size_t k : triangles_of(p.face)) {
      polygon_.assign(corner, corner + 3);
      for (int side = 0; side < 3 && !polygon_.empty(); ++side) clip(k, side);
      if (polygon_.size() < 3) continue;
      p.straightest = std::min(p.straightest, cosine);
      for (std::size_t i = 1; i + 1 < polygon_.size(); ++i) share(p, t, polygon_[0], polygon_[i], polygon_[i + 1]);
    }
  }

  void clip(std::size_t triangle, int side) {
    next_.clear();
    for (std::size_t i = 0; i < polygon_.size(); ++i) {
      const Vec3 &a = polygon_[i], &b = polygon_[(i + 1) % polygon_.size()];
      const double da = inside(triangle, a, side), db = inside(triangle, b, side);
      if (da >= 0) next_.push_back(a);
      if ((da >= 0) != (db >= 0)) next_.push_back(a + da / (da - db) * (b - a));
    }
    polygon_.swap(next_);
  }

  /// Adds a covered piece of triangle t to its vertices; the centre of a face hands a quarter to each of its nodes.
  void share(Patch& p, int t, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double area = 0.5 * std::abs(p.normal.dot((b - a).cross(c - a)));
    if (!(area > 1e-14 * block_.radius * block_.radius)) return;
    const auto& v = s_.surface.triangles[static_cast<std::size_t>(t)];
    for (const Vec3& x : {Vec3(0.5 * (a + b)), Vec3(0.5 * (b + c)), Vec3(0.5 * (c + a))}) {   // exact for N_i x
      const Vec3 l = barycentric(t, x);
      for (int k = 0; k < 3; ++k) {
        const int vertex = v[static_cast<std::size_t>(k)];
        const double part = area / 3 * l[k];
        if (s_.surface.nodes[static_cast<std::size_t>(vertex)].count == 1) {
          give(p, vertex, t, part, x);
        } else {
          for (int q = 0; q < 4; ++q) {   // the four triangles of a face follow each other
            const int sibling = 4 * (t / 4) + q;
            give(p, s_.surface.triangles[static_cast<std::size_t>(sibling)][0], sibling, 0.25 * part, x);
          }
        }
      }
    }
  }

  static void give(Patch& p, int vertex, int t, double part, const Vec3& x) {
    auto share = std::find_if(p.shares.rbegin(), p.shares.rend(), [vertex](const Share& q) { return q.vertex == vertex; });
    if (share == p.shares.rend()) {
      p.shares.emplace_back().vertex = vertex;
      share = p.shares.rbegin();
    }
    share->area += part;
    share->moment += part * x;
    share->triangle = t;
  }

  const SurfaceIndex::Impl& s_;
  const SurfaceIndex& index_;
  const Polyhedron& block_;
  double margin_;
  double deepest_;   // overlap that is still read as contact: a convex block less than its height, so that it is never one through a plate
  std::vector<Vec3> x_, normal_, near_normal_;
  std::vector<Vec3> into_;   // per side of a triangle of the block, in its plane, inward
  std::vector<int> near_, handled_;
  std::vector<std::size_t> first_, by_face_;   // faces + 1; triangles of the block, those of a face beside each other
  std::vector<Vec3> polygon_, next_;
};

}  // namespace

int skin_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin, std::vector<ContactPoint>& out) {
  const std::size_t before = out.size();
  Finder finder(index, B, pose_b, margin);
  if (finder.nothing_near()) return 0;
  thread_local std::vector<ContactPoint> points;
  points.clear();
  surface_block(index, B, pose_b, margin, points);
  std::vector<Patch> patches;
  finder.run(patches);
  finder.press(patches, out);
  finder.add_vertices(patches, out);
  for (const ContactPoint& c : points) {
    bool said = c.area == 0 && finder.at_handled_vertex(c);
    for (const Patch& p : patches) said = said || (c.area > 0 ? c.face_b < 0 || c.face_b == p.face : finder.contained(p, c));
    if (!said) out.push_back(c);
  }
  return static_cast<int>(out.size() - before);
}

}  // namespace talus::contact

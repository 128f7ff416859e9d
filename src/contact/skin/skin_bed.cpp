#include "contact/skin/skin_bed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_math.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {
namespace {

constexpr double one_direction = 0.9;  // cosine between normals of faces that a block sinks into together
constexpr double inner = 0.15;  // a line as near to the end of what it cuts, over its length, leaves it whole
constexpr double sliver =
    0.1;  // width over depth, or over the block's inradius, of what is overlapped from the side
constexpr double stands_out = 4;  // depth over that of the other faces of its direction
constexpr double steep = 0.02;    // facets of the block steeper than this against the normal show no area

using Polygon = std::vector<Vec3>;  // (u, v, depth) in the face's axes

/// One quadrilateral of the skin with axes of its own.
struct Face {
  int first = 0;  // of its four triangles
  Vec3 centre, normal, u, v;
  Vec3 corner[4];  // in its axes
  Vec3 local(const Vec3& x) const { return {u.dot(x - centre), v.dot(x - centre), -normal.dot(x - centre)}; }
  Vec3 place(const Vec3& p) const { return centre + p.x() * u + p.y() * v; }
};

Face face_at(const TriangleSurface& s, int first) {
  Face f;
  f.first = first;
  Vec3 x[4];
  for (int k = 0; k < 4; ++k)
    x[k] = s.vertices[static_cast<std::size_t>(s.triangles[static_cast<std::size_t>(first + k)][0])];
  f.centre = 0.25 * (x[0] + x[1] + x[2] + x[3]);
  f.normal = (x[2] - x[0]).cross(x[3] - x[1]).normalized();
  f.u = (x[1] - x[0] + x[2] - x[3]);
  f.u = (f.u - f.normal * f.normal.dot(f.u)).normalized();
  f.v = f.normal.cross(f.u);
  for (int k = 0; k < 4; ++k) f.corner[k] = f.local(x[k]);
  return f;
}

/// Keeps of the polygon where a linear function of (u, v, depth) is not negative. Each corner is asked once:
/// a second answer may round to the other side of zero, and the corner would be lost.
template <class Function>
void keep(Polygon& polygon, Polygon& next, const Function& value) {
  next.clear();
  if (polygon.empty()) return;
  const double first = value(polygon[0]);
  double va = first;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const bool last = i + 1 == polygon.size();
    const Vec3 &a = polygon[i], &b = polygon[last ? 0 : i + 1];
    const double vb = last ? first : value(b);
    if (va >= 0) next.push_back(a);
    if ((va >= 0) != (vb >= 0)) next.push_back(a + va / (va - vb) * (b - a));
    va = vb;
  }
  polygon.swap(next);
}

double fan_area(const Polygon& p, std::size_t i) {
  const Vec3 a = p[i] - p[0], b = p[i + 1] - p[0];
  return 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
}

/// On which side of the line from a to b, seen from above; > 0: left.
double side_of(const Vec3& a, const Vec3& b, const Vec3& x) {
  return (b.x() - a.x()) * (x.y() - a.y()) - (b.y() - a.y()) * (x.x() - a.x());
}

/// A plane piece of the block's lower surface over one face.
struct Piece {
  std::size_t face;
  int cell, facet;
  Polygon polygon;
  Vec3 lift;
  bool sunk;
  std::array<double, 4> past{};  // how far the block's facet reaches past each border of the face [m]
};

/// Faces that the block sinks into along nearly the same normal.
struct Direction {
  Vec3 normal;
  double area = 0;  // sunk in
  Vec3 moment = Vec3::Zero();
  double near_area = 0;  // above, within reach
  Vec3 near_moment = Vec3::Zero();
  Vec3 middle() const { return area > 0 ? Vec3(moment / area) : Vec3(near_moment / near_area); }
};

/// What of the block has sunk in below one face.
struct Sunk {
  std::size_t face;
  double area = 0, volume = 0;
  Vec3 moment = Vec3::Zero();
  double reach_sq = 0;  // of what is farthest from its middle [m^2]
  bool across = false;  // see leave_out_across()
  double depth() const { return volume / area; }
  Vec3 middle() const { return moment / area; }
  double width() const { return area / (2 * std::sqrt(reach_sq)); }  // of the footprint, at least
};

class BedFinder {
 public:
  BedFinder(const SurfaceIndex& index, const Polyhedron& block, const Pose& pose, double reach, double yield)
      : s_(index.impl()), block_(block), reach_(reach), yield_(yield) {
    for (const Vec3& x : block.vertices) x_.push_back(pose.world(x));
    const Mat3 cof = narrow::cofactor(pose.F);
    for (const Vec3& n : block.face_normals) normal_.push_back((cof * n).normalized());
    const Box3 box = bounds(block, pose, reach);
    std::vector<int> first;
    s_.tree.traverse(
        [&](const Vec3& lo, const Vec3& hi) {
          return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
        },
        [&](int t) {
          if (s_.triangle_box(t).intersects(box)) first.push_back(4 * (t / 4));
          return true;
        });
    std::sort(first.begin(), first.end());
    first.erase(std::unique(first.begin(), first.end()), first.end());
    for (const int t : first) faces_.push_back(face_at(s_.surface, t));
  }

  void run(std::vector<Footprint>& out) {
    for (std::size_t f = 0; f < faces_.size(); ++f) cover(f);
    measure();
    measure_widths();
    leave_out_across();
    edge_ = std::count_if(directions_.begin(), directions_.end(),
                          [](const Direction& d) { return d.area > 0; }) > 1;
    for (std::size_t i = 0, last = 0; i < pieces_.size(); i = last) {
      while (last < pieces_.size() && pieces_[last].face == pieces_[i].face) ++last;
      const Direction& d = directions_[direction_[pieces_[i].face]];
      if (d.area + d.near_area > 0 && !sunk(pieces_[i].face).across && !from_the_side(pieces_[i].face))
        divide(std::span(pieces_).subspan(i, last - i), d, out);
    }
    std::stable_sort(out.begin(), out.end(), [](const Footprint& a, const Footprint& b) {
      return a.triangle != b.triangle ? a.triangle < b.triangle : a.sector < b.sector;
    });
  }

 private:
  /// The block's facets that look down on a face, clipped by it and cut where they pass through it.
  void cover(std::size_t f) {
    const Face& face = faces_[f];
    local_.clear();
    double highest = std::numeric_limits<double>::infinity(), deepest = -highest;
    for (const Vec3& x : x_) {
      local_.push_back(face.local(x));
      highest = std::min(highest, local_.back().z());
      deepest = std::max(deepest, local_.back().z());
    }
    if (highest >= 0 || deepest < -reach_) return;  // wholly below: on the structure's other side
    if (block_.convex) look_above(face);
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (const Vec3& c : face.corner)
      for (int k = 0; k < 2; ++k) low[k] = std::min(low[k], c[k]), high[k] = std::max(high[k], c[k]);
    for (std::size_t k = 0; k < block_.triangles.size(); ++k) {
      if (normal_[static_cast<std::size_t>(block_.triangle_face[k])].dot(face.normal) > -steep) continue;
      const auto& t = block_.triangles[k];
      const Vec3 &a = local_[static_cast<std::size_t>(t[0])], &b = local_[static_cast<std::size_t>(t[1])],
                 &c = local_[static_cast<std::size_t>(t[2])];
      const Vec3 least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
      if (least.x() > high[0] || most.x() < low[0] || least.y() > high[1] || most.y() < low[1] ||
          most.z() < -reach_)
        continue;
      if (!block_.convex && least.z() > 0.5 * block_.inradius)
        continue;  // another part of a block that reaches round the structure
      facet_ = block_.triangle_face[k];
      const Vec3& facet = normal_[static_cast<std::size_t>(facet_)];
      lift_ = facet / facet.dot(face.normal);
      if (std::isinf(yield_)) past_ = reach_past(face, static_cast<std::size_t>(facet_));
      polygon_.assign({a, b, c});
      for (int side = 0; side < 4 && !polygon_.empty(); ++side)
        keep(polygon_, next_,
             [&](const Vec3& x) { return side_of(face.corner[side], face.corner[(side + 1) % 4], x); });
      if (block_.convex && most.z() > 0) keep_before();
      if (polygon_.size() < 3) continue;
      if (!block_.convex && most.z() > 0)
        cut_where_before(f);
      else
        cut(f);
    }
  }

  void cut(std::size_t f) {
    if (std::isfinite(yield_))
      cut_cells(f);
    else
      slices(f, 0);
  }

  /// Of a block with hollows the polygon's triangles below which the block reaches to before the face: one of
  /// its arms, or an end of it, may lie wholly on the structure's other side.
  void cut_where_before(std::size_t f) {
    const Polygon all = polygon_;
    const auto before = [&](std::size_t i) { return reaches_before((all[0] + all[i] + all[i + 1]) / 3); };
    std::vector<char> kept(all.size(), 0);
    for (std::size_t i = 1; i + 1 < all.size(); ++i) kept[i] = before(i);
    if (std::all_of(kept.begin() + 1, kept.end() - 1, [](char k) { return k != 0; })) return cut(f);
    for (std::size_t i = 1; i + 1 < all.size(); ++i) {
      if (kept[i] == 0) continue;
      polygon_ = {all[0], all[i], all[i + 1]};
      cut(f);
    }
  }

  /// True if all of the block between a point of its lower surface, in a face's axes, and the plane of the
  /// face is solid.
  bool reaches_before(const Vec3& p) const {
    if (p.z() <= 0) return true;
    double top = -std::numeric_limits<double>::infinity();  // of the solid above it: the deepest of the
                                                            // facets that end it
    for (const auto& t : block_.triangles) {
      const Vec3 &a = local_[static_cast<std::size_t>(t[0])], &b = local_[static_cast<std::size_t>(t[1])],
                 &c = local_[static_cast<std::size_t>(t[2])];
      const double twice = side_of(a, b, c);
      if (twice == 0) continue;
      const Vec3 l = Vec3(side_of(b, c, p), side_of(c, a, p), side_of(a, b, p)) / twice;
      if (l.minCoeff() < 0) continue;
      const double z = l[0] * a.z() + l[1] * b.z() + l[2] * c.z();
      if (z < p.z() * (1 - tolerances().same_place) && z > top) top = z;
    }
    return top <= 0;
  }

  std::array<double, 4> reach_past(const Face& face, std::size_t facet) const {
    std::array<double, 4> past{};
    for (std::size_t side = 0; side < 4; ++side) {
      const Vec3 &from = face.corner[side], &to = face.corner[(side + 1) % 4];
      const double border = (to - from).head<2>().norm();
      for (int v = block_.face_offset[facet]; v < block_.face_offset[facet + 1]; ++v)
        past[side] = std::max(
            past[side],
            -side_of(from, to,
                     local_[static_cast<std::size_t>(block_.face_vertices[static_cast<std::size_t>(v)])]) /
                border);
    }
    return past;
  }

  /// Keeps of the polygon where the block reaches to before the face: past the structure's rim it may lie
  /// wholly on the other side.
  void keep_before() {
    for (const Vec3& facet : above_) {
      const auto within = [&](const Vec3& p) { return facet[0] - facet[1] * p.x() - facet[2] * p.y(); };
      if (!std::all_of(polygon_.begin(), polygon_.end(), [&](const Vec3& p) { return within(p) >= 0; }))
        keep(polygon_, next_, within);
    }
  }

  /// The block's facets that look up from a face: within them is where a - b u - c v >= 0 on it.
  void look_above(const Face& face) {
    above_.clear();
    for (std::size_t k = 0; k < normal_.size(); ++k) {
      if (normal_[k].dot(face.normal) <= 0) continue;
      const Vec3& on_facet =
          x_[static_cast<std::size_t>(block_.face_vertices[static_cast<std::size_t>(block_.face_offset[k])])];
      above_.emplace_back(normal_[k].dot(on_facet - face.centre), normal_[k].dot(face.u),
                          normal_[k].dot(face.v));
    }
  }

  /// The polygon cut along the face's grid.
  void cut_cells(std::size_t f) {
    const auto& corner = faces_[f].corner;
    const auto between = [](const Vec3& a, const Vec3& b, int i) {
      return Vec3(a + (b - a) * (static_cast<double>(i) / crater_cells));
    };
    whole_ = polygon_;
    for (int i = 0; i < crater_cells; ++i) {
      polygon_ = whole_;
      keep(polygon_, next_, [&](const Vec3& x) {
        return -side_of(between(corner[0], corner[1], i), between(corner[3], corner[2], i), x);
      });
      keep(polygon_, next_, [&](const Vec3& x) {
        return side_of(between(corner[0], corner[1], i + 1), between(corner[3], corner[2], i + 1), x);
      });
      if (polygon_.size() < 3) continue;
      strip_ = polygon_;
      for (int k = 0; k < crater_cells; ++k) {
        polygon_ = strip_;
        keep(polygon_, next_, [&](const Vec3& x) {
          return side_of(between(corner[0], corner[3], k), between(corner[1], corner[2], k), x);
        });
        keep(polygon_, next_, [&](const Vec3& x) {
          return -side_of(between(corner[0], corner[3], k + 1), between(corner[1], corner[2], k + 1), x);
        });
        if (polygon_.size() >= 3) slices(f, crater_cells * i + k);
      }
    }
  }

  void slices(std::size_t face, int cell) {
    slice(face, cell, -reach_, 0);
    slice(face, cell, 0, yield_);
    if (std::isfinite(yield_)) slice(face, cell, yield_, INFINITY);
  }

  /// Adds what of the polygon lies between two depths: within a piece the force per area is linear.
  void slice(std::size_t face, int cell, double from, double to) {
    part_ = polygon_;
    keep(part_, next_, [&](const Vec3& x) { return x.z() - from; });
    if (std::isfinite(to)) keep(part_, next_, [&](const Vec3& x) { return to - x.z(); });
    if (part_.size() >= 3) pieces_.push_back({face, cell, facet_, part_, lift_, from >= 0, past_});
  }

  void measure() {
    direction_.assign(faces_.size(), 0);
    std::size_t last = faces_.size();
    for (const Piece& p : pieces_) {
      const Face& face = faces_[p.face];
      if (p.face != last) {
        last = p.face;
        std::size_t d = 0;
        while (d < directions_.size() && directions_[d].normal.dot(face.normal) < one_direction) ++d;
        if (d == directions_.size()) directions_.emplace_back().normal = face.normal;
        direction_[p.face] = d;
        sunk_.push_back({p.face});
      }
      Direction& d = directions_[direction_[p.face]];
      for (std::size_t i = 1; i + 1 < p.polygon.size(); ++i) {
        const double area = fan_area(p.polygon, i);
        const Vec3 centre = (p.polygon[0] + p.polygon[i] + p.polygon[i + 1]) / 3;
        (p.sunk ? d.area : d.near_area) += area;
        (p.sunk ? d.moment : d.near_moment) += area * face.place(centre);
        if (!p.sunk) continue;
        sunk_.back().area += area;
        sunk_.back().volume += area * centre.z();
        sunk_.back().moment += area * face.place(centre);
      }
    }
  }

  const Sunk& sunk(std::size_t face) const {
    return *std::find_if(sunk_.begin(), sunk_.end(), [&](const Sunk& s) { return s.face == face; });
  }

  bool narrow(const Sunk& s) const {
    return s.area > 0 && s.width() < sliver * std::min(s.depth(), block_.inradius);
  }

  /// True where a block beside the structure overlaps little of its rim, but all along a side: a strip far
  /// deeper than it is wide, and than all else that the block sinks into that way. Its columns would press
  /// across the way that the block came.
  bool from_the_side(std::size_t face) const {
    const Sunk& s = sunk(face);
    if (!narrow(s)) return false;
    double area = 0, volume = 0;
    for (const Sunk& o : sunk_)
      if (direction_[o.face] == direction_[face] && !narrow(o)) area += o.area, volume += o.volume;
    return s.depth() * area > stands_out * volume || area == 0;
  }

  /// Leaves out the faces across a convex edge of the structure, below which the block lies far deeper than
  /// below the faces on the other side of it: it presses there, and the same overlap is not counted twice. It
  /// is the same if the faces there count at least half as much of it; a corner of the block that has only
  /// begun to reach past the edge does not. From the shallowest on, since what is left out presses nowhere.
  /// Face by face: in a pocket the block lies across edges on all its sides.
  void leave_out_across() {
    std::vector<Sunk*> order;
    for (Sunk& s : sunk_)
      if (s.area > 0) order.push_back(&s);
    std::stable_sort(order.begin(), order.end(),
                     [](const Sunk* a, const Sunk* b) { return a->depth() < b->depth(); });
    for (std::size_t i = 0; i < order.size(); ++i) {
      double counted = 0;
      bool any = false;
      for (std::size_t k = 0; k < i; ++k)
        if (!order[k]->across && lies_across(*order[i], *order[k])) counted += order[k]->volume, any = true;
      order[i]->across = any && 2 * counted >= order[i]->volume;
    }
  }

  /// True if the block lies across the edge between two faces, by far less deep below e than below d.
  bool lies_across(const Sunk& d, const Sunk& e) const {
    if (direction_[e.face] == direction_[d.face] || 2 * e.depth() >= d.depth()) return false;
    const Vec3 &below = faces_[d.face].normal, &other = faces_[e.face].normal;
    const Vec3 apart = d.middle() - e.middle();
    return other.dot(below) >= -0.5 && other.dot(apart) < e.depth() && -below.dot(apart) < d.depth();
  }

  void measure_widths() {
    std::size_t i = 0;  // pieces follow the order of the faces
    for (const Piece& p : pieces_) {
      while (sunk_[i].face != p.face) ++i;
      Sunk& s = sunk_[i];
      if (!p.sunk || !(s.area > 0)) continue;
      for (const Vec3& x : p.polygon)
        s.reach_sq = std::max(s.reach_sq, (faces_[p.face].place(x) - s.middle()).squaredNorm());
    }
  }

  /// Two directions across a normal that depend on it alone. Of axes that lie across it much the same the
  /// first is taken, so that a face along the axes, the most common one, does not change its lines as it
  /// trembles.
  static std::pair<Vec3, Vec3> lines_of(const Vec3& normal) {
    constexpr double alike = 0.1;
    int least = 0;
    while (std::abs(normal[least]) > normal.cwiseAbs().minCoeff() + alike) ++least;
    const Vec3 along = normal.cross(Vec3::Unit(least)).normalized();
    return {along, normal.cross(along)};
  }

  /// The pieces of one face, cut by the two lines through the middle of their direction where these pass well
  /// within them.
  void divide(std::span<const Piece> pieces, const Direction& d, std::vector<Footprint>& out) {
    const Face& face = faces_[pieces.front().face];
    const auto [along, other] = lines_of(d.normal);
    const Vec3 middle = face.local(d.middle());
    const Vec3 across[2] = {Vec3(face.u.dot(along), face.v.dot(along), 0),
                            Vec3(face.u.dot(other), face.v.dot(other), 0)};
    bool whole[2];
    double side[2];
    for (int k = 0; k < 2; ++k) {
      double low = INFINITY, high = -INFINITY;
      for (const Piece& p : pieces)
        for (const Vec3& x : p.polygon)
          low = std::min(low, across[k].dot(x - middle)), high = std::max(high, across[k].dot(x - middle));
      side[k] = low + high;
      whole[k] = std::min(-low, high) < inner * (high - low);
    }
    const std::size_t first = out.size();
    for (int sector = 0; sector < 4; ++sector) {
      const double sign[2] = {(sector & 1) != 0 ? -1.0 : 1.0, (sector & 2) != 0 ? -1.0 : 1.0};
      if ((whole[0] && side[0] * sign[0] < 0) || (whole[1] && side[1] * sign[1] < 0)) continue;
      for (const Piece& p : pieces) {
        part_ = p.polygon;
        for (int k = 0; k < 2; ++k)
          if (!whole[k])
            keep(part_, next_, [&](const Vec3& x) { return sign[k] * across[k].dot(x - middle); });
        if (part_.size() >= 3) add(face, sector, p, out);
      }
    }
    if (edge_ && std::isinf(yield_)) push_by_energy(std::span(out).subspan(first));
  }

  /// A sliver of a part along a border gives no more than a face that counts, which is no narrower than a
  /// sliver: d / 2w.
  static Vec3 aside(const Footprint& part) {
    if (!(part.volume > 0)) return Vec3::Zero();
    const Vec3 push = part.push / part.volume;
    const double size = push.norm(), most = 0.5 / sliver;
    return size > most ? Vec3(most / size * push) : push;
  }

  /// The columns of an elastic bed hold their energy whatever facet is below them, so that only those at the
  /// borders of a face push along it. The facets' own push, summed over all of them, is the same as long as
  /// none leans over; one that does was missing there.
  static void push_by_energy(std::span<Footprint> parts) {
    for (Footprint& part : parts)
      for (Column& c : part.columns) c.lift = part.normal + aside(part);
  }

  /// 1/2 d^2 along what of the polygon's outline lies on the face's borders, times the way out. Where the
  /// block ends with the face, the columns it loses on one side or the other hold it in the middle: the push
  /// comes as it reaches past the border by what it is deep.
  static Vec3 border_push(const Face& face, const Polygon& polygon, const std::array<double, 4>& past) {
    Vec3 push = Vec3::Zero();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double length = (b - a).head<2>().norm();
      for (int side = 0; side < 4; ++side) {
        const Vec3 &from = face.corner[side], &to = face.corner[(side + 1) % 4];
        const double border = (to - from).head<2>().norm();
        if (std::max(std::abs(side_of(from, to, a)), std::abs(side_of(from, to, b))) >
            tolerances().same_place * border * border)
          continue;
        const Vec3 out = ((to.y() - from.y()) * face.u - (to.x() - from.x()) * face.v) /
                         border;  // corners run counter-clockwise
        const double deep = std::max(a.z(), b.z());
        if (deep > 0)
          push += std::min(1.0, past[static_cast<std::size_t>(side)] / deep) * length / 6 *
                  (a.z() * a.z() + a.z() * b.z() + b.z() * b.z()) * out;
        break;
      }
    }
    return push;
  }

  /// What of a piece is left in `part_`.
  void add(const Face& face, int sector, const Piece& piece, std::vector<Footprint>& out) const {
    const Polygon& polygon = part_;
    const bool pushes = edge_ && piece.sunk && std::isinf(yield_);
    bool pushed = false;
    auto part = std::find_if(out.rbegin(), out.rend(), [&](const Footprint& q) {
      return q.triangle == face.first && q.sector == sector;
    });
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      const double area = fan_area(polygon, i);
      if (!(area > 0)) continue;
      if (part == out.rend()) {
        Footprint& fresh = out.emplace_back();
        fresh.triangle = face.first, fresh.sector = sector, fresh.edge = edge_;
        fresh.normal = face.normal, fresh.centre = face.centre, fresh.u = face.u, fresh.v = face.v;
        part = out.rbegin();
      }
      if (pushes && !std::exchange(pushed, true)) part->push += border_push(face, polygon, piece.past);
      part->deepest = std::max({part->deepest, polygon[0].z(), polygon[i].z(), polygon[i + 1].z()});
      const Vec3 &a = polygon[0], &b = polygon[i], &c = polygon[i + 1];
      if (piece.sunk) part->volume += area * (a.z() + b.z() + c.z()) / 3;
      const std::array<double, 3> depth{a.z(), b.z(), c.z()};
      part->columns.push_back({area,
                               depth,
                               depth,
                               {face.place(a), face.place(b), face.place(c)},
                               piece.lift,
                               piece.cell,
                               piece.facet});
    }
  }

  const SurfaceIndex::Impl& s_;
  const Polyhedron& block_;
  double reach_, yield_;
  bool edge_ = false;
  std::vector<Vec3> x_, normal_, local_, above_;
  std::vector<Face> faces_;
  std::vector<Piece> pieces_;
  std::vector<Direction> directions_;
  std::vector<std::size_t> direction_;  // per face
  std::vector<Sunk> sunk_;              // of the faces with pieces, in their order
  Polygon polygon_, part_, next_, whole_, strip_;
  Vec3 lift_;
  int facet_ = 0;
  std::array<double, 4> past_{};
};

}  // namespace

void skin_bed(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double reach, double yield,
              std::vector<Footprint>& out) {
  std::vector<Footprint> found;
  BedFinder(index, B, pose_b, reach, yield).run(found);
  out.insert(out.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
}

int triangle_of_face(const TriangleSurface& skin, int first, Vec3& x) {
  int best = first;
  double most = -std::numeric_limits<double>::infinity();
  Vec3 on = x;
  for (int t = first; t < first + 4; ++t) {
    const auto& v = skin.triangles[static_cast<std::size_t>(t)];
    const Vec3 &a = skin.vertices[static_cast<std::size_t>(v[0])],
               &b = skin.vertices[static_cast<std::size_t>(v[1])],
               &c = skin.vertices[static_cast<std::size_t>(v[2])];
    const Vec3 n = (b - a).cross(c - a);
    Vec3 l = Vec3(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x))) /
             n.squaredNorm();
    if (!(l.minCoeff() > most)) continue;
    most = l.minCoeff();
    l = l.cwiseMax(0.0);
    l /= l.sum();
    on = l[0] * a + l[1] * b + l[2] * c;
    best = t;
  }
  x = on;
  return best;
}

}  // namespace talus::contact

#include "geometry/overlay.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <unordered_map>

#include "core/error.hpp"
#include "geometry/cut_internal.hpp"

namespace talus::geometry {
namespace {

using Given = CGAL::Exact_predicates_inexact_constructions_kernel::Point_2;  // coordinates as they are given
using Point2 = ExactKernel::Point_2;
using Edge = std::pair<int, int>;  // of places, the lower number first

Edge edge_of(int a, int b) { return std::minmax(a, b); }

InputError two_heights(const std::string& key, const Vec3& x) {
  return InputError(Problem{.key = key,
                            .value = fmt::format("({:.6g}, {:.6g}, {:.6g})", x.x(), x.y(), x.z()),
                            .rule = "has two heights there, so that what lies above it is not known",
                            .remedy = "give the body as a closed mesh (region) beside ground that has one"});
}

/// A corner of the overlay in plan.
struct Place {
  Point2 at;
  ExactNumber upper, lower;  // heights [m]
  bool has_lower = false;
  int sign = 0;                          // of the depth
  int top = -1, bottom = -1;             // vertices of the complex
  std::vector<Edge> on_upper, on_lower;  // edges of the surfaces that it lies on, but at their ends
};

/// Numbers for planes of triangles: neighbours that lie in one plane share it.
class PlaneNumbers {
 public:
  PlaneNumbers(const TriangleSurface& s, const std::vector<int>& triangles, CellComplex& complex) {
    std::map<Edge, std::vector<int>> at_edge;
    for (const int t : triangles)
      for (int k = 0; k < 3; ++k) {
        const auto& v = s.triangles[static_cast<std::size_t>(t)];
        at_edge[edge_of(v[static_cast<std::size_t>(k)], v[static_cast<std::size_t>((k + 1) % 3)])].push_back(
            t);
      }
    const auto corner = [&](int t, int k) -> const Vec3& {
      const auto& v = s.triangles[static_cast<std::size_t>(t)];
      return s.vertices[static_cast<std::size_t>(v[static_cast<std::size_t>(k % 3)])];
    };
    for (const int seed : triangles) {
      if (plane_.contains(seed)) continue;
      const Vec3 n =
          (corner(seed, 1) - corner(seed, 0)).cross(corner(seed, 2) - corner(seed, 0)).normalized();
      const double d = n.dot(corner(seed, 0) + corner(seed, 1) + corner(seed, 2)) / 3;
      const int plane = complex.add_plane(n, d);
      plane_[seed] = plane;
      for (std::vector<int> grown{seed}; !grown.empty();) {
        const int t = grown.back();
        grown.pop_back();
        for (int k = 0; k < 3; ++k) {
          const auto& v = s.triangles[static_cast<std::size_t>(t)];
          for (const int other : at_edge.at(
                   edge_of(v[static_cast<std::size_t>(k)], v[static_cast<std::size_t>((k + 1) % 3)]))) {
            if (plane_.contains(other)) continue;
            bool flat = true;
            for (int c = 0; c < 3; ++c) flat &= std::abs(n.dot(corner(other, c)) - d) <= complex.snap();
            if (!flat) continue;
            plane_[other] = plane;
            grown.push_back(other);
          }
        }
      }
    }
  }
  int of(int triangle) const { return plane_.at(triangle); }

 private:
  std::unordered_map<int, int> plane_;
};

class Overlay {
 public:
  Overlay(const TriangleSurface& upper, const std::vector<int>& upper_triangles, const TriangleSurface& lower,
          const std::vector<int>& lower_triangles, double sliver)
      : upper_(upper),
        lower_(lower),
        own_(upper_triangles),
        out_{ExactComplex(sliver), {}, -1},
        upper_planes_(upper, upper_triangles, out_.complex),
        lower_planes_(lower, lower_triangles, out_.complex) {
    out_.rest = out_.complex.add_cell();
    body_ = out_.complex.add_cell();
    number_places(lower_triangles);
  }

  Between build(const std::vector<int>& lower_triangles) {
    lay_over(lower_triangles);
    for (const int g : own_) add_ground(g);
    for (const Part& p : parts_) add_part(p);
    add_walls();
    if (!out_.complex.cells()[static_cast<std::size_t>(body_)].faces.empty())
      out_.bodies = out_.complex.separate(body_);
    for (const int c : out_.bodies) out_.complex.bound(c);
    return std::move(out_);
  }

 private:
  struct Part {  // of the body, in plan, counter-clockwise
    std::vector<int> places;
    int upper, lower;
  };

  std::array<int, 3> corners_of(const TriangleSurface& s, int t) const {
    const auto& v = s.triangles[static_cast<std::size_t>(t)];
    const auto& of = &s == &upper_ ? upper_place_ : lower_place_;
    return {of.at(v[0]), of.at(v[1]), of.at(v[2])};
  }

  void number_places(const std::vector<int>& lower_triangles) {
    std::map<std::array<double, 2>, int> known;
    const auto number = [&](const Vec3& x) {
      const auto [it, is_new] = known.try_emplace({x.x(), x.y()}, static_cast<int>(places_.size()));
      if (is_new) {
        places_.emplace_back();
        places_.back().at = Point2(x.x(), x.y());
        given_.emplace_back(x.x(), x.y());
      }
      return it->second;
    };
    for (const int t : own_) {
      for (const int v : upper_.triangles[static_cast<std::size_t>(t)]) {
        const Vec3& x = upper_.vertices[static_cast<std::size_t>(v)];
        const int p = number(x);
        const Place& place = places_[static_cast<std::size_t>(p)];
        if (place.top == -2 && place.upper != x.z()) throw two_heights("site.terrain", x);
        upper_place_[v] = p;
        places_[static_cast<std::size_t>(p)].upper = x.z();
        places_[static_cast<std::size_t>(p)].top = -2;  // it has a height
      }
      const auto c = corners_of(upper_, t);
      for (int k = 0; k < 3; ++k)
        ++upper_edges_[edge_of(c[static_cast<std::size_t>(k)], c[static_cast<std::size_t>((k + 1) % 3)])];
    }
    for (const int t : lower_triangles)
      for (const int v : lower_.triangles[static_cast<std::size_t>(t)]) {
        const Vec3& x = lower_.vertices[static_cast<std::size_t>(v)];
        const int p = number(x);
        const Place& place = places_[static_cast<std::size_t>(p)];
        if (place.has_lower && place.lower != x.z()) throw two_heights("rock_mass.slip_surface", x);
        lower_place_[v] = p;
        places_[static_cast<std::size_t>(p)].lower = x.z();
        places_[static_cast<std::size_t>(p)].has_lower = true;
      }
  }

  /// Height of a triangle's plane at a place.
  ExactNumber height(const TriangleSurface& s, int t, const Point2& at) const {
    const auto& v = s.triangles[static_cast<std::size_t>(t)];
    std::array<ExactPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x = s.vertices[static_cast<std::size_t>(v[k])];
      p[k] = ExactPoint(x.x(), x.y(), x.z());
    }
    const auto n = CGAL::cross_product(p[1] - p[0], p[2] - p[0]);
    return p[0].z() - (n.x() * (at.x() - p[0].x()) + n.y() * (at.y() - p[0].y())) / n.z();
  }

  /// Completes a corner of the overlay that lies in both triangles.
  void complete(int place, int g, int s) {
    Place& p = places_[static_cast<std::size_t>(place)];
    if (complete_.size() < places_.size()) complete_.resize(2 * places_.size(), 0);
    if (complete_[static_cast<std::size_t>(place)] != 0) return;
    complete_[static_cast<std::size_t>(place)] = 1;
    if (p.top == -1) p.upper = height(upper_, g, p.at), p.top = -2;
    if (!p.has_lower) p.lower = height(lower_, s, p.at), p.has_lower = true;
    p.sign = static_cast<int>(CGAL::compare(p.upper, p.lower));
  }

  static void note(std::vector<Edge>& edges, const Edge& e) {
    if (std::find(edges.begin(), edges.end(), e) == edges.end()) edges.push_back(e);
  }

  int crossing(const Edge& of_upper, const Edge& of_lower) {
    const auto [it, is_new] = crossings_.try_emplace({of_upper, of_lower}, static_cast<int>(places_.size()));
    if (is_new) {
      const Point2 a = places_[static_cast<std::size_t>(of_upper.first)].at,
                   b = places_[static_cast<std::size_t>(of_upper.second)].at,
                   c = places_[static_cast<std::size_t>(of_lower.first)].at,
                   d = places_[static_cast<std::size_t>(of_lower.second)].at;
      const auto u = b - a, w = d - c;
      const ExactNumber t =
          ((c.x() - a.x()) * w.y() - (c.y() - a.y()) * w.x()) / (u.x() * w.y() - u.y() * w.x());
      places_.emplace_back();
      places_.back().at = a + t * u;
      note(places_.back().on_upper, of_upper);
      note(places_.back().on_lower, of_lower);
    }
    return it->second;
  }

  /// The place where the depth vanishes between two of different sign.
  int zero(int a, int b) {
    const Edge e = edge_of(a, b);
    const auto [it, is_new] = zeros_.try_emplace(e, static_cast<int>(places_.size()));
    if (is_new) {
      const Place &p = places_[static_cast<std::size_t>(e.first)],
                  &q = places_[static_cast<std::size_t>(e.second)];
      const ExactNumber dp = p.upper - p.lower, dq = q.upper - q.lower, t = dp / (dp - dq);
      Place z;
      z.at = p.at + t * (q.at - p.at);
      z.upper = z.lower = p.upper + t * (q.upper - p.upper);
      z.has_lower = true;
      z.top = -2;
      for (const Edge& on : common_edges(e.first, e.second, true)) z.on_upper.push_back(on);
      for (const Edge& on : common_edges(e.first, e.second, false)) z.on_lower.push_back(on);
      places_.push_back(std::move(z));
      complete_.resize(std::max(complete_.size(), places_.size()), 0);
      complete_[static_cast<std::size_t>(it->second)] = 1;
    }
    return it->second;
  }

  /// Edges of a surface that both places lie on, at their ends or between.
  std::vector<Edge> common_edges(int a, int b, bool of_upper) const {
    const auto lies_on = [&](int p, const Edge& e) {
      const auto& on = of_upper ? places_[static_cast<std::size_t>(p)].on_upper
                                : places_[static_cast<std::size_t>(p)].on_lower;
      return p == e.first || p == e.second || std::find(on.begin(), on.end(), e) != on.end();
    };
    std::vector<Edge> out, tried;
    const auto attempt = [&](const Edge& e) {
      if (lies_on(a, e) && lies_on(b, e) && std::find(out.begin(), out.end(), e) == out.end())
        out.push_back(e);
    };
    const auto& edges = of_upper ? upper_edges_ : lower_edges_;
    if (edges.contains(edge_of(a, b))) attempt(edge_of(a, b));
    for (const int p : {a, b})
      for (const Edge& e : of_upper ? places_[static_cast<std::size_t>(p)].on_upper
                                    : places_[static_cast<std::size_t>(p)].on_lower)
        attempt(e);
    return out;
  }

  /// The part of one triangle within another in plan, as places, counter-clockwise; empty if there is none.
  std::vector<int> common_part(int g, int s) {
    const auto a = corners_of(upper_, g), b = corners_of(lower_, s);
    {
      auto x = a, y = b;
      std::sort(x.begin(), x.end());
      std::sort(y.begin(), y.end());
      if (x == y) return {a.begin(), a.end()};
    }
    const auto turn = [&](int p, int q, int r) {
      return static_cast<int>(CGAL::orientation(given_[static_cast<std::size_t>(p)],
                                                given_[static_cast<std::size_t>(q)],
                                                given_[static_cast<std::size_t>(r)]));
    };
    std::array<std::array<int, 3>, 3> side_a{}, side_b{};  // [edge of the other][corner]
    for (std::size_t k = 0; k < 3; ++k) {
      bool all_a = true, all_b = true;
      for (std::size_t i = 0; i < 3; ++i) {
        side_a[k][i] = turn(b[k], b[(k + 1) % 3], a[i]);
        side_b[k][i] = turn(a[k], a[(k + 1) % 3], b[i]);
        all_a &= side_a[k][i] <= 0;
        all_b &= side_b[k][i] <= 0;
      }
      if (all_a || all_b) return {};
    }
    std::vector<int> found;
    const auto add = [&](int p) {
      if (std::find(found.begin(), found.end(), p) == found.end()) found.push_back(p);
    };
    for (std::size_t i = 0; i < 3; ++i) {
      if (side_a[0][i] >= 0 && side_a[1][i] >= 0 && side_a[2][i] >= 0) {
        add(a[i]);
        for (std::size_t k = 0; k < 3; ++k)
          if (side_a[k][i] == 0 && a[i] != b[k] && a[i] != b[(k + 1) % 3])
            note(places_[static_cast<std::size_t>(a[i])].on_lower, edge_of(b[k], b[(k + 1) % 3]));
      }
      if (side_b[0][i] >= 0 && side_b[1][i] >= 0 && side_b[2][i] >= 0) {
        add(b[i]);
        for (std::size_t k = 0; k < 3; ++k)
          if (side_b[k][i] == 0 && b[i] != a[k] && b[i] != a[(k + 1) % 3])
            note(places_[static_cast<std::size_t>(b[i])].on_upper, edge_of(a[k], a[(k + 1) % 3]));
      }
    }
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l)
        if (side_b[k][l] * side_b[k][(l + 1) % 3] < 0 && side_a[l][k] * side_a[l][(k + 1) % 3] < 0)
          add(crossing(edge_of(a[k], a[(k + 1) % 3]), edge_of(b[l], b[(l + 1) % 3])));
    if (found.size() < 3) return {};
    const Point2 origin = places_[static_cast<std::size_t>(found[0])].at;
    std::sort(found.begin() + 1, found.end(), [&](int p, int q) {
      return CGAL::orientation(origin, places_[static_cast<std::size_t>(p)].at,
                               places_[static_cast<std::size_t>(q)].at) == CGAL::LEFT_TURN;
    });
    return found;
  }

  void lay_over(const std::vector<int>& lower_triangles) {
    // Triangles of the lower surface by squares of a grid in plan.
    Eigen::AlignedBox2d limits;
    const auto box_of = [](const TriangleSurface& s, int t) {
      Eigen::AlignedBox2d b;
      for (const int v : s.triangles[static_cast<std::size_t>(t)])
        b.extend(Eigen::Vector2d(s.vertices[static_cast<std::size_t>(v)].head<2>()));
      return b;
    };
    for (const int t : lower_triangles) {
      limits.extend(box_of(lower_, t));
      const auto c = corners_of(lower_, t);
      for (std::size_t k = 0; k < 3; ++k) ++lower_edges_[edge_of(c[k], c[(k + 1) % 3])];
    }
    const auto squares = std::max(1.0, std::sqrt(static_cast<double>(lower_triangles.size()) / 2));
    const Eigen::Vector2d size = (limits.sizes() / squares).cwiseMax(1e-300);
    const auto range = [&](const Eigen::AlignedBox2d& b) {
      std::array<int, 4> r{};
      for (int k = 0; k < 2; ++k) {
        const auto cell = [&](double x) {
          return static_cast<int>(std::clamp(std::floor((x - limits.min()[k]) / size[k]), 0.0, squares));
        };
        r[static_cast<std::size_t>(k)] = cell(b.min()[k]);
        r[static_cast<std::size_t>(k + 2)] = cell(b.max()[k]);
      }
      return r;
    };
    std::map<std::pair<int, int>, std::vector<int>> square;
    for (const int t : lower_triangles) {
      const auto r = range(box_of(lower_, t));
      for (int i = r[0]; i <= r[2]; ++i)
        for (int j = r[1]; j <= r[3]; ++j) square[{i, j}].push_back(t);
    }
    for (const int g : own_) {
      const auto box = box_of(upper_, g);
      if (!box.intersects(limits)) continue;
      std::set<int> near;
      const auto r = range(box);
      for (int i = r[0]; i <= r[2]; ++i)
        for (int j = r[1]; j <= r[3]; ++j)
          if (const auto it = square.find({i, j}); it != square.end())
            for (const int t : it->second)
              if (box.intersects(box_of(lower_, t))) near.insert(t);
      for (const int s : near) divide(g, s, common_part(g, s));
    }
  }

  /// Divides a part of the overlay where the depth vanishes, and keeps what is body, and the ground beside
  /// it.
  void divide(int g, int s, const std::vector<int>& part) {
    if (part.empty()) return;
    bool body = false;
    for (const int p : part) {
      complete(p, g, s);
      body |= places_[static_cast<std::size_t>(p)].sign > 0;
    }
    std::vector<int> above, below;
    for (std::size_t k = 0; k < part.size(); ++k) {
      const int p = part[k], q = part[(k + 1) % part.size()];
      const int sp = places_[static_cast<std::size_t>(p)].sign,
                sq = places_[static_cast<std::size_t>(q)].sign;
      if (sp >= 0) above.push_back(p);
      if (sp <= 0) below.push_back(p);
      if (body && sp * sq < 0) {
        const int z = zero(p, q);
        above.push_back(z);
        below.push_back(z);
      }
    }
    if (!body) {
      beside_[g].push_back(part);
      return;
    }
    touched_.insert(g);
    parts_.push_back({above, g, s});
    if (below.size() >= 3) beside_[g].push_back(below);
  }

  int top(int place) {
    Place& p = places_[static_cast<std::size_t>(place)];
    if (p.top < 0) p.top = out_.complex.add_point(ExactPoint(p.at.x(), p.at.y(), p.upper));
    return p.top;
  }
  int bottom(int place) {
    Place& p = places_[static_cast<std::size_t>(place)];
    if (p.sign == 0) return top(place);
    if (p.bottom < 0) p.bottom = out_.complex.add_point(ExactPoint(p.at.x(), p.at.y(), p.lower));
    return p.bottom;
  }
  std::vector<int> tops(const std::vector<int>& places) {
    std::vector<int> loop;
    for (const int p : places) loop.push_back(top(p));
    return loop;
  }

  void add(std::vector<int> loop, int cell, int beyond, int plane, int mark) {
    CellComplex::Face f;
    f.loop = std::move(loop);
    f.cell[0] = cell;
    f.cell[1] = beyond;
    f.plane = plane;
    f.mark = mark;
    out_.complex.add_face(std::move(f));
  }

  /// Places on the edges of the upper surface that parts of the body, or of the ground beside it in the same
  /// triangle, have: their neighbours across the edge have them too.
  void note_edge_places() {
    const auto note_all = [&](const std::vector<int>& part) {
      for (const int p : part)
        for (const Edge& e : places_[static_cast<std::size_t>(p)].on_upper) {
          auto& list = on_edge_[e];
          if (std::find(list.begin(), list.end(), p) == list.end()) list.push_back(p);
        }
    };
    for (const Part& p : parts_) note_all(p.places);
    for (const int g : touched_)
      if (const auto it = beside_.find(g); it != beside_.end())
        for (const auto& part : it->second) note_all(part);
    for (auto& [e, list] : on_edge_) {
      const Point2 a = places_[static_cast<std::size_t>(e.first)].at;
      std::sort(list.begin(), list.end(), [&](int p, int q) {
        return CGAL::compare_distance_to_point(a, places_[static_cast<std::size_t>(p)].at,
                                               places_[static_cast<std::size_t>(q)].at) == CGAL::SMALLER;
      });
    }
    edges_noted_ = true;
  }

  std::vector<int> outline(int g) {
    if (!edges_noted_) note_edge_places();
    const auto c = corners_of(upper_, g);
    std::vector<int> loop;
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = c[k], b = c[(k + 1) % 3];
      loop.push_back(a);
      if (const auto it = on_edge_.find(edge_of(a, b)); it != on_edge_.end()) {
        auto list = it->second;
        if (a > b) std::reverse(list.begin(), list.end());
        loop.insert(loop.end(), list.begin(), list.end());
      }
    }
    return loop;
  }

  /// The ground that stays, of one triangle.
  void add_ground(int g) {
    const int plane = upper_planes_.of(g);
    if (!touched_.contains(g)) return add(tops(outline(g)), out_.rest, -1, plane, g);
    // What no part of the overlay covers: the outline less the parts.
    EdgeCounts border;
    const auto count = [&](const std::vector<int>& loop, bool forward) {
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const int a = loop[k], b = loop[(k + 1) % loop.size()];
        forward ? count_edge(border, a, b) : count_edge(border, b, a);
      }
    };
    count(outline(g), true);
    for (const auto& part : beside_[g]) {
      count(part, false);
      add(tops(part), out_.rest, -1, plane, g);
    }
    for (const std::size_t p : parts_of(g)) count(parts_[p].places, false);
    std::erase_if(border, [](const auto& e) { return e.second == 0; });
    if (border.empty()) return;
    std::map<int, Point2> at;
    for (const auto& [e, n] : border)
      for (const int p : {e.first, e.second}) at.emplace(p, places_[static_cast<std::size_t>(p)].at);
    for (const int p : at_height(at, g)) top(p);
    for (const auto& part : fill(border, {}, {}, at)) add(tops(part), out_.rest, -1, plane, g);
  }
  /// Places that have no height yet get it from the triangle.
  std::vector<int> at_height(const std::map<int, Point2>& at, int g) {
    std::vector<int> out;
    for (const auto& [p, point] : at) {
      Place& place = places_[static_cast<std::size_t>(p)];
      if (place.top == -1) place.upper = height(upper_, g, place.at), place.top = -2;
      out.push_back(p);
    }
    return out;
  }

  const std::vector<std::size_t>& parts_of(int g) {
    if (parts_of_.empty())
      for (std::size_t k = 0; k < parts_.size(); ++k) parts_of_[parts_[k].upper].push_back(k);
    return parts_of_[g];
  }

  void add_part(const Part& p) {
    add(tops(p.places), body_, -1, upper_planes_.of(p.upper), p.upper);
    std::vector<int> loop;
    for (auto it = p.places.rbegin(); it != p.places.rend(); ++it) loop.push_back(bottom(*it));
    add(std::move(loop), body_, out_.rest, lower_planes_.of(p.lower), of_bed);
  }

  void add_walls() {
    EdgeCounts border;
    for (const Part& p : parts_)
      for (std::size_t k = 0; k < p.places.size(); ++k)
        count_edge(border, p.places[k], p.places[(k + 1) % p.places.size()]);
    std::map<std::pair<Edge, bool>, int> planes;  // of an edge of the upper or of the lower surface
    for (const auto& [edge, n] : border) {
      if (n == 0) continue;
      const auto [u, v] = n > 0 ? edge : std::pair(edge.second, edge.first);
      if (places_[static_cast<std::size_t>(u)].sign == 0 && places_[static_cast<std::size_t>(v)].sign == 0)
        continue;
      std::vector<int> loop{bottom(u), bottom(v), top(v), top(u)};
      if (loop[2] == loop[1]) loop.erase(loop.begin() + 2);
      if (loop.back() == loop.front()) loop.pop_back();
      bool ends = false;  // the ground itself does
      std::pair<Edge, bool> along{edge, false};
      for (const Edge& e : common_edges(u, v, false)) along = {e, false};
      for (const Edge& e : common_edges(u, v, true))
        if (upper_edges_.at(e) == 1) ends = true, along = {e, true};
      auto [at, is_new] = planes.try_emplace(along, -1);
      if (is_new) {
        const auto place = [&](int p) {
          const Point2& x = places_[static_cast<std::size_t>(p)].at;
          return Vec3(rounded(x.x()), rounded(x.y()), 0);
        };
        const Vec3 a = place(along.first.first), d = place(along.first.second) - a;
        const Vec3 normal = Vec3(d.y(), -d.x(), 0).normalized();
        at->second = out_.complex.add_plane(normal, normal.dot(a));
      }
      add(std::move(loop), body_, ends ? -1 : out_.rest, at->second, ends ? of_border : of_bed);
    }
  }

  const TriangleSurface &upper_, &lower_;
  std::vector<int> own_;
  Between out_;
  PlaneNumbers upper_planes_, lower_planes_;
  int body_ = -1;
  std::vector<Place> places_;
  std::vector<Given> given_;  // of the places that are corners of the surfaces
  std::vector<char> complete_;
  std::unordered_map<int, int> upper_place_, lower_place_;
  std::map<Edge, int> upper_edges_, lower_edges_;  // -> triangles at it
  std::map<std::pair<Edge, Edge>, int> crossings_;
  std::map<Edge, int> zeros_;
  std::vector<Part> parts_;
  std::map<int, std::vector<std::size_t>> parts_of_;
  std::set<int> touched_;                                // triangles of the ground that the body is part of
  std::map<int, std::vector<std::vector<int>>> beside_;  // other parts of the overlay in a triangle
  std::map<Edge, std::vector<int>> on_edge_;
  bool edges_noted_ = false;
};

}  // namespace

Between between(const TriangleSurface& upper, const std::vector<int>& upper_triangles,
                const TriangleSurface& lower, const std::vector<int>& lower_triangles, double sliver) {
  return Overlay(upper, upper_triangles, lower, lower_triangles, sliver).build(lower_triangles);
}

}  // namespace talus::geometry

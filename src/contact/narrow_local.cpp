#include "contact/narrow_local.hpp"

#include <limits>

#include "contact/narrow_patch.hpp"

namespace talus::contact::narrow {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double steep = 0.17;              // 10 degrees: an edge falling more than this from a vertex is no contact edge
constexpr double lean = 0.02;               // faces and edges closer than this to parallel are completed to manifolds
constexpr double parallel_cosine = 0.9998;
constexpr double sharpest_notch = 4;        // tangent of half the angle by which its faces turn: 150 degrees
constexpr double crossed_overlap = 0.1;     // overlap of crossed edges, and of a vertex beside a nearer face, that is still looked for, over the deepest of all

/// About a triangle: its centroid and how far it reaches from there.
struct Ball {
  Vec3 centre;
  double radius;
};

struct Scratch {
  Patch a, b;
  std::vector<ContactPoint> points;
  std::vector<ClipVertex> polygon, clipped;
  std::vector<int> chosen;
  std::vector<double> angle;
  Hull hull;
  std::vector<Ball> balls;
};
thread_local Scratch scratch;

struct Search {
  const Patch &A, &B;
  double margin, touch;
  double depth;      // deepest overlap that is still read as contact [m]
  bool closed;       // both are closed bodies, so that inside and outside can be told
};

double falling(const Patch& p, const Patch::Vertex& v, const Vec3& n) {
  double least = infinity;
  for (int i = v.first; i < v.first + v.count; ++i) least = std::min(least, n.dot(p.directions[i]));
  return least;
}
double facing(const Patch& p, const Patch::Vertex& v, const Vec3& n) {
  double least = infinity;
  for (int i = v.first_face; i < v.first_face + v.faces; ++i) least = std::min(least, n.dot(p.face_normals[i]));
  return least;
}

/// Where x projects on a triangle: -1 outside, 0 inside, 1 within `touch` of a convex side.
int inside(const Patch::Triangle& t, const Vec3& x, double touch) {
  const Vec3* p[3] = {&t.a, &t.b, &t.c};
  int result = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k];
    const double h = e.cross(t.n).dot(x - *p[k]), l = touch * e.norm();
    if (h > l) return -1;
    if (h >= -l && t.sharp[k]) result = 1;
  }
  return result;
}

Vec3 closest_on_triangle(const Patch::Triangle& t, const Vec3& x, bool& interior) {
  interior = inside(t, x, 0) >= 0;
  if (interior) return x - (t.n.dot(x) - t.level) * t.n;
  const Vec3* p[3] = {&t.a, &t.b, &t.c};
  Vec3 best = t.a;
  double d = infinity;
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k];
    const double s = std::clamp(e.dot(x - *p[k]) / e.squaredNorm(), 0.0, 1.0);
    const Vec3 y = *p[k] + s * e;
    if ((x - y).squaredNorm() < d) d = (x - y).squaredNorm(), best = y;
  }
  return best;
}

/// Nearest point of a surface to x, and the sum of the normals of the triangles that share it.
struct Nearest {
  double distance = infinity;
  Vec3 foot, pseudo = Vec3::Zero();

  void visit(const Patch::Triangle& t, const Vec3& x, double touch) {
    bool interior;
    const Vec3 y = closest_on_triangle(t, x, interior);
    const double d = (x - y).norm();
    if (d < distance - touch) {
      distance = d, foot = y, pseudo = t.n;
    } else if (d < distance + touch) {
      pseudo += t.n;
    }
  }
};

/// True if x lies before the surface, neither behind nor on it: its nearest point tells.
bool outside(const Patch& p, const Vec3& x, double touch) {
  Nearest nearest{.foot = x};
  for (const auto& t : p.triangles)
    if (std::abs(t.n.dot(x) - t.level) <= nearest.distance + touch) nearest.visit(t, x, touch);
  return nearest.distance > touch && nearest.pseudo.dot(x - nearest.foot) > 0;
}

void enclose(const Patch& p, std::vector<Ball>& balls) {
  balls.clear();
  for (const auto& t : p.triangles) {
    const Vec3 c = (t.a + t.b + t.c) / 3;
    balls.push_back({c, std::sqrt(std::max({(t.a - c).squaredNorm(), (t.b - c).squaredNorm(), (t.c - c).squaredNorm()}))});
  }
}

/// Eight triangles that follow each other, which lie beside each other for the most part.
struct Bunch {
  Ball ball;
  std::size_t first, last;
};

void bunch(const std::vector<Ball>& balls, std::vector<Bunch>& bunches) {
  constexpr std::size_t size = 8;
  bunches.clear();
  for (std::size_t first = 0; first < balls.size(); first += size) {
    Bunch b{{Vec3::Zero(), 0}, first, std::min(first + size, balls.size())};
    for (std::size_t k = first; k < b.last; ++k) b.ball.centre += balls[k].centre / static_cast<double>(b.last - first);
    for (std::size_t k = first; k < b.last; ++k) b.ball.radius = std::max(b.ball.radius, (balls[k].centre - b.ball.centre).norm() + balls[k].radius);
    bunches.push_back(b);
  }
}

/// Distance of x from the surface if x lies before it beyond doubt, else 0.
double ahead(const Patch& p, const std::vector<Ball>& balls, const std::vector<Bunch>& bunches, const Vec3& x, double touch) {
  Nearest nearest{.foot = x};
  const auto search = [&](const Bunch& bunch) {
    for (std::size_t k = bunch.first; k < bunch.last; ++k) {
      const auto& t = p.triangles[k];
      const double reach = nearest.distance + touch;
      if (std::abs(t.n.dot(x) - t.level) <= reach && (x - balls[k].centre).norm() - balls[k].radius <= reach) nearest.visit(t, x, touch);
    }
  };
  const Bunch* likely = &bunches.front();
  double least = infinity;
  for (const Bunch& b : bunches)
    if (const double d = (x - b.ball.centre).squaredNorm(); d < least) least = d, likely = &b;
  search(*likely);
  for (const Bunch& b : bunches)
    if (const double reach = nearest.distance + touch + b.ball.radius; &b != likely && (x - b.ball.centre).squaredNorm() <= reach * reach) search(b);
  return nearest.pseudo.dot(x - nearest.foot) > 0.1 * nearest.pseudo.norm() * nearest.distance ? nearest.distance : 0;
}

/// Vertices of V against triangles of T. `first` tells whether the triangles belong to body A.
void vertex_face(const Search& s, const Patch& T, const Patch& V, bool first, std::vector<Ball>& balls, std::vector<ContactPoint>& out) {
  enclose(T, balls);
  constexpr std::size_t many = 64;   // triangles from which on a vertex far before all of them is told at once
  thread_local std::vector<Bunch> bunches;
  if (T.triangles.size() > many) bunch(balls, bunches);
  for (const auto& v : V.vertices) {
    if (T.triangles.size() > many && ahead(T, balls, bunches, v.x, s.touch) > s.margin + 100 * s.touch) continue;
    const std::size_t start = out.size();
    bool behind = false;
    // Faces that meet in a convex edge on which the vertex lies, the one that its cone admits best first.
    constexpr int most = 8;
    std::pair<double, const Patch::Triangle*> on_edge[most];
    int on_edges = 0;
    const auto emit = [&](const Patch::Triangle& t, const Vec3& n, const Vec3& foot, double gap) {
      for (std::size_t i = start; i < out.size(); ++i)  // the next triangle of the same plane
        if ((first ? out[i].normal : Vec3(-out[i].normal)).dot(n) > 1 - 1e-12 && std::abs(out[i].gap - gap) <= 4 * s.touch) return;
      ContactPoint c;
      c.point_a = first ? foot : v.x;
      c.point_b = first ? v.x : foot;
      c.normal = first ? n : Vec3(-n);
      c.gap = gap;
      c.area = 0;
      c.key = first ? make_key(Form::face_vertex, t.face, v.id) : make_key(Form::vertex_face, v.id, t.face);
      c.face_a = first ? t.id : -1;
      c.face_b = first ? -1 : t.id;
      out.push_back(c);
    };
    for (std::size_t k = 0; k < T.triangles.size(); ++k) {
      const auto& t = T.triangles[k];
      const double h = t.n.dot(v.x) - t.level;
      if (h > s.margin || (behind && h < -s.touch)) continue;
      // Behind a notch lies what projects beside both its faces: as far beside as it is deep, and a few times that where the notch is sharp.
      const double beside = h < -s.touch ? -sharpest_notch * h : 0;
      const double reach = balls[k].radius + beside + 100 * s.touch;
      if ((v.x - balls[k].centre).squaredNorm() - h * h > reach * reach) continue;   // it projects beside the triangle
      if (h < -s.touch) {
        behind = h > -s.depth && inside(t, v.x, beside) >= 0;
        continue;
      }
      const int where = inside(t, v.x, s.touch);
      if (where < 0) continue;
      const double fall = falling(V, v, t.n);
      if (fall < -steep && facing(V, v, t.n) > -lean) continue;  // the far side of the other body
      if (where == 1 && h <= s.touch) {
        if (fall < -steep) continue;  // flush with a side wall
        int at = on_edges < most ? on_edges++ : most;
        for (; at > 0 && (at == most || on_edge[at - 1].first < fall - 1e-9); --at)
          if (at < most) on_edge[at] = on_edge[at - 1];
        if (at < most) on_edge[at] = {fall, &t};
        continue;
      }
      emit(t, t.n, v.x - h * t.n, h);
    }
    // Across a convex edge only one of the two faces holds the vertex (it may leave over the other); faces of a notch both.
    for (int i = 0; i < on_edges; ++i) {
      const auto& t = *on_edge[i].second;
      bool excluded = false;
      for (int j = 0; j < i && !excluded; ++j) {
        const auto& u = *on_edge[j].second;
        if (on_edge[j].first == -infinity) continue;
        const double above = t.n.dot(u.a + u.b + u.c) / 3 - t.level;
        excluded = above < -lean * (u.a - u.b).norm() && t.n.dot(u.n) < parallel_cosine;
      }
      if (excluded) {
        on_edge[i].first = -infinity;
        continue;
      }
      const double h = t.n.dot(v.x) - t.level;
      emit(t, t.n, v.x - h * t.n, h);
    }
    if (!behind) continue;

    // Overlap: is the vertex inside? Its nearest point of the surface tells; then the nearest face that its cone admits.
    double nearest = infinity, admitted = infinity;
    const Patch::Triangle *t_near = nullptr, *t_admitted = nullptr;
    Vec3 foot_near = v.x, foot_admitted = v.x, pseudo = Vec3::Zero();
    double known = infinity;   // the nearest is no farther
    for (const Ball& b : balls) known = std::min(known, (v.x - b.centre).squaredNorm());
    known = std::sqrt(known);
    const double use = std::min(s.depth, std::max(crossed_overlap * s.depth, 2 * known));   // a face that admits it farther away is not used
    for (std::size_t k = 0; k < T.triangles.size(); ++k) {
      const auto& t = T.triangles[k];
      const double h = t.n.dot(v.x) - t.level;
      if (std::abs(h) > std::min(nearest, s.depth) + s.touch && -h > admitted) continue;
      const double apart = (v.x - balls[k].centre).norm() - balls[k].radius;
      if (apart > std::min(nearest, known) + s.touch && apart > std::min(admitted, use)) continue;
      bool interior;
      const Vec3 y = closest_on_triangle(t, v.x, interior);
      const double d = (v.x - y).norm();
      if (d < nearest - s.touch) {
        nearest = d, t_near = &t, foot_near = y, pseudo = t.n;
      } else if (d < nearest + s.touch) {
        pseudo += t.n;
      }
      if (interior && h < 0 && -h < admitted && -h <= s.depth && falling(V, v, t.n) >= -steep)
        admitted = -h, t_admitted = &t, foot_admitted = y;
    }
    if (!t_near || nearest > s.depth || pseudo.dot(v.x - foot_near) >= 0) continue;
    // A vertex on the surface, or just behind it, has nothing to do with the far side of a thick body.
    const bool far = admitted > std::max(crossed_overlap * s.depth, 2 * nearest);
    if (nearest <= s.touch && (out.size() > start || far)) continue;
    if (t_admitted && !far) {
      emit(*t_admitted, t_admitted->n, foot_admitted, -admitted);
    } else {
      const Vec3 n = (foot_near - v.x).normalized();
      emit(*t_near, n, foot_near, -nearest);
    }
  }
}

void edge_edge(const Search& s, std::vector<ContactPoint>& out) {
  // Crossed edges lie apart by the gap or the overlap; springs overlap by a small part of the block at most.
  const double reach = std::max(s.margin, crossed_overlap * s.depth);
  for (const auto& a : s.A.edges) {
    const Vec3 lo = a.a.cwiseMin(a.b).array() - reach, hi = a.a.cwiseMax(a.b).array() + reach;
    const Vec3 da = a.b - a.a;
    const double la = da.norm();
    for (const auto& b : s.B.edges) {
      if ((b.a.cwiseMin(b.b).array() > hi.array()).any() || (b.a.cwiseMax(b.b).array() < lo.array()).any()) continue;
      const Vec3 db = b.b - b.a;
      const double lb = db.norm();
      Vec3 n = da.cross(db);
      const double sine = n.norm() / (la * lb);
      if (sine < 1e-4) continue;  // parallel: their ends are vertex-edge contacts
      n /= n.norm();
      if (n.dot(a.left + a.right) < 0) n = -n;
      double gap = n.dot(b.a - a.a);
      if (gap > s.margin || gap < -s.depth) continue;
      const auto c = closest_segments(a.a, a.b, b.a, b.b);
      const double end_a = s.touch / la, end_b = s.touch / lb;
      if (c.s <= end_a || c.s >= 1 - end_a || c.t <= end_b || c.t >= 1 - end_b) continue;
      const double al = n.dot(a.into_left), ar = n.dot(a.into_right), bl = -n.dot(b.into_left), br = -n.dot(b.into_right);
      if (std::max({al, ar, bl, br}) > lean) continue;
      ContactPoint p;
      // Nearly parallel faces: outside the arc the face itself gives the normal.
      p.face_a = p.face_b = -1;
      if (al > 0 || ar > 0)
        n = al >= ar ? a.left : a.right;
      else if (bl > 0 || br > 0)
        n = -(bl >= br ? b.left : b.right);
      gap = n.dot(c.b - c.a);
      if (gap > s.margin || gap < -s.depth) continue;
      // Edges on the far sides of two neighbours look crossed as well: if they are, neither has the other's point outside.
      if (s.closed && gap < -16 * s.touch && (outside(s.A, c.b, s.touch) || outside(s.B, c.a, s.touch))) continue;
      p.point_a = c.a, p.point_b = c.b, p.normal = n, p.gap = gap, p.area = 0;
      p.key = make_key(Form::edge_edge, a.id, b.id);
      out.push_back(p);
    }
  }
}

/// Vertices of V near convex edges of E, separated. `first`: the edges belong to body A.
void vertex_edge(const Search& s, const Patch& E, const Patch& V, bool first, std::vector<ContactPoint>& out) {
  for (const auto& e : E.edges) {
    const Vec3 lo = e.a.cwiseMin(e.b).array() - s.margin, hi = e.a.cwiseMax(e.b).array() + s.margin;
    const Vec3 d = e.b - e.a;
    const double l = d.norm();
    for (const auto& v : V.vertices) {
      if ((v.x.array() > hi.array()).any() || (v.x.array() < lo.array()).any()) continue;
      const double t = d.dot(v.x - e.a) / (l * l);
      if (t * l <= s.touch || (1 - t) * l <= s.touch) continue;
      const Vec3 foot = e.a + t * d, r = v.x - foot;
      const double gap = r.norm();
      if (gap <= s.touch || gap > s.margin) continue;
      const Vec3 n = r / gap;
      if (r.dot(e.into_left) >= -s.touch || r.dot(e.into_right) >= -s.touch) continue;  // over a face, or behind
      if (n.dot(e.left + e.right) <= 0 && e.right_face >= 0) continue;
      if (falling(V, v, n) < -steep) continue;
      ContactPoint c;
      c.point_a = first ? foot : v.x;
      c.point_b = first ? v.x : foot;
      c.normal = first ? n : Vec3(-n);
      c.gap = gap;
      c.area = 0;
      c.key = first ? make_key(Form::edge_vertex, e.id, v.id) : make_key(Form::vertex_edge, v.id, e.id);
      out.push_back(c);
    }
  }
}

void vertex_vertex(const Search& s, std::vector<ContactPoint>& out) {
  for (const auto& a : s.A.vertices)
    for (const auto& b : s.B.vertices) {
      const Vec3 r = b.x - a.x;
      const double sq = r.squaredNorm();
      if (sq > s.margin * s.margin || sq <= s.touch * s.touch) continue;
      const double gap = std::sqrt(sq);
      const Vec3 n = r / gap;
      if (falling(s.A, a, -n) * gap <= s.touch || falling(s.B, b, n) * gap <= s.touch) continue;
      ContactPoint c;
      c.point_a = a.x, c.point_b = b.x, c.normal = n, c.gap = gap, c.area = 0;
      c.key = make_key(Form::vertex_vertex, a.id, b.id);
      out.push_back(c);
    }
}

/// Area of triangle t clipped by the convex polygon / triangle q, both within `lean` of opposed.
double clipped_area(Scratch& w, const Patch::Triangle& t, const Patch::Triangle& q) {
  w.polygon.clear();
  w.polygon.push_back({t.a, 0, 0});
  w.polygon.push_back({t.b, 0, 0});
  w.polygon.push_back({t.c, 0, 0});
  const Vec3* p[3] = {&q.a, &q.b, &q.c};
  for (int k = 0; k < 3 && !w.polygon.empty(); ++k) {
    const Vec3 m = (*p[(k + 1) % 3] - *p[k]).cross(q.n);
    clip_half_space(w.polygon, *p[k], m, 0.0, 0, w.clipped);
    w.polygon.swap(w.clipped);
  }
  if (w.polygon.size() < 3) return 0;
  return std::max(0.0, polygon_area(w.polygon, t.n, [](const ClipVertex& v) -> const Vec3& { return v.x; }));
}

/// Distributes the area on which face `face` of B presses over the contact points on it, so that the weights sum to the
/// area and, for the hull of the points, keep the centroid.
void assign_area(Scratch& w, const std::vector<int>& which, const Vec3& n, double area, std::vector<ContactPoint>& points) {
  if (which.empty() || area <= 0) return;
  if (which.size() < 3) {
    for (const int i : which) points[i].area += area / static_cast<double>(which.size());
    return;
  }
  // Convex hull in the plane (monotone chain).
  const Vec3 u = n.unitOrthogonal(), v = n.cross(u);
  const auto px = [&](int i) { return u.dot(points[i].point_b); };
  const auto py = [&](int i) { return v.dot(points[i].point_b); };
  thread_local std::vector<int> order, hull;
  order = which;
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const double xi = px(i), xj = px(j);
    if (xi != xj) return xi < xj;
    const double yi = py(i), yj = py(j);
    return yi != yj ? yi < yj : i < j;
  });
  const auto turn = [&](int i, int j, int k) {
    return (px(j) - px(i)) * (py(k) - py(i)) - (py(j) - py(i)) * (px(k) - px(i));
  };
  hull.clear();
  const double flat = 1e-12 * area;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const int i : order) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), i) <= flat) hull.pop_back();
      hull.push_back(i);
    }
    hull.pop_back();
    std::reverse(order.begin(), order.end());
  }
  const std::size_t m = hull.size();
  w.angle.assign(m, 0.0);
  double cx = 0, cy = 0, twice = 0;
  for (std::size_t k = 1; k + 1 < m; ++k) {
    const double a = turn(hull[0], hull[k], hull[k + 1]);
    twice += a;
    cx += a * (px(hull[0]) + px(hull[k]) + px(hull[k + 1])) / 3;
    cy += a * (py(hull[0]) + py(hull[k]) + py(hull[k + 1])) / 3;
  }
  if (twice <= 0) {
    for (const int i : which) points[i].area += area / static_cast<double>(which.size());
    return;
  }
  cx /= twice, cy /= twice;
  double sum = 0;
  for (std::size_t k = 0; k < m; ++k) {
    const std::size_t l = (k + 1) % m;
    const double a = 0.5 * std::abs((px(hull[k]) - cx) * (py(hull[l]) - cy) - (py(hull[k]) - cy) * (px(hull[l]) - cx));
    w.angle[k] += a / 2, w.angle[l] += a / 2;
    sum += a;
  }
  for (std::size_t k = 0; k < m; ++k) points[hull[k]].area += w.angle[k] * area / sum;
}

/// Face-face areas: for each face of B, the overlap with all near-parallel triangles of A within the margin.
void press_areas(const Search& s, const Polyhedron& b, Scratch& w, std::vector<ContactPoint>& points) {
  thread_local std::vector<int> seen;
  seen.clear();
  for (std::size_t i = 0; i < s.B.triangles.size(); ++i) {
    const int face = s.B.triangles[i].face;
    if (std::find(seen.begin(), seen.end(), face) != seen.end()) continue;
    seen.push_back(face);
    const Vec3 n = s.B.triangles[i].n;
    w.chosen.clear();
    const int first = b.face_offset[face], last = b.face_offset[face + 1];
    for (int k = 0; k < static_cast<int>(points.size()); ++k) {
      const auto& c = points[k];
      if (c.normal.dot(n) > -parallel_cosine) continue;
      const auto form = static_cast<Form>(c.key >> 60);
      const int feature = static_cast<int>(c.key & 0x3fffffffu);
      bool on = false;
      if (form == Form::vertex_face)
        on = feature == face;
      else if (form == Form::face_vertex)
        on = std::find(b.face_vertices.begin() + first, b.face_vertices.begin() + last, feature) != b.face_vertices.begin() + last;
      else if (form == Form::edge_edge)
        on = b.edges[feature].left == face || b.edges[feature].right == face;
      if (on) w.chosen.push_back(k);
    }
    if (w.chosen.empty()) continue;
    double deepest = infinity;
    for (const int k : w.chosen) deepest = std::min(deepest, points[k].gap);
    double area = 0;
    for (const auto& t : s.A.triangles) {
      if (t.n.dot(n) > -parallel_cosine) continue;
      for (const auto& q : s.B.triangles) {
        if (q.face != face) continue;
        const double h0 = t.n.dot(q.a) - t.level, h1 = t.n.dot(q.b) - t.level, h2 = t.n.dot(q.c) - t.level;
        if (std::min({h0, h1, h2}) > s.margin || std::max({h0, h1, h2}) < deepest - s.touch) continue;
        area += clipped_area(w, t, q);
      }
    }
    if (area <= 0) continue;
    assign_area(w, w.chosen, n, area, points);
    for (const int k : w.chosen) points[k].face_b = face;
  }
}

/// A vertex on a vertex is found from both sides, a crossing at a corner from two edges: the first one stays.
void remove_doubles(const Search& s, std::vector<ContactPoint>& points) {
  std::size_t kept = 0;
  const double close = 16 * s.touch * s.touch;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool known = false;
    for (std::size_t j = 0; j < kept && !known; ++j)
      known = (points[i].point_b - points[j].point_b).squaredNorm() <= close &&
              (points[i].normal - points[j].normal).squaredNorm() <= 1e-12;
    if (!known) points[kept++] = points[i];
  }
  points.resize(kept);
}

int finish(const Search& s, const Polyhedron& b, const Vec3& origin, Scratch& w, std::vector<ContactPoint>& out) {
  auto& points = w.points;
  points.clear();
  vertex_face(s, s.A, s.B, true, w.balls, points);
  vertex_face(s, s.B, s.A, false, w.balls, points);
  edge_edge(s, points);
  vertex_edge(s, s.A, s.B, true, points);
  vertex_edge(s, s.B, s.A, false, points);
  vertex_vertex(s, points);
  remove_doubles(s, points);
  press_areas(s, b, w, points);
  for (auto& c : points) {
    c.point_a += origin;
    c.point_b += origin;
    out.push_back(c);
  }
  return static_cast<int>(points.size());
}

}  // namespace

int concave_concave(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b, double margin,
                    std::vector<ContactPoint>& out) {
  const Vec3 between = pose_a.c - pose_b.c;
  const double ra = a.radius * stretch_bound(pose_a.F), rb = b.radius * stretch_bound(pose_b.F);
  const double reach = ra + rb + margin;
  if (between.squaredNorm() > reach * reach) return 0;
  Box3 box_a, box_b;
  for (const auto& x : a.vertices) box_a.extend(between + pose_a.F * x);
  for (const auto& x : b.vertices) box_b.extend(pose_b.F * x);
  const double touch = 1e-9 * std::min(ra, rb) + 1e-15 * (std::max(ra, rb) + pose_a.c.cwiseAbs().maxCoeff());
  const Vec3 grow = Vec3::Constant(margin + touch);
  box_a.min() -= grow, box_a.max() += grow, box_b.min() -= grow, box_b.max() += grow;
  const Box3 common = box_a.intersection(box_b);
  if (common.isEmpty()) return 0;
  Scratch& w = scratch;
  gather(a, between, pose_a.F, common, w.a);
  gather(b, Vec3::Zero(), pose_b.F, common, w.b);
  if (w.a.triangles.empty() || w.b.triangles.empty()) return 0;
  const Search s{w.a, w.b, margin, touch, std::min(a.radius, b.radius), true};
  return finish(s, b, pose_b.c, w, out);
}

int surface_polyhedron(const SurfaceIndex::Impl& surface, const Polyhedron& b, const Pose& pose_b, double margin,
                       std::vector<ContactPoint>& out) {
  const double rb = b.radius * stretch_bound(pose_b.F);
  const double touch = 1e-9 * rb + 1e-15 * (rb + pose_b.c.cwiseAbs().maxCoeff());
  Box3 box;
  for (const auto& x : b.vertices) box.extend(pose_b.F * x);
  box.min().array() -= margin + touch;
  box.max().array() += margin + touch;
  Scratch& w = scratch;
  gather(surface, pose_b.c, box, w.a);
  if (w.a.triangles.empty()) return 0;
  // An edge or vertex of a triangle whose plane the whole block clears by the margin is out of reach. (The triangles stay:
  // a vertex behind another one asks for the nearest of all.)
  w.hull.set(b, Vec3::Zero(), pose_b.F);
  const auto clears = [&](const Vec3& n, const Vec3& x) { return w.hull.min_height(n) - n.dot(x) > margin + touch; };
  std::erase_if(w.a.edges, [&](const Patch::Edge& e) { return clears(e.left, e.a) || clears(e.right, e.a); });
  std::erase_if(w.a.vertices, [&](const Patch::Vertex& v) {
    for (int i = v.first_face; i < v.first_face + v.faces; ++i)
      if (clears(w.a.face_normals[i], v.x)) return true;
    return false;
  });
  Box3 near;
  for (const auto& t : w.a.triangles) near.extend(t.a), near.extend(t.b), near.extend(t.c);
  near.min().array() -= margin + touch;
  near.max().array() += margin + touch;
  // Vertices behind the surface count too: the box of the surface reaches down to the block's lowest point.
  near.extend(box);
  gather(b, Vec3::Zero(), pose_b.F, near, w.b);
  const Search s{w.a, w.b, margin, touch, b.radius, false};
  return finish(s, b, pose_b.c, w, out);
}

}  // namespace talus::contact::narrow

namespace talus::contact {

int surface_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out) {
  return narrow::surface_polyhedron(index.impl(), B, pose_b, margin, out);
}

}  // namespace talus::contact

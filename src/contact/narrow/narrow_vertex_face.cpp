/// Vertices against faces: on a face, over it, or inside the body behind it.
#include "contact/geometry/surface_near.hpp"
#include "contact/narrow/narrow_features.hpp"
#include "contact/narrow/narrow_near.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

constexpr double sharpest_notch = 4;  // tangent of half the angle by which its faces turn: 150 degrees

double facing(const Patch& p, const Patch::Vertex& v, const Vec3& n) {
  double least = infinity;
  for (int i = v.first_face; i < v.first_face + v.faces; ++i)
    least = std::min(least, n.dot(p.face_normals[i]));
  return least;
}

/// True if x, which is nearest to y on a side of the triangle, lies past the end of the surface there:
/// neither before it nor behind.
bool past_rim(const Patch::Triangle& t, const Vec3& x, const Vec3& y, double touch) {
  const Vec3* p[3] = {&t.a, &t.b, &t.c};
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k], across = e.cross(t.n).normalized();
    if (t.rim[k] && std::abs(across.dot(y - *p[k])) <= touch && across.dot(x - *p[k]) > touch) return true;
  }
  return false;
}

/// True if x lies behind the surface of which the patch is a part; a point of it is no farther than `reach`.
bool behind_surface(const Search& s, const Vec3& x, double reach) {
  thread_local Patch around;
  const Vec3 r = Vec3::Constant(reach + s.touch);
  gather(*s.surface, s.origin, Box3(x - r, x + r), around);
  Nearest nearest{.foot = x};
  for (const auto& t : around.triangles) nearest.visit(t, x, s.touch);
  return nearest.pseudo.dot(x - nearest.foot) < 0;
}

/// The triangles of one body that the vertices of the other meet.
struct Target {
  const Search& s;
  const Patch &T, &V;
  bool first;  // the triangles belong to body A
  const std::vector<Ball>& balls;
  std::vector<ContactPoint>& out;

  /// A contact of v, unless another triangle of the same plane has given it since out[start].
  void emit(const Patch::Vertex& v, std::size_t start, const Patch::Triangle& t, const Vec3& n,
            const Vec3& foot, double gap) const {
    for (std::size_t i = start; i < out.size(); ++i)
      if ((first ? out[i].normal : Vec3(-out[i].normal)).dot(n) > 1 - square(tolerances().same_normal) &&
          std::abs(out[i].gap - gap) <= 4 * s.touch)
        return;
    ContactPoint c = vertex_contact(first, foot, v.x, n, gap);
    c.key = first ? make_key(Form::face_vertex, t.face, v.id) : make_key(Form::vertex_face, v.id, t.face);
    c.face_a = first ? t.id : -1;
    c.face_b = first ? -1 : t.id;
    out.push_back(c);
  }

  bool before_faces(const Patch::Vertex& v) const;
  bool enters(const Patch::Vertex& v, double way) const;
  void inside_body(const Patch::Vertex& v, std::size_t start) const;
  bool behind_sides(const Patch::Vertex& v, std::size_t start, const Patch::Triangle& near,
                    double depth) const;
};

/// Faces that meet in a convex edge on which a vertex lies, the one that its cone admits best first.
struct EdgeFaces {
  static constexpr int most = 8;
  std::pair<double, const Patch::Triangle*> list[most];
  int count = 0;

  void add(double fall, const Patch::Triangle& t) {
    int at = count < most ? count++ : most;
    for (; at > 0 && (at == most || list[at - 1].first < fall - tolerances().same_place); --at)
      if (at < most) list[at] = list[at - 1];
    if (at < most) list[at] = {fall, &t};
  }
  /// Across a convex edge only one of the two faces holds the vertex (it may leave over the other); faces of
  /// a notch both, and so do faces none of which admits the vertex's cone: that is a notch then, which the
  /// edge fills.
  bool excluded(int i) const {
    const auto& t = *list[i].second;
    for (int j = 0; j < i; ++j) {
      const auto& u = *list[j].second;
      if (list[j].first < -tolerances().steep) continue;
      const double above = t.n.dot(u.a + u.b + u.c) / 3 - t.level;
      if (above < -tolerances().lean * (u.a - u.b).norm() && t.n.dot(u.n) < tolerances().parallel_cosine())
        return true;
    }
    return false;
  }
};

/// The vertex on or over faces; true if it may be behind one.
bool Target::before_faces(const Patch::Vertex& v) const {
  const std::size_t start = out.size();
  bool behind = false;
  EdgeFaces edge;
  for (std::size_t k = 0; k < T.triangles.size(); ++k) {
    const auto& t = T.triangles[k];
    const double h = t.n.dot(v.x) - t.level;
    if (h > s.margin || (behind && h < -s.touch)) continue;
    // Behind a notch lies what projects beside both its faces: as far beside as it is deep, and a few times
    // that where the notch is sharp.
    const double beside = h < -s.touch ? -sharpest_notch * h : 0;
    const double reach = balls[k].radius + beside + 100 * s.touch;
    if ((v.x - balls[k].centre).squaredNorm() - h * h > reach * reach)
      continue;  // it projects beside the triangle
    if (h < -s.touch) {
      behind = h > -s.depth && inside(t, v.x, beside) >= 0;
      continue;
    }
    const int where = inside(t, v.x, s.touch);
    if (where < 0) continue;
    const double fall = falling(V, v, t.n);
    if (fall < -tolerances().steep && facing(V, v, t.n) > -tolerances().lean)
      continue;  // the far side of the other body
    if (where == 1 && h <= s.touch) {
      edge.add(fall, t);
      continue;
    }
    emit(v, start, t, t.n, v.x - h * t.n, h);
  }
  for (int i = 0; i < edge.count; ++i) {
    if (edge.excluded(i)) {
      edge.list[i].first = -infinity;
      continue;
    }
    const auto& t = *edge.list[i].second;
    const double h = t.n.dot(v.x) - t.level;
    emit(v, start, t, t.n, v.x - h * t.n, h);
  }
  return behind;
}

/// True if, beside a face of the vertex and `way` from it, there is matter of both bodies. At a notch and
/// what fills it there is none.
bool Target::enters(const Patch::Vertex& v, double way) const {
  constexpr double in_plane = 1e-6,
                   below = 0.3;  // of the way: beneath what overlaps by no more than the vertex does
  const Whole &of_t = first ? *s.whole_a : *s.whole_b, &of_v = first ? *s.whole_b : *s.whole_a;
  for (int f = v.first_face; f < v.first_face + v.faces; ++f) {
    const Vec3& n = V.face_normals[static_cast<std::size_t>(f)];
    Vec3 into = Vec3::Zero();
    for (int i = v.first; i < v.first + v.count; ++i)
      if (const Vec3& d = V.directions[static_cast<std::size_t>(i)]; std::abs(n.dot(d)) < in_plane)
        into += d.normalized();
    if (into.isZero(in_plane)) continue;
    for (const double side :
         {1.0, -1.0}) {  // a corner of more than 180 degrees lies on the other side of its edges
      const Vec3 x = v.x + way * (side * into.normalized() - below * n);
      if (of_v.holds(x) && of_t.holds(x)) return true;
    }
  }
  return false;
}

/// Overlap: is the vertex inside? Its nearest point of the surface tells; then the nearest face that its cone
/// admits.
void Target::inside_body(const Patch::Vertex& v, std::size_t start) const {
  double nearest = infinity, admitted = infinity;
  const Patch::Triangle *t_near = nullptr, *t_admitted = nullptr;
  Vec3 foot_near = v.x, foot_admitted = v.x, pseudo = Vec3::Zero();
  double known = infinity;  // the nearest is no farther
  for (const Ball& b : balls) known = std::min(known, (v.x - b.centre).squaredNorm());
  known = std::sqrt(known);
  const double use = std::min(
      s.depth,
      std::max(crossed_overlap * s.depth, 2 * known));  // a face that admits it farther away is not used
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
      // Of faces that share the nearest point it lies behind the one that gives the contact its name and law.
      if (t.n.dot(y - v.x) > t_near->n.dot(foot_near - v.x) + s.touch) t_near = &t, foot_near = y;
    }
    if (interior && h < 0 && -h < admitted && -h <= s.depth && falling(V, v, t.n) >= -tolerances().steep)
      admitted = -h, t_admitted = &t, foot_admitted = y;
  }
  if (!t_near || nearest > s.depth || pseudo.dot(v.x - foot_near) >= 0) return;
  // At a corner the sum of the normals does not tell, nor do faces beyond the margin, which are not all in
  // the patch.
  const bool far_off = nearest > s.margin;
  if (const Whole* whole = first ? s.whole_a : s.whole_b;
      whole != nullptr && (far_off || (pseudo != t_near->n && nearest > 16 * s.touch)) && !whole->holds(v.x))
    return;
  if (first && s.surface != nullptr && far_off && !behind_surface(s, v.x, nearest)) return;
  if (pseudo == t_near->n && past_rim(*t_near, v.x, foot_near, s.touch)) return;
  // A vertex on the surface, or just behind it, has nothing to do with the far side of a thick body.
  const bool far = admitted > std::max(crossed_overlap * s.depth, 2 * nearest);
  if (nearest <= s.touch && (out.size() > start || far)) return;
  // Nor has one that lies on the surface at the bottom of a notch that the other body fills: the face that
  // its cone admits lies across that body.
  const bool across = t_admitted && !far && admitted > 2 * nearest && s.closed() &&
                      !enters(v, std::max(16 * nearest, 0.25 * admitted));
  if (across && nearest <= s.touch) return;
  if (t_admitted && !far && !across)
    emit(v, start, *t_admitted, t_admitted->n, foot_admitted, -admitted);
  else if (across || !behind_sides(v, start, *t_near, nearest))
    emit(v, start, *t_near, (foot_near - v.x).normalized(), foot_near, -nearest);
  if (t_admitted == t_near && !across) behind_sides(v, start, *t_near, nearest);
}

/// In a valley the body is all that lies behind any of its sides, and a vertex behind several has to leave
/// each. Of two planes that turn by theta a place at a depth d behind the one is behind both if their line is
/// no farther than d / sin theta. True if there are any.
bool Target::behind_sides(const Patch::Vertex& v, std::size_t start, const Patch::Triangle& near,
                          double depth) const {
  const auto above = [](const Patch::Triangle& t, const Patch::Triangle& plane) {
    return plane.n.dot(t.a + t.b + t.c) / 3 - plane.level;
  };
  bool any = false;
  for (std::size_t k = 0; k < T.triangles.size(); ++k) {
    const auto& t = T.triangles[k];
    const double h = t.n.dot(v.x) - t.level;
    if (h >= 0 || -h > s.depth) continue;
    if (&t != &near) {
      const double sine = t.n.cross(near.n).norm();
      const auto too_far = [&](double distance) { return distance * sine > depth + s.touch; };
      bool interior;
      if (too_far((v.x - balls[k].centre).norm() - balls[k].radius) || above(t, near) <= 0 ||
          above(near, t) <= 0 || too_far((v.x - closest_on_triangle(t, v.x, interior)).norm()))
        continue;
    }
    if (falling(V, v, t.n) < -tolerances().steep) continue;
    emit(v, start, t, t.n, v.x - h * t.n, h);
    any = true;
  }
  return any;
}

}  // namespace

bool Whole::holds(const Vec3& x) const {
  return encloses(p.tree, p.vertices, p.triangles, F.inverse() * (x - centre),
                  tolerances().same_place * p.radius);
}

namespace {

/// How far the surface of a body is from x.
double distance_to(const Patch& p, const Vec3& x) {
  Nearest nearest{.foot = x};
  for (const auto& t : p.triangles)
    if (std::abs(t.n.dot(x) - t.level) <= nearest.distance) nearest.visit(t, x, 0);
  return nearest.distance;
}

/// True if x is inside, where the surface is so far away.
bool behind(const Search& s, bool first, const Vec3& x, double distance) {
  const Whole* whole = first ? s.whole_a : s.whole_b;
  return whole != nullptr ? whole->holds(x) : behind_surface(s, x, distance);
}

}  // namespace

bool inside_by(const Search& s, bool first, const Vec3& x, double depth) {
  const double distance = distance_to(first ? s.A : s.B, x);
  return distance > depth && behind(s, first, x, distance);
}

bool in_body(const Search& s, bool first, const Vec3& x) {
  const double distance = distance_to(first ? s.A : s.B, x);
  return distance <= s.touch || (s.told() && behind(s, first, x, distance));
}

void vertex_face(const Search& s, const Patch& T, const Patch& V, bool first,
                 std::vector<ContactPoint>& out) {
  if (T.triangles.empty()) return;
  thread_local NearTriangles triangles;
  triangles.set(T);
  const Target target{s, T, V, first, triangles.balls(), out};
  for (const auto& v : V.vertices) {
    if (s.common != nullptr && !s.common->contains(v.x))
      continue;  // a corner of a triangle that only reaches in
    if (triangles.ahead(v.x, s.touch) > s.margin + 100 * s.touch) continue;
    const std::size_t start = out.size();
    if (target.before_faces(v)) target.inside_body(v, start);
  }
}

}  // namespace talus::contact::narrow

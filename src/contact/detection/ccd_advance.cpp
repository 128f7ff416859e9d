/// Time of impact by conservative advancement on the true motion.
///
/// At s the pair has a separating (or least overlapping) axis n with gap g. Seen from the body that owns the
/// axis (frame K, turning with it) a vertex y of the other body moves along n as
///
///   h(t) >= h_0 + h' t + ... + h'''' t^4 / 24 - J t^5 / 120
///   J = (|w_K| + |w|)^5 r + |w_K|^5 C + 5 |w_K|^4 C' + 10 |w_K|^3 C''
///
/// which bounds the gap from below over [s, s + T] whatever the true normal does. T is the longest step for
/// which the bound stays above the level sought, so no crossing is ever stepped over.
///
/// symbol   meaning                                                        unit   shape
/// w_K, w   rotation over the step of the owner and of the other body      rad    3
/// r        largest distance of a vertex from its centroid                 m
/// C        bound on the distance of the centroids, C', C'' its rates      m
#include <array>
#include <limits>

#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_axes.hpp"
#include "contact/narrow/narrow_gjk.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {
namespace {

using narrow::Hull;

constexpr double never = 2.0;
constexpr int most_advances = 20000, most_trials = 60;

struct Mover {
  const Polyhedron* p;
  const Motion* motion;
  double reach;  // largest distance of a vertex from c [m]
};

struct Levels {
  double stop;  // gap at which to report
  double aim;   // a little below, so that the advance arrives
};

/// A triangle whose plane the block has not met up to s.
struct MetPlane {
  double s;
  int triangle;
  Levels level;
};

struct AdvanceScratch {
  Hull a, b, start;
  std::vector<int> triangles;
  std::vector<MetPlane> planes;
  std::vector<std::pair<Vec3, double>> pressed;  // normal and gap of the triangles in contact at the start
};
thread_local AdvanceScratch advance_scratch;

Mover mover(const Polyhedron& p, const Motion& m) {
  return {&p, &m, p.radius * narrow::stretch_bound(m.start.F)};
}

Vec3 velocity(const Motion& m, double s) { return m.displacement + (2 * s - 1) * m.half_gravity_step; }

/// Lower bound over [0, T] of the gap of the other body's vertices along n (out of the owner), the owner's
/// extent given.
///
/// In the owner's frame h^(k) = n . D^k (c + R x) with D u = u' - w_K x u, so that with n_m = (w_K x)^m n
///
///   h^(k) = X_k . x + n_k . c + k n_(k-1) . c' + k (k-1) / 2 n_(k-2) . c''
///   X_k = sum over j of C(k, j) (-w x)^j n_(k-j)
///
/// is linear in the place x of a vertex. h is at least its Taylor polynomial of order 4 less J T^5 / 120; of
/// the polynomial the larger of two bounds holds: that of its parabola at its lowest and of the rest at its
/// ends, and the least of its Bernstein coefficients.
class Bound {
 public:
  /// `other`: the hull of the other body relative to the owner's centroid, its centre `between`; the
  /// rotations, relative velocity of the centroids and its constant derivative; `height`: n . (highest point
  /// of the owner); `reach` of the other body.
  Bound(const Hull* other, const Vec3& n, const Vec3& between, const Vec3& owner_turns,
        const Vec3& other_turns, const Vec3& velocity, const Vec3& bend, double height, double reach)
      : hull_(other),
        centre_(between),
        wk_(owner_turns),
        w_(other_turns),
        v_(velocity),
        q2_(bend),
        reach_(reach) {
    look_along(n, height);
  }
  /// The same motion along another axis.
  void look_along(const Vec3& n, double height) {
    static constexpr double binomial[orders][orders] = {
        {1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}};
    height_ = height;
    Vec3 turned[orders];  // n_m; then (-w x)^j of them
    turned[0] = n;
    for (int m = 1; m < orders; ++m) turned[m] = wk_.cross(turned[m - 1]);
    for (int k = 0; k < orders; ++k) {
      at_[k].setZero();
      of_centre_[k] = turned[k].dot(centre_);
      if (k > 0) of_centre_[k] += k * turned[k - 1].dot(v_);
      if (k > 1) of_centre_[k] += 0.5 * k * (k - 1) * turned[k - 2].dot(q2_);
    }
    for (int j = 0; j < orders; ++j) {
      for (int k = j; k < orders; ++k) at_[k] += binomial[k][j] * turned[k - j];
      for (int m = 0; m + j + 1 < orders; ++m) turned[m] = turned[m].cross(w_);
    }
    for (int k = 0; k < orders; ++k) of_centre_[k] -= at_[k].dot(centre_);  // the hull holds x + c
  }
  double over(double T) const {
    using Packet = Hull::Packet;
    const double ak = wk_.norm(), sum = ak + w_.norm(), ak3 = ak * ak * ak,
                 speed = v_.norm() + T * q2_.norm(), distance = centre_.norm() + T * speed;
    const double jerk =
        sum * sum * sum * sum * sum * reach_ + ak3 * (ak * ak * distance + 5 * ak * speed + 10 * q2_.norm());
    const double T2 = T * T / 2, T3 = T * T2 / 3, T4 = T * T3 / 4;
    Packet least = Packet::Constant(std::numeric_limits<double>::infinity());
    for (int i = 0; i < hull_->padded; i += Hull::width) {
      const auto order = [&](int k) -> Packet { return of_centre_[k] + hull_->heights(i, at_[k]); };
      const Packet h = order(0), rate = order(1), bend = order(2), a1 = T * rate, a2 = T2 * bend,
                   a3 = T3 * order(3), a4 = T4 * order(4);
      // The vertex of the parabola where it lies within [0, T]; t^3 times a line is least at an end.
      const Packet turn = h - 0.5 * rate * rate / (bend > 0).select(bend, 1.0), ends = h.min(h + a1 + a2);
      const Packet parabola =
          (bend > 0 && rate < 0 && -rate < T * bend).select(turn, ends) + a3.min(a3 + a4).min(0.0);
      const Packet bernstein = h.min(h + 0.25 * a1)
                                   .min(h + 0.5 * a1 + a2 / 6)
                                   .min(h + 0.75 * a1 + 0.5 * a2 + 0.25 * a3)
                                   .min(h + a1 + a2 + a3 + a4);
      least = least.min(parabola.max(bernstein));
    }
    return least.minCoeff() - jerk * T * T4 / 5 - height_;
  }
  /// A time in [0, T] up to which the bound stays above `aim`: T, or just before it falls below; 0 if it is
  /// below at once. `gap`: the bound at 0.
  double clear_for(double T, double aim, double gap) const {
    double low = over(T);
    if (low >= aim) return T;
    if (gap < aim) return 0;
    for (int trial = 0; trial < most_trials; ++trial) {
      T *= std::clamp(0.999 * (gap - aim) / (gap - low), 0.05, 0.95);
      low = over(T);
      if (low >= aim) return T;
    }
    return 0;
  }

 private:
  static constexpr int orders = 5;
  const Hull* hull_;
  Vec3 centre_, wk_, w_, v_, q2_;
  double reach_, height_ = 0;
  Vec3 at_[orders];           // X_k
  double of_centre_[orders];  // of h^(k), what is the same for all vertices
};

/// Poses both, relative to A's centroid, and finds the axis.
narrow::SignedAxis look(const Mover& A, const Mover& B, double s, Hull& a, Hull& b) {
  const Pose pa = A.motion->at(s), pb = B.motion->at(s);
  const Vec3 between = pb.c - pa.c;
  a.set(*A.p, Vec3::Zero(), pa.F);
  b.set(*B.p, between, pb.F);
  const auto sep = narrow::gjk(a, b, between, std::numeric_limits<double>::infinity());
  if (!sep.overlap && sep.distance > tolerances().same_place * std::min(A.reach, B.reach)) {
    // Very close together the direction of the closest points is lost in round-off: it must part the two as
    // far as they are.
    double lo, hi;
    a.extent(sep.normal, lo, hi);
    if (b.min_height(sep.normal) - hi > 0.99 * sep.distance) return {sep.distance, sep.normal};
  }
  return narrow::signed_axis(a, b);
}

double extent_up(const Hull& h, const Vec3& n) {
  double lo, hi;
  h.extent(n, lo, hi);
  return hi;
}

/// The bound along an axis found at s, of hulls that are posed relative to A's centroid (and moved to B's if
/// B owns it).
Bound bound_along(const Mover& A, const Mover& B, bool owner_is_a, const Vec3& normal, double s,
                  const Vec3& between, Hull& a, Hull& b) {
  const Vec3 v = velocity(*B.motion, s) - velocity(*A.motion, s);
  const Vec3 q2 = 2 * (B.motion->half_gravity_step - A.motion->half_gravity_step);
  if (owner_is_a)
    return Bound(&b, normal, between, A.motion->rotation, B.motion->rotation, v, q2, extent_up(a, normal),
                 B.reach);
  for (Hull* h : {&a, &b})
    for (int i = 0; i < h->padded; ++i)
      h->x[i] -= between.x(), h->y[i] -= between.y(), h->z[i] -= between.z();
  return Bound(&a, -normal, -between, B.motion->rotation, A.motion->rotation, -v, -q2, extent_up(b, -normal),
               A.reach);
}

/// First s in [from, to] where the gap falls to levels.stop; `never` if it does not.
double advance(const Mover& A, const Mover& B, double from, double to, const Levels& levels) {
  Hull &a = advance_scratch.a, &b = advance_scratch.b;
  double s = from;
  for (int iteration = 0; iteration < most_advances; ++iteration) {
    const narrow::SignedAxis now = look(A, B, s, a, b);
    if (now.gap <= levels.stop) return s;
    if (s >= to) return never;
    // The axis turns with the body whose face or edge it stands on; closest points do not tell which that is,
    // so the better bound counts.
    const Vec3 between = B.motion->at(s).c - A.motion->at(s).c;
    double T = bound_along(A, B, true, now.normal, s, between, a, b).clear_for(to - s, levels.aim, now.gap);
    if (T < to - s)
      T = std::max(
          T, bound_along(A, B, false, now.normal, s, between, a, b).clear_for(to - s, levels.aim, now.gap));
    if (T >= to - s) return never;
    const double next = s + T;
    if (next <= s) return s;  // no progress possible in double precision: it is there
    s = next;
  }
  return s;  // conservative: never past the impact
}

/// The rule of the header for a pair of convex sets: beyond tolerance at the start, or within.
Levels levels_for(double start_gap, bool touching, double tolerance) {
  const double stop = touching ? std::min(0.0, start_gap) - 10 * tolerance : tolerance;
  return {stop, stop - tolerance / 10};
}

/// A triangle as a flat polyhedron: two faces back to back, three edges. Allocated once per thread.
struct FlatTriangle {
  Polyhedron p;
  FlatTriangle() {
    p.vertices.resize(3);
    p.face_offset = {0, 3, 6};
    p.face_vertices = {0, 1, 2, 0, 2, 1};
    p.face_edges = {0, 1, 2, 2, 1, 0};
    p.edges = {{0, 1, 0, 1, 0}, {1, 2, 0, 1, 0}, {2, 0, 0, 1, 0}};
    p.face_normals.resize(2);
    p.vertex_edge_offset = {0, 2, 4, 6};
    p.vertex_edges = {0, 2, 0, 1, 1, 2};
    p.axis_faces = {0};
    p.axis_opposite = {1};
    p.axis_edges = {0, 1, 2};
    p.convex = true;
  }
  bool set(const Vec3& a, const Vec3& b, const Vec3& c) {
    p.vertices[0] = a, p.vertices[1] = b, p.vertices[2] = c;
    const Vec3 n = (b - a).cross(c - a);
    const double l = n.norm();
    if (!(l > 0)) return false;
    p.face_normals[0] = n / l;
    p.face_normals[1] = -n / l;
    p.radius = std::sqrt(std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()}));
    return true;
  }
};
thread_local FlatTriangle flat_a, flat_b;

/// The box of both ends of a part ds of the motion, grown by what the way between them bends out of it.
Box3 with_bows(const Mover& m, double ds, double margin, const Box3& ends) {
  const double angle = ds * m.motion->rotation.norm();
  const Vec3 grow = ds * ds / 4 * m.motion->half_gravity_step.cwiseAbs() +
                    Vec3::Constant(m.reach * std::min(angle * angle / 8, 2.0) + margin);
  return {ends.min() - grow, ends.max() + grow};
}

/// Box of the motion over [s0, s1].
Box3 swept(const Mover& m, double s0, double s1, double margin) {
  Box3 box = bounds(*m.p, m.motion->at(s0));
  box.extend(bounds(*m.p, m.motion->at(s1)));
  return with_bows(m, s1 - s0, margin, box);
}

bool meet(const Box3& l, const Box3& r) {
  return (l.min().array() <= r.max().array()).all() && (l.max().array() >= r.min().array()).all();
}

/// Box of one triangle of a moving body over [s0, s1].
Box3 swept_triangle(const Mover& m, const std::array<int, 3>& t, const Pose& p0, const Pose& p1, double ds,
                    double margin) {
  Box3 box;
  for (const int v : t) box.extend(p0.world(m.p->vertices[v])), box.extend(p1.world(m.p->vertices[v]));
  return with_bows(m, ds, margin, box);
}

/// Calls use(mover) for the convex pieces of a body that may meet `box`: itself if convex, else its
/// triangles.
template <class Use>
void pieces(const Mover& m, FlatTriangle& flat, const Box3& box, double s0, double s1, double margin,
            Use&& use) {
  if (m.p->convex) {
    use(m);
    return;
  }
  const Pose p0 = m.motion->at(s0), p1 = m.motion->at(s1);
  for (const auto& t : m.p->triangles) {
    if (!meet(swept_triangle(m, t, p0, p1, s1 - s0, margin), box)) continue;
    if (!flat.set(m.p->vertices[t[0]], m.p->vertices[t[1]], m.p->vertices[t[2]])) continue;
    use(Mover{&flat.p, m.motion, m.reach});
  }
}

/// A convex piece of a body, -1 for itself, and its box over the time that it was looked for.
struct MovingTriangle {
  int triangle;
  Box3 box;
};

/// Of two pieces at `from` along the normal of a triangle, A's or B's: how far they are apart, at least,
/// and whether they stay farther than `aim` up to `to`. Two bodies that lie on each other have thousands of
/// pairs of triangles beside each other, and nearly all are cleared so.
struct AlongFace {
  double gap = -std::numeric_limits<double>::infinity();
  bool clear = false;
};
AlongFace along_faces(const Mover& A, const Mover& B, double from, double to, double aim) {
  Hull &a = advance_scratch.a, &b = advance_scratch.b;
  const Pose pa = A.motion->at(from), pb = B.motion->at(from);
  const Vec3 between = pb.c - pa.c;
  a.set(*A.p, Vec3::Zero(), pa.F);
  b.set(*B.p, between, pb.F);
  AlongFace best;
  for (const bool owner_is_a : {true, false}) {
    const Mover& owner = owner_is_a ? A : B;
    if (owner.p->vertices.size() != 3) continue;
    const Vec3 out = (narrow::cofactor((owner_is_a ? pa : pb).F) * owner.p->face_normals[0]).normalized();
    const Bound bound = bound_along(A, B, owner_is_a, owner_is_a ? out : Vec3(-out), from, between, a, b);
    best.gap = std::max(best.gap, bound.over(0));
    if (to > from && bound.over(to - from) >= aim) best.clear = true;
    if (best.clear) break;
  }
  return best;
}

/// The pieces that may meet `box` over [s0, s1].
void find_pieces(const Mover& m, const Box3& box, double s0, double s1, double margin,
                 std::vector<MovingTriangle>& out) {
  out.clear();
  if (m.p->convex) {
    out.push_back({-1, swept(m, s0, s1, margin)});
    return;
  }
  const Pose p0 = m.motion->at(s0), p1 = m.motion->at(s1);
  for (std::size_t t = 0; t < m.p->triangles.size(); ++t)
    if (const Box3 own = swept_triangle(m, m.p->triangles[t], p0, p1, s1 - s0, margin); meet(own, box))
      out.push_back({static_cast<int>(t), own});
}

/// Calls use(a, b) for the pairs of pieces whose boxes meet over [s0, s1].
template <class Use>
void pairs_of_pieces(const Mover& a, const Mover& b, const Box3& common, double s0, double s1, double margin,
                     Use&& use) {
  thread_local std::vector<MovingTriangle> of_a, of_b;
  find_pieces(a, common, s0, s1, margin, of_a);
  find_pieces(b, common, s0, s1, margin, of_b);
  const auto with = [](const Mover& m, FlatTriangle& flat, int triangle, auto&& then) {
    if (triangle < 0) return then(m);
    const auto& t = m.p->triangles[static_cast<std::size_t>(triangle)];
    if (flat.set(m.p->vertices[t[0]], m.p->vertices[t[1]], m.p->vertices[t[2]]))
      then(Mover{&flat.p, m.motion, m.reach});
  };
  for (const MovingTriangle& p : of_a)
    with(a, flat_a, p.triangle, [&](const Mover& piece_a) {
      for (const MovingTriangle& q : of_b)
        if (meet(p.box, q.box))
          with(b, flat_b, q.triangle, [&](const Mover& piece_b) { use(piece_a, piece_b); });
    });
}

/// The time up to which the convex hulls of two bodies are proved to stay farther apart than `aim`; `never`
/// if they do all along. Before it hollow bodies need no look at their triangles.
double hulls_apart(const Mover& A, const Mover& B, double aim) {
  Hull &a = advance_scratch.a, &b = advance_scratch.b;
  double s = 0;
  for (int iteration = 0; iteration < most_advances; ++iteration) {
    const Pose pa = A.motion->at(s), pb = B.motion->at(s);
    const Vec3 between = pb.c - pa.c;
    a.set(*A.p, Vec3::Zero(), pa.F);
    b.set(*B.p, between, pb.F);
    const auto sep = narrow::gjk(a, b, between, std::numeric_limits<double>::infinity());
    if (sep.overlap) return s;
    const double gap = b.min_height(sep.normal) - extent_up(a, sep.normal);
    if (!(gap > aim)) return s;
    double T = bound_along(A, B, true, sep.normal, s, between, a, b).clear_for(1 - s, aim, gap);
    if (T < 1 - s)
      T = std::max(T, bound_along(A, B, false, sep.normal, s, between, a, b).clear_for(1 - s, aim, gap));
    if (T >= 1 - s) return never;
    if (s + T <= s) return s;
    s += T;
  }
  return s;
}

/// Calls use(s0, s1) for parts of [s0, s1] one after the other in which no point of either body goes farther
/// than the body reaches, while it returns true; parts in which their boxes do not meet are passed over.
template <class Use>
bool short_parts(const Mover& a, const Mover& b, double s0, double s1, double margin, Use&& use) {
  if (!meet(swept(a, s0, s1, margin), swept(b, s0, s1, margin))) return true;
  const auto far = [&](const Mover& m) {  // |c'| <= |d| + |q|
    const Motion& of = *m.motion;
    return (s1 - s0) * (of.displacement.norm() + of.half_gravity_step.norm() + m.reach * of.rotation.norm()) >
           m.reach;
  };
  if (!far(a) && !far(b)) return use(s0, s1);
  const double middle = 0.5 * (s0 + s1);
  return short_parts(a, b, s0, middle, margin, use) && short_parts(a, b, middle, s1, margin, use);
}

}  // namespace

double time_of_impact(const Polyhedron& A, const Motion& motion_a, const Polyhedron& B,
                      const Motion& motion_b, double tolerance) {
  const Mover a = mover(A, motion_a), b = mover(B, motion_b);
  const Box3 box_a = swept(a, 0, 1, tolerance), box_b = swept(b, 0, 1, tolerance);
  if (!meet(box_a, box_b)) return never;
  if (A.convex && B.convex) {
    const double gap = look(a, b, 0, advance_scratch.a, advance_scratch.b).gap;
    return advance(a, b, 0, 1, levels_for(gap, gap <= tolerance, tolerance));
  }
  const double from = hulls_apart(a, b, tolerance);
  if (from > 1) return never;
  double start = std::numeric_limits<double>::infinity();
  if (from == 0)
    pairs_of_pieces(a, b, box_a.intersection(box_b), 0, 0, tolerance, [&](const Mover& pa, const Mover& pb) {
      if (along_faces(pa, pb, 0, 0, 0).gap < start)
        start = std::min(start, look(pa, pb, 0, advance_scratch.a, advance_scratch.b).gap);
    });
  const Levels levels = levels_for(start, start <= tolerance, tolerance);
  double first = never;
  short_parts(a, b, from, 1, tolerance, [&](double s0, double s1) {
    const Box3 common = swept(a, s0, s1, tolerance).intersection(swept(b, s0, s1, tolerance));
    pairs_of_pieces(a, b, common, s0, s1, tolerance, [&](const Mover& pa, const Mover& pb) {
      const double to = std::min(first, s1);
      if (!along_faces(pa, pb, s0, to, levels.aim).clear)
        first = std::min(first, advance(pa, pb, s0, to, levels));
    });
    return first > 1;
  });
  return first;
}

double time_of_impact(const Plane& plane, const Polyhedron& B, const Motion& motion, double tolerance) {
  const Mover b = mover(B, motion);
  Hull& hull = advance_scratch.b;
  const Vec3& n = plane.normal;
  double s = 0;
  Levels levels{};
  for (int iteration = 0; iteration < most_advances; ++iteration) {
    const Pose pose = motion.at(s);
    hull.set(B, pose.c - plane.point, pose.F);
    const double gap = hull.min_height(n);
    if (iteration == 0) levels = levels_for(gap, gap <= tolerance, tolerance);
    if (gap <= levels.stop) return s;
    if (s >= 1) return never;
    const Bound bound{&hull,
                      n,
                      pose.c - plane.point,
                      Vec3::Zero(),
                      motion.rotation,
                      velocity(motion, s),
                      2 * motion.half_gravity_step,
                      0.0,
                      b.reach};
    const double T = bound.clear_for(1 - s, levels.aim, gap);
    const double next = T >= 1 - s ? 1.0 : s + T;
    if (next <= s) return s;
    s = next;
  }
  return s;
}

namespace {

/// A block on its way over the triangles of a surface at rest.
struct Passage {
  const SurfaceIndex::Impl& surface;
  const Polyhedron& B;
  const Motion& motion;
  Mover b;
  double tolerance;
  bool touching = false;  // at the start

  const Vec3& corner(int t, int k) const { return surface.surface.vertices[surface.surface.triangles[t][k]]; }
  void find_triangles(const Box3& box) const;
  /// Triangles move with the local origin at their first corner, so that far coordinates do not cost
  /// accuracy.
  template <class Use>
  void with_triangle(int t, Use&& use) const {
    const Vec3& o = corner(t, 0);
    if (!flat_a.set(Vec3::Zero(), corner(t, 1) - o, corner(t, 2) - o)) return;
    Motion at;
    at.start.c = o;
    use(Mover{&flat_a.p, &at, flat_a.p.radius});
  }
  void find_pressed();
  Levels levels(int t) const;
  double first_impact(double s0, double s1, const Box3& box) const;
};

/// Triangles near the box, in ascending order.
void Passage::find_triangles(const Box3& box) const {
  auto& list = advance_scratch.triangles;
  list.clear();
  surface.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) {
        if (meet(surface.triangle_box(t), box)) list.push_back(t);
        return true;
      });
  std::sort(list.begin(), list.end());
}

void Passage::find_pressed() {
  auto& pressed = advance_scratch.pressed;
  pressed.clear();
  find_triangles(swept(b, 0, 0, tolerance));
  advance_scratch.start.set(B, motion.start.c, motion.start.F);
  for (const int t : advance_scratch.triangles) {
    const Vec3& out = surface.normal[t];
    if (advance_scratch.start.min_height(out) - out.dot(corner(t, 0)) > 2 * tolerance)
      continue;  // the whole block is above its plane
    with_triangle(t, [&](const Mover& a) {
      double gap = std::numeric_limits<double>::infinity();
      pieces(b, flat_b, surface.triangle_box(t), 0, 0, 2 * tolerance, [&](const Mover& piece) {
        gap = std::min(gap, look(a, piece, 0, advance_scratch.a, advance_scratch.b).gap);
      });
      if (gap > tolerance) return;
      touching = true;
      if (gap < 0) pressed.emplace_back(surface.normal[t], gap);
    });
  }
}

/// What counts as deeper than at the start: on ground of about the same slope the block is pressed in as deep
/// already.
Levels Passage::levels(int t) const {
  double start = 0;
  for (const auto& [n, gap] : advance_scratch.pressed)
    if (n.dot(surface.normal[t]) > 0.7) start = std::min(start, gap);
  return levels_for(start, touching, tolerance);
}

/// Most triangles are cleared at once: the whole block stays above their plane. Of the others those come
/// first whose plane it meets first: nothing is met before, and what is met bounds the search of the rest.
double Passage::first_impact(double s0, double s1, const Box3& box) const {
  find_triangles(box);
  advance_scratch.start.set(B, Vec3::Zero(), motion.at(s0).F);
  Bound above{&advance_scratch.start,
              Vec3::UnitZ(),
              Vec3::Zero(),
              Vec3::Zero(),
              motion.rotation,
              velocity(motion, s0),
              2 * motion.half_gravity_step,
              0,
              b.reach};
  const Vec3 centre = motion.at(s0).c;
  auto& planes = advance_scratch.planes;
  planes.clear();
  for (const int t : advance_scratch.triangles) {
    const Levels level = levels(t);
    above.look_along(surface.normal[t], surface.normal[t].dot(corner(t, 0) - centre));
    const double clear = above.clear_for(s1 - s0, level.aim, above.over(0));
    if (clear < s1 - s0) planes.push_back({s0 + clear, t, level});
  }
  std::stable_sort(planes.begin(), planes.end(),
                   [](const MetPlane& p, const MetPlane& q) { return p.s < q.s; });
  double first = never;
  for (const MetPlane& plane : planes) {
    if (plane.s >= first) break;
    with_triangle(plane.triangle, [&](const Mover& a) {
      pieces(b, flat_b, surface.triangle_box(plane.triangle), s0, s1, tolerance, [&](const Mover& piece) {
        first = std::min(first, advance(a, piece, plane.s, std::min(first, s1), plane.level));
      });
    });
  }
  return first;
}

}  // namespace

double time_of_impact(const SurfaceIndex& index, const Polyhedron& B, const Motion& motion_b,
                      double tolerance) {
  Passage passage{index.impl(), B, motion_b, mover(B, motion_b), tolerance};
  passage.find_pressed();
  // Halve the interval while its box is long against the block; the earlier half first.
  struct Span {
    double s0, s1;
  };
  const double size = bounds(B, motion_b.start).diagonal().norm();
  std::array<Span, 64> stack;
  int top = 0;
  stack[top++] = {0, 1};
  while (top > 0) {
    const Span span = stack[--top];
    const Box3 box = swept(passage.b, span.s0, span.s1, tolerance);
    if (!index.overlaps(box)) continue;
    if (box.diagonal().norm() > 3 * size + 8 * tolerance && top + 2 < 64) {
      const double middle = 0.5 * (span.s0 + span.s1);
      stack[top++] = {middle, span.s1};
      stack[top++] = {span.s0, middle};
      continue;
    }
    if (const double first = passage.first_impact(span.s0, span.s1, box); first <= 1) return first;
  }
  return never;
}

}  // namespace talus::contact

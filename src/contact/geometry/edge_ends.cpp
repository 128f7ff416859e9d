#include "contact/geometry/edge_ends.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"

namespace talus::contact {
namespace {

/// True if the ray x lies in the sector; `out[2]` are then the directions across x in which the sector
/// extends, `count` of them: two within it, one along a side.
struct Across {
  Vec3 into[2];
  int count = 0;

  Across(const Sector& s, const Vec3& x, double same) {
    if (std::abs(s.n.dot(x)) > same) return;
    const Vec3 from_p = s.n.cross(s.p), from_q = s.q.cross(s.n);  // into the sector from its sides
    const double hp = from_p.dot(x), hq = from_q.dot(x);
    if (hp < -same || hq < -same) return;
    const bool on_p = hp <= same && s.p.dot(x) > 0, on_q = hq <= same && s.q.dot(x) > 0;
    if (hp <= same && hq <= same && !on_p && !on_q) return;  // behind the vertex
    if (on_p)
      into[count++] = from_p;
    else if (on_q)
      into[count++] = from_q;
    else
      into[0] = s.n.cross(x), into[1] = -into[0], count = 2;
  }
};

/// True if x, on none of the sectors, lies inside: behind the nearest of them.
bool inside(std::span<const Sector> around, const Vec3& x, double same) {
  double nearest = std::numeric_limits<double>::infinity();
  Vec3 foot = Vec3::Zero(), pseudo = Vec3::Zero();
  for (const Sector& s : around) {
    Vec3 y = x - s.n.dot(x) * s.n;
    double weight = 1;
    if (s.n.cross(s.p).dot(y) < 0 || s.q.cross(s.n).dot(y) < 0) {
      const double p = std::max(0.0, s.p.dot(x)), q = std::max(0.0, s.q.dot(x));
      y = p >= q ? Vec3(p * s.p) : Vec3(q * s.q);
      if (y.isZero(0)) weight = std::atan2(s.p.cross(s.q).norm(), s.p.dot(s.q));
    }
    const double d = (x - y).norm();
    if (d < nearest - same)
      nearest = d, foot = y, pseudo = weight * s.n;
    else if (d < nearest + same)
      pseudo += weight * s.n;
  }
  return pseudo.dot(x - foot) < 0;
}

}  // namespace

bool goes_on(std::span<const Sector> around, const Vec3& d, const Vec3& left, const Vec3& right) {
  // In one plane to a part of the edge's own angle: of ground that is plane but for its digits each edge
  // turns by as little as its neighbours.
  const double same = std::max(tolerances().true_edge, tolerances().same_normal * left.cross(right).norm());
  const Vec3 x = -d, bisector = -(left + right);
  const bool rim = (left - right).norm() <= same;
  bool on_surface = false, some = false, all = true;  // of the planes at x: has the bisector behind it
  bool reentrant = false;
  for (const Sector& s : around) {
    const Across across(s, x, same);
    if (across.count == 0) continue;
    on_surface = true;
    if (rim) {
      if ((s.n - left).norm() > same) return false;
      continue;
    }
    for (int k = 0; k < across.count; ++k) {
      const Vec3& b = across.into[k];
      if (left.dot(b) < -same && right.dot(b) < -same) return false;  // a face of the body cuts the wedge
      for (const Sector& o : around)
        if (Across(o, x, same).count > 0) reentrant = reentrant || o.n.dot(b) > same;
    }
    (s.n.dot(bisector) < 0 ? some : all) = s.n.dot(bisector) < 0;
  }
  if (!on_surface) return !rim && inside(around, x, same);
  return rim || (reentrant ? some : all);
}

}  // namespace talus::contact

#include "contact/solver/solver_sweep.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace talus::contact::detail {

namespace {

/// Slip under exact Coulomb with u_n = 0: the direction d of p_t = g d by Newton's method on its angle, g the
/// bound that d leaves.
///
///   g (1 + mu c . d) = cohesion - mu k q_n,   (g S d + r) x d = 0,   (g S d + r) . d <= 0
///   r = q_t - c q_n
///
/// From the direction of `start`, else against r. False where it does not settle, or the contact would open.
bool slip_direction(const Touch& t, const Vec3& q, const Vec3& start, double change, Vec3& p) {
  const Eliminated& e = t.slip;
  const double mu = t.law.mu, most = t.law.cohesion - mu * e.k * q.x();
  const double r1 = q.y() - e.c1 * q.x(), r2 = q.z() - e.c2 * q.x();
  const double before = length(start.y(), start.z()), away = length(r1, r2);
  if (!(before > 0 || away > 0)) return false;
  double x = before > 0 ? start.y() / before : -r1 / away, y = before > 0 ? start.z() / before : -r2 / away;
  for (int k = 0; k < 10; ++k) {
    const double lever = 1 + mu * (e.c1 * x + e.c2 * y);
    if (!(lever > 0)) return false;
    const double g = most / lever, along_lever = mu * (e.c2 * x - e.c1 * y) / lever;
    const double S1 = e.s11 * x + e.s12 * y, S2 = e.s12 * x + e.s22 * y;  // S d
    const double across = S2 * x - S1 * y, along = S1 * x + S2 * y;       // its parts across d and along it
    const double turned =
        e.s11 * y * y - 2 * e.s12 * x * y + e.s22 * x * x;  // of S times the normal to d, across
    const double off = g * across + r2 * x - r1 * y, slides = g * along + r1 * x + r2 * y;
    const double slope = g * (turned - along_lever * across) - slides;
    if (!(slope > 0)) {
      if (k > 0 || !(away > 0)) return false;
      x = -r1 / away;
      y = -r2 / away;
      continue;
    }
    const double turn = std::clamp(-off / slope, -1.0, 1.0), shorter = 1 / std::sqrt(1 + turn * turn),
                 before_x = x;
    x = (x - turn * y) * shorter;
    y = (y + turn * before_x) * shorter;
    if (std::abs(turn) > change) continue;
    const double bound = most / (1 + mu * (e.c1 * x + e.c2 * y));
    p = Vec3(-e.k * q.x() - bound * (e.c1 * x + e.c2 * y), bound * x, bound * y);
    return slides <= 0 && bound >= 0 && p.x() > t.law.floor;
  }
  return false;
}

}  // namespace

Vec3 solve_one(const Touch& t, const Vec3& q, const Vec3& start, SlipAccuracy accuracy) {
  const Law& law = t.law;
  const Eliminated& e = t.slip;
  if (law.mu == 0 && law.cohesion == 0)
    return Vec3(e.k > 0 ? std::max(law.floor, -q.x() * e.k) : start.x(), 0, 0);
  const double r1 = q.y() - e.c1 * q.x(), r2 = q.z() - e.c2 * q.x();
  const double stick1 = -(e.i11 * r1 + e.i12 * r2), stick2 = -(e.i12 * r1 + e.i22 * r2);
  const Vec3 stick(-e.k * q.x() - e.c1 * stick1 - e.c2 * stick2, stick1, stick2);
  if (stick.x() >= law.floor && length(stick.y(), stick.z()) <= law.mu * stick.x() + law.cohesion)
    return stick;
  if (!(law.floor_bound > 0)) {
    const Vec3 none(law.floor, 0, 0);
    const Vec3 u = q + t.W.col(0) * law.floor;
    if (u.x() >= 0 && (law.exact || u.x() >= law.mu * length(u.y(), u.z()))) return none;
  }
  Vec3 p = start, next;
  if (law.exact) {
    if (accuracy.by_direction && slip_direction(t, q, start, accuracy.change, next)) return next;
    // Slip: normal and tangential in turn. The tangential step is a projected gradient step with the largest
    // eigenvalue.
    const double a = t.W(1, 1), b = t.W(2, 2), c = t.W(1, 2);
    const double wt = 0.5 * (a + b) + length(0.5 * (a - b), c);
    for (int k = 0; k < accuracy.iterations; ++k) {
      const Vec3 u = q + t.W * p;
      next.x() = std::max(law.floor, p.x() - u.x() * e.k);
      const double dn = next.x() - p.x();
      const double g = std::max(0.0, law.mu * next.x() + law.cohesion);
      double y = p.y() - (u.y() + t.W(1, 0) * dn) / wt, z = p.z() - (u.z() + t.W(2, 0) * dn) / wt;
      const double s = length(y, z);
      if (s > g) {
        y *= g / s;
        z *= g / s;
      }
      next.y() = y;
      next.z() = z;
      const double change = (next - p).cwiseAbs().maxCoeff();
      p = next;
      if (change <= accuracy.change * p.cwiseAbs().maxCoeff()) break;
    }
    return p;
  }
  for (int k = 0; k < 8; ++k) {
    const Vec3 u = q + t.W * p;
    const double r = t.W.trace();
    project(law, p - u / r, 1, 1, next, nullptr);
    const double change = (next - p).cwiseAbs().maxCoeff();
    p = next;
    if (change <= accuracy.change * p.cwiseAbs().maxCoeff()) break;
  }
  return p;
}

void sweep(const System& system, std::vector<Vec3>& p, std::vector<double>& v, int sweeps) {
  for (int s = 0; s < sweeps; ++s)
    system.order.each(s % 2 == 0, true, [&](int i) {
      const Touch& t = system.touch[i];
      if (!(t.w > 0) || system.open_still(t, p[i], v.data())) return false;
      const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      const Vec3 next = solve_one(t, u - t.W * p[i], p[i]);
      const Vec3 change = next - p[i];
      if (change == Vec3::Zero()) return false;
      p[i] = next;
      system.push(t, change, v.data());
      return true;
    });
}

/// Marks the contacts whose residual is above the limit; false if none is.
bool LocalSweeps::mark(const System& system, const std::vector<Vec3>& p, const std::vector<double>& v,
                       double limit) {
  std::atomic<bool> any = false;
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    bool some = false;
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      pending_[i] = 0;
      if (system.open_still(t, p[i], v.data())) continue;
      const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      pending_[i] = natural_residual(t.law, u, p[i], t.scale(), 0) > limit;
      some = some || pending_[i] != 0;
    }
    if (some) any.store(true, std::memory_order_relaxed);
  });
  return any;
}

/// Has the memory of contacts fetched that are visited soon, `way` (1 or -1) from this one on: what is left
/// to visit lies too far apart for the processor to foresee.
void LocalSweeps::fetch(const System& system, int i, int way) const {
  constexpr int line = 64, near = 4,
                far = 8;  // bytes; contacts from here, first their places, then their Jacobians
  const auto left = [&](int k) { return k >= 0 && k < system.contacts() && pending_[k] != 0; };
  if (const int k = i + way * far; left(k)) {
    const char* touch = reinterpret_cast<const char*>(&system.touch[k]);
    for (std::size_t at = 0; at < sizeof(Touch); at += line) __builtin_prefetch(touch + at);
  }
  if (const int k = i + way * near; left(k)) {
    const Touch& t = system.touch[k];
    if (t.count == 0) return;
    const char* J = reinterpret_cast<const char*>(system.J.data() + system.terms[t.first].at);
    for (std::size_t at = 0; at < 36 * sizeof(double); at += line) __builtin_prefetch(J + at);
  }
}

/// True if the contact's impulse changed by more than counts.
bool LocalSweeps::visit(const System& system, int i, std::vector<Vec3>& p, std::vector<double>& v,
                        double change_that_counts) {
  const Touch& t = system.touch[i];
  if (!(t.w > 0) || system.open_still(t, p[i], v.data())) return false;
  const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
  Vec3 change = solve_one(t, u - t.W * p[i], p[i], visited) - p[i];
  if (change == Vec3::Zero()) return false;
  const bool counts = (t.scale() * change).cwiseAbs().maxCoeff() > change_that_counts;
  if (t.law.mu > 0 && ++visits_[i] > undamped_visits) change *= 0.5;
  p[i] += change;
  system.push(t, change, v.data());
  return counts;
}

void LocalSweeps::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance,
                      int budget) {
  const int nc = system.contacts();
  pending_.assign(nc, 0);
  visits_.assign(nc, 0);
  const double change_that_counts = part_that_counts * tolerance;
  mark(system, p, v, change_that_counts);
  const long most = static_cast<long>(budget) * nc;
  long visits = 0, last = nc;  // in all, in the last round
  for (int round = 0; visits < most; ++round) {
    if (last == 0) {  // many changes too small to count may add up
      if (!mark(system, p, v, change_that_counts)) return;
      visits += nc / 4;
      last = nc;
    }
    const bool forward = round % 2 == 0;
    last = system.order.each(forward, last > few, [&](int i) {
      fetch(system, i, forward ? 1 : -1);
      if (pending_[i] == 0) return false;
      pending_[i] = 0;
      if (!visit(system, i, p, v, change_that_counts)) return true;
      const Touch& t = system.touch[i];
      for (int e = t.first; e < t.first + t.count; ++e) {
        const int b = system.terms[e].body;
        // A neighbour of two that are visited at once is marked by both.
        for (int o = system.first_of_body[b]; o < system.first_of_body[b + 1]; ++o)
          std::atomic_ref(pending_[system.of_body[o].contact]).store(1, std::memory_order_relaxed);
      }
      return true;
    });
    visits += last;
  }
}

}  // namespace talus::contact::detail

#include "contact/solver_sweep.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

Vec3 solve_one(const Touch& t, const Vec3& q, const Vec3& start) {
  const Law& law = t.law;
  if (law.mu == 0 && law.cohesion == 0) return Vec3(t.W(0, 0) > 0 ? std::max(law.floor, -q.x() / t.W(0, 0)) : start.x(), 0, 0);
  const Vec3 stick = -t.W_inverse * q;
  if (stick.x() >= law.floor && length(stick.y(), stick.z()) <= law.mu * stick.x() + law.cohesion) return stick;
  const double at_floor = std::max(0.0, law.mu * law.floor + law.cohesion);
  if (at_floor <= 1e-14 * law.cohesion) {
    const Vec3 none(law.floor, 0, 0);
    const Vec3 u = q + t.W.col(0) * law.floor;
    if (u.x() >= 0 && (law.exact || u.x() >= law.mu * length(u.y(), u.z()))) return none;
  }
  Vec3 p = start, next;
  if (law.exact) {
    // Slip: normal and tangential in turn. The tangential step is a projected gradient step with the largest eigenvalue.
    const double a = t.W(1, 1), b = t.W(2, 2), c = t.W(1, 2);
    const double wt = 0.5 * (a + b) + length(0.5 * (a - b), c);
    for (int k = 0; k < 4; ++k) {
      const Vec3 u = q + t.W * p;
      next.x() = std::max(law.floor, p.x() - u.x() / t.W(0, 0));
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
      if (change <= 1e-4 * p.cwiseAbs().maxCoeff()) break;
    }
    return p;
  }
  for (int k = 0; k < 8; ++k) {
    const Vec3 u = q + t.W * p;
    const double r = t.W.trace();
    project(law, p - u / r, 1, 1, next, nullptr);
    const double change = (next - p).cwiseAbs().maxCoeff();
    p = next;
    if (change <= 1e-12 * p.cwiseAbs().maxCoeff()) break;
  }
  return p;
}

double sweep(const System& system, std::vector<Vec3>& p, std::vector<double>& v, int sweeps) {
  const int nc = system.contacts();
  double largest = 0;
  for (int s = 0; s < sweeps; ++s) {
    largest = 0;
    for (int k = 0; k < nc; ++k) {
      const int i = s % 2 == 0 ? k : nc - 1 - k;
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      const Vec3 next = solve_one(t, u - t.W * p[i], p[i]);
      const Vec3 change = next - p[i];
      if (change == Vec3::Zero()) continue;
      p[i] = next;
      system.push(t, change, v.data());
      largest = std::max(largest, t.w * change.cwiseAbs().maxCoeff());
    }
  }
  return largest;
}

void LocalSweeps::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance, int budget) {
  const int nc = system.contacts();
  first_.assign(system.body.size() + 1, 0);
  for (const Touch& t : system.touch)
    for (int k = t.first; k < t.first + t.count; ++k) ++first_[system.terms[k].body + 1];
  for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  touching_.resize(first_.back());
  for (int i = nc - 1; i >= 0; --i)   // first_[b + 1] runs down to the start of body b's list
    for (int k = system.touch[i].first; k < system.touch[i].first + system.touch[i].count; ++k) touching_[--first_[system.terms[k].body + 1]] = i;
  first_.push_back(static_cast<int>(touching_.size()));
  pending_.assign(nc, 0);
  const double change_that_counts = 0.05 * tolerance;
  for (int i = 0; i < nc; ++i) {
    const Touch& t = system.touch[i];
    const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
    pending_[i] = natural_residual(t.law, u, p[i], t.w, 0) > change_that_counts;
  }
  const long most = static_cast<long>(budget) * nc;
  long visits = 0, before = -1;
  for (int round = 0; visits < most && visits != before; ++round) {
    before = visits;
    for (int k = 0; k < nc; ++k) {
      const int i = round % 2 == 0 ? k : nc - 1 - k;
      if (pending_[i] == 0) continue;
      pending_[i] = 0;
      ++visits;
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      const Vec3 u = system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      const Vec3 change = solve_one(t, u - t.W * p[i], p[i]) - p[i];
      if (change == Vec3::Zero()) continue;
      p[i] += change;
      system.push(t, change, v.data());
      if (!(t.w * change.cwiseAbs().maxCoeff() > change_that_counts)) continue;
      for (int e = t.first; e < t.first + t.count; ++e) {
        const int b = system.terms[e].body;
        for (int o = first_[b + 1]; o < first_[b + 2]; ++o) pending_[touching_[o]] = 1;
      }
    }
  }
}

}  // namespace talus::contact::detail

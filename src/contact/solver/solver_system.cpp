#include "contact/solver/solver_system.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

namespace talus::contact::detail {

void System::velocities(const std::vector<Vec3>& p, std::vector<double>& v) const {
  v.resize(v_hat.size());
  in_ranges(static_cast<int>(body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) {
      double* x = v.data() + offset[b];
      std::copy_n(v_hat.data() + offset[b], ndof[b], x);
      for (int e = first_of_body[b]; e < first_of_body[b + 1]; ++e)
        if (const Vec3& q = p[of_body[e].contact]; q != Vec3::Zero())
          add_transposed(J.data() + of_body[e].at, ndof[b], q, x);
    }
  });
}

void System::write(const std::vector<double>& v, ContactProblem& problem) const {
  for (std::size_t b = 0; b < body.size(); ++b) {
    const int m = ndof[b];
    const double *M = root.data() + matrix[b], *x = v.data() + offset[b], *free = v_hat.data() + offset[b];
    double* to = problem.v.data() + problem.bodies[body[b]].offset;
    std::copy_n(problem.v_hat.data() + problem.bodies[body[b]].offset, m, to);
    for (int c = 0; c < m; ++c)
      if (const double change = x[c] - free[c]; change != 0)
        for (int r = c; r < m; ++r) to[r] += M[c * m + r] * change;
  }
}

void System::impulse_reach(const std::vector<Vec3>& p, std::vector<double>& reach) const {
  reach.resize(body.size());
  in_ranges(static_cast<int>(body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) {
      reach[b] = 0;
      for (int e = first_of_body[b]; e < first_of_body[b + 1]; ++e) {
        const Touch& t = touch[of_body[e].contact];
        const Vec3 pressed = p[of_body[e].contact].cwiseAbs().cwiseMin(most_pressed);
        reach[b] = std::max(reach[b], (t.scale() * pressed).maxCoeff());
      }
    }
  });
}

double System::residual(const std::vector<double>& v, const std::vector<Vec3>& p) const {
  impulse_reach(p, reach_);
  of_contact_.resize(touch.size());
  in_ranges(contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = touch[i];
      if (open_still(t, p[i], v.data())) {
        of_contact_[i] = 0;
        continue;
      }
      const Vec3 u = relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      of_contact_[i] = natural_residual(t.law, u, p[i], t.scale(), excuse(t, reach_));
    }
  });
  double worst = 0;
  for (const double r : of_contact_) worst = larger(worst, r);
  return worst;
}

double System::residual_by_mass(const std::vector<double>& v, const std::vector<Vec3>& p,
                                double least) const {
  if (!std::isfinite(residual(v, p))) return INFINITY;
  const auto mass = [&](int b) { return 1 / square(root[matrix[b]]); };  // infinite of what is held
  double sum = 0, worst = 0;
  int free = 0;
  for (int b = 0; b < static_cast<int>(body.size()); ++b)
    if (const double m = mass(b); std::isfinite(m)) sum += m, ++free;
  for (int i = 0; i < contacts(); ++i) {
    const Touch& t = touch[i];
    double lightest = INFINITY;
    for (int k = t.first; k < t.first + t.count; ++k) lightest = std::min(lightest, mass(terms[k].body));
    const double share =
        std::isfinite(lightest) ? std::clamp(std::sqrt(free * lightest / sum), least, 1.0) : 1;
    worst = std::max(worst, share * of_contact_[i]);
  }
  return worst;
}

double System::speed(const std::vector<double>& v) const {
  double sum = 0, masses = 0;
  for (const Touch& t : touch) {
    if (!(t.w > 0) || t.count < 2) continue;
    sum += relative(t, v.data()).squaredNorm() / t.w;
    masses += 1 / t.w;
  }
  return masses > 0 ? std::sqrt(sum / masses) : 0;
}

double System::residual_apart(const std::vector<double>& v, const std::vector<double>& off,
                              const std::vector<Vec3>& p) const {
  impulse_reach(p, reach_);
  std::atomic<bool> beyond = false;
  in_ranges(contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to && !beyond.load(std::memory_order_relaxed); ++i)
      if (!(relative(touch[i], off.data()).norm() <= round_off(touch[i], reach_))) beyond = true;
  });
  return beyond ? INFINITY : residual(v, p);
}

void System::list() {
  first_of_body.assign(body.size() + 2, 0);
  for (const Touch& t : touch)
    for (int k = t.first; k < t.first + t.count; ++k) ++first_of_body[terms[k].body + 2];
  for (std::size_t b = 2; b < first_of_body.size(); ++b) first_of_body[b] += first_of_body[b - 1];
  of_body.resize(first_of_body.back());
  for (int i = 0; i < contacts(); ++i)  // first_of_body[b + 1] runs up to the end of body b's list
    for (int k = touch[i].first; k < touch[i].first + touch[i].count; ++k)
      of_body[first_of_body[terms[k].body + 1]++] = {i, static_cast<std::uint32_t>(terms[k].at)};
  first_of_body.pop_back();
  order.find(*this);
  double least = INFINITY;
  for (const Touch& t : touch)
    if (t.w > 0) least = std::min(least, t.w);
  for (Touch& t : touch) t.load = t.w > 0 ? std::sqrt(least / t.w) : 1;
}

Eliminated eliminate_normal(const Mat3& W) {
  Eliminated e;
  if (!(W(0, 0) > 0)) return e;
  e.k = 1 / W(0, 0);
  e.c1 = W(0, 1) * e.k;
  e.c2 = W(0, 2) * e.k;
  e.s11 = W(1, 1) - W(0, 1) * e.c1;
  e.s12 = W(1, 2) - W(0, 1) * e.c2;
  e.s22 = W(2, 2) - W(0, 2) * e.c2;
  const double little = 1e-12 * W.trace() / 3, a = e.s11 + little, b = e.s22 + little,
               det = a * b - e.s12 * e.s12;
  e.i11 = b / det;
  e.i12 = -e.s12 / det;
  e.i22 = a / det;
  return e;
}

namespace {

/// Three rows of J become those of J M. A contact names a few of a skin's nodes: most columns of J are zero.
void multiply_few(double* row, const double* M, int m) {
  thread_local std::vector<int> named;
  thread_local std::vector<double> entries;
  named.clear(), entries.clear();
  for (int q = 0; q < m; ++q) {
    if (row[q] == 0 && row[m + q] == 0 && row[2 * m + q] == 0) continue;
    named.push_back(q);
    for (int i = 0; i < 3; ++i) entries.push_back(std::exchange(row[i * m + q], 0.0));
  }
  std::size_t first = 0;  // of the named columns that column c needs
  for (int c = 0; c < m; ++c) {
    while (first < named.size() && named[first] < c) ++first;
    for (std::size_t k = first; k < named.size(); ++k)
      for (int i = 0; i < 3; ++i)
        row[i * m + c] += entries[3 * k + static_cast<std::size_t>(i)] * M[c * m + named[k]];
  }
}

constexpr int large_skin = 96;  // degrees of freedom from which on the root is found by blocks

/// Root of a skin's inverse mass, M = L of L L^T, and L^-1 v; false if it is not safely positive definite.
bool take_skin(int m, const double* B, const double* v, double* M, double* free) {
  Eigen::Map<MatX> L(M, m, m);
  const Eigen::Map<const MatX> W(B, m, m);
  L.triangularView<Eigen::Lower>() = W.triangularView<Eigen::Lower>();
  Eigen::Ref<MatX> in_place(L);
  const Eigen::LLT<Eigen::Ref<MatX>> root(in_place);
  if (root.info() != Eigen::Success || (L.diagonal().array().square() <= 1e-15 * W.diagonal().array()).any())
    return false;
  L.triangularView<Eigen::StrictlyUpper>().setZero();
  Eigen::Map<VecX>(free, m) = L.triangularView<Eigen::Lower>().solve(Eigen::Map<const VecX>(v, m));
  return true;
}

}  // namespace

/// M of A^-1 = M M^T by Cholesky's method, and v_hat; columns of what is held, or cannot move on its own, are
/// zero.
void System::take_body(const ContactProblem& problem, int active) {
  const ProblemBody& source = problem.bodies[body[active]];
  const int m = source.ndof;
  const double *A = source.mass, *B = source.mass_inverse, *v = problem.v_hat.data() + source.offset;
  double *M = root.data() + matrix[active], *free = v_hat.data() + offset[active],
         *rest = held.data() + offset[active];
  const auto fast = [&](int i) {
    return !(B[i * m + i] > 0 && (A == nullptr || std::isfinite(A[i * m + i])));
  };
  std::fill_n(rest, m, 0.0);
  const auto any_fast = [&] {
    for (int i = 0; i < m; ++i)
      if (fast(i)) return true;
    return false;
  };
  if (m > large_skin && !any_fast() && take_skin(m, B, v, M, free)) return;
  std::fill_n(M, static_cast<std::size_t>(m) * m, 0.0);
  std::fill_n(free, m, 0.0);
  for (int c = 0; c < m; ++c) {
    double pivot = B[c * m + c], left = v[c];
    for (int k = 0; k < c; ++k) {
      pivot -= M[k * m + c] * M[k * m + c];
      left -= M[k * m + c] * free[k];
    }
    if (fast(c) || !(pivot > 1e-15 * B[c * m + c])) {
      rest[c] = left;
      continue;
    }
    const double root_of_pivot = std::sqrt(pivot);
    M[c * m + c] = root_of_pivot;
    free[c] = left / root_of_pivot;
    if (m > 12) {  // a small skin, or one with nodes that are held: by whole columns
      const int below = m - c - 1;
      Eigen::Map<VecX> column(M + c * m + c + 1, below);
      column = Eigen::Map<const VecX>(B + c * m + c + 1, below);
      for (int k = 0; k < c; ++k)
        if (const double factor = M[k * m + c]; factor != 0)
          column.noalias() -= factor * Eigen::Map<const VecX>(M + k * m + c + 1, below);
      column /= root_of_pivot;
      for (int r = c + 1; r < m; ++r)
        if (fast(r)) M[c * m + r] = 0;
      continue;
    }
    for (int r = c + 1; r < m; ++r) {
      if (fast(r)) continue;
      double sum = B[c * m + r];
      for (int k = 0; k < c; ++k) sum -= M[k * m + r] * M[k * m + c];
      M[c * m + r] = sum / root_of_pivot;
    }
  }
}

/// Active bodies, contacts and their terms, without the figures of the latter.
void System::number(const ContactProblem& problem, bool exact_coulomb) {
  const int bodies = static_cast<int>(problem.bodies.size());
  active_.assign(bodies, -1);
  for (const ContactTerm& term : problem.terms) active_[term.body] = 0;
  body.clear();
  ndof.clear();
  offset.clear();
  matrix.clear();
  n = 0;
  std::size_t entries = 0;
  for (int b = 0; b < bodies; ++b) {
    if (active_[b] < 0) continue;
    const int m = problem.bodies[b].ndof;
    active_[b] = static_cast<int>(body.size());
    body.push_back(b);
    ndof.push_back(m);
    offset.push_back(n);
    matrix.push_back(entries);
    entries += static_cast<std::size_t>(m) * m;
    n += m;
  }
  if (root.size() < entries) root.resize(entries);
  v_hat.resize(static_cast<std::size_t>(n));
  held.resize(static_cast<std::size_t>(n));
  touch.resize(problem.contacts.size());
  terms.clear();
  std::size_t at = 0;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const ProblemContact& contact = problem.contacts[c];
    Touch& t = touch[c];
    t.id = static_cast<int>(c);
    t.first = static_cast<int>(terms.size());
    t.shift = 0;
    t.law = law_of(contact.friction, contact.cohesion, contact.tension, exact_coulomb && !contact.associated);
    for (int k = contact.first_term; k < contact.first_term + contact.terms; ++k) {
      const int b = active_[problem.terms[k].body];
      if (std::any_of(terms.begin() + t.first, terms.end(),
                      [&](const TouchTerm& known) { return known.body == b; }))
        continue;
      terms.push_back({b, ndof[b], offset[b], at});
      at += 3 * static_cast<std::size_t>(ndof[b]);
    }
    t.count = static_cast<int>(terms.size()) - t.first;
  }
  if (J.size() < at)
    J.resize(at);  // what is beyond is not looked at: shrunk and grown again it would be cleared each time
}

/// Jacobians, bias and Delassus block of one contact.
void System::fill(const ContactProblem& problem, int contact) {
  Touch& t = touch[contact];
  const ProblemContact& source = problem.contacts[contact];
  t.bias = source.bias;
  t.compliance = source.compliance;
  t.W = t.compliance.asDiagonal();
  for (int e = t.first; e < t.first + t.count; ++e)
    std::fill_n(J.data() + terms[e].at, 3 * static_cast<std::size_t>(terms[e].n), 0.0);
  for (int k = source.first_term; k < source.first_term + source.terms; ++k) {
    const ContactTerm& from = problem.terms[k];
    int e = t.first;
    while (body[terms[e].body] != from.body) ++e;
    const int m = terms[e].n;
    const double *j = problem.jacobians.data() + from.jacobian, *rest = held.data() + terms[e].v;
    double* to = J.data() + terms[e].at;
    for (int q = 0; q < m; ++q)
      for (int i = 0; i < 3; ++i) {
        to[i * m + q] += j[3 * q + i];
        t.bias[i] += j[3 * q + i] * rest[q];
      }
  }
  for (int e = t.first; e < t.first + t.count; ++e) {
    const int m = terms[e].n;
    const double* M = root.data() + matrix[terms[e].body];
    double* row = J.data() + terms[e].at;
    if (m > 12) {
      multiply_few(row, M, m);
    } else {
      for (int c = 0; c < m; ++c) {  // column c of J M needs columns c and beyond of J
        Vec3 sum = Vec3::Zero();
        for (int q = c; q < m; ++q)
          for (int i = 0; i < 3; ++i) sum[i] += row[i * m + q] * M[c * m + q];
        for (int i = 0; i < 3; ++i) row[i * m + c] = sum[i];
      }
    }
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k <= i; ++k) {
        double sum = 0;
        for (int q = 0; q < m; ++q) sum += row[i * m + q] * row[k * m + q];
        t.W(i, k) += sum;
        if (k < i) t.W(k, i) += sum;
      }
  }
  t.w = t.wt = t.W.trace() / 3;
  // A spring along the face that gives by far more than the normal: of one mean of the two, round-off would
  // be more than what is asked.
  constexpr double apart = 1e4;
  if (const double along = std::max(t.W(1, 1), t.W(2, 2)); along > apart * t.W(0, 0) && t.W(0, 0) > 0)
    t.w = t.W(0, 0), t.wt = along;
  t.slip = t.w > 0 ? eliminate_normal(t.W) : Eliminated{};
  // Sliding presses it by no more than mu |c| of what friction takes.
  t.opens = t.w > 0 && t.law.exact && t.law.floor == 0 && t.law.cohesion == 0 &&
            t.law.mu * length(t.slip.c1, t.slip.c2) < 1;
}

void System::find_bounds() {
  double fastest = 0;
  for (const Touch& t : touch)
    fastest = std::max({fastest, -t.bias.x(), std::abs(t.bias.y()), std::abs(t.bias.z())});
  thread_local std::vector<double> least;  // of |J|^2 / 3 over a body's terms: the inverse of its mass
  least.assign(body.size(), INFINITY);
  for (const TouchTerm& term : terms) {
    const double* row = J.data() + term.at;
    double square = 0;
    for (int k = 0; k < 3 * term.n; ++k) square += row[k] * row[k];
    if (square > 0) least[term.body] = std::min(least[term.body], square / 3);
  }
  most_pressed = 0;
  double square = 0, mass = 0;
  for (std::size_t b = 0; b < body.size(); ++b) {
    const Eigen::Map<const VecX> free(v_hat.data() + offset[b], ndof[b]);
    most_pressed += free.norm() / std::sqrt(least[b]) + fastest / least[b];
    square += free.squaredNorm();
    mass += 1 / least[b];
  }
  most_moving = std::sqrt(square) + fastest * std::sqrt(mass);
}

void System::assemble(const ContactProblem& problem, bool exact_coulomb) {
  number(problem, exact_coulomb);
  in_ranges(static_cast<int>(body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) take_body(problem, b);
  });
  in_ranges(contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) fill(problem, i);
  });
  find_bounds();
  list();
}

}  // namespace talus::contact::detail

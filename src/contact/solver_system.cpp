#include "contact/solver_system.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

namespace {

template <int N>
inline void multiply(const double* J, int n, const double* x, Vec3& u) {
  const int m = N > 0 ? N : n;
  double a = 0, b = 0, c = 0;
  for (int k = 0; k < m; ++k) {
    a += J[k] * x[k];
    b += J[m + k] * x[k];
    c += J[2 * m + k] * x[k];
  }
  u.x() += a;
  u.y() += b;
  u.z() += c;
}

template <int N>
inline void multiply_transposed(const double* J, int n, const Vec3& p, double* x) {
  const int m = N > 0 ? N : n;
  for (int k = 0; k < m; ++k) x[k] += J[k] * p.x() + J[m + k] * p.y() + J[2 * m + k] * p.z();
}

}  // namespace

void add_transposed(const double* rows, int n, const Vec3& p, double* x) {
  switch (n) {
    case 3: return multiply_transposed<3>(rows, 3, p, x);
    case 6: return multiply_transposed<6>(rows, 6, p, x);
    case 12: return multiply_transposed<12>(rows, 12, p, x);
    default: return multiply_transposed<0>(rows, n, p, x);
  }
}

Vec3 System::relative(const Touch& t, const double* x) const {
  Vec3 u = Vec3::Zero();
  for (int k = t.first; k < t.first + t.count; ++k) {
    const TouchTerm& term = terms[k];
    const double* j = J.data() + term.at;
    switch (term.n) {
      case 3: multiply<3>(j, 3, x + term.v, u); break;
      case 6: multiply<6>(j, 6, x + term.v, u); break;
      case 12: multiply<12>(j, 12, x + term.v, u); break;
      default: multiply<0>(j, term.n, x + term.v, u);
    }
  }
  return u;
}

void System::push(const Touch& t, const Vec3& p, double* x) const {
  for (int k = t.first; k < t.first + t.count; ++k) {
    const TouchTerm& term = terms[k];
    add_transposed(Y.data() + term.at, term.n, p, x + term.v);
  }
}

void System::velocities(const std::vector<Vec3>& p, std::vector<double>& v) const {
  v.resize(v_hat.size());
  in_ranges(static_cast<int>(body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) {
      double* x = v.data() + offset[b];
      std::copy_n(v_hat.data() + offset[b], ndof[b], x);
      for (int e = first_of_body[b]; e < first_of_body[b + 1]; ++e)
        if (const Vec3& q = p[of_body[e].contact]; q != Vec3::Zero()) add_transposed(Y.data() + of_body[e].at, ndof[b], q, x);
    }
  });
}

double System::apply_mass(const double* x, double* y) const {
  double energy = 0;
  for (std::size_t b = 0; b < body.size(); ++b) {
    const int m = ndof[b];
    const double* A = mass.data() + matrix[b];
    const double* xb = x + offset[b];
    double* yb = y + offset[b];
    for (int i = 0; i < m; ++i) yb[i] = 0;
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i) yb[i] += A[j * m + i] * xb[j];
    for (int i = 0; i < m; ++i) energy += yb[i] * xb[i];
  }
  return energy;
}

void System::impulse_reach(const std::vector<Vec3>& p, std::vector<double>& reach) const {
  reach.resize(body.size());
  in_ranges(static_cast<int>(body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) {
      reach[b] = 0;
      for (int e = first_of_body[b]; e < first_of_body[b + 1]; ++e) reach[b] = std::max(reach[b], touch[of_body[e].contact].w * p[of_body[e].contact].cwiseAbs().maxCoeff());
    }
  });
}

double System::residual(const std::vector<double>& v, const std::vector<Vec3>& p) const {
  impulse_reach(p, reach_);
  of_contact_.resize(touch.size());
  in_ranges(contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = touch[i];
      const Vec3 u = relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(p[i]);
      of_contact_[i] = natural_residual(t.law, u, p[i], t.w, round_off(t, reach_));
    }
  });
  double worst = 0;
  for (const double r : of_contact_)
    if (!(r <= worst)) worst = r;  // keeps a NaN
  return worst;
}

void System::list() {
  first_of_body.assign(body.size() + 2, 0);
  for (const Touch& t : touch)
    for (int k = t.first; k < t.first + t.count; ++k) ++first_of_body[terms[k].body + 2];
  for (std::size_t b = 2; b < first_of_body.size(); ++b) first_of_body[b] += first_of_body[b - 1];
  of_body.resize(first_of_body.back());
  for (int i = 0; i < contacts(); ++i)   // first_of_body[b + 1] runs up to the end of body b's list
    for (int k = touch[i].first; k < touch[i].first + touch[i].count; ++k) of_body[first_of_body[terms[k].body + 1]++] = {i, terms[k].at};
  first_of_body.pop_back();
  order.find(*this);
}

void System::assemble(const ContactProblem& problem, bool exact_coulomb) {
  const int bodies = static_cast<int>(problem.bodies.size());
  active_.assign(bodies, -1);
  for (const ContactTerm& term : problem.terms) active_[term.body] = 0;
  body.clear();
  ndof.clear();
  offset.clear();
  matrix.clear();
  mass.clear();
  mass_inverse.clear();
  v_hat.clear();
  n = 0;
  for (int b = 0; b < bodies; ++b) {
    if (active_[b] < 0) continue;
    const ProblemBody& source = problem.bodies[b];
    const int m = source.ndof;
    active_[b] = static_cast<int>(body.size());
    body.push_back(b);
    ndof.push_back(m);
    offset.push_back(n);
    matrix.push_back(mass.size());
    mass.insert(mass.end(), source.mass, source.mass + m * m);
    mass_inverse.insert(mass_inverse.end(), source.mass_inverse, source.mass_inverse + m * m);
    double* A = mass.data() + matrix.back();
    double* B = mass_inverse.data() + matrix.back();
    for (int i = 0; i < m; ++i) {
      if (B[i * m + i] > 0 && std::isfinite(A[i * m + i])) continue;
      for (int j = 0; j < m; ++j) A[i * m + j] = A[j * m + i] = B[i * m + j] = B[j * m + i] = 0;
      A[i * m + i] = 1;  // held: B stays zero, and assemble() drops its Jacobian
    }
    v_hat.insert(v_hat.end(), problem.v_hat.begin() + source.offset, problem.v_hat.begin() + source.offset + m);
    n += m;
  }
  touch.clear();
  terms.clear();
  J.clear();
  Y.clear();
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const ProblemContact& contact = problem.contacts[c];
    touch.emplace_back();
    Touch& t = touch.back();
    t.id = static_cast<int>(c);
    t.first = static_cast<int>(terms.size());
    t.bias = contact.bias;
    t.compliance = contact.compliance;
    t.law.mu = contact.friction;
    t.law.cohesion = contact.cohesion;
    t.law.floor = law_floor(contact.friction, contact.cohesion, contact.tension);
    t.law.exact = exact_coulomb && !contact.associated;
    for (int k = contact.first_term; k < contact.first_term + contact.terms; ++k) {
      const ContactTerm& source = problem.terms[k];
      const int b = active_[source.body], m = ndof[b];
      const double* from = problem.jacobians.data() + source.jacobian;
      const double* B = mass_inverse.data() + matrix[b];
      std::size_t at = 0;
      bool found = false;
      for (int e = t.first; e < static_cast<int>(terms.size()); ++e)
        if (terms[e].body == b) {
          found = true;
          at = terms[e].at;
        }
      if (!found) {
        at = J.size();
        J.resize(at + 3 * m, 0.0);
        Y.resize(at + 3 * m, 0.0);
        terms.push_back({b, m, offset[b], at});
      }
      for (int j = 0; j < m; ++j) {
        // A held degree of freedom moves with v_hat whatever the impulses: its share belongs to the bias.
        const bool held = !(B[j * m + j] > 0);
        for (int i = 0; i < 3; ++i) {
          if (held)
            t.bias[i] += from[3 * j + i] * v_hat[offset[b] + j];
          else
            J[at + i * m + j] += from[3 * j + i];
        }
      }
    }
    t.count = static_cast<int>(terms.size()) - t.first;
    t.W = t.compliance.asDiagonal();
    for (int k = t.first; k < t.first + t.count; ++k) {
      const TouchTerm& term = terms[k];
      const int m = term.n;
      const double* B = mass_inverse.data() + matrix[term.body];
      for (int i = 0; i < 3; ++i) {
        const double* j = J.data() + term.at + i * m;
        double* y = Y.data() + term.at + i * m;
        for (int q = 0; q < m; ++q) y[q] = 0;
        for (int q = 0; q < m; ++q)
          for (int r = 0; r < m; ++r) y[r] += B[q * m + r] * j[q];
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          double sum = 0;
          for (int q = 0; q < m; ++q) sum += J[term.at + i * m + q] * Y[term.at + j * m + q];
          t.W(i, j) += sum;
        }
    }
    t.w = t.W.trace() / 3;
    if (t.w > 0) {
      Mat3 safe = t.W;
      safe.diagonal().array() += 1e-12 * t.w;
      t.W_inverse = safe.inverse();
    } else {
      t.W_inverse.setZero();
    }
  }
  list();
}

}  // namespace talus::contact::detail

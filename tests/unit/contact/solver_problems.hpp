/// Contact problems built by hand for tests and benchmarks: boxes with known masses, patches of contact
/// points.
#pragma once
#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include <Eigen/LU>

#include "contact/solver/problem.hpp"

namespace talus::contact::testing {

struct Builder {
  ContactProblem problem;
  std::deque<std::vector<double>> store;
  std::vector<Vec3> centre;

  int body(const MatX& A, const VecX& v_hat, const Vec3& at = Vec3::Zero()) {
    ProblemBody b;
    b.ndof = static_cast<int>(A.rows());
    b.offset = static_cast<int>(problem.v_hat.size());
    const MatX inverse = A.inverse();
    store.emplace_back(A.data(), A.data() + A.size());
    b.mass = store.back().data();
    store.emplace_back(inverse.data(), inverse.data() + inverse.size());
    b.mass_inverse = store.back().data();
    problem.bodies.push_back(b);
    problem.v_hat.insert(problem.v_hat.end(), v_hat.data(), v_hat.data() + v_hat.size());
    centre.push_back(at);
    return static_cast<int>(problem.bodies.size()) - 1;
  }
  /// Rigid box with full sides `side`, axis-aligned.
  int box(const Vec3& at, const Vec3& side, double density, const Vec3& v, const Vec3& w = Vec3::Zero()) {
    const double m = density * side.prod();
    Vec6 diagonal;
    diagonal << m, m, m, m / 12 * (side.y() * side.y() + side.z() * side.z()),
        m / 12 * (side.x() * side.x() + side.z() * side.z()),
        m / 12 * (side.x() * side.x() + side.y() * side.y());
    Vec6 v_hat;
    v_hat << v, w;
    return body(diagonal.asDiagonal().toDenseMatrix(), v_hat, at);
  }
  void term(int b, const MatX& J) {
    problem.terms.push_back({b, static_cast<int>(problem.jacobians.size())});
    problem.jacobians.insert(problem.jacobians.end(), J.data(), J.data() + J.size());
    ++problem.contacts.back().terms;
  }
  ProblemContact& contact(double mu) {
    problem.contacts.emplace_back();
    problem.contacts.back().first_term = static_cast<int>(problem.terms.size());
    problem.contacts.back().friction = mu;
    return problem.contacts.back();
  }
  static Mat3 frame(const Vec3& n) {
    const Vec3 t = n.unitOrthogonal();
    Mat3 f;
    f.row(0) = n;
    f.row(1) = t;
    f.row(2) = n.cross(t);
    return f;
  }
  /// Contact of rigid bodies a (-1: fixed) and b at a point, normal out of a.
  ProblemContact& touch(int a, int b, const Vec3& point, const Vec3& n, double mu) {
    contact(mu);
    const Mat3 f = frame(n);
    for (const auto& [body, sign] : {std::pair{a, -1.0}, std::pair{b, 1.0}}) {
      if (body < 0) continue;
      MatX J(3, 6);
      J.leftCols<3>() = sign * f;
      J.rightCols<3>() = -sign * f * skew(point - centre[body]);
      term(body, J);
    }
    return problem.contacts.back();
  }
  /// Four points of a horizontal or vertical face: centre, two half extents.
  void patch(int a, int b, const Vec3& c, const Vec3& e1, const Vec3& e2, const Vec3& n, double mu) {
    for (double s : {-1.0, 1.0})
      for (double t : {-1.0, 1.0}) touch(a, b, c + s * e1 + t * e2, n, mu);
  }
  Vec3 velocity(int b) const {
    const double* v = problem.v.data() + problem.bodies[b].offset;
    return Vec3(v[0], v[1], v[2]);
  }
  double* v_hat(int b) { return problem.v_hat.data() + problem.bodies[b].offset; }
};

/// Coefficients of friction that the random problems take in turn.
inline constexpr double frictions[] = {0, 0.1, 0.3, 0.53, 1, 2, 10};

inline const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();

/// Wall or stack: nx by ny columns of nz unit cubes, resting; bricks shifted by half in odd layers if `bond`.
inline Builder cubes(int nx, int ny, int nz, double mu, double h, bool bond = false,
                     const Vec3& g = Vec3(0, 0, -9.81)) {
  Builder b;
  auto id = [&](int i, int j, int k) { return (k * ny + j) * nx + i; };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        b.box(Vec3(i + (bond && k % 2 ? 0.5 : 0.0), j, k + 0.5), Vec3::Ones(), 2500, h * g);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const int me = id(i, j, k);
        const Vec3 base = b.centre[me] - 0.5 * Z;
        if (k == 0) {
          b.patch(-1, me, base, 0.5 * X, 0.5 * Y, Z, mu);
        } else if (!bond) {
          b.patch(id(i, j, k - 1), me, base, 0.5 * X, 0.5 * Y, Z, mu);
        } else {
          const int left = k % 2 ? i : i - 1;
          for (int q : {left, left + 1}) {
            if (q < 0 || q >= nx) continue;
            const double middle = 0.5 * (b.centre[id(q, j, k - 1)].x() + base.x());
            b.patch(id(q, j, k - 1), me, Vec3(middle, base.y(), base.z()), 0.25 * X, 0.5 * Y, Z, mu);
          }
        }
        if (i > 0) b.patch(id(i - 1, j, k), me, b.centre[me] - 0.5 * X, 0.5 * Y, 0.5 * Z, X, mu);
        if (j > 0 && !bond) b.patch(id(i, j - 1, k), me, b.centre[me] - 0.5 * Y, 0.5 * X, 0.5 * Z, Y, mu);
      }
  return b;
}

/// A pile in motion: cubes on a lattice with disturbed positions; every neighbour touches with 1 to 4 points
/// whose normal is disturbed; random velocities of `speed` besides gravity. Never infeasible (v = 0 is
/// admissible).
inline Builder pile(int nx, int ny, int nz, double mu, double h, double speed, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  auto vec = [&](double s) { return Vec3(s * unit(random), s * unit(random), s * unit(random)); };
  Builder b;
  auto id = [&](int i, int j, int k) { return (k * ny + j) * nx + i; };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const Vec3 v = Vec3(0, 0, -9.81 * h) + vec(speed), w = vec(speed);
        b.box(Vec3(i, j, k + 0.5) + vec(0.1), Vec3(1, 1, 1), 2500, v, w);
      }
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const int me = id(i, j, k);
        auto meet = [&](int other, const Vec3& axis) {
          const Vec3 n = (axis + vec(0.3)).normalized();
          const Vec3 t = n.unitOrthogonal(), s = n.cross(t);
          const Vec3 c =
              other < 0 ? Vec3(b.centre[me] - 0.5 * Z) : Vec3(0.5 * (b.centre[me] + b.centre[other]));
          const int points = 1 + static_cast<int>(random() % 4);
          const Vec3 q[4] = {0.35 * t + 0.35 * s, -0.35 * t - 0.35 * s, 0.35 * t - 0.35 * s,
                             -0.35 * t + 0.35 * s};
          for (int m = 0; m < points; ++m) b.touch(other, me, points == 1 ? c : Vec3(c + q[m]), n, mu);
        };
        if (k == 0) meet(-1, Z);
        if (k > 0) meet(id(i, j, k - 1), Z);
        if (i > 0 && random() % 3 != 0) meet(id(i - 1, j, k), X);
        if (j > 0 && random() % 3 != 0) meet(id(i, j - 1, k), Y);
      }
  return b;
}

}  // namespace talus::contact::testing

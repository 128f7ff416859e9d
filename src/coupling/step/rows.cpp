#include "coupling/step/rows.hpp"

#include <cmath>

namespace talus::coupling::step {

Mass mass_of(const Body& body, const Mat3& rotation) {
  Mass m{Mat6::Zero(), Mat6::Zero()};
  m.mass.diagonal().head<3>().setConstant(body.mass);
  m.inverse.diagonal().head<3>().setConstant(1 / body.mass);
  const Mat3 inertia = rotation * body.inertia * rotation.transpose();
  m.mass.block<3, 3>(3, 3) = inertia;
  m.inverse.block<3, 3>(3, 3) = inertia.inverse();
  return m;
}

At place_row(const Row& row, const std::vector<Body>& bodies, const std::vector<Place>& places) {
  const auto carried = [&](int body, const Vec3& x) {
    if (body < 0) return x;
    const auto k = static_cast<std::size_t>(body);
    return Vec3(places[k].c + places[k].turn * (x - bodies[k].c));
  };
  const Vec3 a = carried(row.a, row.point_a), b = carried(row.b, row.point_b);
  At at;
  at.x = row.edges ? Vec3(0.5 * (a + b)) : row.a_owns ? b : a;
  at.frame = row.frame;
  if (row.carrier >= 0) at.frame = places[static_cast<std::size_t>(row.carrier)].turn * row.frame;
  if (row.edges) {
    // The common normal of two edges turns with the mean of both.
    const Mat3& tb = places[static_cast<std::size_t>(row.b)].turn;
    const Vec3 n = row.frame.col(0), turned = (tb * n + (row.a >= 0 ? Vec3(places[static_cast<std::size_t>(row.a)].turn * n) : n)).normalized();
    at.frame = Quat::FromTwoVectors(n, turned).toRotationMatrix() * row.frame;
  }
  at.arm_b = at.x - places[static_cast<std::size_t>(row.b)].c;
  if (row.a >= 0) at.arm_a = at.x - places[static_cast<std::size_t>(row.a)].c;
  return at;
}

double kinetic(const std::vector<Mass>& masses, const std::vector<Vec6>& v) {
  double sum = 0;
  for (std::size_t i = 0; i < v.size(); ++i) sum += 0.5 * v[i].dot(masses[i].mass * v[i]);
  return sum;
}

Solved Problems::solve(const std::vector<Mass>& masses, const std::vector<Vec6>& free, const std::vector<Row>& rows, const std::vector<At>& at, const std::vector<Asked>& asked, double residual) {
  constexpr double two_sided = 1e6;   // times all momentum there is: what a two-sided row may need
  Solved out;
  out.v = free;
  out.impulse.assign(rows.size(), Vec3::Zero());
  problem_.clear();
  double momentum = 0, fastest = residual;
  for (std::size_t i = 0; i < free.size(); ++i) {
    problem_.bodies.push_back({6, static_cast<int>(6 * i), masses[i].mass.data(), masses[i].inverse.data()});
    problem_.v_hat.insert(problem_.v_hat.end(), free[i].data(), free[i].data() + 6);
    momentum += masses[i].mass(0, 0) * free[i].head<3>().norm();
    fastest = std::max(fastest, free[i].head<3>().norm());
  }
  std::vector<std::size_t> used;
  const auto term = [&](int body, const Mat3& frame, const Vec3& arm, double sign) {
    problem_.terms.push_back({body, static_cast<int>(problem_.jacobians.size())});
    const Mat3 linear = sign * frame.transpose(), turning = -sign * frame.transpose() * skew(arm);
    problem_.jacobians.insert(problem_.jacobians.end(), linear.data(), linear.data() + 9);
    problem_.jacobians.insert(problem_.jacobians.end(), turning.data(), turning.data() + 9);
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!asked[i].used) continue;
    contact::ProblemContact c;
    c.first_term = static_cast<int>(problem_.terms.size());
    if (rows[i].a >= 0) term(rows[i].a, at[i].frame, at[i].arm_a, -1);
    term(rows[i].b, at[i].frame, at[i].arm_b, 1);
    c.terms = static_cast<int>(problem_.terms.size()) - c.first_term;
    c.bias = asked[i].bias;
    c.friction = asked[i].friction;
    c.impulse = asked[i].warm;
    const double bound = two_sided * (momentum + masses[static_cast<std::size_t>(rows[i].b)].mass(0, 0) * residual);
    if (asked[i].held) c.tension = bound;
    if (asked[i].held_along) c.cohesion = bound;
    problem_.contacts.push_back(c);
    used.push_back(i);
  }
  if (used.empty()) {
    out.ok = true;
    return out;
  }
  contact::SolveSettings settings;
  settings.velocity_scale = fastest;
  settings.tolerance = std::max(1e-13, 1e-2 * residual / fastest);
  settings.sufficient = std::max(1e-12, residual / fastest);
  // A little give on the way suits redundant contacts, next to none those of light bodies under heavy ones.
  contact::SolveReport r;
  for (const double give : {settings.proximal, 1e-2, 1e-7}) {
    settings.proximal = give;
    r = solver_.solve(problem_, settings);
    newton += r.newton;
    sweeps += r.sweeps;
    outer += r.outer;
    if (r.converged) break;
    for (contact::ProblemContact& c : problem_.contacts) c.impulse.setZero();
  }
  ++problems;
  worst = std::max(worst, r.residual);
  out.ok = r.converged;
  if (!r.converged) ++unsolved;
  for (std::size_t i = 0; i < free.size(); ++i) out.v[i] = Eigen::Map<const Vec6>(problem_.v.data() + 6 * i);
  for (std::size_t k = 0; k < used.size(); ++k) out.impulse[used[k]] = problem_.contacts[k].impulse;
  return out;
}

}  // namespace talus::coupling::step

#include "dda/state.hpp"

#include "dda/kinematics.hpp"

namespace talus::dda {

Mat3 strain_tensor(const Vec6& e) {
  Mat3 t;
  t << e[0], 0.5 * e[5], 0.5 * e[4],  //
      0.5 * e[5], e[1], 0.5 * e[3],   //
      0.5 * e[4], 0.5 * e[3], e[2];
  return t;
}

BlockState block_state(const State& s, int i) {
  const auto k = static_cast<std::size_t>(i);
  return {s.c[k], s.v[k], s.w[k], s.q[k], s.eps[k], s.eps_rate[k]};
}

void set_block_state(State& s, int i, const BlockState& b) {
  const auto k = static_cast<std::size_t>(i);
  s.c[k] = b.c;
  s.v[k] = b.v;
  s.w[k] = b.w;
  s.q[k] = b.q;
  s.eps[k] = b.eps;
  s.eps_rate[k] = b.eps_rate;
}

Pose pose(const BlockState& s) {
  Pose p;
  p.c = s.c;
  p.F = s.q.toRotationMatrix();
  if (!s.eps.isZero(0)) p.F *= Mat3::Identity() + strain_tensor(s.eps);
  return p;
}

Pose pose(const State& s, int i) {
  const auto k = static_cast<std::size_t>(i);
  Pose p;
  p.c = s.c[k];
  p.F = s.rotation(i);
  if (!s.eps[k].isZero(0)) p.F *= Mat3::Identity() + strain_tensor(s.eps[k]);
  return p;
}

Mat6 elastic_matrix(double young, double poisson) {
  const double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  const double mu = young / (2 * (1 + poisson));
  Mat6 d = Mat6::Zero();
  d.topLeftCorner<3, 3>().setConstant(lambda);
  d.diagonal().head<3>().array() += 2 * mu;
  d.diagonal().tail<3>().setConstant(mu);
  return d;
}

BlockEnergy energy(const Model& m, const State& s, int i) {
  return energy(m.blocks[static_cast<std::size_t>(i)], m.gravity, block_state(s, i));
}

BlockEnergy energy(const Model::Block& b, const Vec3& gravity, const BlockState& s) {
  BlockEnergy e;
  e.potential = -b.mass * gravity.dot(s.c);
  if (b.fixed) return e;
  e.translational = 0.5 * b.mass * s.v.squaredNorm();
  if (!b.deformable) {
    const Vec3 w = s.q.conjugate() * s.w;
    e.rotational = 0.5 * w.dot(b.inertia * w);
    return e;
  }
  const Mat12 mass = mass_matrix(b, pose(s), s.q.toRotationMatrix());
  Vec12 u;
  u << s.v, s.w, s.eps_rate;
  e.rotational = 0.5 * s.w.dot(mass.block<3, 3>(3, 3) * s.w);
  e.straining = 0.5 * u.dot(mass * u) - e.translational - e.rotational;
  e.strain_energy = 0.5 * b.volume * s.eps.dot(elastic_matrix(b.young, b.poisson) * s.eps);
  return e;
}

void momentum(const Model& m, const State& s, int i, Vec3& linear, Vec3& angular) {
  const auto k = static_cast<std::size_t>(i);
  const Model::Block& b = m.blocks[k];
  linear.setZero();
  angular.setZero();
  if (b.fixed) return;
  linear = b.mass * s.v[k];
  angular = s.c[k].cross(linear) + spin_momentum(b, s, i);
}

}  // namespace talus::dda

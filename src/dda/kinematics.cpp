#include "dda/kinematics.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace talus::dda {
namespace {

/// Symmetric basis tensors of the six strains, order of Eq. (1).
const std::array<Mat3, 6>& strain_basis() {
  static const std::array<Mat3, 6> basis = [] {
    std::array<Mat3, 6> b;
    for (int k = 0; k < 6; ++k) {
      Vec6 e = Vec6::Zero();
      e[k] = 1;
      b[static_cast<std::size_t>(k)] = strain_tensor(e);
    }
    return b;
  }();
  return basis;
}

Vec3 axial(const Mat3& c) { return {c(1, 2) - c(2, 1), c(2, 0) - c(0, 2), c(0, 1) - c(1, 0)}; }

Mat3 inertia_of(const Mat3& second_moment) {
  return second_moment.trace() * Mat3::Identity() - second_moment;
}

/// Body-axes inertia of the strained block: its second moment is (I + eps) S (I + eps).
Mat3 strained_inertia(const Model::Block& b, const Vec6& eps) {
  const Mat3 g = Mat3::Identity() + strain_tensor(eps);
  return inertia_of(g * b.second_moment * g.transpose());
}

/// Coriolis force of the turning frame on the strains, per rate of strain: antisymmetric, so that it takes no
/// energy. `spin`: in body axes.
Mat6 coriolis(const Model::Block& b, const Vec3& spin) {
  Mat6 g = Mat6::Zero();
  for (int j = 0; j < 6; ++j)
    for (int k = 0; k < j; ++k) {
      g(j, k) = 2 * spin.dot(axial(strain_basis()[static_cast<std::size_t>(j)] * b.second_moment *
                                   strain_basis()[static_cast<std::size_t>(k)]));
      g(k, j) = -g(j, k);
    }
  return g;
}

/// Angular momentum that strains take at a constant spin by what they add to the inertia, per strain.
Eigen::Matrix<double, 3, 6> swelling_momentum(const Model::Block& b, const Mat3& F, const Mat3& rotation,
                                              const Vec3& spin) {
  Eigen::Matrix<double, 3, 6> d;
  for (int k = 0; k < 6; ++k) {
    const Mat3 c = F * b.second_moment * (rotation * strain_basis()[static_cast<std::size_t>(k)]).transpose();
    d.col(k) = 2 * c.trace() * spin - (c + c.transpose()) * spin;
  }
  return d;
}

}  // namespace

Vec3 rotation_vector(const Quat& q) {
  const double w = std::abs(q.w());
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double s = v.norm();
  return s < 1e-12 ? Vec3(2 * v) : Vec3(2 * std::atan2(s, w) / s * v);
}

Quat rotation_by(const Vec3& theta) {
  const double angle = theta.norm();
  if (angle < 1e-8) {
    Quat q(1, 0.5 * theta.x(), 0.5 * theta.y(), 0.5 * theta.z());
    return q.normalized();
  }
  const double half = 0.5 * angle, s = std::sin(half) / angle;
  return Quat(std::cos(half), s * theta.x(), s * theta.y(), s * theta.z());
}

Eigen::Matrix<double, 3, 12> transformation(const Pose& pose, const Mat3& rotation, const Vec3& x) {
  Eigen::Matrix<double, 3, 12> t;
  const Vec3 r = x - pose.c;
  const Vec3 X = pose.F.inverse() * r;
  t.leftCols<3>().setIdentity();
  t.middleCols<3>(3) = -skew(r);
  for (int k = 0; k < 6; ++k) t.col(6 + k) = rotation * (strain_basis()[static_cast<std::size_t>(k)] * X);
  return t;
}

Mat12 mass_matrix(const Model::Block& b, const Pose& pose, const Mat3& rotation) {
  Mat12 m = Mat12::Zero();
  m.diagonal().head<3>().setConstant(b.mass);
  m.block<3, 3>(3, 3) = inertia_of(pose.F * b.second_moment * pose.F.transpose());
  for (int k = 0; k < 6; ++k) {
    const Mat3& e = strain_basis()[static_cast<std::size_t>(k)];
    const Vec3 couple = axial(pose.F * b.second_moment * (rotation * e).transpose());
    m.block<3, 1>(3, 6 + k) = couple;
    m.block<1, 3>(6 + k, 3) = couple.transpose();
    for (int l = 0; l < 6; ++l)
      m(6 + k, 6 + l) = (e * b.second_moment * strain_basis()[static_cast<std::size_t>(l)]).trace();
  }
  return m;
}

Vec3 spin_momentum(const Model::Block& b, const State& s, int i) {
  const auto k = static_cast<std::size_t>(i);
  const Mat3 rotation = s.rotation(i);
  if (!b.deformable) return rotation * (b.inertia * (rotation.transpose() * s.w[k]));
  const Mat12 m = mass_matrix(b, pose(s, i), rotation);
  return m.block<3, 3>(3, 3) * s.w[k] + m.block<3, 6>(3, 6) * s.eps_rate[k];
}

Quat rotate_free(const Model::Block&, const Mat3& body_inertia, const Quat& q, const Vec3& L, double h) {
  // Principal axes; a block that is dynamically a sphere turns about a fixed axis.
  Vec3 moments = body_inertia.diagonal();
  Quat principal = Quat::Identity();
  const double off =
      std::abs(body_inertia(0, 1)) + std::abs(body_inertia(0, 2)) + std::abs(body_inertia(1, 2));
  if (off > 1e-14 * moments.maxCoeff()) {
    Eigen::SelfAdjointEigenSolver<Mat3> eig;
    eig.computeDirect(body_inertia);
    Mat3 axes = eig.eigenvectors();
    if (axes.determinant() < 0) axes.col(2) *= -1;
    principal = Quat(axes);
    moments = (axes.transpose() * body_inertia * axes).diagonal();
  }
  Quat r = q * principal;
  Vec3 l = r.conjugate() * L;  // angular momentum in principal axes
  if (moments.maxCoeff() - moments.minCoeff() < 1e-14 * moments.maxCoeff())
    return (rotation_by(h * (L / moments[0])) * q).normalized();

  const double spin = l.cwiseQuotient(moments).norm();
  // Sixth-order composition (Yoshida 1990, solution A) of the Strang product; the sub-step keeps the error
  // near round-off of the orientation.
  const int substeps = std::max(1, static_cast<int>(std::ceil(spin * std::abs(h) / 0.04)));
  const double dt = h / substeps;
  constexpr double w1 = -1.17767998417887, w2 = 0.235573213359357, w3 = 0.784513610477560,
                   w0 = 1 - 2 * (w1 + w2 + w3);
  const auto turn = [&](int axis, double angle_h) {
    const double angle = angle_h * l[axis] / moments[axis];
    const double c = std::cos(angle), sn = std::sin(angle);
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double lj = l[j], lk = l[k];
    l[j] = c * lj + sn * lk;  // R_axis(angle)^T l
    l[k] = -sn * lj + c * lk;
    Vec3 e = Vec3::Zero();
    e[axis] = 1;
    const double ch = std::cos(0.5 * angle), sh = std::sin(0.5 * angle);
    r = r * Quat(ch, sh * e.x(), sh * e.y(), sh * e.z());
  };
  const auto strang = [&](double step) {
    turn(0, 0.5 * step);
    turn(1, 0.5 * step);
    turn(2, step);
    turn(1, 0.5 * step);
    turn(0, 0.5 * step);
  };
  for (int n = 0; n < substeps; ++n) {
    for (const double w : {w3, w2, w1, w0, w1, w2, w3}) strang(w * dt);
  }
  return (r * principal.conjugate()).normalized();
}

double drag_theta(double z) {
  constexpr double series = 0.02;  // below it the two fractions cancel; the next term is z^5/30240
  return z < series ? 0.5 + z / 12 - z * z * z / 720 : 1 / -std::expm1(-z) - 1 / z;
}

Vec3 drag_acceleration(double drag, double h, const Vec3& v0, const Vec3& v1) {
  const double theta = drag_theta(h * drag);
  return (v1 - v0) / h + drag * ((1 - theta) * v0 + theta * v1);
}

Dragged drag_path(double drag, double s, const Vec3& v0, const Vec3& acceleration) {
  const double z = s * drag, theta = drag_theta(z);
  const Vec3 v = v0 + (s * acceleration - z * v0) / (1 + z * theta);
  return {s * ((1 - theta) * v0 + theta * v), v};
}

double drag_work(double mass, double drag, double h, const Vec3& v0, const Vec3& v1) {
  const double theta = drag_theta(h * drag);
  return mass *
         (h * drag * ((1 - theta) * v0 + theta * v1).squaredNorm() + (theta - 0.5) * (v1 - v0).squaredNorm());
}

FreeFlow free_flow(const Model& m, const State& s, int i, double h, FlowRule rule, double drag) {
  const auto k = static_cast<std::size_t>(i);
  const Model::Block& b = m.blocks[k];
  FreeFlow f;
  const bool end = rule == FlowRule::implicit_end || rule == FlowRule::strain_at_end,
             leapfrog = rule == FlowRule::leapfrog;  // of the strain
  f.pose.c = s.c[k] + h * s.v[k] + ((rule == FlowRule::implicit_end ? 1.0 : 0.5) * h * h) * m.gravity;
  f.velocity.setZero();
  f.velocity.head<3>() = s.v[k] + h * m.gravity;
  double massive = 1;  // A over M in the translation
  if (drag > 0) {
    const double z = h * drag;
    f.theta = drag_theta(z);
    massive = 1 + z * f.theta;
    f.velocity.head<3>() = s.v[k] + (h * m.gravity - z * s.v[k]) / massive;
    f.pose.c = s.c[k] + h * (rule == FlowRule::implicit_end
                                 ? Vec3(f.velocity.head<3>())
                                 : Vec3((1 - f.theta) * s.v[k] + f.theta * f.velocity.head<3>()));
  }
  f.eps = s.eps[k];
  f.mass.setZero();
  f.inverse.setZero();
  const Vec3 L = spin_momentum(b, s, i);

  if (!b.deformable) {
    f.q = s.w[k].isZero(0) ? s.q[k] : rotate_free(b, b.inertia, s.q[k], L, h);
    f.rotation = f.q.toRotationMatrix();
    f.pose.F = f.rotation;
    if (!s.eps[k].isZero(0)) f.pose.F = f.rotation * (Mat3::Identity() + strain_tensor(s.eps[k]));
    const Mat3 inertia = f.rotation * b.inertia * f.rotation.transpose();
    const Mat3 inverse = inertia.inverse();
    f.velocity.segment<3>(3) = s.w[k].isZero(0) ? Vec3(Vec3::Zero()) : Vec3(inverse * L);
    f.mass.diagonal().head<3>().setConstant(massive * b.mass);
    f.mass.block<3, 3>(3, 3) = inertia;
    f.inverse.diagonal().head<3>().setConstant(1 / (massive * b.mass));
    f.inverse.block<3, 3>(3, 3) = inverse;
    f.spin = f.velocity.segment<3>(3);
    return f;
  }

  const Mat3 strained = strained_inertia(b, s.eps[k]);
  const Mat3 start_rotation = s.rotation(i);
  const Mat12 mass_start = mass_matrix(b, pose(s, i), start_rotation);
  // Strain rates carry angular momentum, which the frame turns against: L = I w + C epsdot.
  const auto recoil = [](const Mat12& m, const Vec6& rate) {
    return Vec3(-(m.block<3, 3>(3, 3).inverse() * (m.block<3, 6>(3, 6) * rate)));
  };
  const Vec3 recoil_start = recoil(mass_start, s.eps_rate[k]);
  f.q = (rotation_by(h * recoil_start) * rotate_free(b, strained, s.q[k], L, h)).normalized();
  f.rotation = f.q.toRotationMatrix();
  Pose turned = f.pose;
  turned.F = f.rotation * (Mat3::Identity() + strain_tensor(s.eps[k]));
  const Mat12 mass = mass_matrix(b, turned, f.rotation);

  const Mat6 stiffness = b.volume * elastic_matrix(b.young, b.poisson);
  const Mat6 dynamic =
      (end ? h * h + h * b.strain_damping : 0.25 * h * h + 0.5 * h * b.strain_damping) * stiffness;
  // Centrifugal force on the strains: the derivative of the rotational energy [J].
  Vec6 centrifugal;
  const Vec3& w_now = s.w[k];
  const Mat3 F0 = pose(s, i).F;
  for (int j = 0; j < 6; ++j) {
    const Mat3 c =
        F0 * b.second_moment * (start_rotation * strain_basis()[static_cast<std::size_t>(j)]).transpose();
    centrifugal[j] = w_now.squaredNorm() * c.trace() - w_now.dot(c * w_now);
  }
  Vec12 rhs;
  rhs.head<3>() = b.mass * f.velocity.head<3>();
  rhs.segment<3>(3) = L;
  rhs.tail<6>() = mass_start.block<6, 3>(6, 3) * s.w[k] + mass_start.block<6, 6>(6, 6) * s.eps_rate[k] +
                  h * centrifugal - h * (stiffness * s.eps[k]);
  if (leapfrog)
    rhs.tail<6>() += (0.25 * h * h - 0.5 * h * b.strain_damping) * (stiffness * s.eps_rate[k]);
  else if (!end)
    rhs.tail<6>() -= dynamic * s.eps_rate[k];
  Mat12 effective = mass;
  effective.block<6, 6>(6, 6) += dynamic;
  if (w_now.isZero(0)) {
    f.velocity = effective.llt().solve(rhs);
  } else {
    const Vec3 spin = start_rotation.transpose() * w_now;
    const Mat6 turning_frame = (end ? 1.0 : 0.5) * h * coriolis(b, spin);
    const Eigen::Matrix<double, 3, 6> swelling =
        (end ? 1.0 : 0.5) * h * swelling_momentum(b, turned.F, f.rotation, f.rotation * spin);
    effective.block<6, 6>(6, 6) -= turning_frame;
    effective.block<3, 6>(3, 6) += swelling;
    if (!end) {
      rhs.tail<6>() += turning_frame * s.eps_rate[k];
      rhs.segment<3>(3) -= swelling * s.eps_rate[k];
    }
    f.velocity = effective.partialPivLu().solve(rhs);
  }
  f.eps = s.eps[k] + (end || leapfrog ? Vec6(h * f.velocity.tail<6>())
                                      : Vec6(0.5 * h * (s.eps_rate[k] + Vec6(f.velocity.tail<6>()))));
  // The frame's recoil by the rule of the strains, now that their rates at the end are known; then the spin
  // that keeps L there.
  const Vec3 turn = (end || leapfrog ? 1.0 : 0.5) * h * (recoil(mass, f.velocity.tail<6>()) - recoil_start);
  f.q = (rotation_by(turn) * f.q).normalized();
  f.rotation = f.q.toRotationMatrix();
  f.pose.F = f.rotation * (Mat3::Identity() + strain_tensor(f.eps));
  f.mass = mass_matrix(b, f.pose, f.rotation);
  const Mat3 turning = f.mass.block<3, 3>(3, 3).inverse();
  f.velocity.segment<3>(3) = turning * L + recoil(f.mass, f.velocity.tail<6>());
  f.spin = turning * L + recoil(f.mass, s.eps_rate[k]);
  f.mass.diagonal().head<3>() *= massive;
  f.mass.block<6, 6>(6, 6) += dynamic;
  if (leapfrog) {
    // An impulse turns the rates of full steps by A^-1 p, those of half steps by A^-1 S A^-1 p: then its work
    // is their energy's change, whatever h.
    const Mat6 q = 0.25 * h * h * stiffness;
    const Eigen::Matrix<double, 3, 6> couple = f.mass.block<3, 6>(3, 6);
    const Mat6 strains = f.mass.block<6, 6>(6, 6) - dynamic - couple.transpose() * turning * couple;
    f.mass.block<6, 6>(6, 6) += q + q * strains.llt().solve(q);
  }
  f.inverse = f.mass.llt().solve(Mat12::Identity());
  return f;
}

double internal_energy(const Model::Block& b, const FreeFlow& f) {
  const Eigen::Matrix<double, 9, 1> v = f.velocity.tail<9>();
  return 0.5 * v.dot(mass_matrix(b, f.pose, f.rotation).bottomRightCorner<9, 9>() * v) +
         0.5 * b.volume * f.eps.dot(elastic_matrix(b.young, b.poisson) * f.eps);
}

void impulse_mass(const Model& m, const State& s, int i, bool frozen_strain, Mat12& mass, Mat12& inverse) {
  const Model::Block& b = m.blocks[static_cast<std::size_t>(i)];
  mass.setZero();
  inverse.setZero();
  const Mat3 rotation = s.rotation(i);
  if (!b.deformable || frozen_strain) {
    const Pose p = pose(s, i);
    const Mat3 inertia = b.deformable ? inertia_of(p.F * b.second_moment * p.F.transpose())
                                      : Mat3(rotation * b.inertia * rotation.transpose());
    mass.diagonal().setOnes();
    inverse.diagonal().tail<6>().setZero();
    mass.diagonal().head<3>().setConstant(b.mass);
    mass.block<3, 3>(3, 3) = inertia;
    inverse.diagonal().head<3>().setConstant(1 / b.mass);
    inverse.block<3, 3>(3, 3) = inertia.inverse();
    return;
  }
  mass = mass_matrix(b, pose(s, i), rotation);
  inverse = mass.llt().solve(Mat12::Identity());
}

}  // namespace talus::dda

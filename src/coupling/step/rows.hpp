/// Bodies and contact rows of one step, and the contact problems over them.
///
///   place of a row at given poses: the point x in which both sides act (the vertex that lies on the other's face), the normal
///   carried by the body that owns the face:  J v = F^T (v_b + w_b x (x - c_b) - v_a - w_a x (x - c_a)),  F = (n, t1, t2)
///
/// Both sides act in one point, so that momenta are kept to round-off whatever the row.
#pragma once
#include <functional>
#include <vector>

#include "contact/problem.hpp"
#include "coupling/step/tolerances.hpp"
#include "coupling/touch.hpp"
#include "dda/kinematics.hpp"

namespace talus::coupling::step {

struct Body {
  int block = 0;
  double mass = 0, radius = 0;
  Mat3 inertia = Mat3::Zero();   // body axes [kg m^2]
  Tolerances tol{0, 1, 0};
  Vec3 c = Vec3::Zero();         // at the start of the step
  Quat q = Quat::Identity();
  Vec6 v = Vec6::Zero();         // (v, w) [m/s, rad/s]
  Vec6 acceleration = Vec6::Zero();   // that the contacts allow at the start [m/s^2, rad/s^2]
};

/// Where a body is against the start of the step.
struct Place {
  Vec3 c = Vec3::Zero();
  Mat3 turn = Mat3::Identity();
};

/// Mass of a body at some orientation.
struct Mass {
  Mat6 mass, inverse;
};
Mass mass_of(const Body& body, const Mat3& rotation);

struct Row {
  int a = -1, b = 0;             // bodies, -1: what stands fast
  std::size_t pair = 0;
  std::uint64_t key = 0;
  const ContactLaw* law = nullptr;
  Vec3 point_a, point_b;         // at the start, world [m]
  double gap = 0;                // [m]
  int carrier = -1;              // body that turns the normal, -1: none, -2: edges, half of each
  bool a_owns = true, edges = false;
  Mat3 frame = Mat3::Identity(); // at the start, columns n, t1, t2
  Vec3 slip = Vec3::Zero();      // J v at the start [m/s]
  double open = 0, bounce = 0;   // Tolerances of the smaller body [m/s]
  bool slides_through = false;
  Vec3 impulse = Vec3::Zero();   // of the smooth step, frame [N s]
};

/// A row's place at given poses: point, frame, arms.
struct At {
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero(), x = Vec3::Zero();
  Mat3 frame = Mat3::Identity();
  Vec3 velocity(const Row& row, const std::vector<Vec6>& v) const {
    Vec3 u = v[static_cast<std::size_t>(row.b)].head<3>() + v[static_cast<std::size_t>(row.b)].tail<3>().cross(arm_b);
    if (row.a >= 0) u -= v[static_cast<std::size_t>(row.a)].head<3>() + v[static_cast<std::size_t>(row.a)].tail<3>().cross(arm_a);
    return frame.transpose() * u;
  }
};
At place_row(const Row& row, const std::vector<Body>& bodies, const std::vector<Place>& places);

/// What a row asks of a problem.
struct Asked {
  Vec3 bias = Vec3::Zero();
  double friction = 0;
  bool used = true;
  bool held = false, held_along = false;   // two-sided along the normal, along the face
  Vec3 warm = Vec3::Zero();
};

struct Solved {
  bool ok = false;
  std::vector<Vec6> v;
  std::vector<Vec3> impulse;     // per row, zero where unused
};

/// Assembles and solves contact problems over bodies and rows; counts.
class Problems {
 public:
  /// residual [m/s]: of the exact law.
  Solved solve(const std::vector<Mass>& masses, const std::vector<Vec6>& free, const std::vector<Row>& rows, const std::vector<At>& at, const std::vector<Asked>& asked, double residual);
  long problems = 0, newton = 0, sweeps = 0, outer = 0, unsolved = 0;
  double worst = 0;              // residual over what was asked

 private:
  contact::ContactSolver solver_;
  contact::ContactProblem problem_;
};

double kinetic(const std::vector<Mass>& masses, const std::vector<Vec6>& v);

}  // namespace talus::coupling::step

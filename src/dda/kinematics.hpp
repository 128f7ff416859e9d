/// Kinematics and free flow of one block.
///
///   A = M + h^2 K / 4 + h C / 2         (strain by the trapezoidal rule, Kelvin-Voigt C = tau K)
///   M = integral rho T^T T, its rotation and shear rows couple unless S is isotropic
///   free flow: c by the parabola, L exact,
///              R by a fourth-order composition of principal-axis rotations [mclachlan1993]
///   drag F = -eta v on the centroid (docs/theory/ground.md): exact for a force f that stays,
///              v_np - v_n = h f/m - z v_m,   c_np - c_n = h v_m,   z = h eta/m,
///              v_m = (1 - theta) v_n + theta v_np,   theta = 1/(1 - e^-z) - 1/z (1/2 without drag),
///              A = (1 + z theta) M in the translation
#pragma once
#include "dda/state.hpp"

namespace talus::dda {

/// Displacement transformation of Eq. (3) at world point x: velocity = T (v, w, epsdot), strain columns in
/// body axes.
Eigen::Matrix<double, 3, 12> transformation(const Pose& pose, const Mat3& rotation, const Vec3& x);

/// Full mass matrix in the order (v, w, epsdot) [kg, kg m, kg m^2].
Mat12 mass_matrix(const Model::Block& b, const Pose& pose, const Mat3& rotation);

/// Angular momentum about the centroid, world axes [kg m^2/s].
Vec3 spin_momentum(const Model::Block& b, const State& s, int i);

/// The block after a time h without contact.
struct FreeFlow {
  Pose pose;      // at the end
  Mat3 rotation;  // at the end
  Quat q;
  Vec6 eps;
  Vec12 velocity;      // v_hat: generalised velocity at the end, (v, w, epsdot)
  Mat12 mass;          // A at the end (6 x 6 upper left used for rigid blocks)
  Mat12 inverse;       // A^-1
  double theta = 0.5;  // share of the velocity at the end in the mean velocity of the translation
  Vec3
      spin;  // of the start, carried to the orientation at the end with the strain rates of the start [rad/s]
};

/// Rule of the free flow: `exact` is the parabola and the trapezoid of the strain (order 2, keeps energy);
/// `implicit_end` takes position and strain by the velocity at the end (order 1, damps what the step does not
/// resolve), which a force that acts by its value at the end of the step needs to leave a block at rest where
/// it is. `leapfrog` takes strain rates as those of half steps, what blocks at a structure that is stepped so
/// need: A (epsdot_+ - epsdot_-) = -h K eps_n, eps_np = eps_n + h epsdot_+; the work of an impulse at n is
/// then its product with the mean of both rates for any step (Newmark's rule with beta = 1/4, stable).
/// `strain_at_end` is `exact` but for the strain, by its rate at the end: for blocks that impulses at the
/// start of the step move, x + h v^+, and where the trapezoid would make energy of a vibration that the step
/// does not resolve.
enum class FlowRule { exact, implicit_end, leapfrog, strain_at_end };
/// `drag`: eta/m of the block [1/s].
FreeFlow free_flow(const Model& m, const State& s, int i, double h, FlowRule rule = FlowRule::exact,
                   double drag = 0);

/// theta of the drag for z = h eta/m >= 0: in [1/2, 1).
double drag_theta(double z);

/// Acceleration by the other forces, as long as they stay, that takes a block with drag from v0 to v1 in h
/// [m/s^2].
Vec3 drag_acceleration(double drag, double h, const Vec3& v0, const Vec3& v1);

/// Way and velocity after a time s under that acceleration and drag.
struct Dragged {
  Vec3 way, velocity;
};
Dragged drag_path(double drag, double s, const Vec3& v0, const Vec3& acceleration);

/// Energy that drag takes in a step of length h in which the velocity goes from v0 to v1 [J]:
/// eta h |v_m|^2 + (theta - 1/2) m |v1 - v0|^2, the integral of eta v^2 where the other forces stay.
double drag_work(double mass, double drag, double h, const Vec3& v0, const Vec3& v1);

/// Energy of turning, straining and strain at the end of the free flow of a deformable block [J].
double internal_energy(const Model::Block& b, const FreeFlow& f);

/// Mass and inverse for an impulse of no duration: M alone, strain rows decoupled and locked if
/// `frozen_strain`.
void impulse_mass(const Model& m, const State& s, int i, bool frozen_strain, Mat12& mass, Mat12& inverse);

/// Torque-free rotation over h: q at the end for angular momentum L (world). Exact in L.
Quat rotate_free(const Model::Block& b, const Mat3& body_inertia, const Quat& q, const Vec3& L, double h);

/// Rotation by the vector theta [rad], as a quaternion.
Quat rotation_by(const Vec3& theta);

/// Its inverse: the rotation vector of q, of length at most pi [rad].
Vec3 rotation_vector(const Quat& q);

}  // namespace talus::dda

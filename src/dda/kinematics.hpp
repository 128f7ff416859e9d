/// Kinematics and free flow of one block.
///
///   A = M + h^2 K / 4 + h C / 2         (strain by the trapezoidal rule, Kelvin-Voigt C = tau K)
///   M = integral rho T^T T, its rotation and shear rows couple unless S is isotropic
///   free flow: c by the parabola, L exact,
///              R by a fourth-order composition of principal-axis rotations [mclachlan1993]
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
  Vec12 velocity;  // v_hat: generalised velocity at the end, (v, w, epsdot)
  Mat12 mass;      // A at the end (6 x 6 upper left used for rigid blocks)
  Mat12 inverse;   // A^-1
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
FreeFlow free_flow(const Model& m, const State& s, int i, double h, FlowRule rule = FlowRule::exact);

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

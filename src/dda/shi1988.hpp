/// The scheme of the rockfall paper (method "dda-1988"), kept as it is: the baseline of every comparison.
///
///   D = (u_c, v_c, w_c, r_x, r_y, r_z, e_x, e_y, e_z, g_yz, g_zx, g_xy) of a step, world axes        Eq. (1)
///   u(x) = T(x) D                                                                              Eqs. (2), (3)
///   K^ D = F^,  K^ = 2 M / dt^2 + K,  F^ = 2 M Ddot_0 / dt + F,  Ddot = 2 D / dt - Ddot_0    Eqs. (5) - (8)
///   contact: d_n = gap_0 + n.(u_b - u_a),  d_s = d_s0 + (I - n n^T)(u_b - u_a)
///            F_n = -k_n d_n,  F_s = k_s |d_s|
///   open d_n >= 0 | locked F_s <= F_n tan(phi) + c A | sliding otherwise, friction F_n tan(phi)      Table 1
///
/// symbol   meaning                                                  unit      shape
/// D        displacement increment of a block                        m, rad, 1 12
/// M        integral of rho T^T T over the present shape             kg...     12 x 12
/// A        vertex map of a block, x_v = c + A X_v                   1         3 x 3
/// sigma    stress carried from step to step, world axes             Pa        6
/// d_n, d_s normal and shear distance of a contact point             m         1, 3
///
/// The open-close iteration follows the rules of Shi's program: a closed contact that was open starts locked
/// or sliding by the trial shear; a sliding contact stays sliding until its slip turns round, and its
/// friction acts against the slip of the iteration before, with the normal force of the iteration before; at
/// most six iterations and two more; if they do not settle the step is cut to a third. What the scheme does
/// wrong (docs/theory/dda-1988.md) is left as it is.
///
/// [shi1988] Discontinuous deformation analysis, ch. 2-4; [shi2001] Three dimensional DDA; the rockfall
/// paper, Eqs. (1)-(9).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/laws/law.hpp"
#include "dda/state.hpp"

namespace talus::dda {

struct Shi1988Settings {
  bool post_correction = true;  // Eq. (4); off: first-order displacements, the block grows
  int iteration_cap = 8;        // of the open-close iteration: six and two more
  int least_iterations = 2;     // while anything slides: the friction of one iteration lags by a whole step
  bool relock_loaded =
      true;  // a contact that stops sliding locks with its spring at the friction it had; false: slack
  bool settle_shear =
      false;  // false: settled when no contact opens or closes (Shi's program); true: nor locks or slides
  double step_cut = 1.0 / 3.0;  // of a step that does not settle
  double step_growth = 1.3;     // after a cut, per settled step
  double smallest_step = 0.01;  // fraction of the step asked for; there the step is accepted as not settled
  double displacement_ratio =
      0.0;  // allowed step displacement over half the height of the domain; 0: no such control
  double half_height = 0.0;  // of the domain [m]; 0: from the blocks and surfaces at the first step
  double penalty = 0.0;      // k_n where a law says hard [N/m]; 0: ten times the number of Young's modulus
  double shear_ratio = 2.5;  // k_n / k_s where a law gives no k_s
  double fixed_point_penalty = 0.0;  // [N/m]; 0: as `penalty`
  double rigid_young = 50e9;  // [Pa] for a block without Young's modulus: the scheme knows no rigid block
  double rigid_poisson = 0.2;
  int direct_limit = 16;  // islands up to this many blocks are factorised, bigger ones by conjugate gradients
};

/// A contact point with its history.
struct Shi1988Contact {
  enum Partner : std::int32_t { block = 0, plane = 1, surface = 2 };
  enum Status : std::int32_t { open = 0, sliding = 1, locked = 2 };
  std::int32_t partner = block;  // what body A is
  std::int32_t a = 0;            // its index
  std::int32_t b = 0;            // block B
  std::int32_t status = open;
  std::int32_t bonded = 0;   // cohesion and tension not yet broken
  std::int32_t face_a = -1;  // of body A (triangle of a surface)
  contact::FeatureKey key = 0;
  Vec3 point = Vec3::Zero();    // [m]
  Vec3 normal = Vec3::UnitZ();  // out of A
  double area = 0;              // [m^2]
  double gap = 0;               // d_n at the end of the step, as the scheme sees it [m]
  Vec3 shear = Vec3::Zero();    // d_s of a locked contact, zero else [m]
  Vec3 slip = Vec3::Zero();     // direction of sliding of B against A
  Vec3 force = Vec3::Zero();    // on B, end of the step [N]
};

/// All history beyond State, plain arrays. A copy is a checkpoint. Blocks that State has gained are taken
/// over by the next step.
struct Shi1988State {
  std::vector<Mat3> map;                 // A per block
  std::vector<Vec6> stress;              // world axes [Pa]
  std::vector<Shi1988Contact> contacts;  // sorted by partner, a, b, key
  double contact_energy = 0;             // of the springs at the end of the last step [J]
  double next_step = 0;                  // sub-step to begin with after a cut [s]; 0: the whole step
  double half_height = 0;                // [m]
  std::int64_t steps = 0;

  void save(std::vector<double>& out) const;
  /// Reads what save() wrote; returns how many numbers were taken.
  std::size_t restore(std::span<const double> in);
};

/// What a block did to a surface over a sub-step. The scheme's velocities (gamma 1) take the force at the end
/// of it as acting all along.
struct Shi1988Load {
  int surface = 0, block = 0;
  double time = 0, dt = 0;  // end of the sub-step since the start of the step; its length [s]
  Vec3 point = Vec3::Zero(), force = Vec3::Zero(),
       normal = Vec3::UnitZ();  // force on the surface [N]; normal out of it
  double area = 0;              // [m^2]
};

/// What one step did. Dissipated energies are positive and computed from the forces that acted and what they
/// did, spring by spring; a negative `algorithmic` is energy that the scheme created.
struct Shi1988Report {
  int substeps = 0;
  int iterations = 0;  // open-close iterations, solves of Eq. (9)
  int step_cuts = 0;
  int unsettled = 0;  // sub-steps accepted at the smallest step or without permission to cut: not settled
  int contacts = 0;   // listed
  int closed = 0;     // at the end
  double max_penetration = 0;   // [m]
  double max_displacement = 0;  // of a vertex in one sub-step [m]
  double smallest_substep = 0;  // [s]

  double friction_work = 0;   // dissipated by sliding [J]
  double friction_drove = 0;  // of sliding, where the lagging friction drove the motion; at most nothing [J]
  double newmark_contact =
      0;                      // damping of contact springs by beta 0.5, gamma 1, and their release on opening
  double newmark_strain = 0;  // the same of the block strains
  double geometry = 0;        // jump of spring energy where the gap is measured anew at the step start
  double shape = 0;  // jump of kinetic and strain energy where M and the volume are taken from the new shape
  double partner_work = 0;  // work done on the blocks by moving partners (structures)
  double algorithmic() const { return friction_drove + newmark_contact + newmark_strain + geometry + shape; }

  std::vector<Shi1988Load> loads;  // on surfaces, sub-step by sub-step

  // at the end of the step
  double kinetic = 0, strain = 0, potential = 0, contact = 0;  // [J]
  bool settled() const { return unsettled == 0; }
};

class Shi1988 {
 public:
  explicit Shi1988(Shi1988Settings settings = {}) : settings_(settings) {}

  /// Advances by dt, in sub-steps if the iteration does not settle. Throws NumericalFailure if at the
  /// smallest step a block would turn inside out, or if the solution is not finite; state and history are
  /// then those of the last whole sub-step.
  Shi1988Report step(const Model& model, State& state, Shi1988State& history,
                     const std::vector<Plane>& planes,
                     const std::vector<const contact::SurfaceIndex*>& surfaces, const ContactLaws& laws,
                     double dt) const;

  /// c and A: what the blocks look like to the contact search and to output.
  static Pose pose(const State& state, const Shi1988State& history, int i);

  /// What this method does with the scene that another would not, one line per fact.
  std::vector<std::string> plan(const Model& model, const ContactLaws& laws) const;

  const Shi1988Settings& settings() const { return settings_; }

 private:
  Shi1988Settings settings_;
};

}  // namespace talus::dda

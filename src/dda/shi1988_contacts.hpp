/// Contact points of one step of the 1988 scheme: listing, inheritance from the step before, Table 1, springs
/// in Eq. (9).
///
///   normal spring:  K += e^T k_n e, F -= e^T k_n gap_0,      e = n^T [T_b, -T_a]
///   shear spring:   the same with k_s (I - n n^T) and d_s0
///   friction:       F -= [T_b, -T_a]^T F_n tan(phi) s
///                   s the slip direction of B against A, F_n of the iteration before
#pragma once
#include <utility>
#include <vector>

#include "dda/shi1988.hpp"
#include "dda/shi1988_matrices.hpp"
#include "dda/shi1988_system.hpp"

namespace talus::dda::shi1988 {

/// The partners a block can meet.
struct Surroundings {
  const Model& model;
  const std::vector<Plane>& planes;
  const std::vector<const contact::SurfaceIndex*>& surfaces;
  const ContactLaws& laws;
};

/// A contact point during a step: record with what is derived from it.
struct WorkingContact {
  Shi1988Contact record;
  double kn = 0, ks = 0;             // [N/m]
  double friction = 0;               // tan(phi)
  double cohesion = 0, tension = 0;  // [N], while bonded
  int dof_a = -1, dof_b = -1;        // block numbers if they have degrees of freedom
  int pair = -1;                     // coupling of Eq. (9), if both have
  Mat3x12 Ta = Mat3x12::Zero(), Tb = Mat3x12::Zero();
  Vec3 partner_velocity = Vec3::Zero();  // of a moving surface at the point [m/s]
  double gap0 = 0;                       // at the start of the step [m]
  Vec3 shear0 = Vec3::Zero();            // d_s at the start of the step [m]
  int status0 = 0;                       // inherited
  Vec3 slip0 = Vec3::Zero();
  double energy0 = 0;        // in the springs at the start of the step [J]
  double energy0_shear = 0;  // of which shear

  // the iteration
  int status = 0;
  Vec3 reference = Vec3::Zero();  // d_s at the start of the step as the locked spring sees it
  Vec3 slip = Vec3::Zero();
  double lagged_normal = 0;  // F_n of the iteration before [N]
  struct Used {
    int status = 0;
    Vec3 reference = Vec3::Zero(), slip = Vec3::Zero();
    double lagged_normal = 0;
  };
  Used used;                       // what the last solve was made with
  double gap = 0;                  // after the solve
  Vec3 step_shear = Vec3::Zero();  // (I - n n^T)(u_b - u_a) of this step, after the solve

  void reset();  // back to the start of the step
  Vec3 relative_displacement(const std::vector<Vec12>& D, double h) const;
  /// Force on B at the end of the step, as the last solve had it [N].
  Vec3 force() const;
};

class ContactList {
 public:
  /// Lists all contacts with gap <= margin and gives them the history of `previous`.
  void build(const Surroundings& s, const State& state, const Shi1988State& history,
             const Shi1988Settings& settings, double margin);
  /// Pairs of blocks with degrees of freedom that share a contact, sorted; sets WorkingContact::pair.
  std::vector<std::pair<int, int>> number_pairs();
  void reset() {
    for (auto& c : list) c.reset();
  }

  std::vector<WorkingContact> list;
};

/// Adds springs and friction of a contact in its present state.
void assemble(const WorkingContact& c, double h, BlockSystem& system);

/// Table 1 after a solve, by the rules of Shi's program. `tolerance` [m]: slip below it does not count as
/// turned round. `relock_loaded`: see Shi1988Settings. Returns what changed.
struct StatusChange {
  bool opened_or_closed = false;
  bool locked_or_slid = false;
};
StatusChange update_status(WorkingContact& c, const std::vector<Vec12>& D, double h, double tolerance,
                           bool relock_loaded);

/// k_n of a pair whose law names none [N/m].
double default_penalty(const Shi1988Settings& settings, double young_a, double young_b);
/// Young's modulus and Poisson's ratio that the scheme uses for a block.
std::pair<double, double> elasticity(const Shi1988Settings& settings, const Model::Block& b);

}  // namespace talus::dda::shi1988

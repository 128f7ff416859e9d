/// Blocks of 12 degrees of freedom: what is fixed during a step (Model) and all that has a history (State).
///
///   x(X, t) = c + R (I + eps) X,        xdot = v + w x (x - c) + R epsdot X
///
/// symbol   meaning                                                   unit     shape
/// c, v     centroid and its velocity, world axes                     m, m/s   3
/// R        rotation, body to world, as a unit quaternion             1        4
/// w        angular velocity, world axes                              rad/s    3
/// eps      strain in body axes, order of the paper's Eq. (1):
///          ex, ey, ez, g_yz, g_zx, g_xy (engineering shear)          1        6
/// S        second moment of mass about c in body axes                kg m^2   3 x 3
///
/// Generalised velocity of a block: (v, w, epsdot), 6 or 12 numbers, in the order of the paper's Eq. (1).
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "core/types.hpp"

namespace talus::dda {

/// Fixed during a step. Blocks are never removed; fragments are appended.
struct Model {
  struct Block {
    std::string name;
    std::shared_ptr<const Polyhedron> shape;  // body axes about the centroid
    double mass = 0;                          // [kg]
    double volume = 0;                        // [m^3]
    Mat3 second_moment = Mat3::Zero();        // S
    Mat3 inertia = Mat3::Zero();              // J = tr(S) I - S, body axes, undeformed
    int material = 0;
    bool fixed = false;                    // no DOFs
    bool deformable = false;               // 12 DOFs, else 6
    double young = 0, poisson = 0;         // [Pa], used if deformable
    double strain_damping = 0;             // Kelvin-Voigt viscosity over stiffness [s]
    std::vector<Vec3> fixed_points;        // body axes; held by stiff springs (dda-1988) or hard rows (talus)
    std::vector<Vec3> fixed_points_world;  // where they are held
    int structure = -1;                    // fragment of this structure, -1 otherwise
    int ndof() const { return fixed ? 0 : deformable ? 12 : 6; }
  };
  std::vector<Block> blocks;
  Vec3 gravity{0, 0, -9.81};
};

/// All history of the blocks, plain arrays. A copy is a checkpoint.
struct State {
  std::vector<Vec3> c, v, w;
  std::vector<Quat> q;
  std::vector<Vec6> eps, eps_rate;
  std::vector<double> slid;  // way slid as friction remembers it [m]; empty where no law asks for it
  int size() const { return static_cast<int>(c.size()); }
  Mat3 rotation(int i) const { return q[static_cast<std::size_t>(i)].toRotationMatrix(); }
};

/// State of one block.
struct BlockState {
  Vec3 c = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
  Quat q = Quat::Identity();
  Vec6 eps = Vec6::Zero(), eps_rate = Vec6::Zero();
};
BlockState block_state(const State& s, int i);
void set_block_state(State& s, int i, const BlockState& b);

/// Symmetric tensor of a strain vector (half the engineering shears off the diagonal).
Mat3 strain_tensor(const Vec6& e);

/// Pose of block i: c, F = R (I + eps).
Pose pose(const State& s, int i);
Pose pose(const BlockState& s);

/// 6 x 6 elastic matrix for engineering strains in the order of Eq. (1) [Pa].
Mat6 elastic_matrix(double young, double poisson);

struct BlockEnergy {
  double translational = 0, rotational = 0, straining = 0, strain_energy = 0, potential = 0;
};
/// Kinetic (split), strain energy and gravity potential (zero at z = 0) [J]. `rotational` holds the energy of
/// w alone, `straining` the energy of epsdot and its coupling with w.
BlockEnergy energy(const Model& m, const State& s, int i);
BlockEnergy energy(const Model::Block& b, const Vec3& gravity, const BlockState& s);

/// Linear momentum [kg m/s] and angular momentum about the scene origin [kg m^2/s] of block i.
void momentum(const Model& m, const State& s, int i, Vec3& linear, Vec3& angular);

}  // namespace talus::dda

/// Key blocks: which blocks of a cut rock mass can move out, how, and how safely [goodman1985], the mode of
/// motion by vectors [warburton1981].
///
///   joint pyramid        JP = { x : n_i . x >= 0 for all joint faces i },  n_i into the block
///   removable            JP holds more than the zero vector, and the block has a free face
///   falling              r . n_i > 0 for all i: no face opposes the weight, the only resultant (no lifting)
///   sliding on one face  s_i = r - (r . n_i) n_i,  where  r . n_i <= 0  and  s_i . n_j >= 0 for all j
///   sliding on two       s_ij = +-(n_i x n_j) with r . s_ij > 0, in JP,  s_i . n_j <= 0,  s_j . n_i <= 0
///   factor of safety     F = sum_k (N_k tan phi_k + c_k A_k + s_k B_k) / |T|   over the faces it slides on
///
/// symbol  meaning                                                       unit
/// r       resultant (weight)                                            N
/// n_i     unit normal of joint face i, into the block                   1
/// N_k, T  normal force on a sliding face, driving force along the slide N
/// phi, c  friction angle and cohesion of the joint                      rad, Pa
/// A_k     area of the face                                              m^2
/// s, B_k  shear strength of its rock bridges, and their area             Pa, m^2
///
/// Bridges of faces that the block leaves, and of one that falls free, are not counted.
#pragma once
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "geometry/cut.hpp"

namespace talus::geometry {

struct JointStrength {
  double friction = 0;  // angle [rad]
  double cohesion = 0;  // [Pa]
};

struct KeyBlock {
  enum class Type {
    enclosed,        // no free face
    tapered,         // has a free face, but the joints hold it from all sides
    stable,          // removable, but the weight does not drive it out
    needs_friction,  // removable, driven; friction (and cohesion) hold it: F >= 1
    unstable         // removable, driven, F < 1, or falls free
  };
  enum class Mode { none, falling, plane, wedge };
  Type type = Type::enclosed;
  Mode mode = Mode::none;
  int joint_1 = -1, joint_2 = -1;  // joints it slides on, numbered as in face_joint_set
  double factor_of_safety = std::numeric_limits<double>::infinity();
  Vec3 direction = Vec3::Zero();                                     // of sliding or falling, unit
  double normal_force_1 = 0, normal_force_2 = 0, driving_force = 0;  // [N]
  double free_area = 0;                                              // [m^2]
};

/// Directions and forces alone: normals into the block, one for each joint plane it rests against, with area
/// and strength.
struct BlockPlane {
  Vec3 normal;
  double area = 0;
  JointStrength strength;
  int joint = -1;
  double bridges = 0;  // shear force that its rock bridges bear [N]
};
KeyBlock key_block(const std::vector<BlockPlane>& planes, double free_area, const Vec3& weight);

struct KeyBlockOptions {
  double density = 2500;  // [kg/m^3]
  Vec3 gravity{0, 0, -9.81};
  std::vector<JointStrength> strength;  // by joint number; missing entries: the last one
  /// Is there rock or ground right outside the region's surface at this point (normal outward)? Default:
  /// nowhere. Whatever it says, the region's base is held: its faces that look straight down at its lowest
  /// level.
  std::function<bool(const Vec3& point, const Vec3& normal)> is_held;
};
/// One entry per block of the cut. Faces on the region's surface are free whatever their slope, overhanging
/// ones too, but for those that are held; these count as resting on rock, with the strength of the last
/// entry.
std::vector<KeyBlock> key_blocks(const CutResult& cut, const KeyBlockOptions& options);

std::string name_of(KeyBlock::Type type);
std::string name_of(KeyBlock::Mode mode);

}  // namespace talus::geometry

/// Strain rates of blocks at a structure in explicit steps: those of half steps within a step, of full ones
/// in the state (structures/leapfrog.cpp).
#pragma once
#include "dda/kinematics.hpp"

namespace talus::coupling {

/// Mass and stiffness of a block's strains, its angular momentum kept.
struct StrainDynamics {
  Mat12 full;  // mass matrix now
  Mat6 mass, stiffness;

  /// Strain rates of the half step before, where a step of length h has led to these.
  Vec6 rates_before(const dda::State& s, std::size_t k, double h) const {
    return (mass + 0.25 * h * h * stiffness)
        .llt()
        .solve(mass * s.eps_rate[k] + 0.5 * h * (stiffness * s.eps[k]));
  }
  /// The spin that goes with these strain rates [rad/s].
  Vec3 spin_with(const dda::State& s, std::size_t k, const Vec6& rates) const {
    return s.w[k] - full.block<3, 3>(3, 3).inverse() * (full.block<3, 6>(3, 6) * (rates - s.eps_rate[k]));
  }
};
StrainDynamics strain_dynamics(const dda::Model::Block& block, const dda::State& s, int i);

/// What a block's points went faster by in the half step before than at the full step.
class BeforeFullStep {
 public:
  /// `lasted`: length of the step that led to the state, 0: none that had half steps [s].
  BeforeFullStep(const dda::Model& m, const dda::State& s, int block, double lasted);
  bool strains() const { return strains_; }
  Vec3 operator()(const Vec3& x) const;  // at x (world) [m/s]

 private:
  bool strains_;
  Vec3 centre_ = Vec3::Zero(), spin_ = Vec3::Zero();
  Mat3 gradient_ = Mat3::Zero();
};

}  // namespace talus::coupling

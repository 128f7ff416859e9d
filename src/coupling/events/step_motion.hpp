/// Ways of the bodies within a step, and when pairs meet on them.
#pragma once
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// From the start of the step to the state just computed: rotation vector, and a parabola; where
/// `time_stepped`, of blocks that are pushed the chord.
contact::Motion motion_of(const IslandContext& in, const Step& step, int block, bool time_stepped);

class StepMotion {
 public:
  /// Of the step just computed; `time_stepped`: time-stepped (motion_of()).
  StepMotion(const IslandContext& in, const Step& step, bool time_stepped);
  /// These of the bodies, in their order; what is no body rests.
  StepMotion(const IslandContext& in, const Step& step, std::vector<contact::Motion> of_bodies);
  contact::Motion of(int block) const;
  /// Fraction of the step at which the two come as near as `tolerance` [m]; above 1: not within it.
  double time_of_impact(const CandidatePair& pair, double tolerance) const;
  /// Bound on how far points of the two move against each other [m].
  double path(const CandidatePair& pair) const;

 private:
  const IslandContext& in_;
  const Step& step_;
  bool lumped_ = true;
  std::vector<contact::Motion> motions_;  // empty: of the step just computed
};

/// Where a point of a block (or of what is fixed) was at the start of the step.
Vec3 carried_back(const IslandContext& in, const Step& step, int block, const Vec3& x);

/// A touch found at the end of a step as it was at its start: points and normal go back with the bodies that
/// own them.
Touch carried_back(const IslandContext& in, const Step& step, Touch t);

/// Inradius of the thinner one [m].
double thickness(const dda::Model& model, const CandidatePair& pair);

}  // namespace talus::coupling

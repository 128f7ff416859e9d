/// The onset of hard contacts where events are located: an impulse of no duration on all closed touches.
#pragma once
#include "coupling/events/structure_impacts.hpp"
#include "coupling/rows/assembly.hpp"
#include "coupling/solution/problem_solver.hpp"
#include "coupling/step/update.hpp"

namespace talus::coupling {

class ImpactStage {
 public:
  ImpactStage(const IslandContext& in, Step& step, IslandReport& report, RowAssembly& assembly,
              ProblemSolver& solver, BodyUpdate& update, StructureImpacts& on_structures);
  /// Of a macro step.
  void begin() { count_ = 0; }
  /// An impulse of no duration at this time on all closed touches, if any of them approaches. False: it has
  /// no solution, all is as it was.
  bool resolve(double time);
  /// Impacts of the macro step.
  int count() const { return count_; }

 private:
  struct Restitution {
    double normal = 0, along = 0;  // along the normals and along the faces
  };
  enum class Impact { unsolved, gains, done };  // gains: energy from restitution
  /// Rows of an impulse of no duration, with so much of the restitution that their laws ask for; the most
  /// that one of these asks for.
  Restitution impact_rows(const Restitution& part);
  /// The impulse of no duration from the state kept. Where it is unsolved all is as it was; `frozen_strain`
  /// is of begin_step().
  Impact apply_impulse(const Restitution& part, bool frozen_strain);
  /// The impulse with the largest part of the restitution between `none`, which makes no energy, and `all`,
  /// which does, that makes none.
  Impact largest_restitution(const Restitution& none, const Restitution& all, bool frozen_strain);

  const IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  RowAssembly& assembly_;
  ProblemSolver& solver_;
  BodyUpdate& update_;
  StructureImpacts& on_structures_;
  int count_ = 0;
};

}  // namespace talus::coupling

/// What all parts of a step share: the island, its surroundings, and how it is stepped.
#pragma once
#include <atomic>
#include <vector>

#include "contact/tolerances.hpp"
#include "coupling/step/island.hpp"
#include "coupling/step/scales.hpp"
#include "dda/kinematics.hpp"

namespace talus::coupling {

/// Constant over a macro step, but for the state and the regime.
struct IslandContext {
  const dda::Model& model;
  dda::State& state;
  Environment& env;
  ContactHistory& history;          // per block
  ContactHistory& surface_history;  // per structure
  StepSettings settings;
  bool vegetated = false;  // something grows on a ground
  const Island* island = nullptr;
  std::vector<int> local{};   // block -> body of the step, -1
  std::vector<int> placed{};  // the island's blocks, as they stand in `local`
  Scales scale{};
  // regime
  bool time_stepping = false;  // for the rest of the macro step: to locate its events would cost more
  bool condensed = false;      // the structures take condensed steps
  int unsolved = 0;            // problems of the macro step that had no solution
  const std::atomic<int>* stop = nullptr;  // non-zero: end soon, the macro step is void

  /// The island with its bodies, and its length and speed, at the start of a macro step.
  void begin(const Island& of);

  /// A structure's boundary surface as it is now.
  const TriangleSurface& surface(int structure) const {
    return env.structures[static_cast<std::size_t>(structure)].structure->skin().surface();
  }
  double fastest_surface() const;  // of the vertices of the structures [m/s]
  bool moving_surface(const Partner& a) const {
    return a.kind == Partner::Kind::structure &&
           !env.structures[static_cast<std::size_t>(a.index)].fixed_surface;
  }
  /// At a structure that is stepped, on either side.
  bool deformable_structure(const Touch& t) const { return t.b < 0 || moving_surface(t.a); }

  /// All contacts act at the start of the step, springs by the secant rule.
  bool leapfrog() const { return !condensed && !island->structures.empty(); }
  bool event_driven() const { return !time_stepping && island->structures.empty(); }
  /// Blocks alone, and events are not located.
  bool time_stepped() const { return island->structures.empty() && time_stepping; }
  /// So many problems without a solution, or one that cost as much as a time step may: the island is
  /// time-stepped for the rest of the macro step.
  static constexpr int most_unsolved = 2;
  bool over_constrained() const { return unsolved >= most_unsolved; }

  /// No point of a rigid block is faster [m/s].
  double speed_of(int block) const {
    const auto k = static_cast<std::size_t>(block);
    return state.v[k].norm() + model.blocks[k].shape->radius * state.w[k].norm();
  }
  /// Of turning and straining [J].
  double internal_energy(int block) const {
    const dda::BlockEnergy e = dda::energy(model, state, block);
    return e.rotational + e.straining + e.strain_energy;
  }
  /// Normal speed that a condensed step may stop: a rebound of this speed stays below a tenth of the accuracy
  /// asked for [m/s].
  double gentle_speed() const;
};

/// What has seen the stop has done less than it would have: whatever it comes to from here on is void, and
/// the report says so.
inline bool stopped(const IslandContext& in, IslandReport& report) {
  return report.stopped =
             report.stopped || (in.stop != nullptr && in.stop->load(std::memory_order_relaxed) != 0);
}

}  // namespace talus::coupling

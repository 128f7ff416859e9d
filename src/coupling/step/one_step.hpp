/// One step for islands of rigid blocks with hard contact, of any number (docs/theory/one-step.md).
///
///   impacts         of no duration, over all touching rows, while one closes
///   smooth step     midpoint rule, rows of mean velocity at mid-step
///   end             velocities of what pressed are led along the contacts; that only takes energy
///   length          error e = max(t_c, H) H |a - (a_0 + a_1)/2|, a_0 and a_1 what the contacts allow at both ends
///   events          what comes down within the step ends it
///
/// Blocks that cannot meet within a time go on their own steps: groups are split, and halved in time where something happens in one of several clusters.
/// No position is ever corrected: a block moves by its velocities alone.
#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "coupling/island.hpp"
#include "coupling/step/rows.hpp"

namespace talus::coupling::step {

/// Bodies at one time, with what they touch there.
struct Moment {
  std::vector<Body> bodies;
  std::vector<std::vector<Touch>> touches;   // per pair, gap up to the touch band
  std::vector<double> least;                 // per pair: smallest gap of its touches, infinite without [m]
  std::vector<Row> rows;
  bool known = false;                        // the bodies' accelerations are those of this moment
};

class OneStep {
 public:
  OneStep(const dda::Model& model, dda::State& state, Environment& environment, ContactHistory& history, const StepSettings& settings);
  /// True if the island consists of what this step is made for: rigid blocks, hard laws, nothing that yields.
  static bool takes(const dda::Model& model, const Environment& environment, const ContactHistory& history, const Island& island);
  /// As IslandStepper::advance.
  IslandReport advance(const Island& island, double t, double duration, double first_step, const std::atomic<int>* stop = nullptr);

 private:
  struct Group {
    std::vector<int> blocks;
    std::vector<CandidatePair> pairs;
  };
  struct Trial {
    Moment end;
    std::vector<Row> rows;       // of the start, with their impulses
    Ledger work;
    double error = 0;            // over the bodies' tolerance
    double event = 0;            // time at which something comes down [s]; H: nothing
    int bad_pair = -1;
  };
  enum class Way { done, event, failed };

  bool stopped() { return report_.stopped = report_.stopped || (stop_ != nullptr && stop_->load(std::memory_order_relaxed) != 0); }
  // run.cpp
  bool run(const Group& group, double duration);
  std::vector<Group> split(const Group& group, double duration) const;
  bool near(const CandidatePair& pair, double reach) const;
  double reach(int block, double duration) const;
  Way go(const Group& group, double duration, bool alone);
  void measure();
  bool rests();
  // one_step.cpp
  Moment moment(const Group& group);
  void look(const Group& group, Moment& m) const;
  void make_rows(const Group& group, Moment& m) const;
  void slip(Moment& m) const;
  bool impacts(Moment& m);
  bool accelerations(Moment& m);
  bool smooth(const Moment& start, double h, Trial& trial);
  void lead_along(Trial& trial);
  void find_event(const Group& group, const Moment& start, double h, Trial& trial);
  double measure_error(const Moment& start, double h, const Trial& trial) const;
  void put(const Moment& m);
  double energy(const Moment& m) const;

  const dda::Model& model_;
  dda::State& state_;
  Environment& env_;
  ContactHistory& history_;
  const StepSettings& settings_;
  const Island* island_ = nullptr;
  const std::atomic<int>* stop_ = nullptr;
  Problems problems_;
  IslandReport report_;
  std::vector<int> local_;           // per block of the model: in the group at hand, -1 none
  std::vector<double> step_;         // per block of the model: what its last step suggests [s]
  struct Began { Vec3 c; Quat q; };
  std::vector<Began> began_;         // per block of the island
};

}  // namespace talus::coupling::step

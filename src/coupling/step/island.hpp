/// What is asked of one island of touching (or nearly touching) blocks, with the structures that it touches,
/// over a macro step, and what it reports.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "coupling/counters.hpp"
#include "coupling/motion/motion.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// How the blocks of an island go: in steps of their own, part by part between their meetings, or as a mass
/// too dear to locate its events, which is stepped after the others.
enum class Course : char { by_itself, in_turn, as_one };

struct Island {
  std::vector<int> blocks;            // with DOFs, ascending
  std::vector<CandidatePair> pairs;   // everything that may touch within the macro step, deterministic order
  std::vector<int> structures;        // indices into Environment::structures, deformable ones only
  std::vector<SurfacePair> surfaces;  // structures that may touch each other
  std::vector<char> watched;          // per block: it may come near blocks of other islands
  Course course = Course::by_itself;
  int place(int block) const {
    return static_cast<int>(std::ranges::lower_bound(blocks, block) - blocks.begin());
  }
};

/// A macro step, or a part of one. `end` is start + duration, to the bit that what goes on from there starts
/// with.
struct Stretch {
  double start = 0, duration = 0, end = 0;  // [s]
  static Stretch from(double start, double duration) { return {start, duration, start + duration}; }
  Stretch first_half() const { return from(start, 0.5 * duration); }
  Stretch second_half() const { return {first_half().end, duration - 0.5 * duration, end}; }
};

/// A part of a block's way over a macro step.
struct Leg {
  double t0 = 0, t1 = 0;   // [s]
  contact::Motion motion;  // from t0 to t1
};

struct StepSettings {
  double fixed_step = 0;        // [s]; 0: by accuracy
  double accuracy = 1e-3;       // relative to block size
  double min_step = 1e-9;       // [s]
  int exchanges_per_rise = 20;  // least number of exchanges with a structure while a spring's force rises
  int threads = 1;              // that one island may use; the result does not depend on it
  /// Longest step of an island that is time-stepped, (4 accuracy L / g)^(1/2): what falls by twice the
  /// accuracy's part of L [m] within it;
  /// without bound in no gravity. g in m/s^2 [s].
  double time_step(double length, double g) const {
    return fixed_step > 0 ? fixed_step : std::sqrt(accuracy * 4 * length / g);
  }
  static constexpr double dearer = 4;  // events may cost so many times what time stepping does
};

struct IslandReport {
  Ledger ledger;  // work of this macro step; `contact` unused
  Counters counters;
  std::vector<StructureContact> rows;  // contacts on structures, one per contact and step
  AuditSums audit;
  std::vector<MotionPeaks> peaks;      // of each block
  double kinetic_peak = 0;             // of all blocks together, at the starts and ends of steps [J]
  std::vector<IslandMotion> motions;   // over the steps that rows fall into; several: of its parts
  std::vector<std::vector<Leg>> ways;  // of each watched block, leg by leg; of others empty
  std::vector<double> went;   // of each block, farthest that a point of it may have come from where it began,
                              // at the ends of steps [m]
  double next_step = 0;       // suggested h for the next macro step [s]
  bool at_rest = false;       // a static certificate: v = 0 solves the last step exactly
  bool time_stepped = false;  // its events were not all located
  std::string failure;        // empty: done
  bool shorter = false;       // of a failure: a shorter macro step may do, from its start
  bool stopped = false;  // from outside, before the end: the island is not at the end of the macro step, nor
                         // at any of its steps
};

}  // namespace talus::coupling

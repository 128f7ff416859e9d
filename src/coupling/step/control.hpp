/// One step until it stands: solved, then shortened while its error, its energy or something met on the way
/// asks for it.
#pragma once
#include <optional>
#include <vector>

#include "coupling/search/contact_search.hpp"
#include "coupling/step/smooth_step.hpp"

namespace talus::coupling {

/// A step while it is tried: what is asked of it, and what the tries so far have taught.
struct Trial {
  double start = 0;      // [s]
  double remaining = 0;  // of the macro step [s]
  double h = 0;          // [s]
  double usual = 0;  // length by what may move, where all stand still and the step is the rest of the macro
                     // step [s]; else 0
  bool time_stepped = false;  // onsets are rows, not events
  bool closed = false;        // something touches at its start
  bool adaptive = false;      // event driven, its length by error control
  int passes = 1;
  int releases = 0, cuts = 0, halved = 0, refined = 0;
  int stopping = -1;  // touch whose sliding stops within the step
  bool stop_located = false;
  bool at_layer = false;  // ends where a block goes into vegetation or comes out of it
  double asked = 0;       // first length tried [s]
  double holds = 0,
         breaks = 0;  // lengths over which all bonds hold, over which one breaks; 0: none tried [s]
};

class StepControl {
 public:
  StepControl(IslandContext& in, Step& step, IslandReport& report, ContactSearch& search, SmoothStep& smooth,
              ProblemSolver& solver);
  /// What became of a step. `unsolved`: its events, located, have no solution, and it is taken back; `ended`:
  /// so has the run, the report says why.
  enum class Taken { yes, unsolved, ended };
  Taken take(Trial& trial);
  /// The state is another than that at the end of the last step.
  void forget_accelerations() { allowed_.reset(); }

 private:
  /// Not solved, or with too large an error: taken back, `trial` asks for a shorter step.
  bool refused(Trial& trial, const SmoothStep::Outcome& o);
  /// True if the step just solved was taken back for a shorter one, or for one with more rows.
  bool shortened(Trial& trial);
  /// What a time-stepped step met without a row: solved again with rows for it; else it ends short, and a row
  /// is there in the next one.
  bool resolve_crossings(Trial& trial);
  /// True if the step just computed was taken back for one that ends where a block comes to another drag.
  /// Beside a structure in explicit steps none is: they are short, and do not change their length.
  bool cut_at_layer(Trial& trial);
  /// A bond holds over the whole of the step in which it breaks: the step is cut so that it ends there, in
  /// time-stepped islands to within the time in which something falls by the accuracy's part of its size.
  bool cut_at_break(Trial& trial);
  /// What parts too slowly for a bounce, and is pressed by the solution, comes back within the step. The
  /// trapezoid would leave it open by half of its speed times the step: a step about as long as the bounce
  /// holds it where it is.
  bool cut_at_settling(Trial& trial);
  /// Sliding that stops within the step: the step is cut so that it ends there, else the trapezoid would
  /// slide on to its end.
  bool cut_at_stop(Trial& trial);
  bool may_shorten(const Trial& trial) const { return trial.h > 10 * in_.settings.min_step; }

  IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  ContactSearch& search_;
  SmoothStep& smooth_;
  ProblemSolver& solver_;
  std::optional<std::vector<Vec6>>
      allowed_;  // accelerations that the contacts allow at the start of the step, if known
};

}  // namespace talus::coupling

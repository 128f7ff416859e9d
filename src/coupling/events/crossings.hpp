/// What a time-stepped step meets that no row knows of, and what it would throw back.
#pragma once
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "coupling/events/step_motion.hpp"
#include "coupling/search/contact_search.hpp"

namespace talus::coupling {

/// What the rows of a time-stepped step left open.
struct Crossing {
  double first = 2;     // fraction of the step that may stand; above 1: all of it
  bool listed = false;  // something met is no row yet: the step is to be solved again with more of them
  std::vector<std::vector<Touch>>
      features;  // per pair with rows: others that were met, at the start of the step
};

/// Looks through the step just computed, once.
class CrossingSearch {
 public:
  CrossingSearch(const IslandContext& in, Step& step, const ContactSearch& search);
  Crossing find();

 private:
  struct Known {                                             // what the touches of a pair say
    std::size_t first = 0, count = 0;                        // their range
    double apart = std::numeric_limits<double>::infinity();  // least gap at the start [m]
    bool listed = false, any = false, open = false;
  };
  std::vector<Touch> unforeseen(std::size_t pair, std::span<const Touch> known) const;
  std::pair<double, double> meeting(std::size_t pair, const Known& known) const;

  const IslandContext& in_;
  Step& step_;
  const ContactSearch& search_;
  StepMotion motion_;
};

/// Time at which the first pair that is apart meets and is thrown back; h: none within it [s]. Bodies that
/// touch nothing fall, the others go on as they go: exact in flight, of what slides or turns on others met by
/// ever shorter steps.
double first_rebound(const IslandContext& in, Step& step, const ContactSearch& search, double h);

}  // namespace talus::coupling

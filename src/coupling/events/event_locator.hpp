/// Events within a step: onsets that end it.
#pragma once
#include "coupling/search/contact_search.hpp"
#include "coupling/step/smooth_step.hpp"

namespace talus::coupling {

class EventLocator {
 public:
  EventLocator(const IslandContext& in, Step& step, IslandReport& report, ContactSearch& search,
               SmoothStep& smooth);
  /// Shortens the step so that it ends at the first onset. Touches that were rows of this step are not
  /// onsets; what they cross is drift and is projected. False: no solution at an end tried, the state is of
  /// no use.
  bool locate(double& h, int passes);

 private:
  double first_impact() const;  // fraction of the step, above 1: none

  const IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  ContactSearch& search_;
  SmoothStep& smooth_;
};

}  // namespace talus::coupling

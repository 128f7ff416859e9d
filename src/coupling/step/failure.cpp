// Why an island cannot go on.
#include "coupling/step/failure.hpp"

#include <fmt/format.h>

#include "coupling/name_contacts.hpp"

namespace talus::coupling {

void fail_at_smallest_step(const IslandContext& in, const Step& step, IslandReport& report) {
  report.failure = fmt::format(
      "the contact problem could not be solved at the smallest step (residual {:.2g} of the speeds there, {} "
      "contacts: {})",
      step.solution.residual, step.problem.contacts.size(), name_contacts(in.model, step.touches));
}

void fail_at_drift(const IslandContext& in, const Step& step, IslandReport& report) {
  report.failure = fmt::format(
      "the correction of overlaps would move a block farther than its motion in the step explains, down to "
      "the smallest step ({} contacts: {})",
      step.touches.size(), name_contacts(in.model, step.touches));
}

}  // namespace talus::coupling

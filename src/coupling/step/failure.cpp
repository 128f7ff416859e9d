// Why an island cannot go on.
#include "coupling/step/failure.hpp"

#include <fmt/format.h>

#include "coupling/touch/name_contacts.hpp"

namespace talus::coupling {

void fail_at_smallest_step(const IslandContext& in, const Step& step, IslandReport& report) {
  report.failure = fmt::format(
      "the contact problem could not be solved at the smallest step (residual {:.2g} of the speeds there, {} "
      "contacts: {})",
      step.solution.residual, step.problem.contacts.size(), name_contacts(in.model, step.touches));
}

void fail_at_drift(const IslandContext& in, IslandReport& report, const DriftGuard::Worst& worst) {
  report.failure = fmt::format(
      "the correction of overlaps would move block {} by {:.2g} m, where its motion in the step explains "
      "{:.2g} "
      "m, down to the smallest step",
      in.model.blocks[static_cast<std::size_t>(worst.block)].name, worst.way, worst.explained);
}

}  // namespace talus::coupling

/// Impulses of no duration on structures, as the rows that a report has of them.
#pragma once
#include <utility>
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// The block at the start of the step, before what the step solves.
Arrival arrival_of(const dda::Model& model, const Step& step, int block);

class StructureImpacts {
 public:
  void clear() { pending_.clear(); }
  /// Those that the solution just applied has given.
  void note(const dda::Model& model, const Step& step, double time);
  /// Impulses of no duration, each as the mean since it was: over the step that it began, unless that is a
  /// sliver that ends at once, with the macro step or at the next impact. Then over no less than a tenth of
  /// what is usual. `usual_step`: the fixed step, or as long as the macro step, which began at `start` [s].
  /// On a structure of scheme "one-way", whose load they are, each acts over one explicit sub-step of that
  /// structure, whatever the step and the macro step are.
  void report(const Environment& env, double t_end, double start, double duration, double usual_step,
              std::vector<StructureContact>& rows);
  const std::vector<StructureContact>& pending() const { return pending_; }
  void restore(std::vector<StructureContact> pending) { pending_ = std::move(pending); }

 private:
  std::vector<StructureContact> pending_;  // `force` is the impulse [N s], `time` when it was
};

}  // namespace talus::coupling

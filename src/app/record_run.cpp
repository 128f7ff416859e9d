#include "app/record_run.hpp"

#include "app/run_checkpoint.hpp"
#include "core/memory.hpp"

namespace talus::app {

namespace {

void log_end(JsonLog& log, const sim::RunResult& result, double time) {
  const sim::RunCounters& n = result.counters;
  log.info("end", {{"status", result.status},
                   {"message", result.message},
                   {"t", time},
                   {"steps", n.steps},
                   {"rejected", n.rejected},
                   {"structure_steps", n.structure_steps},
                   {"condensed_steps", n.condensed_steps},
                   {"asleep_skipped", n.asleep_skipped},
                   {"flight_closed_form", n.flight_closed_form},
                   {"structure_asleep", n.structure_asleep},
                   {"convex", n.convex},
                   {"worst_residual", n.worst_residual},
                   {"cpu_seconds", n.cpu_seconds}});
}

io::Outcome outcome_of(const sim::RunResult& result) {
  io::Outcome outcome;
  outcome.status = result.status;
  outcome.message = result.message;
  outcome.counters = result.counters;
  outcome.audit = result.audit;
  outcome.audit_made = result.audit_made;
  return outcome;
}

}  // namespace

RecordedRun record_run(sim::Simulation& simulation, io::Recorder& recorder, sim::Sink& sink,
                       const std::atomic<int>* stop, const std::function<void()>& stepped) {
  RecordedRun run;
  run.result = simulation.run(sink, stop);
  if (stepped) stepped();
  give_back_memory();
  const bool ended = io::has_ended(run.result.status);
  const sim::FinalState final_state = ended ? simulation.final_state() : sim::FinalState{};
  run.summary = recorder.finish(outcome_of(run.result), ended ? &final_state : nullptr);
  log_end(recorder.log(), run.result, simulation.time());
  // A run that has ended has nothing to go on with; an old checkpoint would only mislead.
  if (ended) {
    std::error_code ignored;
    std::filesystem::remove(recorder.directory() / checkpoint_name, ignored);
  }
  return run;
}

}  // namespace talus::app

/// From the first step to the files: the part of a run that the command line and Python share.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "io/recorder.hpp"
#include "sim/simulation.hpp"

namespace talus::app {

struct RecordedRun {
  sim::RunResult result;
  std::string summary;  // the text of summary.json
};

/// Runs to the end or until `stop` becomes non-zero, and writes results, final state and summary. `stepped`
/// is called between the last step and the files. `sink` records into `recorder`. Throws InputError,
/// io::WriteError.
RecordedRun record_run(sim::Simulation& simulation, io::Recorder& recorder, sim::Sink& sink,
                       const std::atomic<int>* stop, const std::function<void()>& stepped = {});

}  // namespace talus::app

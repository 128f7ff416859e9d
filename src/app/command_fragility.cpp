// talus fragility, talus compare, talus calibrate: what is made of ensembles.
#include <algorithm>
#include <filesystem>
#include <thread>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/ensemble_progress.hpp"
#include "app/signals.hpp"
#include "app/tell.hpp"
#include "core/units.hpp"
#include "ensemble/calibrate.hpp"
#include "ensemble/compare.hpp"
#include "ensemble/fragility/fragility.hpp"
#include "ensemble/report.hpp"
#include "ensemble/results.hpp"
#include "io/files.hpp"

namespace talus::app {

namespace fs = std::filesystem;

namespace {

int threads_of(const Options& options) {
  return options.threads > 0 ? options.threads
                             : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Seconds of "--window".
double window_of(const std::string& text) {
  std::string error;
  const auto quantity = parse_quantity(text, error);
  if (quantity && quantity->value > 0 &&
      (quantity->dimension.none() || quantity->dimension == dimension::time))
    return quantity->value;
  throw InputError(Problem{.severity = Problem::Severity::error,
                           .file = {},
                           .line = 0,
                           .column = 0,
                           .key = "--window",
                           .value = text,
                           .rule = "must be a time > 0",
                           .remedy = "write for example --window \"0.5 s\""});
}

}  // namespace

int command_fragility(const Options& options) {
  const fs::path directory = options.input;
  ensemble::require_finished(directory);
  const io::DirectoryLock lock(directory);
  EnsembleProgress progress("run");
  ensemble::FragilityRequest request;
  request.directory = directory;
  request.structure = options.structure;
  request.runs = options.runs;
  request.window = window_of(options.window);
  request.threads = threads_of(options);
  request.capacity = options.capacity;
  request.progress = [&](const ensemble::Progress& p) { progress.show(p); };
  request.tell = [](const std::string& line) { tell("{}\n", line); };
  request.stop = &stop_signal();
  on_stop(OnStop::ask);
  const ensemble::FragilityResult result = ensemble::write_fragility(request);
  progress.clear();
  fmt::print("{} of {} coupled runs done, {} failed\n", result.done, result.asked, result.failed);
  for (const std::string& line : result.lines) fmt::print("{}\n", line);
  const ensemble::Ensemble ensemble((directory / "scene.toml").string(), {});
  fmt::print("Report: {}\nResults: {}\n", ensemble::write_report(ensemble, directory).string(),
             (directory / "fragility.json").string());
  if (stop_signal().load() != 0) {
    fmt::print(
        "Interrupted; the figures are of the runs that are done: the same command makes the others.\n");
    return 128 + stop_signal().load();
  }
  return result.done > 0 ? done : numerical_failure;
}

int command_compare(const Options& options) {
  std::vector<fs::path> directories(options.words.begin(), options.words.end());
  const fs::path output = options.output.empty() ? fs::path("results") / "compare" : fs::path(options.output);
  io::check_directory(output);
  const std::vector<std::string> lines = ensemble::write_comparison(directories, output);
  io::write_file(output / io::marker_name,
                 "Results of Talus. A directory with this file may be overwritten by the next run.\n");
  for (const std::string& line : lines) fmt::print("{}\n", line);
  fmt::print("Results: {}\n", (output / "compare.json").string());
  return done;
}

int command_calibrate(const Options& options) {
  EnsembleProgress progress("candidate");
  ensemble::CalibrationRequest request;
  request.scene = options.input;
  request.overrides = options.scene_overrides();
  request.measured = options.measured;
  request.directory = options.output;
  for (const std::string& text : options.vary) request.parameters.push_back(ensemble::parse_parameter(text));
  request.candidates = options.candidates;
  request.threads = threads_of(options);
  request.progress = [&](const ensemble::Progress& p) { progress.show(p); };
  request.stop = &stop_signal();
  ensemble::check(request);
  const io::DirectoryLock lock = io::claim_directory(options.output, io::Results::other);
  on_stop(OnStop::ask);
  const std::vector<std::string> lines = ensemble::calibrate(request);
  progress.clear();
  for (const std::string& line : lines) fmt::print("{}\n", line);
  if (!lines.empty()) fmt::print("Results: {}\n", (fs::path(options.output) / "calibration.json").string());
  if (stop_signal().load() == 0) return done;
  fmt::print("Interrupted; {}: the same command begins anew.\n",
             lines.empty() ? "no candidate was finished and no result written"
                           : "the figures are of the candidates that were finished");
  return 128 + stop_signal().load();
}

}  // namespace talus::app

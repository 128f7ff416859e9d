// talus run: reads, builds, steps, records.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/progress.hpp"
#include "app/record_run.hpp"
#include "app/run_checkpoint.hpp"
#include "app/scene_hash.hpp"
#include "app/signals.hpp"
#include "app/tell.hpp"
#include "app/together.hpp"
#include "core/ranks.hpp"
#include "ensemble/path.hpp"
#include "io/final_state.hpp"
#include "io/hdf5_file.hpp"
#include "io/recorder.hpp"
#include "io/report.hpp"
#include "sim/ground.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::app {

namespace fs = std::filesystem;

namespace {

/// What a scheme other than two-way leaves out, by the run's own numbers; empty for two-way.
std::string left_out(const scene::Scene& scene, const sim::RunResult& result) {
  using Scheme = scene::Coupling::Scheme;
  const Scheme scheme = scene.coupling.scheme;
  const char* both_ways = scene.simulation.method == scene::Simulation::Method::talus
                              ? "scheme = \"two-way\""
                              : "method \"talus\", scheme = \"two-way\"";
  if (scheme == Scheme::two_way) return {};
  if (scheme == Scheme::rigid)
    return fmt::format(
        "Scheme rigid: the structures took no energy and did not deform; {} shows how "
        "much that matters.",
        both_ways);
  return fmt::format(
      "Scheme one-way: {:.4g} J of work on the structures were taken from no block; in one system ({}) they "
      "slow the blocks' rebound and the loads themselves.",
      result.audit.work_on_structure, both_ways);
}

void print_result(const sim::RunResult& result, const fs::path& directory, double time, std::size_t gone,
                  std::optional<double> resumed_at, const std::string& left_out,
                  const std::vector<std::string>& headline) {
  const sim::RunCounters& n = result.counters;
  const std::string status = result.status == "all left" ? "every block has left the model" : result.status;
  fmt::print(
      "{}{} at t = {:.6g} s: {} steps ({} rejected), {} contacts, {:.3g} s CPU{}\n", status,
      gone == 0 ? "" : fmt::format(" (but for {} block{} that left the model)", gone, gone == 1 ? "" : "s"),
      time, n.steps, n.rejected, n.contacts, n.cpu_seconds,
      resumed_at ? fmt::format(" since it went on at t = {:.6g} s", *resumed_at) : "");
  if (result.audit_made && !left_out.empty())  // no balances of steps
    fmt::print("Interface audit: recorded against applied impulse {:.2g}\n", result.audit.impulse_defect);
  else if (result.audit_made)
    fmt::print(
        "Interface audit: force balance {:.2g}, moment balance {:.2g}, impulse defect {:.2g}, work on blocks "
        "{:.6g} J, on structures {:.6g} J\n",
        result.audit.worst_force_imbalance, result.audit.worst_moment_imbalance, result.audit.impulse_defect,
        result.audit.work_on_blocks, result.audit.work_on_structure);
  if (!left_out.empty()) fmt::print("{}\n", left_out);
  if (!result.message.empty()) fmt::print("{}\n", result.message);
  for (const std::string& line : headline) fmt::print("{}\n", line);
  fmt::print("Results: {}\n", directory.string());
}

}  // namespace

std::string output_directory(const Options& options) {
  if (!options.output.empty()) return options.output;
  std::string stem = fs::path(options.input).stem().string();
  const std::string ending = ".resolved";
  if (stem.size() > ending.size() && stem.compare(stem.size() - ending.size(), ending.size(), ending) == 0)
    stem.resize(stem.size() - ending.size());
  return (fs::path("results") / stem).string();
}

namespace {

/// `--resume` of a run that has come to its end: says so, tidies up after a kill just after the end. Returns
/// the exit code.
int nothing_to_resume(const fs::path& directory, const std::string& message, bool report) {
  try {
    io::Hdf5File::open(directory / "results.h5");
  } catch (const InputError&) {
    throw io::bad_file(directory / "results.h5", "--resume",
                       "the run has finished, but its results are missing or damaged",
                       "run the scene again without --resume");
  }
  fmt::print("The run in {} has finished: there is nothing to go on with.\n{}{}", directory.string(), message,
             message.empty() ? "" : "\n");
  const int code =
      message.empty() ? done : fell_short;  // the message of a run that ended is that of its audit
  wait_for_all();
  if (!writes_files()) return code;
  for (const char* left : {checkpoint_name, "journal.bin"}) fs::remove(directory / left);
  if (report && !fs::exists(directory / "report.html"))
    fmt::print("Report: {}\n", io::write_report(directory).string());
  return code;
}

/// Restores the simulation from the directory's checkpoint and returns where the journal stood; nothing if
/// the run had none yet.
std::optional<std::uint64_t> resume_from(const fs::path& directory, const std::string& hash,
                                         sim::Simulation& simulation) {
  if (const fs::path file = directory / checkpoint_name; fs::exists(file)) {
    const StoredRun stored = load_run(file, hash);
    simulation.restore(stored.state);
    return stored.journal_position;
  }
  if (!fs::exists(directory / io::marker_name))
    throw io::bad_file(directory, "--resume", "there is no run to go on with",
                       "leave --resume out to start one, or name its directory with -o");
  tell("No checkpoint yet in {}: starting from t = 0.\n", directory.string());
  return {};
}

void warn_of_departed(JsonLog& log, const std::vector<std::string>& gone) {
  if (gone.empty()) return;
  constexpr std::size_t shown = 5;
  const std::string text = fmt::format(
      "{} of the blocks fell past all that could hold them and left the model ({}{}); a larger terrain, or "
      "site.widen, would show where they stop.",
      gone.size(),
      fmt::join(gone.begin(), gone.begin() + static_cast<std::ptrdiff_t>(std::min(gone.size(), shown)), ", "),
      gone.size() > shown ? ", ..." : "");
  log.warning("departed", {{"text", text}});
  fmt::print("{}\n", text);
}

}  // namespace

void carry_over(sim::Simulation& simulation, bool blocks) {
  const std::string& previous = simulation.scene().simulation.initial_state;
  if (previous.empty()) return;
  sim::FinalState state = io::read_final_state(previous);
  if (!blocks) state.blocks.clear();
  simulation.start_from(state, previous);
}

ensemble::GroundHeight ground_under(sim::Simulation& simulation) {
  return [&world = simulation.world()](double x, double y) {
    const coupling::Environment& env = world.system->environment();
    return sim::uppermost_ground(env.terrain.get(), env.planes, x, y);
  };
}

std::vector<ensemble::PlanLine> lines_of(sim::Simulation& simulation) {
  std::vector<Problem> problems;
  std::vector<ensemble::PlanLine> lines = ensemble::checked_lines(simulation, problems);
  for (const Problem& p : problems) tell("{}\n", p.str());
  if (!lines.empty() && simulation.scene().site && simulation.header().crs.empty())
    tell("{}\n", Problem{.severity = Problem::Severity::warning,
                         .file = simulation.scene().file,
                         .line = 0,
                         .column = 0,
                         .key = "site.crs",
                         .value = {},
                         .rule = "is not known: lines carry no coordinate reference system",
                         .remedy = "add for example crs = \"EPSG:31254\" to [site]"}
                     .str());
  return lines;
}

int run_scene(scene::Scene scene, const Options& options, bool carry_blocks) {
  on_stop(OnStop::end_unwritten);
  const fs::path directory = output_directory(options);
  io::check_directory(directory, io::Results::run);
  std::vector<fs::path> inputs;
  for (const auto& [path, hash] : scene.files) inputs.emplace_back(path);
  io::spare_inputs(directory, inputs);
  const std::string resolved = scene.resolved_json;
  const std::string hash = scene_hash(resolved);
  const std::string scene_file = scene.file;
  const bool report = scene.output.report;
  if (ranks() != nullptr)
    scene.simulation.threads = 1;    // structures on two threads would not call the other ranks in one order
  std::vector<std::string> reports;  // of the build, before there is a log
  io::Recorder* sink_log = nullptr;
  BuildProgress progress;
  sim::Simulation simulation(std::move(scene), [&](const std::string& line) {
    progress.show(line);
    if (sink_log)
      sink_log->log().info("report", {{"text", line}});
    else
      reports.push_back(line);
  });
  const std::vector<Problem> warnings = simulation.warnings();
  for (const Problem& warning : warnings) tell("{}\n", warning.str());
  const std::vector<ensemble::PlanLine> lines = lines_of(simulation);
  carry_over(simulation, carry_blocks);
  std::optional<std::uint64_t> position;  // of the journal, where a run goes on
  if (options.resume) {
    require_same_scene(directory, hash);
    if (const auto message = finished(directory)) return nothing_to_resume(directory, *message, report);
    position = resume_from(directory, hash, simulation);
  }
  const std::optional<double> resumed_at = position ? std::optional(simulation.time()) : std::nullopt;

  const std::vector<std::string> plan =
      simulation.plan();               // by all ranks: loads on supports are sums over them
  on_stop(OnStop::ask_with_patience);  // from here on something is written
  wait_for_all();                      // nobody reads any more what is written now
  const bool writes = writes_files();
  std::optional<io::Recorder> recorder;
  if (writes) {
    const io::RecorderOptions recording{directory, scene_file, resolved, true};
    if (position)
      recorder.emplace(recording, *position);
    else
      recorder.emplace(recording, simulation.header());
    sink_log = &*recorder;
    JsonLog& log = recorder->log();
    log.info(position ? "resume" : "start",
             {{"version", std::string(TALUS_VERSION)}, {"scene", scene_file}, {"t", simulation.time()}});
    for (const Problem& warning : warnings) log.warning("scene", {{"text", warning.str()}});
    for (const std::string& line : plan) log.info("plan", {{"text", line}});
    for (const std::string& line : reports) log.info("report", {{"text", line}});
  }
  if (!position)
    for (const std::string& line : plan) fmt::print("  {}\n", line);
  else
    fmt::print("Going on at t = {:.6g} s.\n", simulation.time());
  std::fflush(stdout);

  // On every rank: what is made again for a crossing takes all of them.
  std::optional<ensemble::Path> crossed;
  if (!lines.empty()) {
    const scene::Scene& s = simulation.scene();
    crossed.emplace(simulation, lines, ground_under(simulation), s.site ? s.site->origin : Vec3::Zero(), 0);
    crossed->after = [&] {
      std::vector<io::LineRow> rows;
      for (const ensemble::Crossing& c : crossed->take_crossings())
        rows.push_back({c.line, c.block, c.time, c.position, c.velocity, c.spin, c.translational,
                        c.rotational, c.height});
      if (recorder) recorder->crossings(rows);
    };
    std::vector<std::string> names;
    for (const ensemble::PlanLine& line : lines) names.push_back(line.name);
    if (recorder && !position) recorder->lines(names);
  }
  if (!writes) {
    sim::Sink silent;
    const sim::RunResult result = simulation.run(silent, &stop_signal());
    on_stop(OnStop::ask);  // from here on it comes to its end by itself
    if (io::has_ended(result.status)) simulation.final_state();
    return result.exit_code;
  }
  RecordingSink sink(*recorder, hash);
  const auto [result, summary] = record_run(simulation, *recorder, sink, &stop_signal(), [&] {
    sink.end_line();
    on_stop(OnStop::ask);  // from here on it comes to its end by itself
  });
  print_result(result, directory, simulation.time(),
               result.status == "at rest" ? simulation.departed().size() : 0, resumed_at,
               simulation.header().structures.empty() ? std::string() : left_out(simulation.scene(), result),
               io::summary_headline(summary));
  for (const std::string& text : io::summary_warnings(summary)) {
    if (const auto& told = recorder->warnings(); std::find(told.begin(), told.end(), text) != told.end())
      continue;  // at the start, or as it happened
    recorder->log().warning("summary", {{"text", text}});
    tell("warning: {}\n", text);
  }
  warn_of_departed(recorder->log(), simulation.departed());
  if (report && result.exit_code == 128 + SIGTERM)  // whoever sent it waits for the end
    fmt::print("No report was written: talus report {} makes it.\n", directory.string());
  else if (report)
    fmt::print("Report: {}\n", io::write_report(directory).string());
  return result.exit_code;
}

int command_run(const Options& options) {
  return run_scene(scene::read_scene(options.input, options.overrides()), options);
}

}  // namespace talus::app

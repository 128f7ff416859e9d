// talus run: reads, builds, steps, records.
#include <csignal>
#include <filesystem>
#include <optional>

#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/final_state.hpp"
#include "app/progress.hpp"
#include "app/together.hpp"
#include "core/ranks.hpp"
#include "io/checkpoint.hpp"
#include "io/final_state.hpp"
#include "io/recorder.hpp"
#include "io/report.hpp"
#include "sim/simulation.hpp"

namespace talus::app {

namespace fs = std::filesystem;

namespace {

std::atomic<int> stop_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void on_signal(int number) {
  stop_signal.store(number);
  // A second SIGINT, from the keyboard, ends the program at once. `timeout` and service managers send SIGTERM twice and mean one.
  if (number == SIGINT) std::signal(number, SIG_DFL);
}

/// Before the first step there is nothing to save: the exit code is told at once.
extern "C" void on_early_signal(int number) {
  constexpr char text[] = "talus: interrupted before the first step; nothing was written\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, sizeof text - 1);
  ::_exit(128 + number);
}

void on_signals(void (*action)(int)) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, action);
}

constexpr const char* checkpoint_name = "checkpoint.h5";
constexpr const char* journal_position = "recorder.journal_position";
constexpr const char* fragment_names = "recorder.fragment_names";

/// Names as whole numbers, byte by byte, since a checkpoint holds nothing else.
std::vector<std::int64_t> packed(const std::vector<std::string>& names) {
  std::vector<std::int64_t> out;
  for (const std::string& name : names) {
    for (const char c : name) out.push_back(static_cast<unsigned char>(c));
    out.push_back(0);
  }
  return out;
}

std::vector<std::string> unpacked(const std::vector<std::int64_t>& bytes) {
  std::vector<std::string> names;
  std::string name;
  for (const std::int64_t c : bytes) {
    if (c != 0) {
      name += static_cast<char>(c);
      continue;
    }
    names.push_back(name);
    name.clear();
  }
  return names;
}

class RecordingSink : public sim::Sink {
 public:
  RecordingSink(io::Recorder& recorder, std::string hash) : recorder_(recorder), hash_(std::move(hash)) {}

  void history(const sim::HistoryRow& row) override { recorder_.history(row); }
  void contacts(std::span<const sim::ContactRow> rows) override { recorder_.contacts(rows); }
  void field(double time, std::span<const Pose> poses, std::span<const Structure::Snapshot> structures) override { recorder_.field(time, poses, structures); }
  void extend(std::span<const sim::RunHeader::BlockInfo> fragments) override {
    recorder_.extend(fragments);
    for (const auto& fragment : fragments) recorder_.log().info("fragment", {{"name", fragment.name}, {"mass", fragment.mass}});
  }
  void checkpoint(const sim::Checkpoint& state) override {
    io::Checkpoint out;
    out.scene_hash = hash_;
    out.version = TALUS_VERSION;
    out.numbers = state.numbers;
    out.integers = state.integers;
    out.integers[fragment_names] = packed(state.fragment_names);
    out.integers[journal_position] = {static_cast<std::int64_t>(recorder_.checkpoint())};
    io::save_checkpoint(recorder_.directory() / checkpoint_name, out);
    recorder_.log().info("checkpoint");
  }
  void progress(double time, double duration, const sim::RunCounters& counters, double residual) override { line_.show(time, duration, counters, residual); }
  void end_line() { line_.clear(); }

 private:
  io::Recorder& recorder_;
  std::string hash_;
  ProgressLine line_;
};

void print_result(const sim::RunResult& result, const fs::path& directory, double time) {
  const sim::RunCounters& n = result.counters;
  fmt::print("{} at t = {:.6g} s: {} steps ({} rejected), {} contacts, {:.3g} s CPU\n", result.status, time, n.steps, n.rejected, n.contacts, n.cpu_seconds);
  if (result.audit_made)
    fmt::print("Interface audit: force balance {:.2g}, moment balance {:.2g}, impulse against momentum {:.2g}, work on blocks {:.6g} J, on structures {:.6g} J\n",
               result.audit.worst_force_imbalance, result.audit.worst_moment_imbalance, result.audit.impulse_defect, result.audit.work_on_blocks, result.audit.work_on_structure);
  if (!result.message.empty()) fmt::print("{}\n", result.message);
  fmt::print("Results: {}\n", directory.string());
}

/// Refuses to go on in a directory that another scene wrote.
void require_same_scene(const fs::path& directory, const std::string& hash) {
  const fs::path file = directory / "scene.resolved.json";
  if (fs::exists(file) && scene_hash(io::read_file(file)) != hash)
    throw io::bad_file(file, "--resume", "the directory holds a run of another scene, or of this one with other values",
                       "resume with the scene and the --set that it was started with, or leave --resume out to start anew");
}

/// The message of the directory's run if it came to its end; summary.json is the last thing that a run swaps in.
std::optional<std::string> finished(const fs::path& directory) {
  const fs::path file = directory / "summary.json";
  if (!fs::exists(file) || !fs::exists(directory / "scene.resolved.json")) return {};
  const auto summary = nlohmann::json::parse(io::read_file(file), nullptr, false);
  const auto text = [&](const char* key) { return summary.is_object() && summary.contains(key) && summary[key].is_string() ? summary[key].get<std::string>() : std::string(); };
  if (const std::string status = text("status"); status != "done" && status != "at rest") return {};
  return text("message");
}

}  // namespace

std::string output_directory(const Options& options) {
  if (!options.output.empty()) return options.output;
  std::string stem = fs::path(options.input).stem().string();
  const std::string ending = ".resolved";
  if (stem.size() > ending.size() && stem.compare(stem.size() - ending.size(), ending.size(), ending) == 0) stem.resize(stem.size() - ending.size());
  return (fs::path("results") / stem).string();
}

int run_scene(scene::Scene scene, const Options& options, bool carry_blocks) {
  on_signals(on_early_signal);
  const fs::path directory = output_directory(options);
  io::check_directory(directory);
  const std::string resolved = scene.resolved_json;
  const std::string hash = scene_hash(resolved);
  const std::string scene_file = scene.file;
  const bool report = scene.output.report;
  if (ranks() != nullptr) scene.simulation.threads = 1;   // structures on two threads would not call the other ranks in one order
  std::vector<std::string> reports;   // of the build, before there is a log
  io::Recorder* sink_log = nullptr;
  sim::Simulation simulation(std::move(scene), [&](const std::string& line) {
    if (sink_log) sink_log->log().info("report", {{"text", line}});
    else reports.push_back(line);
  });
  const std::vector<Problem>& warnings = simulation.scene().warnings;   // of the scene, and of what was built from it
  for (const Problem& warning : warnings) fmt::print(stderr, "{}\n", warning.str());
  if (const std::string& previous = simulation.scene().simulation.initial_state; !previous.empty()) {
    sim::FinalState state = io::read_final_state(previous);
    if (!carry_blocks) state.blocks.clear();
    simulation.start_from(state, previous);
  }

  std::uint64_t position = 0;
  bool resumed = false;
  if (options.resume) {
    const fs::path file = directory / checkpoint_name;
    require_same_scene(directory, hash);
    if (const auto end = finished(directory)) {
      fmt::print("The run in {} has finished: there is nothing to go on with.\n{}{}", directory.string(), *end, end->empty() ? "" : "\n");
      wait_for_all();
      if (!writes_files()) return end->empty() ? done : fell_short;
      for (const char* left : {checkpoint_name, "journal.bin"}) fs::remove(directory / left);   // of a kill just after the end
      if (report && !fs::exists(directory / "report.html")) fmt::print("Report: {}\n", io::write_report(directory).string());
      return end->empty() ? done : fell_short;   // the message of a run that ended is that of its audit
    }
    if (fs::exists(file)) {
      const io::Checkpoint stored = io::load_checkpoint(file, hash, TALUS_VERSION);
      sim::Checkpoint state;
      state.numbers = stored.numbers;
      state.integers = stored.integers;
      const auto names = state.integers.find(fragment_names), journal = state.integers.find(journal_position);
      if (names == state.integers.end() || journal == state.integers.end() || journal->second.size() != 1)
        throw io::bad_file(file, "checkpoint", "lacks the recorder's part", "run from the start, without --resume");
      state.fragment_names = unpacked(names->second);
      position = static_cast<std::uint64_t>(journal->second[0]);
      state.integers.erase(fragment_names);
      state.integers.erase(journal_position);
      simulation.restore(state);
      resumed = true;
    } else if (!fs::exists(directory / io::marker_name)) {
      throw io::bad_file(directory, "--resume", "there is no run to go on with", "leave --resume out to start one, or name its directory with -o");
    } else {
      fmt::print(stderr, "No checkpoint yet in {}: starting from t = 0.\n", directory.string());
    }
  }

  on_signals(on_signal);   // from here on something is written
  wait_for_all();   // nobody reads any more what is written now
  const bool writes = writes_files();
  std::optional<io::Recorder> recorder;
  if (writes) {
    const io::RecorderOptions recording{directory, scene_file, resolved, true};
    if (resumed) recorder.emplace(recording, position);
    else recorder.emplace(recording, simulation.header());
    sink_log = &*recorder;
    JsonLog& log = recorder->log();
    log.info(resumed ? "resume" : "start", {{"version", std::string(TALUS_VERSION)}, {"scene", scene_file}, {"t", simulation.time()}});
    for (const Problem& warning : warnings) log.warning("scene", {{"text", warning.str()}});
    for (const std::string& line : simulation.plan()) log.info("plan", {{"text", line}});
    for (const std::string& line : reports) log.info("report", {{"text", line}});
  }
  if (!resumed)
    for (const std::string& line : simulation.plan()) fmt::print("  {}\n", line);
  else fmt::print("Going on at t = {:.6g} s.\n", simulation.time());
  std::fflush(stdout);

  sim::RunResult result;
  if (writes) {
    RecordingSink sink(*recorder, hash);
    result = simulation.run(sink, &stop_signal);
    sink.end_line();
  } else {
    sim::Sink silent;
    result = simulation.run(silent, &stop_signal);
  }
  const bool ended = result.status == "done" || result.status == "at rest";
  const sim::Checkpoint last = simulation.save();
  const sim::FinalState final_state = ended ? simulation.final_state() : sim::FinalState{};
  if (!writes) return result.exit_code;
  save_final_state(directory, last, simulation.time(), hash);
  io::Outcome outcome;
  outcome.status = result.status;
  outcome.message = result.message;
  outcome.counters = result.counters;
  outcome.audit = result.audit;
  outcome.audit_made = result.audit_made;
  const std::string summary = recorder->finish(outcome, ended ? &final_state : nullptr);
  const sim::RunCounters& n = result.counters;
  recorder->log().info("end", {{"status", result.status}, {"message", result.message}, {"t", simulation.time()}, {"steps", n.steps}, {"rejected", n.rejected},
                               {"structure_steps", n.structure_steps}, {"condensed_steps", n.condensed_steps}, {"asleep_skipped", n.asleep_skipped}, {"flight_closed_form", n.flight_closed_form},
                               {"structure_asleep", n.structure_asleep}, {"tier_e", n.tier_e}, {"worst_residual", n.worst_residual}, {"cpu_seconds", n.cpu_seconds}});
  // A run that has ended has nothing to go on with; an old checkpoint would only mislead.
  if (ended) {
    std::error_code ignored;
    fs::remove(directory / checkpoint_name, ignored);
  }
  print_result(result, directory, simulation.time());
  for (const std::string& text : io::summary_warnings(summary)) {
    recorder->log().warning("summary", {{"text", text}});
    fmt::print(stderr, "warning: {}\n", text);
  }
  if (const std::vector<std::string> gone = simulation.departed(); !gone.empty()) {
    const std::string text = fmt::format("{} of the blocks fell past all that could hold them and left the model ({}{}); a larger terrain, or site.widen, would show where they stop.", gone.size(),
                                         fmt::join(gone.begin(), gone.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(gone.size(), 5)), ", "), gone.size() > 5 ? ", ..." : "");
    recorder->log().warning("departed", {{"text", text}});
    fmt::print("{}\n", text);
  }
  if (report && result.exit_code == 128 + SIGTERM)   // whoever sent it waits for the end
    fmt::print("No report was written: talus report {} makes it.\n", directory.string());
  else if (report) fmt::print("Report: {}\n", io::write_report(directory).string());
  return result.exit_code;
}

int command_run(const Options& options) { return run_scene(scene::read_scene(options.input, options.overrides()), options); }

}  // namespace talus::app

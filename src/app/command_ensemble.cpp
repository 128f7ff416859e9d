// talus ensemble: many members of one scene.
#include <csignal>
#include <filesystem>
#include <thread>

#include <unistd.h>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/ensemble_progress.hpp"
#include "app/signals.hpp"
#include "app/tell.hpp"
#include "app/together.hpp"
#include "core/ranks.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/maps.hpp"
#include "ensemble/report.hpp"
#include "ensemble/results.hpp"
#include "ensemble/statistics.hpp"
#include "io/files.hpp"

namespace talus::app {

namespace fs = std::filesystem;

namespace {

void print_summary(const ensemble::Summary& s, const fs::path& directory) {
  fmt::print("{} members: {} done, {} suspect, {} over the limit, {} failed; {:.4g} s CPU\n", s.asked, s.done,
             s.suspect, s.over_limit, s.failed, s.cpu);
  for (const ensemble::LineSummary& line : s.lines) {
    if (s.done + s.suspect == 0) continue;  // nothing is known of it
    fmt::print("line {}: crossed by {} of {} members, probability {:.3g} ({:.3g} to {:.3g}) per event\n",
               line.name, line.members, s.done + s.suspect, line.probability.value, line.probability.low,
               line.probability.high);
    if (line.crossings == 0) continue;
    const auto& energy = line.percentiles[0][2];
    const auto& height = line.percentiles[2][2];
    fmt::print("  95th percentile: energy {:.4g} kJ ({}), height {:.3g} m ({}){}\n", energy.value / 1e3,
               ensemble::interval_text(energy, 1e-3, 4), height.value, ensemble::interval_text(height),
               line.members < ensemble::enough_for(95)
                   ? fmt::format(", of {} members: too few to bound it from above, which takes {} that cross",
                                 line.members, ensemble::enough_for(95))
                   : "");
  }
  for (const ensemble::StructureSummary& hit : s.structures) {
    if (s.done + s.suspect == 0) continue;
    fmt::print("structure {}: hit by {} of {} members, probability {:.3g} ({:.3g} to {:.3g}) per event\n",
               hit.name, hit.members, s.done + s.suspect, hit.probability.value, hit.probability.low,
               hit.probability.high);
    std::string parts;
    for (const ensemble::StructureSummary::Struck& part : hit.struck)
      parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", part.name, part.members);
    if (hit.struck.size() > 1) fmt::print("  members that hit {}\n", parts);
    if (hit.members > 0)
      fmt::print("  what the hits do to it: talus fragility {} --structure {}\n",
                 shell_word(directory.string()), shell_word(hit.name));
  }
  if (const std::string left = ensemble::left_text(s); !left.empty()) fmt::print("{}\n", left);
  if (const std::string text = s.precision ? ensemble::unreached_text(*s.precision) : ""; !text.empty())
    fmt::print("{}\n", text);
  if (s.failed + s.over_limit + s.suspect > 0)
    fmt::print("Scenes of members that failed, went over the limit or are suspect: {}\n",
               (directory / "members").string());
  fmt::print("Results: {}\n", directory.string());
}

}  // namespace

int command_ensemble(const Options& options) {
  Ranks* const all = ranks();
  work_alone();  // members know nothing of other ranks
  const fs::path directory = options.output;
  io::check_directory(directory, io::Results::ensemble);
  ensemble::Ensemble ensemble(options.input, options.scene_overrides());
  const std::vector<fs::path> inputs = ensemble.inputs();
  io::spare_inputs(directory, inputs);
  for (const Problem& warning : ensemble.warnings()) tell("{}\n", warning.str());
  wait_for_all();
  std::optional<io::DirectoryLock> lock;
  if (writes_files()) {
    if (options.resume) {
      if (!fs::exists(directory / io::marker_name))
        throw io::bad_file(directory, "--resume", "there is no ensemble to go on with",
                           "leave --resume out to start one");
      lock.emplace(directory);
    } else {
      lock.emplace(io::claim_directory(directory, io::Results::ensemble));
      io::write_file(directory / "scene.toml", ensemble.whole_scene());
    }
  }
  EnsembleProgress progress;
  ensemble::Run run;
  run.directory = directory;
  run.threads = options.threads > 0 ? options.threads
                                    : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  run.rank = all != nullptr ? all->rank() : 0;
  run.ranks = all != nullptr ? all->size() : 1;
  if (options.threads == 0 && run.ranks > 1) run.threads = 1;
  run.meet = wait_for_all;
  run.progress = [&](const ensemble::Progress& p) { progress.show(p); };
  run.stop = &stop_signal();
  on_stop(OnStop::ask);
  const long members = ensemble::run_members(ensemble, run);
  progress.clear();
  if (const int signal = stop_signal().load(); signal != 0) {
    // Other ranks may still be at theirs.
    const std::string kept =
        run.ranks > 1 ? std::string("what is finished is kept")
                      : fmt::format("{} of {} members are finished and kept",
                                    ensemble::kept_members(ensemble, directory), ensemble.design().members());
    fmt::print("Interrupted; {}: talus ensemble ... --resume goes on.\n", kept);
    return 128 + signal;
  }
  if (!writes_files()) return done;
  const ensemble::Summary summary = ensemble::write_results(ensemble, directory, members);
  for (const std::string& text : ensemble::write_maps(ensemble, directory, members))
    tell("warning: {}\n", text);
  const fs::path report = ensemble::write_report(ensemble, directory);
  print_summary(summary, directory);
  fmt::print("Report: {}\n", report.string());
  if (summary.asked > 0 && summary.failed + summary.over_limit == summary.asked) {
    tell("talus: no member came to an end; the first lines of members/N.toml say why\n");
    return numerical_failure;
  }
  return done;
}

}  // namespace talus::app

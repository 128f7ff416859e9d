#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "app/commands.hpp"
#include "app/impact_scene.hpp"
#include "app/progress.hpp"
#include "app/tell.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/path.hpp"
#include "io/final_state.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace talus::app {
namespace {

struct Held {
  double most = 0, now = 0;  // resident set of this process so far [MB]
};
Held held_so_far() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  Held held;
  held.most = held.now = static_cast<double>(used.ru_maxrss) * 1024e-6;
  std::ifstream statm("/proc/self/statm");
  if (long whole = 0, resident = 0; statm >> whole >> resident)
    held.now = static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
  return held;
}

/// Warnings of `more` that `problems` does not hold yet.
void add_new(std::vector<Problem>& problems, const std::vector<Problem>& more) {
  for (const Problem& p : more)
    if (std::none_of(problems.begin(), problems.end(),
                     [&](const Problem& q) { return q.key == p.key && q.rule == p.rule; }))
      problems.push_back(p);
}

}  // namespace

int command_check(const Options& options) {
  scene::Scene scene = scene::read_scene(options.input, options.overrides());
  const bool drawn = scene.ensemble.has_value();
  scene.ensemble.reset();  // which the plan of the ensemble states, not a warning
  std::vector<std::string> lines;
  std::vector<Problem> of_impact;
  if (scene.impact) {
    scene::Scene blow =
        impact_scene(scene::read_scene(options.input, options.overrides(), scene::Purpose::impact));
    lines.push_back(impact_line(blow));
    const bool alone = scene.blocks.empty() && !scene.rock_mass && !drawn;
    if (alone)
      scene = std::move(blow);
    else
      of_impact = std::move(blow.warnings);
  }
  std::vector<Problem> problems;
  std::vector<std::string> plan;
  std::string title;
  double most = 0, now = 0;  // [MB]
  {
    BuildProgress progress;
    sim::Simulation simulation(std::move(scene), [&](const std::string& line) { progress.show(line); });
    if (const std::string& previous = simulation.scene().simulation.initial_state; !previous.empty())
      simulation.start_from(io::read_final_state(previous), previous);
    problems = simulation.warnings();
    if (!drawn) ensemble::checked_lines(simulation, problems);
    title = simulation.header().title;
    plan = simulation.plan();
    const double added = simulation.memory_of_run();
    const Held held = held_so_far();
    now = held.now;
    most = 1.05 * std::max(held.most, held.now + added);
  }
  add_new(problems, of_impact);
  if (drawn) {
    const ensemble::Ensemble ensemble(options.input, options.scene_overrides());
    add_new(problems, ensemble.warnings());
    for (std::string& line : ensemble.plan()) lines.push_back(std::move(line));
    lines.emplace_back("One member by the scene's own values, as talus run takes them:");
  }
  for (const Problem& warning : problems) tell("{}\n", warning.str());
  const std::size_t warnings = problems.size();
  fmt::print("{}{}\n", title.empty() ? "" : title + "\n\n", "Plan");
  lines.insert(lines.end(), plan.begin(), plan.end());
  for (const std::string& line : lines) fmt::print("  {}\n", line);
  fmt::print("  Memory: at most about {:.0f} MB, of which {:.0f} MB stand once the scene is built.\n", most,
             now);
  fmt::print("\n{}\n", warnings == 0
                           ? "No problems found."
                           : fmt::format("No errors; {} warning{}.", warnings, warnings == 1 ? "" : "s"));
  return done;
}

}  // namespace talus::app

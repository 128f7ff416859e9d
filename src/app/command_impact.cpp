// talus impact: a structure alone, and the one block of [impact] on its way to it.
#include <filesystem>

#include "app/commands.hpp"
#include "app/impact_scene.hpp"

namespace talus::app {

int command_impact(const Options& options) {
  scene::Scene scene = scene::read_scene(options.input, options.overrides(), scene::Purpose::impact);
  // scene.resolved.json of an impact run holds the block itself.
  if (!scene.impact) {
    Problem problem;
    problem.file = options.input;
    problem.key = "impact";
    problem.rule = "the scene has no [impact]";
    problem.remedy = std::filesystem::path(options.input).filename() == "scene.resolved.json"
                         ? "a resolved scene holds the block itself, where it starts: talus run takes it"
                         : "add [impact] with material, shape, velocity and point: see talus explain impact";
    throw InputError(problem);
  }
  // An earlier impact's block is not this one.
  return run_scene(impact_scene(std::move(scene)), options, false);
}

}  // namespace talus::app

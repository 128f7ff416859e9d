#include <algorithm>

#include "ensemble/path.hpp"
#include "sim/ground.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

std::vector<PlanLine> checked_lines(sim::Simulation& simulation, std::vector<Problem>& warnings) {
  const scene::Scene& scene = simulation.scene();
  std::string crs = simulation.header().crs;
  std::vector<PlanLine> lines = plan_lines(scene, crs);
  GroundExtent extent{.box = {}, .cell = simulation.header().terrain_cell};
  for (const Vec3& v : simulation.header().terrain.vertices) extent.box.extend(v);
  const auto height = [&world = simulation.world()](double x, double y) {
    const coupling::Environment& env = world.system->environment();
    return sim::uppermost_ground(env.terrain.get(), env.planes, x, y);
  };
  std::vector<Problem> problems =
      line_problems(lines, height, extent, scene.file, scene.site ? scene.site->origin : Vec3::Zero());
  if (std::any_of(problems.begin(), problems.end(),
                  [](const Problem& p) { return p.severity == Problem::Severity::error; }))
    throw InputError(std::move(problems));
  warnings.insert(warnings.end(), problems.begin(), problems.end());
  return lines;
}

}  // namespace talus::ensemble

#include "sim/simulation.hpp"

#include "sim/world.hpp"

namespace talus::sim {

Simulation::Simulation(scene::Scene scene, std::function<void(const std::string&)> report)
    : world_(build(std::move(scene), std::move(report))) {
  world_->header.plan = plan();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

const RunHeader& Simulation::header() const { return world_->header; }
const scene::Scene& Simulation::scene() const { return world_->scene; }
double Simulation::time() const { return world_->time(); }
std::vector<std::string> Simulation::departed() const {
  std::vector<std::string> names;
  if (!world_->paper)
    for (const int b : world_->system->departed()) names.push_back(world_->system->model().blocks[static_cast<std::size_t>(b)].name);
  return names;
}
std::vector<Structure*> Simulation::structures() {
  std::vector<Structure*> list;
  for (const coupling::StructurePart& part : world_->system->environment().structures) list.push_back(part.fixed_surface ? nullptr : part.structure.get());
  return list;
}

World& Simulation::world() { return *world_; }

}  // namespace talus::sim

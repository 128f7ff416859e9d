#include "sim/simulation.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <string_view>

#include "sim/world.hpp"

namespace talus::sim {
namespace {

/// "scene.toml:12:1: key = value: rule; remedy". Of the file the name alone: a summary is read where its
/// directory says nothing.
std::string sentence(Problem problem) {
  problem.file = std::filesystem::path(problem.file).filename().string();
  const std::string place = problem.file.empty() ? ""
                            : problem.line > 0
                                ? fmt::format("{}:{}:{}: ", problem.file, problem.line, problem.column)
                                : problem.file + ": ";
  problem.file.clear();
  constexpr std::string_view mark = "warning: ";
  const std::string text = problem.str();
  return place + (text.starts_with(mark) ? text.substr(mark.size()) : text);
}

}  // namespace

Simulation::Simulation(scene::Scene scene, std::function<void(const std::string&)> report)
    : world_(build(std::move(scene), std::move(report))) {
  world_->header.plan = plan();
  world_->header.prescribed_impact = world_->scene.prescribed_impact;
  for (const Problem& p : warnings()) world_->header.warnings.push_back(sentence(p));
}

Simulation::Simulation(scene::Scene scene, Shared& shared) : world_(build(std::move(scene), {}, &shared)) {}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

const RunHeader& Simulation::header() const { return world_->header; }
const scene::Scene& Simulation::scene() const { return world_->scene; }
double Simulation::time() const { return world_->time(); }
std::vector<std::string> Simulation::departed() const {
  std::vector<std::string> names;
  if (!world_->paper)
    for (const int b : coupling::departed(*world_->system))
      names.push_back(world_->system->model().blocks[static_cast<std::size_t>(b)].name);
  return names;
}
std::vector<Structure*> Simulation::structures() {
  std::vector<Structure*> list;
  for (const coupling::StructurePart& part : world_->system->environment().structures)
    list.push_back(part.fixed_surface ? nullptr : part.structure.get());
  return list;
}

World& Simulation::world() { return *world_; }

}  // namespace talus::sim

#include "sim/free_structures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::sim {
namespace {

/// Where v t + g t^2 / 2 takes a coordinate within `duration`: its least and largest change [m].
std::pair<double, double> free_way(double v, double g, double duration) {
  const auto at = [&](double t) { return v * t + 0.5 * g * t * t; };
  double least = std::min(0.0, at(duration)), most = std::max(0.0, at(duration));
  if (const double turns = g != 0 ? -v / g : -1; turns > 0 && turns < duration)
    least = std::min(least, at(turns)), most = std::max(most, at(turns));
  return {least, most};
}

/// How far blows may push a structure beyond its free flight [m]; 0: nothing can strike it.
double pushed(const scene::Scene& scene, const coupling::Environment& environment, const dda::Model& model,
              const dda::State& state, int structure) {
  const double duration = scene.simulation.duration, fall = scene.simulation.gravity.norm() * duration;
  if (!scene.structures[static_cast<std::size_t>(structure)].loads.empty() ||
      !scene.simulation.initial_state.empty())
    return std::numeric_limits<double>::infinity();
  double fastest = -1;
  for (std::size_t k = 0; k < model.blocks.size(); ++k)
    if (model.blocks[k].ndof() > 0)
      fastest = std::max(fastest, state.v[k].norm() + model.blocks[k].shape->radius * state.w[k].norm());
  for (const auto& [a, b] : environment.touching_structures)
    if (a == structure || b == structure)
      fastest = std::max(
          fastest,
          scene.structures[static_cast<std::size_t>(a == structure ? b : a)].initial_velocity.norm());
  return fastest < 0 ? 0 : 2 * (fastest + fall) * duration;
}

Box3 reachable(const scene::Scene& scene, const StructureSpec& spec, Box3 box, double pushed) {
  for (int c = 0; c < 3; ++c) {
    const auto [least, most] =
        free_way(spec.initial_velocity[c], scene.simulation.gravity[c], scene.simulation.duration);
    box.min()[c] += least - pushed;
    box.max()[c] += most + pushed;
  }
  return box;
}

bool meets(const Plane& plane, const Box3& box) {
  const Vec3 half = 0.5 * box.sizes();
  if (!half.allFinite()) return true;
  return plane.normal.dot(box.center() - plane.point) - plane.normal.cwiseAbs().dot(half) <=
         1e-9 * half.norm();
}

}  // namespace

std::vector<Problem> free_structure_problems(const scene::Scene& scene,
                                             const coupling::Environment& environment,
                                             const dda::Model& model, const dda::State& state) {
  std::vector<Problem> found;
  for (std::size_t q = 0; q < environment.structures.size(); ++q) {
    const StructureSpec& spec = scene.structures[q];
    if (!spec.supports.empty() || !environment.structures[q].stepped()) continue;
    const Box3 box = reachable(scene, spec, environment.structures[q].index->bounds(),
                               pushed(scene, environment, model, state, static_cast<int>(q)));
    const auto refuse = [&](const std::string& what, const std::string& instead) {
      Problem p;
      p.file = scene.file;
      p.key = fmt::format("structure.{}.support", spec.name);
      p.value = "[]";
      p.rule = fmt::format(
          "nothing holds it, and within the run it may come to {}, through which it would go: a structure "
          "without supports meets blocks that move and other structures, nothing that is fixed",
          what);
      p.remedy = fmt::format(
          "make {} a [[structure]] with supports and give the [[interface]] of the two, or make {} a "
          "[[block]], or hold it",
          instead, spec.name);
      found.push_back(std::move(p));
    };
    for (std::size_t k = 0; k < environment.planes.size(); ++k)
      if (meets(environment.planes[k], box))
        refuse(fmt::format("plane {}", k + 1), "the part of the plane that it comes to");
    if (environment.terrain != nullptr && (!box.sizes().allFinite() || environment.terrain->overlaps(box)))
      refuse("the terrain", "the part of the ground that it comes to");
    for (std::size_t k = 0; k < model.blocks.size(); ++k)
      if (model.blocks[k].ndof() == 0 &&
          contact::bounds(*model.blocks[k].shape, dda::pose(state, static_cast<int>(k)), 0).intersects(box))
        refuse(fmt::format("the fixed block {}", model.blocks[k].name), model.blocks[k].name);
  }
  return found;
}

}  // namespace talus::sim

#include "coupling/motion/strike_ahead.hpp"

#include <algorithm>
#include <cmath>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {
namespace {

constexpr double least_fall =
    0.01;  // of a block's radius, by which it would have to fall for a blow that counts
constexpr double looks_per_radius =
    4;  // a block near the structure is looked at again after a quarter of its radius
constexpr double shortest_look = 0.002;  // of the horizon
constexpr double
    strike_gap = 1e-3,
    about = 2e-2;  // gap at the first contact, and up to which points belong to it, of a block's radius

}  // namespace

StrikesAhead strikes_ahead(const dda::Model& model, const dda::State& state, const ContactHistory& contacts,
                           const StructurePart& part, int q, double horizon) {
  StrikesAhead ahead;
  const std::uint64_t partner = Partner{Partner::Kind::structure, q}.id();
  const double g = model.gravity.norm();
  for (std::size_t b = 0; b < model.blocks.size(); ++b) {
    const dda::Model::Block& block = model.blocks[b];
    const auto touches = [&](const ContactMemory& m) {
      return m.partner == partner && (!m.force.isZero(0) || m.normal_energy > 0 || m.feature == born_inside);
    };
    if (block.ndof() == 0 || std::any_of(contacts[b].begin(), contacts[b].end(), touches)) continue;
    const double radius = block.shape->radius, speed = state.v[b].norm() + radius * state.w[b].norm();
    const dda::BlockEnergy e = dda::energy(model, state, static_cast<int>(b));
    const double energy = e.translational + e.rotational;
    const Pose pose = dda::pose(state, static_cast<int>(b));
    const double reach = 1.5 * horizon * speed + horizon * horizon * g + strike_gap * radius;
    if (!(energy > least_fall * radius * block.mass * g) ||
        !part.index->overlaps(contact::bounds(*block.shape, pose, reach)))
      continue;
    const double look = std::clamp(radius / (looks_per_radius * (speed + g * horizon)),
                                   shortest_look * horizon, horizon),
                 seen = std::min(horizon, 2 * look);
    contact::Motion path;
    path.start = pose;
    path.displacement = seen * state.v[b] + 0.5 * seen * seen * model.gravity;
    path.half_gravity_step = 0.5 * seen * seen * model.gravity;
    path.rotation = seen * state.w[b];
    ahead.look_again = std::min(ahead.look_again, look);
    const double s = contact::time_of_impact(*part.index, *block.shape, path, strike_gap * radius);
    if (s > 1) continue;
    std::vector<contact::ContactPoint> points;
    contact::surface_block(*part.index, *block.shape, path.at(s), about * radius, points);
    StrikeAhead strike{static_cast<int>(b), {}, energy};
    for (const contact::ContactPoint& p : points) strike.place.extend(p.point_a);
    if (!points.empty()) ahead.strikes.push_back(strike);
  }
  return ahead;
}

}  // namespace talus::coupling

// Motion and works of the steps that rows fall into: read off, no step depends on them.
#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {

/// Of the springs of the island's blocks and skins [J].
double spring_energy_of_island(const IslandContext& in) {
  double sum = 0;
  const auto add = [&](const std::vector<ContactMemory>& list) {
    for (const ContactMemory& m : list) sum += m.normal_energy + m.shear_energy;
  };
  for (int b : in.island->blocks) add(in.history[static_cast<std::size_t>(b)]);
  for (const SurfacePair& pair : in.island->surfaces)
    add(in.surface_history[static_cast<std::size_t>(pair.b)]);
  return sum;
}

}  // namespace

/// Before the step is committed: its start, after impulses of no duration. False: no row falls into it.
bool IslandStepper::begin_motion(double t0, double t1) {
  if (!falls_into(rows_, t0, t1)) return false;
  WorkSegment& work = report_.motion.works.emplace_back();
  work.t0 = t0, work.t1 = t1;
  work.before = report_.ledger;
  work.before.contact = spring_energy_of_island(in_);
  starts_ = step_.saved;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const dda::BlockEnergy e = dda::energy(in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)],
                                           in_.model.gravity, starts_[i]);
    work.energy_before += e.translational + e.rotational + e.straining + e.strain_energy + e.potential;
  }
  return true;
}

/// After the corrections at its end.
void IslandStepper::end_motion() {
  WorkSegment& work = report_.motion.works.back();
  work.after = report_.ledger;
  work.after.contact = spring_energy_of_island(in_);
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const int b = step_.bodies[i].block;
    const dda::BlockState end = dda::block_state(in_.state, b);
    const dda::BlockEnergy e =
        dda::energy(in_.model.blocks[static_cast<std::size_t>(b)], in_.model.gravity, end);
    work.energy_after += e.translational + e.rotational + e.straining + e.strain_energy + e.potential;
    report_.motion.segments.push_back(motion_segment(in_.model, b, work.t0, work.t1, starts_[i], end,
                                                     step_.bodies[i].from_start, step_.bodies[i].drag));
  }
}

}  // namespace talus::coupling

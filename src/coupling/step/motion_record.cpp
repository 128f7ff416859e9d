// Motion and works of the steps that rows fall into: read off, no step depends on them.
#include "coupling/step/motion_record.hpp"

#include "coupling/step/bodies.hpp"

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

MotionRecord::MotionRecord(const IslandContext& in, const Step& step, IslandReport& report)
    : in_(in), step_(step), report_(report) {}

void MotionRecord::begin(std::span<const double> rows) {
  rows_ = rows;
  began_.clear();
  for (const int b : in_.island->blocks) began_.push_back(dda::block_state(in_.state, b));
  report_.peaks.assign(in_.island->blocks.size(), MotionPeaks{});
  report_.went.assign(in_.island->blocks.size(), 0.0);
  report_.ways.resize(in_.island->blocks.size());
  report_.motions.assign(1, IslandMotion{});
  report_.motions.front().blocks = in_.island->blocks;
}

void MotionRecord::begin_step(double t0, double t1) {
  add_peaks(step_.saved);
  recorded_ = falls_into(rows_, t0, t1);
  if (!recorded_) return;
  WorkSegment& work = report_.motions.front().works.emplace_back();
  work.t0 = t0, work.t1 = t1;
  work.before = report_.ledger;
  work.before.contact = spring_energy_of_island(in_);
  starts_ = step_.saved;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const dda::BlockEnergy e = dda::energy(in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)],
                                           in_.model.gravity, starts_[i]);
    work.energy_before += e.translational + e.rotational + e.straining + e.strain_energy + e.potential;
  }
}

// Between impulses a block's acceleration is that of one force, its speed largest at one of the ends.
void MotionRecord::add_peaks(std::span<const dda::BlockState> states) {
  double sum = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const int b = step_.bodies[i].block;
    sum += report_.peaks[i].add(in_.model.blocks[static_cast<std::size_t>(b)], states[i]);
  }
  report_.kinetic_peak = std::max(report_.kinetic_peak, sum);
}

void MotionRecord::end_step() {
  std::vector<dda::BlockState> ends;
  ends.reserve(step_.bodies.size());
  for (const Body& body : step_.bodies) ends.push_back(dda::block_state(in_.state, body.block));
  add_peaks(ends);
  if (!recorded_) return;
  WorkSegment& work = report_.motions.front().works.back();
  work.after = report_.ledger;
  work.after.contact = spring_energy_of_island(in_);
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const int b = step_.bodies[i].block;
    const dda::BlockEnergy e =
        dda::energy(in_.model.blocks[static_cast<std::size_t>(b)], in_.model.gravity, ends[i]);
    work.energy_after += e.translational + e.rotational + e.straining + e.strain_energy + e.potential;
    report_.motions.front().segments.push_back(motion_segment(in_.model, b, work.t0, work.t1, starts_[i],
                                                              ends[i], step_.bodies[i].from_start,
                                                              step_.bodies[i].drag));
  }
}

void MotionRecord::measure_way(double from, double to, std::span<contact::Motion> made) {
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step_.bodies[i].block);
    const dda::BlockState& began = began_[i];
    const double chord =
        2 * (began.q.conjugate() * in_.state.q[k]).vec().norm() + (in_.state.eps[k] - began.eps).norm();
    report_.went[i] = std::max(report_.went[i],
                               (in_.state.c[k] - began.c).norm() + in_.model.blocks[k].shape->radius * chord);
    if (in_.island->watched[i] == 0) continue;
    // With the correction.
    made[i].displacement = in_.state.c[k] - made[i].start.c;
    made[i].rotation = dda::rotation_vector(in_.state.q[k] * step_.saved[i].q.conjugate());
    report_.ways[i].push_back({from, to, made[i]});
  }
}

}  // namespace talus::coupling

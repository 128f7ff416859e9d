#include "coupling/motion/recorded_motion.hpp"

#include <algorithm>
#include <cmath>

namespace talus::coupling {
namespace {

/// Energy stored in contact springs now [J].
double spring_energy(const SystemState& state) {
  double e = 0;
  for (const ContactHistory* history : {&state.contacts, &state.surface_contacts})
    for (const auto& body : *history)
      for (const ContactMemory& m : body) e += m.normal_energy + m.shear_energy;
  return e;
}

MotionSegment piece_of(int block) {
  MotionSegment piece;
  piece.block = block;
  return piece;
}
double whole(const dda::BlockEnergy& e) {
  return e.translational + e.rotational + e.straining + e.strain_energy + e.potential;
}

}  // namespace

void RecordedMotion::keep(std::span<IslandReport> reports, const dda::Model& model,
                          const SystemState& state) {
  std::vector<char> moved(model.blocks.size(), 0);
  for (IslandReport& r : reports)
    for (IslandMotion& motion : r.motions) {
      if (motion.works.empty() && !std::isfinite(motion.t1)) continue;
      for (const int b : motion.blocks) moved[static_cast<std::size_t>(b)] = 1;
      std::stable_sort(motion.segments.begin(), motion.segments.end(),
                       [](const MotionSegment& a, const MotionSegment& b) { return a.block < b.block; });
      motion_.push_back(std::move(motion));
    }
  works_before_ = state.ledger;
  works_before_.contact = 0;
  for (std::size_t b = 0; b < moved.size(); ++b)
    if (moved[b] == 0)
      for (const ContactMemory& m : state.contacts[b])
        works_before_.contact += m.normal_energy + m.shear_energy;
}

Moment RecordedMotion::at(double t, const dda::Model& model, const SystemState& state) const {
  Moment now{t, state.blocks, state.ledger};
  now.works.contact = spring_energy(state);
  if (t >= state.time || motion_.empty()) return now;
  now.works = works_before_;
  for (const IslandMotion& island : motion_) {
    if (t <= island.t0) continue;  // nothing done yet
    if (t > island.t1) {           // its blocks have gone on since
      now.works += island.done;
      continue;
    }
    double energy = 0;
    for (const int b : island.blocks) {
      const auto of_block =
          std::equal_range(island.segments.begin(), island.segments.end(), piece_of(b),
                           [](const MotionSegment& x, const MotionSegment& y) { return x.block < y.block; });
      const auto step = std::partition_point(of_block.first, of_block.second,
                                             [&](const MotionSegment& s) { return s.t1 < t; });
      if (step != of_block.second) dda::set_block_state(now.blocks, b, evaluate(*step, t, model));
      energy += whole(dda::energy(model, now.blocks, b));
    }
    const auto step = std::partition_point(island.works.begin(), island.works.end(),
                                           [&](const WorkSegment& s) { return s.t1 < t; });
    now.works += step == island.works.end() ? island.works.back().after : evaluate(*step, t, energy);
  }
  return now;
}

}  // namespace talus::coupling

// Explicit sub-steps follow only the part of a skin that the blocks can come near before it is chosen anew: of a viaduct under one boulder
// a few faces in a hundred.
#include <algorithm>
#include <cmath>

#include "coupling/island_body.hpp"

namespace talus::coupling {

namespace {
constexpr double steps_ahead = 16;   // the followed part reaches so many times as far as one step asks for
}

/// Before a search with the reach of h: chooses anew what is followed once blocks and skins may have moved out of it.
void IslandStepper::follow_skins(double h) {
  if (!island_->surfaces.empty()) return;   // two skins meet anywhere
  double fastest = 0;
  for (const int s : island_->structures)
    for (const Vec3& v : env_.structures[static_cast<std::size_t>(s)].structure->surface().velocities) fastest = std::max(fastest, v.squaredNorm());
  fastest = std::sqrt(fastest);
  const double path = 2 * step_length_ * fastest;   // of the step just made: twice, since its start may have been faster
  skin_path_ += path;
  skin_travel_ += path;
  double need = 0, moved = 0;
  for (const CandidatePair& pair : island_->pairs)
    if (moving_skin(pair.a)) need = std::max(need, reach(pair.b, h));
  need = 4 * (need + h * fastest) + 4e-3 * length_;   // twice the reach about the end of the step as well
  for (const Seen& b : seen_) {
    const auto k = static_cast<std::size_t>(b.block);
    moved = std::max(moved, (state_.c[k] - b.c).norm() + 2.5 * model_.blocks[k].shape->radius * (state_.q[k] * b.q.conjugate()).vec().norm());
  }
  const bool holds = followed_ >= 0 && moved + skin_path_ + need <= followed_ && followed_ <= 4 * steps_ahead * need;
  if (holds) return;
  followed_ = steps_ahead * need;
  skin_path_ = 0;
  seen_.clear();
  for (std::size_t i = 0; i < island_->pairs.size(); ++i)
    if (moving_skin(island_->pairs[i].a)) watches_[i].forget();   // what it watches may be followed no more
  for (const int s : island_->structures) {
    StructurePart& part = env_.structures[static_cast<std::size_t>(s)];
    std::vector<Box3> boxes;
    for (const CandidatePair& pair : island_->pairs) {
      if (pair.a.kind != Partner::Kind::structure || pair.a.index != s) continue;
      const auto k = static_cast<std::size_t>(pair.b);
      boxes.push_back(contact::bounds(*model_.blocks[k].shape, dda::pose(state_, pair.b), followed_));
      seen_.push_back({pair.b, state_.c[k], state_.q[k]});
    }
    part.index->focus(part.structure->surface(), std::move(boxes));
  }
}

void IslandStepper::follow_all() {
  if (followed_ < 0) return;
  for (const int s : island_->structures) {
    StructurePart& part = env_.structures[static_cast<std::size_t>(s)];
    part.index->unfocus(part.structure->surface());
  }
  followed_ = -1;
}

}  // namespace talus::coupling

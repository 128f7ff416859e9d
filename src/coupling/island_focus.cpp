// Explicit sub-steps follow only the part of a skin that the blocks can come near before it is chosen anew:
// of a viaduct under one boulder a few faces in a hundred.
#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling/island_body.hpp"

namespace talus::coupling {

namespace {
constexpr double steps_ahead = 16;  // the followed part reaches so many times as far as one step asks for

/// Appends the boxes of a skin's faces, grown by `by`, that meet another box.
void boxes_near(const TriangleSurface& skin, const Box3& other, double by, std::vector<Box3>& out) {
  for (std::size_t t = 0; t + 3 < skin.triangles.size(); t += 4) {
    Box3 box;
    for (std::size_t k = 0; k < 4; ++k)
      box.extend(skin.vertices[static_cast<std::size_t>(skin.triangles[t + k][0])]);
    box.min().array() -= by;
    box.max().array() += by;
    if (box.intersects(other)) out.push_back(box);
  }
}

Box3 box_of(const TriangleSurface& skin) {
  Box3 box;
  for (const Vec3& x : skin.vertices) box.extend(x);
  return box;
}
}  // namespace

const TriangleSurface& IslandStepper::skin(int structure) const {
  return env_.structures[static_cast<std::size_t>(structure)].structure->surface();
}

double IslandStepper::fastest_skin() const {
  double fastest = 0;
  for (const int s : island_->structures)
    for (const Vec3& v : skin(s).velocities) fastest = std::max(fastest, v.squaredNorm());
  return std::sqrt(fastest);
}

/// Structures of the island that may touch this one, ascending.
std::vector<int> IslandStepper::met_by(int structure) const {
  std::vector<int> partners;
  for (const SurfacePair& pair : island_->surfaces)
    if (pair.a == structure || pair.b == structure) partners.push_back(pair.a == structure ? pair.b : pair.a);
  std::sort(partners.begin(), partners.end());
  return partners;
}

/// Before a search with the reach of h: chooses anew what is followed once blocks and skins may have moved
/// out of it.
void IslandStepper::follow_skins(double h) {
  const double fastest = fastest_skin();
  const double path =
      2 * step_length_ * fastest;  // of the step just made: twice, since its start may have been faster
  skin_path_ += path;
  skin_travel_ += path;
  const Followed need = followed_need(h, fastest);
  if (follows(need)) return;
  followed_ = island_->blocks.empty() ? 0 : steps_ahead * need.blocks;
  followed_skins_ = surface_reach() + std::max(surface_reach(), steps_ahead * need.skins);
  choose_followed();
}

/// How far skins are to be followed from blocks, twice the reach about the end of the step as well, and by
/// how much farther than surface_reach() from each other [m].
IslandStepper::Followed IslandStepper::followed_need(double h, double fastest) const {
  double need = 0;
  for (const CandidatePair& pair : island_->pairs)
    if (moving_skin(pair.a)) need = std::max(need, reach(pair.b, h));
  return {4 * (need + h * fastest) + 4e-3 * length_, 8 * h * fastest};
}

bool IslandStepper::follows(const Followed& need) const {
  if (followed_ < 0) return false;
  double moved = 0;
  for (const Seen& b : seen_) {
    const auto k = static_cast<std::size_t>(b.block);
    moved = std::max(moved, (state_.c[k] - b.c).norm() + 2.5 * model_.blocks[k].shape->radius *
                                                             (state_.q[k] * b.q.conjugate()).vec().norm());
  }
  if (!island_->blocks.empty() &&
      (moved + skin_path_ + need.blocks > followed_ || followed_ > 4 * steps_ahead * need.blocks))
    return false;
  if (island_->surfaces.empty()) return true;
  for (std::size_t i = 0; i < island_->structures.size(); ++i)  // new faces lie where none was chosen
    if (skin(island_->structures[i]).revision != followed_revisions_[i]) return false;
  return surface_reach() + need.skins + 2 * skin_path_ <= followed_skins_;
}

void IslandStepper::choose_followed() {
  skin_path_ = 0;
  seen_.clear();
  followed_revisions_.clear();
  for (std::size_t i = 0; i < island_->pairs.size(); ++i)
    if (moving_skin(island_->pairs[i].a)) watches_[i].forget();  // what it watches may be followed no more
  for (const int s : island_->structures) {
    StructurePart& part = env_.structures[static_cast<std::size_t>(s)];
    std::vector<Box3> boxes;
    for (const CandidatePair& pair : island_->pairs) {
      if (pair.a.kind != Partner::Kind::structure || pair.a.index != s) continue;
      const auto k = static_cast<std::size_t>(pair.b);
      boxes.push_back(contact::bounds(*model_.blocks[k].shape, dda::pose(state_, pair.b), followed_));
      seen_.push_back({pair.b, state_.c[k], state_.q[k]});
    }
    const Box3 box = box_of(skin(s));
    for (const int other : met_by(s)) boxes_near(skin(other), box, followed_skins_, boxes);
    part.index->focus(skin(s), std::move(boxes));
    followed_revisions_.push_back(skin(s).revision);
  }
}

/// Structures alone go on with what the last stretch followed. (Blocks do not: what they may meet is planned
/// between stretches by whole skins.)
void IslandStepper::go_on_following() {
  if (!island_->blocks.empty()) return;
  followed_revisions_.clear();
  double between = std::numeric_limits<double>::infinity(), path = 0;
  for (const int s : island_->structures) {
    const StructurePart::Followed& last = env_.structures[static_cast<std::size_t>(s)].followed;
    const std::vector<int> partners = met_by(s);
    if (last.between < 0 || last.revision != skin(s).revision ||
        !std::includes(last.partners.begin(), last.partners.end(), partners.begin(), partners.end()))
      return;
    between = std::min(between, last.between);
    path = std::max(path, last.path);
    followed_revisions_.push_back(last.revision);
  }
  followed_ = 0;
  followed_skins_ = between;
  skin_path_ = path;
}

void IslandStepper::end_following() {
  if (followed_ < 0) return;
  const double path = skin_path_ + 2 * step_length_ * fastest_skin();
  for (std::size_t i = 0; i < island_->structures.size(); ++i) {
    const int s = island_->structures[i];
    StructurePart& part = env_.structures[static_cast<std::size_t>(s)];
    if (island_->blocks.empty())
      part.followed = {followed_skins_, path, followed_revisions_[i], met_by(s)};
    else
      part.index->unfocus(skin(s));
  }
  followed_ = -1;
}

}  // namespace talus::coupling

// Explicit sub-steps follow only the part of a skin that the blocks can come near before it is chosen anew:
// of a viaduct under one boulder a few faces in a hundred.
#include "coupling/search/surface_focus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling/ground/ground.hpp"
#include "coupling/search/contact_search.hpp"

namespace talus::coupling {

namespace {
constexpr double steps_ahead = 16;  // the followed part reaches so many times as far as one step asks for

/// Appends the boxes of a surface's faces, grown by `by`, of which `meets` says so.
template <class Meets>
void boxes_near(const TriangleSurface& surface, double by, std::vector<Box3>& out, Meets&& meets) {
  for (std::size_t t = 0; t + 3 < surface.triangles.size(); t += 4) {
    Box3 box;
    for (std::size_t k = 0; k < 4; ++k)
      box.extend(surface.vertices[static_cast<std::size_t>(surface.triangles[t + k][0])]);
    box.min().array() -= by;
    box.max().array() += by;
    if (meets(box)) out.push_back(box);
  }
}

Box3 box_of(const TriangleSurface& skin) {
  Box3 box;
  for (const Vec3& x : skin.vertices) box.extend(x);
  return box;
}

/// Structures and grounds of the island that may touch this one, ascending by their numbers.
std::vector<std::uint64_t> met_by(const IslandContext& in, int structure) {
  std::vector<std::uint64_t> partners;
  const Partner self{Partner::Kind::structure, structure};
  for (const SurfacePair& pair : in.island->surfaces)
    if (pair.b == structure)
      partners.push_back(pair.a.id());
    else if (pair.a == self)
      partners.push_back(Partner{Partner::Kind::structure, pair.b}.id());
  std::sort(partners.begin(), partners.end());
  return partners;
}

}  // namespace

SurfaceFocus::SurfaceFocus(const IslandContext& in, const Step& step) : in_(in), step_(step) {}

void SurfaceFocus::begin() {
  followed_ = -1;
  surface_path_ = surface_travel_ = 0;
  seen_.clear();
  go_on();
}

bool SurfaceFocus::follow(double h) {
  const double fastest = in_.fastest_surface();
  const double path =
      2 * step_.length * fastest;  // of the step just made: twice, since its start may have been faster
  surface_path_ += path;
  surface_travel_ += path;
  const Need need = needed(h, fastest);
  if (serves(need)) return false;
  followed_ = in_.island->blocks.empty() ? 0 : steps_ahead * need.blocks;
  followed_skins_ = in_.scale.surface_reach() + std::max(in_.scale.surface_reach(), steps_ahead * need.skins);
  choose();
  return true;
}

/// How far skins are to be followed from blocks, twice the reach about the end of the step as well, and by
/// how much farther than in_.scale.surface_reach() from each other [m].
SurfaceFocus::Need SurfaceFocus::needed(double h, double fastest) const {
  double need = 0;
  for (const CandidatePair& pair : in_.island->pairs)
    if (in_.moving_surface(pair.a)) need = std::max(need, reach_of(in_, pair.b, h));
  return {4 * (need + h * fastest) + 4e-3 * in_.scale.length, 8 * h * fastest};
}

bool SurfaceFocus::serves(const Need& need) const {
  if (followed_ < 0) return false;
  double moved = 0;
  for (const Seen& b : seen_) {
    const auto k = static_cast<std::size_t>(b.block);
    moved =
        std::max(moved, (in_.state.c[k] - b.c).norm() + 2 * in_.model.blocks[k].shape->radius *
                                                            (in_.state.q[k] * b.q.conjugate()).vec().norm());
  }
  if (!in_.island->blocks.empty() &&
      (moved + surface_path_ + need.blocks > followed_ || followed_ > 4 * steps_ahead * need.blocks))
    return false;
  if (in_.island->surfaces.empty()) return true;
  for (std::size_t i = 0; i < in_.island->structures.size(); ++i)  // new faces lie where none was chosen
    if (in_.surface(in_.island->structures[i]).revision != followed_revisions_[i]) return false;
  return in_.scale.surface_reach() + need.skins + 2 * surface_path_ <= followed_skins_;
}

void SurfaceFocus::choose() {
  surface_path_ = 0;
  seen_.clear();
  followed_revisions_.clear();
  for (const int s : in_.island->structures) {
    StructurePart& part = in_.env.structures[static_cast<std::size_t>(s)];
    std::vector<Box3> boxes;
    for (const CandidatePair& pair : in_.island->pairs) {
      if (pair.a.kind != Partner::Kind::structure || pair.a.index != s) continue;
      const auto k = static_cast<std::size_t>(pair.b);
      boxes.push_back(contact::bounds(*in_.model.blocks[k].shape, dda::pose(in_.state, pair.b), followed_));
      seen_.push_back({pair.b, in_.state.c[k], in_.state.q[k]});
    }
    const Box3 box = box_of(in_.surface(s));
    for (const SurfacePair& pair : in_.island->surfaces) {
      const bool of_a = pair.a == Partner{Partner::Kind::structure, s};
      if (pair.b != s && !of_a) continue;
      if (of_a || pair.a.kind == Partner::Kind::structure)
        boxes_near(in_.surface(of_a ? pair.b : pair.a.index), followed_skins_, boxes,
                   [&](const Box3& face) { return face.intersects(box); });
      else
        boxes_near(in_.surface(s), followed_skins_, boxes,
                   [&](const Box3& face) { return reaches(in_.env, ground_of(in_.env, pair.a), face); });
    }
    part.index->focus(in_.surface(s), std::move(boxes));
    followed_revisions_.push_back(in_.surface(s).revision);
  }
}

/// Structures alone go on with what the last macro step followed. (Blocks do not: what they may meet is
/// planned between stretches by whole skins.)
void SurfaceFocus::go_on() {
  if (!in_.island->blocks.empty()) return;
  followed_revisions_.clear();
  double between = std::numeric_limits<double>::infinity(), path = 0;
  for (const int s : in_.island->structures) {
    const StructurePart::Followed& last = in_.env.structures[static_cast<std::size_t>(s)].followed;
    const std::vector<std::uint64_t> partners = met_by(in_, s);
    if (last.between < 0 || last.revision != in_.surface(s).revision ||
        !std::includes(last.partners.begin(), last.partners.end(), partners.begin(), partners.end()))
      return;
    between = std::min(between, last.between);
    path = std::max(path, last.path);
    followed_revisions_.push_back(last.revision);
  }
  followed_ = 0;
  followed_skins_ = between;
  surface_path_ = path;
}

void SurfaceFocus::end() {
  if (followed_ < 0) return;
  const double path = surface_path_ + 2 * step_.length * in_.fastest_surface();
  for (std::size_t i = 0; i < in_.island->structures.size(); ++i) {
    const int s = in_.island->structures[i];
    StructurePart& part = in_.env.structures[static_cast<std::size_t>(s)];
    if (in_.island->blocks.empty())
      part.followed = {followed_skins_, path, followed_revisions_[i], met_by(in_, s)};
    else
      part.index->unfocus(in_.surface(s));
  }
  followed_ = -1;
}

}  // namespace talus::coupling

#include "coupling/touch/pair_watch.hpp"

#include <algorithm>
#include <limits>

#include "contact/geometry/surface_near.hpp"
#include "contact/tolerances.hpp"

namespace talus::coupling {
namespace {

constexpr double search_steps = 16;  // a search reaches so many steps beyond the one that asks,
constexpr double steps_apart = 64;   // of a pair that was apart by then so many

bool at_skin(const Environment& env, const Partner& a) {
  return a.kind == Partner::Kind::structure &&
         !env.structures[static_cast<std::size_t>(a.index)].fixed_surface;
}

const TriangleSurface& skin_of(const Environment& env, const Partner& a) {
  return env.structures[static_cast<std::size_t>(a.index)].index->surface();
}

/// Barycentric coordinates of x on a triangle of the surface, seen along its normal.
Vec3 barycentric(const TriangleSurface& s, int triangle, const Vec3& x) {
  const auto& v = s.triangles[static_cast<std::size_t>(triangle)];
  const Vec3 &a = s.vertices[static_cast<std::size_t>(v[0])], &b = s.vertices[static_cast<std::size_t>(v[1])],
             &c = s.vertices[static_cast<std::size_t>(v[2])];
  const Vec3 n = (b - a).cross(c - a);
  return Vec3(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x))) /
         n.squaredNorm();
}

Vec3 at(const TriangleSurface& s, int triangle, const Vec3& weight) {
  const auto& v = s.triangles[static_cast<std::size_t>(triangle)];
  Vec3 x = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    x += weight[k] * s.vertices[static_cast<std::size_t>(v[static_cast<std::size_t>(k)])];
  return x;
}

double radius_of(const dda::Model& m, int block) {
  return m.blocks[static_cast<std::size_t>(block)].shape->radius;
}

double smaller_radius(const dda::Model& m, const CandidatePair& pair) {
  const double b = radius_of(m, pair.b);
  return pair.a.kind == Partner::Kind::block ? std::min(b, radius_of(m, pair.a.index)) : b;
}

}  // namespace

bool PairWatch::serves(const dda::Model& m, const Environment& env, const CandidatePair& pair) {
  if (pair.a.kind == Partner::Kind::plane || presses_on_bed(m, env, pair) || !env.joint_laws.empty() ||
      !env.bonds.empty())
    return false;  // a plane costs nothing
  const int b = m.blocks[static_cast<std::size_t>(pair.b)].material;
  const auto hard = [&](int a) { return !env.laws(a, b).sprung(); };
  switch (pair.a.kind) {
    case Partner::Kind::block: return hard(m.blocks[static_cast<std::size_t>(pair.a.index)].material);
    case Partner::Kind::structure:
      return hard(env.structures[static_cast<std::size_t>(pair.a.index)].material);
    case Partner::Kind::terrain:
      return env.terrain->surface().material.empty() && hard(env.terrain->surface().default_material);
    case Partner::Kind::plane: break;
  }
  return false;
}

/// Bound on how far points of the two have moved against each other since the last search [m]: as seen from
/// A, of a skin's vertices as seen from B, with which what has come off it flies along.
double PairWatch::moved(const dda::Model& m, const dda::State& s, const Environment& env,
                        const CandidatePair& pair) const {
  const Pose b = dda::pose(s, pair.b);
  const double radius = radius_of(m, pair.b);
  if (pair.a.kind == Partner::Kind::block) {
    const Pose a = dda::pose(s, pair.a.index);
    const Mat3 now = a.F.inverse(), then = a_.F.inverse();
    return a.F.norm() *
           ((now * (b.c - a.c) - then * (b_.c - a_.c)).norm() + radius * (now * b.F - then * b_.F).norm());
  }
  if (!at_skin(env, pair.a)) return own_way(m, s, pair.b);
  const TriangleSurface& surface = skin_of(env, pair.a);
  const Mat3 turn = b.F * b_.F.inverse();
  double most = 0;
  for (std::size_t i = 0; i < vertex_.size(); ++i)
    most = std::max(most,
                    (surface.vertices[static_cast<std::size_t>(vertex_[i])] - b.c - turn * (place_[i] - b_.c))
                        .squaredNorm());
  return std::sqrt(most);
}

/// Bound on how far points of B have moved since the last search [m].
double PairWatch::own_way(const dda::Model& m, const dda::State& s, int block) const {
  const Pose b = dda::pose(s, block);
  return (b.c - b_.c).norm() + radius_of(m, block) * (b.F - b_.F).norm();
}

void PairWatch::look(const dda::Model& m, const dda::State& s, const Environment& env,
                     const CandidatePair& pair, double margin, double reach, double skin_path,
                     std::vector<FoundPoint>& out) {
  // Of a skin in pieces: how far the faces have moved that the points lie on, as seen from B [m]. Loose cells
  // flap beside them.
  const auto faces_moved = [&](const TriangleSurface& skin, const Pose& b) {
    const Mat3 turn = b.F * b_.F.inverse();
    double most = 0;
    for (const Kept& k : points_)
      for (const int v : skin.triangles[static_cast<std::size_t>(k.found.at.face_a)]) {
        const auto watched = std::lower_bound(vertex_.begin(), vertex_.end(), v);
        if (watched == vertex_.end() || *watched != v) return std::numeric_limits<double>::infinity();
        const Vec3& then = place_[static_cast<std::size_t>(watched - vertex_.begin())];
        most = std::max(
            most, (skin.vertices[static_cast<std::size_t>(v)] - b.c - turn * (then - b_.c)).squaredNorm());
      }
    return std::sqrt(most);
  };
  bool holds = searched_ >= 0;
  if (holds && at_skin(env, pair.a))
    holds = skin_of(env, pair.a).revision == revision_ &&
            skin_path - skin_path_ + own_way(m, s, pair.b) <= skin_slack_;
  if (holds) {
    const double way = moved(m, s, env, pair);
    if (way + margin <= least_) return;  // nothing can have come so near
    const double carried = contact::tolerances().carried_way * smaller_radius(m, pair);
    holds = way + margin <= searched_ &&
            (way <= carried ||
             (at_skin(env, pair.a) && faces_moved(skin_of(env, pair.a), dda::pose(s, pair.b)) <= carried));
  }
  if (!holds) search(m, s, env, pair, margin, reach, skin_path);
  carry(s, env, pair, margin, out);
}

void PairWatch::search(const dda::Model& m, const dda::State& s, const Environment& env,
                       const CandidatePair& pair, double margin, double reach, double skin_path) {
  thread_local std::vector<FoundPoint> found;
  found.clear();
  const bool apart = searched_ >= 0 && least_ > margin;
  searched_ = margin + std::max((apart ? steps_apart : search_steps) * reach,
                                contact::tolerances().carried_way * smaller_radius(m, pair));
  b_ = dda::pose(s, pair.b);
  if (pair.a.kind == Partner::Kind::block) a_ = dda::pose(s, pair.a.index);
  find_points(m, s, env, pair, searched_, found);
  points_.clear();
  least_ = searched_;
  for (const FoundPoint& f : found) {
    points_.push_back({f, Vec3::Zero(), Vec3::Zero()});
    least_ = std::min(least_, f.at.gap);
  }
  if (!at_skin(env, pair.a)) return;
  const contact::SurfaceIndex& index = *env.structures[static_cast<std::size_t>(pair.a.index)].index;
  const TriangleSurface& surface = index.surface();
  skin_path_ = skin_path;
  skin_slack_ = contact::tolerances().skin_ahead * radius_of(m, pair.b);
  revision_ = surface.revision;
  contact::near_vertices(
      index, contact::bounds(*m.blocks[static_cast<std::size_t>(pair.b)].shape, b_, searched_ + skin_slack_),
      vertex_);
  place_.clear();
  for (const int v : vertex_) place_.push_back(surface.vertices[static_cast<std::size_t>(v)]);
  for (Kept& k : points_) {
    k.weight = barycentric(surface, k.found.at.face_a, k.found.at.point_a);
    k.beside = k.found.at.point_a - at(surface, k.found.at.face_a, k.weight);
  }
}

/// Points go along with their bodies, normals with the body that motion is seen from: A, or the block at a
/// skin.
void PairWatch::carry(const dda::State& s, const Environment& env, const CandidatePair& pair, double margin,
                      std::vector<FoundPoint>& out) const {
  const Pose b = dda::pose(s, pair.b);
  const Mat3 turn_b = b.F * b_.F.inverse();
  const bool skin = at_skin(env, pair.a);
  Pose a;
  Mat3 turn = skin ? turn_b : Mat3::Identity();
  if (pair.a.kind == Partner::Kind::block) a = dda::pose(s, pair.a.index), turn = a.F * a_.F.inverse();
  const Mat3 back = turn.inverse();
  for (const Kept& k : points_) {
    FoundPoint f = k.found;
    f.at.point_b = b.c + turn_b * (f.at.point_b - b_.c);
    if (pair.a.kind == Partner::Kind::block)
      f.at.point_a = a.c + turn * (f.at.point_a - a_.c);
    else if (skin)
      f.at.point_a = turn * k.beside + at(skin_of(env, pair.a), f.at.face_a, k.weight);
    if (skin || pair.a.kind == Partner::Kind::block) f.at.normal = (turn * f.at.normal).normalized();
    // By how much the two have come apart along the normal as it was, so that what has not moved keeps its
    // gap to the last digit.
    const Vec3 apart = back * (f.at.point_b - f.at.point_a) - (k.found.at.point_b - k.found.at.point_a);
    f.at.gap += k.found.at.normal.dot(apart);
    if (f.at.gap <= margin) out.push_back(f);
  }
}

}  // namespace talus::coupling

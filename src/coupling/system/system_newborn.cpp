// What lies in each other without a blow: blocks where gravity's preload moved a structure's skin into them,
// and pieces that have just come off a structure: what they overlap does not push, and springs that pressed
// on the skin that they took along go on between block and piece.
#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/system/system.hpp"
#include "coupling/touch/contact_numbers.hpp"

namespace talus::coupling {
namespace {

void sort(std::vector<ContactMemory>& list) {
  std::sort(list.begin(), list.end(), [](const ContactMemory& a, const ContactMemory& b) {
    return std::pair(a.partner, a.feature) < std::pair(b.partner, b.feature);
  });
}

/// True if x lies on a face of the piece that looks along n.
bool on_face(const Polyhedron& shape, const Pose& pose, const Vec3& x, const Vec3& n) {
  const double near = contact::tolerances().on_skin * shape.radius;
  for (std::size_t k = 0; k < shape.triangles.size(); ++k) {
    const auto& t = shape.triangles[k];
    const Vec3 a = pose.world(shape.vertices[static_cast<std::size_t>(t[0])]),
               b = pose.world(shape.vertices[static_cast<std::size_t>(t[1])]),
               c = pose.world(shape.vertices[static_cast<std::size_t>(t[2])]);
    const Vec3 twice = (b - a).cross(c - a);
    const double area = twice.norm();
    if (!(twice.dot(n) > 0.5 * area) || std::abs(twice.dot(x - a)) > near * area) continue;
    const double slack = -near * std::sqrt(area) * area;
    if (twice.dot((b - x).cross(c - x)) >= slack && twice.dot((c - x).cross(a - x)) >= slack &&
        twice.dot((a - x).cross(b - x)) >= slack)
      return true;
  }
  return false;
}

/// Springs of the pair's older block on the piece's part of the skin become the pair's own, with their
/// energy. False if there are none.
bool hand_over(const Environment& env, const dda::Model& model, SystemState& state, const CandidatePair& pair,
               int first, std::uint64_t& serial) {
  if (pair.a.kind != Partner::Kind::block || pair.a.index >= first || pair.b < first) return false;
  const auto older = static_cast<std::size_t>(pair.a.index), piece = static_cast<std::size_t>(pair.b);
  const int structure = model.blocks[piece].structure;
  if (structure < 0 || env.laws(model.blocks[older].material, model.blocks[piece].material).stiffness ==
                           ContactLaw::Stiffness::hard)
    return false;
  const std::uint64_t partner = Partner{Partner::Kind::structure, structure}.id();
  const Pose pose = dda::pose(state.blocks, pair.b);
  bool any = false;
  std::erase_if(state.contacts[older], [&](const ContactMemory& m) {
    if (m.partner != partner || !(m.normal_energy > 0) ||
        !on_face(*model.blocks[piece].shape, pose, m.place, m.normal))
      return false;
    ContactMemory own = m;
    own.partner = pair.a.id();
    own.feature = handed_over | serial++;
    own.force *= -1;
    own.shear *= -1;
    own.shear_way *= -1;
    own.normal *= -1;
    own.offset = own.crushed = 0;
    state.contacts[piece].push_back(own);
    return any = true;
  });
  sort(state.contacts[piece]);
  return any;
}

void remember_inside(std::vector<ContactMemory>& list, std::uint64_t partner, double deepest) {
  ContactMemory memory;
  memory.partner = partner;
  memory.feature = born_inside;
  memory.indentation = deepest;
  list.push_back(memory);
}

}  // namespace

void start_touching(CoupledSystem& system, const CandidatePair& pair, std::span<const Touch> touches) {
  auto& list = system.state().contacts[static_cast<std::size_t>(pair.b)];
  double deepest = 0;
  for (const Touch& t : touches) {
    if (t.at.gap >= 0) continue;
    if (t.normal_law.bed == nullptr || t.law->crushes()) {
      deepest = std::max(deepest, t.offset - t.at.gap);
      continue;
    }
    ContactMemory memory;  // the bed stands from there on
    memory.partner = pair.a.id();
    memory.feature = t.at.key;
    memory.crushed = t.offset - t.at.gap;
    list.push_back(memory);
  }
  if (deepest > 0) remember_inside(list, pair.a.id(), deepest);
  sort(list);
}

void settle_newborn(CoupledSystem& system, int first) {
  const dda::Model& model = system.model();
  const Environment& env = system.environment();
  SystemState& state = system.state();
  const int n = static_cast<int>(model.blocks.size());
  std::vector<Box3> boxes;
  for (int i = 0; i < n; ++i)
    boxes.push_back(
        contact::bounds(*model.blocks[static_cast<std::size_t>(i)].shape, dda::pose(state.blocks, i), 0));
  std::vector<std::pair<int, int>> pairs;
  std::uint64_t serial = 0;
  contact::overlapping_pairs(boxes, pairs);
  std::vector<CandidatePair> candidates;
  for (const auto& [i, j] : pairs)
    if (j >= first) candidates.push_back({{Partner::Kind::block, i}, j});
  for (int i = first; i < n; ++i) {
    for (std::size_t q = 0; q < env.planes.size(); ++q)
      candidates.push_back({{Partner::Kind::plane, static_cast<int>(q)}, i});
    if (env.terrain) candidates.push_back({{Partner::Kind::terrain, 0}, i});
    for (std::size_t q = 0; q < env.structures.size(); ++q)
      candidates.push_back({{Partner::Kind::structure, static_cast<int>(q)}, i});
  }
  std::vector<Touch> touches;
  for (const CandidatePair& pair : candidates) {
    if (hand_over(env, model, state, pair, first, serial)) continue;
    touches.clear();
    find_touches(model, state.blocks, env, pair, 0, state.contacts, touches);
    double deepest = 0;
    for (const Touch& t : touches) deepest = std::max(deepest, t.offset - t.at.gap);
    if (!(deepest > 0)) continue;
    auto& list = state.contacts[static_cast<std::size_t>(pair.b)];
    remember_inside(list, pair.a.id(), deepest);
    sort(list);
  }
}

}  // namespace talus::coupling

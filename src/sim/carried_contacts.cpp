#include "sim/carried_contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "coupling/touch/contact_numbers.hpp"

namespace talus::sim {
namespace {

using coupling::ContactMemory;
using coupling::Partner;

/// FNV-1a over the words of the coordinates.
std::int64_t form_of(std::span<const Vec3> points) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const Vec3& x : points)
    for (const double coordinate : x) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(coordinate + 0.0)) * 0x100000001b3ULL;  // -0 is 0
      hash ^= hash >> 32;
    }
  return std::bit_cast<std::int64_t>(hash);
}

struct NamedBody {
  std::uint64_t id;
  FinalState::Body body;
};  // Partner::id

std::vector<NamedBody> bodies_of(const World& w) {
  std::vector<NamedBody> list;
  const auto add = [&](Partner::Kind kind, std::size_t index, std::string name,
                       std::span<const Vec3> points) {
    list.push_back({Partner{kind, static_cast<int>(index)}.id(), {std::move(name), form_of(points)}});
  };
  const dda::Model& model = w.system->model();
  const coupling::Environment& env = w.system->environment();
  for (std::size_t i = 0; i < model.blocks.size(); ++i)
    add(Partner::Kind::block, i, "block " + model.blocks[i].name, model.blocks[i].shape->vertices);
  for (std::size_t i = 0; i < env.planes.size(); ++i)
    add(Partner::Kind::plane, i, "plane", std::array{env.planes[i].point, env.planes[i].normal});
  if (env.terrain)
    add(Partner::Kind::terrain, 0, "terrain",
        w.header.terrain.vertices);  // without the walls below it, which depend on the blocks
  for (std::size_t i = 0; i < env.structures.size(); ++i)
    add(Partner::Kind::structure, i, "structure " + w.scene.structures[i].name,
        env.structures[i].structure->built_nodes());
  return list;
}

/// The block of two that a pair counts as its second, as the search for contacts has it; -1 if neither moves.
int second_of(const dda::Model& model, int i, int j) {
  const auto moves = [&](int k) { return model.blocks[static_cast<std::size_t>(k)].ndof() > 0; };
  const auto [low, high] = std::minmax(i, j);
  return moves(high) ? high : moves(low) ? low : -1;
}

/// The same contact as seen by the other block, under a feature that none is found by: those that are take it
/// over. `a`, `b`: where its two blocks are, as it names them.
ContactMemory seen_from_the_other(ContactMemory m, std::uint64_t serial, const Pose& a, const Pose& b) {
  if (m.feature != coupling::born_inside) m.feature = coupling::handed_over | serial;
  m.force *= -1, m.shear *= -1, m.shear_way *= -1, m.normal *= -1;
  coupling::BondedAt& bond = m.bonded;
  std::swap(bond.point_a, bond.point_b);
  std::swap(bond.face_a, bond.face_b);
  bond.normal = -(b.F.transpose() * (a.F.inverse().transpose() * bond.normal).normalized());
  return m;
}

}  // namespace

void keep_contacts(const World& w, FinalState& state) {
  if (w.paper) return;
  std::map<std::uint64_t, std::int64_t> place;
  for (NamedBody& b : bodies_of(w)) {
    place[b.id] = static_cast<std::int64_t>(state.bodies.size());
    state.bodies.push_back(std::move(b.body));
  }
  const coupling::SystemState& s = w.system->state();
  const auto keep = [&](Partner::Kind kind, const coupling::ContactHistory& history) {
    for (std::size_t i = 0; i < history.size(); ++i)
      for (const ContactMemory& m : history[i])
        state.contacts.push_back({place.at(Partner{kind, static_cast<int>(i)}.id()), place.at(m.partner), m});
  };
  keep(Partner::Kind::block, s.contacts);
  keep(Partner::Kind::structure, s.surface_contacts);
}

coupling::KnownPairs restore_contacts(World& w, const FinalState& state) {
  const dda::Model& model = w.system->model();
  coupling::SystemState& s = w.system->state();
  for (auto* history : {&s.contacts, &s.surface_contacts})
    for (auto& list : *history) list.clear();

  std::map<std::pair<std::string, std::int64_t>, std::int64_t> then;
  for (std::size_t i = 0; i < state.bodies.size(); ++i)
    then[{state.bodies[i].name, state.bodies[i].form}] = static_cast<std::int64_t>(i);
  std::map<std::int64_t, Partner> now;  // by the place in state.bodies
  auto known = std::make_shared<std::set<std::uint64_t>>();
  for (const NamedBody& b : bodies_of(w)) {
    const Partner p{static_cast<Partner::Kind>(b.id >> 32), static_cast<int>(b.id & 0xffffffff)};
    const auto found = then.find({b.body.name, b.body.form});
    if (found == then.end()) continue;
    if (p.kind == Partner::Kind::block &&
        !state.blocks.contains(model.blocks[static_cast<std::size_t>(p.index)].name))
      continue;
    now[found->second] = p;
    known->insert(b.id);
  }

  std::uint64_t serial = 0;
  for (const FinalState::Contact& c : state.contacts) {
    const auto body = now.find(c.body), partner = now.find(c.partner);
    if (body == now.end() || partner == now.end()) continue;
    Partner of = body->second, with = partner->second;
    ContactMemory m = c.memory;
    if (of.kind == Partner::Kind::block && with.kind == Partner::Kind::block) {
      const int second = second_of(model, of.index, with.index);
      if (second < 0) continue;
      if (second != of.index) {
        m = seen_from_the_other(m, serial++, dda::pose(s.blocks, with.index), dda::pose(s.blocks, of.index));
        std::swap(of, with);
      }
    }
    m.partner = with.id();
    (of.kind == Partner::Kind::block ? s.contacts : s.surface_contacts)[static_cast<std::size_t>(of.index)]
        .push_back(m);
  }
  for (auto* history : {&s.contacts, &s.surface_contacts})
    for (auto& list : *history)
      std::sort(list.begin(), list.end(), [](const ContactMemory& x, const ContactMemory& y) {
        return std::pair(x.partner, x.feature) < std::pair(y.partner, y.feature);
      });
  return [known](const coupling::CandidatePair& pair) {
    return known->contains(pair.a.id()) && known->contains(Partner{Partner::Kind::block, pair.b}.id());
  };
}

}  // namespace talus::sim

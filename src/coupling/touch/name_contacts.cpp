#include "coupling/touch/name_contacts.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace talus::coupling {
namespace {

constexpr std::size_t by_name = 3;

struct Pair {
  Partner a;
  int b, b_structure;
  double impulse;  // largest of its contacts [N s]
};

std::string block_or_structure(const dda::Model& model, int block, int structure) {
  return block >= 0 ? model.blocks[static_cast<std::size_t>(block)].name
                    : fmt::format("structure {}", structure + 1);
}

std::string name(const dda::Model& model, const Partner& a) {
  switch (a.kind) {
    case Partner::Kind::block: return model.blocks[static_cast<std::size_t>(a.index)].name;
    case Partner::Kind::plane: return fmt::format("plane {}", a.index + 1);
    case Partner::Kind::terrain: return "the terrain";
    case Partner::Kind::structure: break;
  }
  return fmt::format("structure {}", a.index + 1);
}

}  // namespace

std::string name_contacts(const dda::Model& model, const std::vector<Touch>& touches) {
  std::vector<Pair> pairs;
  for (const Touch& t : touches) {
    if (t.row < 0) continue;
    auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& p) {
      return p.a == t.a && p.b == t.b && p.b_structure == t.b_structure;
    });
    if (pair == pairs.end()) pair = pairs.insert(pairs.end(), {t.a, t.b, t.b_structure, 0.0});
    pair->impulse = std::max(pair->impulse, t.impulse.norm());
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& p, const Pair& q) { return p.impulse > q.impulse; });
  std::string text;
  for (std::size_t i = 0; i < std::min(by_name, pairs.size()); ++i)
    text += fmt::format("{}{} on {}", i > 0 ? ", " : "",
                        block_or_structure(model, pairs[i].b, pairs[i].b_structure), name(model, pairs[i].a));
  if (pairs.size() > by_name) text += fmt::format(" and {} more", pairs.size() - by_name);
  return text;
}

}  // namespace talus::coupling

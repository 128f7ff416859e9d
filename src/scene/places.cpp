// Where in its file the scene says something, for problems that show when the world is built.
#include <fmt/format.h>

#include "scene/reading.hpp"

namespace talus::scene {
namespace {

void note(const Node& node, const std::string& name, std::map<std::string, Where>& places) {
  const bool list = !node.items.empty() &&
                    node.items.front().kind == Node::Kind::table;  // its entries have places of their own
  if (!name.empty() && !list && node.where.line > 0) places.emplace(name, node.where);
  const std::string below = name.empty() ? "" : name + ".";
  for (const Node::Entry& entry : node.entries) note(entry.value, below + entry.key, places);
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    const Node& item = node.items[i];
    if (item.kind != Node::Kind::table) continue;
    note(item, item.label.starts_with(below) ? item.label : below + std::to_string(i), places);
    if (!item.find("name") && name == "block") note(item, fmt::format("block.B{}", i + 1), places);
    if (!item.find("name") && name == "structure") note(item, fmt::format("structure.S{}", i + 1), places);
  }
}

const Where* find(const Scene& scene, std::string key) {
  while (true) {
    if (const auto found = scene.places.find(key); found != scene.places.end()) return &found->second;
    const auto dot = key.rfind('.');
    if (dot == std::string::npos) return nullptr;
    key.resize(dot);
  }
}

}  // namespace

void note_places(const Node& root, std::map<std::string, Where>& places) { note(root, "", places); }

const Where* place_of(const Scene& scene, const std::string& key) {
  if (key.starts_with("interface.")) {  // the pair as the world has it, whichever way round and by whatever
                                        // stars the scene has it
    const std::string pair = key.substr(key.find('.') + 1, key.rfind('.') - key.find('.') - 1);
    const std::string a = pair.substr(0, pair.find('/')), b = pair.substr(pair.find('/') + 1),
                      last = key.substr(key.rfind('.'));
    for (const std::string& entry :
         {a + "/" + b, b + "/" + a, a + "/*", "*/" + a, b + "/*", "*/" + b, std::string("*/*")})
      if (scene.places.count("interface." + entry) > 0) return find(scene, "interface." + entry + last);
    return nullptr;
  }
  if (const Where* place = find(scene, key); place || !key.starts_with("block.")) return place;
  if (const auto serial = key.rfind('-'); serial != std::string::npos)  // a copy of a release, "B-3"
    if (const Where* place = find(scene, key.substr(0, serial))) return place;
  return find(scene, "rock_mass");
}

}  // namespace talus::scene

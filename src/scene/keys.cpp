#include "scene/keys.hpp"

#include <algorithm>

#include "scene/key_tables.hpp"

namespace talus::scene {

const std::vector<Key>& keys() {
  static const std::vector<Key> table = [] {
    std::vector<Key> all;
    for (auto part :
         {general_keys(), contact_keys(), block_keys(), rock_mass_keys(), structure_keys(), ensemble_keys()})
      all.insert(all.end(), std::make_move_iterator(part.begin()), std::make_move_iterator(part.end()));
    return all;
  }();
  return table;
}

const Key* find_key(const std::string& path) {
  for (const Key& key : keys())
    if (key.path == path) return &key;
  return nullptr;
}

std::vector<std::string> keys_below(const std::string& table) {
  std::vector<std::string> names;
  const std::string prefix = table.empty() ? "" : table + ".";
  for (const Key& key : keys()) {
    if (key.path.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string rest = key.path.substr(prefix.size());
    if (!rest.empty() && rest.find('.') == std::string::npos) names.push_back(rest);
  }
  return names;
}

std::vector<std::string> all_keys() {
  std::vector<std::string> names;
  for (const Key& key : keys()) names.push_back(key.path);
  return names;
}

}  // namespace talus::scene

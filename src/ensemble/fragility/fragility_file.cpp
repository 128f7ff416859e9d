#include "ensemble/fragility/fragility_file.hpp"

#include <algorithm>
#include <utility>

#include "io/files.hpp"
#include "io/json_file.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::vector<Json> read_fragility(const fs::path& directory) {
  const fs::path file = directory / "fragility.json";
  if (!fs::exists(file)) return {};
  std::vector<Json> all{io::read_json(file, "run talus fragility again")};
  if (const auto others = all.front().find("others"); others != all.front().end()) {
    Json list = std::move(*others);
    all.front().erase(others);
    all.insert(all.end(), list.begin(), list.end());
  }
  return all;
}

void keep_fragility(const fs::path& directory, Json figures) {
  std::vector<Json> others = read_fragility(directory);
  const auto name = [](const Json& f) { return f.value("structure", ""); };
  std::erase_if(others, [&](const Json& f) { return name(f) == name(figures); });
  std::sort(others.begin(), others.end(), [&](const Json& a, const Json& b) { return name(a) < name(b); });
  if (!others.empty()) figures["others"] = std::move(others);
  io::write_file(directory / "fragility.json", figures.dump(2) + "\n");
}

}  // namespace talus::ensemble

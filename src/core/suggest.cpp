#include "core/suggest.hpp"

#include <algorithm>
#include <cctype>

namespace talus {

int edit_distance(std::string_view a, std::string_view b) {
  // Names are short; what is longer is no misspelling, and must not cost a quadratic table.
  a = a.substr(0, 128);
  b = b.substr(0, 128);
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<int> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int cost = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + cost});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(previous);
    previous.swap(row);
  }
  return previous[b.size()];
}

std::string nearest_name(std::string_view wrong, const std::vector<std::string>& known) {
  std::string best;
  int least = 1 << 20;
  for (const std::string& name : known) {
    const int distance = edit_distance(wrong, name);
    if (distance < least) {
      least = distance;
      best = name;
    }
  }
  const int allowed = std::max(1, static_cast<int>(std::max(wrong.size(), best.size())) / 3);
  return least <= allowed ? best : std::string();
}

}  // namespace talus

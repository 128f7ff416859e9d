#include <charconv>
#include <map>
#include <optional>

#include "geometry/mesh_builder.hpp"

namespace talus::geometry {
namespace {

/// The text of a DataArray by its Name ("" for the only one within Points).
class Arrays {
 public:
  Arrays(const std::string& text, std::string name) : text_(text), name_(std::move(name)) {}

  std::string_view find(const std::string& array, const std::string& within) const {
    const auto section = text_.find("<" + within), end = text_.find("</" + within + ">");
    if (section == std::string::npos || end == std::string::npos) return {};
    for (auto at = text_.find("<DataArray", section); at < end; at = text_.find("<DataArray", at + 1)) {
      const auto close = text_.find('>', at);
      if (close == std::string::npos) break;
      const std::string_view tag(text_.data() + at, close - at);
      const auto gives = [&](const std::string& key, const std::string& value) {
        return tag.find(key + "=\"" + value + "\"") != std::string_view::npos ||
               tag.find(key + "='" + value + "'") != std::string_view::npos;
      };
      if (!array.empty() && !gives("Name", array)) continue;
      if (!gives("format", "ascii"))
        throw InputError(Problem{.file = name_,
                                 .key = "vtu " + within,
                                 .value = array,
                                 .rule = "is not in text form (format=\"ascii\")",
                                 .remedy = "save it as ASCII, or convert it to OBJ with groups"});
      return std::string_view(text_).substr(close + 1, text_.find("</DataArray>", close) - close - 1);
    }
    return {};
  }

  template <class T>
  std::vector<T> numbers(const std::string& array, const std::string& within) const {
    std::vector<T> out;
    TextCursor in(find(array, within), name_);
    while (!in.at_end()) out.push_back(in.number<T>(array.c_str()));
    return out;
  }

 private:
  const std::string& text_;
  std::string name_;
};

/// The whole number that the first tag of a kind gives under a name; nothing if it gives none.
std::optional<long> attribute(const std::string& text, const std::string& tag, const std::string& name) {
  const auto begin = text.find("<" + tag);
  if (begin == std::string::npos) return {};
  const std::string_view whole(text.data() + begin, std::min(text.find('>', begin), text.size()) - begin);
  const auto at = whole.find(name + "=");
  if (at == std::string_view::npos) return {};
  const auto first = whole.find_first_of("0123456789", at);
  long value = 0;
  if (first == std::string_view::npos ||
      std::from_chars(whole.data() + first, whole.data() + whole.size(), value).ec != std::errc{})
    return {};
  return value;
}

}  // namespace

Mesh read_vtu(const std::string& text, const std::string& name) {
  const Arrays arrays(text, name);
  const auto fail = [&](const std::string& rule) {
    return InputError(
        Problem{.file = name,
                .key = "vtu",
                .rule = rule,
                .remedy = "give an UnstructuredGrid of triangles or polygons, as `talus cut` writes it"});
  };
  if (text.find("type=\"UnstructuredGrid\"") == std::string::npos) throw fail("is no UnstructuredGrid");
  if (const auto first = text.find("<Piece"); text.find("<Piece", first + 1) != std::string::npos)
    throw fail("holds several pieces (<Piece>), and one is read");
  Builder b;
  b.name = name;
  const auto x = arrays.numbers<double>("", "Points");
  for (std::size_t k = 0; k + 2 < x.size(); k += 3) b.points.emplace_back(x[k], x[k + 1], x[k + 2]);
  const auto corners = arrays.numbers<long>("connectivity", "Cells"),
             offsets = arrays.numbers<long>("offsets", "Cells"),
             types = arrays.numbers<long>("types", "Cells");
  const auto block = arrays.numbers<long>("block", "CellData");
  if (types.size() != offsets.size() || (!block.empty() && block.size() != offsets.size()))
    throw fail("its arrays differ in length");
  const auto count = [&](const char* what, const char* key, std::size_t found) {
    if (const auto said = attribute(text, "Piece", key); said && *said != static_cast<long>(found))
      throw fail(fmt::format("its header counts {} {} ({}), and it holds {}", *said, what, key, found));
  };
  if (x.size() % 3 != 0) throw fail(fmt::format("its points are {} numbers, not three each", x.size()));
  count("points", "NumberOfPoints", b.points.size());
  count("cells", "NumberOfCells", offsets.size());
  if (const long last = offsets.empty() ? 0 : offsets.back(); last < static_cast<long>(corners.size()))
    throw fail(fmt::format("its cells use {} corners of the {} in connectivity", last, corners.size()));
  std::vector<int> loop;
  long begin = 0;
  for (std::size_t c = 0; c < offsets.size(); ++c) {
    if (types[c] != 5 && types[c] != 7 && types[c] != 9)
      throw fail(fmt::format(
          "cell {} is of type {}: only triangles (5), polygons (7) and quadrilaterals (9) make a surface", c,
          types[c]));
    if (offsets[c] < begin || offsets[c] > static_cast<long>(corners.size()))
      throw fail(fmt::format("the offset of cell {} lies outside its connectivity", c));
    loop.clear();
    for (long k = begin; k < offsets[c]; ++k) {
      if (corners[k] < 0 || corners[k] >= static_cast<long>(b.points.size()))
        throw fail(fmt::format("cell {} names point {} of {}", c, corners[k], b.points.size()));
      loop.push_back(static_cast<int>(corners[k]));
    }
    begin = offsets[c];
    if (!block.empty()) b.start_group("R" + std::to_string(block[c]));
    b.face(loop, nullptr);
  }
  return b.finish();
}

}  // namespace talus::geometry

#include <map>

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
      if (!array.empty() && tag.find("Name=\"" + array + "\"") == std::string_view::npos) continue;
      if (tag.find("format=\"ascii\"") == std::string_view::npos)
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

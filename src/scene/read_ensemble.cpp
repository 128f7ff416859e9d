// [[line]] and [ensemble].
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

void read_lines(Reading& in, const View& root) {
  std::map<std::string, int> taken;
  for (const View& view : root.tables("line")) {
    Line line;
    line.name = in.name(view, "name", "line", taken);
    line.file = in.file(view, "file");
    if (view.has("points") == view.has("file"))
      view.problem(
          "", "needs points or a file, and not both",
          "give points = [[x, y], ...] in scene coordinates, or file = \"road.geojson\" in map coordinates");
    if (const Node* points = view.get("points")) {
      std::vector<Eigen::Vector2d>& part = line.parts.emplace_back();
      for (const Node& item : points->items) part.emplace_back(vector_of(item, dimension::length).head<2>());
      for (std::size_t i = 1; i < part.size(); ++i)
        if (part[i] == part[i - 1])
          view.problem("points", fmt::format("points {} and {} are the same", i - 1, i),
                       "remove one of them");
    }
    in.scene.lines.push_back(std::move(line));
  }
}

/// Value and unit of an amount that validate() has passed.
Quantity amount_of(const Node& node) {
  if (node.is_number()) return {node.as_number(), {}};
  std::string error;
  return parse_quantity(node.text, error).value_or(Quantity{});
}

class VaryReader {
 public:
  VaryReader(Reading& in, const View& view, Vary& vary) : in_(in), view_(view), vary_(vary) {}

  void read(int place) {
    vary_.key = view_.text("key");
    static const std::vector<std::pair<const char*, Vary::Kind>> kinds{
        {"lognormal", Vary::Kind::lognormal}, {"normal", Vary::Kind::normal},
        {"uniform", Vary::Kind::uniform},     {"power_law", Vary::Kind::power_law},
        {"list", Vary::Kind::list},           {"table", Vary::Kind::table},
        {"rotation", Vary::Kind::rotation}};
    int given = 0;
    for (const auto& [name, kind] : kinds)
      if (view_.has(name)) ++given, vary_.kind = kind;
    const bool release = vary_.key.ends_with(".release");
    if (given == 0 && release)
      vary_.kind = Vary::Kind::release;
    else if (release)
      view_.problem("", "a release takes no distribution: its area says where",
                    "remove it; uniform over the area is what is drawn");
    else if (given != 1)
      view_.problem("", given == 0 ? "has no distribution" : "has more than one distribution",
                    "give one of lognormal, normal, uniform, power_law, list, table, rotation");
    read_unit();
    read_distribution();
    if (view_.get("like")) {
      vary_.like = static_cast<int>(view_.integer("like"));
      if (vary_.like >= place)
        view_.problem("like", "must name an earlier variable", "count the [[ensemble.vary]] from 0");
    }
    if ((vary_.min || vary_.max) && (vary_.kind == Vary::Kind::rotation ||
                                     vary_.kind == Vary::Kind::release || vary_.kind == Vary::Kind::list))
      view_.problem(vary_.min ? "min" : "max", "there is nothing to cut", "remove it");
    if (vary_.min && vary_.max && *vary_.min >= *vary_.max)
      view_.problem("max", "must be larger than min", "swap them");
  }

 private:
  /// Numbers of the variable carry one unit, or none. An angle without its unit is in radians, as everywhere.
  void read_unit() {
    bool first = true;
    Dimension unit;
    const auto look = [&](const char* key, const Node& node) {
      const Dimension dimension = amount_of(node).dimension;
      if (!first && dimension != unit)
        view_.problem(key, "its numbers are of different units", "give all of them in one unit");
      first = false;
      unit = dimension;
    };
    for (const char* key : {"lognormal", "normal", "uniform", "power_law"})
      if (const Node* node = view_.get(key))
        for (std::size_t i = std::string(key) == "power_law" ? 1 : 0; i < node->items.size(); ++i)
          look(key, node->items[i]);
    for (const char* key : {"min", "max"})
      if (const Node* node = view_.get(key)) look(key, *node);
    if (!unit.none()) vary_.unit = unit_name(unit);
    if (const Node* node = view_.get("min")) vary_.min = amount_of(*node).value;
    if (const Node* node = view_.get("max")) vary_.max = amount_of(*node).value;
  }

  void read_distribution() {
    const auto numbers = [&](const char* key, std::size_t count) {
      const Node* node = view_.get(key);
      if (!node) return false;
      if (node->items.size() != count) {
        view_.problem(key, fmt::format("takes {} numbers, not {}", count, node->items.size()),
                      fmt::format("see talus explain ensemble.vary.{}", key));
        return false;
      }
      for (std::size_t i = 0; i < count; ++i) vary_.parameters[i] = amount_of(node->items[i]).value;
      return true;
    };
    const auto& p = vary_.parameters;
    switch (vary_.kind) {
      case Vary::Kind::lognormal:
        if (numbers("lognormal", 2) && !(p[0] > 0 && p[1] > 0))
          view_.problem("lognormal", "mean and standard deviation must be > 0",
                        "they are those of the quantity itself, not of its logarithm");
        return;
      case Vary::Kind::normal:
        if (numbers("normal", 2) && !(p[1] > 0))
          view_.problem("normal", "the standard deviation must be > 0",
                        "leave the variable out for a fixed value");
        return;
      case Vary::Kind::uniform:
        if (numbers("uniform", 2) && !(p[0] < p[1]))
          view_.problem("uniform", "low must be less than high", "swap them");
        return;
      case Vary::Kind::power_law:
        if (numbers("power_law", 3) && !(p[1] > 0 && p[1] < p[2]))
          view_.problem("power_law", "needs 0 < min < max", "write [exponent, min, max]");
        return;
      case Vary::Kind::list:
        if (const Node* node = view_.get("list"))
          for (const Node& item : node->items) vary_.list.push_back(inline_toml(item));
        return;
      case Vary::Kind::table: {
        const std::string path = in_.file(view_, "table");
        if (path.empty()) return;
        const Key* key = key_of_path(vary_.key);
        const NumberTable table = read_numbers(view_, "table", path, 1, [&](std::size_t, const std::string&) {
          const bool quantity = key != nullptr && key->type == Type::quantity;
          return ColumnHolds{true, quantity ? std::optional(key->dimension) : std::nullopt};
        });
        for (const auto& row : table.rows) vary_.table.push_back(row.front());
        if (!table.units.empty() && !table.units[0].none()) vary_.unit = unit_name(table.units[0]);
        std::sort(vary_.table.begin(), vary_.table.end());
        return;
      }
      case Vary::Kind::rotation:
        if (!vary_.key.ends_with(".orientation"))
          view_.problem("key", "rotation is for an orientation",
                        "write for example key = \"block.B1.orientation\"");
        return;
      case Vary::Kind::release: return;
    }
  }

  Reading& in_;
  const View& view_;
  Vary& vary_;
};

/// Keys may be written in several ways: by name or place, pairs of materials either way round. A release
/// gives its block one place a member, `at`, and so sets `count` as well.
void check_that_none_is_drawn_twice(const std::vector<View>& views, const std::vector<Vary>& vary,
                                    const Node& whole) {
  std::vector<KeyPlace> places;
  for (const Vary& v : vary) places.push_back(place_of_key(whole, v.key));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto same = [&](const std::string& key) {
      return static_cast<std::size_t>(
          std::find_if(places.begin(), places.end(), [&](const KeyPlace& p) { return p.key == key; }) -
          places.begin());
    };
    if (const std::size_t j = same(places[i].key); j < i)
      views[i].problem("key",
                       fmt::format("variable {} draws it already{}", j,
                                   vary[i].key == vary[j].key ? "" : ", as " + vary[j].key),
                       "keep one of them");
    if (vary[i].kind != Vary::Kind::release) continue;
    for (const char* set : {".at", ".count"})
      if (const std::size_t j = same(places[i].key + set); j < places.size())
        views[j].problem("key", fmt::format("variable {}, {}, sets it already", i, vary[i].key),
                         "keep one of them");
    const Node* count = places[i].value ? places[i].value->find("count") : nullptr;
    if (count && count->is_number() && count->as_number() > 1)
      views[i].problem(
          "key",
          fmt::format("a member draws one place for its block, and the scene releases {:g} of it",
                      count->as_number()),
          "leave release.count out and take as many more members; blocks that are to fall "
          "together need a [[block]] each");
  }
}

}  // namespace

void read_ensemble(Reading& in, const View& root, const Node& whole) {
  read_lines(in, root);
  const auto view = root.table("ensemble");
  if (!view) return;
  Ensemble e;
  const std::string design = view->text("design");
  e.design = design == "sobol"       ? Ensemble::Design::sobol
             : design == "factorial" ? Ensemble::Design::factorial
                                     : Ensemble::Design::random;
  e.members = view->get("members") ? view->integer("members") : 0;
  e.seed = static_cast<std::uint32_t>(view->integer("seed"));
  e.step_limit = view->integer("step_limit");
  e.map_cell = view->number("map_cell");
  e.releases_per_year = view->maybe("releases_per_year").value_or(0);
  if (const auto precision = view->table("precision")) {
    e.precision = Ensemble::Precision{precision->text("line"), precision->text("quantity"),
                                      precision->number("percentile"), precision->number("within")};
    if (std::none_of(in.scene.lines.begin(), in.scene.lines.end(),
                     [&](const Line& line) { return line.name == e.precision->line; }))
      precision->problem("line", "there is no such [[line]]", "name one of the scene's");
  }
  int place = 0;
  for (const View& vary : view->tables("vary")) VaryReader(in, vary, e.vary.emplace_back()).read(place++);
  for (std::size_t i = 0; i < e.vary.size(); ++i) {
    // What is the same for all members, or says nothing of their motion.
    const std::string& key = e.vary[i].key;
    constexpr std::string_view common[] = {
        "ensemble", "line", "output", "title", "schema", "resolved", "simulation.threads"};
    for (const std::string_view top : common)
      if (key == top || (key.starts_with(top) && key[top.size()] == '.'))
        view->tables("vary")[i].problem("key", "is the same for all members: drawing it changes nothing",
                                        "draw a key of the scene: of a block, an interface, a plane, ...");
  }
  check_that_none_is_drawn_twice(view->tables("vary"), e.vary, whole);
  const bool lists =
      std::any_of(e.vary.begin(), e.vary.end(), [](const Vary& v) { return v.kind == Vary::Kind::list; });
  if (e.design == Ensemble::Design::factorial && !lists)
    view->problem("design", "factorial combines lists, and no variable has one",
                  "give a variable list = [...], or take design \"random\"");
  if (e.members == 0 && !e.precision && e.design != Ensemble::Design::factorial && !view->has("members"))
    view->missing("members", "or precision");
  in.scene.ensemble = std::move(e);
}

}  // namespace talus::scene

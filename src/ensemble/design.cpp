#include "ensemble/design.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "core/units.hpp"
#include "ensemble/random.hpp"
#include "ensemble/statistics.hpp"
#include "scene/document.hpp"
#include "scene/keys.hpp"
#include "scene/view.hpp"

namespace talus::ensemble {
namespace {

using Kind = scene::Vary::Kind;

constexpr long default_most = 100000;         // members of an ensemble that stops by its precision
constexpr std::uint32_t most_tries = 100000;  // for a place within the polygons and over ground
constexpr long planned_members = 1000;        // of which the plan states the whole numbers drawn

InputError fault(const std::string& file, const scene::Vary& v, std::string rule, std::string remedy) {
  return InputError(Problem{.severity = Problem::Severity::error,
                            .file = file,
                            .line = 0,
                            .column = 0,
                            .key = "ensemble.vary",
                            .value = v.key,
                            .rule = std::move(rule),
                            .remedy = std::move(remedy)});
}

/// Uniform over all orientations [Shoemake 1992]: w, x, y, z.
std::array<double, 4> rotation_of(double u, double v, double w) {
  const double a = 2 * std::numbers::pi * v, b = 2 * std::numbers::pi * w, p = std::sqrt(1 - u),
               q = std::sqrt(u);
  return {q * std::cos(b), p * std::sin(a), p * std::cos(a), q * std::sin(b)};
}

std::string list_text(std::span<const double> values) {
  std::string text = "[";
  for (const double x : values) text += (text.size() > 1 ? ", " : "") + exact_text(x);
  return text + "]";
}

/// Value of a list as a number, if it is one.
std::optional<Quantity> number_of(const std::string& toml) {
  const scene::Node node = scene::parse_toml_value(toml, "");
  std::string error;
  if (node.is_number()) return Quantity{node.as_number(), {}};
  if (node.kind != scene::Node::Kind::text) return {};
  return parse_quantity(node.text, error);
}

/// The values of a list as numbers of one unit; nothing if they are none. A number alone is in the unit of
/// the key, where that has one; frictions are coefficients, those given as angles too.
std::optional<std::vector<double>> numbers_of(const std::vector<std::string>& list, const scene::Key* key,
                                              Dimension& unit) {
  const auto of_key = [&](scene::Type type) { return key != nullptr && key->type == type; };
  std::vector<double> numbers;
  for (const std::string& text : list) {
    auto number = number_of(text);
    if (!number) return {};
    if (number->dimension.none() && of_key(scene::Type::quantity)) number->dimension = key->dimension;
    if (number->dimension == dimension::angle && of_key(scene::Type::friction))
      number = Quantity{std::tan(number->value), {}};
    if (!numbers.empty() && number->dimension != unit) return {};
    unit = number->dimension;
    numbers.push_back(number->value);
  }
  return numbers;
}

}  // namespace

struct Design::Variable {
  scene::Vary vary;
  const scene::Key* key = nullptr;  // null: none such, which the scene will say
  std::optional<Distribution> distribution;
  int dimension = 0;  // of the first coordinate
  int column = 0;
  long stride = 1;              // factorial: combinations that pass before the list goes on
  std::vector<double> numbers;  // of the list, if all are
  std::string block;            // release
  geometry::Area area;
  geometry::AreaExtent extent;
  bool turns = false;
  bool whole = false;  // the key takes whole numbers
};

Design::Design(Design&&) noexcept = default;
Design::~Design() = default;

Design::Design(const scene::Ensemble& ensemble, const scene::Template& scene) : ensemble_(ensemble) {
  int dimension = 0;
  for (const scene::Vary& vary : ensemble.vary) {
    Variable v;
    v.vary = vary;
    v.key = scene::key_of_path(vary.key);
    v.whole = v.key && v.key->type == scene::Type::integer;
    const bool single = vary.kind != Kind::rotation && vary.kind != Kind::release;
    if (vary.like >= 0) {
      const Variable& other = variables_[static_cast<std::size_t>(vary.like)];
      if (!single || other.vary.kind == Kind::rotation || other.vary.kind == Kind::release)
        throw fault(scene.file(), vary, "like joins variables of one number each", "leave like out");
      if (ensemble.design == scene::Ensemble::Design::factorial && vary.kind == Kind::list &&
          other.vary.kind == Kind::list && vary.list.size() != other.vary.list.size())
        throw fault(scene.file(), vary, "lists that go together need the same length",
                    "give both as many values");
      v.dimension = other.dimension;
      v.stride = other.stride;
    } else {
      v.dimension = dimension;
      dimension += vary.kind == Kind::rotation ? 3 : vary.kind == Kind::release ? 5 : 1;
      if (ensemble.design == scene::Ensemble::Design::factorial && vary.kind == Kind::list) {
        v.stride = combinations_;
        combinations_ *= static_cast<long>(vary.list.size());
      }
    }
    Column column{.name = vary.key,
                  .width = vary.kind == Kind::rotation  ? 4
                           : vary.kind == Kind::release ? 2
                                                        : 1,
                  .text = false,
                  .unit = vary.unit.empty() ? "1" : vary.unit,
                  .description = "drawn for each member"};
    if (vary.kind == Kind::rotation)
      column.unit = "1", column.description = "quaternion w, x, y, z, body to world";
    if (vary.kind == Kind::release)
      column.unit = "m", column.description = "x, y of the centroid at the start, scene coordinates";
    if (v.key && column.unit == "1" && single && v.key->type == scene::Type::quantity)
      column.unit = unit_name(v.key->dimension);
    if (vary.kind == Kind::list) {
      Dimension unit;
      const auto numbers = numbers_of(vary.list, v.key, unit);
      v.numbers = numbers.value_or(std::vector<double>());
      column.text = !numbers;
      column.unit = !numbers ? "" : unit.none() ? "1" : unit_name(unit);
    } else if (single) {
      v.distribution.emplace(vary, scene.file());
    }
    v.column = static_cast<int>(columns_.size());
    columns_.push_back(std::move(column));
    if (vary.kind == Kind::release) v.block = vary.key.substr(0, vary.key.rfind('.'));
    variables_.push_back(std::move(v));
  }
  if (ensemble.design == scene::Ensemble::Design::sobol)
    sobol_ = std::make_unique<Sobol>(dimension, ensemble.seed);
  members_ = ensemble.members > 0                                    ? ensemble.members
             : ensemble.design == scene::Ensemble::Design::factorial ? combinations_
                                                                     : default_most;
  if (ensemble.design == scene::Ensemble::Design::factorial && members_ % combinations_ != 0)
    throw InputError(Problem{.severity = Problem::Severity::error,
                             .file = scene.file(),
                             .line = 0,
                             .column = 0,
                             .key = "ensemble.members",
                             .value = fmt::format("{}", members_),
                             .rule = fmt::format("is no multiple of the {} combinations", combinations_),
                             .remedy = "leave members out, or give a multiple"});
}

const Design::Variable* Design::find(const std::string& key) const {
  const auto found = std::find_if(variables_.begin(), variables_.end(),
                                  [&](const Variable& v) { return v.vary.key == key; });
  return found == variables_.end() ? nullptr : &*found;
}

bool Design::varies(const std::string& part) const {
  const auto meets = [&](const std::string& path) {
    return path == part || path.starts_with(part + ".") || part.starts_with(path + ".");
  };
  return std::any_of(variables_.begin(), variables_.end(), [&](const Variable& v) {
    return meets(v.vary.key) || (v.key != nullptr && meets(v.key->path));
  });
}

scene::Overrides Design::provisional() const {
  Draw draw;
  draw.numbers.resize(columns_.size());
  draw.texts.resize(columns_.size());
  for (const Variable& v : variables_) {
    if (v.vary.kind == Kind::release)
      draw.set.emplace_back(v.vary.key + ".at", "[0.0, 0.0]"),
          draw.set.emplace_back(v.vary.key + ".count", "1");
    else
      draw_number(v, 0, draw);
  }
  return draw.set;
}

std::vector<Problem> Design::place(const scene::Scene& provisional, std::string& crs, OverGround ground) {
  std::vector<Problem> warnings;
  ground_ = std::move(ground);
  if (provisional.site) origin_ = provisional.site->origin;
  for (Variable& v : variables_) {
    if (v.vary.kind != Kind::release) continue;
    const auto block = std::find_if(provisional.blocks.begin(), provisional.blocks.end(),
                                    [&](const scene::Block& b) { return "block." + b.name == v.block; });
    if (block == provisional.blocks.end() || !block->release)
      throw fault(provisional.file, v.vary, "there is no block of this name with a release area",
                  "give the block release = { polygon = \"source.geojson\" }");
    v.area = geometry::read_area(block->release->polygon, v.vary.key + ".polygon");
    geometry::agree_on_crs(crs, v.area.crs, v.area.limits().center(), block->release->polygon,
                           v.vary.key + ".polygon");
    warnings.insert(warnings.end(), v.area.warnings.begin(), v.area.warnings.end());
    v.extent = geometry::extent_of(v.area, origin_, ground_);
    v.turns = block->release->turn && !find(v.block + ".orientation");
    if (v.turns)
      columns_.push_back({.name = v.block + ".orientation",
                          .width = 4,
                          .text = false,
                          .unit = "1",
                          .description = "quaternion w, x, y, z, body to world"});
    Draw trial;
    trial.numbers.resize(columns_.size());
    draw_release(v, 0, trial);  // throws for an area without ground
    for (Problem& p : geometry::beside_ground(v.extent, v.vary.key + ".polygon")) {
      p.file = provisional.file;
      warnings.push_back(std::move(p));
    }
  }
  return warnings;
}

std::vector<std::string> Design::plan() const {
  std::vector<std::string> lines;
  for (const Variable& v : variables_) {
    std::string what =
        v.vary.kind == Kind::release
            ? fmt::format("one place a member in {:.3g} m^2, {} in scene coordinates{}", v.extent.area,
                          v.extent.span(), v.turns ? "; random orientation" : "")
        : v.vary.kind == Kind::rotation ? std::string("any orientation")
        : v.vary.kind == Kind::list     ? fmt::format("one of {}", fmt::join(v.vary.list, ", "))
        : v.whole                       ? whole_numbers(v)
                                        : percentiles_of(v);
    if (v.vary.like >= 0) what += "; goes with " + ensemble_.vary[static_cast<std::size_t>(v.vary.like)].key;
    lines.push_back(v.vary.key + ": " + what);
  }
  return lines;
}

/// Of the distribution itself, not of the members drawn: to be compared with what was meant.
std::string Design::percentiles_of(const Variable& v) const {
  const std::string& si = columns_[static_cast<std::size_t>(v.column)].unit;
  const bool angle = si == "rad";
  const std::string unit = angle ? " deg" : si == "1" ? "" : " " + si;
  const auto at = [&](double share) {
    const double x = v.distribution->quantile(share);
    return fmt::format("{:.4g}{}", angle ? x * 180 / std::numbers::pi : x, unit);
  };
  return fmt::format("5 % below {}, half below {}, 5 % above {}", at(0.05), at(0.5), at(0.95));
}

std::string Design::whole_numbers(const Variable& v) const {
  Draw draw;
  draw.numbers.resize(columns_.size());
  draw.texts.resize(columns_.size());
  double least = std::numeric_limits<double>::infinity(), most = -least;
  const long n = std::min(planned_members, members_);
  for (long i = 0; i < n; ++i) {
    draw_number(v, i, draw);
    const double x = draw.numbers[static_cast<std::size_t>(v.column)][0];
    least = std::min(least, x), most = std::max(most, x);
  }
  return fmt::format("whole numbers, {:.0f} to {:.0f} in the {}{} members drawn", least, most,
                     n < members_ ? "first " : "", n);
}

double Design::coordinate(long index, int dimension) const {
  if (sobol_) return sobol_->coordinate(static_cast<std::uint64_t>(index), dimension);
  return uniform_of(bits(ensemble_.seed, for_draws, static_cast<std::uint64_t>(index),
                         static_cast<std::uint32_t>(dimension), 0));
}

std::uint64_t Design::seed_of(long index) const {
  return bits(ensemble_.seed, for_seeds, static_cast<std::uint64_t>(index), 0, 0) >> 1;
}

void Design::draw_number(const Variable& v, long index, Draw& draw) const {
  const scene::Vary& vary = v.vary;
  const auto column = static_cast<std::size_t>(v.column);
  if (vary.kind == Kind::rotation) {
    const auto q = rotation_of(coordinate(index, v.dimension), coordinate(index, v.dimension + 1),
                               coordinate(index, v.dimension + 2));
    draw.set.emplace_back(vary.key, "{ quaternion = " + list_text(q) + " }");
    draw.numbers[column].assign(q.begin(), q.end());
    return;
  }
  if (vary.kind == Kind::list) {
    const std::size_t n = vary.list.size();
    const bool combined = ensemble_.design == scene::Ensemble::Design::factorial;
    const std::size_t at = combined
                               ? static_cast<std::size_t>(index / v.stride) % n
                               : std::min(n - 1, static_cast<std::size_t>(coordinate(index, v.dimension) *
                                                                          static_cast<double>(n)));
    draw.set.emplace_back(vary.key, vary.list[at]);
    if (v.numbers.empty())
      draw.texts[column] = vary.list[at];
    else
      draw.numbers[column] = {v.numbers[at]};
    return;
  }
  double x = 0;
  const double u = coordinate(index, v.dimension);
  if (v.whole && vary.kind == Kind::uniform && !vary.min && !vary.max)
    x = std::floor(vary.parameters[0] + u * (vary.parameters[1] - vary.parameters[0] + 1));
  else
    x = v.distribution->quantile(u);
  if (v.whole) x = std::round(x);
  draw.numbers[column] = {x};
  draw.set.emplace_back(vary.key, v.whole             ? fmt::format("{:.0f}", x)
                                  : vary.unit.empty() ? exact_text(x)
                                                      : fmt::format("\"{} {}\"", exact_text(x), vary.unit));
}

void Design::draw_release(const Variable& v, long index, Draw& draw) const {
  const auto i = static_cast<std::uint64_t>(index);
  for (std::uint32_t attempt = 0; attempt < most_tries; ++attempt) {
    // Places that fall beside the area are drawn again, at random whatever the design.
    const auto along = [&](int k) {
      return attempt == 0 ? coordinate(index, v.dimension + k)
                          : uniform_of(bits(ensemble_.seed, for_places, i,
                                            static_cast<std::uint32_t>(v.dimension + k), attempt));
    };
    const double x = v.extent.limits.min().x() + along(0) * v.extent.limits.sizes().x(),
                 y = v.extent.limits.min().y() + along(1) * v.extent.limits.sizes().y();
    if (!v.area.contains(x + origin_.x(), y + origin_.y()) || !ground_(x, y)) continue;
    draw.set.emplace_back(v.vary.key + ".at", list_text(std::array{x, y}));
    draw.set.emplace_back(v.vary.key + ".count", "1");
    draw.numbers[static_cast<std::size_t>(v.column)] = {x, y};
    if (!v.turns) return;
    const auto q = rotation_of(coordinate(index, v.dimension + 2), coordinate(index, v.dimension + 3),
                               coordinate(index, v.dimension + 4));
    draw.set.emplace_back(v.block + ".orientation", "{ quaternion = " + list_text(q) + " }");
    for (std::size_t c = 0; c < columns_.size(); ++c)
      if (columns_[c].name == v.block + ".orientation") draw.numbers[c].assign(q.begin(), q.end());
    return;
  }
  const std::string degrees =
      geometry::remedy_for_degrees({Eigen::Vector2d(v.extent.limits.min() + origin_.head<2>()),
                                    Eigen::Vector2d(v.extent.limits.max() + origin_.head<2>())});
  throw fault(
      {}, v.vary,
      fmt::format("no place of the area lies over ground; it spans {} in scene coordinates", v.extent.span()),
      degrees.empty() ? "give the polygon in the terrain's coordinate system, and site.origin as well"
                      : degrees);
}

Draw Design::draw(long index) const {
  Draw draw;
  draw.numbers.resize(columns_.size());
  draw.texts.resize(columns_.size());
  for (const Variable& v : variables_) {
    if (v.vary.kind == Kind::release)
      draw_release(v, index, draw);
    else
      draw_number(v, index, draw);
  }
  return draw;
}

std::vector<Problem> Design::forbidden(long members, const std::string& file) const {
  std::vector<Problem> found;
  for (const Variable& v : variables_) {
    if (!v.key || v.vary.kind == Kind::rotation || v.vary.kind == Kind::release) continue;
    long count = 0;
    std::string rule, value;
    Draw draw;
    draw.numbers.resize(columns_.size());
    draw.texts.resize(columns_.size());
    for (long i = 0; i < members; ++i) {
      draw.set.clear();
      draw_number(v, i, draw);
      const std::string fault = scene::fault_of(scene::parse_toml_value(draw.set.front().second, ""), *v.key);
      if (fault.empty()) continue;
      if (count++ == 0) rule = fault, value = draw.set.front().second;
    }
    if (count == 0) continue;
    found.push_back({.severity = Problem::Severity::error,
                     .file = file,
                     .line = 0,
                     .column = 0,
                     .key = "ensemble.vary",
                     .value = v.vary.key,
                     .rule = fmt::format(
                         "{} of the first {} members draw a value that the key does not take, {} for one: {}",
                         count, members, value, rule),
                     .remedy = "cut the distribution off by min and max, or take another"});
  }
  return found;
}

}  // namespace talus::ensemble

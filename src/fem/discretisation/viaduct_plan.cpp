#include "fem/discretisation/viaduct.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>

#include "contact/structures/refinable.hpp"
#include "fem/spec_error.hpp"

namespace talus::fem {
namespace {

Box3 box(double x0, double x1, double y0, double y1, double z0, double z1) {
  return Box3(Vec3(x0, y0, z0), Vec3(x1, y1, z1));
}

/// The measures of a viaduct, defaults filled in [m].
struct Measures {
  int spans, across, girders;
  double pier_spacing, pier_x, pier_y, cap_x, cap_y, cap_z, deck_y, deck_z, slab, web, lower_slab, wall;
  std::vector<double> length;  // of each span
  double top;                  // lower side of the cap beams, body axes
  bool abutments, round, levelled;
  double bearing_height, bearing_stiffness, bearing_friction, bearing_seat;
  double skew, grade;

  /// Gap between the ends of two decks.
  double joint() const { return std::min(0.05, 0.2 * cap_x); }
  /// How far a deck reaches over a cap beam.
  double rest() const { return 0.5 * (cap_x - joint()); }
};

const std::string length_of_one = "span_length.";  // and its number: the length of a single span

class Given {
 public:
  explicit Given(const StructureSpec& spec)
      : spec_(spec), given_(spec.parameters.begin(), spec.parameters.end()) {
    static const char* known[] = {"spans",          "span_length",    "pier_height",       "deck_level",
                                  "piers_per_bent", "pier_spacing",   "pier_width",        "pier_depth",
                                  "cap_height",     "cap_width",      "cap_length",        "deck_width",
                                  "deck_depth",     "slab_thickness", "bottom_slab",       "girders",
                                  "girder_width",   "bearing_height", "bearing_stiffness", "bearing_friction",
                                  "bearing_seat",   "abutments",      "pier_diameter",     "skew",
                                  "grade"};
    for (const auto& [key, value] : given_) {
      if (key == "local_refinement" || key == ImpactRefinement::size_key ||
          key == ImpactRefinement::reach_key)
        continue;  // no measures: where its cells are finer
      if (std::find(std::begin(known), std::end(known), key) == std::end(known) &&
          !key.starts_with(length_of_one))
        bad(spec, key, fmt::format("{:g}", value), "a viaduct has no such measure",
            fmt::format("its measures are {}: talus explain structure.{}", fmt::join(known, ", "), known[0]));
      if (!std::isfinite(value)) bad(spec, key, fmt::format("{:g}", value), "must be a number", "correct it");
    }
  }

  /// Spans of their own lengths, by number from 1 [m].
  std::vector<std::pair<int, double>> single_lengths() const {
    std::vector<std::pair<int, double>> found;
    for (const auto& [key, value] : given_) {
      if (!key.starts_with(length_of_one)) continue;
      const std::string number = key.substr(length_of_one.size());
      if (number.empty() || number.size() > 4 ||
          !std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; }) ||
          number[0] == '0')
        bad(spec_, "span_lengths", number, "no number of a span", "count the spans from 1");
      if (!(value >= 1))
        bad(spec_, "span_lengths", fmt::format("{:g} m", value), "must be at least 1 m", "correct it");
      found.emplace_back(std::stoi(number), value);
    }
    return found;
  }

  bool has(const char* key) const { return given_.count(key) != 0; }

  double number(const char* key, double fallback, double least, const char* unit = "") const {
    const auto at = given_.find(key);
    const double value = at == given_.end() ? fallback : at->second;
    if (!(value >= least))
      bad(spec_, key, fmt::format("{:g}{}", value, unit), fmt::format("must be at least {:g}{}", least, unit),
          "correct it");
    return value;
  }
  /// Of either sign, 0 where nothing is said.
  double within(const char* key, double most, const char* rule, const char* remedy) const {
    const auto at = given_.find(key);
    if (at == given_.end()) return 0;
    if (!(std::abs(at->second) <= most)) bad(spec_, key, fmt::format("{:g}", at->second), rule, remedy);
    return at->second;
  }
  int count(const char* key, int fallback, int least, int most) const {
    const double value = number(key, fallback, least);
    if (value > most)
      bad(spec_, key, fmt::format("{:g}", value), fmt::format("at most {}", most),
          "model the part of the bridge that blocks reach");
    return static_cast<int>(std::lround(value));
  }

 private:
  const StructureSpec& spec_;
  std::map<std::string, double> given_;
};

/// Throws InputError where measures do not fit together.
void check(const StructureSpec& spec, const Measures& m) {
  if (m.cap_x < m.pier_x)
    bad(spec, "cap_width", fmt::format("{:g} m", m.cap_x), "the cap beam must cover the pier",
        "at least pier_width");
  if (m.cap_y < (m.across - 1) * m.pier_spacing + m.pier_y)
    bad(spec, "cap_length", fmt::format("{:g} m", m.cap_y), "the cap beam must cover its piers",
        fmt::format("at least {:g} m", (m.across - 1) * m.pier_spacing + m.pier_y));
  if (m.across > 1 && m.pier_spacing <= m.pier_y)
    bad(spec, "pier_spacing", fmt::format("{:g} m", m.pier_spacing), "piers of one bent overlap",
        "more than pier_depth");
  if (m.girders > 0 && m.slab >= m.deck_z)
    bad(spec, "slab_thickness", fmt::format("{:g} m", m.slab), "must be less than deck_depth", "correct it");
  if (m.girders > 0 && m.girders * m.web > m.deck_y)
    bad(spec, "girder_width", fmt::format("{:g} m", m.web), "the girders are wider than the deck",
        "fewer or narrower girders");
  if (m.lower_slab > 0 && m.girders < 2)
    bad(spec, "bottom_slab", fmt::format("{:g} m", m.lower_slab),
        "a box needs two girders or more as its webs", "girders = 2, or no bottom_slab");
  if (m.lower_slab > 0 && m.lower_slab + m.slab >= m.deck_z)
    bad(spec, "bottom_slab", fmt::format("{:g} m", m.lower_slab),
        "with slab_thickness it must be less than deck_depth", "correct it");
  if (spec.section == "hollow" && !(m.wall > 0 && 2 * m.wall < std::min(m.pier_x, m.pier_y)))
    bad(spec, "wall_thickness", fmt::format("{:g} m", m.wall), "between 0 and half of the pier",
        "give the thickness of the wall");
  if (m.round && m.pier_x != m.pier_y)
    bad(spec, "pier_depth", fmt::format("{:g} m", m.pier_y), "a round pier has one diameter",
        "give diameter alone");
  if (m.round && std::min(m.cap_x, m.cap_y) < 1.1 * m.pier_x)
    bad(spec, "cap_width", fmt::format("{:g} m", std::min(m.cap_x, m.cap_y)),
        "the cap beam must be a tenth wider than a round pier",
        fmt::format("at least {:g} m", 1.1 * m.pier_x));
  if (const double least = *std::min_element(m.length.begin(), m.length.end()),
      needed = (m.cap_x + m.joint()) / std::cos(m.skew);
      least <= needed)
    bad(spec, "span_length", fmt::format("{:g} m", least), "neighbouring cap beams overlap",
        fmt::format("more than {:g} m, or a smaller cap_width", needed));
  if (const double rise = std::abs(m.grade) * 0.5 * m.cap_x / std::cos(m.skew); rise >= m.bearing_height)
    bad(spec, "bearing_height", fmt::format("{:g} m", m.bearing_height),
        fmt::format("the deck, which falls by {:.3g} m from the bearings to the edge of a cap beam, meets it",
                    rise),
        "higher bearings, or a gentler grade");
  if (m.bearing_seat > m.rest())
    bad(spec, "bearing_seat", fmt::format("{:g} m", m.bearing_seat),
        fmt::format("a deck's end rests on {:.3g} m of the cap beam (half its width less half the joint)",
                    m.rest()),
        "a shorter seat, or a larger cap_width");
  if (!(spec.cell_size > 0))
    bad(spec, "cell_size", "", "a viaduct needs a cell size", "give cell_size = \"0.5 m\"");
}

/// Of round piers; what else a pier measures if nothing is said.
double diameter_of(const StructureSpec& spec, const Given& given) {
  const double diameter = given.number("pier_diameter", 1.5, 0.1, " m");
  if (!given.has("pier_diameter")) return diameter;
  if (spec.section != "round")
    bad(spec, "pier_diameter", fmt::format("{:g} m", diameter), "only a round section has a diameter",
        "write section = \"round\", or give pier_width and pier_depth");
  for (const char* key : {"pier_width", "pier_depth"})
    if (const double other = given.number(key, diameter, 0.1); other != diameter)
      bad(spec, key, fmt::format("{:g} m", other),
          "differs from pier_diameter, and a round pier has one diameter", "remove it");
  return diameter;
}

Measures measures_of(const StructureSpec& spec) {
  const Given given(spec);
  Measures m{};
  m.spans = given.count("spans", 3, 1, 1000);
  m.length.assign(static_cast<std::size_t>(m.spans), given.number("span_length", 20, 1, " m"));
  for (const auto& [span, length] : given.single_lengths()) {
    if (span > m.spans)
      bad(spec, "span_lengths", fmt::format("span {}", span),
          fmt::format("the viaduct has {} spans", m.spans),
          "count the spans from 1, or give more of them in spans");
    m.length[static_cast<std::size_t>(span - 1)] = length;
  }
  m.across = given.count("piers_per_bent", 1, 1, 100);
  m.pier_spacing = given.number("pier_spacing", 4, 0.1, " m");
  const double diameter = diameter_of(spec, given);
  m.pier_x = given.number("pier_width", diameter, 0.1, " m");
  m.pier_y = given.number("pier_depth", diameter, 0.1, " m");
  m.cap_z = given.number("cap_height", 1.0, 0.1, " m");
  m.cap_x = given.number("cap_width", m.pier_x + 0.5, 0.1, " m");
  m.deck_y = given.number("deck_width", 8, 0.2, " m");
  m.deck_z = given.number("deck_depth", 1.5, 0.1, " m");
  m.skew = given.within("skew", 75 * M_PI / 180, "must lie between -75 and 75 degrees",
                        "write an angle with its unit: skew = \"20 deg\"");
  m.grade = given.within("grade", 0.5, "must lie between -0.5 and 0.5",
                         "the rise over the length: 0.04 for four in a hundred");
  m.cap_y = given.number("cap_length", m.deck_y / std::cos(m.skew), 0.1, " m");
  m.girders = given.count("girders", 0, 0, 100);
  m.slab = given.number("slab_thickness", 0.3, 0.02, " m");
  m.web = given.number("girder_width", 0.5, 0.05, " m");
  m.lower_slab = given.number("bottom_slab", 0, 0, " m");
  m.wall = spec.section == "hollow" ? spec.wall_thickness : 0;
  m.abutments = given.number("abutments", 0, 0) != 0;
  m.round = spec.section == "round";
  m.bearing_height = given.number("bearing_height", 0.1, 0.001, " m");
  m.bearing_stiffness = given.number("bearing_stiffness", 1e7, 1);
  m.bearing_friction = given.number("bearing_friction", 0.3, 0);
  m.bearing_seat = given.number("bearing_seat", std::min(0.5, m.rest()), 0.001, " m");
  m.levelled = given.has("deck_level") && !given.has("pier_height");
  check(spec, m);
  m.top = m.levelled ? given.number("deck_level", 0, -1e9) - spec.position.z() - m.deck_z - m.bearing_height -
                           m.cap_z
                     : given.number("pier_height", 10, 0.1, " m");
  return m;
}

/// Lays out bents and spans in body axes.
class Layout {
 public:
  explicit Layout(const StructureSpec& spec)
      : spec_(spec),
        m_(measures_of(spec)),
        first_bent_(m_.abutments ? 1 : 0),
        last_bent_(m_.abutments ? m_.spans - 1 : m_.spans) {}

  ViaductPlan plan() {
    plan_.bearing_height = m_.bearing_height;
    plan_.bearing_stiffness = m_.bearing_stiffness;
    plan_.bearing_friction = m_.bearing_friction;
    plan_.bearing_seat = m_.bearing_seat;
    for (int i = 0; i <= m_.spans; ++i) add_bent(i);
    for (int s = 0; s < m_.spans; ++s) add_span(s);
    return std::move(plan_);
  }

 private:
  /// Body axes: the first bent with piers stands at 0.
  double support_x(int i) const {
    const auto at = [&](int support) {
      return std::accumulate(m_.length.begin(), m_.length.begin() + support, 0.0);
    };
    return at(i) - at(first_bent_);
  }
  Vec3 world(const Vec3& x) const { return spec_.rotation * x + spec_.position; }
  /// Lower side of the cap beam over support i, and its upper side.
  double cap_bottom(int i) const { return m_.top + m_.grade * support_x(i); }
  double cap_top(int i) const { return cap_bottom(i) + m_.cap_z; }
  /// Lower side of deck s at its first support.
  double bottom(int s) const { return cap_top(s) + m_.bearing_height; }

  /// An abutment is a founded block as deep as the cap beam, behind the joint: a bent without piers.
  void add_bent(int i) {
    const double x = support_x(i);
    ViaductPlan::Part part;
    part.founded = true;
    part.turn = Eigen::AngleAxisd(m_.skew, Vec3::UnitZ()).toRotationMatrix();
    part.shift = Vec3(x, 0, 0) - part.turn * Vec3(x, 0, 0);
    if (i >= first_bent_ && i <= last_bent_)
      for (int k = 0; k < m_.across; ++k) add_pier(i, k, part);
    part.boxes.push_back(
        box(x - m_.cap_x / 2, x + m_.cap_x / 2, -m_.cap_y / 2, m_.cap_y / 2, cap_bottom(i), cap_top(i)));
    plan_.parts.push_back(std::move(part));
  }

  void add_pier(int i, int k, ViaductPlan::Part& part) {
    const double x = support_x(i), y = (k - 0.5 * (m_.across - 1)) * m_.pier_spacing, top = cap_bottom(i),
                 foot = foot_at(i, part.placed(Vec3(x, y, 0)));
    if (m_.round)
      part.rounds.push_back({Vec3(x, y, foot), m_.pier_x / 2, top});
    else
      add_shaft(x, y, foot, top, part.boxes);
    Pier pier;
    pier.name = m_.across > 1 ? fmt::format("P{}.{}", i + 1, k + 1) : fmt::format("P{}", i + 1);
    pier.support = i;
    pier.clear = top - foot;
    pier.wall = m_.wall;
    rebar::Member& member = pier.shape;
    if (m_.round) member.section = rebar::Member::Section::round;
    member.width = m_.pier_x, member.depth = m_.pier_y, member.length = cap_top(i) - foot;
    member.base = world(part.placed(Vec3(x, y, foot)));
    member.axis_x = spec_.rotation * part.turn.col(0);
    member.axis_y = spec_.rotation * part.turn.col(1);
    plan_.piers.push_back(pier);
  }

  /// Level of the foot of a pier at a place of body axes: on the ground where the deck's level is given.
  double foot_at(int i, const Vec3& place) const {
    double foot = 0;
    if (m_.levelled && spec_.ground) {
      const Vec3 at = world(place);
      const double z = spec_.ground(at.x(), at.y());
      if (!std::isfinite(z))
        bad(spec_, "position", fmt::format("pier at ({:.6g}, {:.6g})", at.x(), at.y()),
            "the terrain has no height under this pier", "move the viaduct, or widen the terrain");
      foot = (spec_.rotation.transpose() * (Vec3(at.x(), at.y(), z) - spec_.position)).z();
    }
    if (!(cap_bottom(i) - foot > 0.05 * spec_.cell_size))
      bad(spec_, "pier_height", fmt::format("{:.3g} m for bent {}", cap_bottom(i) - foot, i + 1),
          "the cap beam lies below the ground", "raise deck_level or pier_height");
    return foot;
  }

  /// A rectangular pier, solid or as four walls.
  void add_shaft(double x, double y, double foot, double top, std::vector<Box3>& boxes) const {
    const double x0 = x - m_.pier_x / 2, x1 = x + m_.pier_x / 2, y0 = y - m_.pier_y / 2,
                 y1 = y + m_.pier_y / 2, w = m_.wall;
    if (!(w > 0)) {
      boxes.push_back(box(x0, x1, y0, y1, foot, top));
      return;
    }
    boxes.push_back(box(x0, x0 + w, y0, y1, foot, top));
    boxes.push_back(box(x1 - w, x1, y0, y1, foot, top));
    boxes.push_back(box(x0 + w, x1 - w, y0, y0 + w, foot, top));
    boxes.push_back(box(x0 + w, x1 - w, y1 - w, y1, foot, top));
  }

  void add_span(int s) {
    const double joint = m_.joint();
    const double x0 = support_x(s) + joint / 2, x1 = support_x(s + 1) - joint / 2;
    ViaductPlan::Part part;
    part.deck = s;
    part.turn(0, 1) = -std::tan(m_.skew);
    part.turn(2, 0) = m_.grade;
    part.shift.z() = -m_.grade * support_x(s);
    double width = 0;  // of a pad
    const std::vector<double> lines =
        m_.girders == 0 ? add_solid_deck(s, x0, x1, part, width) : add_girders(s, x0, x1, part, width);
    const double rest = std::min(0.4 * (m_.cap_x - joint), 0.6);  // length of a bearing along the axis
    for (int end = 0; end < 2; ++end)
      for (double y : lines)
        plan_.pads.push_back(
            {Vec3(end == 0 ? x0 + rest / 2 : x1 - rest / 2, y, bottom(s)), s, end, rest, width});
    plan_.spans.push_back(span(s, x0, x1, part));
    plan_.parts.push_back(std::move(part));
  }

  Pier span(int s, double x0, double x1, const ViaductPlan::Part& part) const {
    Pier span;
    span.name = fmt::format("S{}", s + 1);
    span.span = true;
    span.support = s;
    const Vec3 along = Vec3(1, 0, m_.grade), up = Vec3(-m_.grade, 0, 1);
    span.clear = (x1 - x0) * along.norm();
    rebar::Member& member = span.shape;
    member.width = m_.deck_y, member.depth = m_.deck_z, member.length = span.clear;
    member.base = world(part.placed(Vec3(x0, 0, bottom(s) + m_.deck_z / 2)));
    member.axis_x = spec_.rotation * Vec3::UnitY();
    member.axis_y = spec_.rotation * up.normalized();
    if (m_.girders > 0) {
      // Slab and webs, and between the webs the lower slab.
      const double soffit = part.boxes.back().sizes().y();
      span.area = m_.deck_y * m_.slab + m_.girders * m_.web * (m_.deck_z - m_.slab) +
                  m_.lower_slab * std::max(0.0, soffit - m_.girders * m_.web);
      span.web = {m_.slab + m_.lower_slab, m_.girders * m_.web};
    }
    return span;
  }

  void add_soffit(const ViaductPlan::Part& part, int s, double x0, double x1, double y, double width) {
    plan_.soffits.push_back({world(part.placed(Vec3(x0, y, bottom(s)))),
                             world(part.placed(Vec3(x1, y, bottom(s)))), spec_.rotation * part.turn.col(1),
                             width});
  }

  /// Lines of bearings [m across].
  std::vector<double> add_solid_deck(int s, double x0, double x1, ViaductPlan::Part& part, double& width) {
    add_soffit(part, s, x0, x1, 0, m_.deck_y);
    part.boxes.push_back(box(x0, x1, -m_.deck_y / 2, m_.deck_y / 2, bottom(s), bottom(s) + m_.deck_z));
    width = std::min(0.6, cap_across() / 4);
    const double y = std::min(cap_across(), m_.deck_y) / 4;
    return {-y, y};
  }

  std::vector<double> add_girders(int s, double x0, double x1, ViaductPlan::Part& part, double& width) {
    std::vector<double> lines;
    const double soffit = bottom(s), slab = soffit + m_.deck_z - m_.slab;
    part.boxes.push_back(box(x0, x1, -m_.deck_y / 2, m_.deck_y / 2, slab, soffit + m_.deck_z));
    for (int g = 0; g < m_.girders; ++g) {
      const double y = -m_.deck_y / 2 + m_.deck_y * (g + 0.5) / m_.girders;
      part.boxes.push_back(box(x0, x1, y - m_.web / 2, y + m_.web / 2, soffit, slab));
      add_soffit(part, s, x0, x1, y, m_.web);
      if (std::abs(y) < cap_across() / 2) lines.push_back(y);
    }
    if (m_.lower_slab > 0) {
      const double y = m_.deck_y * (0.5 - 0.5 / m_.girders) + m_.web / 2;
      part.boxes.push_back(box(x0, x1, -y, y, soffit, soffit + m_.lower_slab));
    }
    width = m_.web;
    if (lines.empty())
      bad(spec_, "cap_length", fmt::format("{:g} m", m_.cap_y), "no girder rests on the cap beam",
          "a longer cap beam");
    return lines;
  }

  /// Length of a cap beam, square to the axis.
  double cap_across() const { return m_.cap_y * std::cos(m_.skew); }

  const StructureSpec& spec_;
  Measures m_;
  int first_bent_, last_bent_;
  ViaductPlan plan_;
};

}  // namespace

ViaductPlan viaduct_plan(const StructureSpec& spec) { return Layout(spec).plan(); }

}  // namespace talus::fem

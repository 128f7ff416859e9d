#include "fem/viaduct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.hpp"
#include "fem/lattice.hpp"

namespace talus::fem {
namespace {

[[noreturn]] void bad(const StructureSpec& spec, const std::string& key, const std::string& value, const std::string& rule, const std::string& remedy) {
  Problem p;
  p.key = fmt::format("structure.{}.{}", spec.name, key);
  p.value = value;
  p.rule = rule;
  p.remedy = remedy;
  throw InputError(p);
}

Box3 box(double x0, double x1, double y0, double y1, double z0, double z1) { return Box3(Vec3(x0, y0, z0), Vec3(x1, y1, z1)); }

}  // namespace

ViaductPlan viaduct_plan(const StructureSpec& spec) {
  std::map<std::string, double> given(spec.parameters.begin(), spec.parameters.end());
  static const char* known[] = {"spans", "span_length", "pier_height", "deck_level", "piers_per_bent", "pier_spacing", "pier_width", "pier_depth", "cap_height",
                                "cap_width", "cap_length", "deck_width", "deck_depth", "slab_thickness", "bottom_slab", "girders", "girder_width", "bearing_height",
                                "bearing_stiffness", "bearing_friction", "bearing_seat", "abutments", "pier_diameter"};
  for (const auto& [key, value] : given) {
    if (std::find(std::begin(known), std::end(known), key) == std::end(known)) bad(spec, key, fmt::format("{:g}", value), "a viaduct has no such measure", "see the list of measures of the viaduct");
    if (!std::isfinite(value)) bad(spec, key, fmt::format("{:g}", value), "must be a number", "correct it");
  }
  const auto number = [&](const char* key, double fallback, double least) {
    const auto at = given.find(key);
    const double value = at == given.end() ? fallback : at->second;
    if (!(value >= least)) bad(spec, key, fmt::format("{:g}", value), fmt::format("at least {:g}", least), "correct it");
    return value;
  };
  const int spans = static_cast<int>(std::lround(number("spans", 3, 1)));
  const double length = number("span_length", 20, 1);
  const int across = static_cast<int>(std::lround(number("piers_per_bent", 1, 1)));
  const double pier_spacing = number("pier_spacing", 4, 0.1), pier_x = number("pier_width", 1.5, 0.1), pier_y = number("pier_depth", 1.5, 0.1);
  const double cap_z = number("cap_height", 1.0, 0.1), cap_x = number("cap_width", pier_x + 0.5, 0.1);
  const double deck_y = number("deck_width", 8, 0.2), deck_z = number("deck_depth", 1.5, 0.1);
  const double cap_y = number("cap_length", deck_y, 0.1);
  const int girders = static_cast<int>(std::lround(number("girders", 0, 0)));
  const double slab = number("slab_thickness", 0.3, 0.02), web = number("girder_width", 0.5, 0.05);
  const double lower_slab = number("bottom_slab", 0, 0), wall = spec.section == "hollow" ? spec.wall_thickness : 0;
  const bool abutments = number("abutments", 0, 0) != 0, round = spec.section == "round";
  ViaductPlan plan;
  plan.bearing_height = number("bearing_height", 0.1, 0.001);
  plan.bearing_stiffness = number("bearing_stiffness", 1e7, 1);
  plan.bearing_friction = number("bearing_friction", 0.3, 0);
  plan.bearing_seat = number("bearing_seat", 0.5, 0.001);
  if (cap_x < pier_x) bad(spec, "cap_width", fmt::format("{:g} m", cap_x), "the cap beam must cover the pier", "at least pier_width");
  if (cap_y < (across - 1) * pier_spacing + pier_y) bad(spec, "cap_length", fmt::format("{:g} m", cap_y), "the cap beam must cover its piers", fmt::format("at least {:g} m", (across - 1) * pier_spacing + pier_y));
  if (across > 1 && pier_spacing <= pier_y) bad(spec, "pier_spacing", fmt::format("{:g} m", pier_spacing), "piers of one bent overlap", "more than pier_depth");
  if (girders > 0 && slab >= deck_z) bad(spec, "slab_thickness", fmt::format("{:g} m", slab), "must be less than deck_depth", "correct it");
  if (girders > 0 && girders * web > deck_y) bad(spec, "girder_width", fmt::format("{:g} m", web), "the girders are wider than the deck", "fewer or narrower girders");
  if (lower_slab > 0 && girders < 2) bad(spec, "bottom_slab", fmt::format("{:g} m", lower_slab), "a box needs two girders or more as its webs", "girders = 2, or no bottom_slab");
  if (lower_slab > 0 && lower_slab + slab >= deck_z) bad(spec, "bottom_slab", fmt::format("{:g} m", lower_slab), "with slab_thickness it must be less than deck_depth", "correct it");
  if (spec.section == "hollow" && !(wall > 0 && 2 * wall < std::min(pier_x, pier_y))) bad(spec, "wall_thickness", fmt::format("{:g} m", wall), "between 0 and half of the pier", "give the thickness of the wall");
  if (round && !spec.refinements.empty()) bad(spec, "refine", "", "zones of finer cells are not there for round piers", "a smaller cell_size, or rectangular piers");
  if (round && pier_x != pier_y) bad(spec, "pier_depth", fmt::format("{:g} m", pier_y), "a round pier has one diameter", "give diameter alone");
  if (round && std::min(cap_x, cap_y) < 1.1 * pier_x) bad(spec, "cap_width", fmt::format("{:g} m", std::min(cap_x, cap_y)), "the cap beam must be a tenth wider than a round pier", fmt::format("at least {:g} m", 1.1 * pier_x));
  if (!(spec.cell_size > 0)) bad(spec, "cell_size", "", "a viaduct needs a cell size", "give cell_size = \"0.5 m\"");

  // Level of the cap beams' lower side.
  double top = 0;
  const bool levelled = given.count("deck_level") && !given.count("pier_height");
  if (const auto level = given.find("deck_level"); levelled)
    top = level->second - spec.position.z() - deck_z - plan.bearing_height - cap_z;
  else
    top = number("pier_height", 10, 0.1);
  const int first_bent = abutments ? 1 : 0, last_bent = abutments ? spans - 1 : spans;
  const auto support_x = [&](int i) { return (i - first_bent) * length; };
  const double cap_top = top + cap_z;
  for (int i = 0; i <= spans; ++i) {
    const double x = support_x(i);
    ViaductPlan::Part part;
    part.founded = true;
    if (i < first_bent || i > last_bent) {
      // The abutment: a founded block as deep as the cap beam, twice as long, behind the joint.
      part.boxes.push_back(box(x - cap_x / 2, x + cap_x / 2, -cap_y / 2, cap_y / 2, top, cap_top));
    } else {
      for (int k = 0; k < across; ++k) {
        const double y = (k - 0.5 * (across - 1)) * pier_spacing;
        double foot = 0;
        if (levelled && spec.ground) {
          const Vec3 at = spec.rotation * Vec3(x, y, 0) + spec.position;
          const double z = spec.ground(at.x(), at.y());
          if (!std::isfinite(z)) bad(spec, "position", fmt::format("pier at ({:.6g}, {:.6g})", at.x(), at.y()), "the terrain has no height under this pier", "move the viaduct, or widen the terrain");
          foot = (spec.rotation.transpose() * (Vec3(at.x(), at.y(), z) - spec.position)).z();
        }
        if (!(top - foot > 0.05 * spec.cell_size)) bad(spec, "pier_height", fmt::format("{:.3g} m for bent {}", top - foot, i + 1), "the cap beam lies below the ground", "raise deck_level or pier_height");
        const double x0 = x - pier_x / 2, x1 = x + pier_x / 2, y0 = y - pier_y / 2, y1 = y + pier_y / 2;
        if (round) {
          part.rounds.push_back({Vec3(x, y, foot), pier_x / 2, top});
        } else if (wall > 0) {
          part.boxes.push_back(box(x0, x0 + wall, y0, y1, foot, top));
          part.boxes.push_back(box(x1 - wall, x1, y0, y1, foot, top));
          part.boxes.push_back(box(x0 + wall, x1 - wall, y0, y0 + wall, foot, top));
          part.boxes.push_back(box(x0 + wall, x1 - wall, y1 - wall, y1, foot, top));
        } else {
          part.boxes.push_back(box(x0, x1, y0, y1, foot, top));
        }
        Pier pier;
        pier.name = across > 1 ? fmt::format("P{}.{}", i + 1, k + 1) : fmt::format("P{}", i + 1);
        pier.clear = top - foot;
        pier.wall = wall;
        if (round) pier.shape.section = rebar::Member::Section::round;
        rebar::Member& m = pier.shape;
        m.width = pier_x, m.depth = pier_y, m.length = top + cap_z - foot;
        m.base = spec.rotation * Vec3(x, y, foot) + spec.position;
        m.axis_x = spec.rotation * Vec3::UnitX();
        m.axis_y = spec.rotation * Vec3::UnitY();
        plan.piers.push_back(pier);
      }
      part.boxes.push_back(box(x - cap_x / 2, x + cap_x / 2, -cap_y / 2, cap_y / 2, top, cap_top));
    }
    plan.parts.push_back(std::move(part));
  }
  const double joint = std::min(0.05, 0.2 * cap_x), bottom = cap_top + plan.bearing_height;
  const double rest = std::min(0.4 * (cap_x - joint), 0.6);  // length of a bearing along the axis
  for (int s = 0; s < spans; ++s) {
    ViaductPlan::Part part;
    part.deck = s;
    const double x0 = support_x(s) + joint / 2, x1 = support_x(s + 1) - joint / 2;
    std::vector<double> lines;
    double width = 0;
    const auto soffit = [&](double y, double w) {
      plan.soffits.push_back({spec.rotation * Vec3(x0, y, bottom) + spec.position, spec.rotation * Vec3(x1, y, bottom) + spec.position, spec.rotation * Vec3::UnitY(), w});
    };
    if (girders == 0) {
      soffit(0, deck_y);
      part.boxes.push_back(box(x0, x1, -deck_y / 2, deck_y / 2, bottom, bottom + deck_z));
      width = std::min(0.6, cap_y / 4);
      const double y = std::min(cap_y, deck_y) / 4;
      lines = {-y, y};
    } else {
      part.boxes.push_back(box(x0, x1, -deck_y / 2, deck_y / 2, bottom + deck_z - slab, bottom + deck_z));
      for (int g = 0; g < girders; ++g) {
        const double y = -deck_y / 2 + deck_y * (g + 0.5) / girders;
        part.boxes.push_back(box(x0, x1, y - web / 2, y + web / 2, bottom, bottom + deck_z - slab));
        soffit(y, web);
        if (std::abs(y) < cap_y / 2) lines.push_back(y);
      }
      if (lower_slab > 0) {
        const double y = deck_y * (0.5 - 0.5 / girders) + web / 2;
        part.boxes.push_back(box(x0, x1, -y, y, bottom, bottom + lower_slab));
      }
      width = web;
      if (lines.empty()) bad(spec, "cap_length", fmt::format("{:g} m", cap_y), "no girder rests on the cap beam", "a longer cap beam");
    }
    for (int end = 0; end < 2; ++end)
      for (double y : lines) plan.pads.push_back({Vec3(end == 0 ? x0 + rest / 2 : x1 - rest / 2, y, cap_top), s, end, rest, width});
    plan.parts.push_back(std::move(part));
  }
  return plan;
}

std::vector<rebar::Member> cap_members(const StructureSpec& spec) {
  std::vector<rebar::Member> members;
  for (const ViaductPlan::Part& part : viaduct_plan(spec).parts) {
    if (part.deck >= 0 || (part.boxes.size() < 2 && part.rounds.empty())) continue;
    const Box3& cap = part.boxes.back();
    rebar::Member m;
    m.width = cap.sizes().z();
    m.depth = cap.sizes().x();
    m.length = cap.sizes().y();
    m.base = spec.position + spec.rotation * Vec3(cap.center().x(), cap.min().y(), cap.center().z());
    m.axis_x = spec.rotation.col(2);
    m.axis_y = spec.rotation.col(0);
    members.push_back(m);
  }
  return members;
}

std::vector<rebar::Bar> deck_bars(const StructureSpec& spec, const StructureSpec::RebarRule& rule, const material::Steel::Parameters& steel) {
  const Vec3 up = spec.rotation.col(2);
  const double inset = rule.cover + rule.diameter / 2;
  std::vector<rebar::Bar> bars;
  for (const ViaductPlan::Soffit& soffit : viaduct_plan(spec).soffits) {
    const double room = soffit.width - 2 * inset;
    if (!(room >= 0) || (rule.bars > 1 && room / (rule.bars - 1) < rule.diameter))
      bad(spec, "rebar", fmt::format("{} bars of {:g} m", rule.bars, rule.diameter), fmt::format("they do not fit side by side into a width of {:g} m", soffit.width), "fewer, thinner bars or less cover");
    const Vec3 along = (soffit.end - soffit.start).normalized();
    for (int i = 0; i < rule.bars; ++i) {
      rebar::Bar bar;
      bar.name = fmt::format("D{}", bars.size() + 1);
      bar.diameter = rule.diameter;
      bar.steel = steel;
      const Vec3 shift = (rule.bars > 1 ? room * (double(i) / (rule.bars - 1) - 0.5) : 0.0) * soffit.across + inset * up;
      bar.points = {soffit.start + shift + rule.cover * along, soffit.end + shift - rule.cover * along};
      bars.push_back(std::move(bar));
    }
  }
  return bars;
}

namespace {

/// Nodes at the foot of every pier; of a part of one box (an abutment) those of its lower side.
std::vector<int> feet_of(const ViaductPlan::Part& part, const HexMesh& mesh) {
  std::vector<int> feet;
  const std::size_t count = std::max<std::size_t>(1, part.boxes.size() - 1);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3& x = mesh.nodes[n];
    for (std::size_t b = 0; b < count; ++b) {
      const Vec3 low = part.boxes[b].min().array() - 1e-9, high = part.boxes[b].max().array() + 1e-9;
      if (std::abs(x.z() - part.boxes[b].min().z()) > 1e-9 || x.x() < low.x() || x.x() > high.x() || x.y() < low.y() || x.y() > high.y()) continue;
      feet.push_back(static_cast<int>(n));
      break;
    }
  }
  return feet;
}

}  // namespace

HexMesh viaduct_mesh(const StructureSpec& spec) {
  const ViaductPlan plan = viaduct_plan(spec);
  HexMesh mesh;
  std::vector<int> base;
  for (int k = 0; k < static_cast<int>(plan.parts.size()); ++k) {
    const ViaductPlan::Part& what = plan.parts[k];
    std::vector<int> feet;
    const HexMesh part = what.rounds.empty() ? bricks(what.boxes, spec.cell_size, local_refinements(spec)) : round_bent(what.boxes.back(), what.rounds, spec.cell_size, feet);
    const int shift = static_cast<int>(mesh.nodes.size());
    mesh.nodes.insert(mesh.nodes.end(), part.nodes.begin(), part.nodes.end());
    for (auto hex : part.hexes) {
      for (int& n : hex) n += shift;
      mesh.hexes.push_back(hex);
      mesh.component.push_back(k);
    }
    if (!what.founded) continue;
    if (what.rounds.empty()) feet = feet_of(what, part);
    for (int n : feet) base.push_back(shift + n);
  }
  mesh.node_groups["base"] = base;
  mesh.local = mesh.nodes;
  for (Vec3& x : mesh.nodes) x = spec.rotation * x + spec.position;
  return mesh;
}

}  // namespace talus::fem

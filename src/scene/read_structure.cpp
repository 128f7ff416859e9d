#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "contact/structures/refinable.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

const std::vector<std::string> faces{"-x", "+x", "-y", "+y", "-z", "+z"};

Box3 read_region(const View& view) {
  const Vec3 low = view.vector("min"), high = view.vector("max");
  if (view.get("min") && view.get("max") && !(low.array() <= high.array()).all())
    view.problem("max", "must not be below min", "swap the corners");
  return Box3(low, high);
}

void read_supports(const View& view, StructureSpec& spec) {
  const Node* node = view.get("support");
  if (view.has("support") && !node) return;
  if (!node) {
    spec.supports.push_back({.face = "-z", .group = "", .region = {}, .held = {true, true, true}});
    return;
  }
  // A point or a line is a box about the nodes it means; cells are far larger than this.
  const double tolerance =
      1e-3 * (spec.cell_size > 0 ? spec.cell_size
              : spec.cells[0] > 0
                  ? spec.size.minCoeff() / *std::max_element(spec.cells.begin(), spec.cells.end())
                  : 1e-3);
  for (const Node& item : node->items) {
    StructureSpec::Support support;
    if (item.kind == Node::Kind::text) {
      if (std::find(faces.begin(), faces.end(), item.text) != faces.end())
        support.face = item.text;
      else if (spec.kind == "mesh")
        support.group = item.text;
      else
        view.problem("support", fmt::format("\"{}\" is no face", item.text),
                     "faces are -x, +x, -y, +y, -z, +z; only kind = \"mesh\" has groups");
      spec.supports.push_back(support);  // one that is wrong, too: the structure is not meant to be free
      continue;
    }
    if (item.kind != Node::Kind::table) continue;
    const View at = view.below(item, "structure.support");
    const int forms = at.has("face") + at.has("group") + at.has("point") + at.has("line") + at.has("region");
    if (forms != 1) {
      at.problem("", "a support is exactly one of face, group, point, line, region", "keep one of them");
      spec.supports.push_back(support);
      continue;
    }
    support.face = at.text("face");
    support.group = at.text("group");
    if (at.has("group") && spec.kind != "mesh")
      at.problem("group", "only kind = \"mesh\" has groups", "name a face, a point, a line or a region");
    if (const auto point = at.maybe_vector("point"))
      support.region = Box3(*point - Vec3::Constant(tolerance), *point + Vec3::Constant(tolerance));
    if (at.get("line")) {
      const auto ends = at.vectors("line");
      if (ends.size() != 2 || ((ends[0] - ends[1]).array().abs() > tolerance).count() != 1)
        at.problem("line", "must be two points that differ in one coordinate",
                   "write [[x, y, z], [x, y, z]], along an axis");
      else
        support.region = Box3(ends[0].cwiseMin(ends[1]) - Vec3::Constant(tolerance),
                              ends[0].cwiseMax(ends[1]) + Vec3::Constant(tolerance));
    }
    if (const auto region = at.table("region")) support.region = read_region(*region);
    const std::string held = at.text("held");
    if (at.get("held") || !at.has("held")) {
      if (held.empty() || held.find_first_not_of("xyz") != std::string::npos)
        at.problem("held", "must be some of the letters x, y, z",
                   "write held = \"xyz\", or \"z\" for a roller");
      support.held = {held.find('x') != std::string::npos, held.find('y') != std::string::npos,
                      held.find('z') != std::string::npos};
    }
    spec.supports.push_back(support);
  }
}

/// Cells that are to be halved where blocks are about to strike.
void read_impact_zone(const View& at, double cell_size, StructureSpec& spec) {
  if (impact_refinement(spec).cell_size > 0)
    at.problem("where", "\"impact\" stands in one zone of a structure", "remove one of them");
  for (const char* key : {"region", "local"})
    if (at.has(key))
      at.problem(key, "has no meaning with where = \"impact\", which finds its own places", "remove it");
  spec.parameters.emplace_back(ImpactRefinement::size_key, cell_size);
  if (const auto reach = at.maybe("reach")) spec.parameters.emplace_back(ImpactRefinement::reach_key, *reach);
}

void read_refinements(const View& view, StructureSpec& spec) {
  const auto is_local = [&] {
    return std::any_of(spec.parameters.begin(), spec.parameters.end(),
                       [](const auto& p) { return p.first == "local_refinement"; });
  };
  for (const View& at : view.tables("refine")) {
    StructureSpec::Refinement zone;
    zone.cell_size = at.number("cell_size");
    if (at.get("cell_size") && spec.cell_size > 0 && zone.cell_size > spec.cell_size)
      at.problem("cell_size", "must not exceed the structure's cell_size", "give a smaller one");
    if (at.text("where") == "impact") {
      read_impact_zone(at, zone.cell_size, spec);
      continue;
    }
    if (at.has("reach"))
      at.problem("reach", "is of zones with where = \"impact\"",
                 "remove it, or write where = \"impact\" in place of the region");
    if (const auto region = at.table("region"))
      zone.region = read_region(*region);
    else
      at.problem("region", "a zone of finer cells needs its place",
                 "give the region in scene coordinates, or write where = \"impact\"");
    spec.refinements.push_back(zone);
    const bool local = at.flag("local");
    if (local && spec.refinements.size() == 1) spec.parameters.emplace_back("local_refinement", 1);
    if (local != is_local())
      at.problem("local", "is the same for all zones of a structure", "write it in each of them, or in none");
  }
  if (spec.refinements.empty() || is_local()) return;
  if (spec.kind == "mesh")
    view.problem("refine", "a mesh file brings its own cells",
                 "write local = true in each zone, or refine in the mesh generator");
  else if (view.has("cells"))
    view.problem("refine", "cells fixes their number",
                 "give cell_size in place of cells, or write local = true in each zone");
}

/// A viaduct's own key for what `diameter` says; a resolved scene has width and depth beside it.
void read_pier_diameter(const View& view, StructureSpec& spec) {
  const auto diameter = view.maybe("pier_diameter");
  if (!diameter) return;
  if (spec.section != "round")
    return view.problem("pier_diameter", "only a round section has a diameter", "write section = \"round\"");
  if (view.has("diameter") || view.has("section_size"))
    return view.problem("pier_diameter", "the section has its diameter already", "keep one of them");
  for (const char* key : {"pier_width", "pier_depth"}) {
    if (!view.has(key))
      spec.parameters.emplace_back(key, *diameter);
    else if (const auto other = view.maybe(key); other && *other != *diameter)
      view.problem(key, "differs from pier_diameter, and a round pier has one diameter", "remove it");
  }
}

void read_section(const View& view, StructureSpec& spec) {
  Vec3 outer = Vec3::Zero();
  if (const Node* node = view.get("section"); node && node->kind == Node::Kind::array) {
    spec.section = "rectangular";
    outer = vector_of(*node, dimension::length);
    if (view.has("section_size"))
      view.problem("section_size", "the section has its size already", "remove it, or name the section");
  } else {
    spec.section = view.text("section");
    if (const auto size = view.maybe_vector("section_size")) outer = *size;
  }
  spec.wall_thickness = view.number("wall_thickness");
  const double diameter = view.number("diameter");
  if (view.has("diameter") && view.has("section_size"))
    view.problem("section_size", "the section has its diameter already", "keep one of them");
  if (spec.section == "round" && diameter > 0)
    outer = Vec3(diameter, diameter, 0);
  else if (view.has("diameter") && spec.section != "round")
    view.problem("diameter", "only a round section has a diameter",
                 spec.section == "hollow" ? "a hollow one has section_size = [x, y] and wall_thickness"
                                          : "write section = \"round\"");
  if (spec.section == "hollow")
    view.missing("wall_thickness", "a hollow section needs it");
  else if (view.has("wall_thickness"))
    view.problem("wall_thickness", "only a hollow section has a wall", "write section = \"hollow\"");
  if (spec.section == "hollow" && outer.x() > 0 && 2 * spec.wall_thickness >= std::min(outer.x(), outer.y()))
    view.problem("wall_thickness", "twice the wall must be less than the section",
                 "make it thinner, or the section rectangular");
  if (spec.kind != "column") {
    if (spec.kind == "viaduct" && view.has("pier_diameter")) return read_pier_diameter(view, spec);
    if (outer.x() > 0 && spec.kind == "viaduct") {
      spec.parameters.emplace_back("pier_width", outer.x());
      spec.parameters.emplace_back("pier_depth", outer.y());
      if (spec.section == "round") spec.parameters.emplace_back("pier_diameter", outer.x());
    }
    return;
  }
  if (!(outer.x() > 0) && (!view.has("section") || view.get("section")) && !view.has("section_size") &&
      !view.has("diameter"))
    view.problem(
        "section",
        spec.section == "round" ? "a round section needs its diameter" : "the section needs its size",
        spec.section == "round"    ? "add diameter"
        : spec.section == "hollow" ? "add section_size = [x, y]"
                                   : "write section = [x, y]");
  view.missing("height", "a column needs it");
  view.missing("base", "a column needs it");
  spec.position = view.vector("base");
  spec.size = Vec3(outer.x(), outer.y(), view.number("height"));
}

void read_rebar(Reading& in, const View& view, StructureSpec& spec) {
  spec.rebar_file = in.file(view, "rebar");
  spec.bond = view.text("bond");
  if (view.has("bond") && spec.bond == "mc2010" && !view.has("rebar"))
    view.problem("bond", "has no effect: there are no bars", "add [[structure.rebar]], or leave bond out",
                 Problem::Severity::warning);
  for (const View& rule : view.tables("rebar")) {
    StructureSpec::RebarRule bar;
    bar.kind = rule.text("kind");
    bar.part = rule.text("part");
    if (bar.part != "pier" && spec.kind != "viaduct")
      rule.problem("part", "only a viaduct has decks and cap beams",
                   "remove it, or write kind = \"viaduct\"");
    if (bar.part == "deck" && bar.kind == "stirrups")
      rule.problem("kind", "decks take longitudinal bars only",
                   "give stirrups of a deck as polylines in a CSV file");
    bar.bars = static_cast<int>(rule.integer("bars"));
    bar.diameter = rule.number("diameter");
    bar.cover = rule.number("cover");
    bar.spacing = rule.number("spacing");
    bar.yield = rule.number("yield");
    bar.ultimate_strain = rule.number("ultimate_strain");
    bar.prestress = rule.number("prestress");
    if (bar.kind == "longitudinal" && bar.spacing > 0)
      rule.problem("spacing", "only stirrups have a spacing", "remove it: it has no effect",
                   Problem::Severity::warning);
    if (bar.kind == "stirrups" && bar.bars > 0)
      rule.problem("bars", "only longitudinal bars have a number: a stirrup is one closed tie",
                   "remove it: it has no effect; inner ties need polylines in a CSV file",
                   Problem::Severity::warning);
    if (bar.prestress >= bar.yield && rule.get("prestress"))
      rule.problem("prestress", "must be below the yield stress", "at most 0.75 of it after losses");
    if (bar.kind == "longitudinal" && bar.bars < 1 && (rule.get("bars") || !rule.has("bars")))
      rule.problem("bars", "longitudinal bars need a number of at least 1", "add bars");
    if (bar.kind == "stirrups" && !(bar.spacing > 0) && (rule.get("spacing") || !rule.has("spacing")))
      rule.problem("spacing", "stirrups need a spacing above 0", "add spacing");
    spec.rebar_rules.push_back(bar);
  }
  if (view.get("rebar") && !(spec.f_cm > 0))
    view.problem("rebar", "bars are embedded in concrete, and the material has no f_cm",
                 "give the material f_cm, or remove the bars");
}

void read_material(Reading& in, const View& view, StructureSpec& spec) {
  spec.material = in.material(view, "material");
  if (!in.has_material(view, "material")) {
    spec.f_cm = 30e6, spec.density = 2450;  // that it is not known is reported once
    return;
  }
  const Material& m = in.scene.materials[static_cast<std::size_t>(spec.material)];
  spec.density = m.density;
  spec.young = m.young;
  spec.poisson = m.poisson;
  spec.f_cm = m.f_cm;
  spec.tensile_strength = m.tensile_strength;
  spec.fracture_energy = m.fracture_energy;
  if (!(m.f_cm > 0) && !(m.young > 0)) {
    view.problem("material", fmt::format("the material \"{}\" has neither f_cm nor young", m.name),
                 "add f_cm for concrete, or young, poisson and density for an elastic structure");
    spec.f_cm = 30e6;  // what needs a concrete is not reported, too
  }
  if (!(m.density > 0))
    view.problem("material", fmt::format("the material \"{}\" has no density", m.name),
                 "add density to the [[material]]");
  if (spec.damage != "none" && !(spec.f_cm > 0))
    view.problem("damage", fmt::format("needs a concrete, and \"{}\" has no f_cm", m.name),
                 "add f_cm to the material, e.g. f_cm = \"38 MPa\", or write damage = \"none\"");
}

/// Measures of parts that the viaduct does not have.
void warn_of_idle_measures(const View& view, const StructureSpec& spec) {
  const auto count = [&](const char* name, double otherwise) {
    const auto found = std::find_if(spec.parameters.begin(), spec.parameters.end(),
                                    [&](const auto& p) { return p.first == name; });
    return found != spec.parameters.end() ? found->second : otherwise;
  };
  const auto idle = [&](const char* key, const char* rule, const char* remedy) {
    if (view.has(key)) view.problem(key, rule, remedy, Problem::Severity::warning);
  };
  if (count("girders", 0) == 0)
    for (const char* key : {"slab_thickness", "girder_width"})
      idle(key, "has no effect: a solid deck has no girders", "remove it, or give girders");
  if (count("piers_per_bent", 1) == 1)
    idle("pier_spacing", "has no effect: a bent has one pier", "remove it, or give piers_per_bent");
}

void read_viaduct(const View& view, StructureSpec& spec) {
  static const std::vector<std::string> names{"spans",          "span_length",       "pier_height",
                                              "deck_level",     "pier_spacing",      "piers_per_bent",
                                              "pier_width",     "pier_depth",        "pier_diameter",
                                              "cap_height",     "cap_width",         "cap_length",
                                              "deck_width",     "deck_depth",        "slab_thickness",
                                              "bottom_slab",    "girders",           "girder_width",
                                              "bearing_height", "bearing_stiffness", "bearing_friction",
                                              "bearing_seat",   "abutments",         "skew",
                                              "grade"};
  for (const std::string& name : names) {
    const auto value = view.maybe(name);
    if (!view.has(name)) continue;
    if (spec.kind != "viaduct")
      view.problem(name, "only a viaduct has this measure", "remove it, or write kind = \"viaduct\"");
    else if (value) {
      const bool counted =
          name == "spans" || name == "piers_per_bent" || name == "girders" || name == "abutments";
      if (counted && *value != std::round(*value))
        view.problem(name, "must be a whole number",
                     name == "spans" ? "give spans of other lengths in span_lengths" : "correct it");
      if (name == "abutments" && *value != 0 && *value != 1)
        view.problem(name, "must be 0 or 1", "1: abutments at both ends");
      spec.parameters.emplace_back(name, *value);
    }
  }
  if (view.has("span_lengths")) {
    if (spec.kind != "viaduct")
      view.problem("span_lengths", "only a viaduct has this measure",
                   "remove it, or write kind = \"viaduct\"");
    for (const auto& [span, length] : view.pairs("span_lengths")) {
      if (span < 1 || span != std::round(span))
        view.problem("span_lengths", fmt::format("{:g} is no number of a span", span),
                     "count the spans from 1");
      spec.parameters.emplace_back(fmt::format("span_length.{:.0f}", span), length);
    }
  }
  const auto free = view.table("parameters");
  if (free && !free->node().entries.empty() && view.get("kind") && spec.kind != "viaduct")
    view.problem("parameters", "only a viaduct has further measures",
                 "remove them, or write kind = \"viaduct\"");
  else if (free)
    for (const Node::Entry& entry : free->node().entries) {
      if (entry.value.bad) continue;
      std::string error;
      const double value = entry.value.is_number()
                               ? entry.value.as_number()
                               : parse_quantity(entry.value.text, error).value_or(Quantity{}).value;
      spec.parameters.emplace_back(entry.key, value);
    }
  std::sort(spec.parameters.begin(), spec.parameters.end());
  for (std::size_t i = 1; i < spec.parameters.size(); ++i)
    if (spec.parameters[i].first == spec.parameters[i - 1].first)
      view.problem("parameters", fmt::format("\"{}\" is given twice", spec.parameters[i].first),
                   "keep one of them");
  if (spec.kind == "viaduct") warn_of_idle_measures(view, spec);
}

}  // namespace

void read_structures(Reading& in, const View& root) {
  std::map<std::string, int> taken;
  int place = 0;
  for (const View& view : root.tables("structure")) {
    StructureSpec spec;
    spec.name = in.name(view, "name", fmt::format("S{}", ++place), taken);
    spec.kind = view.text("kind");
    spec.damage = view.text("damage");
    read_material(in, view, spec);
    spec.position = view.vector("position");
    const bool placed = spec.kind != "mesh" || view.has("position");
    if (spec.kind == "mesh" && placed) spec.parameters.emplace_back("centred", 1.0);
    if (!placed && view.has("orientation") && view.get("kind"))
      view.problem("orientation", "a mesh without position lies where its file says",
                   "add a position, or remove the orientation");
    spec.rotation = read_orientation(view);
    const auto only = [&](const char* key, const std::vector<std::string>& kinds) {
      if (view.has(key) && std::find(kinds.begin(), kinds.end(), spec.kind) == kinds.end())
        view.problem(key, fmt::format("has no effect with kind = \"{}\"", spec.kind),
                     fmt::format("remove it, or write kind = \"{}\"", fmt::join(kinds, "\" or \"")));
    };
    spec.size = Vec3::Ones();
    spec.cell_size = view.number("cell_size");
    if (const Node* cells = view.get("cells"))
      for (std::size_t i = 0; i < 3; ++i) spec.cells[i] = static_cast<int>(cells->items[i].integer);
    if (view.get("kind")) {
      only("base", {"column"});
      only("height", {"column"});
      only("size", {"box"});
      only("file", {"mesh"});
      for (const char* key : {"section", "section_size", "diameter", "wall_thickness"})
        only(key, {"column", "viaduct"});
      if (spec.kind == "column" && view.has("position"))
        view.problem("position", "a column stands on its base", "give base, the centre of its foot");
      if (spec.kind == "box") {
        view.missing("size", "a box needs it");
        view.missing("position", "a box needs it");
        spec.size = view.vector("size");
      }
      if (spec.kind == "viaduct") {
        view.missing("position", "a viaduct needs it");
        if (view.has("deck_level") && view.has("pier_height"))
          view.problem("deck_level", "pier_height fixes the deck's level already", "keep one of them");
        if (view.has("cells")) view.problem("cells", "a viaduct has parts of many sizes", "give cell_size");
      }
      if (spec.kind == "column" || spec.kind == "viaduct") read_section(view, spec);
      if (spec.kind == "mesh") {
        view.missing("file", "kind = \"mesh\" needs it");
        for (const char* key : {"cell_size", "cells"})
          if (view.has(key)) view.problem(key, "a mesh file brings its own cells", "remove it");
      } else {
        if (view.has("cell_size") && view.has("cells"))
          view.problem("cells", "cell_size and cells say the same thing", "give one of them");
        if (!view.has("cells"))
          view.missing("cell_size", spec.kind == "viaduct" ? "" : "or cells = [nx, ny, nz]");
      }
    }
    spec.file = in.file(view, "file");
    read_refinements(view, spec);
    read_viaduct(view, spec);
    read_supports(view, spec);
    const Node* const support = view.has("support") ? view.get("support") : nullptr;
    const bool free = support && support->items.empty();
    if (impact_refinement(spec).cell_size > 0 && free)
      view.problem("refine", "only structures with supports are refined where they are struck",
                   "give it supports, or cells that are fine throughout");
    spec.gravity_preload = view.text("preload") == "gravity";
    spec.rate_effect = view.flag("rate_effect");
    spec.erosion = view.flag("erosion");
    if (spec.damage == "concrete" || view.has("aggregate")) spec.aggregate = view.number("aggregate");
    if (spec.aggregate > 0 && spec.damage != "concrete")
      view.problem("aggregate", "only the law damage = \"concrete\" knows interlocking faces",
                   "remove it, or take that law");
    read_rebar(in, view, spec);
    spec.damping_ratio = view.number("damping_ratio");
    spec.integrator = view.text("integrator");
    spec.critical_step_fraction = view.number("critical_step_fraction");
    spec.initial_velocity = view.vector("initial_velocity");
    if (free && spec.gravity_preload && in.scene.simulation.gravity.norm() > 0)
      view.problem("preload", "a structure without support has no state at rest under gravity",
                   "write preload = \"none\", or add a support");
    std::map<std::string, int> probes;
    for (const View& at : view.tables("probe")) {
      if (at.has("at") && at.has("offset"))
        at.problem("offset", "at gives the point already", "keep one of them");
      else if (at.has("offset") && !placed)
        at.problem("offset", "a mesh without position has no point to count from",
                   "give at, in scene coordinates");
      else if (!at.has("offset"))
        at.missing("at", "or offset, from the structure's base or position");
      spec.probes.push_back(
          {in.name(at, "name", "", probes),
           at.has("offset") ? Vec3(spec.position + spec.rotation * at.vector("offset")) : at.vector("at")});
    }
    for (const View& at : view.tables("load")) {
      StructureSpec::Load load;
      if (const auto region = at.table("region")) load.region = read_region(*region);
      load.traction = at.vector("traction");
      load.history = at.pairs("history");
      for (std::size_t i = 1; i < load.history.size(); ++i)
        if (!(load.history[i].first > load.history[i - 1].first)) {
          at.problem("history", "the times must grow",
                     "sort the pairs by time; a jump is two times close together");
          break;
        }
      spec.loads.push_back(std::move(load));
    }
    in.scene.structures.push_back(std::move(spec));
  }
}

}  // namespace talus::scene

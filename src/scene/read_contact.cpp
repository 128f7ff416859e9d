#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>
#include <sstream>

#include "core/suggest.hpp"
#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

struct Entry {
  View view;
  std::string a, b;
  ContactLaw law;
  bool stiffness_given = false;
  int stars() const { return (a == "*") + (b == "*"); }
  bool same_pair(const Entry& other) const {
    return (a == other.a && b == other.b) || (a == other.b && b == other.a);
  }
};

/// True for a heading that starts with one of the words, or is one of the letters.
bool heads(std::string heading, std::string_view letters, std::initializer_list<std::string_view> words) {
  std::transform(heading.begin(), heading.end(), heading.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return (heading.size() == 1 && letters.find(heading[0]) != std::string_view::npos) ||
         std::any_of(words.begin(), words.end(), [&](auto word) { return heading.starts_with(word); });
}

/// Indentation and force of a table in a file.
std::vector<std::pair<double, double>> read_force_law(const View& form, const std::string& path) {
  const NumberTable table = read_numbers(form, "file", path, 2, [](std::size_t column, const std::string&) {
    return ColumnHolds{true, column == 0 ? dimension::length : dimension::force};
  });
  const auto& header = table.header;
  if (header.size() == 2 &&
      (heads(header[0], "fpnq", {"force", "load"}) ||
       heads(header[1], "sudw", {"indentation", "penetration", "displacement", "deflection"}))) {
    form.problem("file", fmt::format("the columns are {}, {}", header[0], header[1]),
                 "the first one is the indentation, the second one the force: swap them");
    return {};
  }
  std::vector<std::pair<double, double>> law;
  for (const auto& row : table.rows) law.emplace_back(row[0], row[1]);
  return law;
}

void read_stiffness(const View& view, Entry& entry) {
  ContactLaw& law = entry.law;
  const Node* normal = view.get("normal_stiffness");
  const Node* shear = view.get("shear_stiffness");
  const auto value = [](const Node& node) {
    std::string error;
    if (node.is_number()) return Quantity{node.as_number(), dimension::stiffness};
    return parse_quantity(node.text, error).value_or(Quantity{});
  };
  if (normal && normal->text == "hard") {
    law.stiffness = ContactLaw::Stiffness::hard;
    entry.stiffness_given = true;
  } else if (normal) {
    const Quantity k = value(*normal);
    law.stiffness = k.dimension == dimension::stiffness ? ContactLaw::Stiffness::per_contact
                                                        : ContactLaw::Stiffness::per_area;
    law.normal_stiffness = k.value;
    law.shear_stiffness = k.value / 2.5;
    entry.stiffness_given = true;
  }
  law.chosen = view.flag("normal_stiffness_chosen") && entry.stiffness_given;
  if (!shear) return;
  if (!normal || law.stiffness == ContactLaw::Stiffness::hard) {
    if (!view.has("normal_stiffness") || normal)
      view.problem("shear_stiffness",
                   normal ? "hard contact has no shear spring" : "needs a normal_stiffness beside it",
                   normal ? "remove it, or give normal_stiffness a value" : "add normal_stiffness");
    return;
  }
  const Quantity k = value(*shear);
  const bool per_contact = k.dimension == dimension::stiffness;
  // A bare number takes the unit of its neighbour.
  if (!shear->is_number() && per_contact != (law.stiffness == ContactLaw::Stiffness::per_contact)) {
    view.problem("shear_stiffness", "must be in the unit of normal_stiffness",
                 "give both in N/m, or both in Pa/m");
    return;
  }
  law.shear_stiffness = k.value;
}

void read_law_form(Reading& in, const View& view, ContactLaw& law) {
  const auto form = view.table("contact_law");
  if (!form || !form->get("kind")) return;
  const std::string kind = form->text("kind");
  if (kind == "hertz") {
    law.kind = ContactLaw::Kind::hertz;
    form->missing("radius", "a Hertz contact needs it");
    law.hertz_radius = form->number("radius");
  } else if (kind == "crushing") {
    law.kind = ContactLaw::Kind::crushing;
    form->missing("pressure", "a crushing contact needs it");
    law.crushing_pressure = form->number("pressure");
    law.yield_gradient = form->number("gradient");
    law.yield_thickness = form->maybe("thickness").value_or(0);
    law.ploughing_pressure = form->number("ploughing");
    law.ploughing_density = form->number("ploughing_density");
    if (law.yield_gradient > 0 && view.has("normal_stiffness") &&
        law.stiffness != ContactLaw::Stiffness::per_area)
      form->problem("gradient", "needs a normal_stiffness per area", "give normal_stiffness in Pa/m");
  } else if (kind == "table") {
    law.kind = ContactLaw::Kind::table;
    if (form->has("file") == form->has("points"))
      form->problem(form->has("file") ? "points" : "kind", "a table law needs exactly one of file and points",
                    "write { kind = \"table\", file = \"law.csv\" }");
    if (form->has("points"))
      law.table = form->pairs("points");
    else if (const std::string path = in.file(*form, "file", true); !path.empty())
      law.table = read_force_law(*form, path);
    const std::string key = form->has("points") ? "points" : "file";
    if (form->get(key) && !law.table.empty()) {
      bool grows = law.table.size() >= 2;
      for (std::size_t i = 1; i < law.table.size(); ++i)
        grows = grows && law.table[i].first > law.table[i - 1].first &&
                law.table[i].second >= law.table[i - 1].second;
      if (!grows || law.table[0].first != 0 || law.table[0].second != 0)
        form->problem(key, "the table must start at 0, 0, and indentation and force must grow",
                      "correct the table");
      else if (!(law.table.back().second > law.table[law.table.size() - 2].second))
        form->problem(key,
                      "the force must grow from the last point but one to the last: beyond the table it goes "
                      "on with that slope, and here nothing would hold a block",
                      "add a point of a larger force");
    }
  }
  const auto stray = [&](const char* key, const char* owner) {
    if (form->has(key) && kind != owner)
      form->problem(key, fmt::format("has no effect with kind = \"{}\"", kind), "remove it");
  };
  stray("radius", "hertz");
  stray("pressure", "crushing");
  for (const char* key : {"gradient", "thickness", "ploughing", "ploughing_density"}) stray(key, "crushing");
  stray("file", "table");
  stray("points", "table");
}

/// A ground by name: what it fills in, and the ranges of its values (docs/theory/ground.md has their
/// sources).
struct Preset {
  const char* name;
  double friction, restitution, rolling;  // [deg], 1, 1
  double most, way, recovery;             // slip friction: coefficient, [m], [1/s]; most 0: none
  double height, drag;                    // vegetation [m], [kg/s]; 0: none
  const char* ranges;
};
constexpr Preset presets[] = {
    {"rock", 35, 0.35, 0.05, 0, 1, 0, 0, 0,
     "friction 28 to 39 deg, restitution 0 to 0.65, rolling_resistance 0 to 0.3"},
    {"talus", 38, 0.2, 0.15, 0, 1, 0, 0, 0,
     "friction 32 to 42 deg, restitution 0 to 0.45, rolling_resistance 0 to 0.35"},
    {"compact soil", 22, 0.15, 0.2, 2, 0.4, 175, 0, 0,
     "friction 19 to 29 deg, restitution 0 to 0.35, rolling_resistance 0 to 0.35, slip_friction.most 2, "
     "length 0.33 to 0.5 m, recovery 150 to 185 1/s"},
    {"soft soil", 14, 0.05, 0.3, 2, 0.8, 100, 0, 0,
     "friction 11 to 17 deg, restitution 0 to 0.15, rolling_resistance 0 to 0.8, slip_friction.most 2, "
     "length 0.67 to 1 m, recovery 50 to 125 1/s"},
    {"forest", 22, 0.15, 0.2, 2, 0.4, 175, 5, 500,
     "as compact soil; vegetation.drag 250 (open) to 750 kg/s (dense), vegetation.height 2 to 10 m"},
};

/// Friction, the laws of ground, and what a preset fills in.
void read_ground(Reading& in, const View& view, ContactLaw& law) {
  const Preset* preset = nullptr;
  if (view.has("preset"))
    for (const Preset& p : presets)
      if (view.text("preset") == p.name) preset = &p;
  if (preset == nullptr) {
    if (!view.has("friction")) view.missing("friction", "or preset");
  } else {
    if (!view.has("friction")) law.friction = std::tan(preset->friction * M_PI / 180);
    law.restitution = preset->restitution;
    law.rolling_resistance = preset->rolling;
    if (preset->most > 0)
      law.friction_most = std::max(preset->most, law.friction), law.friction_way = preset->way,
      law.friction_recovery = preset->recovery;
    law.vegetation_height = preset->height, law.vegetation_drag = preset->drag;
    const auto names = view.texts("between");
    in.scene.notes.push_back(
        fmt::format("contact {}: preset \"{}\" stands for what is left out; ranges: {}. Starting values, to "
                    "be calibrated (docs/theory/ground.md says where they come from).",
                    fmt::join(names, "/"), preset->name, preset->ranges));
  }
  if (const auto slip = view.table("slip_friction")) {
    if (const Node* most = slip->get("most")) law.friction_most = friction_coefficient(*most);
    if (const auto way = slip->maybe("length")) law.friction_way = *way;
    law.friction_recovery = slip->number("recovery");
    if (law.friction_most > 0 && law.friction_most < law.friction)
      slip->problem("most", fmt::format("is less than friction ({:.4g}), from which it grows", law.friction),
                    "give the larger of the two as most");
  }
  if (const auto plants = view.table("vegetation"))
    law.vegetation_height = plants->number("height"), law.vegetation_drag = plants->number("drag");
}

std::vector<Entry> read_entries(Reading& in, const View& root) {
  std::vector<Entry> entries;
  for (const View& view : root.tables("interface")) {
    Entry entry{view, {}, {}, {}};
    const auto names = view.texts("between");
    if (view.get("between")) {
      if (names.size() != 2) {
        view.problem("between", "must name two materials",
                     "write between = [\"rock\", \"slope\"]; \"*\" stands for any");
        in.names_good = false;
        continue;
      }
      for (const std::string& name : names) {
        if (name == "*" || in.material_index.count(name) > 0) continue;
        std::vector<std::string> known;
        for (const Material& m : in.scene.materials) known.push_back(m.name);
        const std::string near = nearest_name(name, known);
        view.problem("between", fmt::format("there is no material \"{}\"", name),
                     near.empty() ? "add it as [[material]], or use it in [site] or a [[plane]]"
                                  : fmt::format("did you mean \"{}\"?", near));
        in.names_good = false;
      }
      entry.a = names[0];
      entry.b = names[1];
    } else {
      in.names_good = false;
      continue;
    }
    ContactLaw& law = entry.law;
    if (const Node* friction = view.get("friction")) law.friction = friction_coefficient(*friction);
    read_ground(in, view, law);
    law.cohesion = view.number("cohesion");
    law.tension = view.number("tension");
    if (law.tension > 0 && law.friction > 0 && law.cohesion < law.friction * law.tension)
      view.problem(
          "tension",
          fmt::format("reaches only {:.4g} Pa: friction and cohesion end in a tip at cohesion over friction",
                      law.cohesion / law.friction),
          fmt::format("give a cohesion of {:.4g} Pa or more", law.friction * law.tension),
          Problem::Severity::warning);
    if (const auto given = view.maybe("restitution")) law.restitution = given;
    if (const auto half = view.maybe("restitution_half_speed")) {
      law.restitution_half_speed = *half;
      if (!law.restitution)
        view.problem("restitution_half_speed", "there is no restitution that could fall with speed",
                     "add restitution, its value at low speed, or remove it");
    }
    law.restitution_tangential = view.maybe("restitution_tangential");
    if (const auto given = view.maybe("rolling_resistance")) law.rolling_resistance = *given;
    // A patch within which the normal force shifts by f has a radius of at least f; uniform pressure on it
    // resists drilling by 2/3 mu f N.
    law.drilling_resistance =
        view.maybe("drilling_resistance").value_or(2.0 / 3 * law.friction * law.rolling_resistance);
    law.damping_ratio = view.number("damping_ratio");
    read_stiffness(view, entry);
    read_law_form(in, view, law);
    if (law.damping_ratio > 0 && entry.stiffness_given && !law.chosen && !law.sprung())
      view.problem(
          "damping_ratio", "hard contact has no spring to damp",
          "remove it, or give normal_stiffness a value; restitution says what comes back of an impact");
    if (in.scene.simulation.method == Simulation::Method::dda1988 && entry.stiffness_given &&
        law.stiffness == ContactLaw::Stiffness::hard)
      view.problem("normal_stiffness", "method \"dda-1988\" has no hard contact",
                   "give a penalty stiffness, e.g. \"30 GN/m\", or leave it out");
    for (const Entry& other : entries)
      if (entry.same_pair(other))
        view.problem("between",
                     "there is an entry for this pair already" +
                         std::string(other.law == entry.law ? "" : ", and it says something else"),
                     "keep one of the two");
    entries.push_back(std::move(entry));
  }
  return entries;
}

/// The entry that holds for a pair: exact before one "*" before two. Two one-star entries that differ are a
/// contradiction; two of the same pair were reported.
const Entry* match(const std::vector<Entry>& entries, const std::string& a, const std::string& b,
                   bool& contradiction) {
  contradiction = false;
  const Entry* best = nullptr;
  for (const Entry& entry : entries) {
    const auto fits = [&](const std::string& x, const std::string& y) {
      return (entry.a == x || entry.a == "*") && (entry.b == y || entry.b == "*");
    };
    if (!fits(a, b) && !fits(b, a)) continue;
    if (!best || entry.stars() < best->stars()) {
      best = &entry;
      contradiction = false;
    } else if (entry.stars() == best->stars() && !entry.same_pair(*best) && entry.law != best->law) {
      contradiction = true;
    }
  }
  return best;
}

struct Needs {
  std::set<std::pair<int, int>> pairs;      // lower index first
  std::set<std::pair<int, int>> fragments;  // only pieces of a structure can make these
  std::set<std::pair<int, int>> optional;   // structures touch each other and the ground only where an entry
                                            // says so
};

Needs needed_pairs(const Scene& scene) {
  struct Body {
    int material;
    bool moves;
    bool structure;
  };
  std::vector<Body> bodies;
  for (const Block& b : scene.blocks) bodies.push_back({b.material, !b.fixed, false});
  if (scene.rock_mass) bodies.insert(bodies.end(), 2, {scene.rock_mass->material, true, false});
  if (scene.rock_mass && scene.rock_mass->from_terrain)
    bodies.push_back({scene.rock_mass->bed_material, false, false});
  if (scene.site) {
    bodies.push_back({scene.site->material, false, false});
    for (const auto& area : scene.site->material_areas) bodies.push_back({area.material, false, false});
  }
  for (const Plane& plane : scene.planes) bodies.push_back({plane.material, false, false});
  for (const StructureSpec& s : scene.structures) bodies.push_back({s.material, false, true});
  Needs needs;
  const auto pair = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
  // Many blocks share few materials: one look per material, and the count shows whether a material can meet
  // itself.
  std::map<std::pair<int, bool>, int> count;
  for (const Body& b : bodies) ++count[{b.material, b.moves}];
  for (const auto& [first, n] : count)
    for (const auto& [second, m] : count) {
      if (!first.second && !second.second) continue;
      if (first == second && n < 2) continue;
      needs.pairs.insert(pair(first.first, second.first));
    }
  if (scene.impact && !scene.structures.empty())
    needs.pairs.insert(pair(scene.impact->material,
                            scene.structures[static_cast<std::size_t>(scene.impact->structure)].material));
  // A viaduct keeps its terrain under the one block of [impact]: talus impact asks for the law, talus run has
  // no use for it.
  if (scene.impact && scene.site && !scene.structures.empty() &&
      scene.structures[static_cast<std::size_t>(scene.impact->structure)].kind == "viaduct") {
    needs.optional.insert(pair(scene.impact->material, scene.site->material));
    for (const auto& area : scene.site->material_areas)
      needs.optional.insert(pair(scene.impact->material, area.material));
  }
  for (std::size_t i = 0; i < scene.structures.size(); ++i)
    for (std::size_t j = i + 1; j < scene.structures.size(); ++j)
      needs.optional.insert(pair(scene.structures[i].material, scene.structures[j].material));
  if (scene.coupling.scheme == Coupling::Scheme::two_way)
    for (const StructureSpec& s : scene.structures)
      for (const Body& b : bodies)
        if (!b.moves && !b.structure) needs.optional.insert(pair(s.material, b.material));
  if (scene.coupling.fragments && scene.coupling.scheme == Coupling::Scheme::two_way)
    for (const StructureSpec& s : scene.structures)
      if (s.damage != "none")
        for (const Body& b : bodies)
          if (needs.pairs.count(pair(s.material, b.material)) == 0)
            needs.fragments.insert(pair(s.material, b.material));
  return needs;
}

/// Size of the smallest block of either material, 0 if none is known.
double least_block(const Scene& scene, int a, int b) {
  double least = 0;
  const auto offer = [&](int material, double size) {
    if ((material == a || material == b) && size > 0 && (least == 0 || size < least)) least = size;
  };
  for (const Block& block : scene.blocks)
    offer(block.material,
          shape_size(block.shape, scene.materials[static_cast<std::size_t>(block.material)].density));
  if (scene.rock_mass) {
    for (const JointSet& set : scene.rock_mass->joint_sets) offer(scene.rock_mass->material, set.spacing);
    if (scene.rock_mass->box && scene.rock_mass->joint_sets.empty())
      offer(scene.rock_mass->material, std::cbrt(scene.rock_mass->box->sizes().prod()));
  }
  if (scene.impact)
    offer(scene.impact->material,
          shape_size(scene.impact->shape,
                     scene.materials[static_cast<std::size_t>(scene.impact->material)].density));
  return least;
}

void choose_stiffness(Scene& scene, int a, int b, ContactLaw& law) {
  const Material& first = scene.materials[static_cast<std::size_t>(a)];
  const Material& second = scene.materials[static_cast<std::size_t>(b)];
  law.chosen = true;
  const double ea = first.modulus(), eb = second.modulus();
  const double soft = ea > 0 && eb > 0 ? std::min(ea, eb) : std::max(ea, eb);
  const bool penalty = scene.simulation.method == Simulation::Method::dda1988;
  if (!(soft > 0)) {
    law.stiffness = ContactLaw::Stiffness::hard;
    scene.notes.push_back(fmt::format("contact {}/{}: hard, since neither material has a Young's modulus",
                                      first.name, second.name));
    return;
  }
  const double known = least_block(scene, a, b);
  const double size = known > 0 ? known : 1;
  const std::string whence = known > 0 ? fmt::format("the smallest block ({:.3g} m)", size)
                                       : "1 m (no block size is known before its mesh is read)";
  if (penalty) {
    law.stiffness = ContactLaw::Stiffness::per_contact;
    law.normal_stiffness = soft * size;
    scene.notes.push_back(fmt::format(
        "contact {}/{}: {:.4g} N/m per contact point, chosen as the softer modulus ({:.3g} GPa) times {}",
        first.name, second.name, law.normal_stiffness, soft / 1e9, whence));
  } else {
    law.stiffness = ContactLaw::Stiffness::per_area;
    law.normal_stiffness = soft / size;
    scene.notes.push_back(
        fmt::format("contact {}/{}: {:.4g} Pa/m, chosen as the softer modulus ({:.3g} GPa) over {}",
                    first.name, second.name, law.normal_stiffness, soft / 1e9, whence));
  }
  law.shear_stiffness = law.normal_stiffness / 2.5;
}

}  // namespace

double friction_coefficient(const Node& node) {
  if (node.is_number()) return node.as_number();
  std::string error;
  const auto given = parse_quantity(node.text, error).value_or(Quantity{});
  return given.dimension == dimension::angle ? std::tan(given.value) : given.value;
}

/// Coefficient of friction between rough faces of concrete [en1992-1-1, 6.2.5(2)].
constexpr double concrete_friction = 0.7;

void read_interfaces(Reading& in, const View& root) {
  Scene& scene = in.scene;
  const std::vector<Entry> entries = read_entries(in, root);
  const auto n = scene.materials.size();
  scene.laws.materials = static_cast<int>(n);
  scene.laws.law.assign(n * n, ContactLaw{});
  const Needs needs = needed_pairs(scene);
  std::set<std::pair<int, int>> set;
  const auto put = [&](int a, int b, const ContactLaw& law) {
    scene.laws.law[static_cast<std::size_t>(a) * n + static_cast<std::size_t>(b)] = law;
    scene.laws.law[static_cast<std::size_t>(b) * n + static_cast<std::size_t>(a)] = law;
  };
  // A name that is misspelt elsewhere would only make pairs look missing.
  const bool clean = in.names_good;
  for (int a = 0; a < static_cast<int>(n); ++a)
    for (int b = a; b < static_cast<int>(n); ++b) {
      const std::string& first = scene.materials[static_cast<std::size_t>(a)].name;
      const std::string& second = scene.materials[static_cast<std::size_t>(b)].name;
      const bool needed = needs.pairs.count({a, b}) > 0;
      if (!clean || (!needed && needs.fragments.count({a, b}) == 0 && needs.optional.count({a, b}) == 0))
        continue;
      bool contradiction = false;
      const Entry* entry = match(entries, first, second, contradiction);
      if (!entry) {
        if (needed)
          root.problem(
              "", fmt::format("\"{}\" and \"{}\" can meet, and no [[interface]] covers them", first, second),
              fmt::format("add [[interface]] with between = [\"{}\", \"{}\"], or \"*\" for any", first,
                          second));
        continue;
      }
      if (contradiction) {
        entry->view.problem(
            "between",
            fmt::format("two entries with \"*\" cover \"{}\" and \"{}\" and differ", first, second),
            fmt::format("add an entry with between = [\"{}\", \"{}\"]", first, second));
        continue;
      }
      ContactLaw law = entry->law;
      const std::size_t notes = scene.notes.size();
      if (!entry->stiffness_given) choose_stiffness(scene, a, b, law);
      if (law.curved())
        scene.notes.resize(notes);  // whatever stiffness is chosen, a curved law goes before it
      if (law.kind == ContactLaw::Kind::table && !law.table.empty() && !root.has("resolved"))
        scene.notes.push_back(
            fmt::format("contact {}/{}: force by a table of {} points, up to {:.4g} N at {:.4g} m; beyond, "
                        "its last slope goes on",
                        first, second, law.table.size(), law.table.back().second, law.table.back().first));
      if (law.kind == ContactLaw::Kind::hertz) {
        const double modulus = hertz_modulus(scene.materials[static_cast<std::size_t>(a)],
                                             scene.materials[static_cast<std::size_t>(b)]);
        if (!(modulus > 0))
          entry->view.problem(
              "contact_law",
              (first == second
                   ? fmt::format("\"{}\" has no Young's modulus", first)
                   : fmt::format("neither \"{}\" nor \"{}\" has a Young's modulus", first, second)) +
                  ", and Hertz's law needs one",
              "add young to a [[material]]");
        else if (!root.has("resolved"))
          scene.notes.push_back(
              fmt::format("contact {}/{}: Hertz's law, 4/3 E* sqrt(R) with E* = {:.4g} GPa and R = {:.4g} m",
                          first, second, modulus / 1e9, law.hertz_radius));
      }
      put(a, b, law);
      in.law_uses.push_back({entry->view, a, b});
      set.insert({a, b});
    }
  std::vector<std::pair<int, int>> lent_pairs;
  for (const auto& [a, b] : needs.fragments) {
    if (set.count({a, b}) > 0 || !clean) continue;
    // A piece of the structure meets what the scene has no entry for: the blocks' law with the same partner
    // is taken.
    const int mover = scene.blocks.empty() ? scene.rock_mass ? scene.rock_mass->material
                                             : scene.impact  ? scene.impact->material
                                                             : -1
                                           : scene.blocks[0].material;
    bool structure_a = false;
    for (const StructureSpec& s : scene.structures) structure_a = structure_a || s.material == a;
    const int partner = structure_a ? b : a;
    const auto lent = std::pair(std::min(mover, partner), std::max(mover, partner));
    const std::string& first = scene.materials[static_cast<std::size_t>(a)].name;
    const std::string& second = scene.materials[static_cast<std::size_t>(b)].name;
    const std::string remedy =
        fmt::format("add [[interface]] with between = [\"{}\", \"{}\"]", first, second);
    if (mover < 0) {
      // A structure alone, under prescribed loads: its pieces rub like rough concrete.
      ContactLaw law;
      law.friction = concrete_friction;
      choose_stiffness(scene, a, b, law);
      root.problem("",
                   fmt::format("fragments let \"{}\" and \"{}\" meet, and no [[interface]] covers them: "
                               "friction {} of rough concrete (EN 1992-1-1, 6.2.5) is taken",
                               first, second, concrete_friction),
                   remedy, Problem::Severity::warning);
      put(a, b, law);
      lent_pairs.emplace_back(a, b);
      continue;
    }
    if (set.count(lent) == 0) {
      root.problem("",
                   fmt::format("fragments let \"{}\" and \"{}\" meet, and no [[interface]] covers them",
                               first, second),
                   remedy);
      continue;
    }
    root.problem("",
                 fmt::format("fragments let \"{}\" and \"{}\" meet, and no [[interface]] covers them: the "
                             "law of \"{}\" and \"{}\" is taken",
                             first, second, scene.materials[static_cast<std::size_t>(lent.first)].name,
                             scene.materials[static_cast<std::size_t>(lent.second)].name),
                 remedy, Problem::Severity::warning);
    put(a, b, scene.laws(lent.first, lent.second));
    lent_pairs.emplace_back(a, b);
  }
  scene.law_pairs.assign(set.begin(), set.end());
  scene.law_pairs.insert(scene.law_pairs.end(), lent_pairs.begin(), lent_pairs.end());
}

double hertz_modulus(const Material& a, const Material& b) {
  double compliance = 0;
  for (const Material* m : {&a, &b})
    if (m->modulus() > 0) compliance += (1 - m->poisson * m->poisson) / m->modulus();
  return compliance > 0 ? 1 / compliance : 0;
}

}  // namespace talus::scene

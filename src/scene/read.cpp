#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/names.hpp"
#include "core/sha256.hpp"
#include "core/suggest.hpp"
#include "core/text_file.hpp"
#include "scene/fragment_names.hpp"
#include "scene/reading.hpp"

namespace talus::scene {

namespace fs = std::filesystem;

namespace {

constexpr std::uintmax_t scene_size_limit = 64u << 20;  // a scene holds parameters, not meshes

Problem whole_file(const std::string& path, std::string rule, std::string remedy) {
  Problem problem;
  problem.file = path;
  problem.rule = std::move(rule);
  problem.remedy = std::move(remedy);
  return problem;
}

void read_simulation(Reading& in, const View& root) {
  Simulation& s = in.scene.simulation;
  static const Node empty = [] {
    Node node;
    node.kind = Node::Kind::table;
    node.label = "simulation";
    return node;
  }();
  const View view = root.table("simulation").value_or(View(empty, "simulation", in.problems));
  s.duration = view.number("duration");
  s.until_rest = view.text("until") == "rest";
  s.gravity = view.vector("gravity");
  s.method = view.text("method") == "dda-1988" ? Simulation::Method::dda1988 : Simulation::Method::talus;
  s.threads = static_cast<int>(view.integer("threads"));
  s.sleeping = view.flag("sleeping");
  s.min_step = view.number("min_step");
  s.accuracy = view.maybe("accuracy");
  s.step = view.maybe("step");
  s.initial_state = in.file(view, "initial_state");
  if (view.has("accuracy") && view.has("step"))
    view.problem("step", "a fixed step and accuracy exclude each other",
                 "remove one: accuracy lets the program choose the step, step fixes it");
  if (s.method == Simulation::Method::dda1988) {
    view.missing("step", "method \"dda-1988\" works with a fixed step");
    if (view.has("accuracy") && !view.has("step"))
      view.problem("accuracy", "method \"dda-1988\" has no error control",
                   "remove accuracy and give a step, e.g. step = \"1e-4 s\"");
  } else if (!view.has("accuracy") && !view.has("step")) {
    s.accuracy = view.number("accuracy");
  }
  constexpr double most_steps = 1e12;  // beyond, time plus a step is no longer a later time
  if (s.step && *s.step * most_steps < s.duration)
    view.problem("step", fmt::format("makes more than {:g} steps of the duration", most_steps),
                 "lengthen the step");
  if (s.step && *s.step > s.duration)
    view.problem("step", "must not be longer than the duration", "shorten the step");
  if (s.step && *s.step < s.min_step)
    view.problem("step", fmt::format("must not be shorter than min_step, {:g} s", s.min_step),
                 "lengthen the step, or shorten min_step");
  if (s.min_step > s.duration && view.get("duration") && view.has("min_step"))
    view.problem("min_step", fmt::format("must not be longer than the duration, {:g} s", s.duration),
                 "shorten it");
}

/// The scheme of 1988 finds its contacts at fixed surfaces: what they do to a structure can be put on it, not
/// the other way round.
void check_scheme(const Simulation& s, const Coupling& c, const View& view) {
  if (s.method == Simulation::Method::dda1988 && view.has("scheme") && c.scheme == Coupling::Scheme::two_way)
    view.problem("scheme",
                 "method \"dda-1988\" does not couple both ways: its blocks strike a structure's undeformed "
                 "surface as a fixed one",
                 "take scheme = \"one-way\" (the structure gets their forces; the default with this "
                 "method), \"rigid\", or method \"talus\"");
}

void read_coupling_and_output(Reading& in, const View& root) {
  Coupling& c = in.scene.coupling;
  if (in.scene.simulation.method == Simulation::Method::dda1988) c.scheme = Coupling::Scheme::one_way;
  if (const auto view = root.table("coupling")) {
    const std::string scheme = view->text("scheme");
    if (view->has("scheme") || in.scene.simulation.method == Simulation::Method::talus)
      c.scheme = scheme == "one-way" ? Coupling::Scheme::one_way
                 : scheme == "rigid" ? Coupling::Scheme::rigid
                                     : Coupling::Scheme::two_way;
    c.strict = view->text("audit") == "strict";
    check_scheme(in.scene.simulation, c, *view);
    c.exchanges_per_rise = static_cast<int>(view->integer("exchanges_per_rise"));
    c.fragments = view->flag("fragments");
    if (!root.has("structure") &&
        (view->has("scheme") || view->has("exchanges_per_rise") || view->has("fragments")))
      view->problem("", "there is no structure to couple", "remove [coupling], or add a [[structure]]");
  }
  Output& o = in.scene.output;
  if (const auto view = root.table("output")) {
    o.interval = view->number("interval");
    o.history_interval = view->number("history_interval");
    o.checkpoint_steps = static_cast<int>(view->integer("checkpoint_steps"));
    o.report = view->flag("report");
    constexpr double most_rows = 1e8, most_frames = 1e6;
    const double duration = in.scene.simulation.duration;
    if (o.history_interval * most_rows < duration)
      view->problem("history_interval",
                    fmt::format("makes more than {:g} rows of the duration of {:g} s", most_rows, duration),
                    "lengthen it, or shorten the duration");
    if (o.interval * most_frames < duration)
      view->problem(
          "interval",
          fmt::format("makes more than {:g} frames of the duration of {:g} s", most_frames, duration),
          "lengthen it, or shorten the duration");
  }
}

void read_resolved_header(Reading& in, const View& root) {
  const auto view = root.table("resolved");
  if (!view) return;
  if (view->has("scene")) in.scene.file = view->text("scene");
  for (const View& file : view->tables("file")) in.expected_hash[file.text("path")] = file.text("sha256");
  in.scene.notes = view->texts("note");
}

void refuse_names_of_fragments(const Scene& s, const View& root) {
  const auto taken = [&](const View& view, const char* key, const std::string& name) {
    if (const std::string structure = structure_of_fragment(s, name); !structure.empty())
      view.problem(key, fragment_name_rule(structure), fragment_name_remedy);
  };
  const std::vector<View> blocks = root.tables("block");
  for (std::size_t i = 0; i < blocks.size() && i < s.blocks.size(); ++i)
    if (!s.blocks[i].release) taken(blocks[i], "name", s.blocks[i].name);
  if (const auto mass = root.table("rock_mass"); mass && s.rock_mass && s.rock_mass->blocks.empty())
    taken(*mass, "prefix", s.rock_mass->block_prefix + "1");
}

}  // namespace

std::string structure_of_fragment(const Scene& s, const std::string& name) {
  if (!s.coupling.fragments || s.coupling.scheme != Coupling::Scheme::two_way ||
      !s.simulation.initial_state.empty())
    return {};
  const auto found =
      std::find_if(s.structures.begin(), s.structures.end(),
                   [&](const StructureSpec& structure) { return is_fragment_name(name, structure.name); });
  return found == s.structures.end() ? std::string() : found->name;
}

int Reading::material(const View& view, const std::string& key, bool surface) {
  if (!view.get(key)) {
    names_good = false;
    return 0;
  }
  const std::string name = view.text(key);
  if (const auto found = material_index.find(name); found != material_index.end()) return found->second;
  // A surface needs no density: that an interface names its material, or "*" stands for it, is enough. A slip
  // of the pen is not.
  const auto covered = [&] {
    if (interface_name.count(name) > 0) return true;
    if (!interface_wildcard) return false;
    std::vector<std::string> names;
    for (const auto& entry : interface_name) names.push_back(entry.first);
    for (const Material& m : scene.materials) names.push_back(m.name);
    return nearest_name(name, names).empty();
  };
  if (surface && covered()) {
    const int index = static_cast<int>(scene.materials.size());
    Material material;
    material.name = name;
    material.declared = false;
    scene.materials.push_back(material);
    material_index[name] = index;
    return index;
  }
  std::vector<std::string> known;
  for (const Material& m : scene.materials) known.push_back(m.name);
  const std::string near = nearest_name(name, known);
  names_good = false;
  unknown_materials.insert(name);
  view.problem(key, "there is no such material",
               near.empty() ? fmt::format("add a [[material]] with name = \"{}\", or, of ground that only "
                                          "needs laws of contact, name it in an [[interface]]",
                                          name)
                            : fmt::format("did you mean \"{}\"?", near));
  return 0;
}

bool Reading::has_material(const View& view, const std::string& key) const {
  return view.get(key) && !scene.materials.empty() && unknown_materials.count(view.text(key)) == 0;
}

std::string Reading::file(const View& view, const std::string& key, bool inlined) {
  const Node* node = view.get(key);
  if (!node || node->kind != Node::Kind::text) return {};
  const fs::path path = (fs::path(directory) / node->text).lexically_normal();
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) {
    std::vector<std::string> beside;
    for (const auto& entry : fs::directory_iterator(path.parent_path(), error))
      if (entry.exists(error)) beside.push_back(entry.path().filename().string());  // no link to nothing
    std::sort(beside.begin(), beside.end());
    const std::string near = nearest_name(path.filename().string(), beside);
    view.problem(key, fmt::format("there is no file {}", path.string()),
                 near.empty() ? "paths are relative to the scene file; correct the name or put the file there"
                              : fmt::format("did you mean \"{}\"?",
                                            (fs::path(node->text).parent_path() / near).string()));
    return {};
  }
  if (!fs::is_regular_file(status)) {
    view.problem(key, fmt::format("{} is not a file", path.string()), "name a file");
    return {};
  }
  const auto booked = std::find_if(scene.files.begin(), scene.files.end(),
                                   [&](const auto& f) { return f.first == path.string(); });
  if (booked == scene.files.end() && !inlined) {
    const auto known = [&]() -> const std::string* {
      if (known_files)
        for (const auto& [name, hash] : *known_files)
          if (name == path.string()) return &hash;
      return nullptr;
    }();
    const std::string hash = known ? *known : sha256_file(path.string());
    if (hash.empty()) {
      view.problem(key, fmt::format("{} cannot be read", path.string()), "check its permissions");
      return {};
    }
    if (const auto expected = expected_hash.find(path.string());
        expected != expected_hash.end() && expected->second != hash)
      view.problem(key, "the file has changed since the scene was resolved (its SHA-256 differs)",
                   "run the original scene, or bring the file back");
    scene.files.emplace_back(path.string(), hash);
  }
  return path.string();
}

std::string Reading::name(const View& view, const std::string& key, const std::string& otherwise,
                          std::map<std::string, int>& taken) {
  const std::string name = view.has(key) ? view.text(key) : otherwise;
  if (view.has(key) && !view.get(key)) return otherwise;
  if (!is_name(name)) {
    view.problem(key, name_rule, name_remedy);
    return name;
  }
  if (!taken.emplace(name, static_cast<int>(taken.size())).second) {
    if (view.has(key))
      view.problem(key, "the name is taken already", "names are unique: choose another one");
    else
      view.problem("", fmt::format("the name \"{}\", given by place, is taken already", name),
                   fmt::format("add {} = \"...\"", key));
  }
  return name;
}

namespace {

Node parse_scene(const std::string& text, const std::string& path, const Overrides& overrides,
                 std::vector<Problem>& problems) {
  const auto first = text.find_first_not_of(" \t\r\n");
  const bool json = first != std::string::npos && text[first] == '{';
  Node root = json ? parse_json(text, path, problems) : parse_toml(text, path, problems);
  if (json ? !problems.empty() : root.bad) throw InputError(problems);

  for (const auto& [key, value] : overrides) {
    set_value(root, key, value, problems);
    // An override chooses between the two ways to fix the step, whatever the file chose.
    if (Node* simulation = root.find("simulation");
        simulation && (key == "simulation.step" || key == "simulation.accuracy")) {
      const std::string other = key == "simulation.step" ? "accuracy" : "step";
      const bool set_too = std::any_of(overrides.begin(), overrides.end(),
                                       [&](const auto& o) { return o.first == "simulation." + other; });
      if (!set_too) std::erase_if(simulation->entries, [&](const Node::Entry& e) { return e.key == other; });
    }
  }
  if (root.where.file.empty()) root.where = {path, 1, 1};
  return root;
}

/// Takes out what is switched off.
void leave_out(Node& root) {
  const auto off = [](const Node& item) {
    const Node* enabled = item.find("enabled");
    return enabled != nullptr && enabled->kind == Node::Kind::boolean && !enabled->boolean;
  };
  for (const char* key : {"structure", "block", "plane"})
    if (Node* list = root.find(key)) std::erase_if(list->items, off);
  if (Node* site = root.find("site"))
    if (Node* areas = site->find("area")) std::erase_if(areas->items, off);
}

/// Takes out what the block of [impact] does not meet. A rock mass that is cut out of the terrain changes the
/// ground that a viaduct stands on.
void leave_out_beside_impact(Node& root) {
  if (root.find("impact") == nullptr) return;
  std::erase_if(root.entries, [](const Node::Entry& e) {
    const Node& mass = e.value;
    return e.key == "block" || e.key == "plane" ||
           (e.key == "rock_mass" && !mass.find("slip_surface") && !mass.find("from_terrain"));
  });
}

/// `known`: files whose hashes are known.
Scene read_tree(Node root, const std::string& path, std::vector<Problem> problems,
                const std::vector<std::pair<std::string, std::string>>* known, bool resolve) {
  Scene scene;
  validate(root, problems);
  leave_out(root);

  std::error_code error;
  const fs::path absolute = fs::absolute(path, error).lexically_normal();
  scene.file = absolute.string();
  Reading in{scene, problems, absolute.parent_path().string(), {}, {}, true, {}, {}, known};
  const View view(root, "", problems);
  note_places(root, scene.places);
  scene.title = view.text("title");
  read_resolved_header(in, view);
  read_simulation(in, view);
  read_materials(in, view);
  read_site(in, view);
  read_blocks(in, view);
  read_rock_mass(in, view);
  read_structures(in, view);
  read_impact(in, view);
  read_ensemble(in, view, view.node());
  read_coupling_and_output(in, view);
  read_interfaces(in, view);
  refuse_names_of_fragments(scene, view);
  if (scene.blocks.empty() && !view.has("rock_mass") && scene.structures.empty() &&
      problems.empty())  // `block = []` is none
    view.problem("", "the scene has no block, no rock mass and no structure",
                 "add a [[block]]: see docs/scene.md");

  const bool blocks_move = view.has("rock_mass") || std::any_of(scene.blocks.begin(), scene.blocks.end(),
                                                                [](const Block& b) { return !b.fixed; });
  if (scene.simulation.until_rest && scene.simulation.gravity.isZero(0) && blocks_move)
    view.table("simulation")
        ->problem("until", "nothing makes a block come to rest without gravity",
                  "leave until out: the run ends with its duration");
  warn_of_the_implausible(in, view);
  warn_of_idle_keys(in, view);

  std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  const bool failed = std::any_of(problems.begin(), problems.end(),
                                  [](const Problem& p) { return p.severity == Problem::Severity::error; });
  if (failed) throw InputError(problems);
  scene.warnings = std::move(problems);
  if (resolve) scene.resolved_json = resolved_json(scene);
  return scene;
}

std::string scene_text(const std::string& path);

}  // namespace

Scene read_scene_text(const std::string& text, const std::string& path, const Overrides& overrides) {
  std::vector<Problem> problems;
  Node root = parse_scene(text, path, overrides, problems);
  return read_tree(std::move(root), path, std::move(problems), nullptr, true);
}

namespace {

std::string scene_text(const std::string& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status))
    throw InputError(whole_file(path, "there is no such file", "give the path of a scene file (TOML)"));
  if (fs::is_directory(status))
    throw InputError(
        whole_file(path, "is a directory",
                   "name the scene file in it, e.g. " + (fs::path(path) / "scene.toml").string()));
  if (!fs::is_regular_file(status))
    throw InputError(whole_file(path, "is not a file", "give the path of a scene file (TOML)"));
  if (fs::file_size(path, error) > scene_size_limit)
    throw InputError(whole_file(path, "is larger than 64 MiB",
                                "a scene file holds parameters; meshes stay in files of their own"));
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw InputError(whole_file(path, "cannot be read", "check its permissions"));
  return as_utf8(text.str(), path);
}

/// Where relative paths of a table start from, made absolute.
void make_absolute(Node& node, const std::string& path, const std::string& directory) {
  for (Node& item : node.items) make_absolute(item, path, directory);
  for (Node::Entry& entry : node.entries) {
    const std::string below = path.empty() ? entry.key : path + "." + entry.key;
    const Key* key = find_key(below);
    if (key && (key->type == Type::path || key->type == Type::path_or_tables) &&
        entry.value.kind == Node::Kind::text)
      entry.value.text = (fs::path(directory) / entry.value.text).lexically_normal().string();
    else
      make_absolute(entry.value, below, directory);
  }
}

/// In the order in which the parser gives them, also those that were set later: a scene has one text.
void sort_keys(Node& node) {
  for (Node& item : node.items) sort_keys(item);
  std::sort(node.entries.begin(), node.entries.end(),
            [](const Node::Entry& a, const Node::Entry& b) { return a.key < b.key; });
  for (Node::Entry& entry : node.entries) sort_keys(entry.value);
}

}  // namespace

Scene read_scene(const std::string& path, const Overrides& overrides, Purpose purpose) {
  std::vector<Problem> problems;
  Node root = parse_scene(scene_text(path), path, overrides, problems);
  if (purpose == Purpose::impact) leave_out_beside_impact(root);
  return read_tree(std::move(root), path, std::move(problems), nullptr, true);
}

Template::Template(const std::string& path, const Overrides& overrides) : path_(path) {
  std::vector<Problem> problems;
  root_ = parse_scene(scene_text(path), path, overrides, problems);
  if (!problems.empty()) throw InputError(problems);
  // What is drawn may be missing from the scene, which is whole only with the first member's values:
  // [ensemble] and [[line]] are read by themselves.
  Node part;
  part.kind = Node::Kind::table;
  part.where = root_.where;
  for (const Node::Entry& entry : root_.entries)
    if (entry.key == "schema" || entry.key == "ensemble" || entry.key == "line")
      part.entries.push_back(entry);
  validate(part, problems);
  std::error_code error;
  Scene scene;
  Reading in{scene, problems, fs::absolute(path, error).lexically_normal().parent_path().string(),
             {},    {},       true,
             {},    {},       nullptr};
  read_ensemble(in, View(part, "", problems), root_);
  if (!problems.empty()) throw InputError(problems);
  ensemble_ = std::move(scene.ensemble);
  whole_ = root_;
  std::erase_if(root_.entries, [](const Node::Entry& e) { return e.key == "ensemble"; });
}

Node Template::changed(const Overrides& values) const {
  Node root = root_;
  std::vector<Problem> problems;
  for (const auto& [key, value] : values) set_value(root, key, value, problems);
  if (!problems.empty()) throw InputError(problems);
  return root;
}

Scene Template::scene(const Overrides& values) const {
  return read_tree(changed(values), path_, {}, &files_, false);
}

std::string Template::toml(const Overrides& values) const {
  Node root = changed(values);
  make_absolute(root, "", directory());
  sort_keys(root);
  return toml_text(root);
}

std::string Template::whole_toml() const {
  Node root = whole_;
  make_absolute(root, "", directory());
  sort_keys(root);
  return toml_text(root);
}

std::string Template::directory() const {
  std::error_code error;
  return fs::absolute(path_, error).lexically_normal().parent_path().string();
}

}  // namespace talus::scene

// The only place that decides what exists.
#include <algorithm>
#include <limits>
#include <numeric>
#include <string_view>
#include <tuple>
#include <utility>

#include "sim/builder.hpp"
#include "sim/section.hpp"

namespace talus::sim {
namespace {

/// Alphabetic, runs of digits by their number: B2 before B10. No two different names are equal.
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto run = [&](const std::string& s, std::size_t& at) {  // of digits, without zeros in front
      const std::size_t end =
          std::find_if_not(s.begin() + static_cast<std::ptrdiff_t>(at), s.end(), digit) - s.begin();
      while (at < end && s[at] == '0') ++at;
      const std::string_view number = std::string_view(s).substr(at, end - at);
      at = end;
      return number;
    };
    const std::string_view x = run(a, i), y = run(b, j);
    if (x != y) return x.size() != y.size() ? x.size() < y.size() : x < y;
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

}  // namespace

Builder::Builder(scene::Scene scene, Report report, Shared* shared)
    : world_(std::make_unique<World>()), shared_(shared) {
  world_->scene = std::move(scene);
  world_->report = report ? std::move(report) : [](const std::string&) {};
}

std::unique_ptr<World> Builder::build() {
  const scene::Scene& s = world_->scene;
  if (s.impact)
    add_warnings({{.severity = Problem::Severity::warning,
                   .file = {},
                   .key = "impact",
                   .value = {},
                   .rule = "only talus impact takes the block of [impact]; talus run leaves it out",
                   .remedy = "start it by talus impact, or remove [impact]"}});
  if (s.ensemble)
    add_warnings(
        {{.severity = Problem::Severity::warning,
          .file = {},
          .key = "ensemble",
          .value = {},
          .rule = "only talus ensemble draws from it; talus run and talus check take the scene's own values",
          .remedy = "start the members by talus ensemble"}});
  model_.gravity = s.simulation.gravity;
  add_terrain();
  if (world_->scene.site)
    world_->header.crs = terrain_ && !terrain_->crs.empty() ? terrain_->crs : world_->scene.site->crs;
  for (const StructureSpec& spec : s.structures) names_.insert(spec.name);
  for (const scene::Block& b : s.blocks) add_block(b);
  single_blocks_ = model_.blocks.size();
  add_rock_mass();
  index_terrain();
  refuse_what_is_missing();
  check_ground();
  env_.planes = s.planes;
  env_.laws = s.laws;
  const std::size_t before = problems_.size();
  complete_laws();
  check_stiffness();
  const bool laws = problems_.size() == before;
  if (terrain_ || !s.site || !s.site->given()) add_structures();  // a viaduct may stand on the terrain
  const bool whole = laws && env_.structures.size() == s.structures.size();
  if (!problems_.empty() && !whole) fail();
  warn_of_small_blocks();
  pair_structures();
  warn_of_sudden_weight();

  coupling::SystemSettings settings;
  settings.step.fixed_step = s.simulation.step.value_or(0);
  settings.step.accuracy = s.simulation.accuracy.value_or(1e-3);
  settings.step.min_step = s.simulation.min_step;
  settings.step.exchanges_per_rise = s.coupling.exchanges_per_rise;
  settings.sleeping = s.simulation.sleeping;
  settings.threads = std::max(1, s.simulation.threads);
  const bool steps = std::any_of(env_.structures.begin(), env_.structures.end(),
                                 [](const coupling::StructurePart& part) { return part.stepped(); });
  if (steps)
    settings.longest_stretch =
        std::max(settings.longest_stretch, s.output.history_interval);  // there rows end macro steps
  sort_blocks();
  world_->system = std::make_unique<coupling::CoupledSystem>(std::move(model_), std::move(state_),
                                                             std::move(env_), settings);
  if (s.rock_mass && s.rock_mass->from_terrain)
    world_->report(
        "progress: rock mass: looking for overlaps of its blocks, with each other and their hollow");
  std::vector<Problem> overlaps;
  if (s.simulation.initial_state.empty()) {  // else it is looked at as that run left it (start_from)
    overlaps = structure_overlaps(*world_);
    std::ranges::move(initial_overlaps(*world_), std::back_inserter(overlaps));
  }
  for (Problem& overlap : overlaps) {
    const bool told = std::any_of(problems_.begin(), problems_.end(), [&](const Problem& p) {
      return p.key == overlap.key;
    });  // its centroid lies in the ground
    if (!told) problems_.push_back(std::move(overlap));
  }
  if (!problems_.empty()) fail();
  if (s.simulation.method == scene::Simulation::Method::dda1988) {
    world_->paper.emplace();
    const coupling::Environment& env = world_->system->environment();
    if (env.terrain) world_->paper->surfaces.push_back(env.terrain.get());
    world_->paper->first_structure = static_cast<int>(world_->paper->surfaces.size());
    for (const coupling::StructurePart& p : env.structures) world_->paper->surfaces.push_back(p.index.get());
  }
  for (Problem& p : world_->scene.warnings) locate(p);
  fill_header();
  return std::move(world_);
}

void Builder::locate(Problem& p) const {
  if (p.line > 0 || (!p.file.empty() && p.file != world_->scene.file)) return;
  if (const scene::Where* place = scene::place_of(world_->scene, p.key))
    p.file = place->file, p.line = place->line, p.column = place->column;
}

void Builder::fail() {
  for (Problem& p : world_->scene.warnings)
    problems_.push_back(std::move(p));  // a foot in the air explains a probe that is far
  for (Problem& p : problems_) locate(p);
  std::stable_sort(problems_.begin(), problems_.end(), [](const Problem& a, const Problem& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  throw InputError(problems_);
}

void Builder::problem(std::string key, std::string value, std::string rule, std::string remedy) {
  Problem p;
  p.file = world_->scene.file;
  p.key = std::move(key);
  p.value = std::move(value);
  p.rule = std::move(rule);
  p.remedy = std::move(remedy);
  problems_.push_back(std::move(p));
}

void Builder::add_problems(const std::vector<Problem>& found) {
  for (Problem p : found) {
    if (p.file.empty()) p.file = world_->scene.file;
    problems_.push_back(std::move(p));
  }
}

void Builder::add_warnings(const std::vector<Problem>& found) {
  for (Problem p : found) {
    if (p.file.empty()) p.file = world_->scene.file;
    world_->scene.warnings.push_back(std::move(p));
  }
}

void Builder::sort_blocks() {
  const std::size_t n = model_.blocks.size();
  std::vector<int> sorted(n);
  std::iota(sorted.begin(), sorted.end(), 0);
  std::sort(sorted.begin(), sorted.end(), [&](int a, int b) {
    return natural_less(model_.blocks[static_cast<std::size_t>(a)].name,
                        model_.blocks[static_cast<std::size_t>(b)].name);
  });
  std::vector<int>& place = world_->place;
  place.resize(n);
  dda::Model model{.blocks = {}, .gravity = model_.gravity};
  dda::State state;
  for (const int from : sorted) {
    const auto k = static_cast<std::size_t>(from);
    place[k] = static_cast<int>(model.blocks.size());
    model.blocks.push_back(std::move(model_.blocks[k]));
    const dda::State& s = state_.blocks;
    state.c.push_back(s.c[k]);
    state.v.push_back(s.v[k]);
    state.w.push_back(s.w[k]);
    state.q.push_back(s.q[k]);
    state.eps.push_back(s.eps[k]);
    state.eps_rate.push_back(s.eps_rate[k]);
  }
  world_->order = std::move(sorted);
  model_ = std::move(model);
  state_.blocks = std::move(state);
  for (coupling::Bond& b : env_.bonds)
    std::tie(b.a, b.b) =
        std::minmax({place[static_cast<std::size_t>(b.a)], place[static_cast<std::size_t>(b.b)]});
  std::sort(env_.bonds.begin(), env_.bonds.end(), [](const coupling::Bond& x, const coupling::Bond& y) {
    return std::tie(x.a, x.b, x.joint) < std::tie(y.a, y.b, y.joint);
  });
}

namespace {

/// When the last of prescribed tractions has ended; one whose table ends with a force goes on for good [s].
double end_of(const std::vector<StructureSpec::Load>& loads) {
  double end = 0;
  for (const StructureSpec::Load& load : loads) {
    if (load.history.empty() || load.history.back().second != 0)
      return std::numeric_limits<double>::infinity();
    std::size_t last = load.history.size() - 1;  // the first of the zeros that it ends with
    while (last > 0 && load.history[last - 1].second == 0) --last;
    end = std::max(end, load.history[last].first);
  }
  return end;
}

}  // namespace

void Builder::fill_header() {
  RunHeader& h = world_->header;
  const scene::Scene& s = world_->scene;
  h.title = s.title;
  h.duration = s.simulation.duration;
  if (s.site) { h.map_origin = s.site->origin; }
  for (const int k : world_->place) {
    const dda::Model::Block& b = world_->system->model().blocks[static_cast<std::size_t>(k)];
    const scene::Material& m = s.materials[static_cast<std::size_t>(b.material)];
    h.blocks.push_back(
        {b.name, b.mass, b.volume, b.fixed, false, *b.shape, m.young, m.young > 0 ? m.poisson : 0, -1});
  }
  if (terrain_) h.terrain_cell = terrain_->grid.dx;
  if (terrain_ && !shared_) h.terrain = terrain_->surface;
  h.planes = s.planes;
  for (std::size_t i = 0; i < s.structures.size(); ++i) {
    RunHeader::StructureInfo info;
    info.name = s.structures[i].name;
    for (const auto& p : s.structures[i].probes) {
      info.probes.push_back(p.name);
      info.probe_at.push_back(p.at);
    }
    const coupling::StructurePart& part = world_->system->environment().structures[i];
    info.plan = part.structure->plan();
    if (part.stepped()) info.members = part.structure->loads().members();
    if (!shared_) describe_section(s.structures[i], *part.structure, info);
    for (const scene::Block& b : s.blocks) {
      const ContactLaw::Kind kind = s.laws(b.material, s.structures[i].material).kind;
      info.cushion = info.cushion || kind == ContactLaw::Kind::crushing || kind == ContactLaw::Kind::table;
    }
    info.poisson = s.structures[i].poisson;
    info.f_cm = s.structures[i].f_cm;
    info.loaded = part.stepped() && !s.structures[i].loads.empty();
    info.permanent = part.structure->loads().permanent_reaction();
    info.told_permanent = true;
    if (info.loaded) info.load_until = end_of(s.structures[i].loads);
    for (const auto& [a, b] : world_->system->environment().touching_structures)
      if (a == static_cast<int>(i) || b == static_cast<int>(i))
        info.meets.push_back(a == static_cast<int>(i) ? b : a);
    h.structures.push_back(std::move(info));
  }
  for (const scene::Material& m : s.materials) h.materials.push_back(m.name);
}

std::unique_ptr<World> build(scene::Scene scene, Report report, Shared* shared) {
  return Builder(std::move(scene), std::move(report), shared).build();
}

}  // namespace talus::sim

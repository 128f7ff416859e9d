#include "ensemble/ensemble.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include <fmt/format.h>

#include "contact/detection/detect.hpp"
#include "core/log.hpp"
#include "core/sha256.hpp"
#include "ensemble/random.hpp"
#include "sim/ground.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {
namespace {

constexpr long tried =
    16;  // members whose worlds are built before the first one runs: if none can be, all fail for one reason
constexpr long looked_at = 10000;      // members whose draws are held against the rules of their keys
constexpr double suspect_gain = 0.01;  // numerical energy gain over the largest kinetic energy

scene::Template& with_ensemble(scene::Template& scene) {
  if (scene.ensemble()) return scene;
  throw InputError(Problem{.severity = Problem::Severity::error,
                           .file = scene.file(),
                           .line = 0,
                           .column = 0,
                           .key = "ensemble",
                           .value = {},
                           .rule = "is missing",
                           .remedy = "add [ensemble] with members, and [[ensemble.vary]] for what is drawn; "
                                     "see talus explain ensemble"});
}

/// Overrides of a member name their keys as --set does: their mistakes are the ensemble's, but those of
/// `given` are of the command line.
InputError as_of_ensemble(const InputError& error, const std::string& file, const scene::Overrides& given) {
  std::vector<Problem> problems = error.problems();
  for (Problem& p : problems) {
    const bool by_hand =
        std::ranges::any_of(given, [&](const auto& set) { return p.file == "--set " + set.first; });
    if (!p.file.starts_with("--set") || by_hand) continue;
    p.file = file;
    p.key = "ensemble.vary: " + p.key;
  }
  return InputError(problems);
}

double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Quiet : sim::Sink {
  bool quiet() const override { return true; }
  double watched_interval() const override { return map_interval; }
};

std::vector<Vec3> centroids(sim::Simulation& simulation) {
  std::vector<Vec3> places;
  const sim::World& w = simulation.world();
  for (int i = 0; i < static_cast<int>(w.system->model().blocks.size()); ++i) places.push_back(w.pose(i).c);
  return places;
}

double reach_angle(const Member& m) {
  double least = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t b = 0; b < m.end.size(); ++b)
    if (const double way = m.runout(b); way > 1e-6)
      least = std::fmin(least, std::atan2(m.start[b].z() - m.end[b].z(), way));
  return least;
}

}  // namespace

Ensemble::Ensemble(const std::string& file, const scene::Overrides& overrides)
    : template_(std::make_unique<scene::Template>(file, overrides)),
      settings_(*with_ensemble(*template_).ensemble()),
      design_(settings_, *template_),
      file_(file),
      given_(overrides) {
  const auto read = [&] {
    scene::Overrides values = design_.provisional();
    values.insert(values.end(), forced_.begin(), forced_.end());
    try {
      return template_->scene(values);
    } catch (const InputError& error) { throw as_of_ensemble(error, file_, given_); }
  };
  if (const std::vector<Problem> forbidden = design_.forbidden(std::min(looked_at, design_.members()), file_);
      !forbidden.empty())
    throw InputError(forbidden);
  forced_ = {{"simulation.threads", "1"}};
  scene::Scene provisional = read();
  if (!provisional.structures.empty()) {
    was_rigid_ = provisional.coupling.scheme == scene::Coupling::Scheme::rigid;
    forced_.emplace_back("coupling.scheme", "\"rigid\"");
    forced_.emplace_back("coupling.audit", "\"report\"");
    provisional = read();
  }
  template_->adopt_files(provisional);
  files_ = provisional.files;
  title_ = provisional.title;
  planes_ = provisional.planes;
  if (provisional.site) origin_ = provisional.site->origin;
  shares_ground_ = !design_.varies("site") && !design_.varies("plane") && !design_.varies("rock_mass") &&
                   !design_.varies("material.roughness");
  shares_structures_ = shares_ground_ && !design_.varies("structure");  // feet of viaducts follow the ground
  auto read_ground = std::make_unique<sim::Shared>(provisional);
  ground_ = read_ground->ground();
  if (provisional.site) crs_ = ground_ ? ground_->crs : provisional.site->crs;
  std::shared_ptr<const contact::SurfaceIndex> index;
  if (ground_) {
    double low = std::numeric_limits<double>::infinity();
    for (const Vec3& v : ground_->surface.vertices) low = std::min(low, v.z());
    index = std::make_shared<const contact::SurfaceIndex>(ground_->surface);
  }
  height_ = [index, planes = planes_](double x, double y) {
    return sim::uppermost_ground(index.get(), planes, x, y);
  };
  shared_ = shares_ground_ ? std::move(read_ground) : std::make_unique<sim::Shared>();
  shared_->keeps_structures = shares_structures_;
  for (const StructureSpec& s : provisional.structures) structures_.push_back(s.name);
  lines_ = plan_lines(provisional, crs_);
  check_lines();
  for (Problem& p : design_.place(provisional, crs_, [this](double x, double y) {
         return std::isfinite(height_(x, y)) && !(ground_ && ground_->over_hole(x, y));
       }))
    warnings_.push_back(std::move(p));
  if (provisional.site && provisional.site->crs.empty() && !crs_.empty())
    forced_.emplace_back("site.crs", json_quoted(crs_));
  if (provisional.site && crs_.empty())
    warnings_.push_back({.severity = Problem::Severity::warning,
                         .file = file_,
                         .line = 0,
                         .column = 0,
                         .key = "site.crs",
                         .value = {},
                         .rule = "is not known: maps and lines will carry no coordinate reference system",
                         .remedy = "add for example crs = \"EPSG:31254\" to [site]"});
  warn_of_what_is_not_drawn(provisional);
  try_members();
  std::string all = TALUS_VERSION;
  all += template_->toml(forced_) +
         fmt::format(
             "\n{} {} {} {} {} {} {}", settings_.seed, settings_.step_limit,
             static_cast<int>(settings_.design), settings_.members, settings_.map_cell, settings_.vary.size(),
             settings_.precision
                 ? fmt::format("{} {} {} {}", settings_.precision->line, settings_.precision->quantity,
                               settings_.precision->percentile, settings_.precision->within)
                 : "");
  for (const scene::Vary& v : settings_.vary) {
    all += fmt::format("\n{} {} {} {} {} {} {} {} {}", v.key, static_cast<int>(v.kind), v.parameters[0],
                       v.parameters[1], v.parameters[2], v.unit, v.min.value_or(-1e300),
                       v.max.value_or(1e300), v.like);
    for (const std::string& text : v.list) all += " " + text;
    for (const double x : v.table) all += fmt::format(" {}", x);
  }
  // What the files hold matters, not where they are: an ensemble goes on in a directory that was moved.
  for (const auto& [path, hash] : files_) {
    for (auto at = all.find(path); at != std::string::npos; at = all.find(path, at + hash.size()))
      all.replace(at, path.size(), hash);
    all += "\n" + hash;
  }
  identity_ = sha256(all);
}

std::vector<std::filesystem::path> Ensemble::inputs() const {
  std::vector<std::filesystem::path> paths{file_};
  for (const auto& [path, hash] : files_) paths.emplace_back(path);
  return paths;
}

std::vector<std::string> Ensemble::plan() const {
  std::vector<std::string> lines;
  lines.push_back(settings_.precision
                      ? fmt::format("Ensemble: members until the {:g}th percentile of {} at line {} is known "
                                    "within {:g} of it, at most {}; seed {}.",
                                    settings_.precision->percentile, settings_.precision->quantity,
                                    settings_.precision->line, settings_.precision->within, design_.members(),
                                    settings_.seed)
                      : fmt::format("Ensemble: {} members, seed {}.", design_.members(), settings_.seed));
  for (const std::string& drawn : design_.plan()) lines.push_back("  " + drawn);
  for (const PlanLine& line : lines_) {
    double length = 0;
    for (const auto& part : line.parts)
      for (std::size_t k = 0; k + 1 < part.size(); ++k) length += (part[k + 1] - part[k]).norm();
    lines.push_back(fmt::format("  Line {}: {:.4g} m, crossings of it are counted.", line.name, length));
  }
  const std::vector<StructureSpec> coupled =
      structures_.empty() ? std::vector<StructureSpec>() : coupled_scene(0).structures;
  for (const StructureSpec& s : coupled)
    lines.push_back(fmt::format(
        "  Structure {}: members strike it as a rigid surface; talus fragility computes "
        "what some of the hits do{}.",
        s.name,
        s.damage == "none" ? ": forces alone, since its damage = \"none\" gives no damage class" : ""));
  lines.push_back(settings_.releases_per_year > 0
                      ? fmt::format("  Releases: {:g} a year.", settings_.releases_per_year)
                      : "  Releases a year: not given (releases_per_year); no return periods, no figures per "
                        "year.");
  return lines;
}

void Ensemble::check_lines() {
  GroundExtent extent;
  if (ground_) {
    extent.cell = ground_->grid.dx;
    for (const Vec3& v : ground_->surface.vertices) extent.box.extend(v);
  }
  const std::vector<Problem> problems = line_problems(lines_, height_, extent, file_, origin_);
  for (const Problem& p : problems)
    if (p.severity == Problem::Severity::error)
      throw InputError(problems);
    else
      warnings_.push_back(p);
}

/// Members that begin alike are one draw, whatever their number.
void Ensemble::warn_of_what_is_not_drawn(const scene::Scene& provisional) {
  const auto warn = [&](std::string key, std::string rule, std::string remedy) {
    warnings_.push_back({.severity = Problem::Severity::warning,
                         .file = file_,
                         .line = 0,
                         .column = 0,
                         .key = std::move(key),
                         .value = {},
                         .rule = std::move(rule),
                         .remedy = std::move(remedy)});
  };
  if (design_.members() < 2) return;
  if (settings_.vary.empty())
    return warn("ensemble.vary", "nothing is drawn: all members are the same",
                "add [[ensemble.vary]] for what is uncertain");
  for (const scene::Block& b : provisional.blocks)
    if (b.release && !b.release->at && !design_.varies("block." + b.name + ".release"))
      warn(fmt::format("block.{}.release", b.name), "is not drawn: every member starts at the same places",
           fmt::format("add [[ensemble.vary]] with key = \"block.{}.release\"", b.name));
}

/// Worlds of the first members, until one stands: what is wrong with all of them is wrong with the scene.
void Ensemble::try_members() {
  std::optional<InputError> first;
  for (long i = 0; i < std::min(tried, design_.members()); ++i) {
    try {
      const auto world = simulation(i);
      for (const auto& b : world->header().blocks) blocks_.push_back(b.name);
      for (const coupling::StructurePart& part : world->world().system->environment().structures)
        structure_members_.push_back(design_.varies("structure") ? std::vector<talus::Member>()
                                                                 : part.structure->loads().members());
      for (Problem p : world->world().scene.warnings)
        // The cells at the strike are those of the coupled runs; members strike rigid surfaces.
        if (was_rigid_ || !p.key.ends_with(".refine")) warnings_.push_back(std::move(p));
      return;
    } catch (const InputError& error) {
      if (!first) first = as_of_ensemble(error, file_, given_);
    }
  }
  throw *first;
}

scene::Overrides Ensemble::overrides(long index) const {
  scene::Overrides values = design_.draw(index).set;
  values.insert(values.end(), forced_.begin(), forced_.end());
  return values;
}

std::string Ensemble::scene_file(long index, const std::string& comment) const {
  std::string head;
  for (std::size_t from = 0; from <= comment.size();) {
    const std::size_t to = std::min(comment.find('\n', from), comment.size());
    head += "# " + comment.substr(from, to - from) + "\n";
    from = to + 1;
  }
  return head + template_->toml(overrides(index));
}

scene::Scene Ensemble::coupled_scene(long index) const {
  scene::Overrides values = design_.draw(index).set;
  values.emplace_back("simulation.threads", "1");
  if (was_rigid_) values.emplace_back("coupling.scheme", "\"two-way\"");
  return template_->scene(values);
}

std::unique_ptr<sim::Simulation> Ensemble::simulation(long index) {
  return std::make_unique<sim::Simulation>(template_->scene(overrides(index)), *shared_);
}

std::optional<Member> Ensemble::run(long index, const std::atomic<int>* stop) {
  const double began = thread_seconds();
  Member m;
  m.index = index;
  const auto fail = [&](const std::string& why) {
    m.status = Status::failed;
    m.message = why;
    m.cpu = thread_seconds() - began;
    return m;
  };
  std::unique_ptr<sim::Simulation> simulation;
  try {
    simulation = this->simulation(index);
  } catch (const InputError& error) { return fail(error.what()); } catch (const NumericalFailure& error) {
    return fail(error.what());
  }
  sim::World& world = simulation->world();
  m.start = centroids(*simulation);
  world.ledger(world.now());  // energies are counted from here
  Path path(
      *simulation, lines_,
      [&world](double x, double y) {
        return sim::uppermost_ground(world.system->environment().terrain.get(),
                                     world.system->environment().planes, x, y);
      },
      origin_, settings_.map_cell);
  std::atomic<int> halt{0};
  bool over = false;
  path.after = [&] {
    over = world.counters().steps > settings_.step_limit;
    if (over) halt = 1;
    if (stop != nullptr && stop->load() != 0) halt = stop->load();
  };
  Quiet sink;
  const sim::RunResult result = simulation->run(sink, &halt);
  if (stop != nullptr && stop->load() != 0) return std::nullopt;
  m.steps = world.counters().steps;
  m.end = centroids(*simulation);
  m.message = result.message;
  const sim::LedgerRow ledger = world.ledger(world.now());
  const double scale = world.energy_peak > 0 ? 1 / world.energy_peak : 0;
  m.energy_residual = scale * ledger.residual;
  m.numerical_gain = scale * std::max(0.0, -ledger.numerical_dissipation());
  m.reach_angle = reach_angle(m);
  path.finish(m);
  const auto& blocks = world.system->model().blocks;
  const auto moving = static_cast<std::size_t>(
      std::count_if(blocks.begin(), blocks.end(), [](const dda::Model::Block& b) { return b.ndof() > 0; }));
  const bool left = !world.paper && moving > 0 && departed(*world.system).size() == moving;
  const bool rest = result.status == "at rest" || (!world.paper && !left && at_rest(*world.system));
  m.moving = !rest && !left;
  if (result.status == "failed") {
    m.status = Status::failed;
  } else if (over) {
    m.status = Status::over_limit;
    m.message = fmt::format("{} steps by t = {:.6g} s", m.steps, simulation->time());
  } else if (m.numerical_gain > suspect_gain) {
    m.status = Status::suspect;
    m.message =
        fmt::format("numerical energy gain of {:.3g} of the largest kinetic energy", m.numerical_gain);
  } else if (world.scene.simulation.until_rest && !rest && !left) {
    m.status = Status::suspect;
    m.message = fmt::format("still moving at the end of its duration, t = {:.6g} s", simulation->time());
  } else {
    m.status = left ? Status::left : rest ? Status::at_rest : Status::done;
    m.message.clear();
  }
  m.cpu = thread_seconds() - began;
  return m;
}

}  // namespace talus::ensemble

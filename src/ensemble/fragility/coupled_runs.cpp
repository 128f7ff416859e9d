#include "ensemble/fragility/coupled_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "ensemble/random.hpp"
#include "io/files.hpp"
#include "io/json_file.hpp"
#include "io/recorder.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr double speed_scatter = 0.01, angle_scatter = 0.035;  // standard deviations of the perturbation of a
                                                               // run: of its speed, and of its turn [rad]

/// Standard normal number of a run.
double normal(std::uint32_t seed, const Task& t, std::uint32_t k) {
  const auto key = (static_cast<std::uint64_t>(t.event->member) << 16) | static_cast<std::uint64_t>(t.serial);
  const double u = uniform_of(bits(seed, for_runs, key, k, 0)),
               v = uniform_of(bits(seed, for_runs, key, k, 1));
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * M_PI * v);
}

class RunSink : public sim::Sink {
 public:
  explicit RunSink(io::Recorder& recorder) : recorder_(recorder) {}
  void history(const sim::HistoryRow& row) override { recorder_.history(row); }
  void contacts(std::span<const sim::ContactRow> rows) override { recorder_.contacts(rows); }
  void field(double time, std::span<const Pose> poses,
             std::span<const Structure::Fields> structures) override {
    recorder_.field(time, poses, structures);
  }
  void extend(std::span<const sim::RunHeader::BlockInfo> fragments) override { recorder_.extend(fragments); }
  void warning(const std::string& text) override { recorder_.warning(text); }

 private:
  io::Recorder& recorder_;
};

}  // namespace

int Outcome::worst() const { return grade.empty() ? -1 : *std::max_element(grade.begin(), grade.end()); }

bool Outcome::rests_on_shear() const {
  for (std::size_t m = 0; m < grade.size(); ++m)
    if (grade[m] == worst() && !(basis[m].starts_with("V_dyn") && basis[m].find(", ") == std::string::npos))
      return false;
  return !grade.empty();
}

CoupledRuns::CoupledRuns(const FragilityRequest& request, Ensemble& ensemble, int structure,
                         const std::vector<Cluster>& clusters, const std::vector<Task>& tasks)
    : request_(request), ensemble_(ensemble), structure_(structure), clusters_(clusters), tasks_(tasks) {}

/// The scene of a run: the block just before its hit, on its own, a little perturbed; `back` metres behind
/// on its way.
scene::Scene CoupledRuns::scene_of(const Task& t, double back) {
  const Event& e = *t.event;
  scene::Scene s = ensemble_.coupled_scene(e.member);
  if (s.rock_mass && s.rock_mass->from_terrain)
    throw io::bad_file(
        s.file, "rock_mass",
        "is cut out of the terrain; talus fragility takes single blocks on the terrain as it is, "
        "without the hollow",
        "leave rock_mass out, or give the terrain with its hollow as site.terrain");
  const auto world = ensemble_.simulation(e.member);
  const std::string name = world->header().blocks.at(static_cast<std::size_t>(e.hit.block)).name;
  const auto block = std::find_if(s.blocks.begin(), s.blocks.end(), [&](const scene::Block& b) {
    return b.name == name || (b.release && name.starts_with(b.name + "-"));
  });
  if (block == s.blocks.end())
    throw io::bad_file(s.file, "block " + name, "comes from a rock mass; talus fragility takes single blocks",
                       "write the block as a [[block]]");
  scene::Block b = *block;
  const std::uint32_t seed = ensemble_.settings().seed;
  const Vec3 turn = angle_scatter * Vec3(normal(seed, t, 0), normal(seed, t, 1), normal(seed, t, 2));
  const Quat q(e.hit.orientation[0], e.hit.orientation[1], e.hit.orientation[2], e.hit.orientation[3]);
  const Quat turned = turn.norm() > 0 ? Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * q : q;
  b.release.reset();
  b.rotation = turned.normalized().toRotationMatrix();
  b.velocity = e.hit.velocity * (1 + speed_scatter * normal(seed, t, 3));
  b.spin = e.hit.spin;
  // What slides or rolls touches the ground, into which it would be turned.
  const sim::World& ground = world->world();
  Vec3 at = e.hit.centre - back * e.hit.velocity.normalized();
  at.z() += sim::raise_above_ground(ground, ground.placed(e.hit.block), {at, b.rotation});
  b.position = at;
  std::erase_if(s.blocks, [](const scene::Block& other) { return !other.fixed; });
  s.blocks.push_back(std::move(b));
  s.rock_mass.reset();
  s.ensemble.reset();
  s.simulation.duration = request_.window;
  s.simulation.until_rest = false;
  s.output.interval = request_.window;
  s.output.history_interval = std::min(1e-3, request_.window);
  s.output.report = false;
  return s;
}

fs::path CoupledRuns::folder(std::size_t k) const {
  return request_.directory / "fragility" / fmt::format("{}-{}", request_.structure, k);
}

std::optional<Outcome> CoupledRuns::outcome_of(const fs::path& directory) const {
  if (!fs::exists(directory / "summary.json")) return std::nullopt;
  const Json summary = io::read_json(directory / "summary.json", "remove the directory and run again");
  Outcome o;
  o.made = true;
  o.message = summary.value("message", "");
  for (const Json& w : summary.value("warnings", Json::array())) o.warnings.push_back(w.get<std::string>());
  for (const Json& s : summary.value("structures", Json::array())) {
    if (s.value("name", "") != request_.structure) continue;
    o.good = summary.value("status", "") != "failed";
    // A mean over 1.5 ms: that of a single sub-step depends on the cells.
    for (const Json& m : summary.value("impacts", Json::array()))
      if (m.value("structure", "") == request_.structure)
        o.peak_force = std::max(o.peak_force, m.value("filtered_force", 0.0));
    for (const Json& m : s.value("members", Json::array())) {
      o.names.push_back(m.value("name", ""));
      o.grade.push_back(
          m.contains("damage_class") && m["damage_class"].is_number() ? m["damage_class"].get<int>() : -1);
      o.basis.push_back(m.contains("damage_class_basis") && m["damage_class_basis"].is_string()
                            ? m["damage_class_basis"].get<std::string>()
                            : std::string());
    }
  }
  if (request_.capacity && fs::exists(directory / "capacity_ratio.json")) {
    const Json ratios =
        io::read_json(directory / "capacity_ratio.json", "remove the directory and run again");
    for (const Json& m : ratios.value("members", Json::array()))
      if (const double ratio = m.value("ratio", -1.0); ratio >= 0 && (o.capacity < 0 || ratio < o.capacity))
        o.capacity = ratio;
  }
  return o;
}

bool CoupledRuns::run_one(std::size_t k) {
  const fs::path directory = folder(k);
  std::optional<sim::Simulation> simulation;
  double back = 0.02;
  for (int attempt = 0; !simulation; ++attempt, back *= 2) try {
      simulation.emplace(scene_of(tasks_[k], back));
    } catch (const InputError&) {  // the turned block overlaps what it is about to strike
      if (attempt == 5) throw;
    }
  io::Recorder recorder({directory, "", "", false}, simulation->header());
  RunSink sink(recorder);
  const sim::RunResult result = simulation->run(sink, request_.stop);
  io::Outcome outcome;
  outcome.status = result.status, outcome.message = result.message, outcome.counters = result.counters,
  outcome.audit = result.audit, outcome.audit_made = result.audit_made;
  if (result.status == "interrupted") return false;
  if (request_.capacity && result.status != "failed") write_capacity(*simulation, directory);
  recorder.finish(outcome);
  return true;
}

/// Capacities of the structure's members as they stand at the end of a run, beside those as built.
void CoupledRuns::write_capacity(sim::Simulation& simulation, const fs::path& directory) {
  Structure* const s = simulation.structures()[static_cast<std::size_t>(structure_)];
  if (s == nullptr) return;
  const std::vector<PushDown> now = s->capacity().push_down(), &built = as_built(tasks_.front());
  const std::vector<MemberState> states = s->loads().states();
  Json list = Json::array();
  for (std::size_t k = 0; k < std::min(now.size(), built.size()); ++k) {
    const talus::Member& m = s->loads().members()[k];
    const bool lost =
        !std::isfinite(states[k].drift[0]) || (m.volume > 0 && states[k].lost_volume > 0.1 * m.volume);
    list.push_back({{"member", now[k].member},
                    {"ratio", lost || !(built[k].capacity > 0) ? 0.0 : now[k].capacity / built[k].capacity}});
  }
  io::write_file(directory / "capacity_ratio.json", Json{{"members", list}}.dump(2) + "\n", false);
}

/// The same for all runs: the structure is that of the scene.
const std::vector<PushDown>& CoupledRuns::as_built(const Task& task) {
  const std::lock_guard lock(built_mutex_);
  if (!built_)
    built_ = sim::Simulation(scene_of(task, 0.5))
                 .structures()[static_cast<std::size_t>(structure_)]
                 ->capacity()
                 .push_down();
  return *built_;
}

void CoupledRuns::run() {
  outcomes_.resize(tasks_.size());
  std::vector<std::string> why(tasks_.size());
  std::vector<std::size_t> todo;
  plan_file();
  for (const std::size_t k : order_of_runs(tasks_, clusters_))
    if (auto o = outcome_of(folder(k)))
      outcomes_[k] = std::move(*o);
    else
      todo.push_back(k);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  Progress progress{.done = static_cast<long>(tasks_.size() - todo.size()),
                    .asked = static_cast<long>(tasks_.size())};
  for (const Outcome& o : outcomes_) progress.failed += o.made && !o.good;
  const auto work = [&] {
    while (request_.stop == nullptr || request_.stop->load() == 0) {
      const std::size_t at = next.fetch_add(1);
      if (at >= todo.size()) return;
      const std::size_t k = todo[at];
      try {
        if (!run_one(k)) return;
        if (auto o = outcome_of(folder(k))) outcomes_[k] = std::move(*o);
      } catch (const std::exception& error) { why[k] = error.what(); }
      const std::lock_guard lock(mutex);
      ++progress.done;
      progress.failed += !outcomes_[k].good;
      if (request_.progress) request_.progress(progress);
    }
  };
  std::vector<std::thread> threads;
  for (int k = 1; k < request_.threads; ++k) threads.emplace_back(work);
  work();
  for (std::thread& t : threads) t.join();
  for (std::size_t k = 0; k < tasks_.size(); ++k) {
    if (why[k].empty() && outcomes_[k].made && !outcomes_[k].good) why[k] = outcomes_[k].message;
    if (!why[k].empty())
      faults_.push_back(fmt::format("run {} (member {}): {}", k, tasks_[k].event->member, why[k]));
  }
}

/// Runs of another plan (other numbers of runs, another ensemble) are not taken for these.
void CoupledRuns::plan_file() {
  std::string plan = fmt::format("{} {} {} {}{}", ensemble_.identity(), request_.structure, request_.runs,
                                 request_.window, request_.capacity ? " capacity" : "");
  const fs::path file = request_.directory / "fragility" / (request_.structure + ".plan");
  fs::create_directories(file.parent_path());
  if (fs::exists(file) && io::read_file(file) == plan) return;
  std::vector<fs::path> old;  // runs are made in no order of their numbers
  for (const auto& entry : fs::directory_iterator(file.parent_path())) {
    const std::string name = entry.path().filename().string(), prefix = request_.structure + "-";
    if (entry.is_directory() && name.starts_with(prefix) && name.size() > prefix.size() &&
        name.find_first_not_of("0123456789", prefix.size()) == std::string::npos)
      old.push_back(entry.path());
  }
  for (const fs::path& directory : old) fs::remove_all(directory);
  io::write_file(file, plan, false);
}

}  // namespace talus::ensemble

#include "ensemble/fragility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "ensemble/ensemble.hpp"
#include "ensemble/logistic.hpp"
#include "ensemble/random.hpp"
#include "ensemble/statistics.hpp"
#include "ensemble/store.hpp"
#include "ensemble/strata.hpp"
#include "io/files.hpp"
#include "io/json_file.hpp"
#include "io/recorder.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr int classes = 4;
constexpr std::array<const char*, classes + 1> class_names{"none", "slight", "moderate", "severe", "lost"};
constexpr std::size_t least_events = 3;  // of a cluster, where one is divided
constexpr int runs_a_cluster = 3;        // at least, over all clusters, where hits are divided further
/// Spreads that count as equal when a cluster is divided: of ln(energy), of the height over the member's
/// length, of the direction in plan [rad].
constexpr std::array<double, 3> alike{0.5, 0.15, 0.5};
constexpr double least_spread = 0.05;  // of these: hits that differ by less are one kind
constexpr double speed_scatter = 0.01, angle_scatter = 0.035;  // standard deviations of the perturbation of a
                                                               // run: of its speed, and of its turn [rad]
/// Days that a bridge is closed by the class of its worst member: an assumption that is written with the
/// results.
constexpr std::array<double, classes + 1> closure_days{0, 1, 14, 180, 365};

struct Event {
  std::int64_t member = 0;
  Hit hit;
  double energy = 0;     // of the translation just before [J]
  int struck = -1;       // member of the structure
  double height = 0;     // of the contact above the member's base, along its axis; without members its z [m]
  double direction = 0;  // of the velocity in plan, clockwise from north (+y) [rad]
};

struct Cluster {
  int struck = -1;
  std::vector<Event> events;  // by energy
  int runs = 0, done = 0;
  std::array<int, classes + 1> at_least{};  // runs at class k or more
};

struct Task {
  int cluster = 0, serial = 0;
  const Event* event = nullptr;
};

struct Outcome {
  bool good = false;
  std::vector<std::string> names;  // of the structure's members
  std::vector<int> grade;          // -1: not judged
  double peak_force = 0;           // [N]
  double capacity =
      -1;  // least over the members of that now over that as built, 0: lost; negative: not asked for
  int worst() const { return grade.empty() ? -1 : *std::max_element(grade.begin(), grade.end()); }
};

std::string figure(const Json& p) {
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", p["value"].get<double>(), p["low"].get<double>(),
                     p["high"].get<double>());
}

/// Number of the sorted values that go to the lower part, so that the sum of squares about the means of both
/// parts is least.
std::size_t best_cut(const std::vector<double>& sorted) {
  const double all = std::accumulate(sorted.begin(), sorted.end(), 0.0),
               n = static_cast<double>(sorted.size());
  double sum = 0, most = -1;
  std::size_t best = sorted.size() / 2;
  for (std::size_t k = 1; k + least_events <= sorted.size(); ++k) {
    sum += sorted[k - 1];
    if (k < least_events) continue;
    const double low = static_cast<double>(k),
                 between = std::pow(sum / low - (all - sum) / (n - low), 2) * low * (n - low);
    if (between > most) most = between, best = k;
  }
  return best;
}

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
             std::span<const Structure::Snapshot> structures) override {
    recorder_.field(time, poses, structures);
  }
  void extend(std::span<const sim::RunHeader::BlockInfo> fragments) override { recorder_.extend(fragments); }
  void warning(const std::string& text) override { recorder_.warning(text); }

 private:
  io::Recorder& recorder_;
};

class Fragility {
 public:
  explicit Fragility(const FragilityRequest& r)
      : request_(r), ensemble_((r.directory / "scene.toml").string(), {}) {
    const auto& names = ensemble_.structures();
    const auto found = std::find(names.begin(), names.end(), r.structure);
    if (found == names.end())
      throw io::bad_file(r.directory / "scene.toml", "--structure " + r.structure,
                         "there is no such structure",
                         fmt::format("name one of: {}", fmt::join(names, ", ")));
    structure_ = static_cast<int>(found - names.begin());
  }

  FragilityResult write() {
    gather();
    cluster();
    run_all();
    return report();
  }

 private:
  void gather() {
    const auto world = first_world();
    for (const talus::Member& m : world->world()
                                      .system->environment()
                                      .structures[static_cast<std::size_t>(structure_)]
                                      .structure->members())
      members_.push_back(m);
    each_member(request_.directory, ensemble_.identity(), [&](ensemble::Member&& m) {
      if (!finished(m.status)) return;
      ++finished_;
      const Hit* most = nullptr;
      for (const Hit& h : m.hits)
        if (h.structure == structure_ && (most == nullptr || h.mass * h.velocity.squaredNorm() >
                                                                 most->mass * most->velocity.squaredNorm()))
          most = &h;
      if (most != nullptr) events_.push_back(event_of(m.index, *most));
    });
    std::sort(events_.begin(), events_.end(),
              [](const Event& a, const Event& b) { return a.member < b.member; });
    if (events_.empty())
      throw io::bad_file(request_.directory / "ensemble.h5", "/hits/" + request_.structure,
                         "no member hits the structure",
                         "there is nothing to run; more members would tell how rare a hit is");
  }

  std::unique_ptr<sim::Simulation> first_world() {
    for (long i = 0;; ++i) try {
        return ensemble_.simulation(i);
      } catch (const InputError&) {
        if (i > 100) throw;
      }
  }

  Event event_of(std::int64_t member, const Hit& hit) const {
    Event e{.member = member,
            .hit = hit,
            .energy = 0.5 * hit.mass * hit.velocity.squaredNorm(),
            .struck = struck_by(hit.point),
            .height = hit.point.z(),
            .direction = std::atan2(hit.velocity.x(), hit.velocity.y())};
    if (e.struck >= 0) {
      const talus::Member& m = members_[static_cast<std::size_t>(e.struck)];
      e.height = std::clamp((hit.point - m.base).dot(m.axis_x.cross(m.axis_y).normalized()), 0.0, m.length);
    }
    return e;
  }

  /// The member that is nearest to the point, a prism about its axis; -1 without members.
  int struck_by(const Vec3& point) const {
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < members_.size(); ++k) {
      const Vec3 axis = members_[k].axis_x.cross(members_[k].axis_y).normalized();
      const Vec3 from = point - members_[k].base, x = members_[k].axis_x, y = members_[k].axis_y;
      const Vec3 inside =
          std::clamp(from.dot(axis), 0.0, members_[k].length) * axis +
          std::clamp(from.dot(x), -0.5 * members_[k].section[0], 0.5 * members_[k].section[0]) * x +
          std::clamp(from.dot(y), -0.5 * members_[k].section[1], 0.5 * members_[k].section[1]) * y;
      if (const double d = (from - inside).norm(); d < least) least = d, best = static_cast<int>(k);
    }
    return best;
  }

  /// What a cluster is divided by: ln(energy), height over the member's length, direction against the mean
  /// one.
  std::array<double, 3> features(const Event& e, const Eigen::Vector2d& mean) const {
    const double length = e.struck >= 0 ? members_[static_cast<std::size_t>(e.struck)].length : 1;
    return {std::log(std::max(e.energy, 1e-300)), e.height / std::max(length, 1e-300),
            std::remainder(e.direction - std::atan2(mean.x(), mean.y()), 2 * M_PI)};
  }

  /// The feature in which the hits of a cluster differ most, over what counts as equal, and by how much.
  std::pair<double, std::size_t> widest(const Cluster& c, std::vector<std::array<double, 3>>& all) const {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Event& e : c.events) mean += Eigen::Vector2d(std::sin(e.direction), std::cos(e.direction));
    all.clear();
    for (const Event& e : c.events) all.push_back(features(e, mean));
    std::pair<double, std::size_t> found{0, 0};
    for (std::size_t k = 0; k < alike.size(); ++k) {
      double sum = 0, squares = 0;
      for (const auto& f : all) sum += f[k], squares += f[k] * f[k];
      const double n = static_cast<double>(all.size()),
                   spread = std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) / alike[k];
      if (spread > found.first) found = {spread, k};
    }
    return found;
  }

  /// Hits by the member struck; then the cluster whose events differ most, each counted, is divided in what
  /// they differ most in, as long as the runs suffice for more clusters.
  void divide() {
    std::map<int, std::size_t> place;
    for (const Event& e : events_) {
      const auto [at, fresh] = place.try_emplace(e.struck, clusters_.size());
      if (fresh) clusters_.push_back({.struck = e.struck, .events = {}});
      clusters_[at->second].events.push_back(e);
    }
    std::vector<std::array<double, 3>> of;
    while (static_cast<int>(clusters_.size()) * runs_a_cluster < request_.runs) {
      double most = 0;
      std::size_t which = 0;
      for (std::size_t i = 0; i < clusters_.size(); ++i) {
        if (clusters_[i].events.size() < 2 * least_events) continue;
        const double spread = widest(clusters_[i], of).first;
        if (const double gain = static_cast<double>(clusters_[i].events.size()) * spread;
            spread > least_spread && gain > most)
          most = gain, which = i;
      }
      if (most == 0) break;
      const std::size_t by = widest(clusters_[which], of).second, n = clusters_[which].events.size();
      std::vector<std::size_t> order(n);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(of[a][by], clusters_[which].events[a].member) <
               std::pair(of[b][by], clusters_[which].events[b].member);
      });
      Cluster low{.struck = clusters_[which].struck, .events = {}}, high = low;
      std::vector<double> sorted;
      for (const std::size_t k : order) sorted.push_back(of[k][by]);
      const std::size_t cut = best_cut(sorted);
      for (std::size_t k = 0; k < n; ++k)
        (k < cut ? low : high).events.push_back(clusters_[which].events[order[k]]);
      clusters_[which] = std::move(low);
      clusters_.push_back(std::move(high));
    }
    for (Cluster& c : clusters_)
      std::sort(c.events.begin(), c.events.end(), [](const Event& a, const Event& b) {
        return std::pair(a.energy, a.member) < std::pair(b.energy, b.member);
      });
    std::stable_sort(clusters_.begin(), clusters_.end(),
                     [](const Cluster& a, const Cluster& b) { return a.struck < b.struck; });
  }

  void cluster() {
    divide();
    // One run each, the rest one by one to the cluster that is behind its share most.
    double roots = 0;
    for (const Cluster& c : clusters_) roots += std::sqrt(static_cast<double>(c.events.size()));
    std::vector<std::size_t> order(clusters_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return clusters_[a].events.size() > clusters_[b].events.size();
    });
    for (int k = 0; k < request_.runs; ++k) {
      Cluster* next = nullptr;
      double most = -std::numeric_limits<double>::infinity();
      for (const std::size_t i : order) {
        Cluster& c = clusters_[i];
        const double behind =
            c.runs == 0 ? 1e9
                        : request_.runs * std::sqrt(static_cast<double>(c.events.size())) / roots - c.runs;
        if (behind > most) most = behind, next = &c;
      }
      ++next->runs;
    }
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
      Cluster& c = clusters_[i];
      // Events in an order of chance; over again, with another perturbation, if there are fewer than runs.
      std::vector<std::pair<std::uint64_t, std::size_t>> lots;
      for (std::size_t e = 0; e < c.events.size(); ++e)
        lots.emplace_back(bits(ensemble_.settings().seed, for_clusters,
                               static_cast<std::uint64_t>(c.events[e].member), 0, 0),
                          e);
      std::sort(lots.begin(), lots.end());
      for (int k = 0; k < c.runs; ++k) {
        const auto at = static_cast<std::size_t>(k);
        tasks_.push_back({static_cast<int>(i), k / static_cast<int>(lots.size()),
                          &c.events[lots[at % lots.size()].second]});
      }
    }
  }

  /// The scene of a run: the block just before its hit, on its own, a little perturbed; `back` metres behind
  /// on its way.
  scene::Scene scene_of(const Task& t, double back) {
    const Event& e = *t.event;
    scene::Scene s = ensemble_.coupled_scene(e.member);
    const auto world = ensemble_.simulation(e.member);
    const std::string name = world->header().blocks.at(static_cast<std::size_t>(e.hit.block)).name;
    const auto block = std::find_if(s.blocks.begin(), s.blocks.end(), [&](const scene::Block& b) {
      return b.name == name || (b.release && name.starts_with(b.name + "-"));
    });
    if (block == s.blocks.end())
      throw io::bad_file(s.file, "block " + name,
                         "comes from a rock mass; talus fragility takes single blocks",
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
    b.position = e.hit.centre - back * e.hit.velocity.normalized();
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

  fs::path folder(std::size_t k) const {
    return request_.directory / "fragility" / fmt::format("{}-{}", request_.structure, k);
  }

  std::optional<Outcome> outcome_of(const fs::path& directory) const {
    if (!fs::exists(directory / "summary.json")) return std::nullopt;
    const Json summary = io::read_json(directory / "summary.json", "remove the directory and run again");
    Outcome o;
    for (const Json& s : summary.value("structures", Json::array())) {
      if (s.value("name", "") != request_.structure) continue;
      o.good = summary.value("status", "") != "failed";
      o.peak_force =
          s.contains("peak_force") && s["peak_force"].is_number() ? s["peak_force"].get<double>() : 0;
      for (const Json& m : s.value("members", Json::array())) {
        o.names.push_back(m.value("name", ""));
        o.grade.push_back(
            m.contains("damage_class") && m["damage_class"].is_number() ? m["damage_class"].get<int>() : -1);
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

  void run_one(std::size_t k) {
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
    if (result.status == "interrupted") return;
    if (request_.capacity && result.status != "failed") write_capacity(*simulation, directory);
    recorder.finish(outcome);
  }

  /// Capacities of the structure's members as they stand at the end of a run, beside those as built.
  void write_capacity(sim::Simulation& simulation, const fs::path& directory) {
    const Structure* s = simulation.structures()[static_cast<std::size_t>(structure_)];
    if (s == nullptr) return;
    const std::vector<PushDown> now = s->push_down(), &built = as_built(tasks_.front());
    const std::vector<MemberState> states = s->member_states();
    Json list = Json::array();
    for (std::size_t k = 0; k < std::min(now.size(), built.size()); ++k) {
      const talus::Member& m = s->members()[k];
      const bool lost =
          !std::isfinite(states[k].drift[0]) || (m.volume > 0 && states[k].lost_volume > 0.1 * m.volume);
      list.push_back(
          {{"member", now[k].member},
           {"ratio", lost || !(built[k].capacity > 0) ? 0.0 : now[k].capacity / built[k].capacity}});
    }
    io::write_file(directory / "capacity_ratio.json", Json{{"members", list}}.dump(2) + "\n", false);
  }

  /// The same for all runs: the structure is that of the scene.
  const std::vector<PushDown>& as_built(const Task& task) {
    const std::lock_guard lock(built_mutex_);
    if (!built_)
      built_ = sim::Simulation(scene_of(task, 0.5))
                   .structures()[static_cast<std::size_t>(structure_)]
                   ->push_down();
    return *built_;
  }

  void run_all() {
    outcomes_.resize(tasks_.size());
    std::vector<std::size_t> todo;
    plan_file();
    for (std::size_t k = 0; k < tasks_.size(); ++k)
      if (auto o = outcome_of(folder(k)))
        outcomes_[k] = std::move(*o);
      else
        todo.push_back(k);
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    int done = static_cast<int>(tasks_.size() - todo.size());
    const auto work = [&] {
      while (request_.stop == nullptr || request_.stop->load() == 0) {
        const std::size_t at = next.fetch_add(1);
        if (at >= todo.size()) return;
        std::string why;
        try {
          run_one(todo[at]);
        } catch (const std::exception& error) { why = error.what(); }
        const std::lock_guard lock(mutex);
        if (!why.empty())
          faults_.push_back(
              fmt::format("run {} (member {}): {}", todo[at], tasks_[todo[at]].event->member, why));
        else if (auto o = outcome_of(folder(todo[at])))
          outcomes_[todo[at]] = std::move(*o);
        if (request_.progress) request_.progress(++done, static_cast<int>(tasks_.size()));
      }
    };
    std::vector<std::thread> threads;
    for (int k = 1; k < request_.threads; ++k) threads.emplace_back(work);
    work();
    for (std::thread& t : threads) t.join();
  }

  /// Runs of another plan (other numbers of runs, another ensemble) are not taken for these.
  void plan_file() {
    std::string plan = fmt::format("{} {} {} {}{}", ensemble_.identity(), request_.structure, request_.runs,
                                   request_.window, request_.capacity ? " capacity" : "");
    const fs::path file = request_.directory / "fragility" / (request_.structure + ".plan");
    fs::create_directories(file.parent_path());
    if (fs::exists(file) && io::read_file(file) == plan) return;
    for (std::size_t k = 0; fs::exists(folder(k)); ++k) fs::remove_all(folder(k));
    io::write_file(file, plan, false);
  }

  FragilityResult report() {
    FragilityResult result;
    std::vector<std::string> names;
    double most_force = 0;
    for (const Outcome& o : outcomes_) {
      if (!o.good) {
        ++result.failed;
        continue;
      }
      ++result.done;
      most_force = std::max(most_force, o.peak_force);
      if (names.empty()) names = o.names;
    }
    const double n = static_cast<double>(std::max(1L, finished_)),
                 yearly = ensemble_.settings().releases_per_year;
    Json root;
    root["structure"] = request_.structure;
    root["runs"] = {{"asked", request_.runs},
                    {"done", result.done},
                    {"failed", result.failed},
                    {"window", request_.window}};
    root["faults"] = faults_;
    const Estimate struck = wilson(static_cast<long>(events_.size()), finished_);
    root["events"] = {{"members", finished_},
                      {"hits", events_.size()},
                      {"probability_of_hit", static_cast<double>(events_.size()) / n},
                      {"probability_of_hit_interval", {struck.low, struck.high}}};
    root["peak_force"] = {{"mean", mean_per_hit([](const Outcome& o) { return o.peak_force; })},
                          {"largest", most_force}};
    if (request_.capacity)
      root["capacity"] = {{"least_ratio", mean_per_hit([](const Outcome& o) { return o.capacity; })},
                          {"note",
                           "capacity now over that as built, of the member of a run with the least; 0: lost; "
                           "mean over hits"}};
    root["classes"] = class_names;
    root["members"] = Json::array();
    for (std::size_t m = 0; m < names.size(); ++m) root["members"].push_back(member_curves(names[m], m));
    // The structure as a whole: its worst member.
    const auto worst = [](const Outcome& o) { return o.worst(); };
    Json per_event = Json::array(), per_year = Json::array();
    std::array<double, classes + 2> at_least{};
    at_least[0] = 1;
    for (int k = 1; k <= classes; ++k) {
      const Json p = probability(k, worst);
      per_event.push_back(p);
      if (!p["value"].is_number()) continue;  // no run was judged
      at_least[static_cast<std::size_t>(k)] = p["value"].get<double>();
      if (yearly > 0) {
        Json y = p;
        for (const char* bound : {"value", "low", "high"})
          y[bound] = -std::expm1(-yearly * p[bound].get<double>());
        per_year.push_back(y);
      }
      result.lines.push_back(fmt::format("P(class >= {}, {}) = {} per event", k,
                                         class_names[static_cast<std::size_t>(k)], figure(p)));
    }
    if (per_event.front()["value"].is_null())
      result.lines.push_back(
          fmt::format("no damage class: {} has no damage law (structure.damage), or no run was judged",
                      request_.structure));
    else
      for (const Json& m : root["members"])
        result.lines.push_back(fmt::format("P({} severe) = {} per event", m["name"].get<std::string>(),
                                           figure(m["per_event"][2])));
    root["per_event"] = per_event;
    if (yearly > 0) root["per_year"] = per_year;
    double closure = 0;
    for (int k = 1; k <= classes; ++k)
      closure += closure_days[static_cast<std::size_t>(k)] *
                 (at_least[static_cast<std::size_t>(k)] - at_least[static_cast<std::size_t>(k + 1)]);
    root["expected_closure"] = {{"days_per_event", closure},
                                {"days_by_class", closure_days},
                                {"note", "days of closure by class are an assumption"}};
    if (yearly > 0) root["expected_closure"]["days_per_year"] = yearly * closure;
    root["next_run"] = next_run(worst);
    if (!root["next_run"].is_null())
      result.lines.push_back("One more run narrows most: " + root["next_run"]["text"].get<std::string>());
    root["clusters"] = Json::array();
    for (const Cluster& c : clusters_) {
      const auto [low, high] =
          std::minmax_element(c.events.begin(), c.events.end(),
                              [](const Event& a, const Event& b) { return a.height < b.height; });
      Eigen::Vector2d way = Eigen::Vector2d::Zero();
      for (const Event& e : c.events) way += Eigen::Vector2d(std::sin(e.direction), std::cos(e.direction));
      root["clusters"].push_back({{"struck", c.struck < 0 || c.struck >= static_cast<int>(names.size())
                                                 ? Json(nullptr)
                                                 : Json(names[static_cast<std::size_t>(c.struck)])},
                                  {"energy", {c.events.front().energy, c.events.back().energy}},
                                  {"height", {low->height, high->height}},
                                  {"mean_direction", std::atan2(way.x(), way.y())},
                                  {"events", c.events.size()},
                                  {"runs", c.runs}});
    }
    root["limits"] = "blocks do not break on impact; other blocks of a member are left out of its window";
    io::write_file(request_.directory / "fragility.json", root.dump(2) + "\n");
    return result;
  }

  template <class Grade>
  std::pair<int, int> counts(std::size_t cluster, int k, Grade grade) const {
    int x = 0, n = 0;
    for (std::size_t t = 0; t < tasks_.size(); ++t)
      if (tasks_[t].cluster == static_cast<int>(cluster) && outcomes_[t].good && grade(outcomes_[t]) >= 0)
        ++n, x += grade(outcomes_[t]) >= k;
    return {x, n};
  }

  /// Mean over the hits of what runs give, each cluster by its number of hits, with its 95 % interval; runs
  /// that give none (negative) are left out.
  template <class Value>
  Json mean_per_hit(Value value) const {
    double pooled = 0, all = 0;
    long spare = 0;
    std::vector<std::array<double, 3>> sums(clusters_.size(),
                                            {0, 0, 0});  // number, sum, sum of squares about the mean
    for (std::size_t t = 0; t < tasks_.size(); ++t)
      if (outcomes_[t].good && value(outcomes_[t]) >= 0)
        sums[static_cast<std::size_t>(tasks_[t].cluster)][0] += 1,
            sums[static_cast<std::size_t>(tasks_[t].cluster)][1] += value(outcomes_[t]);
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      auto& c = sums[static_cast<std::size_t>(tasks_[t].cluster)];
      if (outcomes_[t].good && value(outcomes_[t]) >= 0)
        c[2] += std::pow(value(outcomes_[t]) - c[1] / c[0], 2);
    }
    for (const auto& c : sums)
      if (c[0] > 1) pooled += c[2], spare += static_cast<long>(c[0]) - 1;
    double mean = 0, variance = 0;
    for (std::size_t i = 0; i < clusters_.size(); ++i)
      if (sums[i][0] > 0) all += static_cast<double>(clusters_[i].events.size());
    if (all == 0) return nullptr;
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
      if (sums[i][0] == 0) continue;
      const double w = static_cast<double>(clusters_[i].events.size()) / all;
      mean += w * sums[i][1] / sums[i][0];
      if (spare > 0) variance += w * w * pooled / static_cast<double>(spare) / sums[i][0];
    }
    if (spare == 0) return {{"value", mean}, {"low", nullptr}, {"high", nullptr}};
    const double half = 1.959963984540054 * std::sqrt(variance);
    return {{"value", mean}, {"low", std::max(0.0, mean - half)}, {"high", mean + half}};
  }

  /// P(class >= k) per event of the ensemble: that of a hit times that of the class given one.
  template <class Grade>
  Json probability(int k, Grade grade) const {
    const Estimate given = stratified(strata(k, grade));
    const Estimate p = product(wilson(static_cast<long>(events_.size()), finished_), given);
    if (!std::isfinite(given.value))
      return {{"class", k}, {"value", nullptr}, {"low", nullptr}, {"high", nullptr}};
    return {{"class", k}, {"value", p.value}, {"low", p.low}, {"high", std::min(1.0, p.high)}};
  }

  template <class Grade>
  std::vector<Stratum> strata(int k, Grade grade) const {
    std::vector<Stratum> all;
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      const auto [x, n] = counts(c, k, grade);
      all.push_back({static_cast<double>(clusters_[c].events.size()), x, n});
    }
    return all;
  }

  Json member_curves(const std::string& name, std::size_t m) const {
    const auto grade = [m](const Outcome& o) { return m < o.grade.size() ? o.grade[m] : -1; };
    Json member{{"name", name}, {"per_event", Json::array()}, {"curves", Json::array()}};
    // Of the hits on this member, if there are enough of them; else of all.
    int own = 0;
    for (std::size_t t = 0; t < tasks_.size(); ++t)
      own += outcomes_[t].good && tasks_[t].event->struck == static_cast<int>(m);
    const bool only_own = own >= 6;
    for (int k = 1; k <= classes; ++k) {
      member["per_event"].push_back(probability(k, grade));
      std::vector<double> x;
      std::vector<int> y;
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        if (!outcomes_[t].good || grade(outcomes_[t]) < 0 || !(tasks_[t].event->energy > 0) ||
            (only_own && tasks_[t].event->struck != static_cast<int>(m)))
          continue;
        x.push_back(std::log(tasks_[t].event->energy));
        y.push_back(grade(outcomes_[t]) >= k);
      }
      Json curve{{"class", k},
                 {"hits", only_own ? "on this member" : "anywhere"},
                 {"runs", x.size()},
                 {"reached", std::accumulate(y.begin(), y.end(), 0)}};
      const Logistic fit = fit_logistic(x, y);
      curve["fitted"] = fit.fitted;
      if (fit.fitted) {
        curve["law"] = "P = 1 / (1 + exp(-(a + b ln(E / 1 J))))";
        curve["a"] = fit.a, curve["b"] = fit.b;
        curve["goodness"] = {
            {"deviance", fit.deviance}, {"null_deviance", fit.null_deviance}, {"brier", fit.brier}};
        const auto [low, high] = std::minmax_element(x.begin(), x.end());
        for (int q = 0; q <= 20; ++q) {
          const double at = *low + (*high - *low) * q / 20;
          const Logistic::Band band = fit.at(at);
          curve["energy"].push_back(std::exp(at)), curve["probability"].push_back(band.value),
              curve["low"].push_back(band.low), curve["high"].push_back(band.high);
        }
      }
      member["curves"].push_back(std::move(curve));
    }
    return member;
  }

  /// The cluster in which one more run takes most off the variance of P(class >= 3).
  template <class Grade>
  Json next_run(Grade grade) const {
    double most = 0;
    std::size_t best = 0;
    const std::vector<Stratum> all = strata(3, grade);
    for (std::size_t c = 0; c < clusters_.size(); ++c)
      if (const double gain = variance_gain(all, c); gain > most) most = gain, best = c;
    if (!(most > 0)) return nullptr;
    const Cluster& c = clusters_[best];
    const std::string where = c.struck >= 0 && c.struck < static_cast<int>(members_.size())
                                  ? members_[static_cast<std::size_t>(c.struck)].name
                                  : request_.structure;
    return {{"cluster", best},
            {"variance_gain", most},
            {"text", fmt::format("a hit on {} with {:.4g} to {:.4g} kJ ({} events, {} runs)", where,
                                 c.events.front().energy / 1e3, c.events.back().energy / 1e3, c.events.size(),
                                 c.runs)}};
  }

  FragilityRequest request_;
  Ensemble ensemble_;
  int structure_ = 0;
  long finished_ = 0;
  std::vector<talus::Member> members_;  // of the structure
  std::vector<Event> events_;
  std::vector<Cluster> clusters_;
  std::vector<Task> tasks_;
  std::vector<Outcome> outcomes_;
  std::vector<std::string> faults_;
  std::optional<std::vector<PushDown>> built_;
  std::mutex built_mutex_;
};

}  // namespace

FragilityResult write_fragility(const FragilityRequest& request) { return Fragility(request).write(); }

}  // namespace talus::ensemble

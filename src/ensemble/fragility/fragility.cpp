#include "ensemble/fragility/fragility.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/error.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/fragility/coupled_runs.hpp"
#include "ensemble/fragility/figures.hpp"
#include "ensemble/fragility/fragility_file.hpp"
#include "ensemble/fragility/hits.hpp"
#include "ensemble/store.hpp"
#include "io/files.hpp"
#include "sim/fineness.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

constexpr double long_window = 5;       // of a run, beyond which it is more likely a mistake of the unit [s]
constexpr long tried_for_ground = 100;  // members whose scene may be refused before one stands

class Fragility {
 public:
  explicit Fragility(const FragilityRequest& r)
      : request_(r), ensemble_((r.directory / "scene.toml").string(), {}) {
    const std::unique_ptr<sim::Simulation> world = first_world();
    structure_ = place_of_structure(*world);
    members_ = world->world()
                   .system->environment()
                   .structures[static_cast<std::size_t>(structure_)]
                   .structure->loads()
                   .members();
  }

  FragilityResult write() {
    gather();
    clusters_ = cluster_events(events_, members_, request_.runs);
    tasks_ = draw_tasks(clusters_, ensemble_.settings().seed);
    announce();
    CoupledRuns runs(request_, ensemble_, structure_, clusters_, tasks_);
    runs.run();
    FragilityFigures figures = figures_of({.request = request_,
                                           .releases_per_year = ensemble_.settings().releases_per_year,
                                           .finished = finished_,
                                           .hits = static_cast<long>(events_.size()),
                                           .members = members_,
                                           .clusters = clusters_,
                                           .tasks = tasks_,
                                           .outcomes = runs.outcomes(),
                                           .faults = runs.faults(),
                                           .mesh = coarse_cells()});
    keep_fragility(request_.directory, std::move(figures.root));
    return std::move(figures.result);
  }

 private:
  std::unique_ptr<sim::Simulation> first_world() {
    for (long i = 0;; ++i) try {
        return ensemble_.simulation(i);
      } catch (const InputError&) {
        if (i > tried_for_ground) throw;
      }
  }

  int place_of_structure(sim::Simulation& world) const {
    const auto& names = ensemble_.structures();
    const auto found = std::find(names.begin(), names.end(), request_.structure);
    if (found != names.end()) return static_cast<int>(found - names.begin());
    const fs::path scene = request_.directory / "scene.toml";
    const std::string option = "--structure " + request_.structure;
    if (names.empty())
      throw io::bad_file(scene, option, "the ensemble has no structure",
                         "add the [[structure]] to its scene and run talus ensemble again");
    const auto& parts = world.world().system->environment().structures;
    for (std::size_t s = 0; s < parts.size(); ++s)
      for (const talus::Member& m : parts[s].structure->loads().members())
        if (m.name == request_.structure)
          throw io::bad_file(
              scene, option, fmt::format("is a member of the structure {}", names[s]),
              fmt::format("write --structure {}: the results list each of its members", names[s]));
    throw io::bad_file(scene, option, "there is no such structure",
                       fmt::format("name one of: {}", fmt::join(names, ", ")));
  }

  /// The strongest hit of each member of the ensemble that came to an end.
  void gather() {
    each_member(request_.directory, ensemble_.identity(), [&](ensemble::Member&& m) {
      if (!finished(m.status)) return;
      ++finished_;
      const Hit* most = nullptr;
      for (const Hit& h : m.hits)
        if (h.structure == structure_ && (most == nullptr || h.mass * h.velocity.squaredNorm() >
                                                                 most->mass * most->velocity.squaredNorm()))
          most = &h;
      if (most != nullptr) events_.push_back(event_of(m.index, *most, members_));
    });
    std::sort(events_.begin(), events_.end(),
              [](const Event& a, const Event& b) { return a.member < b.member; });
    if (events_.empty())
      throw io::bad_file(request_.directory / "ensemble.h5", "/hits/" + request_.structure,
                         "no member hits the structure",
                         "there is nothing to run; more members would tell how rare a hit is");
  }

  std::string coarse_cells() const {
    const StructureSpec spec =
        ensemble_.coupled_scene(events_.front().member).structures[static_cast<std::size_t>(structure_)];
    const std::vector<Problem> few = sim::fineness_problems(spec);
    return few.empty() ? sim::fineness_line(spec) : few.front().key + " " + few.front().rule + ".";
  }

  /// What is about to be computed, and what of it cannot be what was meant.
  void announce() const {
    if (!request_.tell) return;
    const auto s = [](auto count) { return count == 1 ? "" : "s"; };
    request_.tell(fmt::format("{} of {} members hit {}; {} coupled run{} of {:g} s for {} kind{} of hit",
                              events_.size(), finished_, request_.structure, request_.runs, s(request_.runs),
                              request_.window, clusters_.size(), s(clusters_.size())));
    if (request_.window > long_window)
      request_.tell(
          fmt::format("warning: --window = {:g} s: a strike and what follows take about 0.5 s; a "
                      "number without a unit is in seconds",
                      request_.window));
    const scene::Scene scene = ensemble_.coupled_scene(events_.front().member);
    if (scene.structures[static_cast<std::size_t>(structure_)].damage == "none")
      request_.tell(
          fmt::format("warning: structure.{}.damage = \"none\": forces are computed, but no damage class and "
                      "no probability "
                      "of one; write damage = \"concrete\" and run talus ensemble again",
                      request_.structure));
  }

  FragilityRequest request_;
  Ensemble ensemble_;
  int structure_ = 0;
  long finished_ = 0;
  std::vector<talus::Member> members_;  // of the structure
  std::vector<Event> events_;
  std::vector<Cluster> clusters_;
  std::vector<Task> tasks_;
};

}  // namespace

FragilityResult write_fragility(const FragilityRequest& request) { return Fragility(request).write(); }

}  // namespace talus::ensemble

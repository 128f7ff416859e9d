/// The run: a scene is read, a world is built from only the pieces that the scene needs, the world is
/// stepped, a sink writes.
///
/// `build()` (build.hpp) is the only place that decides what exists. A part that the scene does not need is
/// null and costs nothing: no structure, no structure module; no damage law, no history arrays; fixed terrain
/// and blocks, no DOFs; no strain asked for, 6 DOFs.
#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.hpp"
#include "sim/final_state.hpp"
#include "sim/frame.hpp"

namespace talus::sim {

/// Named plain arrays: a checkpoint. Restoring them gives the same bits as no stop.
struct Checkpoint {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::vector<std::int64_t>> integers;
  std::vector<std::string> fragment_names;
};

/// Where results go. All calls come in order of time from one thread.
class Sink {
 public:
  virtual ~Sink() = default;
  /// True if neither rows nor fields are wanted: they are not made.
  virtual bool quiet() const { return false; }
  /// Multiples of it are read off as well, for whoever watches the system; 0: none [s].
  virtual double watched_interval() const { return 0; }
  virtual void history(const HistoryRow&) {}
  virtual void contacts(std::span<const ContactRow>) {}
  /// Of several ranks all ask for the fields, and one writes them.
  virtual void field(double /*time*/, std::span<const Pose>, std::span<const Structure::Fields> structures) {
    for (const Structure::Fields& s : structures)
      for (const auto& part : {s.shape, s.values}) part([](const Structure::Snapshot&) {});
  }
  virtual void extend(std::span<const RunHeader::BlockInfo>) {}
  virtual void warning(const std::string& /*text*/) {}
  virtual void checkpoint(const Checkpoint&) {}
  /// After every macro step: t, duration, statistics, relative energy residual.
  virtual void progress(double /*time*/, double /*duration*/, const RunCounters&, double /*residual*/) {}
};

struct RunResult {
  std::string status =
      "done";  // done, at rest, all left (fell past all that could hold them), interrupted, failed
  std::string message;
  RunCounters counters;
  InterfaceAudit audit;
  bool audit_made = false;
  int exit_code = 0;
};

class World;   // world.hpp
class Shared;  // shared.hpp

class Simulation {
 public:
  /// Builds the world. Throws InputError with every problem found. `report` receives lines for the log.
  explicit Simulation(scene::Scene scene, std::function<void(const std::string&)> report = {});
  /// One of many that have `shared` in common. Its header has neither plan nor warnings.
  Simulation(scene::Scene scene, Shared& shared);
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  const RunHeader& header() const;
  const scene::Scene& scene() const;
  /// What is computed and what is left out and why, degrees of freedom, memory, time.
  std::vector<std::string> plan() const;
  /// Of the scene, of what was built from it, and of structures so fine that a touched second of them takes
  /// days.
  std::vector<Problem> warnings() const;
  /// What stepping, results and report hold beyond what stands after the building, at most [MB]; measured
  /// (docs/results/robustness.md).
  double memory_of_run() const;

  /// Runs to the end, to rest, or until `stop` is non-zero (a signal number).
  RunResult run(Sink& sink, const std::atomic<int>* stop = nullptr);

  Checkpoint save() const;
  void restore(const Checkpoint&);

  FinalState final_state() const;
  /// Halves the cells that were halved where blocks struck: the states of structures are of that mesh.
  void halve_cells_struck(const FinalState& state);
  /// Starts blocks and structures of the same names from `state` instead of the scene's own; t stays 0 and
  /// all works start from zero. Returns what was taken over, for the log. Throws InputError if nothing fits,
  /// a mesh differs, or bodies overlap then; `file` names the source in messages.
  std::vector<std::string> start_from(const FinalState& state, const std::string& file);
  double time() const;
  /// Names of the blocks that have left the model and fall for ever.
  std::vector<std::string> departed() const;

  World& world();
  /// In the order of the scene; null where the surface is fixed.
  std::vector<Structure*> structures();

 private:
  std::unique_ptr<World> world_;
};

}  // namespace talus::sim

/// An ensemble: many runs of one scene that differ in what is drawn, on one shared ground.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact/structures/structure.hpp"
#include "ensemble/design.hpp"
#include "ensemble/member.hpp"
#include "ensemble/path.hpp"
#include "ensemble/progress.hpp"
#include "ensemble/statistics.hpp"
#include "sim/shared.hpp"

namespace talus::ensemble {

/// A scene with [ensemble], ready to make members.
class Ensemble {
 public:
  /// Throws InputError for all that can be known before the first member runs.
  Ensemble(const std::string& scene, const scene::Overrides& overrides);

  const scene::Ensemble& settings() const { return settings_; }
  const Design& design() const { return design_; }
  const std::vector<PlanLine>& lines() const { return lines_; }
  const std::vector<std::string>& blocks() const {
    return blocks_;
  }  // of the first member, as results list them
  const std::vector<std::string>& structures() const { return structures_; }
  /// Piers, columns and spans of each of them, to be named with the hits; none where the structures are
  /// drawn.
  const std::vector<std::vector<talus::Member>>& structure_members() const { return structure_members_; }
  const std::vector<Problem>& warnings() const { return warnings_; }
  const std::string& identity() const { return identity_; }
  const std::string& crs() const { return crs_; }
  const std::string& title() const { return title_; }
  const Vec3& origin() const { return origin_; }
  /// Of the ground in plan, NaN off it.
  double height(double x, double y) const { return height_(x, y); }
  std::vector<std::filesystem::path> inputs() const;
  /// What will be drawn and counted, a line each: the part of `talus check` that a plain run has not.
  std::vector<std::string> plan() const;

  /// Runs a member; nothing if `stop` became non-zero. From any thread.
  std::optional<Member> run(long index, const std::atomic<int>* stop);
  /// The member's scene, as a file that `talus run` repeats it from.
  std::string scene_file(long index, const std::string& comment) const;
  /// The whole scene with absolute paths.
  std::string whole_scene() const { return template_->whole_toml(); }
  /// The member's scene with the coupling that the file asks for, not that of the ensemble. Throws
  /// InputError.
  scene::Scene coupled_scene(long index) const;
  /// The member's world, not yet started. Throws InputError.
  std::unique_ptr<sim::Simulation> simulation(long index);

 private:
  scene::Overrides overrides(long index) const;
  void check_lines();
  void try_members();
  void warn_of_what_is_not_drawn(const scene::Scene& provisional);

  std::unique_ptr<scene::Template> template_;
  scene::Ensemble settings_;
  Design design_;
  bool was_rigid_ = false;               // so the file says
  scene::Overrides forced_;              // what every member's scene takes
  std::unique_ptr<sim::Shared> shared_;  // between members
  std::vector<PlanLine> lines_;
  std::vector<std::string> blocks_, structures_;
  std::vector<std::vector<talus::Member>> structure_members_;
  std::vector<Problem> warnings_;
  std::string identity_, crs_, file_, title_;
  scene::Overrides given_;  // on the command line
  Vec3 origin_ = Vec3::Zero();
  std::vector<std::pair<std::string, std::string>> files_;
  std::vector<Plane> planes_;
  std::shared_ptr<const geometry::Terrain> ground_;  // for places and lines
  GroundHeight height_;
  bool shares_ground_ = true, shares_structures_ = true;
};

struct Run {
  std::filesystem::path directory;
  int threads = 1;
  int rank = 0, ranks = 1;
  std::function<void()> meet;                     // waits for the other ranks
  std::function<void(const Progress&)> progress;  // from any thread, one at a time
  const std::atomic<int>* stop = nullptr;
};

/// Runs the members that the directory's journals do not hold yet. Returns the number of members that there
/// are then, 0 if it was stopped.
long run_members(Ensemble& ensemble, const Run& run);

/// How many members the directory's journals hold, of those that the ensemble asks for.
long kept_members(const Ensemble& ensemble, const std::filesystem::path& directory);

}  // namespace talus::ensemble

/// What a member's blocks pass and strike on their way, from their states at the ends of the macro steps of
/// its run and, where that is not enough, from states within: no step of the run ends because of a line, and
/// no output interval matters.
///
/// Within a macro step in free flight the path is the parabola through both states, and the time at a line
/// follows in closed form. Else the macro step is made again in pieces of at most 1 ms; within a piece the
/// path is the cubic through both states (Hermite), its place on the line is found by bisection, and the
/// state there is computed by steps to that very time.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "ensemble/member.hpp"
#include "sim/simulation.hpp"

namespace talus::ensemble {

/// A line as segments in plan.
struct PlanLine {
  std::string name;
  std::vector<std::vector<Eigen::Vector2d>> parts;  // scene coordinates
  bool of_file = false;                             // GeoJSON, in map coordinates there
  std::vector<Problem> warnings;                    // of its file
};

/// Where there is terrain, in scene coordinates [m].
struct GroundExtent {
  Box3 box;         // empty: there is none
  double cell = 0;  // of its grid, whose nodes are cell centres; 0: a mesh
};

/// Height of the ground; NaN where there is none.
using GroundHeight = std::function<double(double x, double y)>;

/// The scene's lines; those of files in scene coordinates. Throws InputError for a file that cannot be read,
/// or of another coordinate system than `crs`
/// (geometry::agree_on_crs).
std::vector<PlanLine> plan_lines(const scene::Scene& scene, std::string& crs);
/// Errors for lines that lie off the ground, warnings for those that go beyond it by more than half a cell of
/// its grid, up to which the land is known. `origin`: of the scene, map coordinates.
std::vector<Problem> line_problems(const std::vector<PlanLine>& lines, const GroundHeight& height,
                                   const GroundExtent& ground, const std::string& file, const Vec3& origin);
/// The lines of a scene that was built, with the warnings of them. Throws InputError as the two above.
std::vector<PlanLine> checked_lines(sim::Simulation& simulation, std::vector<Problem>& warnings);

/// Maps split the path of a macro step with contact at one blow in each part of this length [s]. Whoever runs
/// the simulation has multiples of it read off (sim::Sink::watched_interval).
inline constexpr double map_interval = 5e-3;

class Path {
 public:
  /// `origin`: map coordinates of the scene's origin. `cell` 0: no maps.
  Path(sim::Simulation& simulation, const std::vector<PlanLine>& lines, GroundHeight ground,
       const Vec3& origin, double cell);
  ~Path();
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;

  /// The crossings since the last call, in order of time.
  std::vector<Crossing> take_crossings();
  /// Crossings, hits and cells so far go into the member.
  void finish(Member& member);
  /// Called after each macro step.
  std::function<void()> after;

 private:
  class Watcher;
  std::unique_ptr<Watcher> watcher_;
};

}  // namespace talus::ensemble

/// Drift correction: closed hard contacts to gap >= 0 and fixed points to their places (theory:
/// docs/theory/contact.md, (4)).
#pragma once
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "coupling/rows/assembly.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/solution/problem_solver.hpp"

namespace talus::coupling {

class DriftCorrection {
 public:
  DriftCorrection(const IslandContext& in, Step& step, IslandReport& report, ContactSearch& search,
                  RowAssembly& assembly, ProblemSolver& solver);
  /// Of the present state, with the touches within the reach of h; its energy is accounted for. The deepest
  /// overlap left [m].
  double correct(double h);

 private:
  /// The largest depth that the motion of the step can explain, of pairs of blocks with a hollow: by partner
  /// and block [m].
  std::map<std::pair<std::uint64_t, int>, double> deepest_by_motion() const;
  /// Clusters that nothing fixed holds keep their centre of mass; of each body, what its spin gives back for
  /// its way.
  std::vector<Vec3> moments_of_way();
  void find_scales(double h);
  /// Gap that a contact may keep [m]: it closes by no more than its bodies have moved in the step, into a
  /// structure by a part of that. What is deeper, a feature that was hidden until now, takes several steps.
  double kept(const Touch& t) const;
  /// By how much it is to be closed, a bond both ways [m].
  double drift_of(const Touch& t) const;
  bool believed(const Touch& t) const;
  void measure();  // the deepest overlap and the farthest fixed point
  contact::SolveReport solve();
  void move();  // bodies by the solution

  const IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  ContactSearch& search_;
  RowAssembly& assembly_;
  ProblemSolver& solver_;
  double thinnest_ = 0, tolerance_ = 0;  // least width of a block, overlap that is none [m]
  double deepest_ = 0, drifted_ = 0;     // overlap to be closed, way of a fixed point from its place [m]
  double overlap_ = 0;                   // of all that is believed, closed or not [m]
  double inside_ = 0, shows_ = 0;        // overlap with a structure, and what of it is left [m]
  std::map<std::pair<std::uint64_t, int>, double> deepest_of_;
  std::vector<double> allowed_;  // ways that the correction may still take, per body [m]
  double recovery_ = 0;          // of an overlap with a structure, in this pass [m]
  std::vector<Pose> last_;       // of the bodies before a pass
};

}  // namespace talus::coupling

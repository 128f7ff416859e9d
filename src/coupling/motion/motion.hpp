/// The motion of blocks as a function of time: one piece per block and step, which rows are read off. No step
/// ends because of a row.
///
/// Between the state after the impulses at the start of a step (index 0) and the state at its end (index 1),
/// s = t - t0, h = t1 - t0, r = s / h:
///
///   flight     c0 + s v0 + s^2 g / 2,  v0 + s g,  torque-free rotation of a rigid block that nothing
///   touches;
///              in vegetation the closed form with drag (dda/kinematics.hpp)
///   trapezoid  c = c0 + s v0 + s^2 (v1 - v0) / (2 h) + r^2 (3 - 2 r) d,  v = v0 + r (v1 - v0),
///              d = c1 - c0 - h (v0 + v1) / 2; with drag the way of the constant force that leads to v1
///   straight   c = c0 + r (c1 - c0),  v = v0 + r (v1 - v0): impulses act at the start, or the way is that of
///   the
///              end's velocity; momenta go with the loads, and no row has more energy than the ends
///
/// d is what the step moved a block beyond the trapezoidal rule (drift correction). A rotation vector about
/// q0 takes the place of c, and of v the angular momentum about the centroid, which gives the spin at the
/// orientation reached. Strains go straight from start to end, their rates as v: their energy lies between
/// that of both ends also where the step does not resolve the vibration. Continuous at both ends, of second
/// order between them; limits: decided by the states at the ends alone, not by each contact.
#pragma once
#include <limits>
#include <span>
#include <vector>

#include "coupling/environment.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

/// Largest of a block over the steps that it took.
struct MotionPeaks {
  double speed = 0, spin = 0, kinetic = 0;  // of the centroid [m/s], [rad/s], [J]
  /// Returns the kinetic energy of `state` [J].
  double add(const dda::Model::Block& block, const dda::BlockState& state);
  void add(const MotionPeaks& other);
};

struct MotionSegment {
  enum class Path : char { flight, trapezoid, straight };
  int block = 0;
  Path path = Path::trapezoid;
  double t0 = 0, t1 = 0;       // [s]
  dda::BlockState start, end;  // after impulses of no duration at t0; at t1
  double drag = 0;             // eta/m [1/s]
};

/// The path is that of flight if the end is where free flow leads from the start, straight where all impulses
/// act at the start, else by the rule that the displacement of the centroid agrees with.
MotionSegment motion_segment(const dda::Model& model, int block, double t0, double t1,
                             const dda::BlockState& start, const dda::BlockState& end,
                             bool all_at_start = false, double drag = 0);

/// The block at t in [t0, t1]: at t1 and later the end, to the bit.
dda::BlockState evaluate(const MotionSegment& segment, double t, const dda::Model& model);

/// Works of an island over a step; `contact` is what its springs store then.
struct WorkSegment {
  double t0 = 0, t1 = 0;  // [s]
  Ledger before, after;   // works since the start of the interval that the island is advanced over [J]
  double energy_before = 0, energy_after = 0;  // kinetic, potential and strain of its blocks [J]
};

/// Works at t, where the island's blocks have this energy: what they lack of it by then has been done, in the
/// proportions of the whole step. What is given on the way and taken back by the end is stored in springs, if
/// there are any; the rest, the error of what is read between the ends, is `algorithmic`.
Ledger evaluate(const WorkSegment& segment, double t, double energy);

/// What an island did over an interval of time, as far as rows fall into it.
struct IslandMotion {
  /// The interval: open at its start, and without an end where the island goes to the end of the stretch [s].
  double t0 = -std::numeric_limits<double>::infinity(), t1 = std::numeric_limits<double>::infinity();
  Ledger done;                          // works over all of it; `contact` unused
  std::vector<int> blocks;              // of the island
  std::vector<MotionSegment> segments;  // in the order of time for each block
  std::vector<WorkSegment> works;       // in the order of time
};

/// True if one of the times (ascending) lies in (t0, t1]: a row falls into the step.
bool falls_into(std::span<const double> times, double t0, double t1);

}  // namespace talus::coupling

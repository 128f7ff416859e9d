// The correction of positions after a step is a correction of drift, or the step is not taken.
//
// Rows hold velocities; positions drift from them by the square of the step, and are corrected after it
// (island_project.cpp). Two bodies can have come into each other by no more than they moved against each
// other in the step, beside what they were in each other at its start:
//
//   |d_i| <= L_i (max over partners j of (s_i + s_j) + sum over pairs of o)
//   s = |c_np - c_n| + r |F_np - F_n| + g h^2,   L = (1 + (1 + r^2/k^2)^(1/2)) / 2
//
// beside an overlap of 1e-9 of the block size on either side, contact::tolerances().overlap_none. L: a
// contact that is moved by d, with a lever about the centroid, moves no point of its block farther than L d.
//
// symbol   meaning                                                                   unit
// d_i      farthest way of a point of body i by the correction                       m
// s        way of its farthest point in the step, and what a fall may have added     m
//          (of a structure that of its skin)
// r, k     radius of the block; its largest radius of gyration                       m
// o        deepest overlap of a pair's hard contacts at the start of the step        m
//
// A correction beyond that answers to no motion: contact rows that contradict each other, of concave scans
// wedged between faces of terrain, say, have solutions of any size. Drift falls with the square of the step
// and motion with the step, so that the step is tried again halved.
#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"

namespace talus::coupling {

double sum_of_overlaps(const Step& step) {
  double sum = 0, deepest = 0;
  for (std::size_t i = 0; i < step.touches.size(); ++i) {  // in the order of the pairs
    const Touch& t = step.touches[i];
    if (t.stiffness == 0) deepest = std::max(deepest, -t.at.gap);
    if (i + 1 < step.touches.size() && step.touches[i + 1].a == t.a && step.touches[i + 1].b == t.b) continue;
    sum += std::exchange(deepest, 0.0);
  }
  return sum;
}

void IslandStepper::keep_for_drift() {
  before_drift_.ledger = report_.ledger;
  before_drift_.counters = report_.counters;
  before_drift_.audit = report_.audit;
  before_drift_.rows = report_.rows.size();
  before_drift_.works = report_.motion.works.size();
  before_drift_.segments = report_.motion.segments.size();
  before_drift_.impacts = impacts_on_skin_;
  before_drift_.memory.resize(step_.bodies.size());
  before_drift_.poses.resize(step_.bodies.size());
  step_.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step_.bodies.data());
    before_drift_.memory[i] = in_.history[static_cast<std::size_t>(b.block)];
    before_drift_.poses[i] = dda::pose(in_.state, b.block);
  });
}

/// All is as at the start of the step.
void IslandStepper::take_back() {
  report_.ledger = before_drift_.ledger;
  report_.counters = before_drift_.counters;
  report_.audit = before_drift_.audit;
  report_.rows.resize(before_drift_.rows);
  report_.motion.works.resize(before_drift_.works);
  report_.motion.segments.resize(before_drift_.segments);
  impacts_on_skin_ = before_drift_.impacts;
  step_.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step_.bodies.data());
    in_.history[static_cast<std::size_t>(b.block)].swap(before_drift_.memory[i]);
  });
  reject();
}

namespace {

/// Farthest way of a point of a block over that of the contact that moves it: the greatest of (k^2 + a
/// r)/(k^2 + a^2) over levers a.
double lever(const dda::Model::Block& block) {
  const double gyration_sq =
      Eigen::SelfAdjointEigenSolver<Mat3>(block.inertia, Eigen::EigenvaluesOnly).eigenvalues()[2] /
      block.mass;
  return 0.5 * (1 + std::sqrt(1 + block.shape->radius * block.shape->radius / gyration_sq));
}

/// Way of the farthest point of a body between two of its poses [m].
double farthest_way(const IslandContext& in, const Body& body, const Pose& from, const Pose& to) {
  return (to.c - from.c).norm() +
         in.model.blocks[static_cast<std::size_t>(body.block)].shape->radius * (to.F - from.F).norm();
}

}  // namespace

bool IslandStepper::drift_beyond_motion(double h) const {
  const double fall = h * h * in_.model.gravity.norm();
  std::vector<double> way(step_.bodies.size()), allowed(step_.bodies.size());
  bool corrected = false;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const dda::BlockState& start = step_.saved[i];
    const Pose from{start.c, start.q.toRotationMatrix() * (Mat3::Identity() + dda::strain_tensor(start.eps))};
    way[i] = allowed[i] = farthest_way(in_, step_.bodies[i], from, before_drift_.poses[i]) + fall;
    allowed[i] += 2 * contact::tolerances().overlap_none *
                  in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)].shape->radius;
    corrected =
        corrected || before_drift_.poses[i].c != in_.state.c[static_cast<std::size_t>(step_.bodies[i].block)];
  }
  if (!corrected) return false;
  const double skins =
      in_.island->structures.empty()
          ? 0
          : 2 * h * in_.fastest_skin();  // twice, since the start of the step may have been faster
  for (const CandidatePair& pair : in_.island->pairs) {
    if (pair.a.kind == Partner::Kind::structure) {
      if (const int b = in_.local[static_cast<std::size_t>(pair.b)]; b >= 0)
        allowed[static_cast<std::size_t>(b)] =
            std::max(allowed[static_cast<std::size_t>(b)], way[static_cast<std::size_t>(b)] + skins);
    }
    if (pair.a.kind != Partner::Kind::block) continue;
    const int a = in_.local[static_cast<std::size_t>(pair.a.index)],
              b = in_.local[static_cast<std::size_t>(pair.b)];
    if (a < 0 || b < 0) continue;
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    allowed[i] = std::max(allowed[i], way[i] + way[j]);
    allowed[j] = std::max(allowed[j], way[i] + way[j]);
  }
  for (std::size_t i = 0; i < step_.bodies.size(); ++i)
    if (farthest_way(in_, step_.bodies[i], before_drift_.poses[i],
                     dda::pose(in_.state, step_.bodies[i].block)) >
        lever(in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)]) *
            (allowed[i] + before_drift_.overlaps))
      return true;
  return false;
}

}  // namespace talus::coupling

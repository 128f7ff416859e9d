// The correction of positions after a step is a correction of drift, or the step is not taken.
//
// Rows hold velocities; positions drift from them by the square of the step, and are corrected after it
// (drift_correction.hpp). Two bodies can have come into each other by no more than they moved against each
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
#include "coupling/drift/drift_guard.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/events/structure_impacts.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/step.hpp"

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

DriftGuard::DriftGuard(const IslandContext& in, Step& step, IslandReport& report, StructureImpacts& impacts)
    : in_(in), step_(step), report_(report), impacts_(impacts) {}

void DriftGuard::begin_step() { before_.overlaps = sum_of_overlaps(step_); }

void DriftGuard::keep() {
  before_.ledger = report_.ledger;
  before_.counters = report_.counters;
  before_.audit = report_.audit;
  before_.rows = report_.rows.size();
  before_.works = report_.motions.front().works.size();
  before_.segments = report_.motions.front().segments.size();
  before_.impacts = impacts_.pending();
  before_.memory.resize(step_.bodies.size());
  before_.poses.resize(step_.bodies.size());
  step_.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step_.bodies.data());
    before_.memory[i] = in_.history[static_cast<std::size_t>(b.block)];
    before_.poses[i] = dda::pose(in_.state, b.block);
  });
}

void DriftGuard::revert() {
  report_.ledger = before_.ledger;
  report_.counters = before_.counters;
  report_.audit = before_.audit;
  report_.rows.resize(before_.rows);
  report_.motions.front().works.resize(before_.works);
  report_.motions.front().segments.resize(before_.segments);
  impacts_.restore(before_.impacts);
  step_.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step_.bodies.data());
    in_.history[static_cast<std::size_t>(b.block)].swap(before_.memory[i]);
  });
  reject_step(in_, step_, report_);
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

}  // namespace

bool DriftGuard::beyond_motion(double h) {
  const double fall = h * h * in_.model.gravity.norm();
  std::vector<double> way(step_.bodies.size()), allowed(step_.bodies.size());
  bool corrected = false;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const dda::BlockState& start = step_.saved[i];
    const Pose from{start.c, start.q.toRotationMatrix() * (Mat3::Identity() + dda::strain_tensor(start.eps))};
    way[i] = allowed[i] = farthest_way(in_.model, step_.bodies[i].block, from, before_.poses[i]) + fall;
    allowed[i] += 2 * contact::tolerances().overlap_none *
                  in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)].shape->radius;
    corrected =
        corrected || before_.poses[i].c != in_.state.c[static_cast<std::size_t>(step_.bodies[i].block)];
  }
  if (!corrected) return false;
  const double skins =
      in_.island->structures.empty()
          ? 0
          : 2 * h * in_.fastest_surface();  // twice, since the start of the step may have been faster
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
  worst_ = {};
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const int block = step_.bodies[i].block;
    const double went = farthest_way(in_.model, block, before_.poses[i], dda::pose(in_.state, block)),
                 explained = lever(in_.model.blocks[static_cast<std::size_t>(block)]) *
                             (allowed[i] + before_.overlaps);
    if (went - explained > worst_.way - worst_.explained) worst_ = {block, went, explained};
  }
  return worst_.way > worst_.explained;
}

void DriftGuard::account_gains() {
  const Ledger &before = before_.ledger, &after = report_.ledger;
  Counters& n = report_.counters;
  const double made = before.algorithmic - after.algorithmic;
  if (made > 0) {
    n.gained += made;
    n.worst_gain = std::max(n.worst_gain, made);
  }
  for (const double undone :
       {before.friction_work - after.friction_work, before.damping_work - after.damping_work,
        before.yield_work - after.yield_work, before.ploughing_work - after.ploughing_work})
    n.undone += std::max(0.0, undone);
}

}  // namespace talus::coupling

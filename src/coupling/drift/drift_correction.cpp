// Drift correction: closed hard contacts to gap >= 0 and fixed points to their places, its energy accounted
// for.
#include "coupling/drift/drift_correction.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "contact/tolerances.hpp"
#include "coupling/drift/moved_moments.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/rows/assembly.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/rows/spring_rows.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/update.hpp"

namespace talus::coupling {

DriftCorrection::DriftCorrection(const IslandContext& in, Step& step, IslandReport& report,
                                 ContactSearch& search, RowAssembly& assembly, ProblemSolver& solver)
    : in_(in), step_(step), report_(report), search_(search), assembly_(assembly), solver_(solver) {}

std::vector<Vec3> DriftCorrection::moments_of_way() {
  std::vector<MovedBody> moved(step_.bodies.size());
  std::vector<MovedPair> pairs;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step_.bodies[i].block);
    moved[i] = {in_.model.blocks[k].mass, !in_.model.blocks[k].fixed_points.empty(),
                Eigen::Map<const Vec3>(step_.problem.v.data() + step_.problem.bodies[i].offset),
                in_.state.v[k]};
  }
  for (const Touch& t : step_.touches) {
    if (t.row < 0 || step_.problem.contacts[static_cast<std::size_t>(t.row)].impulse.isZero(0)) continue;
    const auto a = static_cast<std::size_t>(t.a.index);
    const int partner = t.a.kind == Partner::Kind::block ? in_.local[a]
                        : in_.deformable_structure(t) && in_.env.structures[a].structure->free()
                            ? MovedPair::free_structure
                            : MovedPair::fixed;
    pairs.push_back({partner, in_.local[static_cast<std::size_t>(t.b)]});
  }
  const std::vector<Vec3> moments = keep_momenta(moved, pairs);
  for (std::size_t i = 0; i < step_.bodies.size(); ++i)
    Eigen::Map<Vec3>(step_.problem.v.data() + step_.problem.bodies[i].offset) = moved[i].way;
  return moments;
}

std::map<std::pair<std::uint64_t, int>, double> DriftCorrection::deepest_by_motion() const {
  constexpr double known_before =
      0.05;  // of the block size: what earlier projections of over-constrained blocks may have left
  std::map<std::pair<std::uint64_t, int>, double> bounds;
  for (const CandidatePair& pair : in_.island->pairs) {
    if (pair.a.kind != Partner::Kind::block) continue;
    const Polyhedron &a = *in_.model.blocks[static_cast<std::size_t>(pair.a.index)].shape,
                     &b = *in_.model.blocks[static_cast<std::size_t>(pair.b)].shape;
    if (!a.convex || !b.convex)
      bounds[{pair.a.id(), pair.b}] =
          2 * StepMotion(in_, step_, true).path(pair) + known_before * std::min(a.inradius, b.inradius);
  }
  return bounds;
}

void DriftCorrection::find_scales(double h) {
  double far = 0;
  thinnest_ = in_.scale.length;
  for (const Body& b : step_.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    thinnest_ = std::min(thinnest_, 2 * in_.model.blocks[k].shape->inradius);
    far = std::max(far, in_.state.c[k].cwiseAbs().maxCoeff() + in_.model.blocks[k].shape->radius);
  }
  tolerance_ = 0.5 * std::max(contact::tolerances().drift * thinnest_, contact::tolerances().far_off * far);
  shows_ = std::max(tolerance_,
                    contact::tolerances().drift_at_structures * in_.settings.accuracy * 0.5 * thinnest_);
  deepest_of_ = deepest_by_motion();
  allowed_.clear();
  for (const Body& b : step_.bodies)
    allowed_.push_back(farthest_way(in_.model, b.block, b.start, dda::pose(in_.state, b.block)) +
                       h * h * in_.model.gravity.norm());
  recovery_ = contact::tolerances().recovery * h * step_.fastest;
}

double DriftCorrection::kept(const Touch& t) const {
  if (t.at.gap >= 0 || t.holds()) return 0;
  if (in_.deformable_structure(t)) return std::max(t.at.gap, std::min(-shows_, t.at.gap + recovery_));
  double way = 0;
  for (const int block : {t.b, t.a.kind == Partner::Kind::block ? t.a.index : -1}) {
    const int l = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)];
    if (l >= 0) way += allowed_[static_cast<std::size_t>(l)];
  }
  return std::min(0.0, t.at.gap + std::max(0.0, way));
}

/// Of pieces with hollows a feature can look as deep as the piece is wide, though the two have hardly moved:
/// corrected along it, they would fly into others.
bool DriftCorrection::believed(const Touch& t) const {
  if (t.stiffness > 0 || t.b < 0) return false;
  if (in_.deformable_structure(t)) return in_.leapfrog() && !t.holds();
  const auto bound = deepest_of_.find({t.a.id(), t.b});
  return bound == deepest_of_.end() || -t.at.gap <= bound->second;
}

double DriftCorrection::drift_of(const Touch& t) const {
  return t.holds() ? std::abs(t.at.gap) : kept(t) - t.at.gap;
}

void DriftCorrection::measure() {
  std::atomic<double> deepest = 0, overlap = 0, inside = 0;  // the largest: the same in whatever order
  const auto raise = [](std::atomic<double>& largest, double here) {
    for (double most = largest.load(std::memory_order_relaxed);
         here > most && !largest.compare_exchange_weak(most, here, std::memory_order_relaxed);) {}
  };
  contact::in_ranges(static_cast<int>(step_.touches.size()), touches_at_once, [&](int from, int to) {
    double corrects = 0, overlaps = 0, depth = 0;
    for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i) {
      const Touch& t = step_.touches[i];
      if (!believed(t)) continue;
      overlaps = std::max(overlaps, t.holds() ? std::abs(t.at.gap) : -t.at.gap);
      if (in_.deformable_structure(t))
        depth = std::max(depth, -t.at.gap);
      else
        corrects = std::max(corrects, drift_of(t));
    }
    raise(deepest, corrects);
    raise(overlap, overlaps);
    raise(inside, depth);
  });
  deepest_ = deepest.load();
  overlap_ = overlap.load();
  inside_ = inside.load();
  drifted_ = 0;
  each_drift(in_.model, in_.state, step_.bodies,
             [&](const Vec3& drift) { drifted_ = std::max(drifted_, drift.norm()); });
}

/// min 1/2 d^T (M/m) d  subject to  g + J d >= 0 on every hard contact near enough to matter, x + J d = place
/// of every fixed point; no friction, no velocity.
contact::SolveReport DriftCorrection::solve() {
  begin_step(in_, step_, 0, true);
  for (Body& b : step_.bodies) {
    const dda::Model::Block& block = in_.model.blocks[static_cast<std::size_t>(b.block)];
    // How far fixed points of one block are from each other is for its strains to keep.
    if (block.deformable && block.fixed_points.size() >= 2) {
      b.ndof = 12;
      dda::impulse_mass(in_.model, in_.state, b.block, false, b.free.mass, b.free.inverse);
    }
    b.free.mass /= block.mass;
    b.free.inverse *= block.mass;
  }
  assembly_.begin_correction();
  // Of a time-stepped island only what is as near as a column of blocks could move becomes a row.
  const double near = contact::tolerances().drift_near * in_.scale.length,
               within = 4 * std::max(deepest_, recovery_) +
                        (in_.time_stepped() ? std::min(near, 100 * deepest_) : near);
  std::vector<char> taken(step_.touches.size(), 0);
  step_.each_touch([&](Touch& t) {
    t.row = -1;
    if (!believed(t) || (t.at.gap > within && !t.holds())) return;
    t.mode = Mode::idle;
    taken[static_cast<std::size_t>(&t - step_.touches.data())] = 1;
  });
  for (std::size_t i = 0; i < step_.touches.size(); ++i)
    if (taken[i] != 0) assembly_.take(step_.touches[i], 1, true);
  assembly_.fill_rows(1, true);
  const double most = std::max({deepest_, drifted_, recovery_});
  step_.each_touch([&](const Touch& t) {
    if (t.row < 0) return;
    contact::ProblemContact& c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
    c.friction = 0;
    c.cohesion = 0;
    c.tension = t.holds() ? 1e6 * most : 0;
    const double beyond = t.at.gap - kept(t);
    c.bias = Vec3(beyond - (beyond < -tolerance_ ? contact::tolerances().bound_aim * tolerance_ : 0), 0, 0);
    // Between sides that cannot both be left no way is large enough: at a structure half of it is gone.
    c.compliance.setConstant(in_.deformable_structure(t) ? normal_compliance(in_, step_, c) : 0.0);
    c.impulse.setZero();
  });
  std::size_t held = step_.problem.contacts.size();
  add_held_rows(step_.problem, in_.model, step_.bodies, 0, 1e6 * most);
  each_drift(in_.model, in_.state, step_.bodies,
             [&](const Vec3& drift) { step_.problem.contacts[held++].bias = drift; });
  assembly_.finish_bodies();
  std::fill(step_.problem.v_hat.begin(), step_.problem.v_hat.end(), 0.0);
  contact::SolveSettings settings;
  settings.velocity_scale = most;
  // A correction by d turns normals by d / L: from far off the next pass is closer than this one could be.
  settings.tolerance = std::clamp(0.2 * tolerance_ / most, in_.time_stepped() ? 1e-5 : 1e-3, 0.2);
  settings.sufficient = 0.3;  // of over-constrained blocks: the next pass goes on from there
  settings.exact_coulomb = false;
  const contact::SolveReport r = solver_.solver().solve(step_.problem, settings);
  report_.counters.newton += r.newton;
  return r;
}

void DriftCorrection::move() {
  const std::vector<Vec3> moments = moments_of_way();
  std::vector<double> fall(step_.bodies.size(), 0.0), turning(step_.bodies.size(), 0.0);  // [J]
  step_.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step_.bodies.data());
    last_[i] = b.start;
    const Eigen::Map<const VecX> d(step_.problem.v.data() + step_.problem.bodies[i].offset, b.ndof);
    if (d.isZero(0)) return;
    const auto k = static_cast<std::size_t>(b.block);
    const Vec3 momentum = dda::spin_momentum(in_.model.blocks[k], in_.state, b.block);
    const double before_it = in_.internal_energy(b.block);
    in_.state.c[k] += d.head<3>();
    in_.state.q[k] = (dda::rotation_by(d.segment<3>(3)) * in_.state.q[k]).normalized();
    if (b.strains()) in_.state.eps[k] += d.tail<6>();
    allowed_[i] -= farthest_way(in_.model, b.block, last_[i], dda::pose(in_.state, b.block));
    fall[i] = in_.model.blocks[k].mass * in_.model.gravity.dot(d.head<3>());
    set_spin(in_, b.block, momentum - moments[i], in_.model.blocks[k].deformable);
    turning[i] = in_.internal_energy(b.block) - before_it;
  });
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    report_.ledger.algorithmic += fall[i];
    report_.ledger.algorithmic -= turning[i];
  }
}

double DriftCorrection::correct(double h) {
  find_scales(h);
  search_.find(h);
  search_.keep_late_overlaps();
  measure();
  // Sub-steps at a structure drift by a ten-millionth of a block each: corrected once it shows, to a tenth of
  // that.
  const double shows = in_.leapfrog() ? shows_ : tolerance_;
  if (deepest_ <= shows && drifted_ <= shows && inside_ <= shows_) return overlap_;
  const double left = in_.leapfrog() ? std::max(tolerance_, 0.1 * shows) : tolerance_;
  std::vector<double> carried(in_.island->pairs.size(), 0.0);
  last_.resize(step_.bodies.size());
  double least = std::max(deepest_, drifted_);  // so far
  int fruitless = 0;  // passes in a row that did not halve it, those without a solution twice:
                      // over-constrained bodies stay in each other
  for (int pass = 0; pass < 24 && fruitless < 4; ++pass) {
    if (pass > 0 && std::max(deepest_, drifted_) <= left) {
      // What went along with its blocks tells of the features that were near before, not of what they have
      // been moved into.
      if (!search_.carried()) break;
      step_.found_for = -1;
      search_.find(h);
      std::fill(carried.begin(), carried.end(), 0.0);
      measure();
      if (std::max(deepest_, drifted_) <= left) break;
    }
    ++report_.counters.projections;
    const contact::SolveReport r = solve();
    if (!std::all_of(step_.problem.v.begin(), step_.problem.v.end(),
                     [](double d) { return std::isfinite(d); }))
      break;  // nothing to go by
    move();
    recovery_ = 0;
    search_.find_moved(last_, carried);
    measure();
    fruitless = std::max(deepest_, drifted_) < 0.5 * least ? 0 : fruitless + (r.converged ? 1 : 2);
    least = std::min(least, std::max(deepest_, drifted_));
  }
  if (search_.carried()) step_.found_for = -1;
  return overlap_;
}

}  // namespace talus::coupling

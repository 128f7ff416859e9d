// The drift of closed hard contacts led back to gap >= 0 and that of fixed points to their places, its energy
// booked.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"
#include "coupling/moved_moments.hpp"

namespace talus::coupling {

/// Clusters that nothing fixed holds keep their centre of mass; of each body, what its spin gives back for
/// its way.
std::vector<Vec3> IslandStepper::moments_of_way() {
  std::vector<MovedBody> moved(bodies_.size());
  std::vector<MovedPair> pairs;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto k = static_cast<std::size_t>(bodies_[i].block);
    moved[i] = {model_.blocks[k].mass, !model_.blocks[k].fixed_points.empty(),
                Eigen::Map<const Vec3>(problem_.v.data() + problem_.bodies[i].offset), state_.v[k]};
  }
  for (const Touch& t : touches_) {
    if (t.row < 0 || problem_.contacts[static_cast<std::size_t>(t.row)].impulse.isZero(0)) continue;
    pairs.push_back({t.a.kind == Partner::Kind::block ? local_[static_cast<std::size_t>(t.a.index)] : -1,
                     local_[static_cast<std::size_t>(t.b)]});
  }
  const std::vector<Vec3> moments = keep_momenta(moved, pairs);
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    Eigen::Map<Vec3>(problem_.v.data() + problem_.bodies[i].offset) = moved[i].way;
  return moments;
}

/// The largest depth that the motion of the step can explain, of pairs of blocks with a hollow: by partner
/// and block [m].
std::map<std::pair<std::uint64_t, int>, double> IslandStepper::deepest_by_motion() const {
  constexpr double known_before =
      0.05;  // of the block size: what earlier projections of jammed blocks may have left
  std::map<std::pair<std::uint64_t, int>, double> bounds;
  for (const CandidatePair& pair : island_->pairs) {
    if (pair.a.kind != Partner::Kind::block) continue;
    const Polyhedron &a = *model_.blocks[static_cast<std::size_t>(pair.a.index)].shape,
                     &b = *model_.blocks[static_cast<std::size_t>(pair.b)].shape;
    if (!a.convex || !b.convex)
      bounds[{pair.a.id(), pair.b}] = 2 * path(pair) + known_before * std::min(a.inradius, b.inradius);
  }
  return bounds;
}

double IslandStepper::project(double h) {
  // min 1/2 d^T (M/m) d  subject to  g + J d >= 0 on every hard touch near enough to matter, x + J d = place
  // of every fixed point; no friction, no velocity.
  double thinnest = length_, far = 0;
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    thinnest = std::min(thinnest, 2 * model_.blocks[k].shape->inradius);
    far = std::max(far, state_.c[k].cwiseAbs().maxCoeff() + model_.blocks[k].shape->radius);
  }
  const double tolerance = std::max(0.5 * contact::tolerances().drift * thinnest, 5e-16 * far);
  const std::map<std::pair<std::uint64_t, int>, double> deepest_of = deepest_by_motion();
  // Of pieces with hollows a feature can look as deep as the piece is wide, though the two have hardly moved:
  // led back along it, they would fly into others.
  const auto believed = [&](const Touch& t) {
    if (t.stiffness > 0 || deformable_structure(t)) return false;
    const auto bound = deepest_of.find({t.a.id(), t.b});
    return bound == deepest_of.end() || -t.at.gap <= bound->second;
  };
  const auto deepest_touch = [&] {
    std::atomic<double> deepest = 0;  // the largest: the same in whatever order
    contact::in_ranges(static_cast<int>(touches_.size()), touches_at_once, [&](int from, int to) {
      double here = 0;
      for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i)
        if (const Touch& t = touches_[i]; believed(t)) here = std::max(here, -t.at.gap);
      for (double most = deepest.load(std::memory_order_relaxed);
           here > most && !deepest.compare_exchange_weak(most, here, std::memory_order_relaxed);) {}
    });
    return deepest.load();
  };
  const auto farthest_point = [&] {
    double farthest = 0;
    each_drift(model_, state_, bodies_,
               [&](const Vec3& drift) { farthest = std::max(farthest, drift.norm()); });
    return farthest;
  };
  find(h);
  keep_late_overlaps();
  double deepest = deepest_touch(), drifted = farthest_point();
  // Sub-steps at a structure drift by a ten-millionth of a block each: led back once it shows, to a tenth of
  // that.
  const double shows = leapfrog() ? std::max(tolerance, contact::tolerances().drift_at_structures *
                                                            settings_.accuracy * 0.5 * thinnest)
                                  : tolerance;
  if (deepest <= shows && drifted <= shows) return deepest;
  // What one pass leaves of a large heap is led back with the next step's: each pass searches all of its
  // contacts.
  const bool vast =
      in_vast_heap() && fastest_ > 1e-4 * speed_;  // and moving: what stands is to stand exactly
  const double left = leapfrog()        ? std::max(tolerance, 0.1 * shows)
                      : in_large_heap() ? std::max(tolerance, (vast ? 1e-7 : 1e-8) * thinnest)
                                        : tolerance;
  // What is led back by d turns rows by d / L: they are no closer than that to the blocks' own gaps. Of a
  // heap a pass that comes as close saves one, and its search of rows; and only what is as near as a column
  // of blocks could move becomes a row.
  const auto closeness = [&] {
    return std::clamp(
        std::max(0.2 * tolerance / std::max(deepest, drifted), in_heap() ? 0.3 * deepest / length_ : 0.0),
        in_heap() ? 1e-5 : 1e-3, 0.2);
  };
  const auto near = [&] {
    return 4 * deepest + (in_heap() ? std::min(contact::tolerances().drift_near * length_, 100 * deepest)
                                    : contact::tolerances().drift_near * length_);
  };
  std::vector<double> carried(island_->pairs.size(), 0.0);
  std::vector<Pose> before, last(bodies_.size());
  for (const Body& b : bodies_) before.push_back(dda::pose(state_, b.block));
  std::vector<char> taken;                    // per touch
  std::vector<double> fall, turning;          // energies that the motion takes, per body [J]
  double least = std::max(deepest, drifted);  // so far
  int fruitless = 0;  // passes in a row that did not halve it, those without a solution twice: what is jammed
                      // stays in each other
  for (int pass = 0; pass < 24 && (pass == 0 || std::max(deepest, drifted) > left) && fruitless < 4; ++pass) {
    ++report_.counters.projections;
    begin_step(0, true);
    for (Body& b :
         bodies_) {  // how far fixed points of one block are from each other is for its strains to keep
      const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(b.block)];
      if (!block.deformable || block.fixed_points.size() < 2) continue;
      b.ndof = 12;
      dda::impulse_mass(model_, state_, b.block, false, b.free.mass, b.free.inverse);
    }
    for (Body& b : bodies_) {
      const double mass = model_.blocks[static_cast<std::size_t>(b.block)].mass;
      b.free.mass /= mass;
      b.free.inverse *= mass;
    }
    begin_rows();
    const double within = near();
    taken.assign(touches_.size(), 0);
    each_touch([&](Touch& t) {
      t.row = -1;
      if (!believed(t) || t.at.gap > within) return;
      t.mode = Mode::idle;
      taken[static_cast<std::size_t>(&t - touches_.data())] = 1;
    });
    for (std::size_t i = 0; i < touches_.size(); ++i)
      if (taken[i] != 0) take_row(touches_[i], 1, true);
    fill_rows(1, true);
    each_touch([&](const Touch& t) {
      if (t.row < 0) return;
      contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
      c.friction = 0;
      c.cohesion = c.tension = 0;
      c.bias =
          Vec3(t.at.gap - (t.at.gap < -tolerance ? contact::tolerances().bound_aim * tolerance : 0), 0, 0);
      c.compliance.setZero();
      c.impulse.setZero();
    });
    std::size_t held = problem_.contacts.size();
    add_held_rows(problem_, model_, bodies_, 0, 1e6 * std::max(deepest, drifted));
    each_drift(model_, state_, bodies_, [&](const Vec3& drift) { problem_.contacts[held++].bias = drift; });
    finish_bodies();
    std::fill(problem_.v_hat.begin(), problem_.v_hat.end(), 0.0);
    contact::SolveSettings settings;
    settings.velocity_scale = std::max(deepest, drifted);
    settings.tolerance = closeness();
    settings.sufficient = 0.3;  // of blocks jammed in each other: the next pass goes on from there
    if (vast) {
      settings.stalled = settings.sufficient;
      settings.sweeps_alone = true;
      settings.tolerance = std::max(settings.tolerance, 0.3 * left / settings.velocity_scale);
    }
    settings.exact_coulomb = false;
    const contact::SolveReport r = solver_.solve(problem_, settings);
    report_.counters.newton += r.newton;
    if (!std::all_of(problem_.v.begin(), problem_.v.end(), [](double d) { return std::isfinite(d); }))
      break;  // nothing to go by
    const std::vector<Vec3> moments = moments_of_way();
    fall.assign(bodies_.size(), 0.0);
    turning.assign(bodies_.size(), 0.0);
    each_body([&](const Body& b) {
      const auto i = static_cast<std::size_t>(&b - bodies_.data());
      last[i] = b.start;
      const Eigen::Map<const VecX> d(problem_.v.data() + problem_.bodies[i].offset, b.ndof);
      if (d.isZero(0)) return;
      const auto k = static_cast<std::size_t>(b.block);
      const Vec3 momentum = dda::spin_momentum(model_.blocks[k], state_, b.block);
      const double before_it = internal_energy(b.block);
      state_.c[k] += d.head<3>();
      state_.q[k] = (dda::rotation_by(d.segment<3>(3)) * state_.q[k]).normalized();
      if (b.ndof == 12) state_.eps[k] += d.tail<6>();
      fall[i] = model_.blocks[k].mass * model_.gravity.dot(d.head<3>());
      set_spin(b.block, momentum - moments[i], model_.blocks[k].deformable);
      turning[i] = internal_energy(b.block) - before_it;
    });
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      report_.ledger.algorithmic += fall[i];
      report_.ledger.algorithmic -= turning[i];
    }
    find_moved(last, carried);
    deepest = deepest_touch();
    drifted = farthest_point();
    fruitless = std::max(deepest, drifted) < 0.5 * least ? 0 : fruitless + (r.converged ? 1 : 2);
    least = std::min(least, std::max(deepest, drifted));
  }
  carry_at_structures(before);
  return deepest;
}

}  // namespace talus::coupling

// The step's stages in order: find, impact, smooth step, events, projection, commit.
#include "coupling/island.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {
constexpr double lengthening = 1.02;   // of a step at a structure, at most
}

IslandStepper::IslandStepper(const dda::Model& model, dda::State& state, Environment& environment, ContactHistory& history,
                             ContactHistory& surface_history, const StepSettings& settings)
    : model_(model), state_(state), env_(environment), history_(history), surface_history_(surface_history), settings_(settings) {}

IslandStepper::~IslandStepper() = default;

bool IslandStepper::moving_skin(const Partner& a) const {
  return a.kind == Partner::Kind::structure && !env_.structures[static_cast<std::size_t>(a.index)].fixed_surface;
}

void IslandStepper::begin(const Island& island) {
  island_ = &island;
  report_ = IslandReport{};
  impacts_ = 0;
  found_for_ = -1;
  followed_ = -1;
  skin_path_ = step_length_ = 0;
  seen_.clear();
  impacts_on_skin_.clear();
  local_.assign(model_.blocks.size(), -1);
  bodies_.assign(island.blocks.size(), Body{});
  length_ = std::numeric_limits<double>::infinity();
  speed_ = 0;
  for (std::size_t i = 0; i < island.blocks.size(); ++i) {
    const auto k = static_cast<std::size_t>(island.blocks[i]);
    bodies_[i].block = island.blocks[i];
    local_[k] = static_cast<int>(i);
    const double radius = model_.blocks[k].shape->radius;
    length_ = std::min(length_, radius);
    speed_ = std::max({speed_, state_.v[k].norm() + radius * state_.w[k].norm(), std::sqrt(model_.gravity.norm() * radius)});
  }
  if (island.blocks.empty())
    for (int s : island.structures) {
      const TriangleSurface& skin = env_.structures[static_cast<std::size_t>(s)].index->surface();
      length_ = std::min(length_, face_edge(skin));
      for (const Vec3& v : skin.velocities) speed_ = std::max(speed_, v.norm());
    }
  if (!(speed_ > 0)) speed_ = 1;
}

void IslandStepper::begin_step(double h, bool frozen_strain) {
  for (Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    b.start = dda::pose(state_, b.block);
    b.q0 = state_.q[k];
    b.rotation0 = state_.rotation(b.block);
    b.eps0 = state_.eps[k];
    b.v0 << state_.v[k], state_.w[k], state_.eps_rate[k];
    b.momentum0 = dda::spin_momentum(model_.blocks[k], state_, b.block);
    b.ndof = model_.blocks[k].deformable && !frozen_strain ? 12 : 6;
    b.internal0 = h > 0 || model_.blocks[k].deformable ? internal_energy(b.block) : 0;
    if (h > 0) {
      b.free = dda::free_flow(model_, state_, b.block, h, b.end_rule ? dda::FlowRule::implicit_end : dda::FlowRule::exact);
    } else {
      dda::impulse_mass(model_, state_, b.block, b.ndof == 6, b.free.mass, b.free.inverse);
      b.free.pose = b.start;
      b.free.q = b.q0;
      b.free.rotation = b.rotation0;
      b.free.eps = b.eps0;
      b.free.velocity = b.v0;
      b.free.spin = b.v0.segment<3>(3);
    }
    b.ref = b.free.pose;
    b.v_ref = b.free.velocity;
    b.impulse.setZero();
    b.shift.setZero();
    b.v_solved = b.free.velocity;
    linearise_at(b, b.free.q);
  }
}

bool IslandStepper::has_closed() const {
  for (const Touch& t : touches_)
    if (t.stiffness > 0 ? t.at.gap <= 0 : t.at.gap <= touch_gap()) return true;
  return false;
}

double IslandStepper::impact_speed(const Touch& t) const {
  // Slower than this a touch is resting contact, not an impact, and restitution is nil. A touch that carried force in the last
  // step moves at its normal only by what the step's own error leaves; a bounce too low for the accuracy asked for is none.
  if (t.persistent) return 1e-4 * speed_;
  if (!t.law->restitution) return 1e-9 * speed_;
  return std::max(1e-10 * speed_, 0.03 * settings_.accuracy * std::sqrt(2 * model_.gravity.norm() * length_));
}

Vec3 IslandStepper::slip(const Touch& t, const Vec3& x) const {
  const Vec3 u = point_velocity(state_, t.b, x) - partner_velocity(state_, env_, t.a, t.at);
  return u - t.at.normal * t.at.normal.dot(u);
}

void IslandStepper::save() {
  saved_.clear();
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    saved_.push_back({state_.c[k], state_.v[k], state_.w[k], state_.q[k], state_.eps[k], state_.eps_rate[k]});
  }
}

void IslandStepper::restore() {
  found_for_ = -1;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto k = static_cast<std::size_t>(bodies_[i].block);
    const Saved& s = saved_[i];
    state_.c[k] = s.c;
    state_.v[k] = s.v;
    state_.w[k] = s.w;
    state_.q[k] = s.q;
    state_.eps[k] = s.eps;
    state_.eps_rate[k] = s.eps_rate;
  }
}

bool IslandStepper::solve(double h, Effort effort) {
  if (problem_.contacts.empty()) {
    problem_.v = problem_.v_hat;
    return true;
  }
  contact::SolveSettings settings;
  const bool small = problem_.contacts.size() <= 60;
  // Impulses (h = 0) and small islands to round-off; large ones to a small part of the speed they have, so that what comes to rest does.
  double fastest = 0;
  for (const Body& b : bodies_)
    fastest = std::max(fastest, b.v0.head<3>().norm() + model_.blocks[static_cast<std::size_t>(b.block)].shape->radius * b.v0.segment<3>(3).norm());
  settings.velocity_scale = small || h == 0 ? speed_ : std::clamp(fastest, 1e-4 * speed_, speed_);
  const bool still = fastest < 1e-6 * speed_;   // a certificate of rest is only as good as its residual
  // A step may be off by accuracy times the block size: a tenth of that is left to the solver, or a thousandth of what moves still.
  const double allowed = h > 0 ? 0.1 * settings_.accuracy * length_ / h / settings.velocity_scale : 0;
  const double coarse = std::clamp(settings_.accuracy / 1e-3, 1.0, 100.0);   // round-off is asked for at the finer accuracies alone
  settings.tolerance = small ? 1e-12 * coarse : still ? 1e-9 : std::max(std::min(allowed, settings_.accuracy), std::clamp(0.1 * settings_.accuracy, 1e-8, 1e-4));
  // Touches that lie close together can keep round-off above the tolerance. Rows linearised about a rough end contradict each other by
  // what that end is off; those of a provisional pass need not be solved closer.
  if (small) settings.sufficient = effort == Effort::provisional ? 1e-7 : 1e-10 * coarse;
  else if (still) settings.sufficient = 1e-5;   // 1e-9 of the island's speed: where the sticking touches of a heap contradict each other
  // A loaded spring's row holds its elongation over h: of short steps that leaves no more than round-off of it.
  double largest = 0;
  for (const contact::ProblemContact& c : problem_.contacts) largest = std::max(largest, c.bias.cwiseAbs().maxCoeff());
  const double round_off = std::numeric_limits<double>::epsilon() * largest / settings.velocity_scale;
  settings.tolerance = std::max(settings.tolerance, 16 * round_off);
  settings.sufficient = std::max(settings.sufficient, 4096 * round_off);
  Counters& n = report_.counters;
  const auto attempt = [&] {
    const contact::SolveReport r = solver_.solve(problem_, settings);
    n.newton += r.newton;
    n.sweeps += r.sweeps;
    n.outer += r.outer;
    return r;
  };
  contact::SolveReport r = attempt();
  const bool no_better = effort == Effort::last_resort || (effort == Effort::repeated && r.residual > 0.5 * residual_);
  residual_ = r.residual;
  // Where touches contradict each other by so little no other rows would help: taken as it is.
  if (!r.converged && no_better && small && r.residual <= 100 * std::max(settings.tolerance, settings.sufficient)) {
    r.converged = true;
    r.tier = 'C';
  }
  certified_ = r.converged;
  if (!r.converged && still && !small && h > 0 && r.residual <= settings_.accuracy) {   // a step like any other, though it proves no rest
    r.converged = true;
    r.tier = 'C';
  }
  if (!r.converged && effort == Effort::last_resort) {
    // The convex problem alone: it has a solution always, which takes energy as it must but lifts what slides.
    settings.exact_coulomb = false;
    settings.sufficient = 1e-6;
    for (contact::ProblemContact& c : problem_.contacts) {   // a little give: what is jammed between friction cones has no largest force
      c.compliance.array() += 1e-7 * normal_compliance(c);
      c.impulse.setZero();
    }
    r = attempt();
    r.tier = 'E';
  }
  if (!r.converged) return false;   // the caller refines the rows or halves the step, tier D
  n.worst_residual = std::max(n.worst_residual, r.residual);
  (r.tier == 'A' ? n.tier_a : r.tier == 'B' ? n.tier_b : r.tier == 'C' ? n.tier_c : n.tier_e) += 1;
  return true;
}

bool IslandStepper::impact_stage() {
  // An impulse of no duration on all closed touches, if any of them approaches.
  bool approaching = false, given = false;
  for (Touch& t : touches_) {
    t.row = -1;
    if (t.at.gap > touch_gap() || deformable_structure(t)) continue;
    if (t.stiffness > 0 && !t.law->restitution) continue;
    if (t.approach < -impact_speed(t)) {
      approaching = true;
      given = given || t.law->restitution.has_value();
    }
  }
  if (!approaching) return true;
  ++impacts_;
  ++report_.counters.impacts;
  save();
  for (double scale : {1.0, 0.5, 0.0}) {
    begin_step(0, given);
    double before = 0;
    for (const Body& b : bodies_) before += 0.5 * b.v0.head(b.ndof).dot(b.free.mass.topLeftCorner(b.ndof, b.ndof) * b.v0.head(b.ndof));
    problem_.clear();
    nodes_.clear();
    held_.clear();
    bool restituted = false;
    for (Touch& t : touches_) {
      t.row = -1;
      if (t.at.gap > touch_gap() || deformable_structure(t)) continue;
      if (t.stiffness > 0 && !t.law->restitution) continue;
      t.mode = Mode::end;
      add_row(t, 1, true);
      contact::ProblemContact& c = problem_.contacts.back();
      c.bias.setZero();
      c.compliance.setZero();
      c.cohesion = c.tension = 0;
      c.impulse.setZero();
      if (t.law->restitution && t.approach < -impact_speed(t)) {
        c.bias[0] = scale * *t.law->restitution * t.approach;
        restituted = restituted || *t.law->restitution > 0;
      }
      if (t.law->restitution_tangential) {
        const Vec3 slip = t.frame.transpose() * (point_velocity(state_, t.b, t.at.point_b) - partner_velocity(state_, env_, t.a, t.at));
        c.bias.tail<2>() = scale * *t.law->restitution_tangential * slip.tail<2>();
      }
    }
    finish_bodies();
    if (!solve(0, Effort::last_resort)) return false;
    pending_ = Ledger{};
    apply(0);
    if (!finite()) return false;
    double after = 0;
    for (const Body& b : bodies_)
      after += 0.5 * b.v_solved.head(b.ndof).dot(b.free.mass.topLeftCorner(b.ndof, b.ndof) * b.v_solved.head(b.ndof));
    if (after <= before * (1 + 1e-12) || !restituted || scale == 0) break;
    restore();   // energy rule: restitution with friction on many contacts may not create energy
  }
  // Strain rates are not part of a rigid impulse.
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (bodies_[i].ndof == 6) state_.eps_rate[static_cast<std::size_t>(bodies_[i].block)] = saved_[i].eps_rate;
  book(0);
  report_.ledger += pending_;
  for (const Touch& t : touches_)
    if (t.row >= 0 && t.a.kind == Partner::Kind::structure && !t.impulse.isZero(0)) {
      StructureContact row;
      row.block = t.b;
      row.structure = t.a.index;
      row.point = t.at.point_a;
      row.normal = t.at.normal;
      row.force = -(t.frame * t.impulse);
      row.area = t.at.area;
      impacts_on_skin_.push_back(row);
    }
  for (Touch& t : touches_) {
    t.approach = t.at.normal.dot(point_velocity(state_, t.b, t.at.point_b) - partner_velocity(state_, env_, t.a, t.at));
    if (t.row >= 0 && std::abs(t.approach) < 1e-9 * speed_) t.approach = 0;
    t.row = -1;
  }
  return true;
}

bool IslandStepper::finite() const {
  return std::all_of(bodies_.begin(), bodies_.end(), [&](const Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    return state_.c[k].allFinite() && state_.q[k].coeffs().allFinite() && state_.v[k].allFinite() && state_.w[k].allFinite() &&
           state_.eps[k].allFinite() && state_.eps_rate[k].allFinite();
  });
}

IslandStepper::Outcome IslandStepper::smooth(double h, bool lumped, int passes, bool last_resort) {
  Outcome out;
  choose_springs(h, lumped);
  begin_step(h, false);
  pending_ = Ledger{};
  // Contacts of a block at rest are linearised where it is: what can stand is then found to stand, however long the step.
  for (Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    if (b.v0.head<3>().norm() + model_.blocks[k].shape->radius * b.v0.segment<3>(3).norm() > 1e-3 * h * model_.gravity.norm()) continue;
    b.ref = b.start;
    b.v_ref = b.v0;
    linearise_at(b, b.q0);
  }
  std::vector<Vec3> last_c;
  std::vector<Quat> last_q;
  constexpr int most_passes = 12;   // while a spring's law is not met at the indentation reached
  bool solved = true;
  for (int pass = 0; pass < most_passes; ++pass) {
    assemble(h, lumped, pass == 0);
    solved = solve(h, last_resort ? Effort::last_resort : pass + 1 < passes ? Effort::provisional : solved ? Effort::full : Effort::repeated);
    if (!solved && (lumped || pass + 1 >= most_passes || residual_ > 1e-7)) return out;
    apply(h);
    if (!finite()) return out;
    if (problem_.contacts.empty()) break;
    const bool met = solved && laws_met(h);
    double error = 0;
    for (std::size_t i = 0; pass > 0 && i < bodies_.size(); ++i) {
      const auto k = static_cast<std::size_t>(bodies_[i].block);
      error = std::max(error, (state_.c[k] - last_c[i]).norm() / length_);
      error = std::max(error, 2 * (state_.q[k].conjugate() * last_q[i]).vec().norm());
    }
    if (pass > 0 && pass < passes) out.error = error;
    if (met && (pass + 1 >= passes || (pass > 0 && error < 1e-14))) break;
    last_c.clear();
    last_q.clear();
    for (Body& b : bodies_) {
      const auto k = static_cast<std::size_t>(b.block);
      last_c.push_back(state_.c[k]);
      last_q.push_back(state_.q[k]);
      b.ref = dda::pose(state_, b.block);
      b.v_ref << state_.v[k], state_.w[k], state_.eps_rate[k];
      linearise_at(b, state_.q[k]);
    }
  }
  if (!island_->structures.empty()) collect_node_impulses();
  book(h);
  out.ok = true;
  return out;
}

bool IslandStepper::laws_met(double h) const {
  // The rows hold the law's tangent; is the force that they gave the law's own at the indentation reached?
  for (const Touch& t : touches_) {
    if (t.row < 0 || t.stiffness == 0 || t.mode == Mode::spring_secant) continue;
    const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
    double derivative = 0;
    double force = t.mode == Mode::spring_mean ? t.normal_law.mean_force(-t.at.gap, t.indentation, derivative) : t.normal_law.force(t.indentation);
    if (t.dashpot > 0) {
      const double u = t.u_ref - (t.indentation + t.gap_ref) / (t.theta * h);
      force -= t.dashpot * (t.mode == Mode::spring_mean ? 0.5 * (t.approach + u) : u);
    }
    if (std::abs(c.impulse[0] - h * std::max(force, 0.0)) > 1e-10 * (c.impulse[0] + h * t.stiffness * 1e-6 * length_)) return false;
  }
  return true;
}

double IslandStepper::step_limit(double remaining, bool lumped) const {
  if (settings_.fixed_step > 0) return settings_.fixed_step;
  if (!lumped) {
    double h = has_closed() && suggested_ > 0 ? suggested_ : remaining;
    // In flight the onset search follows chords: half a radian at most.
    for (const Body& b : bodies_) {
      const double spin = state_.w[static_cast<std::size_t>(b.block)].norm();
      if (spin * h > 0.5 && !island_->pairs.empty()) h = 0.5 / spin;
    }
    return h;
  }
  // Large islands: motion within a step stays a small part of the block size, set by accuracy.
  double h = std::sqrt(settings_.accuracy * 4 * length_ / std::max(model_.gravity.norm(), 1e-12));
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    const double radius = model_.blocks[k].shape->radius;
    const double spin = state_.w[k].norm();
    if (spin > 0) h = std::min(h, std::sqrt(settings_.accuracy * 8) / spin);
    const double speed = state_.v[k].norm();
    if (speed > 0) h = std::min(h, 5 * std::sqrt(settings_.accuracy) * radius / speed);
  }
  return h;
}

IslandReport IslandStepper::advance(const Island& island, double t, double duration, double first_step, const std::atomic<int>* stop) {
  begin(island);
  stop_ = stop;
  suggested_ = first_step;
  IslandReport report = run(t, duration);
  follow_all();
  return report;
}

IslandReport IslandStepper::run(double t, double duration) {
  const Island& island = *island_;
  const bool with_structure = !island.structures.empty();
  const bool small = static_cast<int>(island.blocks.size()) <= settings_.event_blocks && !with_structure;
  double done = 0;
  double longest = std::numeric_limits<double>::infinity();   // of the next step, where the last try found no solution [s]
  condensed_ = with_structure && may_condense(t);
  while (duration - done > 1e-12 * duration) {
    const double remaining = duration - done;
    const bool lumped = !small || impacts_ > 200;
    const double expected = std::min(remaining, suggested_ > 0 ? (with_structure && !condensed_ ? lengthening : 1.0) * suggested_ : step_limit(remaining, lumped));
    if (with_structure && !condensed_ && suggested_ > 0) follow_skins(expected);
    find(expected);
    double h = step_limit(remaining, lumped);
    if (condensed_) {
      const double length = condensed_length(t + done, duration, remaining, h);
      condensed_ = length > 0;
      if (condensed_) h = length;
    }
    if (!condensed_) skins_.clear();
    if (with_structure && !condensed_) h = structure_step(duration, h);
    h = std::min({h, remaining, longest});
    if (h < remaining && !condensed_) h = remaining / std::ceil(remaining / h - 1e-9);
    find(h);
    if (with_structure && !condensed_) blow(t + done, h);
    if (!lumped && !impact_stage()) {
      report_.failure = "impact could not be solved";
      return report_;
    }
    weigh_springs();
    if (settings_.fixed_step <= 0 && !condensed_) h = std::min(h, spring_limit(h, lumped));
    const bool closed = has_closed();
    const int passes = lumped || !closed ? 1 : 3;
    save();
    // Sliding that stops within the step: the step is cut so that it ends there, else the trapezoid would slide on to its end.
    std::vector<Vec3> slip_before;
    int stopping = -1;
    bool stop_located = false;
    int releases = 0;
    int cuts = 0, halved = 0, refined = 0;
    ahead_.assign(island.pairs.size(), 0.0);
    if (!lumped && closed && settings_.fixed_step <= 0)
      for (const Touch& touch : touches_) slip_before.push_back(slip(touch, touch.at.point_b));
    for (;;) {
      if (stopped()) {
        report_.stopped = true;
        return report_;
      }
      step_length_ = h;
      if (with_structure)
        for (int s : island.structures) {
          Structure& structure = *env_.structures[static_cast<std::size_t>(s)].structure;
          condensed_ ? structure.predict_condensed(t + done, h) : structure.predict(t + done, h);
        }
      if (condensed_) gather_skins();
      // Halving brings the solution nearer to the last one's; where that does not help, what can be solved is taken.
      Outcome o = smooth(h, lumped, passes, halved >= 8 || 0.5 * h < settings_.min_step);
      const double limit = 0.1 * settings_.accuracy;
      if (!o.ok || (!lumped && settings_.fixed_step <= 0 && o.error > limit && h > 10 * settings_.min_step)) {
        restore();
        ++report_.counters.rejected;
        if (!o.ok) ++report_.counters.tier_d, ++halved;
        h *= o.ok && !condensed_ ? std::clamp(0.9 * std::cbrt(limit / o.error), 0.2, 0.9) : 0.5;
        if (h < settings_.min_step) {
          report_.failure = "the contact problem could not be solved at the smallest step";
          return report_;
        }
        continue;
      }
      if (!lumped && settings_.fixed_step <= 0 && h > 10 * settings_.min_step && gains_energy() && ++refined <= 8) {
        restore();
        ++report_.counters.rejected;
        h *= 0.5;
        continue;
      }
      if (lumped && h > 10 * settings_.min_step && ++cuts <= 30) {
        const Crossing met = crossing();
        if (met.first < 1 || met.listed) {   // solved again with rows for what it met; else it ends short, and a row is there in the next one
          restore();
          ++report_.counters.rejected;
          for (Touch& touch : touches_)
            if (touch.row >= 0 && touch.stiffness == 0) touch.warm = touch.frame * touch.impulse / h;
          if (met.first < 1) h *= condensed_ ? 0.5 : std::clamp(0.99 * met.first, 0.01, 0.99);
          if (met.listed) look_ahead();
          continue;
        }
      }
      if (condensed_ && settings_.fixed_step <= 0) {
        const double error = condensed_error(h);
        if (error > limit && h > 10 * settings_.min_step) {
          restore();
          ++report_.counters.rejected;
          h *= 0.5;
          continue;
        }
        suggested_ = error < limit / 8 ? 2 * h : h;
      }
      if (!lumped && settings_.fixed_step <= 0 && closed) {
        if (releases < 3 && cut_at_release(h)) {
          ++releases;
          restore();
          continue;
        }
        if (!stop_located && h > 10 * settings_.min_step) {
          int stopped = -1;
          double longest = limit * length_;   // what sliding on would add at most
          for (std::size_t i = 0; i < touches_.size(); ++i) {
            const Touch& touch = touches_[i];
            const bool trapezoid = touch.mode == Mode::closed || (touch.mode == Mode::spring_mean && touch.shear_stiffness == 0);
            if (touch.row < 0 || !trapezoid || !(touch.impulse[0] > 0)) continue;
            const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(touch.row)];
            const bool sticks = touch.impulse.tail<2>().norm() < (c.friction * touch.impulse[0] + c.cohesion) * (1 - 1e-9);
            const double path = 0.5 * h * slip_before[i].norm();
            if (!sticks || path <= longest) continue;
            longest = path;
            stopped = static_cast<int>(i);
          }
          if (stopped >= 0) {
            stopping = stopped;
            restore();
            h *= 0.5;
            continue;
          }
          if (stopping >= 0) {
            // Slides to the end of this shorter step: friction takes its speed at a steady rate.
            stop_located = true;
            const Touch& touch = touches_[static_cast<std::size_t>(stopping)];
            const Body& b = bodies_[static_cast<std::size_t>(local_[static_cast<std::size_t>(touch.b)])];
            const Vec3 from = slip_before[static_cast<std::size_t>(stopping)];
            const Pose now = dda::pose(state_, touch.b);
            const double left = slip(touch, now.c + now.F * (b.start.F.inverse() * (touch.at.point_b - b.start.c))).dot(from) / from.squaredNorm();
            if (left > 0.05 && left < 1) {
              restore();
              h /= 1 - left;
              continue;
            }
          }
        }
        const double grow = o.error > 0 ? std::clamp(0.9 * std::cbrt(limit / o.error), 0.3, 2.0) : 2.0;
        // The rest of a stretch, shorter than the step would be, says nothing against the longer one.
        const bool clipped = h >= remaining * (1 - 1e-12) && grow >= 1;
        suggested_ = clipped ? std::max(suggested_, h * grow) : h * grow;
      }
      break;
    }
    double taken = h;
    if (!lumped && !locate_event(taken, passes)) {
      restore();
      ++report_.counters.rejected;
      longest = 0.5 * h;
      if (longest < settings_.min_step) {
        report_.failure = "the contact problem could not be solved at the smallest step";
        return report_;
      }
      continue;
    }
    longest = std::numeric_limits<double>::infinity();
    if (condensed_ && !correct_skins(t + done, taken)) {
      restore();
      ++report_.counters.rejected;
      condensed_ = false;   // for the rest of the stretch
      continue;
    }
    if (with_structure) {
      for (int s : island.structures) {
        StructurePart& part = env_.structures[static_cast<std::size_t>(s)];
        if (!condensed_) {
          shares_.clear();
          for (const NodeShare& n : node_impulses_)
            if (n.structure == s) shares_.push_back({n.node, n.impulse});
          part.structure->correct(t + done, taken, shares_);
        }
        part.index->refit(part.structure->surface());
        ++(condensed_ ? report_.counters.condensed_steps : report_.counters.structure_steps);
      }
    }
    commit(t + done + taken, taken);
    done += taken;
    ++report_.counters.steps;
    report_.counters.last_step = taken;
    if (!problem_.contacts.empty() || closed) {
      rest_check(taken);
      // At structures as far as the next step reaches, which then need not search again.
      const double penetration = project(with_structure && !condensed_ ? lengthening * std::max(suggested_, taken) : taken);
      report_.counters.worst_penetration = std::max(report_.counters.worst_penetration, penetration);
    } else {
      ++report_.counters.flights;
      report_.at_rest = false;
    }
  }
  report_.next_step = suggested_;
  return report_;
}

/// Step at structures: equal parts of the stretch below the stable step, halved as the contacts ask. They are lengthened again by little at
/// a time: a leapfrog whose step jumps near its stable one feeds its highest modes, jump by jump. Short parts of a short stretch bind no later one.
double IslandStepper::structure_step(double duration, double longest) {
  double stable = std::numeric_limits<double>::infinity();
  for (int s : island_->structures) stable = std::min(stable, env_.structures[static_cast<std::size_t>(s)].structure->critical_step());
  double h = duration / std::ceil(duration / stable * (1 - 1e-12));
  longest = std::min(longest, rise_limit(h));
  bool bound = h > longest * (1 + 1e-9);
  while (h > longest * (1 + 1e-9)) h *= 0.5;
  if (suggested_ > 0 && h > lengthening * suggested_) h = lengthening * suggested_, bound = true;
  suggested_ = bound ? h : stable;
  return h;
}

/// True if the step just computed made more energy than the accuracy allows of what the island moves and stores: its error, and order 2 or better.
bool IslandStepper::gains_energy() const {
  double scale = 0;
  for (const Body& b : bodies_) {
    const double mass = model_.blocks[static_cast<std::size_t>(b.block)].mass;
    scale += 0.5 * mass * b.v0.head<3>().squaredNorm() + b.internal0 + 0.1 * settings_.accuracy * mass * model_.gravity.norm() * length_;
  }
  for (const Touch& t : touches_)
    if (t.row >= 0) scale += t.stored;
  return -pending_.algorithmic > 0.05 * settings_.accuracy * scale;
}

void IslandStepper::rest_check(double h) {
  double still = 1e-6 * model_.gravity.norm() * h;
  bool rest = still > 0 && certified_;
  for (int s : island_->structures) rest = rest && condensed_ && env_.structures[static_cast<std::size_t>(s)].structure->quiet();
  if (condensed_) still += 2 * skin_speed();
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    const double radius = model_.blocks[k].shape->radius;
    rest = rest && b.v0.head<3>().norm() + radius * b.v0.segment<3>(3).norm() <= still &&
           state_.v[k].norm() + radius * state_.w[k].norm() <= still &&
           (!model_.blocks[k].deformable || radius * (state_.eps_rate[k].norm() + b.v0.tail<6>().norm()) <= still);
  }
  report_.at_rest = rest;
}

}  // namespace talus::coupling

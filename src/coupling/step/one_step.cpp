// One step of a group: impacts, the smooth step, its end, its error and the events within it.
#include "coupling/step/one_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling/island_body.hpp"

namespace talus::coupling::step {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Vec3 rotation_vector(const Quat& turn) {
  const Vec3 v = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
  const double s = v.norm();
  return s < 1e-12 ? Vec3(2 * v) : Vec3(2 * std::atan2(s, std::abs(turn.w())) / s * v);
}

std::vector<Place> places_of(const std::vector<Body>& bodies) {
  std::vector<Place> places(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) places[i].c = bodies[i].c;
  return places;
}

std::vector<At> place_all(const std::vector<Row>& rows, const std::vector<Body>& bodies, const std::vector<Place>& places) {
  std::vector<At> at(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) at[i] = place_row(rows[i], bodies, places);
  return at;
}

std::vector<Mass> masses_of(const std::vector<Body>& bodies) {
  std::vector<Mass> masses(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) masses[i] = mass_of(bodies[i], bodies[i].q.toRotationMatrix());
  return masses;
}

std::vector<Vec6> velocities_of(const std::vector<Body>& bodies) {
  std::vector<Vec6> v(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) v[i] = bodies[i].v;
  return v;
}

double residual_of(const std::vector<Body>& bodies) {
  double r = infinity;
  for (const Body& b : bodies) r = std::min(r, b.tol.residual);
  return r;
}

/// Momentum that the rows give each body, about its centre.
std::vector<Vec6> given(const std::vector<Row>& rows, const std::vector<At>& at, const std::vector<Vec3>& impulse, std::size_t bodies) {
  std::vector<Vec6> g(bodies, Vec6::Zero());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vec3 p = at[i].frame * impulse[i];
    const auto b = static_cast<std::size_t>(rows[i].b);
    g[b].head<3>() += p;
    g[b].tail<3>() += at[i].arm_b.cross(p);
    if (rows[i].a < 0) continue;
    const auto a = static_cast<std::size_t>(rows[i].a);
    g[a].head<3>() -= p;
    g[a].tail<3>() -= at[i].arm_a.cross(p);
  }
  return g;
}

/// Largest k in [0, 1] with no more kinetic energy at v0 + k (v1 - v0) than `most`; the energy is convex in k and no more at k = 0.
double blend(const std::vector<Mass>& masses, const std::vector<Vec6>& v0, const std::vector<Vec6>& v1, double most) {
  double a = 0, b = 0, c = kinetic(masses, v0) - most;
  for (std::size_t i = 0; i < v0.size(); ++i) {
    const Vec6 d = v1[i] - v0[i], md = masses[i].mass * d;
    a += 0.5 * d.dot(md);
    b += v0[i].dot(md);
  }
  if (!(a > 0) || c >= 0) return 0;
  return std::clamp((-b + std::sqrt(std::max(0.0, b * b - 4 * a * c))) / (2 * a), 0.0, 1.0);
}

}  // namespace

OneStep::OneStep(const dda::Model& model, dda::State& state, Environment& environment, ContactHistory& history, const StepSettings& settings)
    : model_(model), state_(state), env_(environment), history_(history), settings_(settings) {}

Moment OneStep::moment(const Group& group) {
  Moment m;
  for (const int block : group.blocks) {
    const dda::Model::Block& of = model_.blocks[static_cast<std::size_t>(block)];
    const auto k = static_cast<std::size_t>(block);
    Body& b = m.bodies.emplace_back();
    b.block = block;
    b.mass = of.mass;
    b.radius = of.shape->radius;
    b.inertia = of.inertia;
    b.tol = Tolerances(settings_.accuracy, std::cbrt(of.volume), model_.gravity.norm());
    b.c = state_.c[k];
    b.q = state_.q[k];
    b.v << state_.v[k], state_.w[k];
  }
  look(group, m);
  make_rows(group, m);
  return m;
}

/// What each pair has within the touch band at the state.
void OneStep::look(const Group& group, Moment& m) const {
  m.touches.assign(group.pairs.size(), {});
  m.least.assign(group.pairs.size(), infinity);
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const CandidatePair& pair = group.pairs[i];
    double band = m.bodies[static_cast<std::size_t>(local_[static_cast<std::size_t>(pair.b)])].tol.touch;
    if (pair.a.kind == Partner::Kind::block && local_[static_cast<std::size_t>(pair.a.index)] >= 0)
      band = std::min(band, m.bodies[static_cast<std::size_t>(local_[static_cast<std::size_t>(pair.a.index)])].tol.touch);
    if (!near(pair, band)) continue;
    find_touches(model_, state_, env_, pair, band, history_, m.touches[i]);
    for (const Touch& t : m.touches[i]) m.least[i] = std::min(m.least[i], t.at.gap);
  }
}

void OneStep::make_rows(const Group& group, Moment& m) const {
  m.rows.clear();
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const Partner& a = group.pairs[i].a;
    Pose pose_a;
    if (a.kind == Partner::Kind::block && !m.touches[i].empty()) pose_a = dda::pose(state_, a.index);
    for (const Touch& t : m.touches[i]) {
      Row& row = m.rows.emplace_back();
      row.a = a.kind == Partner::Kind::block ? local_[static_cast<std::size_t>(a.index)] : -1;
      row.b = local_[static_cast<std::size_t>(t.b)];
      row.pair = i;
      row.key = t.at.key;
      row.law = t.law;
      row.point_a = t.at.point_a;
      row.point_b = t.at.point_b;
      row.gap = t.at.gap;
      const NormalOwner owner = normal_owner(t, model_, env_, &pose_a);
      row.a_owns = owner == NormalOwner::a;
      row.edges = owner == NormalOwner::edges;
      row.carrier = owner == NormalOwner::a ? row.a : owner == NormalOwner::b ? row.b : -1;
      row.frame = contact_frame(t.at.normal);
      const Tolerances& tb = m.bodies[static_cast<std::size_t>(row.b)].tol;
      row.open = tb.open;
      row.bounce = tb.bounce;
      if (row.a >= 0) {
        const Tolerances& ta = m.bodies[static_cast<std::size_t>(row.a)].tol;
        row.open = std::min(row.open, ta.open);
        row.bounce = std::min(row.bounce, ta.bounce);
      }
    }
  }
  slip(m);
}

void OneStep::slip(Moment& m) const {
  const std::vector<Place> places = places_of(m.bodies);
  const std::vector<Vec6> v = velocities_of(m.bodies);
  for (Row& row : m.rows) row.slip = place_row(row, m.bodies, places).velocity(row, v);
}

/// Impulses of no duration over all touching rows, while one of them closes. One share of the laws' restitution for all: the largest that makes no energy.
bool OneStep::impacts(Moment& m) {
  constexpr int rebounds = 20, most = 60;
  for (int n = 0; n < most; ++n) {
    const auto closes = [](const Row& r) { return r.slip[0] < -r.open; };
    if (std::none_of(m.rows.begin(), m.rows.end(), closes)) return true;
    const bool fast = n < rebounds && std::any_of(m.rows.begin(), m.rows.end(), [](const Row& r) { return r.slip[0] < -r.bounce && r.law->restitution; });
    const std::vector<At> at = place_all(m.rows, m.bodies, places_of(m.bodies));
    const std::vector<Mass> masses = masses_of(m.bodies);
    const std::vector<Vec6> before = velocities_of(m.bodies);
    std::vector<Asked> asked(m.rows.size());
    const auto ask = [&](double normal, double along) {
      for (std::size_t i = 0; i < m.rows.size(); ++i) {
        const Row& r = m.rows[i];
        asked[i].friction = r.law->friction;
        asked[i].bias[0] = normal * r.law->restitution.value_or(0.0) * r.slip[0];
        asked[i].bias.tail<2>() = along * r.law->restitution_tangential.value_or(0.0) * r.slip.tail<2>();
      }
    };
    const double e0 = kinetic(masses, before), residual = residual_of(m.bodies);
    ask(fast ? 1 : 0, fast ? 1 : 0);
    Solved found = problems_.solve(masses, before, m.rows, at, asked, residual);
    if (!found.ok && fast) {
      ask(0, 0);
      found = problems_.solve(masses, before, m.rows, at, asked, residual);
    } else if (fast && kinetic(masses, found.v) > e0 * (1 + 1e-12)) {
      ask(0, 0);
      const Solved plastic = problems_.solve(masses, before, m.rows, at, asked, residual);
      const double k = blend(masses, plastic.v, found.v, e0);
      for (std::size_t i = 0; i < found.v.size(); ++i) found.v[i] = plastic.v[i] + k * (found.v[i] - plastic.v[i]);
      for (std::size_t i = 0; i < found.impulse.size(); ++i) found.impulse[i] = plastic.impulse[i] + k * (found.impulse[i] - plastic.impulse[i]);
      found.ok = plastic.ok;
    }
    if (!found.ok) return false;
    const double lost = e0 - kinetic(masses, found.v);
    double rubbed = 0;
    for (std::size_t i = 0; i < m.rows.size(); ++i) rubbed -= 0.5 * found.impulse[i].tail<2>().dot((m.rows[i].slip + at[i].velocity(m.rows[i], found.v)).tail<2>());
    rubbed = std::clamp(rubbed, 0.0, std::max(lost, 0.0));
    report_.ledger.friction_work += rubbed;
    report_.ledger.damping_work += lost - rubbed;
    for (std::size_t i = 0; i < m.bodies.size(); ++i) m.bodies[i].v = found.v[i];
    slip(m);
    m.known = false;
    ++report_.counters.impacts;
  }
  return true;
}

/// Accelerations that the contacts allow: J a >= -dJ/dt v on what neither parts nor closes, Coulomb's law on the sliding there is, or that it begins.
bool OneStep::accelerations(Moment& m) {
  constexpr double fixed_direction = 1e3;   // times gravity: a slip so fast that its direction is the force's
  constexpr double instant = 1e-6;          // [s], of the difference quotient of J v
  const std::vector<Vec6> v = velocities_of(m.bodies);
  std::vector<Place> soon = places_of(m.bodies);
  std::vector<Vec6> free(m.bodies.size());
  double scale = model_.gravity.norm();
  for (std::size_t i = 0; i < m.bodies.size(); ++i) {
    const Body& b = m.bodies[i];
    const Vec3 w = b.v.tail<3>();
    soon[i].c += instant * b.v.head<3>();
    soon[i].turn = dda::rotation_by(instant * w).toRotationMatrix();
    const Mat3 R = b.q.toRotationMatrix();
    const Mat3 inertia = R * b.inertia * R.transpose();
    free[i] << model_.gravity, -(inertia.inverse() * w.cross(inertia * w));
  }
  const std::vector<At> at = place_all(m.rows, m.bodies, places_of(m.bodies)), later = place_all(m.rows, m.bodies, soon);
  std::vector<Asked> asked(m.rows.size());
  for (std::size_t i = 0; i < m.rows.size(); ++i) {
    const Row& r = m.rows[i];
    asked[i].used = std::abs(r.slip[0]) <= r.open;
    asked[i].friction = r.law->friction;
    asked[i].bias = (later[i].velocity(r, v) - r.slip) / instant;
    scale = std::max(scale, asked[i].bias.norm());
  }
  for (std::size_t i = 0; i < m.rows.size(); ++i) {
    const Eigen::Vector2d u = m.rows[i].slip.tail<2>();
    if (u.norm() > m.rows[i].open) asked[i].bias.tail<2>() += fixed_direction * scale * u.normalized();
  }
  double residual = infinity;
  for (const Body& b : m.bodies) residual = std::min(residual, 0.1 * b.tol.open / b.tol.memory);
  const Solved found = problems_.solve(masses_of(m.bodies), free, m.rows, at, asked, residual);
  for (std::size_t i = 0; i < m.bodies.size(); ++i) m.bodies[i].acceleration = found.v[i];
  m.known = true;
  return found.ok;
}

bool OneStep::smooth(const Moment& start, double h, Trial& trial) {
  constexpr int most = 8;
  put(start);
  trial = Trial{};
  trial.rows = start.rows;
  trial.end.bodies = start.bodies;
  const std::size_t n = start.bodies.size();
  const std::vector<Vec6> before = velocities_of(start.bodies);
  std::vector<dda::FreeFlow> flow(n);
  std::vector<Vec6> free(n);
  std::vector<Vec3> spin(n);
  std::vector<Mass> masses(n);
  for (std::size_t i = 0; i < n; ++i) {
    flow[i] = dda::free_flow(model_, state_, start.bodies[i].block, h);
    free[i] = flow[i].velocity.head<6>();
    spin[i] = dda::spin_momentum(model_.blocks[static_cast<std::size_t>(start.bodies[i].block)], state_, start.bodies[i].block);
    masses[i] = {flow[i].mass.topLeftCorner<6, 6>(), flow[i].inverse.topLeftCorner<6, 6>()};
    Body& e = trial.end.bodies[i];
    e.c = flow[i].pose.c;
    e.q = flow[i].q;
    e.v = free[i];
    if (!start.known || start.rows.empty()) continue;   // where the accelerations at the start lead to
    e.c += 0.5 * h * h * (start.bodies[i].acceleration.head<3>() - model_.gravity);
    e.q = (dda::rotation_by(0.5 * h * h * start.bodies[i].acceleration.tail<3>()) * e.q).normalized();
  }
  if (start.rows.empty()) return true;
  const double residual = residual_of(start.bodies);
  std::vector<Asked> asked(trial.rows.size());
  std::vector<At> at;
  for (int pass = 0; pass < most; ++pass) {
    std::vector<Place> mid(n);
    for (std::size_t i = 0; i < n; ++i) {
      mid[i].c = 0.5 * (start.bodies[i].c + trial.end.bodies[i].c);
      mid[i].turn = dda::rotation_by(0.5 * rotation_vector(trial.end.bodies[i].q * start.bodies[i].q.conjugate())).toRotationMatrix();
    }
    at = place_all(trial.rows, start.bodies, mid);
    for (std::size_t i = 0; i < trial.rows.size(); ++i) {
      const Row& r = trial.rows[i];
      asked[i].friction = r.law->friction;
      asked[i].bias = at[i].velocity(r, before) - r.slip;
      asked[i].bias[0] += std::max(r.slip[0], 0.0);
      if (r.slides_through) asked[i].bias.tail<2>() += r.slip.tail<2>();   // friction opposes the mean slip
      asked[i].warm = r.impulse;
    }
    const Solved found = problems_.solve(masses, free, trial.rows, at, asked, residual);
    if (!found.ok) return false;
    const std::vector<Vec6> gain = given(trial.rows, at, found.impulse, n);
    double moved = 0;   // since the last pass, over what is allowed
    for (std::size_t i = 0; i < n; ++i) {
      Body& e = trial.end.bodies[i];
      const Vec3 c = flow[i].pose.c + 0.5 * h / e.mass * gain[i].head<3>();
      const Quat q = (dda::rotation_by(0.5 * h * (masses[i].inverse.block<3, 3>(3, 3) * gain[i].tail<3>())) * flow[i].q).normalized();
      moved = std::max(moved, ((c - e.c).norm() + e.radius * rotation_vector(q * e.q.conjugate()).norm()) / (0.01 * e.tol.error * std::min(1.0, h / e.tol.memory)));
      e.c = c;
      e.q = q;
      const Mat3 R = q.toRotationMatrix();
      e.v.head<3>() = free[i].head<3>() + gain[i].head<3>() / e.mass;
      e.v.tail<3>() = R * (e.inertia.inverse() * (R.transpose() * (spin[i] + gain[i].tail<3>())));
    }
    bool turned = false;
    for (std::size_t i = 0; i < trial.rows.size(); ++i) {
      Row& r = trial.rows[i];
      r.impulse = found.impulse[i];
      const Eigen::Vector2d u = r.slides_through ? Eigen::Vector2d(2 * (at[i].velocity(r, found.v) + asked[i].bias).tail<2>() - r.slip.tail<2>()) : Eigen::Vector2d((at[i].velocity(r, found.v) + asked[i].bias).tail<2>());
      const bool through = r.slip.tail<2>().norm() > r.open && u.norm() > r.open && u.dot(r.slip.tail<2>()) > 0;
      turned = turned || (through && !r.slides_through && pass == 0);
      if (pass == 0) r.slides_through = through;
    }
    if (moved < 1 && !turned) break;
  }
  const std::vector<Vec6> after = velocities_of(trial.end.bodies);
  for (std::size_t i = 0; i < trial.rows.size(); ++i)
    trial.work.friction_work -= 0.5 * trial.rows[i].impulse.tail<2>().dot((at[i].velocity(trial.rows[i], before) + at[i].velocity(trial.rows[i], after)).tail<2>());
  lead_along(trial);
  return true;
}

/// At the end what pressed neither parts nor closes, what stuck does not slide; friction of what slid goes with it. Taken only if it makes no energy.
void OneStep::lead_along(Trial& trial) {
  constexpr int rounds = 6;
  const std::size_t n = trial.end.bodies.size();
  const std::vector<Body> start = trial.end.bodies;
  std::vector<Row> rows;
  for (const Row& r : trial.rows)
    if (r.impulse[0] > 0) rows.push_back(r);
  if (rows.empty()) return;
  // The rows' points are told at the start of the step: its poses are the state's.
  std::vector<Body> from = trial.end.bodies;
  std::vector<Place> places(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(from[i].block);
    from[i].c = state_.c[k];
    places[i] = {trial.end.bodies[i].c, (trial.end.bodies[i].q * state_.q[k].conjugate()).toRotationMatrix()};
  }
  const std::vector<At> at = place_all(rows, from, places);
  const std::vector<Vec6> v1 = velocities_of(trial.end.bodies);
  const double residual = residual_of(start);
  std::vector<Asked> asked(rows.size());
  double off = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vec3 u = at[i].velocity(rows[i], v1);
    asked[i].held = true;
    asked[i].held_along = rows[i].impulse.tail<2>().norm() < rows[i].law->friction * rows[i].impulse[0] * (1 - 1e-9);
    off = std::max(off, asked[i].held_along ? u.norm() : std::abs(u[0]));
  }
  if (off <= residual) return;
  const std::vector<Mass> masses = masses_of(trial.end.bodies);
  std::vector<Vec6> free = v1;
  std::vector<Vec3> along(rows.size(), Vec3::Zero());
  Solved found;
  for (int round = 0; round < rounds; ++round) {
    found = problems_.solve(masses, free, rows, at, asked, residual);
    if (!found.ok) return;
    double change = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Vector2d p = rows[i].impulse.tail<2>();
      if (asked[i].held_along || p.norm() == 0) continue;
      const Vec3 rubs(0, p.x() / rows[i].impulse[0] * found.impulse[i][0], p.y() / rows[i].impulse[0] * found.impulse[i][0]);
      change = std::max(change, (rubs - along[i]).norm() / masses[static_cast<std::size_t>(rows[i].b)].mass(0, 0));
      along[i] = rubs;
    }
    if (change <= residual) break;
    const std::vector<Vec6> g = given(rows, at, along, n);
    for (std::size_t i = 0; i < n; ++i) free[i] = v1[i] + masses[i].inverse * g[i];
  }
  if (kinetic(masses, found.v) > kinetic(masses, v1)) return;
  for (std::size_t i = 0; i < n; ++i) trial.end.bodies[i].v = found.v[i];
}

double OneStep::measure_error(const Moment& start, double h, const Trial& trial) const {
  std::vector<char> touched(start.bodies.size(), 0);
  for (const std::vector<Row>* rows : {&start.rows, &trial.end.rows})
    for (const Row& r : *rows) {
      touched[static_cast<std::size_t>(r.b)] = 1;
      if (r.a >= 0) touched[static_cast<std::size_t>(r.a)] = 1;
    }
  double error = 0;
  for (std::size_t i = 0; i < start.bodies.size(); ++i) {
    if (touched[i] == 0) continue;   // free flow is exact
    const Body &b = start.bodies[i], &e = trial.end.bodies[i];
    const Vec6 d = (e.v - b.v) / h - 0.5 * (b.acceleration + e.acceleration);
    error = std::max(error, std::max(b.tol.memory, h) * h * std::max(d.head<3>().norm(), b.radius * d.tail<3>().norm()) / b.tol.error);
  }
  return error;
}

/// First time in the step at which a pair comes down: one that is apart on its swept motion; in one that touches, features that overlap at the end more than all did at the start.
void OneStep::find_event(const Group& group, const Moment& start, double h, Trial& trial) {
  trial.event = h;
  std::vector<contact::Motion> motions(start.bodies.size());
  for (std::size_t i = 0; i < start.bodies.size(); ++i) {
    const Body &b = start.bodies[i], &e = trial.end.bodies[i];
    contact::Motion& m = motions[i];
    m.start.c = b.c;
    m.start.F = b.q.toRotationMatrix();
    m.displacement = e.c - b.c;
    m.half_gravity_step = m.displacement - h * b.v.head<3>();
    m.rotation = rotation_vector(e.q * b.q.conjugate());
  }
  const auto motion_of = [&](int block) {
    const int l = local_[static_cast<std::size_t>(block)];
    if (l >= 0) return motions[static_cast<std::size_t>(l)];
    contact::Motion m;
    m.start = dda::pose(state_, block);
    return m;
  };
  const auto way = [&](int block) {
    const int l = local_[static_cast<std::size_t>(block)];
    if (l < 0) return 0.0;
    const contact::Motion& m = motions[static_cast<std::size_t>(l)];
    return m.displacement.norm() + m.half_gravity_step.norm() + start.bodies[static_cast<std::size_t>(l)].radius * m.rotation.norm();
  };
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const CandidatePair& pair = group.pairs[i];
    const Body& b = start.bodies[static_cast<std::size_t>(local_[static_cast<std::size_t>(pair.b)])];
    const Polyhedron& shape = *model_.blocks[static_cast<std::size_t>(pair.b)].shape;
    Tolerances tol = b.tol;
    if (pair.a.kind == Partner::Kind::block && local_[static_cast<std::size_t>(pair.a.index)] >= 0) {
      const Tolerances& other = start.bodies[static_cast<std::size_t>(local_[static_cast<std::size_t>(pair.a.index)])].tol;
      if (other.touch < tol.touch) tol = other;
    }
    if (start.least[i] == infinity) {
      put(start);
      if (!near(pair, way(pair.b) + (pair.a.kind == Partner::Kind::block ? way(pair.a.index) : 0.0) + tol.touch)) continue;
      const contact::Motion motion = motion_of(pair.b);
      const auto index = static_cast<std::size_t>(pair.a.index);
      double s = 2;
      switch (pair.a.kind) {
        case Partner::Kind::block: s = contact::time_of_impact(*model_.blocks[index].shape, motion_of(pair.a.index), shape, motion, tol.land); break;
        case Partner::Kind::plane: s = contact::time_of_impact(env_.planes[index], shape, motion, tol.land); break;
        case Partner::Kind::terrain: s = contact::time_of_impact(*env_.terrain, shape, motion, tol.land); break;
        case Partner::Kind::structure: s = contact::time_of_impact(*env_.structures[index].index, shape, motion, tol.land); break;
      }
      if (s < 1 && s * h < trial.event) {
        trial.event = s * h;
        trial.bad_pair = static_cast<int>(i);
      }
      continue;
    }
    const double floor = std::min(0.0, start.least[i]) - tol.missed;
    if (trial.end.least[i] >= floor) continue;
    // Bisection on the motion found.
    std::vector<FoundPoint> points;
    const auto gap_at = [&](double s) {
      for (const int block : {pair.b, pair.a.kind == Partner::Kind::block ? pair.a.index : pair.b}) {
        if (local_[static_cast<std::size_t>(block)] < 0) continue;
        const Pose pose = motion_of(block).at(s);
        state_.c[static_cast<std::size_t>(block)] = pose.c;
        state_.q[static_cast<std::size_t>(block)] = Quat(pose.F).normalized();
      }
      points.clear();
      find_points(model_, state_, env_, pair, tol.touch, points);
      double least = infinity;
      for (const FoundPoint& p : points) least = std::min(least, p.at.gap);
      return least;
    };
    double lo = 0, hi = 1;
    for (int k = 0; k < 40 && (hi - lo) > 1e-12; ++k) {
      const double s = 0.5 * (lo + hi), g = gap_at(s);
      (g < floor ? hi : lo) = s;
      if (g < floor + 0.05 * tol.missed && g >= floor) break;
    }
    if (std::max(lo, 1e-12) * h < trial.event) {
      trial.event = std::max(lo, 1e-12) * h;
      trial.bad_pair = static_cast<int>(i);
    }
  }
}

/// Writes the bodies into the state.
void OneStep::put(const Moment& m) {
  for (const Body& b : m.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    state_.c[k] = b.c;
    state_.q[k] = b.q;
    state_.v[k] = b.v.head<3>();
    state_.w[k] = b.v.tail<3>();
  }
}

double OneStep::energy(const Moment& m) const {
  double sum = 0;
  for (const Body& b : m.bodies) {
    const Vec3 w = b.q.conjugate() * b.v.tail<3>();
    sum += 0.5 * b.mass * b.v.head<3>().squaredNorm() + 0.5 * w.dot(b.inertia * w) - b.mass * model_.gravity.dot(b.c);
  }
  return sum;
}

}  // namespace talus::coupling::step

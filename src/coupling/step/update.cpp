// From impulses to positions and momenta.
#include "coupling/step/update.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/disjoint_sets.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {
namespace {

void hold_direction(const IslandContext& in, Step& step, const Touch& t, const contact::ProblemContact& c) {
  // Takes from the free directions of both blocks what this spring or hard joint holds: its normal, and all
  // where a shear spring sticks.
  const bool slides = at_coulomb_bound(c, t.impulse);
  const auto hold = [&](int block) {
    const int l = in.local[static_cast<std::size_t>(block)];
    if (l < 0) return;
    Mat3& along = step.bodies[static_cast<std::size_t>(l)].along;
    if (t.shear_stiffness > 0 && !slides) {
      along.setZero();
      return;
    }
    const Vec3 n = along * t.normal;
    if (n.norm() > contact::tolerances().same_normal)
      along -= n * n.transpose() / n.squaredNorm();
    else if (along.trace() < 0.5)
      along.setZero();
  };
  hold(t.b);
  if (t.a.kind == Partner::Kind::block) hold(t.a.index);
}

/// Position, velocity and spin at the end of the step by the impulses on the body.
void move_body(const IslandContext& in, Body& b, double h) {
  const auto k = static_cast<std::size_t>(b.block);
  const dda::FreeFlow& f = b.free;
  in.state.c[k] = f.pose.c;
  in.state.q[k] = f.q;
  in.state.eps[k] = f.eps;
  if (!b.impulse.isZero(0)) {
    Vec12 d = Vec12::Zero();
    d.head(b.ndof) = h * (f.inverse.topLeftCorner(b.ndof, b.ndof) * b.shift.head(b.ndof));
    if (!b.end_rule && !b.from_start && !b.leapfrog) d.head<3>() *= 2 * f.theta;  // theta for 1/2
    in.state.c[k] += d.head<3>();
    // Of free flow's own parabola only the velocity counts, unless next to nothing pushes: what falls
    // together falls as what falls alone.
    if (b.from_start)
      in.state.c[k] += std::min(1.0, b.impulse.head<3>().norm() /
                                         (0.1 * in.model.blocks[k].mass * in.model.gravity.norm() * h)) *
                       (1 - f.theta) * h * h * b.free_acceleration(in.model.gravity);
    if (!d.segment<3>(3).isZero(0)) in.state.q[k] = (dda::rotation_by(d.segment<3>(3)) * f.q).normalized();
    if (b.strains())
      in.state.eps[k] +=
          b.leapfrog || b.strains_at_end ? Vec6(h * (b.v_solved - f.velocity).tail<6>()) : Vec6(d.tail<6>());
  }
  // Along the contact faces nothing is stiff: there the path keeps the trapezoid, exact in steady sliding.
  if (b.end_rule) in.state.c[k] -= (1 - f.theta) * h * (b.along * (b.v_solved.head<3>() - b.v0.head<3>()));
  in.state.v[k] = b.v_solved.head<3>();
  in.state.eps_rate[k] = b.strains() ? Vec6(b.v_solved.tail<6>()) : Vec6(Vec6::Zero());
  // Angular momentum exactly: w follows from it at the orientation reached.
  if (h == 0 || (b.impulse.segment<3>(3).isZero(0) && f.q.coeffs() == in.state.q[k].coeffs())) {
    in.state.w[k] = b.v_solved.segment<3>(3);
  } else {
    // The point that the way really taken keeps the angular momentum about is another than that of the last
    // pass, which the rows were made about.
    Vec3 turned = b.impulse.segment<3>(3);
    if (in.island->structures.empty() && !b.end_rule && !b.pressed)
      turned -= ((b.from_start ? b.start.c : Vec3(0.5 * (b.start.c + in.state.c[k]))) - b.about)
                    .cross(b.impulse.head<3>());
    set_spin(in, b.block, b.momentum0 + turned, b.strains());
  }
}

double indentation_at_end(const IslandContext& in, const Step& step, const Touch& t, double h) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const bool by_body = t.spring == Mode::spring_end && t.b >= 0 &&
                       !in.deformable_structure(t);  // each side goes by its own rule
  double way = by_body ? 0.0 : -t.theta * t.u_ref;   // row 0 of theta J (v - v_ref)
  for (int k = 0; k < c.terms; ++k) {
    const contact::ContactTerm& term = step.problem.terms[static_cast<std::size_t>(c.first_term + k)];
    const contact::ProblemBody& body = step.problem.bodies[static_cast<std::size_t>(term.body)];
    const double* const v = step.problem.v.data() + body.offset;
    const Body* const b = by_body ? &step.bodies[static_cast<std::size_t>(term.body)] : nullptr;
    const double theta = b == nullptr ? t.theta : b->end_rule ? 1.0 : 0.5;
    for (int i = 0; i < body.ndof; ++i)
      way += theta * step.problem.jacobians[static_cast<std::size_t>(term.jacobian + 3 * i)] *
             (v[i] - (b != nullptr ? b->v_ref[i] : 0.0));
  }
  return -(t.gap_ref + h * way);
}

}  // namespace

BodyUpdate::BodyUpdate(const IslandContext& in, Step& step) : in_(in), step_(step) {}

void BodyUpdate::list_terms() {
  const std::size_t bodies = step_.bodies.size();
  first_term_of_.assign(bodies + 2, 0);
  const auto of_block = [&](const contact::ContactTerm& term) {
    return term.body < static_cast<int>(bodies);
  };
  for (const contact::ContactTerm& term : step_.problem.terms)
    if (of_block(term)) ++first_term_of_[static_cast<std::size_t>(term.body) + 2];
  for (std::size_t b = 2; b < first_term_of_.size(); ++b) first_term_of_[b] += first_term_of_[b - 1];
  terms_of_.resize(first_term_of_.back());
  for (std::size_t i = 0; i < step_.problem.contacts.size();
       ++i)  // first_term_of_[b + 1] runs up to the end of body b's list
    for (int k = step_.problem.contacts[i].first_term;
         k < step_.problem.contacts[i].first_term + step_.problem.contacts[i].terms; ++k)
      if (const contact::ContactTerm& term = step_.problem.terms[static_cast<std::size_t>(k)]; of_block(term))
        terms_of_[first_term_of_[static_cast<std::size_t>(term.body) + 1]++] = {static_cast<int>(i), k};
  first_term_of_.pop_back();
}

bool mark_reached(const IslandContext& in, Step& step, const std::function<bool(const Touch&)>& bear,
                  const std::function<bool(const Touch&)>& begins, const std::function<void(Body&)>& mark) {
  const auto body = [&](const Touch& t) { return in.local[static_cast<std::size_t>(t.b)]; };
  if (std::ranges::none_of(step.touches, [&](const Touch& t) { return t.row >= 0 && begins(t); }))
    return false;
  DisjointSets sets(static_cast<int>(step.bodies.size()));
  for (const Touch& t : step.touches)
    if (t.row >= 0 && t.a.kind == Partner::Kind::block && bear(t))
      if (const int a = in.local[static_cast<std::size_t>(t.a.index)]; a >= 0) sets.join(a, body(t));
  std::vector<char> reached(step.bodies.size(), 0);
  for (const Touch& t : step.touches)
    if (t.row >= 0 && begins(t)) reached[static_cast<std::size_t>(sets.root(body(t)))] = 1;
  for (std::size_t i = 0; i < step.bodies.size(); ++i)
    if (reached[static_cast<std::size_t>(sets.root(static_cast<int>(i)))] != 0) mark(step.bodies[i]);
  return true;
}

void BodyUpdate::apply(double h) {
  if (h > 0) step_.found_for = -1;  // an impulse leaves the positions
  // With a hard onset in the step all its impulses act from the start: x + h v^+. Steps of closed touches
  // alone keep the trapezoid, and springs their own rule.
  const bool sprung =
      std::ranges::any_of(step_.touches, [](const Touch& t) { return t.row >= 0 && t.stiffness > 0; });
  step_.from_start = false;
  for (Body& b : step_.bodies) b.from_start = false;
  if (!sprung && h > 0 && in_.island->structures.empty()) {
    const auto impulse = [&](const Touch& t) -> const Vec3& {
      return step_.problem.contacts[static_cast<std::size_t>(t.row)].impulse;
    };
    step_.from_start = mark_reached(
        in_, step_, [&](const Touch& t) { return !impulse(t).isZero(0); },
        [&](const Touch& t) { return t.mode == Mode::end && impulse(t)[0] > 0; },
        [](Body& b) { b.from_start = true; });
  }
  theta_of_.assign(step_.problem.contacts.size(), 0.5);  // of rolling rows and fixed points
  step_.each_touch([&](Touch& t) {
    if (t.row < 0) return;
    t.impulse = step_.problem.contacts[static_cast<std::size_t>(t.row)].impulse;
    if (step_.from_start &&
        step_.bodies[static_cast<std::size_t>(in_.local[static_cast<std::size_t>(t.b)])].from_start)
      t.theta = 1;
    if (t.stiffness > 0 && h > 0) t.indentation = indentation_at_end(in_, step_, t, h);
    theta_of_[static_cast<std::size_t>(t.row)] =
        t.spring == Mode::spring_end || (in_.condensed && in_.deformable_structure(t))
            ? 0.5
            : t.theta;  // of blocks of the trapezoid
  });
  list_terms();
  step_.each_body([&](Body& b) {
    b.impulse.setZero();
    b.shift.setZero();
    b.along = Mat3::Identity();
    const std::size_t i = static_cast<std::size_t>(&b - step_.bodies.data());
    // A pebble beneath a boulder bears impulses of which its own is less than the last digit: the sum of all
    // on a body follows from its velocity. Contacts move positions by theta times their impulse (1/2
    // trapezoid, 1 end of the step): what differs from the first one's theta is added up by itself.
    b.v_solved = b.free.velocity;
    std::optional<double> theta;
    Vec12 others = Vec12::Zero();
    for (std::size_t e = first_term_of_[i]; e < first_term_of_[i + 1]; ++e) {
      const auto row = static_cast<std::size_t>(terms_of_[e].contact);
      const Vec3& p = step_.problem.contacts[row].impulse;
      if (p == Vec3::Zero()) continue;
      const double own = b.end_rule ? 1.0 : theta_of_[row];
      if (!theta) theta = own;
      if (own == *theta) continue;
      const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>> jacobian(
          step_.problem.jacobians.data() +
              step_.problem.terms[static_cast<std::size_t>(terms_of_[e].term)].jacobian,
          3, b.ndof);
      others.head(b.ndof) += (own - *theta) * (jacobian.transpose() * p);
    }
    if (theta) {
      b.v_solved.head(b.ndof) =
          Eigen::Map<const VecX>(step_.problem.v.data() + step_.problem.bodies[i].offset, b.ndof);
      b.impulse.head(b.ndof) =
          b.free.mass.topLeftCorner(b.ndof, b.ndof) * (b.v_solved - b.free.velocity).head(b.ndof);
      b.shift = *theta * b.impulse + others;
    }
  });
  if (sprung)
    for (const Touch& t : step_.touches)
      if (t.row >= 0 && (t.mode == Mode::spring_end || (step_.sprung && t.stiffness == 0)) && t.b >= 0 &&
          t.impulse[0] > 0)
        hold_direction(in_, step_, t, step_.problem.contacts[static_cast<std::size_t>(t.row)]);
  step_.each_body([&](Body& b) { move_body(in_, b, h); });
}

void set_spin(const IslandContext& in, int i, const Vec3& momentum, bool strains) {
  const auto k = static_cast<std::size_t>(i);
  const dda::Model::Block& block = in.model.blocks[k];
  const Mat3 rotation = in.state.rotation(i);
  if (!strains) {
    in.state.w[k] = rotation * block.inertia.inverse() * (rotation.transpose() * momentum);
    return;
  }
  const Mat12 mass = dda::mass_matrix(block, dda::pose(in.state, i), rotation);
  in.state.w[k] =
      mass.block<3, 3>(3, 3).inverse() * (momentum - mass.block<3, 6>(3, 6) * in.state.eps_rate[k]);
}

}  // namespace talus::coupling

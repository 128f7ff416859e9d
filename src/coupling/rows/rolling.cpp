// Rolling and drilling resistance: couples about the tangents and about the normal of a contact.
//
//   |m_t| <= mu_r R p_n   m_t opposite to the rolling velocity (w_b - w_a)_t
//   |m_n| <= mu_d R p_n   m_n opposite to the drilling velocity (w_b - w_a)_n
//   |m_t| <= d p_n        of a face that bounces on springs, p_n over the face
//
// p_n is that of all points of a pair with this normal: they have one couple.
// R: equivalent radius, of two blocks R_a R_b / (R_a + R_b). d = 0.1 accuracy L: the part of the block size
// that the place of the face's force is not known to.
//
// The last holds what the accuracy does not see: a face that comes flat and bounces turns a tilt into a spin,
// w_r t_f times it by the next bounce (w_r: frequency of its rocking, t_f: time of flight), so that light
// blocks between heavy ones would amplify round-off of the contact problem a thousandfold in each closing of
// a gap.
//
// They act as long as the normal force does: in an impact that has no duration as an impulse, bounded by the
// impact's own normal impulse. A faceted body that rolls hops from edge to edge, and meets the ground in
// impacts alone.
#include "coupling/rows/rolling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {
namespace {

/// arm * axis . w in the rows from `first` on, one for each axis; the others are empty.
void push_couple(std::vector<double>& pool, std::span<const Vec3> axes, int ndof, double arm) {
  for (int c = 0; c < ndof; ++c)
    for (std::size_t r = 0; r < 3; ++r)
      pool.push_back(r > 0 && r <= axes.size() && c >= 3 && c < 6 ? arm * axes[r - 1][c - 3] : 0.0);
}

double equivalent_radius(double volume) { return std::cbrt(0.75 * volume / M_PI); }

/// A row between the two sides of a touch, R (w_b - w_a) . axis for each, bounded by nothing yet.
contact::ProblemContact couple(const IslandContext& in, Step& step, const Touch& t,
                               std::span<const Vec3> axes) {
  const int a = t.a.kind == Partner::Kind::block ? in.local[static_cast<std::size_t>(t.a.index)] : -1,
            b = in.local[static_cast<std::size_t>(t.b)];
  const double arm = rolling_arm(in, t);
  contact::ProblemContact c;
  c.first_term = static_cast<int>(step.problem.terms.size());
  for (const auto& [body, sign] : {std::pair(a, -1.0), std::pair(b, 1.0)}) {
    if (body < 0) continue;
    step.problem.terms.push_back({body, static_cast<int>(step.problem.jacobians.size())});
    push_couple(step.problem.jacobians, axes, step.bodies[static_cast<std::size_t>(body)].ndof, sign * arm);
  }
  c.terms = static_cast<int>(step.problem.terms.size()) - c.first_term;
  c.bias[0] = 1;  // its normal row never closes
  c.compliance[0] = 1 / in.model.blocks[static_cast<std::size_t>(t.b)].mass;
  return c;
}

}  // namespace

double rolling_arm(const IslandContext& in, const Touch& t) {
  const double arm = equivalent_radius(in.model.blocks[static_cast<std::size_t>(t.b)].volume);
  if (t.a.kind != Partner::Kind::block || in.local[static_cast<std::size_t>(t.a.index)] < 0) return arm;
  const double other = equivalent_radius(in.model.blocks[static_cast<std::size_t>(t.a.index)].volume);
  return arm * other / (arm + other);
}

void add_rolling_rows(const IslandContext& in, Step& step) {
  for (std::size_t i = 0; i < step.touches.size(); ++i) {
    Touch& t = step.touches[i];
    t.couple_of = -1;
    if (couples(t) == 0) continue;
    for (std::size_t k = i; k-- > 0 && step.touches[k].a == t.a && step.touches[k].b == t.b;)
      if (couples(step.touches[k]) > 0 && roll_as_one(step.touches[k], t)) t.couple_of = static_cast<int>(k);
    if (t.couple_of >= 0) continue;
    const auto add = [&](std::span<const Vec3> axes) {
      step.problem.contacts.push_back(couple(in, step, t, axes));
    };
    const std::array<Vec3, 2> tangents{t.frame.col(1), t.frame.col(2)};
    const std::array<Vec3, 1> normal{t.frame.col(0)};
    if (t.law->rolling_resistance > 0) add(tangents);
    if (t.law->drilling_resistance > 0) add(normal);
  }
}

void add_rocking_rows(const IslandContext& in, Step& step, double h, bool first_pass) {
  constexpr std::size_t corners = 3;  // of a face, at least
  step.rocking_rows = 0;
  if (!step.sprung) return;
  const double arm = contact::tolerances().rocking_arm * in.settings.accuracy * in.scale.length;
  for (std::size_t from = 0, to = 0; from < step.touches.size(); from = to) {
    const Touch& first = step.touches[from];
    std::size_t points = 0;
    double pressed = 0, meets = 0;
    bool swings = false;
    for (; to < step.touches.size() && step.touches[to].a == first.a && step.touches[to].b == first.b; ++to) {
      const Touch& t = step.touches[to];
      if (t.row < 0 || t.stiffness == 0) continue;
      ++points;
      swings = swings || t.energetic;
      meets += std::max(0.0, -t.approach) * t.stiffness /
               t.rate_sq;  // impulse that stops its part of the masses [N s]
      pressed += std::max(0.0, first_pass ? h * t.at.normal.dot(t.warm) : t.impulse[0]);
    }
    if (!swings || points < corners || first.b < 0) continue;
    const auto& t =
        *std::find_if(step.touches.begin() + static_cast<std::ptrdiff_t>(from), step.touches.end(),
                      [](const Touch& of) { return of.row >= 0 && of.stiffness > 0; });
    contact::ProblemContact c = couple(in, step, t, std::array<Vec3, 2>{t.frame.col(1), t.frame.col(2)});
    c.cohesion = arm / rolling_arm(in, t) * (pressed > 0 ? pressed : meets);
    step.problem.contacts.push_back(c);
    ++step.rocking_rows;
  }
}

double limit_rolling(Step& step, const std::function<double(const Touch&)>& pressed) {
  std::vector<double> all_pressed(step.touches.size(), 0.0);
  for (std::size_t i = 0; i < step.touches.size(); ++i) {
    const Touch& t = step.touches[i];
    if (t.row < 0 || !t.rolls) continue;
    all_pressed[t.couple_of < 0 ? i : static_cast<std::size_t>(t.couple_of)] += std::max(0.0, pressed(t));
  }
  double change = 0, all = 0;
  each_rolling(
      step.touches, step.problem, [&](const Touch& t, double resistance, contact::ProblemContact& c) {
        const double bound = resistance * all_pressed[static_cast<std::size_t>(&t - step.touches.data())];
        change += std::abs(bound - c.cohesion);
        all += bound;
        c.cohesion = bound;
      });
  return all > 0 ? change / all : 0;
}

}  // namespace talus::coupling

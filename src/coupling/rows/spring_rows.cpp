// Contact springs as rows: linear ones exactly, curved ones and those at a structure by their tangent at the
// predicted end.
#include "coupling/rows/spring_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/springs/spring_energy.hpp"
#include "coupling/step/bodies.hpp"

namespace talus::coupling {

namespace {

struct Tangent {
  double force = 0, slope = 0;  // [N], [N/m]
  bool follows_law = true;
};

/// Whether the step resolves the contact's own oscillation, so that the rule without loss may be used.
bool conserving(const IslandContext& in, const Step& step, const Touch& t, const contact::ProblemContact& c,
                double h) {
  return h * h * std::max(t.stiffness, t.normal_law.slope(-t.gap_ref)) * normal_compliance(in, step, c) < 1;
}

/// What an impulse of such a contact lasts for: from half step to half step, as the structure's own forces do
/// [s].
double lasts_at_structure(const Step& step, const Touch& t, double h) {
  return t.mode == Mode::spring_secant ? step.between_half_steps(t, h) : h;
}

/// Force and tangent of such a contact's law over the step, where it ends at the touch's indentation.
Tangent tangent_at_structure(const Step& step, const Touch& t, double h) {
  const double end = t.indentation,
               before = -t.at.gap +
                        step.length_before(t, h) * t.approach;  // the latter: at the start of the last step
  Tangent at;
  if (t.mode == Mode::spring_end) {
    at.force = t.normal_law.force(std::max(end, 0.0));
    at.slope = t.normal_law.slope(end);
    at.follows_law = end > 0;
    return at;
  }
  at.force = t.normal_law.secant(before, end, at.slope);
  at.follows_law = end > 0 || before > 0;
  if (end <= 0 && before > 0) {
    // It comes out on the way from where it was a step ago, and gives back what it held there: no more than
    // the books of the half step in between leave it.
    at.force = std::min(at.force, 2 * std::max(0.0, t.stored - t.sheared) / (before - end));
    at.slope = std::max(at.force / (before - end), contact::tolerances().level_law * t.stiffness);
  }
  return at;
}

}  // namespace

double normal_compliance(const IslandContext& in, const Step& step, const contact::ProblemContact& c) {
  double sum = 0;
  for (int k = 0; k < c.terms; ++k) {
    const contact::ContactTerm& term = step.problem.terms[static_cast<std::size_t>(c.first_term + k)];
    const double* j = step.problem.jacobians.data() + term.jacobian;
    if (term.body < static_cast<int>(step.bodies.size())) {
      const Body& b = step.bodies[static_cast<std::size_t>(term.body)];
      Vec12 row = Vec12::Zero();
      for (int i = 0; i < b.ndof; ++i) row[i] = j[3 * i];
      sum += row.head(b.ndof).dot(b.free.inverse.topLeftCorner(b.ndof, b.ndof) * row.head(b.ndof));
    } else if (in.condensed) {
      const CondensedSurface& s =
          step.condensed_surfaces[static_cast<std::size_t>(term.body) - step.bodies.size()];
      const Eigen::Map<const VecX, 0, Eigen::InnerStride<3>> row(j, s.inverse.rows());
      sum += row.dot(s.inverse * row);
    } else {
      const NodeBody& n = step.nodes[static_cast<std::size_t>(term.body) - step.bodies.size()];
      sum += (j[0] * j[0] + j[3] * j[3] + j[6] * j[6]) / n.mass;
    }
  }
  return sum;
}

void secant_row(const IslandContext& in, const Step& step, Touch& t, contact::ProblemContact& c, double h,
                bool first_pass) {
  t.theta = 1;
  if (first_pass && !conserving(in, step, t, c, h)) t.mode = Mode::spring_end;
  if (t.mode == Mode::spring_secant) t.normal_law.begin_step(-t.at.gap);
  // p = h (F(x) - dashpot x velocity), h the mean of this step and the one before, F by its tangent: at the
  // indentation that the last force leads to, then at the one reached.
  const double warm = t.frame.col(0).dot(t.warm) * h;
  if (first_pass) t.indentation = -(t.gap_ref + h * normal_compliance(in, step, c) * std::max(0.0, warm));
  Tangent at = tangent_at_structure(step, t, h);
  if (!at.follows_law) {
    // Open as far as can be told: from zero, with the slope of the way it could still go.
    const double way = std::max(h * std::abs(t.u_ref), contact::tolerances().overlap_none * in.scale.length);
    t.indentation = at.force = 0;
    at.slope =
        t.mode == Mode::spring_secant ? t.normal_law.work(way) / (way * way) : t.normal_law.force(way) / way;
    at.slope = std::max(at.slope, contact::tolerances().level_law * t.stiffness);
  } else if (t.indentation > 0 && at.slope < 1e-3 * t.stiffness) {
    // A level stretch of the law (crushing, or the hollow that it left) still needs a row: a hundredth of
    // what the bodies' inertia gives, so that round-off in it stays small.
    at.slope = std::max(at.slope, std::min(t.stiffness, 0.01 / (h * h * normal_compliance(in, step, c))));
  }
  const double share =
      t.mode == Mode::spring_secant ? 0.5 : 1;  // of the dashpot's velocity that is the end's
  const double lasts = lasts_at_structure(step, t, h);
  c.compliance[0] = 1 / (lasts * h * at.slope + share * lasts * t.dashpot);
  c.bias[0] =
      -c.compliance[0] * (lasts * at.force - lasts * at.slope * (t.gap_ref + t.indentation - h * t.u_ref) -
                          (1 - share) * lasts * t.dashpot * t.approach);
}

bool follows_law(const IslandContext& in, const Step& step, const Touch& t, double h, double allowed) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const double u = t.u_ref - (t.indentation + t.gap_ref) / h;  // at the end [m/s]
  const Tangent at = tangent_at_structure(step, t, h);
  const double damped = t.dashpot * (t.mode == Mode::spring_secant ? 0.5 * (t.approach + u) : u);
  const double asked =
      std::max(0.0, lasts_at_structure(step, t, h) * ((at.follows_law ? at.force : 0.0) - damped));
  return std::abs(c.impulse[0] - asked) <=
         allowed * (c.impulse[0] + h * t.stiffness * contact::tolerances().follows_law * in.scale.length);
}

void shear_row(const IslandContext& in, const Step& step, Touch& t, contact::ProblemContact& c, double h,
               const Vec3& moved, const Vec3& u_ref) {
  const Vec3 d = t.frame.transpose() * t.shear,
             way = t.frame.transpose() *
                   t.shear_way;  // elongation at the start, and what the step before added
  t.shears_by_half = t.mode == Mode::spring_secant && in.deformable_structure(t) && !t.normal_law.bed &&
                     h * h * t.shear_stiffness * normal_compliance(in, step, c) < 1;
  for (int i = 1; i < 3; ++i) {
    if (t.shears_by_half) {
      c.compliance[i] = 2 / (step.between_half_steps(t, h) * h * t.shear_stiffness);
      c.bias[i] = (2 * d[i] - way[i] + moved[i]) / h - u_ref[i];
    } else if (t.mode == Mode::spring_mean) {
      c.compliance[i] = 4 / (h * h * t.shear_stiffness);
      c.bias[i] = 2 * (2 * d[i] + moved[i]) / h - u_ref[i];
    } else {
      c.compliance[i] = 1 / (h * h * t.shear_stiffness);
      c.bias[i] = (d[i] + moved[i]) / h - u_ref[i];
    }
  }
}

}  // namespace talus::coupling

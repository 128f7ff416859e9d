// Work of a step's impulses, booked where it is done.
#include <algorithm>
#include <cmath>

#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {

/// Mean generalised velocity whose product with an impulse is the kinetic energy it brings.
Vec12 mean_velocity(const Vec12& v0, const dda::FreeFlow& free, const Vec12& v) {
  Vec12 m = 0.5 * (v0 + v);
  m.segment<3>(3) = 0.5 * (free.spin + v.segment<3>(3));
  return m;
}

/// What the contacts of one problem take, sorted so that friction never gives back.
///
/// An impulse with the mean of the velocities before and after is its work, exactly; but where an impact turns the slip round, or begins it, the
/// friction that opposes the slip at its end seems to have driven. Only the sum of both losses is known: the impact's is less by as much.
struct ContactLoss {
  double friction = 0;   // of hard contacts and rolling, each at least nothing [J]
  double driven = 0;     // what friction seems to have given, at most nothing [J]
  double impact = 0;     // of the normals of what meets [J]
  double sprung = 0;     // friction on springs, up to the scheme's own error [J]

  void slides(double lost) { (lost > 0 ? friction : driven) += lost; }

  void settle(Ledger& ledger) const {
    double slid = friction, met = impact;
    const double taken = std::min(-driven, std::max(met, 0.0));
    met -= taken;
    slid += driven + taken;
    const double scheme = std::min(slid, 0.0);
    slid -= scheme;
    const double shared = met < 0 ? std::min(-met, slid) : 0;   // the normals drove what friction took
    met += shared;
    slid -= shared;
    ledger.friction_work += slid + std::max(sprung, 0.0);
    ledger.damping_work += met;
    ledger.algorithmic += scheme + std::min(sprung, 0.0);
  }
};

}  // namespace

void IslandStepper::book(double h) {
  using Rows = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  double onset = 0;   // what hard contacts and dashpots at structures take
  ContactLoss loss;
  for (const Touch& t : touches_) {
    if (t.row < 0) continue;
    const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
    Vec3 blocks = Vec3::Zero(), structure = Vec3::Zero(), last = Vec3::Zero();   // mean relative velocity, split by side; that at the end
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      const int n = problem_.bodies[static_cast<std::size_t>(term.body)].ndof;
      const Rows j(problem_.jacobians.data() + term.jacobian, 3, n);
      if (term.body < static_cast<int>(bodies_.size())) {
        const Body& b = bodies_[static_cast<std::size_t>(term.body)];
        blocks += j * mean_velocity(b.v0, b.free, b.v_solved).head(n);
        last += j * b.v_solved.head(n);
      } else {
        // The leapfrog's work is impulse times the mean of the half-step velocities before and after.
        const int offset = problem_.bodies[static_cast<std::size_t>(term.body)].offset;
        const Eigen::Map<const VecX> end(problem_.v.data() + offset, n);
        const std::size_t part = static_cast<std::size_t>(term.body) - bodies_.size();
        last += j * end;
        if (condensed_) structure += j * (0.5 * (skins_[part].v_before + end));
        else structure += j * (0.5 * (nodes_[part].v_before + end));
      }
    }
    const Vec3 mean = blocks + structure;
    const double normal_work = c.impulse[0] * mean[0];
    const double slip_work = c.impulse.tail<2>().dot(mean.tail<2>());
    if (deformable_structure(t)) {
      pending_.blocks_contact_work += c.impulse.dot(blocks);
      pending_.structure_contact_work += c.impulse.dot(structure);
    }
    const bool sprung = t.stiffness > 0 && h > 0;
    if (!sprung) {
      loss.slides(-slip_work);
      if (t.mode == Mode::closed)
        pending_.algorithmic -= normal_work;
      else
        loss.impact -= normal_work;
      if (t.mode != Mode::closed && h > 0 && leapfrog()) onset -= normal_work;
      continue;
    }
    // Springs: what they store; the rest of the normal work is the rule's own loss, of the tangential friction.
    const double stretch = t.shear_stiffness > 0 ? 0.5 * t.shear_stiffness * (shear_at_end(t, h).squaredNorm() - t.shear.squaredNorm()) : 0;
    if (leapfrog() && t.shear_stiffness == 0) {
      // Friction takes its force times the slip at the end; that the leapfrog's work is with the mean velocity is the scheme's.
      const double slipped = std::max(0.0, -c.impulse.tail<2>().dot(last.tail<2>()));
      pending_.friction_work += slipped;
      pending_.algorithmic -= slip_work + slipped;
    } else if (leapfrog()) {
      const bool slides = c.impulse.tail<2>().norm() >= (c.friction * c.impulse[0] + c.cohesion) * (1 - 1e-9);
      const Vec3 end = shear_at_end(t, h), moved = t.shear + h * (t.frame.rightCols<2>() * last.tail<2>());
      const double slipped = slides ? std::max(0.0, t.shear_stiffness * end.dot(moved - end)) : 0.0;
      pending_.friction_work += slipped;
      pending_.algorithmic -= slip_work + stretch + slipped;
    } else {
      loss.sprung -= slip_work + stretch;
    }
    const double crushed = t.mode == Mode::spring_secant ? t.normal_law.crushing_by_half(-t.at.gap + h * t.approach, t.indentation) : t.normal_law.crushing(t.indentation);
    pending_.damping_work += crushed;
    // With a dashpot the loss is mostly its own. From what the ledger counts as stored: nothing is lost with a changed feature.
    const double freed = freed_shear(t);
    pending_.friction_work += freed;
    // What the stretched spring of a bond that gives way held is lost with it.
    const double torn = t.indentation < 0 && t.pulls() && gives_way(t) ? pull_energy(t, t.indentation) : 0.0;
    pending_.damping_work += torn;
    const double lost = -(normal_work + torn + (spring_energy_at_end(t, h) - t.stored) - stretch + crushed + freed);
    (t.dashpot > 0 ? pending_.damping_work : pending_.algorithmic) += lost;
    if (t.dashpot > 0 && leapfrog()) onset += std::max(0.0, lost);
  }
  const auto work = [&](const contact::ProblemContact& c) {
    double sum = 0;
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      const Body& b = bodies_[static_cast<std::size_t>(term.body)];
      const Rows j(problem_.jacobians.data() + term.jacobian, 3, b.ndof);
      sum += c.impulse.dot(j * mean_velocity(b.v0, b.free, b.v_solved).head(b.ndof));
    }
    return sum;
  };
  each_rolling(touches_, problem_, [&](const Touch&, const contact::ProblemContact& c) { loss.slides(-work(c)); });
  each_held(touches_, problem_, [&](const contact::ProblemContact& c) { (h > 0 ? pending_.algorithmic : loss.impact) -= work(c); });
  loss.settle(pending_);
  for (const Body& b : bodies_) {
    if (b.impulse.isZero(0) && !b.end_rule) continue;
    const auto k = static_cast<std::size_t>(b.block);
    const dda::Model::Block& block = model_.blocks[k];
    // Positions that left the trapezoid (theta = 1) met gravity and the block's own stiffness elsewhere than the velocities did.
    const Vec3 trapezoid = b.start.c + 0.5 * h * (b.v0.head<3>() + b.v_solved.head<3>());
    pending_.algorithmic += block.mass * model_.gravity.dot(state_.c[k] - trapezoid);
    if (b.ndof == 12 && b.end_rule) {
      // The velocities met the stress at the end all along the step.
      const Vec6 eps = b.eps0 + 0.5 * h * (b.v0.tail<6>() + b.v_solved.tail<6>());
      const Mat6 stiffness = block.volume * dda::elastic_matrix(block.young, block.poisson);
      const double stored = 0.5 * state_.eps[k].dot(stiffness * state_.eps[k]);
      pending_.algorithmic += (eps - b.eps0).dot(stiffness * state_.eps[k]) - (stored - 0.5 * b.eps0.dot(stiffness * b.eps0));
    }
  }
  for (const Body& b : bodies_) {
    if (b.ndof == 6) {
      // The momentum is exact at the orientation reached, where the inertia is another than the one that the impulse met. A rigid impulse of a
      // straining block turns its strain rate as well.
      const bool changes = h > 0 || model_.blocks[static_cast<std::size_t>(b.block)].deformable;
      if (changes && !b.impulse.isZero(0)) pending_.algorithmic -= internal_energy(b.block) - b.internal0 - b.impulse.segment<3>(3).dot(mean_velocity(b.v0, b.free, b.v_solved).segment<3>(3));
      continue;
    }
    const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(b.block)];
    const Vec6 rate = 0.5 * (b.v0.tail<6>() + b.v_solved.tail<6>());
    const Vec6 viscous = b.end_rule ? Vec6(b.v_solved.tail<6>()) : rate;   // the rate that made the viscous stress
    const double damped = h * block.strain_damping * block.volume * rate.dot(dda::elastic_matrix(block.young, block.poisson) * viscous);
    pending_.damping_work += damped;
    // Turning changes the inertia that straining meets and the other way round; the trapezoid of the strain keeps their energy to order 2.
    if (!b.end_rule && h > 0)
      pending_.algorithmic -= internal_energy(b.block) - b.internal0 + damped - b.impulse.tail<9>().dot(mean_velocity(b.v0, b.free, b.v_solved).tail<9>());
  }
  // A hard contact (or a stiff dashpot) at a structure acts at the end of the step, not along it: its work with the mean velocities counts as lost what the block's
  // own energy says was not, so that only the sum of both is known.
  const double overcounted = std::clamp(-pending_.algorithmic, 0.0, std::max(onset, 0.0));
  pending_.damping_work -= overcounted;
  pending_.algorithmic += overcounted;
}

/// Columns of a bed that come out of contact lose the last of their pressure sheared: what they held slips away.
double IslandStepper::freed_shear(const Touch& t) const {
  if (!t.normal_law.bed) return 0;
  const std::vector<ContactMemory>& memory = history_[static_cast<std::size_t>(t.b)];
  const auto last = std::lower_bound(memory.begin(), memory.end(), std::pair(t.a.id(), t.at.key), [](const ContactMemory& m, const std::pair<std::uint64_t, std::uint64_t>& key) { return std::pair(m.partner, m.feature) < key; });
  if (last == memory.end() || last->partner != t.a.id() || last->feature != t.at.key || last->stiffness <= t.stiffness) return 0;
  return std::max(0.0, last->shear_energy - 0.5 * t.shear_stiffness * t.shear.squaredNorm());
}

double IslandStepper::internal_energy(int block) const {
  const dda::BlockEnergy e = dda::energy(model_, state_, block);
  return e.rotational + e.straining + e.strain_energy;
}

}  // namespace talus::coupling

// Work of a step's impulses, accounted for where it is done.
#include "coupling/step/works.hpp"

#include <algorithm>
#include <cmath>

#include "coupling/rows/bonds.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/springs/spring_energy.hpp"

namespace talus::coupling {
namespace {

/// Mean generalised velocity whose product with an impulse is the energy it brings, to motion and to drag.
Vec12 mean_velocity(const Vec12& v0, const dda::FreeFlow& free, const Vec12& v) {
  Vec12 m = 0.5 * (v0 + v);
  if (free.theta != 0.5) m.head<3>() = ((1 - free.theta) * v0 + free.theta * v).head<3>();
  m.segment<3>(3) = 0.5 * (free.spin + v.segment<3>(3));
  return m;
}

/// What the contacts of one problem take, sorted so that friction never gives back.
///
/// An impulse with the mean of the velocities before and after is its work, exactly; but where an impact
/// turns the slip round, or begins it, the friction that opposes the slip at its end seems to have driven.
/// Only the sum of both losses is known: the impact's is less by as much.
struct ContactLoss {
  double friction = 0;  // of hard contacts and rolling, each at least nothing [J]
  double driven = 0;    // what friction seems to have given, at most nothing [J]
  double impact = 0;    // of the normals of what meets [J]
  double sprung = 0;    // friction on springs, up to the scheme's own error [J]

  void slides(double lost) { (lost > 0 ? friction : driven) += lost; }
  ContactLoss& operator+=(const ContactLoss& o) {
    friction += o.friction;
    driven += o.driven;
    impact += o.impact;
    sprung += o.sprung;
    return *this;
  }

  /// What the normals took in the end [J].
  double settle(Ledger& ledger) const {
    double slid = friction, met = impact;
    const double taken = std::min(-driven, std::max(met, 0.0));
    met -= taken;
    slid += driven + taken;
    const double scheme = std::min(slid, 0.0);
    slid -= scheme;
    const double shared = met < 0 ? std::min(-met, slid) : 0;  // the normals drove what friction took
    met += shared;
    slid -= shared;
    ledger.friction_work += slid + std::max(sprung, 0.0);
    ledger.damping_work += met;
    ledger.algorithmic += scheme + std::min(sprung, 0.0);
    return met;
  }
};

/// What crushes between the half steps before and after [J]; `before`: indentation at the start of the last
/// step. What yields now is taken to have yielded on the whole way of the last step. Where it began to yield
/// on that way only the rest of it went into crushing: what the last half step holds tells how much was
/// stored.
double crushed_by_half(const Touch& t, double before) {
  if (!t.law->crushes()) return 0;
  const double stored_before = 2 * (t.stored - t.sheared) - t.normal_law.stored(-t.at.gap);
  const double last =
      std::clamp(stored_before - t.normal_law.before(before), 0.0, -t.normal_law.crushing_before(before));
  return 0.5 * (t.normal_law.crushing(t.indentation) + last);
}

/// The works of one step, or of one impulse of no duration (h = 0), or of some of its rows or bodies.
struct WorkAccount {
  const IslandContext& in;
  Step& step;
  double h;
  Ledger pending{};
  ContactLoss loss{};
  double onset =
      0;  // what hard contacts and dashpots take where only the sum of it and the scheme's part is known
  double reading = 0;  // of pressed blocks: their velocities are those of half steps, their heights are not;
                       // adds up to nothing from landing to take-off

  using Rows = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  /// Velocities of a row's two sides: the mean of the step by side, and that at its end.
  struct Slip {
    Vec3 blocks = Vec3::Zero(), structure = Vec3::Zero(), last = Vec3::Zero();
  };

  Slip slip(const contact::ProblemContact& c) const;
  double work(const contact::ProblemContact& c) const;
  void row(const Touch& t);
  void hard_row(const Touch& t, const contact::ProblemContact& c, const Slip& slip);
  void spring_row(const Touch& t, const contact::ProblemContact& c, const Slip& slip);
  double stretched(const Touch& t) const;
  double slid_before(const Touch& t, const contact::ProblemContact& c, const Slip& slip) const;
  void shear(const Touch& t, const contact::ProblemContact& c, const Slip& slip);
  void position(const Body& b);
  void turning(const Body& b);
  void straining(const Body& b);
  void add(const WorkAccount& o);
  template <class Thing, class Use>
  void each(const std::vector<Thing>& things, int at_once, Use&& use);
};

void WorkAccount::add(const WorkAccount& o) {
  pending += o.pending;
  loss += o.loss;
  onset += o.onset;
  reading += o.reading;
}

/// Calls use(books, thing) for all things, on several threads where it pays: `at_once` of them share one
/// book, which are then added one after the other.
template <class Thing, class Use>
void WorkAccount::each(const std::vector<Thing>& things, int at_once, Use&& use) {
  const int n = static_cast<int>(things.size()), books = (n + at_once - 1) / at_once;
  std::vector<WorkAccount> parts(static_cast<std::size_t>(books), WorkAccount{in, step, h});
  contact::in_ranges(books, in.settings.threads < 2 ? books : 2, [&](int from, int to) {
    for (int part = from; part < to; ++part)
      for (int i = part * at_once; i < std::min(n, (part + 1) * at_once); ++i)
        use(parts[static_cast<std::size_t>(part)], things[static_cast<std::size_t>(i)]);
  });
  for (const WorkAccount& part : parts) add(part);
}

WorkAccount::Slip WorkAccount::slip(const contact::ProblemContact& c) const {
  Slip s;
  for (const contact::ContactTerm& term : step.problem.terms_of(c)) {
    const contact::ProblemBody& body = step.problem.body_of(term);
    const auto j = step.problem.jacobian(term);
    if (term.body < static_cast<int>(step.bodies.size())) {
      const Body& b = step.bodies[static_cast<std::size_t>(term.body)];
      s.blocks += j * mean_velocity(b.v0, b.free, b.v_solved).head(body.ndof);
      s.last += j * b.v_solved.head(body.ndof);
    } else {
      // The leapfrog's work is impulse times the mean of the half-step velocities before and after.
      const Eigen::Map<const VecX> end(step.problem.v.data() + body.offset, body.ndof);
      const std::size_t part = static_cast<std::size_t>(term.body) - step.bodies.size();
      s.last += j * end;
      if (in.condensed)
        s.structure += j * (0.5 * (step.condensed_surfaces[part].v_before + end));
      else
        s.structure += j * (0.5 * (step.nodes[part].v_before + end));
    }
  }
  return s;
}

/// Of an impulse on the blocks, by their mean velocities [J].
double WorkAccount::work(const contact::ProblemContact& c) const { return c.impulse.dot(slip(c).blocks); }

void WorkAccount::row(const Touch& t) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const Slip s = slip(c);
  if (in.deformable_structure(t)) {
    pending.blocks_contact_work += c.impulse.dot(s.blocks);
    pending.structure_contact_work += c.impulse.dot(s.structure);
  }
  if (t.stiffness > 0 && h > 0)
    spring_row(t, c, s);
  else
    hard_row(t, c, s);
}

void WorkAccount::hard_row(const Touch& t, const contact::ProblemContact& c, const Slip& s) {
  const Vec3 mean = s.blocks + s.structure;
  const double normal_work = c.impulse[0] * mean[0], slip_work = c.impulse.tail<2>().dot(mean.tail<2>());
  if (step.from_start &&
      step.bodies[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)])].from_start) {
    // Positions go by the velocities at the end, and so does the slip: friction takes its force times that.
    // What lasts and is slowed by the onset, at the start, rubs by the mean of its slips, as in an impact of
    // no duration. By the means of the velocities the normals have taken the rest.
    const double by_end = -c.impulse.tail<2>().dot(s.last.tail<2>()),
                 slid = std::max({0.0, by_end, t.mode == Mode::closed ? -slip_work : 0.0});
    loss.slides(slid);
    (t.mode == Mode::closed ? pending.algorithmic : loss.impact) -= normal_work + slip_work + slid;
    return;
  }
  loss.slides(-slip_work);
  (t.mode == Mode::closed ? pending.algorithmic : loss.impact) -= normal_work;
  const bool by_end = in.leapfrog() || (step.sprung && t.theta == 1);  // its blocks go by x + h v^+
  if (t.mode != Mode::closed && h > 0 && by_end) onset -= normal_work;
}

/// Energy that the shear spring has taken up in the step [J].
double WorkAccount::stretched(const Touch& t) const {
  return shear_energy_at_end(step, t, h) -
         (t.shears_by_half ? t.sheared : 0.5 * t.shear_stiffness * t.shear.squaredNorm());
}

/// Springs: what they store; the rest of the normal work is the rule's own loss, of the tangential friction.
void WorkAccount::spring_row(const Touch& t, const contact::ProblemContact& c, const Slip& s) {
  const Vec3 mean = s.blocks + s.structure;
  shear(t, c, s);
  const double crushed = booked_by_craters(t) ? t.crushed - t.crushed_ahead + crushed_ahead(t)
                         : t.mode == Mode::spring_secant
                             ? crushed_by_half(t, -t.at.gap + step.length_before(t, h) * t.approach)
                             : t.normal_law.crushing(t.indentation);
  (t.law->yields() ? pending.yield_work : pending.damping_work) += crushed;
  // With a dashpot the loss is mostly its own. From what the ledger counts as stored: nothing is lost with a
  // changed feature.
  const double freed = freed_shear(in, t);
  pending.friction_work += freed;
  // What the stretched spring of a bond that gives way held is lost with it.
  const double torn =
      t.indentation < 0 && t.pulls() && spring_bond_gives_way(step, t) ? pull_energy(t, t.indentation) : 0.0;
  pending.damping_work += torn;
  const double lost = -(c.impulse[0] * mean[0] + torn + (spring_energy_at_end(step, t, h) - t.stored) -
                        stretched(t) + crushed + freed);
  (t.dashpot > 0 ? pending.damping_work : pending.algorithmic) += lost;
  if (t.dashpot > 0 && in.leapfrog()) onset += std::max(0.0, lost);
}

/// Friction in the half step before of what sticks now: the impulse stands for the time from half step to
/// half step, and where the last step slid, half of that slip lies in it [J].
double WorkAccount::slid_before(const Touch& t, const contact::ProblemContact& c, const Slip& s) const {
  if (!t.shears_by_half) return 0;
  const Vec3 before = 2 * (s.blocks + s.structure) - s.last, stretched = t.frame.transpose() * t.shear_way;
  return std::max(0.0,
                  -0.5 * c.impulse.tail<2>().dot((before - stretched / step.length_before(t, h)).tail<2>()));
}

void WorkAccount::shear(const Touch& t, const contact::ProblemContact& c, const Slip& s) {
  const double slip_work = c.impulse.tail<2>().dot((s.blocks + s.structure).tail<2>()),
               stretch = stretched(t);
  // Of what slides, the ground in the way takes its part of the cone.
  const double bound = c.friction * c.impulse[0] + c.cohesion,
               in_the_way = t.ploughing > 0 && bound > 0 ? std::min(1.0, t.ploughing / bound) : 0.0;
  if (!in.leapfrog()) {
    const double lost = -(slip_work + stretch), ploughed = in_the_way * std::max(0.0, lost);
    loss.sprung += lost - ploughed;
    pending.ploughing_work += ploughed;
    return;
  }
  // What slides loses its force times the mean slip, as the bodies do; what sticks has no loss of its own but
  // for the half step before, and what would drive is the scheme's.
  const double lost = -(slip_work + stretch);
  const bool slides = t.shear_stiffness == 0 || at_coulomb_bound(c, c.impulse);
  const double slid = std::max(0.0, slides ? lost : std::min(lost, slid_before(t, c, s)));
  pending.friction_work += (1 - in_the_way) * slid;
  pending.ploughing_work += in_the_way * slid;
  pending.algorithmic += lost - slid;
}

/// Positions that left the trapezoid met gravity elsewhere than the velocities did.
void WorkAccount::position(const Body& b) {
  const auto k = static_cast<std::size_t>(b.block);
  const dda::Model::Block& block = in.model.blocks[k];
  const Vec3 trapezoid = b.start.c + h * mean_velocity(b.v0, b.free, b.v_solved).head<3>();
  // Blocks that an impact stopped at the start of the step stay higher than the means of the velocities say:
  // so much less it took.
  const double sunk = block.mass * in.model.gravity.dot(in.state.c[k] - trapezoid);
  (b.from_start && sunk < 0 ? loss.impact : pending.algorithmic) += sunk;
}

/// The momentum is exact at the orientation reached, where the inertia is another than the one that the
/// impulse met. A rigid impulse of a straining block turns its strain rate as well.
void WorkAccount::turning(const Body& b) {
  const bool changes = h > 0 || in.model.blocks[static_cast<std::size_t>(b.block)].deformable;
  if (changes && !b.impulse.isZero(0))
    pending.algorithmic -= in.internal_energy(b.block) - b.internal0 -
                           b.impulse.segment<3>(3).dot(mean_velocity(b.v0, b.free, b.v_solved).segment<3>(3));
}

void WorkAccount::straining(const Body& b) {
  const dda::Model::Block& block = in.model.blocks[static_cast<std::size_t>(b.block)];
  const Vec6 rate = 0.5 * (b.v0.tail<6>() + b.v_solved.tail<6>());
  const Vec6 viscous = b.end_rule || b.strains_at_end ? Vec6(b.v_solved.tail<6>())
                                                      : rate;  // the rate that made the viscous stress
  const double damped = h * block.strain_damping * block.volume *
                        rate.dot(dda::elastic_matrix(block.young, block.poisson) * viscous);
  pending.damping_work += damped;
  // Turning changes the inertia that straining meets and the other way round; the trapezoid of the strain
  // keeps their energy to order 2. By the end rule the velocities met the stress at the end all along the
  // step.
  Eigen::Matrix<double, 9, 1> of_contacts = b.impulse.tail<9>();
  if (b.follows) of_contacts.tail<6>() -= b.strain_lag;
  if (h > 0)
    pending.algorithmic -= in.internal_energy(b.block) - b.internal0 + damped -
                           of_contacts.dot(mean_velocity(b.v0, b.free, b.v_solved).tail<9>());
}

}  // namespace

void account_works(const IslandContext& in, Step& step, double h) {
  WorkAccount books{in, step, h};
  books.each(step.touches, touches_at_once, [](WorkAccount& of, const Touch& t) {
    if (t.row >= 0) of.row(t);
  });
  each_rolling(step.touches, step.problem, [&](const Touch&, double, const contact::ProblemContact& c) {
    books.loss.slides(-books.work(c));
  });
  each_held(step.touches, step.problem, [&](const contact::ProblemContact& c) {
    (h > 0 ? books.pending.algorithmic : books.loss.impact) -= books.work(c);
  });
  books.each(step.bodies, bodies_at_once, [](WorkAccount& of, const Body& b) {
    if (b.drag > 0)
      of.pending.vegetation_work += dda::drag_work(of.in.model.blocks[static_cast<std::size_t>(b.block)].mass,
                                                   b.drag, of.h, b.v0.head<3>(), b.v_solved.head<3>());
    const double before = of.pending.algorithmic;
    if (!b.impulse.isZero(0) || b.end_rule || b.pressed) of.position(b);
    if (b.pressed) of.reading += of.pending.algorithmic - before;
    of.pending.algorithmic -= b.converted;
    of.reading -= b.converted;
    b.strains() ? of.straining(b) : of.turning(b);
  });
  step.pending += books.pending;
  const double met = books.loss.settle(step.pending);
  if (step.from_start) books.onset += met;
  // A hard contact (or a stiff dashpot) at a structure acts at the end of the step, an onset in a
  // time-stepped island at its start, neither along it: its work with the mean velocities counts as lost what
  // the block's own energy says was not, so that only the sum of both is known.
  const double overcounted =
      std::clamp(books.reading - step.pending.algorithmic, std::min(step.from_start ? met : 0.0, 0.0),
                 std::max(books.onset, 0.0));
  step.pending.damping_work -= overcounted;
  step.pending.algorithmic += overcounted;
}

}  // namespace talus::coupling

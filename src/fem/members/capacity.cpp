// Axial capacity of a member by push-down between rigid plates, from the present state.
//
//   N = (R_top + R_foot) / 2 - W / 2       the plates' reactions; half the sum cancels what inertia and
//                                          damping carry, to first order
//
// The member is cut out of a copy of the structure: only its cells and nodes are computed, its end sections
// are held where they are, and after the motion has settled the upper one is moved down the axis at a
// constant speed. Time is counted in
//
//   T = max(2 L / c, T_b / 2)              axial mode
//   T_b = 2 pi L^2 / (4.730^2 r c)         lowest bending mode between plates [timoshenko1974]
//
// Damping 2 pi / T is half of the critical one of the axial mode, and at most the critical one of bending: a
// slender member can follow its bow, which more damping would hold. The law's rate effect is off.
//
// symbol  meaning                                                            unit
// c       sqrt(E / rho)                                                      m/s
// r       least radius of gyration of the section, as built                  m
#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr double settle_periods = 12, periods_to_strain = 80;  // of T; to reach press_strain
constexpr double press_strain = 2e-3, last_strain = 2e-2;
constexpr double fallen = 0.6;      // of the greatest load: the test is over
constexpr int curve_samples = 100;  // of the curve, until press_strain

/// The curve of a test at one speed: means of its force over equal intervals, and the greatest of them.
class MeanCurve {
 public:
  MeanCurve(PushDown& out, double begin, double interval, double speed, std::string test)
      : out_(&out),
        next_(begin + interval),
        interval_(interval),
        half_way_(0.5 * speed * interval),
        test_(std::move(test)) {}
  /// The force of a step that ends at t, `way` behind [N, s, m]. True at the end of an interval whose mean
  /// has fallen well below the greatest.
  bool add(double force, double t, double way) {
    sum_ += force, ++steps_;
    if (t < next_) return false;
    const double mean = sum_ / static_cast<double>(steps_);
    if (!std::isfinite(mean)) throw NumericalFailure(fmt::format("{} failed at {:.4g} m", test_, way));
    out_->curve.push_back({way - half_way_, mean});
    if (mean > out_->capacity) out_->capacity = mean, out_->at = out_->curve.back()[0];
    next_ += interval_, sum_ = 0, steps_ = 0;
    return mean < fallen * out_->capacity;
  }

 private:
  PushDown* out_;
  double next_, interval_, half_way_, sum_ = 0;
  long steps_ = 0;
  std::string test_;
};

/// Least radius of gyration of the cells about the middle of their section [m]: by Simpson's rule over each
/// cell, exact for bricks.
double least_gyration(const HexMesh& mesh, const std::vector<int>& cells, const std::vector<double>& mass,
                      const Member& member) {
  double total = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (const int cell : cells) {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    Eigen::Matrix2d corners = Eigen::Matrix2d::Zero();
    for (const int n : mesh.hexes[cell]) {
      const Eigen::Vector2d x(mesh.nodes[n].dot(member.axis_x), mesh.nodes[n].dot(member.axis_y));
      centre += x / 8;
      corners += x * x.transpose() / 8;
    }
    total += mass[cell];
    first += mass[cell] * centre;
    second += mass[cell] * (2 * centre * centre.transpose() + corners) / 3;
  }
  first /= total;
  const Eigen::Matrix2d central = second / total - first * first.transpose();
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(central, Eigen::EigenvaluesOnly).eigenvalues()[0]);
}

/// Of the rest of the mesh nothing is left: its groups of elements and its nodes are passed over.
void compute_only(StructureBody& body, const std::vector<char>& cells) {
  body.bearings.reset();
  body.elements->restrict_to(cells);
  std::vector<char> node(body.mesh.nodes.size(), 0);
  for (std::size_t cell = 0; cell < cells.size(); ++cell)
    if (cells[cell])
      for (int n : body.mesh.hexes[cell]) node[n] = 1;
  body.own = ranges_of(node);
  body.elements->mark_nodes(node);
  if (body.bars) {
    body.bars->mark_nodes(node);
    body.bars->cells_changed();
  }
  body.touched = ranges_of(node);
}

/// A test at one speed, after the motion has settled: `drive(v)` moves the top at v [m/s] and returns the
/// load that it bears. Up to a way `last`, or where the load has fallen behind the way `least` [m].
template <class Drive>
void push(FemStructure& test, double settled, double interval, double speed, double last, double least,
          const std::string& name, PushDown& out, Drive&& drive) {
  const double h = test.critical_step();
  MeanCurve means(out, settled, interval, speed, name);
  double way = 0;
  for (double t = 0; way < last; t += h) {
    test.predict(t, h);
    const bool moving = t >= settled;
    const double load = drive(moving ? speed : 0.0);
    test.correct(t, h, {});
    if (!moving) continue;
    way += speed * h;
    if (means.add(load, t + h, way) && way > least) break;
  }
}
}  // namespace

CapacityTests::CapacityTests(const FemStructure& whole)
    : whole_(whole), body_(whole.body_), loads_(whole.loads_) {}

std::size_t CapacityTests::pier_count() const {
  return static_cast<std::size_t>(std::count_if(loads_.members().begin(), loads_.members().end(),
                                                [](const Member& m) { return !m.span; }));
}

void CapacityTests::needs_piers() const {
  if (pier_count() == 0)
    bad(body_.spec, "", "",
        "a capacity is one of a member: piers of a viaduct, a column or a box that is supported",
        "model the pier as a column, or the bridge as a viaduct");
  if (!body_.damage)
    bad(body_.spec, "damage", body_.spec.damage, "an elastic structure has no capacity",
        "run it with damage = \"concrete\" or \"concrete-cdpm2\"");
}

std::vector<PushDown> CapacityTests::push_down() {
  needs_piers();
  const std::size_t piers = pier_count();
  std::vector<PushDown> all;
  unharmed_.resize(piers);
  for (std::size_t k = 0; k < piers; ++k) {
    std::optional<PushDown>& known = unharmed_[k];
    const bool whole = unharmed(loads_.place(k).place);
    if (whole && known) {
      body_.report(
          fmt::format("push-down of {} {}: unharmed, as before", body_.spec.name, loads_.members()[k].name));
      all.push_back(*known);
      continue;
    }
    body_.report(
        fmt::format("push-down of {} {}, {} of {}", body_.spec.name, loads_.members()[k].name, k + 1, piers));
    all.push_back(push_down(k));
    body_.report(fmt::format("push-down of {} {}: {:.1f} kN at {:.3g} mm", body_.spec.name,
                             loads_.members()[k].name, all.back().capacity / 1e3, 1e3 * all.back().at));
    if (whole) known = all.back();
  }
  return all;
}

bool CapacityTests::unharmed(const PierPlace& place) const {
  return std::all_of(place.cells.begin(), place.cells.end(),
                     [this](int cell) { return body_.live[cell] && !body_.damage->has(cell); });
}

/// A copy of this structure in which only the member is left, at rest between its plates, or on the lower one
/// alone.
std::unique_ptr<FemStructure> CapacityTests::cut_out(const PierPlace& place, bool top_held) const {
  StructureSpec spec = body_.spec;
  spec.gravity_preload = false;
  spec.rate_effect = false;
  spec.damping_ratio = 0;
  spec.loads.clear();
  spec.probes.clear();
  auto copy = std::make_unique<FemStructure>(
      spec, body_.gravity, [](const std::string&) {}, body_.struck_zones, &whole_);
  std::vector<double> state;
  whole_.save(state);
  copy->restore(state);
  copy->loads_.track().clear();  // nobody asks what it carries on the way
  std::vector<char> inside(body_.mesh.hexes.size(), 0);
  for (int cell : place.cells) inside[cell] = 1;
  std::vector<int> outside;
  for (int cell = 0; cell < static_cast<int>(inside.size()); ++cell)
    if (!inside[cell] && copy->body_.live[cell]) outside.push_back(cell);
  copy->fracture_.switch_off(outside);
  for (int n = 0; n < static_cast<int>(body_.mesh.nodes.size()); ++n) {
    copy->body_.supports.held[n] = {false, false, false};
    if (copy->body_.cells_at_node[n] == 0) copy->fracture_.remove_node(n);
    for (int c = 0; c < 3; ++c) {
      copy->body_.inverse_mass[4 * n + c] = copy->body_.mass[n] > 0 ? 1 / copy->body_.mass[n] : 0;
      copy->fields_.v[4 * n + c] = 0;
    }
  }
  for (const std::vector<int>* plate : {&place.foot, &place.top})
    for (int n : plate == &place.foot || top_held ? *plate : std::vector<int>{})
      for (int c = 0; c < 3; ++c)
        copy->body_.inverse_mass[4 * n + c] = 0, copy->body_.supports.held[n][c] = true;
  compute_only(copy->body_, inside);
  copy->fields_.h_last = 0;
  copy->fields_.time = 0;
  copy->forces_.moved();
  return copy;
}

/// Weight of the member's cells that are left, along its axis [N].
double CapacityTests::weight_of(const PierPlace& place, const Vec3& axis) const {
  double weight = 0;
  for (const int cell : place.cells)
    if (body_.live[cell]) weight -= body_.cell_mass[cell] * body_.gravity.dot(axis);
  return weight;
}

/// 2 pi L^2 / (root^2 r c) [s].
double CapacityTests::bending_period(std::size_t k, double root) const {
  const Member& member = loads_.members()[k];
  const double c = std::sqrt(body_.spec.young / body_.spec.density);
  return 2 * M_PI * member.length * member.length /
         (root * root * c * least_gyration(body_.mesh, loads_.place(k).place.cells, body_.cell_mass, member));
}

PushDown CapacityTests::push_down(std::size_t k) const {
  const PierPlace& place = loads_.place(k).place;
  const Member& member = loads_.members()[k];
  const Vec3 z = member.axis_x.cross(member.axis_y);
  const std::unique_ptr<FemStructure> test = cut_out(place, true);
  const double c = std::sqrt(body_.spec.young / body_.spec.density),
               period = std::max(2 * member.length / c, 0.5 * bending_period(k, 4.730));
  test->body_.alpha = 2 * M_PI / period;
  const double speed = press_strain * member.length / (periods_to_strain * period),
               weight = weight_of(place, z);
  PushDown out;
  out.member = member.name;
  push(*test, settle_periods * period, periods_to_strain * period / curve_samples, speed,
       last_strain * member.length, 0.5 * press_strain * member.length,
       fmt::format("structure {}: the push-down of {}", body_.spec.name, member.name), out, [&](double down) {
         double plates = 0;
         for (int n : place.top)
           for (int d = 0; d < 3; ++d) {
             plates -= test->fields_.f_int[4 * n + d] * z[d];
             test->fields_.v_hat[4 * n + d] = -down * z[d];
           }
         for (int n : place.foot)
           for (int d = 0; d < 3; ++d) plates += test->fields_.f_int[4 * n + d] * z[d];
         return 0.5 * plates - 0.5 * weight;
       });
  return out;
}

// Lateral capacity: the foot is held, the nodes of the top section move along an axis of the section at one
// speed, free along the two others, and carry the permanent load.
//
//   H = (R_top - R_foot) / 2        T_1 = 2 pi L^2 / (1.875^2 r c)     lowest bending mode of a cantilever; a
//   fifth of the critical damping there: what it carries is some 3 % of the load
PushDown CapacityTests::push_over(std::size_t k, int axis) const {
  constexpr double settle = 4, periods_to_drift = 20, drift_step = 0.01,
                   last_drift = 0.03;  // of T_1; in these periods the drift grows by drift_step of the length
  constexpr int points = 50;           // of the curve, a drift_step
  const PierPlace& place = loads_.place(k).place;
  const Member& member = loads_.members()[k];
  const Vec3 z = member.axis_x.cross(member.axis_y), e = axis == 0 ? member.axis_x : member.axis_y;
  const std::unique_ptr<FemStructure> test = cut_out(place, false);
  const double period = bending_period(k, 1.875);
  test->body_.alpha = 0.2 * 4 * M_PI / period;
  const double speed = drift_step * member.length / (periods_to_drift * period), h = test->critical_step();
  double top_mass = 0;
  for (int n : place.top) top_mass += test->body_.mass[n];
  const double load = member.axial_preload - weight_of(place, z);  // what the pier carries on its top
  PushDown out;
  out.member = member.name;
  out.axis = axis;
  push(*test, settle * period, periods_to_drift * period / points, speed, last_drift * member.length,
       0.2 * drift_step * member.length,
       fmt::format("structure {}: the lateral test of {}", body_.spec.name, member.name), out,
       [&](double sideways) {
         double held = 0;
         for (int n : place.top) {
           if (!(test->body_.mass[n] > 0)) continue;
           double along = 0;
           for (int d = 0; d < 3; ++d) {
             double& v = test->fields_.v_hat[4 * n + d];
             held += test->fields_.f_int[4 * n + d] * e[d];
             v -= h * load / top_mass * z[d];
             along += v * e[d];
           }
           for (int d = 0; d < 3; ++d) test->fields_.v_hat[4 * n + d] += (sideways - along) * e[d];
         }
         for (int n : place.foot)
           for (int d = 0; d < 3; ++d) held -= test->fields_.f_int[4 * n + d] * e[d];
         return 0.5 * held;
       });
  return out;
}

std::vector<PushDown> CapacityTests::push_over() {
  needs_piers();
  std::vector<PushDown> all;
  for (std::size_t k = 0; k < pier_count(); ++k)
    for (int axis = 0; axis < 2; ++axis) {
      body_.report(fmt::format("push-over of {} {} along its {} axis", body_.spec.name,
                               loads_.members()[k].name, axis == 0 ? "x" : "y"));
      all.push_back(push_over(k, axis));
      body_.report(fmt::format("push-over of {} {}: {:.1f} kN at {:.3g} mm", body_.spec.name,
                               loads_.members()[k].name, all.back().capacity / 1e3, 1e3 * all.back().at));
    }
  return all;
}

std::vector<SectionResistance> CapacityTests::section_resistances() const {
  constexpr double above_the_foot = 0.02;  // of the length, where the bars of the foot are all there
  std::vector<SectionResistance> all;
  if (!body_.concrete) return all;
  for (std::size_t k = 0; k < pier_count(); ++k) {
    const Member& member = loads_.members()[k];
    const Pier& pier = loads_.place(k).pier;
    std::vector<rebar::Bar> own;  // bars that lie in it
    for (const rebar::Bar& bar : body_.bars ? body_.bars->embedded().bars() : std::vector<rebar::Bar>{})
      if (std::all_of(bar.points.begin(), bar.points.end(), [&](const Vec3& p) {
            const Vec3 from = p - member.base;
            return std::abs(from.dot(member.axis_x)) <= 0.5 * member.section[0] &&
                   std::abs(from.dot(member.axis_y)) <= 0.5 * member.section[1];
          }))
        own.push_back(bar);
    SectionResistance r;
    r.member = member.name;
    r.axial = member.axial_preload;
    for (const bool design : {true, false}) {
      const double f_ck = body_.concrete->f_ck;
      const rebar::Strengths strengths = design ? rebar::Strengths{f_ck, 1.2, 1.0, 1.0, f_ck}
                                                : rebar::Strengths{body_.concrete->f_cm, 1.0, 1.0, 1.0, f_ck};
      const rebar::Section section(pier.shape, pier.wall, own, above_the_foot * member.length, strengths);
      SectionResistance::Values& values = design ? r.design : r.mean;
      values.compression = section.axial_compression(), values.tension = section.axial_tension();
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double angle = axis == 0 ? 0 : M_PI / 2;  // the side towards which it is pushed is pressed
        values.moment[axis] = section.moment(r.axial, angle);
        values.shear[axis] = (design ? member.shear_design : member.shear_mean)[axis];
        if (design)
          for (const rebar::Section::Point& p : section.interaction(angle))
            r.interaction[axis].push_back({p.axial, p.moment});
      }
    }
    all.push_back(std::move(r));
  }
  return all;
}

}  // namespace talus::fem

// Blocks that strike elastic structures, against d'Alembert's rod, Hertz, and Timoshenko's sphere on a beam.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "contact/structures/structure.hpp"
#include "sim/world.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

const std::string hard = "normal_stiffness = \"hard\"";

/// Rod of 1 m x 0.1 m x 0.1 m, c = 1000 m/s, nu = 0; its upper end is struck at 1 m/s. Times in L / c are
/// milliseconds.
struct RodScene {
  static constexpr double density = 1000, wave_speed = 1000, modulus = 1e9, side = 0.1, speed = 1;
  static constexpr double unit_force = density * wave_speed * speed * side * side;  // rho c V A
  double ratio = 1;  // mass of the rod over that of the striker
  int cells = 100;
  double fraction = 0.9;  // of the stable step
  static constexpr int soft_cells = 8;
  bool soft = false;  // contact as stiff as so many cells, E / (8 h)
  Method method = Method::by_accuracy(1e-3);
  std::string text() const {
    const double end = 5.2e-3, height = 0.05;
    SceneText s(method, end, Vec3::Zero());
    const std::string law =
        soft ? "normal_stiffness = \"" + number(modulus * cells / soft_cells) + " Pa/m\"" : hard;
    s.history(8.8e-4 / cells)
        .material("rod", density, "young = " + number(modulus) + "\npoisson = 0.0")
        .material("rock", density / (ratio * height))
        .interface("rock", "rod", 0, law);
    s.box("striker", Vec3(side, side, height), Vec3(0, 0, 1 + height / 2), velocity(Vec3(0, 0, -speed)));
    return s
        .raw(structure_box(
            "rod", Vec3(side, side, 1), Vec3(0, 0, 0.5), {1, 1, cells}, "rod",
            std::string(held_below) + fmt::format("critical_step_fraction = {}\n", number(fraction))))
        .str();
  }
};

/// Characteristics [d'Alembert]: time c t / L of first separation and the striker's velocity over V there.
struct RodReference {
  double ratio, separation, velocity;
};
constexpr RodReference rods[] = {
    {0.5, 4.709, -0.925}, {1, 3.068, -0.688}, {2, 2.505, -0.729}, {4, 2.250, -0.736}};

/// Stress over rho c V at the struck end for c t / L in (2, 4), and at the clamped one in (3, 5).
double struck(double r, double t) {
  return std::exp(-r * t) + 2 * std::exp(-r * (t - 2)) * (1 - r * (t - 2));
}
double clamped(double r, double t) { return 2 * (struck(r, t - 1) - std::exp(-r * (t - 3))); }
/// Largest force on a spring of stiffness rho c^2 A / (tau L) between striker and rod, over rho c V A, by
/// characteristics; times in L / c:
///
///   F' = (v_s - v_r) / tau,   v_s' = - r F,   F(t) = v_r + 2 f(t - 2),   f(t) = F(t) - f(t - 2)
///
/// with f the wave that goes down the rod and comes back from the clamped end as it was.
double struck_on_spring(double r, double tau) {
  constexpr int steps = 100000;  // of the way there and back
  const double dt = 2.0 / steps;
  std::vector<double> down(2 * steps + 1, 0.0);
  double force = 0, striker = 1, largest = 0;
  for (int i = 0; i < 2 * steps; ++i) {
    const auto returning = [&](int at) {
      return at >= steps ? down[static_cast<std::size_t>(at - steps)] : 0.0;
    };
    const double next = std::max(0.0, force + dt * (striker - (force - 2 * returning(i))) / tau);
    striker -= dt * r * force;
    force = next;
    down[static_cast<std::size_t>(i + 1)] = force - returning(i + 1);
    largest = std::max(largest, force);
  }
  return largest;
}
/// Mean over a window behind the jump: how a peak at a jump is read, since no mesh resolves the jump.
template <class F>
double exact_mean(const F& f, double r, double start, double window) {
  double sum = 0;
  for (int i = 0; i < 1000; ++i) sum += f(r, start + window * (i + 0.5) / 1000);
  return sum / 1000;
}

/// The striker's velocity at its first separation, over V.
double rebound(const Outcome& o, double pause, double* separation = nullptr) {
  const auto contact = spells(resultants(o), pause);
  if (contact.empty()) return NAN;
  if (separation) *separation = contact[0].end;
  for (const sim::HistoryRow& r : o.rows)
    if (r.time >= contact[0].end) return -r.velocity[0].z() / RodScene::speed;
  return NAN;
}

void rod_case(CaseRun& c) {
  const double pause = 5e-5, behind = 0.05, window = 0.2;  // s; L / c
  for (const RodReference& r : rods) {
    RodScene scene;
    scene.ratio = r.ratio;
    c.method(scene.method);
    const Outcome o = c.run(scene.text());
    const std::string title = fmt::format("rod/striker {:g}", r.ratio);
    if (!o.ok()) return c.failed(o.result.message);
    const auto samples = resultants(o);
    // Of the peak: means over so long a window fall below it as the rod grows heavier, and cross zero.
    const std::string read =
        "d'Alembert, mean over 0.05 to 0.25 L/c behind the jump, allowed 2 % of the peak";
    c.absolute(
        title + ": struck end, stress/(rho c V)", read, exact_mean(struck, r.ratio, 2 + behind, window),
        window_mean(samples, Vec3(0, 0, -1), (2 + behind) * 1e-3, window * 1e-3) / RodScene::unit_force,
        0.02 * struck(r.ratio, 2));
    std::vector<ContactSample> base;
    for (std::size_t i = 1; i < o.rows.size(); ++i)
      base.push_back(
          {o.rows[i].time, o.rows[i].time - o.rows[i - 1].time, o.rows[i].structures[0].base_force});
    c.absolute(title + ": clamped end, stress/(rho c V)", read,
               exact_mean(clamped, r.ratio, 3 + behind, window),
               window_mean(base, Vec3(0, 0, -1), (3 + behind) * 1e-3, window * 1e-3) / RodScene::unit_force,
               0.02 * clamped(r.ratio, 3));
    double separation = 0;
    c.relative(title + ": striker's velocity/V at separation", "d'Alembert", r.velocity,
               -std::abs(rebound(o, pause, &separation)), 0.01);
    c.relative(title + ": first separation, c t/L", "d'Alembert", r.separation, separation * 1e3, 0.02);
    if (r.ratio == 1)
      c.relative(title + ": velocity/V after the second contact", "d'Alembert", -0.699,
                 -o.last().velocity[0].z() / RodScene::speed, 0.01);
    judge_interface(c, o, title, 0.01);
    // At a jump any mesh overshoots, however fine. As soft as several cells the front is one that the mesh
    // resolves, and the largest force of any step is the rod's own.
    if (!c.quick()) {
      scene.soft = true;
      scene.cells = 400;
      const Outcome soft = c.run(scene.text());
      double peak = 0;
      for (const ContactSample& s : resultants(soft)) peak = std::max(peak, -s.force.z());
      c.relative(title + ", contact E/(8 h), 400 cells: largest force of any step",
                 "d'Alembert, striker on a spring",
                 struck_on_spring(r.ratio, double(RodScene::soft_cells) / scene.cells),
                 peak / RodScene::unit_force, 0.02);
    }
    if (c.quick()) break;
  }
  if (c.quick()) return;
  // Error of the rebound against CPU time.
  for (const int cells : {25, 50, 100, 200, 400}) {
    RodScene s;
    s.cells = cells;
    const Outcome o = c.run(s.text());
    c.point("cell size (cells along the rod)", cells, std::abs(rebound(o, pause) / 0.6877 - 1), o);
  }
  for (const double fraction : {0.9, 0.45, 0.225}) {
    RodScene s;
    s.fraction = fraction;
    const Outcome o = c.run(s.text());
    c.point("sub-step (fraction of the stable one)", fraction, std::abs(rebound(o, pause) / 0.6877 - 1), o);
  }
  for (const double accuracy : {1e-2, 1e-4, 1e-6}) {
    RodScene s;
    s.method = Method::by_accuracy(accuracy);
    const Outcome o = c.run(s.text());
    c.point("accuracy", accuracy, std::abs(rebound(o, pause) / 0.6877 - 1), o);
  }
}

/// A ball as an octahedron of its radius and mass: Hertz's law holds its shape, the block only its lowest
/// point.
double ball_density(double radius, double density) {
  return density * (4.0 / 3 * M_PI * radius * radius * radius) / (4.0 / 3 * radius * radius * radius);
}
void add_ball(SceneText& s, double radius, double z) {
  const Vec3 c(0, 0, z + radius * (1 + 1e-6));
  s.hull("ball",
         {c + Vec3(radius, 0, 0), c - Vec3(radius, 0, 0), c + Vec3(0, radius, 0), c - Vec3(0, radius, 0),
          c + Vec3(0, 0, radius), c - Vec3(0, 0, radius)},
         c, velocity(Vec3(0, 0, -0.01)), "ball");
}

std::string hertz_law(double radius) {
  return fmt::format("contact_law = {{ kind = \"hertz\", radius = {} }}", number(radius));
}

struct BeamScene {
  double length = 0.1535, radius = 0.01, end = 3.2e-4;
  int layers = 4;
  double fraction = 0.9;
  std::string text() const {
    const std::string steel = fmt::format("young = {}\npoisson = 0.3", number(2.2e6 * 98066.5));
    SceneText s(Method::by_accuracy(1e-3), end, Vec3::Zero());
    const double side = 0.01;
    s.history(end / 320)
        .material("steel", 7960, steel)
        .material("ball", ball_density(radius, 7960), steel)
        .interface("ball", "steel", 0, hertz_law(radius));
    add_ball(s, radius, 0.5 * side);
    const int along = 2 * static_cast<int>(std::lround(0.5 * length / side * layers));
    return s
        .raw(structure_box(
            "beam", Vec3(length, side, side), Vec3::Zero(), {along, layers, layers}, "steel",
            fmt::format("support = [{{ face = \"-x\", held = \"z\" }}, {{ face = \"+x\", held = \"z\" "
                        "}}]\npreload = \"none\"\nintegrator = \"explicit\"\ncritical_step_fraction = "
                        "{}\n[[structure.probe]]\nname = \"middle\"\nat = [0.0, 0.0, 0.0]\n",
                        number(fraction))))
        .str();
  }
};

void beam_case(CaseRun& c) {
  BeamScene scene;
  scene.end = 5e-4;
  c.method(Method::by_accuracy(1e-3));
  const Outcome o = c.run(scene.text());
  if (!o.ok()) return c.failed(o.result.message);
  const auto contact = spells(resultants(o), 1e-5);
  if (contact.empty()) return c.failed("no contact");
  const ContactSpell& first = contact[0];
  const std::string theory = "Timoshenko's beam (kappa 0.85); Euler-Bernoulli's within 1.5 %";
  c.relative("short beam: peak force [N]", theory, 4.934, first.peak, 0.01);
  c.relative("short beam: time of the peak [s]", theory, 72.1e-6, first.peak_time - first.start, 0.02);
  c.relative("short beam: end of contact [s]", theory, 158.5e-6, first.end - first.start, 0.01);
  c.relative("short beam: impulse [N s]", theory, 4.330e-4, first.impulse.norm(), 0.01);
  c.relative("short beam: rebound [m/s]", theory, 2.985e-3, o.last().velocity[0].z(), 0.02);
  for (const auto& [time, w] :
       {std::pair(100e-6, 0.241e-6), std::pair(200e-6, 0.783e-6), std::pair(300e-6, 1.081e-6)}) {
    double measured = NAN;
    for (std::size_t i = 1; i < o.rows.size(); ++i) {
      const double t0 = o.rows[i - 1].time - first.start, t1 = o.rows[i].time - first.start;
      if (t0 > time || t1 < time) continue;
      const double s = (time - t0) / (t1 - t0);
      measured = -((1 - s) * o.rows[i - 1].structures[0].probe_displacement[0].z() +
                   s * o.rows[i].structures[0].probe_displacement[0].z());
    }
    c.relative(fmt::format("short beam: deflection after {:g} us [m]", time * 1e6), theory, w, measured,
               0.03);
  }
  judge_interface(c, o, "short beam", 0.01);
  if (c.quick()) return;
  const auto study = [&](const char* parameter, double value, BeamScene s) {
    s.end = 5e-4;
    const Outcome q = c.run(s.text());
    const auto spell = spells(resultants(q), 1e-5);
    c.point(parameter, value, spell.empty() ? NAN : std::abs(spell[0].peak / 4.934 - 1), q);
  };
  for (const int layers : {2, 4, 6, 8}) {
    BeamScene s;
    s.layers = layers;
    study("cell size (layers)", layers, s);
  }
  for (const double fraction : {0.9, 0.45, 0.225}) {
    BeamScene s;
    s.fraction = fraction;
    study("sub-step (fraction of the stable one)", fraction, s);
  }
}

void long_beam_case(CaseRun& c) {
  BeamScene scene;
  scene.length = 0.307;
  scene.radius = 0.02;
  scene.end = 3.9e-3;
  scene.fraction = 0.9;
  c.method(Method::by_accuracy(1e-3));
  const Outcome o = c.run(scene.text());
  if (!o.ok()) return c.failed(o.result.message);
  const auto contact = spells(resultants(o), 1e-4);
  c.absolute("long beam: number of contacts", "both beam theories", 3, static_cast<double>(contact.size()),
             0);
  if (contact.size() < 3) return;
  const double start = contact[0].start;
  struct Spell {
    double from, to, peak;
  };
  // Sensitive: the two beam theories differ by 0.6 % in times and by 1, 12 and 22 % in the three peaks.
  const Spell reference[3] = {
      {0, 439.8e-6, 8.89}, {1337.6e-6, 1791.7e-6, 11.57}, {2805.8e-6, 3253.8e-6, 6.82}};
  const double times = 0.02, peaks[3] = {0.02, 0.12, 0.22};
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (i > 0)
      c.relative(fmt::format("long beam: start of contact {} [s]", i + 1), "Timoshenko's beam",
                 reference[i].from, contact[k].start - start, times);
    c.relative(fmt::format("long beam: end of contact {} [s]", i + 1), "Timoshenko's beam", reference[i].to,
               contact[k].end - start, times);
    c.relative(fmt::format("long beam: peak of contact {} [N]", i + 1), "Timoshenko's beam",
               reference[i].peak, contact[k].peak, peaks[i]);
  }
  judge_interface(c, o, "long beam", 0.01);
}

std::string half_space(int cells) {
  SceneText s(Method::by_accuracy(1e-3), 4.5e-4, Vec3::Zero());
  const std::string metal = "young = \"210 GPa\"\npoisson = 0.3";
  s.history(2.5e-7)
      .material("steel", 7800, metal)
      .material("ball", ball_density(0.01, 7800), metal)
      .interface("ball", "steel", 0, hertz_law(0.01));
  add_ball(s, 0.01, 0);
  return s
      .raw(structure_box("base", Vec3(0.2, 0.2, 0.2), Vec3(0, 0, -0.1), {cells, cells, cells}, "steel",
                         held_below))
      .str();
}

void hertz_case(CaseRun& c) {
  for (const int cells : {10, 20}) {
    c.method(Method::by_accuracy(1e-3));
    const Outcome o = c.run(half_space(cells));
    if (!o.ok()) return c.failed(o.result.message);
    const auto contact = spells(resultants(o), 1e-5);
    if (contact.empty()) return c.failed("no contact");
    const std::string title = fmt::format("half-space of {}^3 cells", cells);
    c.relative(title + ": peak force [N]", "Hertz", 6.942, contact[0].peak, 0.01);
    c.relative(title + ": time of contact [s]", "Hertz", 173.15e-6, contact[0].end - contact[0].start, 0.01);
    c.relative(title + ": rebound [m/s]", "Hertz, no loss", 0.01, o.last().velocity[0].z(), 0.02);
    judge_interface(c, o, title, 0.01);
    if (c.quick()) break;
  }
}

/// A rigid cube and a cube of finite elements of the same mass, nu = 0: the rod free at its far end. Until
/// the reflected wave is back the rigid one slows as exp(-c t / L); then they part: e^-2 = 0.13534 of the
/// closing speed stays.
void equal_blocks_case(CaseRun& c) {
  const double kept = std::exp(-2.0);
  for (const bool element_moves : {false, true}) {
    c.method(Method::by_accuracy(1e-3));
    SceneText s(Method::by_accuracy(1e-3), 4e-3, Vec3::Zero());
    s.history(1e-5)
        .material("soft", 1000, "young = 1e9\npoisson = 0.0")
        .material("rock", 1000)
        .interface("rock", "soft", 0, hard);
    s.box("B", Vec3(1, 1, 1), Vec3(0, 0, 1.0005), element_moves ? "" : velocity(Vec3(0, 0, -1)));
    const std::string flies = element_moves ? "initial_velocity = [0.0, 0.0, 1.0]\n" : "";
    const Outcome o = c.run(s.raw(structure_box("F", Vec3(1, 1, 1), Vec3::Zero(), {2, 2, 64}, "soft",
                                                std::string(unsupported) + flies))
                                .str());
    if (!o.ok()) return c.failed(o.result.message);
    const std::string title = element_moves ? "elements strike block" : "block strikes elements";
    c.absolute(title + ": block's velocity after, over the closing speed", "d'Alembert",
               element_moves ? 1 - kept : -kept, o.last().velocity[0].z(), 0.01);
    const Vec3 change = o.last().ledger.linear_momentum - o.rows.front().ledger.linear_momentum;
    c.absolute(title + ": total momentum, change over the whole", "momentum", 0, change.norm() / 1000, 1e-12);
    judge_interface(c, o, title, 0.01);
  }
}

/// A flat face presses on nine cells of another pattern: every point of the face gets the same pressure, and
/// the end stays plane.
void patch_case(CaseRun& c) {
  for (const bool soft : {false, true}) {
    c.method(Method::by_accuracy(1e-3));
    SceneText s(Method::by_accuracy(1e-3), 2e-3, Vec3::Zero());
    s.history(1e-4)
        .material("soft", 1000, "young = 1e9\npoisson = 0.0")
        .material("rock", 1000)
        .interface("rock", "soft", 0.3, soft ? "normal_stiffness = \"4 GPa/m\"" : hard);
    s.box("B", Vec3(1, 1, 1), Vec3(0, 0, 0.5), velocity(Vec3(0, 0, -1)));
    std::string probes = held_below;
    const std::vector<Vec3> at{{0.1, 0.2, 0},    {0.5, 0.5, 0},  {-0.5, 0.5, 0},
                               {-0.3, -0.45, 0}, {0.4, -0.1, 0}, {-0.17, 0.08, 0}};
    for (std::size_t i = 0; i < at.size(); ++i)
      probes += fmt::format("[[structure.probe]]\nname = \"p{}\"\nat = {}\n", i, vector(at[i]));
    const Outcome o =
        c.run(s.raw(structure_box("F", Vec3(1, 1, 2), Vec3(0, 0, -1), {3, 3, 6}, "soft", probes)).str());
    if (!o.ok()) return c.failed(o.result.message);
    const std::string title = soft ? "springs" : "hard";
    double spread = 0, most = 0;
    for (const sim::HistoryRow& r : o.rows)
      for (const Vec3& u : r.structures[0].probe_displacement) {
        most = std::max(most, std::abs(u.z()));
        spread = std::max(spread, (u - r.structures[0].probe_displacement[0]).norm());
      }
    c.absolute(title + ": the struck end stays plane, spread over displacement", "uniform pressure", 0,
               spread / most, 1e-9);
    if (soft) {
      double uneven = 0, area = 0;
      const double time = o.structure_contacts.at(o.structure_contacts.size() / 2).time;
      double total = 0;
      for (const sim::ContactRow& r : o.structure_contacts)
        if (r.time == time) area += r.area, total += r.force.norm();
      for (const sim::ContactRow& r : o.structure_contacts)
        if (r.time == time) uneven = std::max(uneven, std::abs(r.force.norm() / r.area * area / total - 1));
      c.relative(title + ": area pressed on [m^2]", "the block's face", 1, area, 1e-9);
      c.absolute(title + ": pressure over mean pressure, less 1", "uniform", 0, uneven, 1e-9);
    }
    judge_interface(c, o, title, 0.01);
  }
}

/// A slab in free space breaks under a block: nothing from outside acts, so mass and both momenta stay.
void fragment_case(CaseRun& c) {
  struct Strike {
    std::string title, damage, law;
    double speed;
  };
  const std::string soft;
  const std::vector<Strike> strikes{{"slab breaks, hard contacts", "concrete", hard, 20},
                                    {"slab breaks, springs", "concrete", soft, 20},
                                    {"slab breaks, CDPM2", "concrete-cdpm2", hard, 40}};
  for (const Strike& strike : strikes)
    for (const bool erosion : {false, true}) {
      if (c.quick() && (erosion || strike.speed > 20)) continue;
      c.method(Method::by_accuracy(1e-3));
      SceneText s(Method::by_accuracy(1e-3), c.quick() ? 0.008 : 0.02,
                  Vec3::Zero());  // the first pieces come off at 5 ms
      s.history(1e-3)
          .material("concrete", 2450, "f_cm = \"38 MPa\"")
          .material("rock", 2600)
          .interface("rock", "concrete", 0.5, strike.law)
          .interface("concrete", "concrete", 0.5, strike.law);
      s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(0.12, 0.05, 0.42),
            velocity(Vec3(0, 0, -strike.speed)) + turned(Vec3(0.1, 0.05, 0.2)));
      const std::string breaks =
          "damage = \"" + strike.damage + "\"\nerosion = " + (erosion ? "true\n" : "false\n");
      const Outcome o = c.run(s.raw(structure_box("slab", Vec3(3, 1, 0.2), Vec3::Zero(), {30, 10, 2},
                                                  "concrete", unsupported + breaks))
                                  .str());
      const std::string title = strike.title + (erosion ? ", with erosion" : "");
      c.holds(title + ": runs to its end", "no failure", o.ok());
      if (!o.ok()) continue;
      const auto& blocks = o.simulation->header().blocks;
      const auto pieces = static_cast<double>(
          std::count_if(blocks.begin(), blocks.end(), [](const auto& b) { return b.fragment; }));
      c.holds(fmt::format("{}: pieces came off ({})", title, pieces), "at least one", pieces >= 1);
      const Structure& slab = *o.simulation->world().system->environment().structures[0].structure;
      double mass = 0;
      for (int n = 0; n < static_cast<int>(slab.snapshot().nodes.size()); ++n)
        mass += slab.skin().node_mass(n);
      for (const auto& b : blocks)
        if (b.fragment) mass += b.mass;
      c.relative(title + ": mass of slab and pieces [kg]", "as it was", 2450 * 3 * 0.2, mass, 1e-12);
      const sim::LedgerRow &first = o.rows.front().ledger, &last = o.last().ledger;
      c.absolute(title + ": linear momentum, change over the whole", "momentum", 0,
                 (last.linear_momentum - first.linear_momentum).norm() / first.linear_momentum.norm(), 1e-12);
      c.absolute(title + ": angular momentum, change over m v r", "momentum", 0,
                 (last.angular_momentum - first.angular_momentum).norm() / first.linear_momentum.norm(),
                 1e-12);
      double growth = 0;
      const auto mechanical = [](const sim::LedgerRow& l) { return l.kinetic + l.strain + l.contact; };
      for (const sim::HistoryRow& r : o.rows)
        growth = std::max(growth, mechanical(r.ledger) - mechanical(first));
      c.absolute(title + ": energy gained, relative", "first law", 0, growth / first.kinetic, 1e-6);
      judge_interface(c, o, title, 0.01);
    }
}

/// Peer scene S6: a cube of finite elements against a pier of finite elements.
std::string cube_on_pier(bool block) {
  SceneText s(Method::by_accuracy(1e-3), 1.5e-3, Vec3::Zero());
  s.history(1.5e-5)
      .material("concrete", 2500, "young = \"30 GPa\"\npoisson = 0.2")
      .material("rock", 2500, "young = \"30 GPa\"\npoisson = 0.2");
  const std::string law = "normal_stiffness = \"100 GPa/m\"";
  s.interface("rock", "concrete", 0, law);
  s.raw(structure_box("pier", Vec3(2, 2, 10), Vec3(0, 0, 5), {8, 8, 40}, "concrete", held_below));
  if (block)
    return s.box("cube", Vec3(1, 1, 1), Vec3(-1.5, 0, 8), velocity(Vec3(20, 0, 0)) + "deformable = true\n")
        .str();
  return s
      .raw(structure_box("cube", Vec3(1, 1, 1), Vec3(-1.5, 0, 8), {4, 4, 4}, "rock",
                         std::string(unsupported) + "initial_velocity = [20.0, 0.0, 0.0]\n"))
      .str();
}

void cube_case(CaseRun& c) {
  c.method(Method::by_accuracy(1e-3));
  const Outcome o = c.run(cube_on_pier(false));
  if (!o.ok()) return c.failed(o.result.message);
  const Vec3 after =
      o.simulation->world().system->environment().structures[1].structure->energy().linear_momentum;
  const double mass = 2500, impulse = mass * 20 - after.x();
  c.relative("cube of elements: impulse [N s]", "CalculiX, explicit, same mesh and penalty", 80.0e3, impulse,
             0.01);
  c.relative("cube of elements: rebound [m/s]", "CalculiX", -12.0, after.x() / mass, 0.03);
  double worst = 0;
  for (const sim::HistoryRow& r : o.rows) worst = std::max(worst, std::abs(r.ledger.residual));
  c.absolute("cube of elements: energy residual over the energy of the impact", "first law", 0,
             worst / o.rows.front().ledger.kinetic, 0.01);
  const Outcome b = c.run(cube_on_pier(true));
  if (!b.ok()) return c.failed(b.result.message);
  CaseResult& r = c.relative("one block of 12 degrees of freedom: impulse [N s]",
                             "CalculiX, 64 cells; one strain mode cannot match them", 80.0e3,
                             mass * (20 - b.last().velocity[0].x()), 0.05);
  r.judged = false;
  judge_interface(c, b, "block of 12 degrees of freedom", 0.01);
}

}  // namespace

std::vector<Case> coupling_cases() {
  return {{"coupling", "C1", "Rigid striker on a clamped rod: rebound", "d'Alembert; characteristics", true,
           rod_case},
          {"coupling", "C2", "Timoshenko: sphere on a beam: peak force", "Timoshenko 1913; modes", true,
           beam_case},
          {"coupling", "C2b", "Timoshenko: sphere on a long beam, three contacts", "Timoshenko 1913; modes",
           false, long_beam_case},
          {"coupling", "C3", "Hertz: sphere on a half-space", "Hertz 1882", true, hertz_case},
          {"coupling", "C4", "Block against a block of finite elements, both ways", "d'Alembert", true,
           equal_blocks_case},
          {"coupling", "C5", "Contact patch test", "uniform stress", true, patch_case},
          {"coupling", "C6", "Fragments detach", "conservation", true, fragment_case},
          {"coupling", "S6", "Cube of finite elements against a pier", "CalculiX 2.20", true, cube_case}};
}

}  // namespace talus::verify

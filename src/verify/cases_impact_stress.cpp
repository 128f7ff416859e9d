// Stress scenes of blocks on structures: no growth of energy, no tunnelling, nothing that is not a number,
// both sides in balance.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A cube of 0.5 m, turned a little so that corner, edge and face follow each other, strikes the side of a
/// pier 1 x 1 x 6 m.
struct PierScene {
  double young = 30e9, block_density = 2600, speed = 10, end = 0.02;
  std::string law = "normal_stiffness = \"hard\"";
  Method method = Method::by_accuracy(1e-3);
  std::string text() const {
    SceneText s(method, end, Vec3::Zero());
    s.history(end / 100)
        .material("concrete", 2450, "young = " + number(young) + "\npoisson = 0.2")
        .material("rock", block_density)
        .interface("rock", "concrete", 0.5, law);
    s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(-0.87, 0.13, 4.05),
          velocity(Vec3(speed, 0, 0)) + turned(Vec3(0.03, 0.05, 0.1)));
    return s
        .raw(structure_box(
            "pier", Vec3(1, 1, 6), Vec3(0, 0, 3), {4, 4, 24}, "concrete",
            std::string(held_below) + "[[structure.probe]]\nname = \"face\"\nat = [-0.5, 0.13, 4.05]\n"))
        .str();
  }
};

/// A boulder of 115 m^3 at 50 m/s against a pier 2 x 2 x 14 m, or from above on the edge of a slab.
std::string boulder(const std::string& damage, bool deck) {
  SceneText s(Method::by_accuracy(1e-3), 0.03, Vec3::Zero());
  s.history(3e-4)
      .material("concrete", 2450, "f_cm = \"38 MPa\"")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.6)
      .interface("concrete", "concrete", 0.6);
  const Vec3 at = deck ? Vec3(0, 2.3, 3.2) : Vec3(-4.7, 0.4, 9), v = deck ? Vec3(0, 0, -50) : Vec3(50, 0, 0);
  s.raw("[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"EOTA221\"\nvolume = 115.0\nposition = " +
        vector(at) + "\ndeformable = false\n" + velocity(v) + turned(Vec3(0.2, 0.3, 0.1)));
  const std::string more = "preload = \"none\"\ndamage = \"" + damage +
                           "\"\n[[structure.probe]]\nname = \"face\"\nat = " +
                           vector(deck ? Vec3(0, 2.3, 0.5) : Vec3(-1, 0.4, 9)) + "\n";
  if (deck)
    return s
        .raw(structure_box("deck", Vec3(12, 5, 1), Vec3(0, 0, 0), {24, 10, 2}, "concrete",
                           "support = [\"-x\", \"+x\"]\n" + more))
        .str();
  return s
      .raw(structure_box("pier", Vec3(2, 2, 14), Vec3(0, 0, 7), {4, 4, 28}, "concrete",
                         "support = [\"-z\"]\n" + more))
      .str();
}

void judge(CaseRun& c, const std::string& title, const std::string& text, const Vec3& into, const Vec3& face,
           bool taken_judged = true) {
  const Outcome o = c.run(text);
  c.holds(title + ": runs to its end", "no failure", o.ok());
  bool finite = true;
  double growth = 0, nearest = 1e300;
  const auto mechanical = [](const sim::LedgerRow& l) {
    return l.kinetic + l.potential + l.strain + l.contact - l.external_work;
  };
  for (const sim::HistoryRow& r : o.rows) {
    finite = finite && r.position[0].allFinite() && r.velocity[0].allFinite() &&
             r.structures[0].probe_displacement[0].allFinite() && std::isfinite(r.ledger.residual);
    growth = std::max(growth, mechanical(r.ledger) - mechanical(o.rows.front().ledger));
    nearest = std::min(nearest, into.dot(face + r.structures[0].probe_displacement[0] - r.position[0]));
  }
  c.holds(title + ": finite", "no NaN", finite);
  c.absolute(title + ": energy gained, relative", "first law", 0,
             std::max(0.0, growth) / o.rows.front().ledger.kinetic, 1e-6);
  if (text.find("damage = \"concrete\"") == std::string::npos)
    c.holds(title + ": centroid stays before the struck face", "no tunnelling", nearest > 0);
  judge_interface(c, o, title, 0.01, taken_judged);
}

void pier(CaseRun& c, const std::string& title, const PierScene& scene) {
  judge(c, title, scene.text(), Vec3::UnitX(), Vec3(-0.5, 0.13, 4.05));
}

void moduli(CaseRun& c) {
  for (const double factor : {1e-3, 1.0, 1e3}) {
    PierScene s;
    s.young *= factor;
    s.end = factor < 1 ? 0.1 : factor > 1 ? 0.015 : 0.02;
    pier(c, fmt::format("E times {:g}", factor), s);
  }
}

void masses(CaseRun& c) {
  for (const double ratio : {1e-6, 1e-3, 1e3, 1e6}) {  // of the block to the pier, 14.7 t
    PierScene s;
    s.block_density = ratio * 2450 * 6 / 0.125;
    if (ratio > 1) s.speed = 5;
    s.end = 0.03;
    pier(c, fmt::format("mass ratio {:g}", ratio), s);
  }
}

void stiffnesses(CaseRun& c) {
  for (const double k : {1e6, 1e8, 1e9, 1e10, 1e12, 1e14}) {
    PierScene s;
    s.law = "normal_stiffness = \"" + number(k) + " N/m\"";
    if (k < 1e7) s.speed = 3;
    s.end = k < 1e7 ? 0.1 : 0.03;
    pier(c, fmt::format("springs of {:g} N/m", k), s);
  }
}

void steps(CaseRun& c) {
  for (const double h : {3e-5, 3e-4, 3e-3}) {  // 1, 10 and 100 times the critical step
    PierScene s;
    s.method = Method::fixed_step(h);
    c.method(s.method);
    pier(c, fmt::format("step {:g} s asked for", h), s);
  }
}

void boulders(CaseRun& c) {
  for (const std::string damage : {"none", "concrete"}) {
    judge(c, "115 m3 at 50 m/s, pier, damage " + damage, boulder(damage, false), Vec3::UnitX(),
          Vec3(-1, 0.4, 9), damage == "none");  // cells that fly apart take springs along
    judge(c, "115 m3 at 50 m/s, deck edge, damage " + damage, boulder(damage, true), Vec3(0, 0, -1),
          Vec3(0, 2.3, 0.5), damage == "none");
  }
}

}  // namespace

std::vector<Case> impact_stress_cases() {
  const std::string source = "invariants";
  return {{"coupling", "E32", "Modulus of the structure times 1e-3 to 1e3", source, true, moduli},
          {"coupling", "E33", "Mass ratio 1e-6 to 1e6", source, true, masses},
          {"coupling", "E34", "Contact stiffness 1e6 to 1e14 N/m", source, true, stiffnesses},
          {"coupling", "E35", "Steps 1 to 100 times the critical one", source, true, steps},
          {"coupling", "E36", "Boulder of 115 m3 at 50 m/s", source, false, boulders}};
}

}  // namespace talus::verify

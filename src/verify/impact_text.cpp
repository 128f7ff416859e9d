#include "verify/impact_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/world.hpp"

namespace talus::verify {

std::string structure_box(const std::string& name, const Vec3& size, const Vec3& position,
                          const std::array<int, 3>& cells, const std::string& material,
                          const std::string& more) {
  return fmt::format(
      "[[structure]]\nname = \"{}\"\nkind = \"box\"\nmaterial = \"{}\"\nsize = {}\nposition = {}\ncells = "
      "[{}, {}, {}]\n{}",
      name, material, vector(size), vector(position), cells[0], cells[1], cells[2], more);
}

std::vector<ContactSample> resultants(const Outcome& o) {
  std::vector<ContactSample> samples;
  for (const sim::ContactRow& r : o.structure_contacts) {
    if (samples.empty() || samples.back().time != r.time) samples.push_back({r.time, r.dt, Vec3::Zero()});
    samples.back().force += r.force;
  }
  return samples;
}

std::vector<ContactSpell> spells(const std::vector<ContactSample>& samples, double pause) {
  std::vector<ContactSpell> list;
  for (const ContactSample& s : samples) {
    const double start = s.time - s.dt;
    if (list.empty() || start - list.back().end > pause) list.push_back({start, start, 0, 0, Vec3::Zero()});
    ContactSpell& spell = list.back();
    spell.end = s.time;
    spell.impulse += s.dt * s.force;
    if (s.force.norm() > spell.peak) {
      spell.peak = s.force.norm();
      spell.peak_time = s.time - 0.5 * s.dt;
    }
  }
  return list;
}

double window_mean(const std::vector<ContactSample>& samples, const Vec3& direction, double start,
                   double window) {
  double impulse = 0;
  for (const ContactSample& s : samples) {
    const double from = std::max(s.time - s.dt, start), to = std::min(s.time, start + window);
    if (to > from) impulse += (to - from) * direction.dot(s.force);
  }
  return impulse / window;
}

void judge_interface(CaseRun& c, const Outcome& o, const std::string& title, double residual,
                     bool taken_judged) {
  const sim::InterfaceAudit& a = o.result.audit;
  c.absolute(title + ": forces on both sides, sum over force", "action and reaction", 0,
             a.worst_force_imbalance, 1e-12);
  c.absolute(title + ": moments on both sides, sum over moment", "action and reaction", 0,
             a.worst_moment_imbalance, 1e-12);
  // The blocks' momentum comes from the velocities, the impulse from the recorded contacts.
  const auto& blocks = o.simulation->header().blocks;
  if (blocks.size() == o.rows.front().velocity.size()) {  // pieces that came off strike the blocks, too
    Vec3 change = Vec3::Zero(), impulse = Vec3::Zero();
    double scale = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b)
      change += blocks[b].mass * (o.last().velocity[b] - o.rows.front().velocity[b]);
    for (const sim::ContactRow& r : o.structure_contacts)
      impulse += r.dt * r.force, scale += r.dt * r.force.norm();
    c.absolute(title + ": impulse against momentum change, relative", "momentum", 0,
               scale > 0 ? (impulse + change).norm() / scale : NAN, 1e-9);
  }
  double energy = 0, worst = 0, made = 0, taken = 0;
  for (const sim::HistoryRow& r : o.rows) {
    energy = std::max(energy, r.ledger.kinetic);
    worst = std::max(worst, std::abs(r.ledger.residual));
    made = std::max(made, -r.ledger.numerical_dissipation());
    taken = std::max(taken, r.ledger.numerical_dissipation());
  }
  c.absolute(title + ": energy residual over the energy of the impact", "first law", 0, worst / energy,
             residual);
  c.absolute(title + ": numerical energy gain over the energy of the impact", "first law", 0, made / energy,
             residual);
  c.absolute(title + ": numerical dissipation over the energy of the impact", "first law", 0, taken / energy,
             residual)
      .judged = taken_judged;
}

}  // namespace talus::verify

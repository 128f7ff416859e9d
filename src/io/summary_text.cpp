// The keys of summary.json (docs/output.md), in their order.
#include "io/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/design_checks.hpp"

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

json vec(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }

double energy_of(const sim::LedgerRow& l) { return l.kinetic + l.potential + l.strain + l.contact; }
double dissipated(const sim::LedgerRow& l) { return l.dissipated(); }

json of_stress(const StressPeak& p) {
  if (!(p.strength > 0 && p.value > p.strength)) return {};
  return {{"value", p.value},
          {"time", p.time},
          {"at", vec(p.at)},
          {"strength", p.strength},
          {"share_beyond", p.share}};
}

json of_impacts(const sim::RunHeader& header, const std::vector<Impact>& list) {
  json impacts = json::array();
  for (const Impact& m : list) {
    const double duration = m.end - m.start;
    const auto& structure = header.structures[static_cast<std::size_t>(m.structure)];
    const Member* member = struck_member(structure, m.point);
    impacts.push_back({{"structure", structure.name},
                       {"member", member == nullptr ? json() : json(member->name)},
                       {"block", header.blocks[static_cast<std::size_t>(m.block)].name},
                       {"start", m.start},
                       {"end", m.end},
                       {"velocity", vec(m.velocity)},
                       {"speed", m.velocity.norm()},
                       {"spin", vec(m.spin)},
                       {"kinetic", m.kinetic},
                       {"kinetic_translational", m.kinetic - m.rotational},
                       {"kinetic_rotational", m.rotational},
                       {"point", vec(m.point)},
                       {"impulse", vec(m.impulse)},
                       {"peak_force", m.peak_force},
                       {"peak_time", m.peak_time},
                       {"filtered_force", m.filtered_force},
                       {"mean_force", duration > 0 ? m.impulse.norm() / duration : 0.0}});
  }
  return impacts;
}

json of_counters(const sim::RunCounters& c) {
  return {{"steps", c.steps},
          {"rejected", c.rejected},
          {"contacts", c.contacts},
          {"newton", c.newton},
          {"sweeps", c.sweeps},
          {"outer", c.outer},
          {"impacts", c.impacts},
          {"solutions",
           {{"newton", c.newton_method},
            {"interior_point", c.interior_point},
            {"above_tolerance", c.above_tolerance},
            {"halved", c.halved},
            {"convex", c.convex}}},
          {"asleep_skipped", c.asleep_skipped},
          {"flight_closed_form", c.flight_closed_form},
          {"structure_steps", c.structure_steps},
          {"condensed_steps", c.condensed_steps},
          {"structure_asleep", c.structure_asleep},
          {"worst_residual", c.worst_residual},
          {"worst_penetration", c.worst_penetration},
          {"crush_depth", c.crush_depth},
          {"crush_share", c.crush_share},
          {"energy_made", c.gained},
          {"worst_energy_made", c.worst_gain},
          {"dissipation_undone", c.undone},
          {"restitution_reduced", c.reduced},
          {"restitution_lost", c.restitution_lost}};
}

json of_audit(const sim::InterfaceAudit& a) {
  return {
      {"force_imbalance", a.worst_force_imbalance}, {"moment_imbalance", a.worst_moment_imbalance},
      {"impulse_defect", a.impulse_defect},         {"work_on_blocks", a.work_on_blocks},
      {"work_on_structure", a.work_on_structure},   {"impulse_on_structure", vec(a.impulse_on_structure)}};
}

json of_plan(const sim::RunHeader& header) {
  json plan = json::array();
  for (const std::string& line : header.plan) plan.push_back(line);
  for (const auto& s : header.structures) {
    std::size_t at = 0;
    while (at < s.plan.size()) {
      const std::size_t end = std::min(s.plan.find('\n', at), s.plan.size());
      if (std::string line = s.plan.substr(at, end - at); !line.empty()) {
        if (!line.starts_with(s.name + ":")) line = s.name + ": " + line;
        // The run's own plan has most of them, indented.
        const bool told = std::any_of(header.plan.begin(), header.plan.end(), [&](const std::string& l) {
          return l.ends_with(line) && l.find_first_not_of(' ') + line.size() == l.size();
        });
        if (!told) plan.push_back(std::move(line));
      }
      at = end + 1;
    }
  }
  return plan;
}

}  // namespace

json SummaryBuilder::of_structures() const {
  json structures = json::array();
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const StructureTrack& s = structures_[i];
    const auto& info = header_.structures[i];
    json probes = json::array();
    for (std::size_t k = 0; k < s.probes.size(); ++k)
      probes.push_back({{"name", info.probes[k]},
                        {"at", k < info.probe_at.size() ? vec(info.probe_at[k]) : json()},
                        {"peak_displacement", s.probes[k].peak},
                        {"peak_time", s.probes[k].peak_time},
                        {"final_displacement", vec(s.probes[k].last)}});
    const int by = loaded_through(i).structure;
    json members = json::array();
    for (const MemberTrack& m : s.members) members.push_back(m.summary(s.members));
    structures.push_back(
        {{"name", info.name},
         {"form", info.form},
         {"loaded", info.loaded},
         {"hit", std::any_of(impacts_.begin(), impacts_.end(),
                             [&](const Impact& m) { return m.structure == static_cast<int>(i); })},
         {"loaded_through", by < 0 ? json() : json(header_.structures[static_cast<std::size_t>(by)].name)},
         {"met",
          met(i) == nullptr
              ? json()
              : json{{"first", met(i)->first}, {"impulse", vec(met(i)->impulse)}, {"with", others_met(i)}}},
         {"impulse", vec(s.impulse)},
         {"peak_force", s.peak_force},
         {"peak_force_time", s.peak_force_time},
         {"peak_base_force", s.loads.force.value},
         {"peak_base_force_time", s.loads.force.time},
         {"peak_base_shear", s.loads.shear.value},
         {"peak_base_shear_time", s.loads.shear.time},
         {"peak_base_moment", s.loads.moment.value},
         {"peak_base_moment_time", s.loads.moment.time},
         {"peak_base_moment_at", s.loads.moment.value > 0 ? vec(s.loads.moment_at) : json()},
         {"peak_base_moment_member",
          s.loads.moment_member >= 0 && s.loads.moment_member < static_cast<int>(info.members.size())
              ? json(info.members[static_cast<std::size_t>(s.loads.moment_member)].name)
              : json()},
         {"elastic_tension", of_stress(s.loads.tension)},
         {"elastic_compression", of_stress(s.loads.compression)},
         {"preload_force", vec(s.first_force)},
         {"preload_moment", vec(s.first_moment)},
         {"damage_max", s.damage},
         {"damaged_volume", s.damaged_volume},
         {"spalled_volume", s.spalled_volume},
         {"members", members},
         {"probes", probes}});
  }
  return structures;
}

json SummaryBuilder::of_blocks() const {
  json blocks = json::array();
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const BlockTrack& b = blocks_[i];
    const auto& info = header_.blocks[i];
    json item = {{"name", info.name},
                 {"mass", info.mass},
                 {"volume", info.volume},
                 {"fixed", info.fixed},
                 {"fragment", info.fragment}};
    if (info.fragment) item["crushed_mass"] = info.crushed;
    if (b.born) {
      item["start"] = vec(b.start);
      item["end"] = vec(b.end);
      item["runout"] = std::hypot(b.end.x() - b.start.x(), b.end.y() - b.start.y());
      item["drop"] = b.start.z() - b.end.z();
      item["path_length"] = b.path;
      item["max_speed"] = b.peaks.speed;
      item["max_spin"] = b.peaks.spin;
      item["max_kinetic"] = b.peaks.kinetic;
      item["final_speed"] = b.velocity.norm();
      item["birth"] = b.birth;
      item["left"] = b.left ? json(b.time) : json();
    }
    blocks.push_back(item);
  }
  return blocks;
}

json SummaryBuilder::of_energy() const {
  const double least = std::max(least_kinetic(), 1e-300), moving = std::max(kinetic_peak_, least);
  return {
      {"start", energy_of(first_)},
      {"end", energy_of(last_)},
      {"kinetic_peak", kinetic_peak_},
      {"dissipated", dissipated(last_)},
      {"friction_work", last_.friction_work},
      {"damping_work", last_.damping_work},
      {"yield_work", last_.yield_work},
      {"ploughing_work", last_.ploughing_work},
      {"vegetation_work", last_.vegetation_work},
      {"damage_work", last_.damage_work},
      {"algorithmic", last_.algorithmic},
      {"algorithmic_relative",
       kinetic_peak_ > 0 ? std::abs(last_.numerical_dissipation()) / std::max(moved_energy(), least) : 0.0},
      {"algorithmic_warned", scheme_takes_too_much()},
      {"step_dependence", last_.step_dependence},
      {"external_work", last_.external_work},
      {"residual_end", last_.residual},
      {"residual_worst", residual_worst_},
      {"residual_worst_time", residual_worst_time_},
      {"residual_relative", kinetic_peak_ > 0 ? std::abs(residual_worst_) / moving : 0.0}};
}

/// How well each kind of number is known; a number without a comparison of its own is never better than
/// extrapolated.
json SummaryBuilder::of_confidence() const {
  const bool moved = kinetic_peak_ >= least_kinetic();
  const auto share = [&](double part) {
    return kinetic_peak_ > 0 ? std::abs(part) / std::max(moved_energy(), least_kinetic()) : 0.0;
  };
  json confidence = json::array();
  const auto say = [&](const std::string& quantity, const char* level, std::string basis) {
    confidence.push_back({{"quantity", quantity}, {"level", level}, {"basis", std::move(basis)}});
  };
  say("energy and momentum ledger", "verified",
      fmt::format(
          "every loss is accounted for where it occurs; of the {} the worst residual of this run is {:.2g}, "
          "the numerical {} {:.2g}",
          moved ? moved_name() : "kinetic energy of all blocks at 1 cm/s, which none reached,",
          share(residual_worst_), last_.numerical_dissipation() < 0 ? "energy gain" : "dissipation",
          share(last_.numerical_dissipation())));
  if (steps_ == Steps::scheme_1988)
    say("motion of blocks for the given terrain and contact parameters", "extrapolated",
        "the scheme of 1988: how far blocks rebound, turn and creep depends on its step and its springs "
        "(docs/theory/dda-1988.md)");
  else
    say("motion of blocks for the given terrain and contact parameters", "verified",
        "closed forms of flight, sliding, rolling and toppling (talus verify dda)");
  say("run-out and deposits on the real slope", "extrapolated",
      "depend on roughness and parameters that were not calibrated for this site");
  if (!structures_.empty()) {
    switch (taken_) {
      case Taken::both_ways:
        say("impulse and momentum passed to the structure", "verified",
            "closed forms of impacts (talus verify coupling); in this run force and moment on blocks and on "
            "nodes were compared in each step (audit)");
        break;
      case Taken::one_way:
        say("impulse and momentum passed to the structure", "extrapolated",
            "blocks struck its undeformed surface as a fixed one, their forces were then applied to it "
            "(coupling.scheme = \"one-way\"): it gets them in full and did not yield to them");
        break;
      case Taken::nothing:
        say("forces and impulses on the structure", "extrapolated",
            "a fixed surface that does not respond (coupling.scheme = \"rigid\"); only the forces of blocks "
            "on it are reported");
        break;
    }
    if (taken_ == Taken::nothing) return confidence;
    // Closed forms are of sound structures: what has cracked carries by its cells and its law.
    std::string cracked;
    std::size_t count = 0;
    for (std::size_t i = 0; i < structures_.size(); ++i)
      if (structures_[i].damage > 0) cracked += (count++ > 0 ? ", " : "") + header_.structures[i].name;
    if (count < structures_.size())
      say(count == 0 ? "elastic response, base forces, displacement"
                     : "elastic response, base forces, displacement of structures without a crack",
          "verified", "beam and wave solutions (talus verify fem)");
    if (count > 0)
      say(fmt::format("base forces, section forces, displacement of what cracked ({})", cracked),
          "extrapolated",
          "no closed form: they depend on the size of the cells and on the damage law; of a 2 m pier that "
          "breaks, base force, base moment and drift differed by 34 to 39 % between cells of 0.5 and 0.33 m. "
          "Run it "
          "again with finer cells and state what both tell");
    say("peak contact force", "extrapolated",
        "mean over 1.5 ms; a single sub-step's force grows with finer cells and a stiffer contact; "
        "compare with the design formulas");
    bool computed = false;  // damage
    for (std::size_t i = 0; i < structures_.size(); ++i)
      computed = computed || (header_.structures[i].f_cm > 0 && !elastic(i));
    std::string flips;  // members near a limit of their class
    for (const StructureTrack& s : structures_)
      for (const MemberTrack& m : s.members)
        if (m.has_verdict() && !m.elastic())
          if (const std::string doubt = m.verdict().doubt(); !doubt.empty())
            flips += "; " + m.name() + ": " + doubt;
    if (computed)
      say("damage", "extrapolated",
          "material law calibrated on standard tests, not on this structure; where and how much depends on "
          "the size of the cells and of the time steps" +
              flips);
  }
  return confidence;
}

std::string SummaryBuilder::text(const Outcome* outcome) {
  for (auto& row : open_of_)
    for (Open& open : row) {
      const Vec3 force = open.force;
      close_step(open);
      open.force = force;  // the step may still grow
    }
  for (Impact& m : impacts_) m.filtered_force = std::max(m.filtered_force, m.force.filtered_peak());
  for (StructureTrack& s : structures_) {
    const Vec3 force = s.step_force;
    close_step(s);
    s.step_force = force;
  }
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    const double late = 0.9 * time_;  // a residual drift is the mean from here on
    for (MemberTrack& m : structures_[i].members)
      m.set_under_load(structures_[i].last_contact > late ||
                       (header_.structures[i].loaded && header_.structures[i].load_until > late));
  }

  if (outcome != nullptr) met_ = outcome->audit.met;
  json j;
  j["schema"] = 1;
  j["program"] = "talus";
  j["title"] = header_.title;
  j["status"] = outcome != nullptr ? outcome->status : "unfinished";
  j["message"] = outcome != nullptr ? outcome->message : "";
  j["map"] = {{"crs", header_.crs}, {"origin", vec(header_.map_origin)}};
  j["time"] = {{"end", time_}, {"duration", header_.duration}};
  if (outcome != nullptr) {
    j["time"]["wall_seconds"] = outcome->counters.wall_seconds;
    j["time"]["cpu_seconds"] = outcome->counters.cpu_seconds;
  }

  json headline = json::array();
  for (std::string& line : this->headline()) headline.push_back(std::move(line));
  j["headline"] = headline;
  j["hit"] = !impacts_.empty();
  j["impacts"] = of_impacts(header_, impacts_);
  const json formulas = design_checks(header_, impacts_);
  j["formulas"] = formulas;
  j["structures"] = of_structures();
  j["blocks"] = of_blocks();
  j["energy"] = of_energy();
  j["warnings"] = warnings(formulas, outcome != nullptr ? outcome->counters : sim::RunCounters{});
  if (outcome != nullptr) {
    j["counters"] = of_counters(outcome->counters);
    if (outcome->audit_made) j["audit"] = of_audit(outcome->audit);
  }
  j["confidence"] = of_confidence();
  j["plan"] = of_plan(header_);
  return j.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace talus::io

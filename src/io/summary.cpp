#include "io/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "core/place.hpp"
#include "io/summary_words.hpp"

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;
using sim::ContactRow;
using sim::HistoryRow;

constexpr double nothing =
    1e-8;  // [m/s^2] a contact force over the block's mass: what a solver's tolerance leaves is less
/// A part of an energy that comes of a difference: 0 where round-off is all there is.
double above_round_off(double part, double whole) { return std::abs(part) > 1e-12 * whole ? part : 0.0; }

constexpr int coarse_ground_side = 400;  // nodes of the coarse grid that shows where the terrain ends

}  // namespace

SummaryBuilder::SummaryBuilder(const sim::RunHeader& header, Steps steps, Taken taken)
    : steps_(steps), taken_(taken) {
  header_.title = header.title;
  header_.duration = header.duration;
  header_.crs = header.crs;
  header_.map_origin = header.map_origin;
  header_.structures = header.structures;
  header_.materials = header.materials;
  header_.plan = header.plan;
  header_.warnings = header.warnings;
  header_.prescribed_impact = header.prescribed_impact;
  structures_.resize(header.structures.size());
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    structures_[i].probes.resize(header.structures[i].probes.size());
    for (const Member& m : header.structures[i].members) structures_[i].members.emplace_back(m, elastic(i));
  }
  open_of_.resize(structures_.size());
  if (header.planes.empty() && !header.terrain.triangles.empty()) {
    Mesh mesh{header.terrain.vertices, header.terrain.triangles};
    Box3 box;
    for (const Vec3& v : mesh.vertices) box.extend(v);
    ground_ = rasterise(mesh, box, coarse_ground_side);
    lowest_ground_ = box.min().z();
  }
  extend(header.blocks);
}

void SummaryBuilder::extend(std::span<const sim::RunHeader::BlockInfo> blocks) {
  for (const auto& b : blocks) {
    if (b.from >= static_cast<int>(structures_.size()))
      throw std::out_of_range("a piece names a structure that is not there");
    header_.blocks.push_back(b);
    header_.blocks.back().shape = Polyhedron{};
  }
  blocks_.resize(header_.blocks.size());
  if (!ground_.z.empty()) ground_of_.resize(blocks_.size(), {.there = {}, .height = lowest_ground_});
  for (auto& row : open_of_) row.resize(header_.blocks.size());
}

std::vector<double> SummaryBuilder::left() const {
  std::vector<double> times;
  for (const BlockTrack& b : blocks_)
    times.push_back(b.left ? b.time : std::numeric_limits<double>::quiet_NaN());
  return times;
}

double SummaryBuilder::ground_at(const Vec3& x) const {
  const auto i = std::lround((x.x() - ground_.x0) / ground_.dx),
             j = std::lround((x.y() - ground_.y0) / ground_.dy);
  if (i < 0 || j < 0 || i >= ground_.nx || j >= ground_.ny) return std::numeric_limits<double>::quiet_NaN();
  return ground_
      .z[static_cast<std::size_t>(j) * static_cast<std::size_t>(ground_.nx) + static_cast<std::size_t>(i)];
}

void SummaryBuilder::watch_edge(std::size_t i) {
  LastGround& last = ground_of_[i];
  BlockTrack& b = blocks_[i];
  if (const double height = ground_at(b.end); std::isfinite(height)) {
    last = {.there = b, .height = height, .beside = false};
  } else if (!last.there.born) {
    last = {.there = b, .height = lowest_ground_, .beside = true};
  } else if (b.end.z() + std::cbrt(header_.blocks[i].volume) < last.height) {
    if (!last.beside || !struck(i)) b = last.there;
    b.left = true;
  }
}

void SummaryBuilder::add_block(std::size_t i, const HistoryRow& row) {
  BlockTrack& b = blocks_[i];
  if (!row.position[i].allFinite() || b.left) return;
  if (!b.born) {
    b.born = true;
    b.birth = row.time;
    b.start = row.position[i];
    if (const int s = header_.blocks[i].from;
        s >= 0 && structures_[static_cast<std::size_t>(s)].first_loss < 0)
      structures_[static_cast<std::size_t>(s)].first_loss = row.time;
  } else {
    b.path += (row.position[i] - b.end).norm();
    if (row.time > b.time) b.acceleration = (row.velocity[i] - b.velocity).norm() / (row.time - b.time);
  }
  b.time = row.time;
  b.end = row.position[i];
  b.velocity = row.velocity[i];
  b.spin = row.spin[i];
  b.kinetic = row.kinetic_translational[i] + row.kinetic_rotational[i];
  b.rotational = row.kinetic_rotational[i];
  b.peaks.add({.speed = b.velocity.norm(), .spin = b.spin.norm(), .kinetic = b.kinetic});
  if (i < row.peaks.size()) b.peaks.add(row.peaks[i]);
  if (!ground_of_.empty() && !header_.blocks[i].fixed) watch_edge(i);
}

void SummaryBuilder::add_structure(std::size_t i, const HistoryRow& row) {
  StructureTrack& s = structures_[i];
  const auto& r = row.structures[i];
  if (!s.seen) {
    s.seen = true;
    const auto& info = header_.structures[i];
    s.first_force = info.told_permanent ? Vec3(info.permanent.head<3>()) : r.base_force;
    s.first_moment = info.told_permanent ? Vec3(info.permanent.tail<3>()) : r.base_moment;
    s.lost_before = r.spalled_volume;
  }
  if (s.first_loss < 0 && r.spalled_volume > s.lost_before) s.first_loss = row.time;
  s.loads = r.peaks;
  s.damage = std::max(s.damage, r.damage_max);
  s.damaged_volume = std::max(s.damaged_volume, r.damaged_volume);
  s.spalled_volume = std::max(s.spalled_volume, r.spalled_volume);
  for (std::size_t k = 0; k < std::min({r.members.size(), r.peaks.members.size(), s.members.size()}); ++k)
    s.members[k].add(row.time, r.members[k], r.peaks.members[k]);
  for (std::size_t k = 0; k < r.probe_displacement.size() && k < s.probes.size(); ++k) {
    const double d = r.probe_displacement[k].norm();
    const auto keep = [&](double size, double time) {
      if (size > s.probes[k].peak) s.probes[k].peak = size, s.probes[k].peak_time = time;
    };
    if (k < r.peaks.probes.size()) keep(r.peaks.probes[k].value, r.peaks.probes[k].time);
    keep(d, row.time);
    s.probes[k].last = r.probe_displacement[k];
  }
}

void SummaryBuilder::add(const HistoryRow& row) {
  time_ = row.time;
  for (std::size_t i = 0; i < row.position.size() && i < blocks_.size(); ++i) add_block(i, row);
  for (std::size_t i = 0; i < row.structures.size() && i < structures_.size(); ++i) add_structure(i, row);
  if (!any_) first_ = row.ledger;
  if (const double step = row.ledger.numerical_dissipation() - last_.numerical_dissipation();
      any_ && std::abs(step) > std::abs(algorithmic_step_)) {
    algorithmic_step_ = step;
    algorithmic_from_ = ledger_time_;
    algorithmic_to_ = row.time;
  }
  ledger_time_ = row.time;
  any_ = true;
  last_ = row.ledger;
  springs_ = springs_ || row.ledger.contact != 0;
  kinetic_peak_ = std::max({kinetic_peak_, row.ledger.kinetic, row.kinetic_peak});
  strain_moved_ = std::max(strain_moved_,
                           std::abs(row.ledger.strain + row.ledger.contact - first_.strain - first_.contact));
  if (std::abs(row.ledger.residual) > std::abs(residual_worst_))
    residual_worst_ = row.ledger.residual, residual_worst_time_ = row.time;
}

bool SummaryBuilder::elastic(std::size_t structure) const {
  return header_.structures[structure].plan.find("elastic, no damage history kept") != std::string::npos;
}

SummaryBuilder::Through SummaryBuilder::loaded_through(std::size_t structure) const {
  constexpr double least = 1e-3;  // added reaction over the greatest contact force of what was struck
  if (first_strike(structure) != nullptr) return {};
  std::vector<char> seen(structures_.size(), 0);
  seen[structure] = 1;
  // From it outwards to the nearest that was struck; the result is the neighbour by which that path begins.
  std::vector<std::pair<std::size_t, int>> ring{{structure, -1}};
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const auto [at, by] = ring[k];
    if (const Impact* strike = by >= 0 ? first_strike(at) : nullptr)
      return structures_[structure].loads.force.value > least * structures_[at].peak_force
                 ? Through{by, strike->start}
                 : Through{};
    for (const int other : header_.structures[at].meets)
      if (char& known = seen[static_cast<std::size_t>(other)]; known == 0)
        known = 1, ring.emplace_back(static_cast<std::size_t>(other), by >= 0 ? by : other);
  }
  return {};
}

const coupling::Met* SummaryBuilder::met(std::size_t structure) const {
  return structure < met_.size() && met_[structure].first >= 0 ? &met_[structure] : nullptr;
}

std::string SummaryBuilder::others_met(std::size_t structure) const {
  std::string others;
  for (const int k : header_.structures[structure].meets)
    if (met(static_cast<std::size_t>(k)) != nullptr)
      others += (others.empty() ? "" : ", ") + header_.structures[static_cast<std::size_t>(k)].name;
  return others;
}

bool SummaryBuilder::is_own(int block, int structure) const {
  return header_.blocks[static_cast<std::size_t>(block)].from == structure;
}

const Impact* SummaryBuilder::first_strike(std::size_t structure) const {
  const auto m = std::find_if(impacts_.begin(), impacts_.end(),
                              [&](const Impact& x) { return x.structure == static_cast<int>(structure); });
  return m == impacts_.end() ? nullptr : &*m;
}

const Impact* SummaryBuilder::hardest_strike(std::size_t structure) const {
  const auto rank = [&](const Impact& m) {
    return std::pair(!header_.blocks[static_cast<std::size_t>(m.block)].fragment, m.kinetic);
  };
  const Impact* hardest = nullptr;
  for (const Impact& m : impacts_)
    if (m.structure == static_cast<int>(structure) && (hardest == nullptr || rank(m) > rank(*hardest)))
      hardest = &m;
  return hardest;
}

double SummaryBuilder::failed_before_strike(std::size_t structure) const {
  const sim::RunHeader::StructureInfo& info = header_.structures[structure];
  const double loss = structures_[structure].first_loss;
  const Impact* first = first_strike(structure);
  // What nothing holds falls and lands, on another structure too.
  const auto free = [](const sim::RunHeader::StructureInfo& s) {
    return s.told_permanent && s.permanent.isZero(0);
  };
  const bool landed = free(info) || std::any_of(info.meets.begin(), info.meets.end(), [&](int other) {
                        return free(header_.structures[static_cast<std::size_t>(other)]);
                      });
  return loss < 0 || info.loaded || landed || (first != nullptr && first->start <= loss) ? -1 : loss;
}

/// What reduces the numerical energy error of contacts, by the keys that choose this run's steps.
std::string SummaryBuilder::against_algorithmic() const {
  const std::string springs =
      springs_ ? "; if springs sink by more than a tenth of a block, a stiffer interface.normal_stiffness"
               : "";
  switch (steps_) {
    case Steps::by_accuracy: return "set a lower simulation.accuracy" + springs;
    case Steps::fixed: return "set a shorter simulation.step, or simulation.accuracy in its place" + springs;
    case Steps::scheme_1988: break;
  }
  return "the scheme of 1988 has it: try a shorter simulation.step, or simulation.method = \"talus\"";
}

const char* SummaryBuilder::moved_name() const {
  if (moved_energy() == kinetic_peak_) return "largest kinetic energy";
  return moved_energy() == strain_moved_ ? "largest change of stored energy" : "work of the loads";
}

/// Numerical dissipation or energy gain: how much, when, and which keys of this run can reduce it.
std::string SummaryBuilder::algorithmic_warning() const {
  const double sum = last_.numerical_dissipation();
  std::string text =
      fmt::format("numerical {} of {}, {:.2g} % of the {}, {} (energy.algorithmic)",
                  sum > 0 ? "dissipation" : "energy gain", engineering(std::abs(sum), "J"),
                  100 * std::abs(sum) / moved_energy(), moved_name(), engineering(moved_energy(), "J"));
  if (algorithmic_step_ / sum > 0.5)
    text += fmt::format(", most of it between t = {:.6g} and {:.6g} s", algorithmic_from_, algorithmic_to_);
  text += ".";
  const bool contacts = structures_.size() > 1 || std::any_of(header_.blocks.begin(), header_.blocks.end(),
                                                              [](const auto& b) { return !b.fixed; });
  if (contacts) text += " Contacts: " + against_algorithmic() + ".";
  if (!structures_.empty())
    text += fmt::format(
        " At structures finer cells help most (of a round section: facets); they choose their own sub-steps: "
        "try {}a lower structure.critical_step_fraction.",
        header_.blocks.empty() ? "" : "a higher coupling.exchanges_per_rise or ");
  if (contacts && springs_ && sum > 0 && !structures_.empty())
    text +=
        " What springs per area hold below a face that folds away is lost; "
        "normal_stiffness = \"hard\" holds nothing.";
  text.pop_back();
  return text;
}

/// Stress that elastic cells bear and concrete does not.
std::string SummaryBuilder::elastic_warning(std::size_t i) const {
  const LoadPeaks& p = structures_[i].loads;
  const auto part = [](const StressPeak& s, const char* what) {
    return s.strength > 0 && s.value > s.strength
               ? fmt::format(
                     "{:.3g} MPa {} in concrete of {:.3g} MPa (at {}, t = {:.4g} s; "
                     "{:.2g} % of the volume at most)",
                     s.value / 1e6, what, s.strength / 1e6, place_text(s.at), s.time, 100 * s.share)
               : std::string();
  };
  const std::string pressed = part(p.compression, "of compression"), pulled = part(p.tension, "of tension");
  if (pressed.empty() && pulled.empty()) return "";
  return fmt::format(
      "{} is elastic in this run (damage = \"none\") and exceeds the strength of concrete: {}{}{}. Its "
      "forces, "
      "displacements and the blocks' rebound are those of a material without strength limit; "
      "run it with damage = \"concrete\"",
      header_.structures[i].name, pressed, pressed.empty() || pulled.empty() ? "" : ", ", pulled);
}

double SummaryBuilder::least_kinetic() const {
  constexpr double least = 5e-5;  // [J/kg] 1 cm/s
  double mass = 0;
  for (const auto& b : header_.blocks) mass += b.fixed ? 0 : b.mass;
  return least * mass;
}

bool SummaryBuilder::scheme_takes_too_much() const {
  constexpr double allowed = 0.01;  // of the energy that was moved
  return std::abs(last_.numerical_dissipation()) > allowed * moved_energy() &&
         kinetic_peak_ > least_kinetic();
}

std::vector<std::string> SummaryBuilder::warnings(const json& formulas,
                                                  const sim::RunCounters& counters) const {
  std::vector<std::string> list;
  for (std::size_t i = 0; i < structures_.size(); ++i)
    if (std::string beyond = elastic_warning(i); !beyond.empty()) list.push_back(std::move(beyond));
  list.insert(list.end(), header_.warnings.begin(), header_.warnings.end());
  if (scheme_takes_too_much()) list.push_back(algorithmic_warning());
  constexpr double notable = 0.01;  // of what moved
  if (const double lost = counters.restitution_lost; lost > notable * kinetic_peak_ && lost > least_kinetic())
    list.push_back(fmt::format(
        "contacts between many blocks closed within a step, without their restitution: {} of rebound, {:.2g} "
        "% of "
        "the {}, {}, is missing and stands under energy.damping_work (counters.restitution_lost). A lower "
        "simulation.accuracy follows more of them one by one",
        engineering(lost, "J"), 100 * lost / moved_energy(), moved_name(), engineering(moved_energy(), "J")));
  for (std::size_t i = 0; i < structures_.size(); ++i)
    if (const double loss = failed_before_strike(i); loss >= 0)
      list.push_back(
          fmt::format("{} fails under permanent load at t = {:.3g} s, before any block arrives: what the run "
                      "says of an impact on it is void. Check its section, reinforcement and supports, "
                      "and its capacity (talus capacity)",
                      header_.structures[i].name, loss));
  if (header_.prescribed_impact && impacts_.empty() && !blocks_.empty())
    list.push_back(fmt::format(
        "the block of [impact] never touched {} within {:.4g} s: nothing here tells of an impact. Check "
        "impact.point, velocity and orientation, and simulation.duration",
        header_.structures.empty() ? std::string("the structure") : header_.structures[0].name, time_));
  for (const json& f : formulas)
    if (f["id"] == "hertz" && f["computed"].get<double>() > f["value"].get<double>())
      list.push_back(
          fmt::format("the greatest force of a single sub-step on {}, {}, is above Hertz's elastic {}, an "
                      "upper bound of a sphere's contact: it depends on cells and contact law. "
                      "Take the filtered force ({}), the impulse and the base reactions",
                      f["structure"].get<std::string>(), engineering(f["computed"], "N"),
                      engineering(f["value"], "N"), engineering(f["computed_filtered"], "N")));
  return list;
}

bool has_ended(const std::string& status) {
  return status == "done" || status == "at rest" || status == "all left";
}

std::vector<std::string> summary_warnings(const std::string& summary_json) {
  return json::parse(summary_json).at("warnings").get<std::vector<std::string>>();
}

std::vector<std::string> summary_headline(const std::string& summary_json) {
  return json::parse(summary_json).at("headline").get<std::vector<std::string>>();
}

double SummaryBuilder::blow_part(const Impact& impact, const Open& open) const {
  const Vec3 n = impact.normal.normalized();
  const double mass = header_.blocks[static_cast<std::size_t>(impact.block)].mass,
               whole = 2 * mass * std::abs(impact.velocity.dot(n)),
               made = std::abs(open.force.dot(n)) * open.dt,
               left = whole - (std::abs(impact.impulse.dot(n)) - made);
  return made > 0 ? open.force.norm() * std::clamp(left / made, 0.0, 1.0) : 0;
}

void SummaryBuilder::close_step(Open& open) {
  if (open.impact < 0) return;
  Impact& impact = impacts_[static_cast<std::size_t>(open.impact)];
  const double f = open.force.norm();
  if (f > impact.peak_force) impact.peak_force = f, impact.peak_time = open.time;
  impact.blow_force = std::max(impact.blow_force, blow_part(impact, open));
  open.force.setZero();
}

/// Its force is filtered and forgotten.
void SummaryBuilder::settle(Impact& impact) {
  impact.filtered_force = std::max(impact.filtered_force, impact.force.filtered_peak());
  impact.force = {};
}

void SummaryBuilder::close_step(StructureTrack& s) {
  const double f = s.step_force.norm();
  if (f > s.peak_force) s.peak_force = f, s.peak_force_time = s.step_time;
  s.step_force.setZero();
}

void SummaryBuilder::add_to_structure(StructureTrack& s, const ContactRow& c) {
  if (c.time != s.step_time) close_step(s);
  s.step_time = s.last_contact = c.time;
  s.step_force += c.force;
  s.impulse += c.force * c.dt;
}

void SummaryBuilder::add(std::span<const ContactRow> rows) {
  for (const ContactRow& c : rows) {
    if (c.structure < 0 || c.block < 0) continue;
    const auto is = static_cast<std::size_t>(c.structure), ib = static_cast<std::size_t>(c.block);
    if (is >= structures_.size() || ib >= blocks_.size()) continue;
    const double size = c.force.norm();
    if (!(size > nothing * header_.blocks[ib].mass)) continue;  // a contact that carries nothing is no impact
    add_to_structure(structures_[is], c);
    if (is_own(c.block, c.structure)) continue;
    Open& open = open_of_[is][ib];
    if (open.impact < 0 || c.time - c.dt > open.time + impact_gap) {
      close_step(open);
      if (open.impact >= 0) settle(impacts_[static_cast<std::size_t>(open.impact)]);
      open.impact = static_cast<int>(impacts_.size());
      open.weight = 0;
      Impact impact;
      impact.structure = c.structure;
      impact.block = c.block;
      impact.start = c.time - c.dt;
      impact.velocity = blocks_[ib].born ? blocks_[ib].velocity : Vec3::Zero();
      impact.spin = blocks_[ib].born ? blocks_[ib].spin : Vec3::Zero();
      impact.kinetic = blocks_[ib].kinetic;
      impact.rotational = above_round_off(blocks_[ib].rotational, impact.kinetic);
      impacts_.push_back(impact);
      open.time = c.time;
    }
    Impact& impact = impacts_[static_cast<std::size_t>(open.impact)];
    // As it came: not what a later row of the same blow, or the last row of the history, says.
    if (c.arrival.known && c.time - c.dt <= impact.start) {
      impact.velocity = c.arrival.velocity;
      impact.spin = c.arrival.spin;
      impact.kinetic = c.arrival.translational + c.arrival.rotational;
      impact.rotational = above_round_off(c.arrival.rotational, impact.kinetic);
    }
    if (c.time != open.time) close_step(open);
    open.time = c.time, open.dt = c.dt;
    open.force += c.force;
    impact.end = c.time;
    impact.impulse += c.force * c.dt;
    const double w = size * c.dt;
    impact.normal += w * c.normal;
    open.weight += w;
    if (open.weight > 0) impact.point += (c.point - impact.point) * (w / open.weight);
    impact.force.add(c.time, c.dt, c.force);
  }
}

}  // namespace talus::io

#include "io/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;
using sim::ContactRow;
using sim::HistoryRow;

/// A number with a unit prefix, for sentences: 2.31e6 N -> "2.31 MN".
std::string engineering(double value, const char* unit) {
  const double a = std::abs(value);
  const char* prefix = "";
  double scale = 1;
  if (a >= 1e9)
    prefix = "G", scale = 1e9;
  else if (a >= 1e6)
    prefix = "M", scale = 1e6;
  else if (a >= 1e3)
    prefix = "k", scale = 1e3;
  else if (a > 0 && a < 1e-3)
    prefix = "u", scale = 1e-6;
  else if (a > 0 && a < 1)
    prefix = "m", scale = 1e-3;
  return fmt::format("{:.3g} {}{}", value / scale, prefix, unit);
}

/// "397 m", "12.3 m", "112 mm": lengths as a headline has them.
std::string length(double metres) {
  return std::abs(metres) >= 100 ? fmt::format("{:.0f} m", metres) : engineering(metres, "m");
}

constexpr double nothing =
    1e-8;  // [m/s^2] a contact force over the block's mass: what a solver's tolerance leaves is less
constexpr int coarse_ground_side = 400;  // nodes of the coarse grid that tells where the terrain ends

double horizontal(const Vec3& v) { return std::hypot(v.x(), v.y()); }

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
  b.max_speed = std::max(b.max_speed, b.velocity.norm());
  b.max_spin = std::max(b.max_spin, b.spin.norm());
  b.max_kinetic = std::max(b.max_kinetic, b.kinetic);
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
    if (d > s.probes[k].peak) s.probes[k].peak = d, s.probes[k].peak_time = row.time;
    s.probes[k].last = r.probe_displacement[k];
  }
}

void SummaryBuilder::add(const HistoryRow& row) {
  time_ = row.time;
  for (std::size_t i = 0; i < row.position.size() && i < blocks_.size(); ++i) add_block(i, row);
  for (std::size_t i = 0; i < row.structures.size() && i < structures_.size(); ++i) add_structure(i, row);
  if (!any_) first_ = row.ledger;
  if (const double step = row.ledger.by_the_scheme() - last_.by_the_scheme();
      any_ && std::abs(step) > std::abs(algorithmic_step_)) {
    algorithmic_step_ = step;
    algorithmic_from_ = ledger_time_;
    algorithmic_to_ = row.time;
  }
  ledger_time_ = row.time;
  any_ = true;
  last_ = row.ledger;
  springs_ = springs_ || row.ledger.contact != 0;
  kinetic_peak_ = std::max(kinetic_peak_, row.ledger.kinetic);
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
  // From it outwards to the nearest that was struck; what is told is the neighbour by which the way begins.
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

bool SummaryBuilder::is_own(int block, int structure) const {
  return header_.blocks[static_cast<std::size_t>(block)].from == structure;
}

const Impact* SummaryBuilder::first_strike(std::size_t structure) const {
  const auto m = std::find_if(impacts_.begin(), impacts_.end(),
                              [&](const Impact& x) { return x.structure == static_cast<int>(structure); });
  return m == impacts_.end() ? nullptr : &*m;
}

double SummaryBuilder::failed_before_strike(std::size_t structure) const {
  const double loss = structures_[structure].first_loss;
  const Impact* first = first_strike(structure);
  return loss < 0 || header_.structures[structure].loaded || (first != nullptr && first->start <= loss)
             ? -1
             : loss;
}

/// What lessens the energy that the scheme itself takes or makes in contacts, by the keys that this run's
/// steps go by.
std::string SummaryBuilder::against_algorithmic() const {
  const std::string springs =
      springs_ ? "; if springs sink by more than a tenth of a block, a stiffer interface.normal_stiffness"
               : "";
  switch (steps_) {
    case Steps::by_accuracy: return "set a lower simulation.accuracy" + springs;
    case Steps::fixed: return "set a shorter simulation.step, or simulation.accuracy in its place" + springs;
    case Steps::scheme_1988: break;
  }
  return "it is the scheme of 1988 that does so: see whether it lessens with a shorter simulation.step, or "
         "take simulation.method = \"talus\"";
}

/// Energy that the scheme itself takes or makes: how much, when, and what the run has that can lessen it.
std::string SummaryBuilder::algorithmic_warning() const {
  const double sum = last_.by_the_scheme();
  std::string text =
      fmt::format("the scheme itself {} {}, {:.2g} % of the largest kinetic energy, {} (energy.algorithmic)",
                  sum > 0 ? "took" : "made", engineering(std::abs(sum), "J"),
                  100 * std::abs(sum) / kinetic_peak_, engineering(kinetic_peak_, "J"));
  if (algorithmic_step_ / sum > 0.5)
    text += fmt::format(", most of it between t = {:.6g} and {:.6g} s", algorithmic_from_, algorithmic_to_);
  text += ".";
  const bool contacts = structures_.size() > 1 || std::any_of(header_.blocks.begin(), header_.blocks.end(),
                                                              [](const auto& b) { return !b.fixed; });
  if (contacts) text += " Contacts: " + against_algorithmic() + ".";
  if (!structures_.empty())
    text += fmt::format(
        " Structures: their sub-steps are their own; see whether it lessens with {}a lower "
        "structure.critical_step_fraction.",
        header_.blocks.empty() ? "" : "a higher coupling.exchanges_per_rise or ");
  text.pop_back();
  return text;
}

/// Stress that elastic cells bear and concrete does not.
std::string SummaryBuilder::elastic_warning(std::size_t i) const {
  const LoadPeaks& p = structures_[i].loads;
  const auto part = [](const StressPeak& s, const char* what) {
    return s.strength > 0 && s.value > s.strength
               ? fmt::format(
                     "{:.3g} MPa {} in concrete of {:.3g} MPa (at [{:.3g}, {:.3g}, {:.3g}], t = {:.4g} s; "
                     "{:.2g} % of the volume at most)",
                     s.value / 1e6, what, s.strength / 1e6, s.at.x(), s.at.y(), s.at.z(), s.time,
                     100 * s.share)
               : std::string();
  };
  const std::string pressed = part(p.compression, "of compression"), pulled = part(p.tension, "of tension");
  if (pressed.empty() && pulled.empty()) return "";
  return fmt::format(
      "{} is elastic in this run (damage = \"none\") and bears what concrete cannot: {}{}{}. Its forces, "
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

std::vector<std::string> SummaryBuilder::warnings(const json& formulas) const {
  constexpr double allowed = 0.01;  // of the largest kinetic energy
  std::vector<std::string> list;
  for (std::size_t i = 0; i < structures_.size(); ++i)
    if (std::string beyond = elastic_warning(i); !beyond.empty()) list.push_back(std::move(beyond));
  list.insert(list.end(), header_.warnings.begin(), header_.warnings.end());
  const double scale =
      std::max(kinetic_peak_, std::abs(last_.external_work));  // a load that is put on slowly moves little
  if (std::abs(last_.by_the_scheme()) > allowed * scale && kinetic_peak_ > least_kinetic())
    list.push_back(algorithmic_warning());
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

void SummaryBuilder::close_step(Open& open) {
  if (open.impact < 0) return;
  Impact& impact = impacts_[static_cast<std::size_t>(open.impact)];
  const double f = open.force.norm();
  if (f > impact.peak_force) impact.peak_force = f, impact.peak_time = open.time;
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
      impact.rotational = blocks_[ib].rotational;
      impacts_.push_back(impact);
      open.time = c.time;
    }
    Impact& impact = impacts_[static_cast<std::size_t>(open.impact)];
    if (c.time != open.time) close_step(open);
    open.time = c.time;
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

std::vector<std::string> SummaryBuilder::headline() const {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < structures_.size(); ++i) structure_lines(i, lines);
  if (structures_.empty()) block_lines(lines);
  left_line(lines);
  return lines;
}

const Member* struck_member(const sim::RunHeader::StructureInfo& structure, const Vec3& point) {
  const bool spanned = std::ranges::any_of(structure.members, &Member::span);
  for (const bool above_piers : {false, true}) {  // a cap beam ends between a pier's top and its spans
    const Member* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Member& m : structure.members) {
      const Vec3 axis = m.axis_x.cross(m.axis_y), from_base = point - m.base;
      const double along = from_base.dot(axis), aside = (from_base - along * axis).norm();
      constexpr double deformed = 0.02;  // of its extent
      const bool reaches = along >= -deformed * m.length &&
                           (along <= (1 + deformed) * m.length || (above_piers && !m.span)),
                 at_height = !m.span || std::abs(from_base.dot(m.axis_y)) <= (0.5 + deformed) * m.section[1];
      if (!reaches || !at_height || aside >= least) continue;
      nearest = &m;
      least = aside;
    }
    if (nearest != nullptr || !spanned) return nearest;
  }
  return nullptr;
}

/// Its name in a sentence: the member that was struck, of the structure if that has more than one.
static std::string struck_name(const sim::RunHeader::StructureInfo& structure, const Vec3& point) {
  const Member* member = struck_member(structure, point);
  return member == nullptr || member->name == structure.name
             ? structure.name
             : fmt::format("{} of {}", member->name, structure.name);
}

/// What struck a structure, or what its prescribed loads did to it.
void SummaryBuilder::structure_lines(std::size_t i, std::vector<std::string>& lines) const {
  const sim::RunHeader::StructureInfo& info = header_.structures[i];
  const StructureTrack& s = structures_[i];
  const auto fragment = [&](const Impact& m) {
    return header_.blocks[static_cast<std::size_t>(m.block)].fragment;
  };
  const auto name_of = [&](const Impact& m) {
    return header_.blocks[static_cast<std::size_t>(m.block)].name;
  };
  const Impact* first = first_strike(i);
  const Impact* worst = nullptr;
  int count = 0;
  for (const Impact& m : impacts_) {
    if (m.structure != static_cast<int>(i)) continue;
    if (!fragment(m)) ++count;
    // A piece of another structure: no blow to head the page with, if there is one of a block.
    const auto rank = [&](const Impact& x) { return std::pair(!fragment(x), x.filtered_force); };
    if (worst == nullptr || rank(m) > rank(*worst)) worst = &m;
  }
  const double failed = failed_before_strike(i);
  if (failed >= 0)
    lines.push_back(fmt::format("{} fails under permanent load at t = {:.3f} s, before any block arrives.",
                                info.name, failed));
  if (first != nullptr) {
    lines.push_back(fmt::format(
        "{} struck {} at {:.4g} s with {:.1f} m/s and {} ({} of translation, {} of rotation); {} {} in all.",
        name_of(*first), struck_name(info, first->point), first->start, first->velocity.norm(),
        engineering(first->kinetic, "J"), engineering(first->kinetic - first->rotational, "J"),
        engineering(first->rotational, "J"), count, count == 1 ? "impact" : "impacts"));
    member_lines(i, lines);
    lines.push_back(
        fmt::format("Greatest contact force {} ({}, low-passed at {:.0f} Hz; {} in a single sub-step, which "
                    "depends on cells and contact law). Impulse of all contacts {}.",
                    engineering(worst->filtered_force, "N"), name_of(*worst), force_cutoff,
                    engineering(worst->peak_force, "N"), engineering(s.impulse.norm(), "N s")));
  } else if (info.loaded) {
    const auto most =
        std::max_element(s.probes.begin(), s.probes.end(),
                         [](const ProbeTrack& a, const ProbeTrack& b) { return a.peak < b.peak; });
    lines.push_back(fmt::format(
        "{} under its prescribed load: {} added to the base reaction at most, at {:.3f} s{}.", info.name,
        engineering(s.loads.force.value, "N"), s.loads.force.time,
        most == s.probes.end() ? std::string()
                               : fmt::format("; {} moved {} at most",
                                             info.probes[static_cast<std::size_t>(most - s.probes.begin())],
                                             engineering(most->peak, "m"))));
    member_lines(i, lines);
    if (!blocks_.empty()) lines.push_back(fmt::format("No block struck {}.", info.name));
  } else {
    not_hit_line(i, lines);
  }
  piece_line(i, lines);
  if (s.damage > 0)
    lines.push_back(fmt::format(
        "Greatest damage {:.2f}; {:.3g} m^3 with damage above one half{}.", s.damage, s.damaged_volume,
        s.spalled_volume > 0 ? fmt::format(", {:.3g} m^3 eroded or come off", s.spalled_volume)
                             : std::string()));
}

/// What no block struck: what it got through others that touch it.
void SummaryBuilder::not_hit_line(std::size_t i, std::vector<std::string>& lines) const {
  constexpr double least = 1e-3;  // of its permanent load
  const sim::RunHeader::StructureInfo& info = header_.structures[i];
  const StructureTrack& s = structures_[i];
  const std::string added = fmt::format("{} added to its base reaction at most, at {:.3f} s",
                                        engineering(s.loads.force.value, "N"), s.loads.force.time);
  if (const Through by = loaded_through(i); by.structure >= 0) {
    lines.push_back(fmt::format("{} was not struck itself, it was loaded through {}: {}{}.", info.name,
                                header_.structures[static_cast<std::size_t>(by.structure)].name, added,
                                s.loads.force.time < by.struck ? ", before a block struck" : ""));
    return member_lines(i, lines);
  }
  if (!info.meets.empty() && s.loads.force.value > std::max(least * s.first_force.norm(), 1e-3)) {
    std::string others;
    for (const int k : info.meets)
      others += (others.empty() ? "" : ", ") + header_.structures[static_cast<std::size_t>(k)].name;
    lines.push_back(fmt::format("{} was not hit; {}, by what it can touch ({}) or by its own motion.",
                                info.name, added, others));
    return member_lines(i, lines);
  }
  lines.push_back(fmt::format("{} was not hit.", info.name));
  if (s.damage > 0) member_lines(i, lines);
}

/// What came off a structure, a whole span or splinters.
void SummaryBuilder::piece_line(std::size_t structure, std::vector<std::string>& lines) const {
  constexpr double least = 0.1;  // [m] less is no fall
  std::size_t count = 0, heaviest = 0;
  double mass = 0, first = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!is_own(static_cast<int>(i), static_cast<int>(structure)) || !blocks_[i].born) continue;
    if (count++ == 0 || header_.blocks[i].mass > header_.blocks[heaviest].mass) heaviest = i;
    mass += header_.blocks[i].mass;
    first = std::min(first, blocks_[i].birth);
  }
  if (count == 0) return;
  const auto tonnes = [](double kilograms) { return fmt::format("{:.3g} t", kilograms / 1e3); };
  const std::string& name = header_.structures[structure].name;
  std::string text = count == 1
                         ? fmt::format("1 piece of {} came off {} at {:.3f} s", tonnes(mass), name, first)
                         : fmt::format("{} pieces of {} in all came off {}, the first at {:.3f} s", count,
                                       tonnes(mass), name, first);
  if (count > 1)
    text += fmt::format("; the heaviest, {} of {},", header_.blocks[heaviest].name,
                        tonnes(header_.blocks[heaviest].mass));
  else
    text += "; it";
  const double fall = blocks_[heaviest].start.z() - blocks_[heaviest].end.z();
  lines.push_back(text +
                  (fall > least
                       ? " fell " + length(fall)
                       : fmt::format(" has moved {} so far",
                                     length((blocks_[heaviest].end - blocks_[heaviest].start).norm()))) +
                  ".");
}

void SummaryBuilder::member_lines(std::size_t i, std::vector<std::string>& lines) const {
  constexpr std::size_t shown = 6;
  const sim::RunHeader::StructureInfo& info = header_.structures[i];
  std::vector<std::pair<const MemberTrack*, MemberTrack::Verdict>> members;
  for (const MemberTrack& m : structures_[i].members)
    if (m.has_verdict()) members.emplace_back(&m, m.verdict());
  if (members.empty()) return;
  std::stable_sort(members.begin(), members.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second.grade, a.second.use_design) > std::pair(b.second.grade, b.second.use_design);
  });
  const auto whole = [&](const MemberTrack& m) {
    return m.name() == info.name ? info.name : info.name + ", " + m.name();
  };
  if (elastic(i)) {
    const auto most = std::max_element(members.begin(), members.end(), [](const auto& a, const auto& b) {
      return a.second.use_design < b.second.use_design;
    });
    lines.push_back(
        fmt::format("{}: V_dyn/V_Rd = {:.2f} at most (shear against its design resistance, EN 1992-1-1 6.2). "
                    "It is elastic in this run: what breaks was not computed.",
                    whole(*most->first), most->second.use_design));
    return;
  }
  const auto& [worst, verdict] = members.front();
  lines.push_back(
      fmt::format("{}: damage class {} of 4, {} ({}). Shear V_dyn/V_Rd = {:.2f} at most (design resistance, "
                  "EN 1992-1-1 6.2).",
                  whole(*worst), verdict.grade, verdict.grade == 0 ? "no damage" : verdict.name,
                  verdict.basis, verdict.use_design));
  if (members.size() < 2) return;
  std::string others;
  std::size_t told = 0;
  for (std::size_t k = 1; k < members.size() && told < shown && members[k].second.grade > 0; ++k, ++told)
    others +=
        fmt::format("{}{} {} {} (V_dyn/V_Rd {:.2f})", others.empty() ? "" : ", ", members[k].first->name(),
                    members[k].second.grade, members[k].second.name, members[k].second.use_design);
  if (const std::size_t rest = members.size() - 1 - told; rest > 0) {
    const auto& next = members[1 + told].second;
    others +=
        fmt::format("{}{} {} class {}{}", others.empty() ? "" : ", ", rest,
                    others.empty() ? "members of" : "more of", next.grade, next.grade > 0 ? " or less" : "");
  }
  lines.push_back(fmt::format("Other members of {}: {}.", info.name, others));
  function_line(i, lines);
}

/// What traffic the spans of a deck may carry, the worst first.
void SummaryBuilder::function_line(std::size_t i, std::vector<std::string>& lines) const {
  std::string spans;
  std::size_t open = 0;
  for (const char* state : {"closed", "restricted", "open"})
    for (const MemberTrack& m : structures_[i].members) {
      const MemberTrack::Function f = m.function();
      if (f.basis.empty() || std::string_view(f.state) != state) continue;
      if (std::string_view(state) == "open")
        ++open;
      else
        spans += fmt::format("{}{} {} ({})", spans.empty() ? "" : ", ", m.name(), f.state, f.basis);
    }
  if (open > 0)
    spans += fmt::format("{}{} open", spans.empty() ? "" : ", ",
                         open == 1 ? "1 span" : fmt::format("{} spans", open));
  if (!spans.empty())
    lines.push_back(
        fmt::format("Deck of {}: {}. Our own rule: closed from damage class 3, joints moved by 50 mm or "
                    "1/250 of the span; restricted from class 2 or 1/1000.",
                    header_.structures[i].name, spans));
}

/// Slower than a hundredth of what a fall from its own size gives, and not about to get faster: a block that
/// was let go a moment ago is slow too. What was proven to rest has no velocity at all.
bool SummaryBuilder::moves(std::size_t i) const {
  constexpr double gravity = 9.81, slow = 0.01, calm = 0.05;
  const double speed = std::sqrt(2 * gravity * std::cbrt(header_.blocks[i].volume));
  return !header_.blocks[i].fixed && !(time_ > 0 && blocks_[i].velocity.isZero(0)) &&
         (blocks_[i].velocity.norm() > slow * speed || blocks_[i].acceleration > calm * gravity);
}

/// Where the blocks went, where there is nothing to strike.
void SummaryBuilder::block_lines(std::vector<std::string>& lines) const {
  constexpr double shortest = 1e-6;  // [s] below it gravity has set nothing in motion
  constexpr double still = 1e-4;     // [m/s] a third of a metre in an hour: slower is called rest
  std::size_t farthest = 0, moving = 0;
  double way = -1, run = 0;  // in all; in plan
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!blocks_[i].born || started_beside(i)) continue;
    const Vec3 gone = blocks_[i].end - blocks_[i].start;
    if (gone.norm() > way) way = gone.norm(), run = horizontal(gone), farthest = i;
    if (!blocks_[i].left && moves(i)) ++moving;
  }
  if (blocks_.empty()) return;
  if (way >= 0) {
    const double drop = blocks_[farthest].start.z() - blocks_[farthest].end.z();
    lines.push_back(fmt::format("{} went {}{} in plan, {} {}, at up to {:.3g} m/s.",
                                header_.blocks[farthest].name, blocks_.size() > 1 ? "farthest: " : "",
                                length(run), length(std::abs(drop)), drop < 0 ? "up" : "down",
                                blocks_[farthest].max_speed));
  }
  std::size_t left = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) left += blocks_[i].left || started_beside(i) ? 1 : 0;
  if (left == blocks_.size()) return;
  if (moving == 0 && time_ < shortest) return lines.push_back("The run is too short to tell what rests.");
  // What rocks or creeps so slowly goes nowhere, but it is not at rest either.
  double fastest = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    if (!header_.blocks[i].fixed && !blocks_[i].left && !started_beside(i))
      fastest = std::max(fastest, blocks_[i].velocity.norm());
  const bool creeps = moving == 0 && fastest > still;
  const bool one = blocks_.size() == 1;
  if (moving > 0)
    lines.push_back(
        one ? "It still moves at the end."
            : fmt::format("{} of {} blocks still move at the end.", moving, blocks_.size() - left));
  else if (creeps)
    lines.push_back(one ? fmt::format("It moves at no more than {:.2g} mm/s at the end.", 1e3 * fastest)
                        : fmt::format("No {}block moves faster than {:.2g} mm/s at the end.",
                                      left > 0 ? "other " : "", 1e3 * fastest));
  else
    lines.push_back(one ? "It is at rest at the end."
                        : fmt::format("All {}blocks are at rest at the end.", left > 0 ? "other " : ""));
}

bool SummaryBuilder::struck(std::size_t i) const {
  return std::any_of(impacts_.begin(), impacts_.end(),
                     [&](const Impact& m) { return m.block == static_cast<int>(i); });
}

/// It was over no ground all the time, struck nothing, and did not stay where it was.
bool SummaryBuilder::started_beside(std::size_t i) const {
  return i < ground_of_.size() && ground_of_[i].beside && (blocks_[i].left || moves(i)) &&
         !header_.blocks[i].fragment && !struck(i);
}

void SummaryBuilder::left_line(std::vector<std::string>& lines) const {
  constexpr std::size_t shown = 5;
  const auto names = [&](auto&& meant) {
    std::pair<std::size_t, std::string> found;
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      if (meant(i) && ++found.first <= shown)
        found.second += (found.first == 1 ? "" : ", ") + header_.blocks[i].name;
    if (found.first > shown) found.second += ", ...";
    return found;
  };
  if (const auto [count, list] = names([&](std::size_t i) { return blocks_[i].left && !started_beside(i); });
      count > 0)
    lines.push_back(fmt::format(
        "{} of {} blocks left the model over the edge of the terrain ({}): figures count each until then.",
        count, blocks_.size(), list));
  if (const auto [count, list] = names([&](std::size_t i) { return started_beside(i); }); count > 0)
    lines.push_back(
        fmt::format("{} of {} blocks started beside the terrain, with no ground below, and fell ({}): the "
                    "run tells nothing of {}.",
                    count, blocks_.size(), list, count == 1 ? "it" : "them"));
}

}  // namespace talus::io

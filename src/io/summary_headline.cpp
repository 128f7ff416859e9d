// The sentences that a summary begins with: what was struck and how bad, what came off, where blocks went.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/structures/structure.hpp"
#include "io/summary.hpp"
#include "io/summary_words.hpp"

namespace talus::io {

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
  const Impact *first = first_strike(i), *hardest = hardest_strike(i);
  const Impact* worst = nullptr;
  int count = 0;
  double impulses = 0;  // of one blow each: those from opposite sides do not cancel
  for (const Impact& m : impacts_) {
    if (m.structure != static_cast<int>(i)) continue;
    impulses += m.impulse.norm();
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
        "{} struck {} at {:.4g} s with {} and {} ({} of translation, {} of rotation); {} {} in all{}.",
        name_of(*hardest), struck_name(info, hardest->point), hardest->start,
        speed_text(hardest->velocity.norm()), engineering(hardest->kinetic, "J"),
        engineering(hardest->kinetic - hardest->rotational, "J"), engineering(hardest->rotational, "J"),
        count, count == 1 ? "impact" : "impacts",
        hardest == first ? ""
                         : fmt::format(", this one with the most energy, the first by {} at {:.4g} s",
                                       name_of(*first), first->start)));
    member_lines(i, lines);
    lines.push_back(
        fmt::format("Greatest contact force {} ({}, mean over {:.1f} ms; {} in a single sub-step, which "
                    "depends on cells and contact law). Impulse of all contacts {}.",
                    engineering(worst->filtered_force, "N"), name_of(*worst), 1e3 * load_window,
                    engineering(worst->peak_force, "N"), engineering(impulses, "N s")));
  } else if (info.loaded) {
    const auto most =
        std::max_element(s.probes.begin(), s.probes.end(),
                         [](const ProbeTrack& a, const ProbeTrack& b) { return a.peak < b.peak; });
    const std::string reaction = s.loads.force.value > 0
                                     ? fmt::format("{} added to the base reaction at most, at {:.3f} s",
                                                   engineering(s.loads.force.value, "N"), s.loads.force.time)
                                     : "no support took any of it";
    lines.push_back(fmt::format(
        "{} under its prescribed load: {}{}.", info.name, reaction,
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
  if (const coupling::Met* meeting = met(i)) {
    lines.push_back(fmt::format("No block struck {}; it met {} at {:.4g} s, impulse of all contacts {}.",
                                info.name, others_met(i), meeting->first,
                                engineering(meeting->impulse.norm(), "N s")));
    return member_lines(i, lines);
  }
  lines.push_back(fmt::format("{} was not hit.", info.name));
  if (s.damage > 0) member_lines(i, lines);
}

/// What came off a structure, a whole span or splinters.
void SummaryBuilder::piece_line(std::size_t structure, std::vector<std::string>& lines) const {
  constexpr double least = 0.1;  // [m] less is no fall
  std::size_t count = 0, heaviest = 0;
  double mass = 0, crushed = 0, first = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!is_own(static_cast<int>(i), static_cast<int>(structure)) || !blocks_[i].born) continue;
    if (count++ == 0 || header_.blocks[i].mass > header_.blocks[heaviest].mass) heaviest = i;
    mass += header_.blocks[i].mass, crushed += header_.blocks[i].crushed;
    first = std::min(first, blocks_[i].birth);
  }
  if (count == 0) return;
  const auto tonnes = [](double kilograms) { return fmt::format("{:.3g} t", kilograms / 1e3); };
  const std::string& name = header_.structures[structure].name;
  std::string crushed_line;
  std::string text = count == 1
                         ? fmt::format("1 piece of {} came off {} at {:.3f} s", tonnes(mass), name, first)
                         : fmt::format("{} pieces of {} in all came off {}, the first at {:.3f} s", count,
                                       tonnes(mass), name, first);
  if (count > 1)
    text += fmt::format("; the heaviest, {} of {},", header_.blocks[heaviest].name,
                        tonnes(header_.blocks[heaviest].mass));
  else
    text += "; it";
  if (constexpr double shown = 5e-3; crushed > shown * mass)  // less rounds to nothing beside three digits
    crushed_line = fmt::format(
        " Of their mass {} is what crushed cells beside them left at common nodes, and the steel of bars, if "
        "any: they are denser by it than what they came off.",
        tonnes(crushed));
  const double fall = blocks_[heaviest].start.z() - blocks_[heaviest].end.z();
  lines.push_back(text +
                  (fall > least
                       ? " fell " + length(fall)
                       : fmt::format(" has moved {} so far",
                                     length((blocks_[heaviest].end - blocks_[heaviest].start).norm()))) +
                  "." + crushed_line);
}

void SummaryBuilder::member_lines(std::size_t i, std::vector<std::string>& lines) const {
  constexpr std::size_t shown = 6;
  const sim::RunHeader::StructureInfo& info = header_.structures[i];
  std::vector<std::pair<const MemberTrack*, MemberTrack::Verdict>> members;
  for (const MemberTrack& m : structures_[i].members)
    if (m.has_verdict()) members.emplace_back(&m, m.verdict());
  if (members.empty() && elastic(i))
    lines.push_back(
        fmt::format("{} is elastic in this run: damage was not computed, there is no damage class. "
                    "damage = \"concrete\" in [[structure]] computes it.",
                    info.name));
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
    lines.push_back(fmt::format(
        "{}: V_dyn/V_Rd = {:.2f} at most (shear against its design resistance, EN 1992-1-1 6.2). "
        "It is elastic in this run: damage was not computed (damage = \"concrete\" in [[structure]] does).",
        whole(*most->first), most->second.use_design));
    return;
  }
  const auto& [worst, verdict] = members.front();
  lines.push_back(
      fmt::format("{}: damage class {} of 4, {} ({}). Shear V_dyn/V_Rd = {:.2f} at most (design resistance, "
                  "EN 1992-1-1 6.2).{}",
                  whole(*worst), verdict.grade, verdict.grade == 0 ? "no damage" : verdict.name,
                  verdict.basis, verdict.use_design,
                  verdict.least == verdict.most
                      ? ""
                      : fmt::format(" Near a limit: class {} to {} with other time steps or cells.",
                                    verdict.least, verdict.most)));
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
      const MemberTrack::Function f = m.function(structures_[i].members);
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
        fmt::format("Deck of {}: {}. Our own rule: closed from damage class 3, its own or that of a pier "
                    "below it, joints moved by 50 mm or "
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
  constexpr double level = 1e-6;     // of the way: a drop that is none
  constexpr double touching = 1e-9;  // of a block's size: as deep an overlap is none, so far a move is none
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
  if (way >= 0 && way <= touching * std::cbrt(header_.blocks[farthest].volume)) {
    lines.emplace_back("No block moved.");
  } else if (way >= 0) {
    double drop = blocks_[farthest].start.z() - blocks_[farthest].end.z();
    if (std::abs(drop) < level * way) drop = 0;
    lines.push_back(fmt::format("{} went {}{} in plan, {} {}, at up to {:.3g} m/s.",
                                header_.blocks[farthest].name, blocks_.size() > 1 ? "farthest: " : "",
                                length(run), length(std::abs(drop)), drop < 0 ? "up" : "down",
                                blocks_[farthest].peaks.speed));
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

// Piers, columns and spans of decks as members: section forces, drift, cracks and bars.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr int stations = 9;  // from base to top

Vec3 mean_displacement(const std::vector<int>& nodes, const AlignedVector& u) {
  Vec3 sum = Vec3::Zero();
  for (int n : nodes) sum += Vec3(u[4 * n], u[4 * n + 1], u[4 * n + 2]);
  return nodes.empty() ? sum : Vec3(sum / static_cast<double>(nodes.size()));
}
}  // namespace

void FemStructure::set_members() {
  if (supports_.nodes.empty()) return;
  std::vector<Pier> all = find_piers(spec_);
  for (Pier& span : find_spans(spec_)) all.push_back(std::move(span));
  int deck = 0;
  for (const Pier& pier : all) {
    MemberPlace m{pier, place_of(pier, mesh_, stations), {}, {}, {}, pier.span ? deck : -1};
    if (pier.span) ++deck;
    if (m.place.cells.empty()) continue;
    for (const Cut& cut : m.place.cuts) m.cut_packs.push_back(operator_->pack_of(cut.cells));
    if (bars_) {
      m.segments = bars_->segments_in(m.place.cells);
      for (const Cut& cut : m.place.cuts) m.cut_segments.push_back(bars_->segments_in(cut.cells));
    }
    Member info;
    info.name = pier.name;
    info.span = pier.span;
    info.section = {pier.shape.width, pier.shape.section == rebar::Member::Section::round ? pier.shape.width : pier.shape.depth};
    info.base = pier.shape.base;
    info.axis_x = pier.shape.axis_x;
    info.axis_y = pier.shape.axis_y;
    info.length = pier.clear;
    for (const Cut& cut : m.place.cuts) info.stations.push_back(cut.at);
    for (int cell : m.place.cells) info.volume += cell_mass_[cell] / spec_.density;
    member_places_.push_back(std::move(m));
    members_.push_back(std::move(info));
  }
  const std::vector<MemberState> start = member_states();
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const double axial = start[k].axial.front(), rounding = 1e-9 * 9.81 * spec_.density * members_[k].volume;
    members_[k].axial_preload = std::abs(axial) > rounding ? axial : 0;
    if (!concrete_) continue;
    const std::vector<rebar::Bar> none;
    for (int axis = 0; axis < 2; ++axis) {
      const rebar::ShearInput in = shear_input(member_places_[k].pier, bars_ ? bars_->list() : none, members_[k].length / 2, axis, members_[k].axial_preload);
      members_[k].shear_design[axis] = rebar::shear_resistance(in, {concrete_->f_ck, 1.2, 1.0, 1.0}).governing;
      members_[k].shear_mean[axis] = rebar::shear_resistance(in, {concrete_->f_cm, 1.0, 1.0, 1.0}).governing;
    }
  }
}

std::vector<MemberState> FemStructure::member_states() const {
  if (member_states_.empty()) member_states_ = find_member_states(true);
  return member_states_;
}

/// Crack widths (`widths`; else 0) ask the law of every cracked cell once more.
std::vector<MemberState> FemStructure::find_member_states(bool widths) const {
  std::vector<MemberState> states;
  if (members_.empty()) return states;
  share_motion();
  share_bars();
  AlignedVector force(u_.size(), 0.0);
  for (std::size_t k = 0; k < members_.size(); ++k) states.push_back(member_state(k, force, widths));
  return states;
}

/// Feet: supported nodes that cells join, each with the pier that stands on it.
void FemStructure::find_feet() {
  std::vector<int> place(mesh_.nodes.size(), -1);
  for (std::size_t i = 0; i < supports_.nodes.size(); ++i) place[static_cast<std::size_t>(supports_.nodes[i])] = static_cast<int>(i);
  DisjointSets joined(static_cast<int>(supports_.nodes.size()));
  for (const auto& hex : mesh_.hexes) {
    int first = -1;
    for (const int n : hex)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0) first < 0 ? void(first = i) : void(joined.join(first, i));
  }
  std::vector<int> number(supports_.nodes.size(), -1), count;
  foot_of_.clear(), foot_centroid_.clear();
  for (std::size_t i = 0; i < supports_.nodes.size(); ++i) {
    int& foot = number[static_cast<std::size_t>(joined.root(static_cast<int>(i)))];
    if (foot < 0) foot = static_cast<int>(count.size()), count.push_back(0), foot_centroid_.push_back(Vec3::Zero());
    foot_of_.push_back(foot);
    ++count[static_cast<std::size_t>(foot)];
    foot_centroid_[static_cast<std::size_t>(foot)] += mesh_.nodes[static_cast<std::size_t>(supports_.nodes[i])];
  }
  for (std::size_t k = 0; k < count.size(); ++k) foot_centroid_[k] /= count[k];
  std::vector<int> member(count.size(), -1);
  for (std::size_t m = 0; m < members_.size(); ++m)
    for (const int n : members_[m].span ? std::vector<int>{} : member_places_[m].place.foot)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0) member[static_cast<std::size_t>(foot_of_[static_cast<std::size_t>(i)])] = static_cast<int>(m);
  load_track_.name_feet(foot_centroid_, member);
}

/// What it carries now is what it carries for good.
void FemStructure::begin_loads() {
  if (supports_.nodes.empty()) return;
  forces(time_);
  find_feet();
  load_track_.begin(foot_reactions(0), members_, member_states());
  watch_stress(0);
}

void FemStructure::watch_loads(double t, double h) {
  if (!load_track_.begun()) return;
  load_track_.react(t, h, foot_reactions(h));
  if (load_track_.due(h) && load_track_.widths_due(t, h)) watch_stress(t);
  if (!load_track_.due(h)) load_track_.pass(h);
  else if (load_track_.widths_due(t, h)) load_track_.sample(t, h, members_, member_states());
  else load_track_.sample(t, h, members_, find_member_states(false));
}

/// `force` is zero on entry and on return.
MemberState FemStructure::member_state(std::size_t k, AlignedVector& force, bool widths) const {
  MemberPlace& m = member_places_[k];
  const Vec3 x = members_[k].axis_x, y = members_[k].axis_y, z = x.cross(y);
  MemberState state;
  for (std::size_t i = 0; i < m.place.cuts.size(); ++i) {
    const Cut& cut = m.place.cuts[i];
    ElementPack& pack = m.cut_packs[i];
    for (std::size_t lane = 0; lane < cut.cells.size(); ++lane) {
      const int cell = cut.cells[lane];
      const bool counts = live_[cell] && own_cell(cell), cracked = damage_ && damage_->has(cell);
      pack.scale[lane] = counts && !cracked ? 1 : 0;
      if (counts && cracked) damage_->add_force_of(cell, u_.data(), force.data());
    }
    operator_->add_internal_force_of(pack, u_.data(), force.data(), finite_);
    if (bars_ && first_rank()) bars_->add_forces_of(m.cut_segments[i], u_.data(), live_, force.data());
    const Vec3 centre = members_[k].base + cut.at * z + mean_displacement(cut.nodes, u_);
    Vec3 total = Vec3::Zero(), moment = Vec3::Zero();
    for (int n : cut.above) {
      const Vec3 f(force[4 * n], force[4 * n + 1], force[4 * n + 2]);
      total += f;
      moment += (position(n) - centre).cross(f);
    }
    sum({total.data(), 3});
    sum({moment.data(), 3});
    for (int n : cut.nodes) std::fill_n(&force[4 * static_cast<std::size_t>(n)], 4, 0.0);
    state.axial.push_back(-total.dot(z));
    state.shear.push_back({total.dot(x), total.dot(y)});
    state.moment.push_back({moment.dot(x), moment.dot(y)});
  }
  // Nodes that no cell holds any more stay where they were: they say nothing of a section.
  const auto gone = [&](const std::vector<int>& section) { return std::none_of(section.begin(), section.end(), [&](int n) { return cells_at_node_[n] > 0; }); };
  const std::vector<int>& middle = m.place.cuts[m.place.cuts.size() / 2].nodes;
  const Vec3 top = mean_displacement(m.place.top, u_), foot = mean_displacement(m.place.foot, u_);
  const Vec3 drift = m.pier.span ? Vec3(mean_displacement(middle, u_) - (top + foot) / 2) : Vec3(top - foot);
  state.drift = {drift.dot(x), drift.dot(y)};
  if (gone(m.place.top) || (m.pier.span && (gone(m.place.foot) || gone(middle)))) state.drift.fill(std::numeric_limits<double>::quiet_NaN());
  if (m.pier.span) state.ends_unseated = bearings_->ends_unseated(m.deck), state.end_shift = std::max(top.norm(), foot.norm());
  for (int cell : m.place.cells) {
    if (!live_[cell]) state.lost_volume += cell_mass_[cell] / spec_.density;
    else if (widths && damage_ && own_cell(cell)) state.crack_width = std::max(state.crack_width, damage_->crack_width(cell, u_.data()));
  }
  if (widths) state.crack_width = largest(state.crack_width);
  if (bars_) {
    const Bars::Counts bars = bars_->count(m.segments);
    state.bars_yielded = bars.yielded;
    state.bars_broken = bars.broken;
  }
  return state;
}

std::vector<BarLine> FemStructure::bars() const {
  std::vector<BarLine> lines;
  if (bars_)
    for (const rebar::Bar& bar : bars_->list()) lines.push_back({bar.points.front(), bar.points.back(), bar.diameter});
  return lines;
}

}  // namespace talus::fem

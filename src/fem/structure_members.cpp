// Piers and columns as members: section forces, drift, cracks and bars.
#include <algorithm>
#include <cmath>
#include <limits>

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
  for (const Pier& pier : find_piers(spec_)) {
    MemberPlace m{pier, place_of(pier, mesh_, stations), {}, {}, {}};
    if (m.place.cells.empty()) continue;
    for (const Cut& cut : m.place.cuts) m.cut_packs.push_back(operator_->pack_of(cut.cells));
    if (bars_) {
      m.segments = bars_->segments_in(m.place.cells);
      for (const Cut& cut : m.place.cuts) m.cut_segments.push_back(bars_->segments_in(cut.cells));
    }
    Member info;
    info.name = pier.name;
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

/// What it carries now is what it carries for good.
void FemStructure::begin_loads() {
  if (supports_.nodes.empty()) return;
  forces(time_);
  load_track_.begin(support_reaction(0), members_, member_states());
}

void FemStructure::watch_loads(double t, double h) {
  if (!load_track_.begun()) return;
  load_track_.react(t, h, support_reaction(h));
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
  const Vec3 drift = mean_displacement(m.place.top, u_) - mean_displacement(m.place.foot, u_);
  state.drift = {drift.dot(x), drift.dot(y)};
  // Nodes that no cell holds any more stay where they were: they tell of no top.
  if (std::none_of(m.place.top.begin(), m.place.top.end(), [&](int n) { return cells_at_node_[n] > 0; })) state.drift.fill(std::numeric_limits<double>::quiet_NaN());
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

// Piers, columns and spans of decks as members: section forces, drift, cracks and bars.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr int stations = 9;  // from base to top

/// Of sums as by sums_over().
Vec3 mean_displacement(const double* sums) {
  return sums[3] > 0 ? Vec3(Vec3(sums) / sums[3]) : Vec3(Vec3::Zero());
}
bool gone(const double* sums) { return sums[4] == 0; }  // no cell holds any of them

}  // namespace

void FemStructure::find_places(const HexMesh& whole) {
  if (supports_.none) return;
  std::vector<Pier> all = find_piers(spec_);
  for (Pier& span : find_spans(spec_)) all.push_back(std::move(span));
  int deck = 0;
  for (const Pier& pier : all) {
    MemberPlace m{pier, place_of(pier, whole, stations), {}, {}, {}, pier.span ? deck : -1};
    if (pier.span) ++deck;
    if (m.place.cells.empty()) continue;
    Member info;
    info.name = pier.name;
    info.span = pier.span;
    info.section = {pier.shape.width, pier.shape.section == rebar::Member::Section::round ? pier.shape.width
                                                                                          : pier.shape.depth};
    info.base = pier.shape.base;
    info.axis_x = pier.shape.axis_x;
    info.axis_y = pier.shape.axis_y;
    info.length = pier.clear;
    for (const Cut& cut : m.place.cuts) info.stations.push_back(cut.at);
    member_places_.push_back(std::move(m));
    members_.push_back(std::move(info));
  }
}

void FemStructure::set_members() {
  if (supports_.none) return;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    MemberPlace& m = member_places_[k];
    for (Cut& cut : m.place.cuts) {
      if (divided()) std::erase_if(cut.cells, [this](int cell) { return !own_cell(cell); });
      m.cut_packs.push_back(operator_->pack_of(cut.cells));
    }
    for (int cell : m.place.cells)
      members_[k].volume += own_cell(cell) ? cell_mass_[cell] / spec_.density : 0.0;
    sum({&members_[k].volume, 1});
  }
  find_segments();
  const std::vector<MemberState> start = member_states();
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const double axial = start[k].axial.front(), rounding = 1e-9 * 9.81 * spec_.density * members_[k].volume;
    members_[k].axial_preload = std::abs(axial) > rounding ? axial : 0;
    if (!concrete_) continue;
    const std::vector<rebar::Bar> none;
    for (int axis = 0; axis < 2; ++axis) {
      const rebar::ShearInput in = shear_input(member_places_[k].pier, bars_ ? bars_->list() : none,
                                               members_[k].length / 2, axis, members_[k].axial_preload);
      members_[k].shear_design[axis] =
          rebar::shear_resistance(in, {concrete_->f_ck, 1.2, 1.0, 1.0}).governing;
      members_[k].shear_mean[axis] = rebar::shear_resistance(in, {concrete_->f_cm, 1.0, 1.0, 1.0}).governing;
    }
  }
}

void FemStructure::find_segments() {
  for (MemberPlace& m : member_places_) {
    if (!bars_) return;
    m.segments = bars_->segments_in(m.place.cells);
    m.cut_segments.clear();
    for (const Cut& cut : m.place.cuts) m.cut_segments.push_back(bars_->segments_in(cut.cells));
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
  AlignedVector force(u_.size(), 0.0);
  for (std::size_t k = 0; k < members_.size(); ++k) states.push_back(member_state(k, force, widths));
  return states;
}

/// Feet: supported nodes that cells join, each with the pier that stands on it.
void FemStructure::find_feet(const HexMesh& whole) {
  std::vector<int> place(whole.nodes.size(), -1);
  for (std::size_t i = 0; i < supports_.nodes.size(); ++i)
    place[static_cast<std::size_t>(supports_.nodes[i])] = static_cast<int>(i);
  DisjointSets joined(static_cast<int>(supports_.nodes.size()));
  for (const auto& hex : whole.hexes) {
    int first = -1;
    for (const int n : hex)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0)
        first < 0 ? void(first = i) : void(joined.join(first, i));
  }
  std::vector<int> number(supports_.nodes.size(), -1), count;
  foot_of_.clear(), foot_centroid_.clear();
  for (std::size_t i = 0; i < supports_.nodes.size(); ++i) {
    int& foot = number[static_cast<std::size_t>(joined.root(static_cast<int>(i)))];
    if (foot < 0)
      foot = static_cast<int>(count.size()), count.push_back(0), foot_centroid_.push_back(Vec3::Zero());
    foot_of_.push_back(foot);
    ++count[static_cast<std::size_t>(foot)];
    foot_centroid_[static_cast<std::size_t>(foot)] +=
        whole.nodes[static_cast<std::size_t>(supports_.nodes[i])];
  }
  for (std::size_t k = 0; k < count.size(); ++k) foot_centroid_[k] /= count[k];
  std::vector<int> member(count.size(), -1);
  for (std::size_t m = 0; m < members_.size(); ++m)
    for (const int n : members_[m].span ? std::vector<int>{} : member_places_[m].place.foot)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0)
        member[static_cast<std::size_t>(foot_of_[static_cast<std::size_t>(i)])] = static_cast<int>(m);
  load_track_.name_feet(foot_centroid_, member);
}

/// What it carries now is what it carries for good.
void FemStructure::begin_loads() {
  if (supports_.none) return;
  forces(time_);
  if (!divided()) find_feet(mesh_);
  load_track_.begin(foot_reactions(0), members_, member_states());
  watch_stress(0);
}

void FemStructure::watch_loads(double t, double h) {
  if (!load_track_.begun()) return;
  load_track_.react(t, h, foot_reactions(h));
  if (load_track_.due(h) && load_track_.widths_due(t, h)) watch_stress(t);
  if (!load_track_.due(h))
    load_track_.pass(h);
  else if (load_track_.widths_due(t, h))
    load_track_.sample(t, h, members_, member_states());
  else
    load_track_.sample(t, h, members_, find_member_states(false));
}

/// Of each list of nodes, over all ranks: displacements, how many nodes, and how many of them cells still
/// hold.
std::vector<double> FemStructure::sums_over(const std::vector<const std::vector<int>*>& lists) const {
  std::vector<double> sums;
  for (const std::vector<int>* nodes : lists) {
    double of[5] = {};
    for (const int n : *nodes) {
      if (!own_node(n)) continue;
      for (std::size_t c = 0; c < 3; ++c) of[c] += u_[4 * static_cast<std::size_t>(n) + c];
      of[3] += 1, of[4] += cells_at_node_[n] > 0;
    }
    sums.insert(sums.end(), of, of + 5);
  }
  sum(sums);
  return sums;
}

/// `force` is zero on entry and on return.
MemberState FemStructure::member_state(std::size_t k, AlignedVector& force, bool widths) const {
  MemberPlace& m = member_places_[k];
  const Vec3 x = members_[k].axis_x, y = members_[k].axis_y, z = x.cross(y);
  const std::size_t cuts = m.place.cuts.size();
  std::vector<const std::vector<int>*> lists{&m.place.top, &m.place.foot};
  for (const Cut& cut : m.place.cuts) lists.push_back(&cut.nodes);
  const std::vector<double> nodes = sums_over(lists);
  std::vector<double> totals(6 * cuts);
  for (std::size_t i = 0; i < cuts; ++i) {
    const Cut& cut = m.place.cuts[i];
    ElementPack& pack = m.cut_packs[i];
    for (std::size_t lane = 0; lane < cut.cells.size(); ++lane) {
      const int cell = cut.cells[lane];
      const bool counts = live_[cell] && own_cell(cell), cracked = damage_ && damage_->has(cell);
      pack.scale[lane] = counts && !cracked ? 1 : 0;
      if (counts && cracked) damage_->add_force_of(cell, u_.data(), force.data());
    }
    operator_->add_internal_force_of(pack, u_.data(), force.data(), finite_);
    if (bars_) {
      std::vector<int> own;
      std::copy_if(m.cut_segments[i].begin(), m.cut_segments[i].end(), std::back_inserter(own),
                   [this](int segment) { return own_cell(bars_->host(static_cast<std::size_t>(segment))); });
      bars_->add_forces_of(own, u_.data(), live_, force.data());
    }
    const Vec3 centre = members_[k].base + cut.at * z + mean_displacement(&nodes[5 * (2 + i)]);
    Eigen::Map<Vec3> total(&totals[6 * i]), moment(&totals[6 * i + 3]);
    total.setZero(), moment.setZero();
    for (int n : cut.above) {
      const Vec3 f(force[4 * n], force[4 * n + 1], force[4 * n + 2]);
      total += f;
      moment += (position(n) - centre).cross(f);
    }
    for (int n : cut.nodes) std::fill_n(&force[4 * static_cast<std::size_t>(n)], 4, 0.0);
  }
  sum(totals);
  MemberState state;
  for (std::size_t i = 0; i < cuts; ++i) {
    const Vec3 total(&totals[6 * i]), moment(&totals[6 * i + 3]);
    state.axial.push_back(-total.dot(z));
    state.shear.push_back({total.dot(x), total.dot(y)});
    state.moment.push_back({moment.dot(x), moment.dot(y)});
  }
  // Nodes that no cell holds any more stay where they were: they say nothing of a section.
  const double *const at_top = &nodes[0], *const at_foot = &nodes[5],
                      *const at_middle = &nodes[5 * (2 + cuts / 2)];
  const Vec3 top = mean_displacement(at_top), foot = mean_displacement(at_foot);
  const Vec3 drift = m.pier.span ? Vec3(mean_displacement(at_middle) - (top + foot) / 2) : Vec3(top - foot);
  state.drift = {drift.dot(x), drift.dot(y)};
  if (gone(at_top) || (m.pier.span && (gone(at_foot) || gone(at_middle))))
    state.drift.fill(std::numeric_limits<double>::quiet_NaN());
  if (m.pier.span)
    state.ends_unseated = bearings_->ends_unseated(m.deck),
    state.end_shift = std::max(top.norm(), foot.norm());
  for (int cell : m.place.cells) {
    if (!own_cell(cell)) continue;
    if (!live_[cell])
      state.lost_volume += cell_mass_[cell] / spec_.density;
    else if (widths && damage_)
      state.crack_width = std::max(state.crack_width, damage_->crack_width(cell, u_.data()));
  }
  sum({&state.lost_volume, 1});
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
    for (const rebar::Bar& bar : bars_->list())
      lines.push_back({bar.points.front(), bar.points.back(), bar.diameter});
  return lines;
}

}  // namespace talus::fem

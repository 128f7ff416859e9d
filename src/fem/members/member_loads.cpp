// Piers, columns and spans of decks as members: section forces, drift, cracks and bars.
#include "fem/members/member_loads.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.hpp"
#include "core/sort_unique.hpp"

namespace talus::fem {

namespace {
constexpr int stations = 9;  // from base to top

/// Of sums as by sums_over().
Vec3 mean_displacement(const double* sums) {
  return sums[3] > 0 ? Vec3(Vec3(sums) / sums[3]) : Vec3(Vec3::Zero());
}
bool gone(const double* sums) { return sums[4] == 0; }  // no cell holds any of them

/// What the structure presses on its support at a held degree of freedom.
Vec3 on_support(const AlignedVector& external, const AlignedVector& internal, const AlignedVector& impulse,
                double step, int node, const std::array<bool, 3>& held) {
  Vec3 f = Vec3::Zero();
  for (int c = 0; c < 3; ++c)
    if (held[c]) {
      const std::size_t i = 4 * static_cast<std::size_t>(node) + c;
      f[c] = external[i] - internal[i] + (step > 0 ? impulse[i] / step : 0.0);
    }
  return f;
}

}  // namespace

void MemberLoads::find_places(const HexMesh& whole) {
  if (body_.supports.none) return;
  std::vector<Pier> all = find_piers(body_.spec);
  for (Pier& span : find_spans(body_.spec)) all.push_back(std::move(span));
  int deck = 0;
  for (const Pier& pier : all) {
    Place m{pier, place_of(pier, whole, stations), {}, {}, {}, pier.span ? deck : -1};
    if (pier.span) ++deck;
    if (m.place.cells.empty()) continue;
    Member info;
    info.name = pier.name;
    info.span = pier.span;
    for (std::size_t k = 0; pier.span && k < places_.size(); ++k)
      if (const Pier& below = places_[k].pier;
          !below.span && (below.support == pier.support || below.support == pier.support + 1))
        info.carried_by.push_back(static_cast<int>(k));
    info.section = {pier.shape.width, pier.shape.section == rebar::Member::Section::round ? pier.shape.width
                                                                                          : pier.shape.depth};
    info.base = pier.shape.base;
    info.axis_x = pier.shape.axis_x;
    info.axis_y = pier.shape.axis_y;
    info.length = pier.clear;
    for (const Cut& cut : m.place.cuts) info.stations.push_back(cut.at);
    places_.push_back(std::move(m));
    members_.push_back(std::move(info));
  }
}

void MemberLoads::complete() {
  if (body_.supports.none) return;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    Place& m = places_[k];
    for (const Cut& cut : m.place.cuts)
      for (const Layer& layer : cut.layers) m.layer_packs.push_back(body_.elements->pack_of(layer.cells));
    for (int cell : m.place.cells)
      members_[k].volume += body_.own_cell(cell) ? body_.cell_mass[cell] / body_.spec.density : 0.0;
    body_.sum({&members_[k].volume, 1});
  }
  find_segments();
  const std::vector<MemberState> start = states();
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const double axial = start[k].axial.front(),
                 rounding = 1e-9 * 9.81 * body_.spec.density * members_[k].volume;
    members_[k].axial_preload = std::abs(axial) > rounding ? axial : 0;
    if (!body_.concrete) continue;
    const std::vector<rebar::Bar> none;
    for (int axis = 0; axis < 2; ++axis) {
      const rebar::ShearInput in =
          shear_input(places_[k].pier, body_.bars ? body_.bars->embedded().bars() : none,
                      members_[k].length / 2, axis, members_[k].axial_preload);
      members_[k].shear_design[axis] =
          rebar::shear_resistance(in, {body_.concrete->f_ck, 1.2, 1.0, 1.0}).governing;
      members_[k].shear_mean[axis] =
          rebar::shear_resistance(in, {body_.concrete->f_cm, 1.0, 1.0, 1.0}).governing;
    }
  }
}

void MemberLoads::find_segments() {
  for (Place& m : places_) {
    if (!body_.bars) return;
    m.segments = body_.bars->embedded().segments_in(m.place.cells);
    m.layer_segments.clear();
    for (const Cut& cut : m.place.cuts)
      for (const Layer& layer : cut.layers)
        m.layer_segments.push_back(body_.bars->embedded().segments_in(layer.cells));
  }
}

const std::vector<MemberState>& MemberLoads::states() const {
  if (states_of_ != fields_.revision) {
    states_ = find_states(true);
    states_of_ = fields_.revision;
  }
  return states_;
}

/// Crack widths (`widths`; else 0) ask the law of every cracked cell once more.
std::vector<MemberState> MemberLoads::find_states(bool widths) const {
  std::vector<MemberState> found;
  if (members_.empty()) return found;
  AlignedVector force(fields_.u.size(), 0.0);
  for (std::size_t k = 0; k < members_.size(); ++k) found.push_back(state(k, force, widths));
  return found;
}

/// Feet: supported nodes that cells join, each with the pier that stands on it.
void MemberLoads::find_feet(const HexMesh& whole) {
  std::vector<int> place(whole.nodes.size(), -1);
  for (std::size_t i = 0; i < body_.supports.nodes.size(); ++i)
    place[static_cast<std::size_t>(body_.supports.nodes[i])] = static_cast<int>(i);
  DisjointSets joined(static_cast<int>(body_.supports.nodes.size()));
  for (const auto& hex : whole.hexes) {
    int first = -1;
    for (const int n : hex)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0)
        first < 0 ? void(first = i) : void(joined.join(first, i));
  }
  std::vector<int> number(body_.supports.nodes.size(), -1), count;
  foot_of_.clear(), foot_centroid_.clear();
  for (std::size_t i = 0; i < body_.supports.nodes.size(); ++i) {
    int& foot = number[static_cast<std::size_t>(joined.root(static_cast<int>(i)))];
    if (foot < 0)
      foot = static_cast<int>(count.size()), count.push_back(0), foot_centroid_.push_back(Vec3::Zero());
    foot_of_.push_back(foot);
    ++count[static_cast<std::size_t>(foot)];
    foot_centroid_[static_cast<std::size_t>(foot)] +=
        whole.nodes[static_cast<std::size_t>(body_.supports.nodes[i])];
  }
  for (std::size_t k = 0; k < count.size(); ++k) foot_centroid_[k] /= count[k];
  std::vector<int> member(count.size(), -1);
  for (std::size_t m = 0; m < members_.size(); ++m)
    for (const int n : members_[m].span ? std::vector<int>{} : places_[m].place.foot)
      if (const int i = place[static_cast<std::size_t>(n)]; i >= 0)
        member[static_cast<std::size_t>(foot_of_[static_cast<std::size_t>(i)])] = static_cast<int>(m);
  track_.name_feet(foot_centroid_, member);
}

std::vector<double> MemberLoads::foot_reactions(double step) const {
  std::vector<double> all(6 + 3 * foot_centroid_.size(), 0.0);
  for (std::size_t i = 0; i < body_.supports.nodes.size(); ++i) {
    const int n = body_.supports.nodes[i];
    if (!body_.own_node(n)) continue;
    const auto foot = static_cast<std::size_t>(foot_of_[i]);
    const Vec3 f =
        on_support(fields_.f_ext, fields_.f_int, fields_.contact_impulse, step, n, body_.supports.held[n]);
    const Vec3 total = (fields_.position(n) - body_.supports.centroid).cross(f),
               own = (fields_.position(n) - foot_centroid_[foot]).cross(f);
    for (int c = 0; c < 3; ++c)
      all[static_cast<std::size_t>(c)] += f[c], all[static_cast<std::size_t>(3 + c)] += total[c],
          all[6 + 3 * foot + static_cast<std::size_t>(c)] += own[c];
  }
  body_.sum(all);
  return all;
}

void MemberLoads::take_part(const std::vector<int>& supported) {
  const Partition& part = *body_.partition;
  std::vector<int> feet;
  for (std::size_t i = 0; i < supported.size(); ++i)
    if (part.node_here(supported[i]) >= 0 && !foot_of_.empty()) feet.push_back(foot_of_[i]);
  foot_of_ = std::move(feet);
  for (Place& m : places_) {
    m.place.cells = part.cells_here(m.place.cells);
    for (std::vector<int>* nodes : {&m.place.foot, &m.place.top}) *nodes = part.nodes_here(*nodes);
    for (Cut& cut : m.place.cuts) {
      cut.nodes = part.nodes_here(cut.nodes);
      for (Layer& layer : cut.layers) {
        std::vector<double> held;
        for (std::size_t i = 0; i < layer.cells.size(); ++i)
          if (part.cell_here(layer.cells[i]) >= 0) held.push_back(layer.part[i]);
        layer.part = std::move(held);
        layer.cells = part.cells_here(layer.cells);
        for (std::vector<int>* nodes : {&layer.nodes, &layer.above})
          *nodes = part.nodes_here(*nodes), sort_unique(*nodes);
      }
    }
  }
}

void MemberLoads::watch_stress(double t) {
  if (body_.damage || !body_.concrete) return;
  const auto [tension, compression] = stresses_.peaks(t);
  track_.strain(tension, compression);
}

/// What it carries now is what it carries for good.
void MemberLoads::begin() {
  if (body_.supports.none) track_.clear();
  if (body_.supports.none) return watch_probes(0);
  forces_.evaluate(fields_.time);
  if (!body_.divided()) find_feet(body_.mesh);
  track_.begin(foot_reactions(0), members_, states());
  watch_stress(0);
  watch_probes(0);
}

void MemberLoads::begin_again() {
  if (body_.supports.none) return begin();
  forces_.evaluate(fields_.time);
  track_.begin_again(foot_reactions(0), members_, states());
  watch_stress(0);
  watch_probes(0);
}

/// Each corner's displacement comes from the one rank that owns it.
std::vector<Vec3> MemberLoads::displaced_probes() const {
  std::vector<double> corners;
  for (const ProbePoint& p : probes_)
    for (const int whole : p.node) {
      const int n = body_.node_here(whole);
      for (int c = 0; c < 3; ++c)
        corners.push_back(n >= 0 && body_.own_node(n) ? fields_.u[4 * static_cast<std::size_t>(n) + c] : 0.0);
    }
  body_.sum(corners);
  std::vector<Vec3> displaced;
  const double* corner = corners.data();
  for (const ProbePoint& p : probes_) {
    Vec3& u = displaced.emplace_back(Vec3::Zero());
    for (const double weight : p.weight) u += weight * Vec3(corner), corner += 3;
  }
  return displaced;
}

void MemberLoads::watch_probes(double t) {
  if (probes_.empty()) return;
  const std::vector<Vec3> displaced = displaced_probes();
  for (std::size_t k = 0; k < displaced.size(); ++k) track_.displace(t, k, displaced[k]);
}

long MemberLoads::forces_carried() const {
  std::size_t stations = 0;
  for (const Member& m : members_) stations += m.stations.size();
  return static_cast<long>(6 + 3 * foot_centroid_.size() + 5 * stations);
}

VecX MemberLoads::carried() const {
  std::vector<double> all = foot_reactions(0);
  const std::vector<MemberState> members = find_states(false);
  const std::vector<double> sections = section_forces(members);
  all.insert(all.end(), sections.begin(), sections.end());
  for (const MemberState& m : members) all.insert(all.end(), m.drift.begin(), m.drift.end());
  for (const Vec3& u : displaced_probes()) all.insert(all.end(), u.begin(), u.end());
  return Eigen::Map<const VecX>(all.data(), static_cast<long>(all.size()));
}

void MemberLoads::carry(double t, double duration, Eigen::Ref<const VecX> mean) {
  const std::size_t reactions = 6 + 3 * foot_centroid_.size(), all = static_cast<std::size_t>(mean.size());
  track_.react(t, duration, {mean.data(), reactions});
  track_.bear(t, duration, members_, {mean.data() + reactions, all - reactions});
}

void MemberLoads::displace(double t, Eigen::Ref<const VecX> end) {
  const double* at = end.data();
  for (std::size_t k = 0; k < members_.size(); ++k, at += 2) track_.sway(k, {at[0], at[1]});
  for (std::size_t k = 0; k < probes_.size(); ++k, at += 3) track_.displace(t, k, Vec3(at));
}

void MemberLoads::watch(double t, double h) {
  if (!track_.begun()) return;
  track_.react(t, h, foot_reactions(h));
  if (track_.due(h) && track_.widths_due(t, h)) watch_stress(t);
  if (!track_.due(h))
    track_.pass(h);
  else if (track_.widths_due(t, h))
    track_.sample(t, h, members_, states());
  else
    track_.sample(t, h, members_, find_states(false));
}

/// Of each list of nodes, over all ranks: displacements, how many nodes, and how many of them cells still
/// hold.
std::vector<double> MemberLoads::sums_over(const std::vector<const std::vector<int>*>& lists) const {
  std::vector<double> sums;
  for (const std::vector<int>* nodes : lists) {
    double of[5] = {};
    for (const int n : *nodes) {
      if (!body_.own_node(n)) continue;
      for (std::size_t c = 0; c < 3; ++c) of[c] += fields_.u[4 * static_cast<std::size_t>(n) + c];
      of[3] += 1, of[4] += body_.cells_at_node[n] > 0;
    }
    sums.insert(sums.end(), of, of + 5);
  }
  body_.sum(sums);
  return sums;
}

/// `force` is zero on entry and on return.
Vec6 MemberLoads::handed_down(Place& m, std::size_t layer_of_all, const Layer& layer, const Vec3& centre,
                              AlignedVector& force) const {
  Vec6 total = Vec6::Zero();
  const auto add = [&](const Vec3& x, const Vec3& f) {
    total.head<3>() += f;
    total.tail<3>() += (x - centre).cross(f);
  };
  ElementPack& pack = m.layer_packs[layer_of_all];
  for (std::size_t lane = 0; lane < layer.cells.size(); ++lane) {
    const int cell = layer.cells[lane];
    const bool counts = body_.live[cell] && body_.own_cell(cell),
               cracked = body_.damage && body_.damage->has(cell);
    pack.scale[lane] = counts && !cracked ? 1 : 0;
    if (!counts) continue;
    if (cracked) body_.damage->add_force_of(cell, fields_.u.data(), force.data());
    // The weight of the part above in place of that of the nodes above.
    const Vec3 weight = body_.cell_mass[cell] * body_.gravity;
    Vec3 middle = Vec3::Zero();
    const Vec3 axis = m.pier.axis();
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const int n : body_.mesh.hexes[static_cast<std::size_t>(cell)]) {
      const Vec3 x = fields_.position(n);
      middle += x / 8;
      low = std::min(low, x.dot(axis)), high = std::max(high, x.dot(axis));
      if (std::binary_search(layer.above.begin(), layer.above.end(), n)) add(x, -weight / 8);
    }
    add(middle + 0.5 * (1 - layer.part[lane]) * (high - low) * axis, layer.part[lane] * weight);
  }
  body_.elements->add_internal_force_of(pack, fields_.u.data(), force.data(), body_.finite);
  if (body_.bars) {
    std::vector<int> own;
    std::copy_if(
        m.layer_segments[layer_of_all].begin(), m.layer_segments[layer_of_all].end(), std::back_inserter(own),
        [this](int segment) {
          return body_.own_cell(body_.bars->embedded().segments()[static_cast<std::size_t>(segment)].cell);
        });
    body_.bars->add_forces_of(own, fields_.u.data(), body_.live, force.data());
  }
  for (const int n : layer.above)
    add(fields_.position(n), Vec3(force[4 * n], force[4 * n + 1], force[4 * n + 2]));
  for (const int n : layer.nodes) std::fill_n(&force[4 * static_cast<std::size_t>(n)], 4, 0.0);
  return total;
}

/// `force` is zero on entry and on return.
MemberState MemberLoads::state(std::size_t k, AlignedVector& force, bool widths) const {
  Place& m = places_[k];
  const Vec3 x = members_[k].axis_x, y = members_[k].axis_y, z = x.cross(y);
  const std::size_t cuts = m.place.cuts.size();
  std::vector<const std::vector<int>*> lists{&m.place.top, &m.place.foot};
  for (const Cut& cut : m.place.cuts) lists.push_back(&cut.nodes);
  const std::vector<double> nodes = sums_over(lists);
  std::vector<double> totals(6 * cuts, 0.0);
  std::size_t layer_of_all = 0;
  for (std::size_t i = 0; i < cuts; ++i) {
    const Cut& cut = m.place.cuts[i];
    const Vec3 centre = members_[k].base + cut.at * z + mean_displacement(&nodes[5 * (2 + i)]);
    for (const Layer& layer : cut.layers)
      Eigen::Map<Vec6>(&totals[6 * i]) +=
          handed_down(m, layer_of_all++, layer, centre, force) / static_cast<double>(cut.layers.size());
  }
  body_.sum(totals);
  MemberState out;
  for (std::size_t i = 0; i < cuts; ++i) {
    const Vec3 total(&totals[6 * i]), moment(&totals[6 * i + 3]);
    out.axial.push_back(-total.dot(z));
    out.shear.push_back({total.dot(x), total.dot(y)});
    out.moment.push_back({moment.dot(x), moment.dot(y)});
  }
  // Nodes that no cell holds any more stay where they were: they say nothing of a section.
  const double *const at_top = &nodes[0], *const at_foot = &nodes[5],
                      *const at_middle = &nodes[5 * (2 + cuts / 2)];
  const Vec3 top = mean_displacement(at_top), foot = mean_displacement(at_foot);
  const Vec3 drift = m.pier.span ? Vec3(mean_displacement(at_middle) - (top + foot) / 2) : Vec3(top - foot);
  out.drift = {drift.dot(x), drift.dot(y)};
  if (gone(at_top) || (m.pier.span && (gone(at_foot) || gone(at_middle))))
    out.drift.fill(std::numeric_limits<double>::quiet_NaN());
  if (m.pier.span)
    out.ends_unseated = body_.bearings->ends_unseated(m.deck),
    out.end_shift = std::max(top.norm(), foot.norm());
  for (int cell : m.place.cells) {
    if (!body_.own_cell(cell)) continue;
    if (!body_.live[cell])
      out.lost_volume += body_.cell_mass[cell] / body_.spec.density;
    else if (widths && body_.damage)
      out.crack_width = std::max(out.crack_width, body_.damage->crack_width(cell, fields_.u.data()));
  }
  body_.sum({&out.lost_volume, 1});
  if (widths) out.crack_width = body_.largest(out.crack_width);
  if (body_.bars) {
    const Bars::Counts bars = body_.bars->count(m.segments);
    out.bars_yielded = bars.yielded;
    out.bars_broken = bars.broken;
  }
  return out;
}

std::size_t MemberLoads::memory_of_packs() const {
  std::size_t bytes = 0;
  for (const Place& m : places_)
    for (const ElementPack& pack : m.layer_packs) bytes += pack.memory_consumption();
  return bytes;
}

Vec6 MemberLoads::present_reaction() const {
  forces_.evaluate(fields_.time);
  return Vec6(foot_reactions(fields_.contact_step).data());
}

}  // namespace talus::fem

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.hpp"
#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {

/// Of these nodes those that a cell holds or that have mass.
std::vector<NodeRange> living(const std::vector<NodeRange>& nodes, const std::vector<int>& cells_at_node,
                              const std::vector<double>& mass) {
  std::vector<char> lives(mass.size(), 0);
  for (const auto& [first, last] : nodes)
    for (int n = first; n < last; ++n) lives[n] = cells_at_node[n] > 0 || mass[n] > 0;
  return ranges_of(lives);
}

}  // namespace

/// Of several ranks each finds the faces of its own nodes; all of them hold the whole skin, in numbers of the
/// whole mesh.
std::vector<SkinQuad> FemStructure::whole_skin() const {
  std::vector<SkinQuad> quads = skin(mesh_, live_);
  if (!partition_) return quads;
  std::vector<double> mine;
  for (const SkinQuad& q : quads) {
    if (!partition_->owns_face(q.node)) continue;
    mine.insert(mine.end(), {6.0 * partition_->whole_cell(q.cell) + q.face});
    for (const int n : q.node) mine.push_back(partition_->whole_node(n));
  }
  const std::vector<double> all = partition_->records(5, mine);
  quads.clear();
  for (std::size_t at = 0; at < all.size(); at += 5) {
    const int place = static_cast<int>(all[at]);
    SkinQuad& q = quads.emplace_back(SkinQuad{{}, place / 6, place % 6});
    for (std::size_t k = 0; k < 4; ++k) q.node[k] = static_cast<int>(all[at + 1 + k]);
  }
  return quads;
}

void FemStructure::rebuild_skin() {
  skin_ = whole_skin();
  std::vector<int> vertex(partition_ ? partition_->nodes_in_all() : mesh_.nodes.size(), -1);
  skin_node_.clear();
  for (const SkinQuad& quad : skin_)
    for (int n : quad.node)
      if (vertex[n] < 0) vertex[n] = 0;
  for (std::size_t n = 0; n < vertex.size(); ++n)
    if (vertex[n] == 0)
      vertex[n] = static_cast<int>(skin_node_.size()), skin_node_.push_back(static_cast<int>(n));
  TriangleSurface& s = surface_;
  const int nodes = static_cast<int>(skin_node_.size());
  s.vertices.assign(nodes + skin_.size(), Vec3::Zero());
  s.velocities.assign(nodes + skin_.size(), Vec3::Zero());
  s.nodes.assign(nodes + skin_.size(), {});
  s.triangles.clear();
  s.parent_face.clear();
  s.default_material = spec_.material;
  for (int i = 0; i < nodes; ++i) s.nodes[i] = followed_by_node(mesh_, skin_node_[i]);
  for (int q = 0; q < static_cast<int>(skin_.size()); ++q) {
    s.nodes[nodes + q] = followed_by_face(mesh_, skin_[q].node);
    for (int k = 0; k < 4; ++k) {
      s.triangles.push_back({vertex[skin_[q].node[k]], vertex[skin_[q].node[(k + 1) % 4]], nodes + q});
      s.parent_face.push_back(q);
    }
  }
  ++s.revision;
  surface_stale_ = true;
  if (partition_) watch();
  if (cells_at_node_.empty()) return;  // not built yet
  // What has no cell and no mass any more is passed over: of a broken viaduct nine nodes in ten.
  own_ = living(
      partition_ ? partition_->own_nodes() : std::vector<NodeRange>{{0, static_cast<int>(mass_.size())}},
      cells_at_node_, mass_);
  std::vector<char> touched(mesh_.nodes.size(), partition_ ? 0 : 1);
  if (partition_) {
    operator_->mark_nodes(touched);
    if (bars_) bars_->mark_nodes(touched);
    if (bearings_)
      for (int node : bearings_->nodes()) touched[node] = 1;
  }
  touched_ = living(ranges_of(touched), cells_at_node_, mass_);
  if (bars_) bars_->cells_changed();
  for (AlignedVector* f : {&f_int_, &f_visc_})
    std::fill(f->begin(), f->end(), 0.0);  // nobody clears them there from now on
}

const TriangleSurface& FemStructure::surface() const {
  if (surface_stale_) {
    // The nodes of the skin come first, then the middle of every face, four triangles around each
    // (rebuild_skin()).
    const std::size_t nodes = skin_node_.size();
    for (std::size_t i = 0; i < nodes; ++i)
      surface_.vertices[i] = node_position(skin_node_[i]),
      surface_.velocities[i] = node_velocity(skin_node_[i]);
    const auto middle = [&](std::vector<Vec3>& of, std::size_t q) {
      const auto corner = [&](std::size_t k) -> const Vec3& {
        return of[static_cast<std::size_t>(surface_.triangles[4 * q + k][0])];
      };
      of[nodes + q] = 0.25 * ((corner(0) + corner(1)) + (corner(2) + corner(3)));
    };
    for (std::size_t q = 0; q < skin_.size(); ++q) {
      const TriangleSurface::NodeWeights& w = surface_.nodes[nodes + q];
      if (w.count == 4 && std::all_of(w.weight.begin(), w.weight.end(), [](double x) { return x == 0.25; })) {
        middle(surface_.vertices, q), middle(surface_.velocities, q);
        continue;
      }
      // Corners hang: the middle moves as the nodes that contact presses on, or it would do other work.
      Vec3 &x = surface_.vertices[nodes + q], &v = surface_.velocities[nodes + q];
      x = v = Vec3::Zero();
      for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k)
        x += w.weight[k] * node_position(w.node[k]), v += w.weight[k] * node_velocity(w.node[k]);
    }
    surface_stale_ = false;
  }
  return surface_;
}

double FemStructure::node_mass(int node) const {
  const std::array<bool, 3> held = node_held(node);
  return held[0] && held[1] && held[2]
             ? std::numeric_limits<double>::infinity()
             : drag_ * (partition_ ? seen_.built[6 * seen_place(node) + 3] : mass_[node]);
}

Vec3 FemStructure::node_position(int node) const {
  return partition_ ? Vec3(Vec3(&seen_.built[6 * seen_place(node)]) + Vec3(seen(node))) : position(node);
}
Vec3 FemStructure::node_built(int node) const {
  return partition_ ? Vec3(&seen_.built[6 * seen_place(node)]) : mesh_.nodes[node];
}
Vec3 FemStructure::node_velocity(int node) const {
  return partition_ ? Vec3(seen(node) + 3) : velocity(node);
}
Vec3 FemStructure::predicted_velocity(int node) const {
  if (!partition_) return {v_hat_[4 * node], v_hat_[4 * node + 1], v_hat_[4 * node + 2]};
  share_prediction();
  return Vec3(&seen_.prediction[3 * seen_place(node)]);
}
std::array<bool, 3> FemStructure::node_held(int node) const {
  if (!partition_) return supports_.held[node];
  const auto bits = static_cast<int>(seen_.built[6 * seen_place(node) + 4]);
  return {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
}

StructureEnergy FemStructure::energy() const {
  double kinetic = 0, potential = 0, stored = 0;
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  for (const auto& [first, last] : own_)
    for (int i = first; i < last; ++i) {
      const Vec3 v = velocity(i);
      const Vec3 x = position(i) - 0.5 * h_last_ * v;  // at the half step, where the velocities live
      kinetic += 0.5 * mass_[i] * v.squaredNorm();
      potential -= mass_[i] * gravity_.dot(x);
      linear += mass_[i] * v;
      angular += mass_[i] * x.cross(v);
    }
  if (h_last_ == 0) {
    const_cast<FemStructure*>(this)->forces(time_);
    stored = stored_part_;
  }
  std::array<double, 9> all{kinetic,   potential,  stored,     linear[0], linear[1],
                            linear[2], angular[0], angular[1], angular[2]};
  sum(all);
  StructureEnergy e = books_;
  if (h_last_ == 0 && !laws_taken_) {  // what the laws took in a condensed step is accepted by the next one
    e.damage_work += damage_ ? damage_->dissipation() : 0.0;
    e.plastic_work += (bars_ ? bars_->dissipation() : 0.0) + (bearings_ ? bearings_->dissipation() : 0.0);
  }
  e.kinetic = all[0];
  e.gravity_potential = all[1] + dust_potential_;
  e.elastic = h_last_ == 0 ? all[2] : stored_half_;
  e.linear_momentum = Vec3(&all[3]) + dust_momentum_;
  e.angular_momentum = Vec3(&all[6]) + dust_spin_;
  return e;
}

namespace {
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

Vec6 FemStructure::support_reaction(double step) const {
  Vec6 total = Vec6::Zero();
  for (int n : supports_.nodes) {
    if (!own_node(n)) continue;
    const Vec3 f = on_support(f_ext_, f_int_, contact_impulse_, step, n, supports_.held[n]);
    total.head<3>() += f;
    total.tail<3>() += (position(n) - supports_.centroid).cross(f);
  }
  sum({total.data(), 6});
  return total;
}

std::vector<double> FemStructure::foot_reactions(double step) const {
  std::vector<double> all(6 + 3 * foot_centroid_.size(), 0.0);
  for (std::size_t i = 0; i < supports_.nodes.size(); ++i) {
    const int n = supports_.nodes[i];
    if (!own_node(n)) continue;
    const auto foot = static_cast<std::size_t>(foot_of_[i]);
    const Vec3 f = on_support(f_ext_, f_int_, contact_impulse_, step, n, supports_.held[n]);
    const Vec3 total = (position(n) - supports_.centroid).cross(f),
               own = (position(n) - foot_centroid_[foot]).cross(f);
    for (int c = 0; c < 3; ++c)
      all[static_cast<std::size_t>(c)] += f[c], all[static_cast<std::size_t>(3 + c)] += total[c],
          all[6 + 3 * foot + static_cast<std::size_t>(c)] += own[c];
  }
  sum(all);
  return all;
}

Vec3 FemStructure::base_force() const {
  const_cast<FemStructure*>(this)->forces(time_);
  return support_reaction(contact_step_).head<3>();
}

Vec3 FemStructure::base_moment() const {
  const_cast<FemStructure*>(this)->forces(time_);
  return support_reaction(contact_step_).tail<3>();
}

std::vector<Vec3> FemStructure::probe_displacements() const {
  std::vector<Vec3> result;
  for (const ProbePoint& p : probes_) {
    Vec3 u = Vec3::Zero();
    for (int a = 0; a < 8; ++a) {
      const double* const there = partition_ ? seen(p.node[a]) : &u_[4 * static_cast<std::size_t>(p.node[a])];
      for (int c = 0; c < 3; ++c) u[c] += p.weight[a] * there[c];
    }
    result.push_back(u);
  }
  return result;
}

double FemStructure::damage_max() const {
  return damage_ ? (eroded_volume_ > 0 ? 1.0 : largest(damage_->largest())) : 0;
}
double FemStructure::damaged_volume() const {
  double volume = 0;
  if (damage_)
    for (int cell : damage_->cells())
      if (own_cell(cell) && std::max(damage_->tension(cell), damage_->compression(cell)) > 0.5)
        volume += cell_mass_[cell] / spec_.density;
  sum({&volume, 1});
  return volume + eroded_volume_;
}
long FemStructure::elements() const {
  long count = 0;
  for (std::size_t cell = 0; cell < live_.size(); ++cell)
    count += live_[cell] && own_cell(static_cast<int>(cell));
  return count_of(count);
}

/// Steps longer than the explicit ones, and what of the choice of the integrator cannot be.
std::string FemStructure::plan_of_steps() const {
  if (spec_.integrator == "explicit" || partition_ || supports_.none || free_dofs_ > largest_factored_system)
    return fmt::format("{}: no condensed steps, each touch is explicit ({})\n", spec_.name,
                       spec_.integrator == "explicit" ? "integrator"
                       : partition_                   ? "several processes"
                       : supports_.none               ? "no support"
                                                      : "too large to factor");
  std::string text = fmt::format("{}: long implicit steps while blocks {} it and the structure is quiet{}\n",
                                 spec_.name, condensed_by_choice() ? "are at" : "rest on",
                                 bearings_ ? "; explicit sub-steps wherever bearings slide" : "");
  if (spec_.integrator == "modal" && !rings_in_modes())
    text += fmt::format("{}: integrator = \"modal\" finds no modes ({}): it goes on as with \"implicit\"\n",
                        spec_.name,
                        bearings_                ? "bearings"
                        : bars_                  ? "bars"
                        : spec_.damage != "none" ? "damage"
                                                 : "parts that turn");
  return text;
}

std::string FemStructure::plan() const {
  std::string text =
      fmt::format("{}: {} cells, {} free degrees of freedom, kernels {} ({} elements at a time)\n",
                  spec_.name, partition_ ? partition_->cells_in_all() : mesh_.hexes.size(), free_dofs_,
                  kernels().name, kernels().width);
  if (!mesh_.remark.empty())
    text += fmt::format(
        "{}: the mesh file holds {} elements beside its cells; they name groups and carry nothing\n",
        spec_.name, mesh_.remark);
  text += fmt::format("{}: explicit sub-step {:.3g} s; {}\n", spec_.name, critical_step_,
                      finite_ ? "total Lagrangian, any rotation" : "small strains and rotations");
  if (const double fine = impact_refinement(spec_).cell_size; fine > 0)
    text += fmt::format(
        "{}: cells are halved down to {:g} m where a block is about to strike, as long as nothing of it has "
        "cracked\n",
        spec_.name, fine);
  text += plan_of_steps();
  text += spec_.damage == "none" ? fmt::format("{}: elastic, no damage history kept\n", spec_.name) : "";
  if (damage_)
    text += fmt::format(
        "{}: concrete damage, f_cm {:.4g} MPa, f_t {:.4g} MPa, G_F {:.4g} N/m; only cells near the damage "
        "threshold store damage variables, bulk viscosity 0.06 / 1.2, erosion {}{}\n",
        spec_.name, concrete_->f_cm / 1e6, concrete_->f_t / 1e6, concrete_->fracture_energy,
        spec_.erosion ? "on" : "off",
        spec_.aggregate > 0
            ? fmt::format(", faces of cracks interlock (grains of {:.3g} mm)", 1e3 * spec_.aggregate)
            : "");
  text += bars_ ? fmt::format("{}: {} bars in {} segments, {:.4g} m^3 of steel, {}\n", spec_.name,
                              bars_->count(), bars_->segments_in_all(), bars_->steel_volume(),
                              bars_->slips() ? "bond slip by the Model Code" : "perfect bond")
                : fmt::format("{}: no reinforcement\n", spec_.name);
  if (bearings_)
    text += fmt::format("{}: viaduct, {} springs in bearings with friction and seat\n", spec_.name,
                        bearings_->sites().size());
  if (partition_) {
    const std::vector<long> cells = partition_->cells_per_rank();
    text += fmt::format(
        "{}: divided over {} ranks{}, {} to {} cells each, {:.2g} % of them computed more than once\n",
        spec_.name, partition_->size(), divided() ? ", its memory too" : "",
        *std::min_element(cells.begin(), cells.end()), *std::max_element(cells.begin(), cells.end()),
        100 * partition_->repeated_share());
  }
  if (const auto parts = memory_consumption(); partition_ || mesh_.hexes.size() >= 20000) {
    std::string list;
    std::size_t bytes = 0;
    for (const auto& [name, size] : parts) {
      list += fmt::format("{}{} {:.2f}", list.empty() ? "" : ", ", name, static_cast<double>(size) / 1e6);
      bytes += size;
    }
    text += fmt::format("{}: {:.2f} MB on this process: {}\n", spec_.name, static_cast<double>(bytes) / 1e6,
                        list);
  }
  if (alpha_ > 0)
    text += fmt::format("{}: damping {:g} of the first mode, {:.4g} Hz\n", spec_.name, spec_.damping_ratio,
                        omega_1_ / (2 * M_PI));
  else if (spec_.damping_ratio > 0)
    text += fmt::format("{}: no support, hence no first mode: damping left out\n", spec_.name);
  return text;
}

/// `here`: what this process holds, as it holds it; else the whole, in its own order, on the first rank.
void FemStructure::save(std::vector<double>& state, bool here) const {
  const bool gathers = partition_ && !here;
  const TakeRows take = [&](std::span<const double> rows) {
    if (here || first_rank()) state.insert(state.end(), rows.begin(), rows.end());
  };
  const auto nodes = [&](int width, const WriteRow& write) {
    return gathers ? each_node(width, write, take) : rows_of(mass_.size(), width, write, take);
  };
  const std::size_t nodes_in_all = gathers ? partition_->nodes_in_all() : mass_.size(),
                    cells_in_all = gathers ? partition_->cells_in_all() : live_.size();
  if (here || first_rank())
    state.reserve(state.size() + 10 * nodes_in_all +
                  cells_in_all);  // most of it: else twice as much is asked for on the way
  state.insert(state.end(), {h_last_,
                             power_,
                             power_valid_ ? 1.0 : 0.0,
                             time_,
                             contact_step_,
                             stored_half_,
                             reference_kinetic_,
                             still_since_,
                             still_ ? 1.0 : 0.0,
                             blow_time_,
                             steps_taken_,
                             books_.damping_work,
                             books_.damage_work,
                             books_.plastic_work,
                             books_.bulk_viscosity_work,
                             books_.eroded_energy,
                             books_.external_work,
                             books_.contact_work,
                             books_.algorithmic,
                             books_.step_dependence});
  nodes(9, [this](int n, double* to) {
    for (std::size_t i = 4 * static_cast<std::size_t>(n), c = 0; c < 3; ++c, ++i)
      *to++ = u_[i], *to++ = v_[i], *to++ = contact_impulse_[i];
  });
  save_linear(state);
  if (bars_) bars_->save(state, here);
  if (bearings_) bearings_->save(state);
  if (damage_ || bearings_) {
    state.insert(state.end(), {static_cast<double>(breaks_), static_cast<double>(cuts_seen_), dust_mass_,
                               dust_potential_, eroded_volume_, detached_volume_});
    for (const Vec3* p : {&dust_momentum_, &dust_spin_}) state.insert(state.end(), p->data(), p->data() + 3);
    if (gathers)
      each_cell(
          1, [this](int cell, double* to) { *to = live_[cell]; }, take);
    else
      state.insert(state.end(), live_.begin(), live_.end());
    nodes(1, [this](int n, double* to) { *to = mass_[n]; });
    if (damage_ && here) {
      damage_->save_here(state);
    } else if (damage_ && gathers) {
      std::vector<double> records;
      damage_->save_records(records);
      records = damage_->state_of(partition_->collect_at_first(records));
      state.insert(state.end(), records.begin(), records.end());
    } else if (damage_) {
      damage_->save(state);
    }
  }
  state.push_back(frames_.empty() ? 0 : 1);
  for (const Mat3& t : frames_) state.insert(state.end(), t.data(), t.data() + 9);
  load_track_.save(state);
  state.push_back(taken_by_condensed_);
}

void FemStructure::restore(std::span<const double> state, bool here) {
  const bool whole = partition_ && !here;
  std::size_t at = 0;
  const auto next = [&]() {
    if (at >= state.size())
      throw NumericalFailure("structure " + spec_.name + ": the saved state belongs to another structure");
    return state[at++];
  };
  const auto take = [&](std::size_t count, std::size_t width) {  // of a table
    if (state.size() - at < count * width)
      throw NumericalFailure("structure " + spec_.name + ": the saved state belongs to another structure");
    const double* const from = state.data() + at;
    at += count * width;
    return from;
  };
  h_last_ = next(), power_ = next();
  power_valid_ = next() != 0;
  time_ = next(), contact_step_ = next(), stored_half_ = next(), reference_kinetic_ = next(),
  still_since_ = next();
  still_ = next() != 0;
  blow_time_ = next();
  steps_taken_ = next();
  books_ = {};
  for (double* p : {&books_.damping_work, &books_.damage_work, &books_.plastic_work,
                    &books_.bulk_viscosity_work, &books_.eroded_energy, &books_.external_work,
                    &books_.contact_work, &books_.algorithmic, &books_.step_dependence})
    *p = next();
  const auto node = [&](std::size_t n) {
    return whole ? static_cast<std::size_t>(partition_->whole_node(static_cast<int>(n))) : n;
  };
  const std::size_t nodes = whole ? partition_->nodes_in_all() : mass_.size();
  const double* const motion = take(nodes, 9);
  for (std::size_t n = 0; n < mass_.size(); ++n) {
    const double* from = motion + 9 * node(n);
    for (std::size_t i = 4 * n; i < 4 * n + 3; ++i)
      u_[i] = *from++, v_[i] = *from++, contact_impulse_[i] = *from++;
  }
  at += restore_linear(state.subspan(at));
  if (bars_) at += bars_->restore(state.subspan(at), here);
  if (bearings_) at += bearings_->restore(state.subspan(at));
  if (damage_ || bearings_) {
    breaks_ = static_cast<long>(next()), cuts_seen_ = static_cast<long>(next()), dust_mass_ = next(),
    dust_potential_ = next(), eroded_volume_ = next(), detached_volume_ = next();
    for (Vec3* p : {&dust_momentum_, &dust_spin_})
      for (int c = 0; c < 3; ++c) (*p)[c] = next();
    double changed = 0;
    std::fill(cells_at_node_.begin(), cells_at_node_.end(), 0);
    const double* const lives = take(whole ? partition_->cells_in_all() : live_.size(), 1);
    for (std::size_t cell = 0; cell < live_.size(); ++cell) {
      const char now =
          lives[whole ? static_cast<std::size_t>(partition_->whole_cell(static_cast<int>(cell))) : cell] != 0;
      if (now != live_[cell]) changed = 1;
      live_[cell] = now;
      if (now)
        for (int n : carriers(mesh_, static_cast<int>(cell))) ++cells_at_node_[n];
    }
    if (partition_) partition_->exchange_numbers(cells_at_node_);
    const double* const masses = take(nodes, 1);
    for (std::size_t n = 0; n < mass_.size(); ++n) {
      const double mass = masses[node(n)];
      if (mass != mass_[n]) changed = 1;
      mass_[n] = mass;
      weights_valid_ = false;
      for (int c = 0; c < 3; ++c)
        inverse_mass_[4 * n + c] = mass_[n] > 0 && !supports_.held[n][c] ? 1 / mass_[n] : 0.0;
    }
    if (damage_) at += here ? damage_->restore_here(state.subspan(at)) : damage_->restore(state.subspan(at));
    for (int cell = 0; cell < static_cast<int>(live_.size()); ++cell)
      operator_->set_on(cell, live_[cell] && !(damage_ && damage_->has(cell)));
    if (largest(changed) > 0) {
      rebuild_skin();
      forget_stiffness();
    }
  }
  std::vector<Mat3> frames(at < state.size() && next() != 0 ? mesh_.hexes.size()
                                                            : 0);  // vectors of former versions end here
  for (Mat3& t : frames)
    for (int i = 0; i < 9; ++i) t.data()[i] = next();
  if (frames != frames_) set_frames(std::move(frames));
  const bool loads_known = at < state.size();
  if (loads_known) at += load_track_.restore(state.subspan(at));
  taken_by_condensed_ = at < state.size() ? next() : 0.0;
  if (at != state.size())
    throw NumericalFailure("structure " + spec_.name + ": the saved state belongs to another structure");
  struck_.clear();
  for (std::size_t i = 0; i < mass_.size(); ++i)
    if (Vec3(&contact_impulse_[4 * i]) != Vec3::Zero()) struck_.push_back(static_cast<int>(i));
  motion_changed();
  moved();
  if (!loads_known) begin_loads();
}

void FemStructure::start_over() {
  books_ = {};
  taken_by_condensed_ = 0;
  still_since_ -= time_;
  blow_time_ -= time_;
  time_ = 0;
  contact_step_ = 0;
  std::fill(contact_impulse_.begin(), contact_impulse_.end(), 0.0);
  struck_.clear();
  moved();
  if (supports_.none) return;
  forces(time_);
  load_track_.begin_again(foot_reactions(0), members_, member_states());
  watch_stress(0);
}

void FemStructure::each_node(int width, const WriteRow& write, const TakeRows& take) const {
  if (partition_) return partition_->each_node(width, write, take);
  rows_of(mass_.size(), width, write, take);
}

void FemStructure::each_cell(int width, const WriteRow& write, const TakeRows& take) const {
  if (partition_) return partition_->each_cell(width, write, take);
  rows_of(live_.size(), width, write, take);
}

void FemStructure::shape(const TakePart& take) const {
  each_node(
      3, [this](int n, double* to) { std::copy_n(mesh_.nodes[n].data(), 3, to); },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += 3) part.nodes.emplace_back(&rows[at]);
        take(part);
      });
  constexpr int width = 9;
  each_cell(
      width,
      [this](int cell, double* to) {
        *to++ = live_[cell];
        for (const int n : mesh_.hexes[cell]) *to++ = partition_ ? partition_->whole_node(n) : n;
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += width)
          if (rows[at] != 0) std::copy_n(&rows[at + 1], 8, part.hexes.emplace_back().begin());
        take(part);
      });
  if (bars_) bars_->shape(take);
}

void FemStructure::values(const TakePart& take) const {
  each_node(
      6,
      [this](int n, double* to) {
        for (const AlignedVector* field : {&u_, &v_})
          to = std::copy_n(&(*field)[4 * static_cast<std::size_t>(n)], 3, to);
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += 6)
          part.displacement.emplace_back(&rows[at]), part.velocity.emplace_back(&rows[at + 3]);
        take(part);
      });
  constexpr int width = 5;
  each_cell(
      width,
      [this](int cell, double* to) {
        *to++ = live_[cell];
        if (live_[cell] == 0) return;
        const Mat3 strain = strain_at_centre(cell);  // where it is most accurate
        const double tension = damage_ ? damage_->tension(cell) : 0,
                     compression = damage_ ? damage_->compression(cell) : 0;
        // In a damaged cell the effective stress is reduced by the larger damage: a measure for a picture,
        // not for a check.
        const Mat3 deviator = 2 * shear_ * (1 - std::max(tension, compression)) *
                              (strain - strain.trace() / 3 * Mat3::Identity());
        *to++ = std::sqrt(1.5) * deviator.norm();
        *to++ = tension;
        *to++ = compression;
        *to = damage_ ? damage_->crack_width(cell, u_.data()) : 0.0;
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += width) {
          if (rows[at] == 0) continue;
          part.stress_von_mises.push_back(rows[at + 1]);
          part.damage_tension.push_back(rows[at + 2]);
          part.damage_compression.push_back(rows[at + 3]);
          part.crack_width.push_back(rows[at + 4]);
        }
        take(part);
      });
  if (bars_) bars_->values(u_.data(), take);
}

}  // namespace talus::fem

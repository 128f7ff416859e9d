#include "fem/rebar/bars.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/reject.hpp"
#include "fem/discretisation/viaduct.hpp"
#include "fem/rebar/bar_anchorage.hpp"

namespace talus::fem {

namespace {

bool inside_round(const rebar::Member& m, const Vec3& p) {
  const Vec3 x = m.axis_x.normalized(), y = m.axis_y.normalized(), d = p - m.base;
  const double along = d.dot(x.cross(y)), exact = 1e-6 * m.width;
  return m.section == rebar::Member::Section::round &&
         std::hypot(d.dot(x), d.dot(y)) <= 0.5 * m.width + exact && along >= -exact &&
         along <= m.length + exact;
}

/// Where bars find their cells. The flat faces of a round section's cells lie inside its circle: what is
/// between the two is held by the nearest cell.
rebar::HostSearch host_of_bars(const StructureSpec& spec, const HexMesh& mesh,
                               const std::vector<rebar::Member>& members) {
  const rebar::HostSearch exact = rebar::host_search(mesh.nodes, mesh.hexes, 1e-6);
  if (spec.section != "round") return exact;
  return [exact, members, nearest = rebar::host_search(mesh.nodes, mesh.hexes, 0.25)](const Vec3& p) {
    const auto host = exact(p);
    if (host) return host;
    return std::any_of(members.begin(), members.end(),
                       [&](const rebar::Member& m) { return inside_round(m, p); })
               ? nearest(p)
               : std::nullopt;
  };
}

/// The law's own demands, told by the keys of the rule.
void check_steel(const material::Steel::Parameters& steel, const std::string& rule) {
  try {
    const material::Steel law(steel);
  } catch (const InputError& e) {
    std::vector<Problem> problems = e.problems();
    for (Problem& p : problems) {
      const std::string name = p.key.substr(p.key.rfind('.') + 1);
      p.key = rule + "." + (name == "fracture_strain" ? "ultimate_strain" : name);
    }
    throw InputError(problems);
  }
}

}  // namespace

Bars::Bars(const StructureSpec& spec, const HexMesh& mesh, const Supports& supports,
           std::vector<rebar::Member> members, const std::function<void(const std::string&)>& warn) {
  for (rebar::Member& member : members) mark_held_ends(member, mesh, supports);
  std::vector<rebar::Bar> all;
  const std::string key = "structure." + spec.name + ".rebar";
  if (!spec.rebar_file.empty()) all = rebar::read_bars(spec.rebar_file);
  const auto stirrup_diameter = [&](const std::string& part) {
    double diameter = 0;
    for (const auto& rule : spec.rebar_rules)
      if (rule.kind == "stirrups" && rule.part == part) diameter = std::max(diameter, rule.diameter);
    return diameter;
  };
  const std::vector<rebar::Member> caps =
      spec.kind == "viaduct" ? cap_members(spec) : std::vector<rebar::Member>{};
  for (const auto& rule : spec.rebar_rules) {
    if (members.empty())
      reject(key, rule.kind, "bars by rule need a box, a column or a viaduct",
             "give the bars of a mesh as polylines: rebar = \"bars.csv\"");
    material::Steel::Parameters steel;
    steel.yield = rule.yield;
    steel.ultimate = 1.08 * rule.yield;
    steel.fracture_strain = rule.ultimate_strain;
    steel.prestress = rule.prestress;
    steel.rate_effect = spec.rate_effect;
    check_steel(steel, fmt::format("{}.{}", key, &rule - spec.rebar_rules.data()));
    if (rule.part == "deck") {
      const std::vector<rebar::Bar> made = deck_bars(spec, rule, steel);
      all.insert(all.end(), made.begin(), made.end());
      continue;
    }
    for (const rebar::Member& member : rule.part == "cap" ? caps : members) {
      std::vector<rebar::Bar> made;
      if (rule.kind == "longitudinal")
        made = rebar::longitudinal_bars(
            member, {rule.bars, rule.diameter, rule.cover, stirrup_diameter(rule.part), steel}, key);
      else if (rule.kind == "stirrups")
        made = rebar::stirrups(member, {rule.diameter, rule.cover, rule.spacing, steel}, key);
      else
        reject(key, rule.kind, "one of longitudinal, stirrups", "choose one");
      all.insert(all.end(), made.begin(), made.end());
    }
  }
  const rebar::HostSearch host = host_of_bars(spec, mesh, members);
  if (const std::string short_ends = anchor_bars(all, host, mesh, supports); !short_ends.empty())
    warn(short_ends);
  const std::vector<rebar::Segment> segments = rebar::embed(all, host, key);
  rebar::check_surfaces(all, segments, host, key);
  std::vector<char> hosting(mesh.nodes.size(), 0);
  for (const rebar::Segment& s : segments)
    for (int n : mesh.hexes[s.cell]) hosting[n] = 1;
  for (std::size_t n = 0; n < hosting.size(); ++n)
    if (hosting[n]) node_.push_back(static_cast<int>(n));
  bars_ = rebar::EmbeddedBars(all, segments, mesh.nodes, mesh.hexes);
  old_ = next_ = bars_.initial_states();
  old_strain_.assign(segments.size(), 0.0);
  next_strain_ = old_strain_;
  if (spec.bond == "mc2010") slip_ = std::make_unique<rebar::SlipField>(bars_, spec.f_cm);
  if (spec.damage != "none" && spec.f_cm > 0) {
    material::ConcreteInput input;
    input.f_cm = spec.f_cm, input.f_t = spec.tensile_strength, input.fracture_energy = spec.fracture_energy;
    const material::Concrete concrete = material::mc2010(input);
    dowels_ = std::make_unique<rebar::DowelField>(bars_, mesh.nodes, mesh.hexes, concrete.f_cm,
                                                  concrete.fracture_energy / concrete.f_t);
  }
}

void Bars::find_carrying(const std::vector<char>& live) {
  carrying_stale_ = false;
  carrying_.clear();
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const int cell = bars_.segments()[k].cell;
    if (live[cell] && (!partition_ || slip_ || partition_->local_cells()[cell]))
      carrying_.push_back(static_cast<int>(k));
  }
  changed_.clear();
  next_ = old_;
  next_strain_ = old_strain_;
}

void Bars::add_forces(const double* u, double h, const std::vector<char>& live, double* f) {
  if (carrying_stale_) find_carrying(live);
  for (const int k : changed_) next_[static_cast<std::size_t>(k)] = old_[static_cast<std::size_t>(k)];
  changed_.clear();
  if (slip_) {
    bars_.host_strains(u, host_);
    bond_ = slip_->solve(host_, h, old_, old_strain_, live.data());
  }
  const bool part = partition_ && !slip_;
  sums_ = bars_.forces(u, h, old_, old_strain_, next_, next_strain_, changed_, f, &carrying_,
                       slip_ ? slip_->strain() : std::span<const double>{},
                       part ? partition_->own_cells().data() : nullptr);
  if (dowels_) {
    const auto stress = [this](std::size_t k) { return steel_stress(k, next_[k], next_strain_[k]); };
    const char* const local = partition_ ? partition_->local_cells().data() : nullptr;
    dowel_sums_ = dowels_->forces(u, stress, live.data(), local,
                                  partition_ ? partition_->own_cells().data() : nullptr, f);
  }
  evaluated_ = true;
}

double Bars::steel_stress(std::size_t k, const material::Steel::State& state, double strain) const {
  if (state.broken > 0) return INFINITY;
  material::Steel::State unused;
  return bars_.law(bars_.segments()[k].bar)(strain, 0, state, unused).stress;
}

void Bars::see_cracks(const DamageField& damage, const double* u, const std::vector<char>& live) {
  if (!dowels_ || damage.cells().empty()) return;
  if (carrying_stale_) find_carrying(live);
  for (const int k : carrying_) {
    const int cell = bars_.segments()[static_cast<std::size_t>(k)].cell;
    if (damage.has(cell) && dowels_->possible(static_cast<std::size_t>(k), damage.largest_strain(cell)))
      dowels_->open(static_cast<std::size_t>(k), u);
  }
}

void Bars::divide(Partition& partition) {
  partition_ = &partition;
  carrying_stale_ = true;
}

void Bars::share_motion(AlignedVector& u) {
  if (!partition_ || !slip_) return;
  std::vector<double> values(3 * node_.size(), 0.0);  // each from its owner
  for (std::size_t k = 0; k < node_.size(); ++k)
    if (partition_->owns_node(node_[k]))
      std::copy_n(&u[4 * static_cast<std::size_t>(node_[k])], 3, &values[3 * k]);
  partition_->sum(values);
  for (std::size_t k = 0; k < node_.size(); ++k)
    std::copy_n(&values[3 * k], 3, &u[4 * static_cast<std::size_t>(node_[k])]);
}

void Bars::share_states() {
  if (partition_ && dowels_) {
    std::vector<double> mine;
    dowels_->save(mine, [this](std::size_t k) { return partition_->owns_cell(bars_.segments()[k].cell); });
    dowels_->learn(partition_->collect(mine), [this](std::size_t k) {
      return partition_->local_cells()[bars_.segments()[k].cell] != 0;
    });
  }
  if (!partition_ || slip_) return;
  std::vector<double> mine;
  for (std::size_t k = 0; k < old_.size(); ++k)
    if (partition_->owns_cell(bars_.segments()[k].cell)) {
      mine.push_back(static_cast<double>(k));
      write_state(k, mine);
    }
  const std::vector<double> all = partition_->collect(mine);
  for (std::size_t i = 0; i < all.size(); i += 1 + state_width)
    read_state(static_cast<std::size_t>(all[i]), &all[i + 1]);
  carrying_stale_ = true;  // the next states of others' segments are to be these, too
}

void Bars::mark_nodes(std::vector<char>& touched) const {
  for (int n : node_) touched[n] = 1;
}

void Bars::accept() {
  if (!evaluated_) return;  // nothing new; what was next is older now
  evaluated_ = false;
  for (const int k : changed_) old_[static_cast<std::size_t>(k)] = next_[static_cast<std::size_t>(k)];
  changed_.clear();
  old_strain_.swap(next_strain_);
  ties_stale_ = ties_stale_ || sums_.breaking > 0;
  if (slip_) slip_->accept();
  if (dowels_) dowels_->accept();
}

void Bars::add_mass(double density, std::vector<double>& mass) const { bars_.add_mass(density, mass); }

double Bars::steel_volume() const {
  double volume = 0;
  for (const auto& s : bars_.segments()) volume += s.area * s.length;
  return volume;
}

std::vector<Spring> Bars::springs(const std::vector<Mat3>* frames) const {
  std::vector<Spring> list;
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const rebar::Segment& s = bars_.segments()[k];
    Spring spring;
    Vec3 along = bars_.along(k);
    for (int i = 0; i < 8; ++i) {
      spring.node.push_back(bars_.host_nodes(k)[i]);
      spring.weight.push_back(s.end[i] - s.start[i]);
    }
    if (frames != nullptr) along = (*frames)[static_cast<std::size_t>(s.cell)] * along;
    along.normalize();
    spring.stiffness = bars_.stiffness(k) * along * along.transpose();
    list.push_back(std::move(spring));
  }
  return list;
}

void Bars::ties(const std::function<void(int, int)>& visit) const {
  if (ties_stale_) {
    ties_stale_ = false;
    ties_.clear();
    tied_.clear();
    const auto& s = bars_.segments();
    for (std::size_t k = 1; k < s.size(); ++k)
      if (s[k].bar == s[k - 1].bar && !(old_[k].broken > 0) && !(old_[k - 1].broken > 0))
        ties_.push_back({s[k - 1].cell, s[k].cell});
  }
  for (const auto& [a, b] : ties_) visit(a, b);
}

const std::vector<char>& Bars::tied(std::size_t cells) const {
  if (!ties_stale_ && tied_.size() == cells) return tied_;
  std::vector<char> held(cells, 0);
  ties([&](int a, int b) { held[static_cast<std::size_t>(a)] = held[static_cast<std::size_t>(b)] = 1; });
  tied_.swap(held);
  return tied_;
}

std::vector<int> Bars::segments_in(const std::vector<int>& cells) const {
  std::vector<int> sorted = cells, list;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t k = 0; k < bars_.segments().size(); ++k)
    if (std::binary_search(sorted.begin(), sorted.end(), bars_.segments()[k].cell))
      list.push_back(static_cast<int>(k));
  return list;
}

double Bars::stored_in(const std::vector<int>& cells) const {
  const auto& states = evaluated_ ? next_ : old_;
  const auto& strains = evaluated_ ? next_strain_ : old_strain_;
  double sum = 0;
  for (const int k : segments_in(cells)) {
    if (dowels_ && (!partition_ || partition_->owns_cell(host(static_cast<std::size_t>(k)))))
      sum += dowels_->stored(static_cast<std::size_t>(k));
    if (!counts()) continue;
    const rebar::Segment& s = bars_.segments()[static_cast<std::size_t>(k)];
    if (partition_ && !slip_ && !partition_->owns_cell(s.cell)) continue;
    material::Steel::State after;
    sum +=
        s.area * s.length *
        bars_.law(s.bar)(strains[static_cast<std::size_t>(k)], 0, states[static_cast<std::size_t>(k)], after)
            .energy;
  }
  return sum;
}

void Bars::add_forces_of(const std::vector<int>& segments, const double* u, const std::vector<char>& live,
                         double* f) const {
  for (int k : segments) {
    if (!live[bars_.segments()[k].cell]) continue;
    const rebar::EmbeddedBars::Pull pull = bars_.pull(k, u, old_[k], slip_strain(k));
    bars_.add_pull(k, pull.force, f);
    if (dowels_)
      dowels_->add_forces_of(static_cast<std::size_t>(k), u, old_[k].broken > 0 ? INFINITY : pull.stress, f);
  }
}

Bars::Counts Bars::count(const std::vector<int>& segments) const {
  std::vector<int> yielded, broken;
  for (int k : segments) {
    if (old_[k].accumulated > 0) yielded.push_back(bars_.segments()[k].bar);
    if (old_[k].broken > 0) broken.push_back(bars_.segments()[k].bar);
  }
  const auto different = [](std::vector<int>& list) {
    std::sort(list.begin(), list.end());
    return static_cast<int>(std::unique(list.begin(), list.end()) - list.begin());
  };
  return {different(yielded), different(broken)};
}

void Bars::snapshot(const double* u, Structure::Snapshot& out) const {
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const auto [a, b] = bars_.ends(k, u);
    const int first = static_cast<int>(out.bar_points.size());
    out.bar_points.push_back(a);
    out.bar_points.push_back(b);
    out.bars.push_back({first, first + 1});
    out.bar_strain.push_back(old_strain_[k]);
    out.bar_stress.push_back(bars_.pull(k, u, old_[k], slip_strain(k)).stress);
    out.bar_state.push_back(old_[k].broken > 0 ? 2 : old_[k].accumulated > 0 ? 1 : 0);
  }
}

void Bars::write_state(std::size_t k, std::vector<double>& state) const {
  const auto& s = old_[k];
  state.insert(state.end(), {s.plastic, s.accumulated, s.back_stress, s.yield, s.broken, old_strain_[k]});
}

void Bars::read_state(std::size_t k, const double* from) {
  auto& s = old_[k];
  ties_stale_ = true;
  for (double* value : {&s.plastic, &s.accumulated, &s.back_stress, &s.yield, &s.broken, &old_strain_[k]})
    *value = *from++;
}

void Bars::save(std::vector<double>& state) const {
  for (std::size_t k = 0; k < old_.size(); ++k) write_state(k, state);
  if (slip_) slip_->save(state);
  if (!dowels_) return;
  std::vector<double> records;
  dowels_->save(records, [](std::size_t) { return true; });
  state.push_back(static_cast<double>(records.size()));
  state.insert(state.end(), records.begin(), records.end());
}

std::size_t Bars::restore(std::span<const double> state) {
  const std::size_t size = state_width * old_.size();
  if (state.size() < size) throw NumericalFailure("the saved bars belong to another structure");
  for (std::size_t k = 0; k < old_.size(); ++k) read_state(k, &state[state_width * k]);
  next_ = old_;
  changed_.clear();
  next_strain_ = old_strain_;
  std::size_t at = size + (slip_ ? slip_->restore(state.subspan(size)) : 0);
  if (!dowels_) return at;
  const std::size_t numbers = at < state.size() ? static_cast<std::size_t>(state[at++]) : 0;
  if (at + numbers > state.size()) throw NumericalFailure("the saved dowels belong to another structure");
  dowels_->restore(state.subspan(at, numbers));
  return at + numbers;
}

}  // namespace talus::fem

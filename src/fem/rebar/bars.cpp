#include "fem/rebar/bars.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/reject.hpp"
#include "core/sort_unique.hpp"
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
  bars_ = rebar::EmbeddedBars(all, segments, mesh.nodes, mesh.hexes);
  division_.hold(segments);
  if (spec.bond == "mc2010") law_.f_cm = spec.f_cm;
  if (spec.damage != "none" && spec.f_cm > 0) {
    const material::Concrete concrete = concrete_of(spec);
    law_.dowel_strength = concrete.f_cm, law_.dowel_opening = concrete.fracture_energy / concrete.f_t;
  }
  place(mesh, nullptr);
}

/// Tables and virgin states of the segments here, in cells and nodes of `mesh`.
void Bars::place(const HexMesh& mesh, std::shared_ptr<const rebar::Surroundings> around) {
  const std::size_t count = bars_.segments().size();
  states_ = {};
  states_.old = bars_.initial_states(),
  states_.next = bars_.initial_states();  // in memory of their own length
  states_.old_strain = std::vector<double>(count, 0.0), states_.next_strain = std::vector<double>(count, 0.0);
  if (law_.f_cm > 0) slip_ = std::make_unique<rebar::SlipField>(bars_, law_.f_cm);
  if (law_.dowel_strength > 0)
    dowels_ = std::make_unique<rebar::DowelField>(bars_, mesh.nodes, mesh.hexes, law_.dowel_strength,
                                                  law_.dowel_opening, std::move(around));
  carrying_stale_ = true;
}

void Bars::find_carrying(const std::vector<char>& live) {
  carrying_stale_ = false;
  carrying_.clear();
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const int cell = bars_.segments()[k].cell;
    if (cell < 0 || live[static_cast<std::size_t>(cell)]) carrying_.push_back(static_cast<int>(k));
  }
  states_.back_to_accepted();
}

void Bars::add_forces(const double* u, double h, const std::vector<char>& live, double* f) {
  if (carrying_stale_) find_carrying(live);
  for (const int k : states_.changed)
    states_.next[static_cast<std::size_t>(k)] = states_.old[static_cast<std::size_t>(k)];
  states_.changed.clear();
  Partition* const partition = division_.partition();
  rebar::DowelField::Sums of_bond, of_dowels;
  if (slip_) {
    bars_.host_strains(u, host_);
    share_strains(live);
    const rebar::SlipField::Sums bond =
        slip_->solve(host_, h, states_.old, states_.old_strain,
                     [this](int first) { return division_.own(host(static_cast<std::size_t>(first))); });
    of_bond = {bond.energy, bond.dissipation};
  }
  const char* const counted = partition ? partition->own_cells().data() : nullptr;
  const rebar::EmbeddedBars::Sums sums =
      bars_.forces(u, h, states_.old, states_.old_strain, states_.next, states_.next_strain, states_.changed,
                   f, &carrying_, slip_ ? slip_->strain() : std::span<const double>{}, counted, host_);
  if (dowels_) {
    const auto stress = [this](std::size_t k) {
      return bars_.stress(k, states_.next[k], states_.next_strain[k]);
    };
    of_dowels = dowels_->forces(u, stress, live.data(), counted, f);
  }
  sums_ = {sums.energy + of_bond.energy + of_dowels.energy,
           sums.dissipation + of_bond.dissipation + of_dowels.dissipation,
           static_cast<double>(sums.breaking)};
  states_.evaluated = true;
}

void Bars::see_cracks(const DamageField& damage, const double* u, const std::vector<char>& live) {
  if (!dowels_ || damage.cells().empty()) return;
  if (carrying_stale_) find_carrying(live);
  for (const int k : carrying_) {
    const int cell = bars_.segments()[static_cast<std::size_t>(k)].cell;
    if (cell >= 0 && damage.has(cell) &&
        dowels_->possible(static_cast<std::size_t>(k), damage.result(cell).largest_strain))
      dowels_->open(static_cast<std::size_t>(k), u);
  }
}

std::shared_ptr<const rebar::Surroundings> Bars::surroundings(const Partition& partition,
                                                              const HexMesh& whole) const {
  if (!dowels_) return nullptr;
  double thickest = 0;
  for (const rebar::Bar& bar : bars_.bars()) thickest = std::max(thickest, bar.diameter);
  Box3 box;
  for (std::size_t k = 0; k < bars_.segments().size(); ++k)
    if (const int cell = partition.cell_here(host(k)); cell >= 0 && partition.local_cells()[cell])
      for (const int n : bars_.host_nodes(k)) box.extend(whole.nodes[static_cast<std::size_t>(n)]);
  auto around = std::make_shared<rebar::Surroundings>();
  if (box.isEmpty()) return around;
  const auto within = [&](double diameters) {
    const Vec3 reach = Vec3::Constant(diameters * thickest);
    return Box3(box.min() - reach, box.max() + reach);
  };
  const Box3 of_bars = within(rebar::DowelField::bar_reach),
             of_concrete = within(rebar::DowelField::concrete_reach);
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const Vec3 start = bars_.start(k), end = start + bars_.along(k);
    if (of_bars.intersects(Box3(start.cwiseMin(end), start.cwiseMax(end))))
      around->bars.push_back({start, bars_.along(k)});
  }
  std::vector<int> place(whole.nodes.size(), -1);
  for (const auto& hex : whole.hexes) {
    Box3 cell;
    for (const int n : hex) cell.extend(whole.nodes[static_cast<std::size_t>(n)]);
    if (!of_concrete.intersects(cell)) continue;
    auto& copy = around->hexes.emplace_back(hex);
    for (int& n : copy) {
      int& at = place[static_cast<std::size_t>(n)];
      if (at < 0)
        at = static_cast<int>(around->nodes.size()),
        around->nodes.push_back(whole.nodes[static_cast<std::size_t>(n)]);
      n = at;
    }
  }
  return around;
}

void Bars::divide(Partition& partition, const HexMesh& mesh,
                  std::shared_ptr<const rebar::Surroundings> around) {
  std::vector<double> state;
  save(state, false);
  const auto local = [&](int cell) {
    const int here = partition.cell_here(cell);
    return here >= 0 && partition.local_cells()[here] ? here : -1;
  };
  std::vector<char> kept(bars_.segments().size(), 0);
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) kept[k] = local(host(k)) >= 0;
  const auto& all = bars_.segments();
  for (std::size_t first = 0, last = 0; slip_ && first < all.size(); first = last) {
    while (last < all.size() && all[last].bar == all[first].bar) ++last;
    const auto begin = kept.begin() + static_cast<std::ptrdiff_t>(first),
               end = kept.begin() + static_cast<std::ptrdiff_t>(last);
    if (std::find(begin, end, 1) != end) std::fill(begin, end, 1);
  }
  std::vector<int> numbers;
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (kept[k]) numbers.push_back(static_cast<int>(k));
  bars_ = bars_.part(numbers, local, [&](int n) { return partition.node_here(n); });
  division_.divide(std::move(numbers), partition);
  place(mesh, std::move(around));
  std::vector<double> asked;
  for (std::size_t k = 0; k < bars_.segments().size(); ++k)
    if (host(k) < 0) asked.push_back(division_.number(k));
  if (slip_) asked = partition.collect(asked);
  heard_.assign(asked.begin(), asked.end());
  sort_unique(heard_);
  StateReader whole(state);
  restore(whole, false);
}

/// Strains of the concrete along segments of other ranks, from their owners; NaN where it is gone.
void Bars::share_strains(const std::vector<char>& live) {
  for (std::size_t k = 0; k < bars_.segments().size(); ++k)
    if (host(k) >= 0 && !live[static_cast<std::size_t>(host(k))]) host_[k] = NAN;
  if (heard_.empty()) return;
  std::vector<double> values(heard_.size(), 0.0);
  const auto each = [&](auto&& use) {
    for (std::size_t i = 0; i < heard_.size(); ++i)
      if (const int k = division_.segment(heard_[i]); k >= 0) use(static_cast<std::size_t>(k), values[i]);
  };
  each([&](std::size_t k, double& value) {
    if (division_.own(host(k))) value = host_[k];
  });
  division_.partition()->sum(values);
  each([&](std::size_t k, double value) {
    if (host(k) < 0) host_[k] = value;
  });
}

std::size_t Bars::memory_consumption() const {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return bars_.memory_consumption() + of(states_.old) + of(states_.next) + of(states_.old_strain) +
         of(states_.next_strain) + of(heard_) + of(carrying_) + of(host_) + division_.memory_consumption() +
         ties_.memory_consumption();
}

void Bars::mark_nodes(std::vector<char>& touched) const {
  for (std::size_t k = 0; k < bars_.segments().size(); ++k)
    if (host(k) >= 0)
      for (const int n : bars_.host_nodes(k)) touched[static_cast<std::size_t>(n)] = 1;
}

void Bars::accept() {
  if (!states_.evaluated) return;  // nothing new; what was next is older now
  states_.evaluated = false;
  for (const int k : states_.changed)
    states_.old[static_cast<std::size_t>(k)] = states_.next[static_cast<std::size_t>(k)];
  states_.changed.clear();
  states_.old_strain.swap(states_.next_strain);
  if (sums_.breaking > 0 && division_.partition() == nullptr) find_broken();
  if (slip_) slip_->accept();
  if (dowels_) dowels_->accept();
}

double Bars::stored_in(const std::vector<int>& cells) const {
  const auto& states = states_.evaluated ? states_.next : states_.old;
  const auto& strains = states_.evaluated ? states_.next_strain : states_.old_strain;
  double sum = 0;
  for (const int k : bars_.segments_in(cells)) {
    if (!division_.own(host(static_cast<std::size_t>(k)))) continue;
    if (dowels_) sum += dowels_->stored(static_cast<std::size_t>(k));
    const rebar::Segment& s = bars_.segments()[static_cast<std::size_t>(k)];
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
    const rebar::EmbeddedBars::Pull pull = bars_.pull(k, u, states_.old[k], slip_ ? slip_->strain()[k] : 0.0);
    bars_.add_pull(k, pull.force, f);
    if (dowels_)
      dowels_->add_forces_of(static_cast<std::size_t>(k), u,
                             states_.old[k].broken > 0 ? INFINITY : pull.stress, f);
  }
}

Bars::Counts Bars::count(const std::vector<int>& segments) const {
  std::vector<double> found;  // twice the number of a bar, one more if it is broken
  const auto once = [&] { sort_unique(found); };
  for (const int segment : segments) {
    const auto k = static_cast<std::size_t>(segment);
    const double bar = 2.0 * bars_.segments()[k].bar;
    if (!division_.own(host(k))) continue;
    if (states_.old[k].accumulated > 0) found.push_back(bar);
    if (states_.old[k].broken > 0) found.push_back(bar + 1);
  }
  once();
  if (Partition* const all = division_.partition()) found = all->collect(found), once();
  const auto broken = std::count_if(found.begin(), found.end(), [](double x) { return std::fmod(x, 2) > 0; });
  return {static_cast<int>(found.size()) - static_cast<int>(broken), static_cast<int>(broken)};
}

void Bars::values(const double* u, const Structure::TakePart& take) const {
  constexpr std::size_t width = 9;
  const auto write = [&](int segment, double* to) {
    const auto k = static_cast<std::size_t>(segment);
    const auto [a, b] = bars_.ends(k, u);
    for (const Vec3* end : {&a, &b}) to = std::copy_n(end->data(), 3, to);
    *to++ = states_.old_strain[k];
    *to++ = bars_.pull(k, u, states_.old[k], slip_ ? slip_->strain()[k] : 0.0).stress;
    *to = states_.old[k].broken > 0 ? 2.0 : states_.old[k].accumulated > 0 ? 1.0 : 0.0;
  };
  const auto take_rows = [&](std::span<const double> rows) {
    Structure::Snapshot part;
    for (std::size_t at = 0; at < rows.size(); at += width) {
      part.bar_points.emplace_back(&rows[at]);
      part.bar_points.emplace_back(&rows[at + 3]);
      part.bar_strain.push_back(rows[at + 6]);
      part.bar_stress.push_back(rows[at + 7]);
      part.bar_state.push_back(rows[at + 8]);
    }
    take(part);
  };
  std::vector<int> numbers;
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) numbers.push_back(division_.number(k));
  if (Partition* const all = division_.partition())
    all->each(
        numbers, division_.in_all(),
        [this](int k) { return division_.own(host(static_cast<std::size_t>(k))); }, width, write, take_rows);
  else
    rows_of(numbers.size(), width, write, take_rows);
}

/// Accepted states of the segments, then how many numbers dowels have, and these.
void Bars::save(std::vector<double>& state, bool here) const {
  const bool gathers = division_.partition() != nullptr && !here;
  const auto width = state_width() + (gathers ? 1 : 0);
  std::vector<double> records;
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    if (gathers && !division_.own(host(k))) continue;
    if (gathers) records.push_back(division_.number(k));
    const auto& s = states_.old[k];
    records.insert(records.end(),
                   {s.plastic, s.accumulated, s.back_stress, s.yield, s.broken, states_.old_strain[k]});
    if (slip_) slip_->write(k, records);
  }
  if (gathers)
    records = division_.partition()->records(static_cast<int>(width), records, Partition::For::first);
  for (std::size_t at = gathers ? 1 : 0; at < records.size(); at += width)
    state.insert(state.end(), &records[at], &records[at] + state_width());
  if (!dowels_) return;
  records.clear();
  dowels_->save(records, [&](std::size_t k) { return !gathers || division_.own(host(k)); });
  if (gathers) {
    for (std::size_t at = 0; at < records.size(); at += rebar::DowelField::record_width)
      records[at] = division_.number(static_cast<std::size_t>(records[at]));
    records = division_.partition()->records(rebar::DowelField::record_width, records, Partition::For::first);
  }
  state.push_back(static_cast<double>(records.size()));
  state.insert(state.end(), records.begin(), records.end());
}

void Bars::restore(StateReader& state, bool here) {
  const bool whole = division_.partition() != nullptr && !here;
  const std::size_t width = state_width();
  const double* const states = state.take(width * (whole ? division_.in_all() : bars_.segments().size()));
  for (std::size_t k = 0; k < bars_.segments().size(); ++k) {
    const double* from = states + width * (whole ? static_cast<std::size_t>(division_.number(k)) : k);
    auto& s = states_.old[k];
    for (double* value :
         {&s.plastic, &s.accumulated, &s.back_stress, &s.yield, &s.broken, &states_.old_strain[k]})
      *value = *from++;
    if (slip_) slip_->read(k, from);
  }
  states_.back_to_accepted();
  find_broken();
  if (!dowels_) return;
  constexpr std::size_t record = rebar::DowelField::record_width;
  const std::size_t numbers = state.count();
  std::vector<double> mine;
  for (std::size_t i = 0; i < numbers; i += record) {
    const double* const from = state.take(record);
    double k = from[0];
    if (whole) {
      k = division_.segment(static_cast<int>(k));
      if (k < 0) continue;
      if (host(static_cast<std::size_t>(k)) < 0) continue;
    }
    mine.push_back(k);
    mine.insert(mine.end(), from + 1, from + record);
  }
  dowels_->restore(mine);
}

bool Bars::yielded() const {
  return std::any_of(states_.old.begin(), states_.old.end(),
                     [](const material::Steel::State& s) { return s.accumulated > 0 || s.broken > 0; });
}

void Bars::take_over(const Bars& before) {
  const auto &old = before.bars_.segments(), &segments = bars_.segments();
  std::vector<double> part(old.size(), -1), records;  // of each old segment, the last one in it
  for (std::size_t k = 0, j = 0; k < segments.size(); ++k) {
    const double middle = segments[k].arc + 0.5 * segments[k].length;
    while (old[j].bar < segments[k].bar || old[j].arc + old[j].length < middle) ++j;
    states_.old[k] = before.states_.old[j], states_.old_strain[k] = before.states_.old_strain[j];
    part[j] = static_cast<double>(k);
  }
  states_.back_to_accepted();
  find_broken();
  if (!dowels_) return;
  before.dowels_->save(records, [](std::size_t) { return true; });
  for (std::size_t at = 0; at < records.size(); at += rebar::DowelField::record_width)
    records[at] = part[static_cast<std::size_t>(records[at])];
  dowels_->restore(records);
}

std::vector<Spring> springs_of(const rebar::EmbeddedBars& bars, const std::vector<Mat3>* frames) {
  std::vector<Spring> list;
  for (std::size_t k = 0; k < bars.segments().size(); ++k) {
    const rebar::Segment& s = bars.segments()[k];
    if (s.cell < 0) continue;
    Spring spring;
    Vec3 along = bars.along(k);
    for (int i = 0; i < 8; ++i) {
      spring.node.push_back(bars.host_nodes(k)[i]);
      spring.weight.push_back(s.end[i] - s.start[i]);
    }
    if (frames != nullptr) along = (*frames)[static_cast<std::size_t>(s.cell)] * along;
    along.normalize();
    spring.stiffness = bars.stiffness(k) * along * along.transpose();
    list.push_back(std::move(spring));
  }
  return list;
}

}  // namespace talus::fem

// A checkpoint is a copy of the state as named plain arrays.
#include <fmt/format.h>

#include "core/error.hpp"
#include "coupling/touch/contact_numbers.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::sim {
namespace {

class Writer {
 public:
  explicit Writer(std::vector<double>& out) : out_(out) {}
  void operator()(double x) { out_.push_back(x); }
  template <typename Derived>
  void operator()(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c)
      for (Eigen::Index r = 0; r < m.rows(); ++r) out_.push_back(m(r, c));
  }
  void operator()(const Quat& q) { (*this)(q.coeffs()); }

 private:
  std::vector<double>& out_;
};

[[noreturn]] void refuse(std::string value, std::string rule) {
  Problem problem;
  problem.key = "checkpoint";
  problem.value = std::move(value);
  problem.rule = std::move(rule);
  problem.remedy = "run from the start, without --resume";
  throw InputError(problem);
}

template <typename T>
const std::vector<T>& array(const std::map<std::string, std::vector<T>>& arrays, const std::string& key) {
  const auto found = arrays.find(key);
  if (found == arrays.end()) refuse(key, "the array is missing");
  return found->second;
}

/// Whole numbers of an array, one after the other.
class Counts {
 public:
  explicit Counts(const std::vector<std::int64_t>& in) : in_(in) {}
  std::int64_t next() {
    if (at_ >= in_.size()) refuse("", "an array is shorter than it must be");
    return in_[at_++];
  }
  /// In 0 .. limit - 1: what counts or names elements of something.
  std::int64_t below(std::int64_t limit) {
    const std::int64_t n = next();
    if (n < 0 || n >= limit) refuse(std::to_string(n), fmt::format("must lie in 0..{}", limit - 1));
    return n;
  }

 private:
  const std::vector<std::int64_t>& in_;
  std::size_t at_ = 0;
};

class Reader {
 public:
  explicit Reader(const std::vector<double>& in) : in_(in) {}
  double next() {
    if (at_ >= in_.size()) refuse("", "an array is shorter than it must be");
    return in_[at_++];
  }
  void operator()(double& x) { x = next(); }
  template <typename Derived>
  void operator()(Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c)
      for (Eigen::Index r = 0; r < m.rows(); ++r) m(r, c) = next();
  }
  void operator()(Quat& q) { (*this)(q.coeffs()); }

 private:
  const std::vector<double>& in_;
  std::size_t at_ = 0;
};

template <typename F>
void each_ledger(coupling::Ledger& l, F&& f) {
  f(l.friction_work);
  f(l.damping_work);
  f(l.yield_work);
  f(l.ploughing_work);
  f(l.vegetation_work);
  f(l.algorithmic);
  f(l.contact);
  f(l.structure_contact_work);
  f(l.blocks_contact_work);
}

/// Every sum of the run, in one order for both directions.
template <typename Count, typename Number>
void each_sum(coupling::RunSums& sums, Count&& count, Number&& number) {
  coupling::Counters& c = sums.counters;
  for (long* n :
       {&c.steps, &c.rejected, &c.contacts, &c.newton, &c.sweeps, &c.outer, &c.impacts, &c.projections,
        &c.newton_method, &c.interior_point, &c.above_tolerance, &c.halved, &c.convex, &c.flights,
        &c.structure_steps, &c.condensed_steps, &sums.asleep_skipped, &sums.structure_asleep, &c.reduced})
    count(*n);
  coupling::AuditSums& a = sums.audit;
  for (double* x : {&c.worst_residual, &c.worst_penetration, &c.last_step, &a.worst_force, &a.worst_moment,
                    &a.work_on_blocks, &a.work_on_structure, &c.gained, &c.worst_gain, &c.undone,
                    &c.crush_depth, &c.crush_share, &c.restitution_lost})
    number(*x);
  for (Vec3* v : {&a.impulse_on_structure, &a.impulse_on_blocks}) number(*v);
}

/// Halves the cells that were halved where blocks struck.
void halve_cells_at(World& w, const std::vector<double>& places) {
  auto& structures = w.system->environment().structures;
  Reader struck(places);
  for (std::size_t left = places.size(); left > 0; left -= 9) {
    World::StruckPlace place;
    const double structure = struck.next();
    if (left < 9 || !(structure >= 0 && structure < static_cast<double>(structures.size())))
      refuse(fmt::format("{:g}", structure), "names no structure");
    place.structure = static_cast<int>(structure);
    struck(place.zone.region.min());
    struck(place.zone.region.max());
    struck(place.zone.cell_size);
    struck(place.energy);
    w.struck.push_back(place);
  }
  const double energy_start = w.energy_start;  // of the run, whatever cells it began with
  for (std::size_t q = 0; q < structures.size(); ++q)
    if (structures[q].stepped()) w.refine_structure(static_cast<int>(q));
  w.energy_start = energy_start;
}

}  // namespace

Checkpoint Simulation::save() const {
  Checkpoint c;
  World& w = *world_;
  coupling::SystemState& s = w.system->state();
  const std::size_t n = s.blocks.c.size();
  auto& blocks = c.numbers["blocks"];
  Writer out(blocks);
  for (std::size_t i = 0; i < n; ++i) {
    out(s.blocks.c[i]);
    out(s.blocks.v[i]);
    out(s.blocks.w[i]);
    out(s.blocks.q[i]);
    out(s.blocks.eps[i]);
    out(s.blocks.eps_rate[i]);
    out(s.step[i]);
  }
  auto& asleep = c.integers["asleep"];
  auto& memory_count = c.integers["contact_count"];
  auto& keys = c.integers["contact_key"];
  Writer memory(c.numbers["contacts"]);
  for (std::size_t i = 0; i < n; ++i) {
    asleep.push_back(s.asleep[i]);
    memory_count.push_back(static_cast<std::int64_t>(s.contacts[i].size()));
    for (const coupling::ContactMemory& m : s.contacts[i]) {
      keys.push_back(static_cast<std::int64_t>(m.partner));
      keys.push_back(static_cast<std::int64_t>(m.feature));
      keys.push_back(coupling::bond_flags(m));
      coupling::each_number(m, memory);
    }
  }
  Writer surfaces(c.numbers["surface_contacts"]);
  auto& surface_keys = c.integers["surface_contacts"];
  for (const auto& list : s.surface_contacts) {
    surface_keys.push_back(static_cast<std::int64_t>(list.size()));
    for (const coupling::ContactMemory& m : list) {
      surface_keys.insert(surface_keys.end(), {static_cast<std::int64_t>(m.partner),
                                               static_cast<std::int64_t>(m.feature), m.broken ? 1 : 0});
      coupling::each_number(m, surfaces);
    }
  }
  Writer general(c.numbers["general"]);
  general(s.time);
  each_ledger(s.ledger, [&](double x) { general(x); });
  general(w.energy_start);
  general(w.energy_peak);
  general(s.stretch);
  general(s.kinetic_peak);
  Writer peaks(c.numbers["peaks"]);
  for (const coupling::MotionPeaks& p : s.peaks) peaks(p.speed), peaks(p.spin), peaks(p.kinetic);
  Writer sums(c.numbers["sums"]);
  each_sum(
      w.system->sums(), [&](long n) { c.integers["sums"].push_back(n); }, sums);
  Writer met(c.numbers["met"]);
  for (const coupling::Met& m : w.system->sums().audit.met) met(m.first), met(m.impulse);
  c.integers["general"] = {s.stretches, w.built_energy ? 1 : 0, static_cast<std::int64_t>(n)};
  c.integers["told_unsupported"].assign(w.told_unsupported.begin(), w.told_unsupported.end());
  c.numbers["structure_steps"] = s.structure_step;
  Writer struck(c.numbers["struck_places"]);
  for (const World::StruckPlace& place : w.struck) {
    struck(static_cast<double>(place.structure));
    struck(place.zone.region.min());
    struck(place.zone.region.max());
    struck(place.zone.cell_size);
    struck(place.energy);
  }
  if (!s.blocks.slid.empty()) c.numbers["slid"] = s.blocks.slid;
  c.integers["crush_law"] = {w.system->sums().counters.crush_law, w.told_crushed_through ? 1 : 0};
  for (std::size_t q = 0; q < w.system->environment().structures.size(); ++q) {
    const coupling::StructurePart& part = w.system->environment().structures[q];
    if (!part.stepped()) continue;
    part.structure->save(c.numbers[fmt::format("structure{}", q)]);
    // An index that lags behind its surface decides what is near until something comes near: it is history.
    Writer index(c.numbers[fmt::format("index{}", q)]);
    if (part.lagging_index)
      for (const Vec3& x : part.index->surface().vertices) index(x);
  }
  // Fragments: their shapes and mass properties are history, too.
  const dda::Model& model = w.system->model();
  Writer shape(c.numbers["fragments"]);
  auto& counts = c.integers["fragments"];
  for (std::size_t i = 0; i < n; ++i) {
    if (!w.header.blocks[i].fragment) continue;
    const dda::Model::Block& b = model.blocks[i];
    c.fragment_names.push_back(b.name);
    counts.push_back(static_cast<std::int64_t>(b.shape->vertices.size()));
    counts.push_back(static_cast<std::int64_t>(b.shape->triangles.size()));
    counts.push_back(b.material);
    counts.push_back(b.structure);
    for (const auto& t : b.shape->triangles) counts.insert(counts.end(), t.begin(), t.end());
    shape(b.mass);
    shape(b.volume);
    shape(b.second_moment);
    for (const Vec3& x : b.shape->vertices) shape(x);
  }
  if (w.paper) {
    w.paper->history.save(c.numbers["paper"]);
    const PaperScheme& p = *w.paper;
    c.numbers["paper_sums"] = {p.time,           p.friction_work, p.algorithmic, p.worst_penetration,
                               p.contact_energy, p.strain_energy, p.kinetic};
    c.integers["paper_sums"] = {p.steps, p.iterations, p.cuts, p.unsettled, p.contacts};
  }
  return c;
}

void Simulation::restore(const Checkpoint& c) {
  World& w = *world_;
  w.restored = true;
  const auto numbers = [&](const std::string& key) -> const std::vector<double>& {
    return array(c.numbers, key);
  };
  const auto integers = [&](const std::string& key) -> const std::vector<std::int64_t>& {
    return array(c.integers, key);
  };
  // Fragments first: they are blocks of the state.
  Counts counts(integers("fragments"));
  Reader shape(numbers("fragments"));
  for (const std::string& name : c.fragment_names) {
    const std::int64_t vertices = counts.below(static_cast<std::int64_t>(numbers("fragments").size()));
    const std::int64_t triangles = counts.below(static_cast<std::int64_t>(integers("fragments").size()));
    dda::Model::Block b;
    b.name = name;
    b.material = static_cast<int>(counts.below(static_cast<std::int64_t>(w.scene.materials.size())));
    b.structure = static_cast<int>(counts.below(static_cast<std::int64_t>(w.scene.structures.size())));
    std::vector<std::array<int, 3>> t(static_cast<std::size_t>(triangles));
    for (auto& tri : t)
      for (int& v : tri) v = static_cast<int>(counts.below(vertices));
    shape(b.mass);
    shape(b.volume);
    shape(b.second_moment);
    std::vector<Vec3> v(static_cast<std::size_t>(vertices));
    for (Vec3& x : v) shape(x);
    b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
    b.shape = std::make_shared<const Polyhedron>(make_polyhedron(std::move(v), t));
    const StructureSpec& of = w.scene.structures[static_cast<std::size_t>(b.structure)];
    w.header.blocks.push_back({b.name, b.mass, b.volume, false, true, *b.shape, of.young, of.poisson});
    w.system->add_block(b, Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  }
  coupling::SystemState& s = w.system->state();
  const std::size_t n = s.blocks.c.size();
  Counts general_integers(integers("general"));
  const std::int64_t stretches = general_integers.next();
  const bool built_energy = general_integers.next() != 0;
  if (const std::int64_t blocks = general_integers.next(); blocks != static_cast<std::int64_t>(n))
    refuse(fmt::format("{} blocks", blocks), fmt::format("the scene has {} blocks", n));
  Reader in(numbers("blocks"));
  for (std::size_t i = 0; i < n; ++i) {
    in(s.blocks.c[i]);
    in(s.blocks.v[i]);
    in(s.blocks.w[i]);
    in(s.blocks.q[i]);
    in(s.blocks.eps[i]);
    in(s.blocks.eps_rate[i]);
    in(s.step[i]);
  }
  Reader memory(numbers("contacts"));
  Counts asleep(integers("asleep")), contact_count(integers("contact_count")), keys(integers("contact_key"));
  for (std::size_t i = 0; i < n; ++i) {
    s.asleep[i] = asleep.next() != 0 ? 1 : 0;
    s.contacts[i].assign(static_cast<std::size_t>(contact_count.below(
                             static_cast<std::int64_t>(integers("contact_key").size()) + 1)),
                         {});
    for (coupling::ContactMemory& m : s.contacts[i]) {
      m.partner = static_cast<std::uint64_t>(keys.next());
      m.feature = static_cast<std::uint64_t>(keys.next());
      coupling::set_bond(m, keys.next());
      coupling::each_number(m, memory);
    }
  }
  Reader surfaces(numbers("surface_contacts"));
  Counts surface_keys(integers("surface_contacts"));
  for (auto& list : s.surface_contacts) {
    list.assign(static_cast<std::size_t>(surface_keys.below(1'000'000)), {});
    for (coupling::ContactMemory& m : list) {
      m.partner = static_cast<std::uint64_t>(surface_keys.next());
      m.feature = static_cast<std::uint64_t>(surface_keys.next());
      m.broken = surface_keys.next() != 0;
      coupling::each_number(m, surfaces);
    }
  }
  Reader general(numbers("general"));
  general(s.time);
  each_ledger(s.ledger, [&](double& x) { general(x); });
  general(w.energy_start);
  general(w.energy_peak);
  general(s.stretch);
  general(s.kinetic_peak);
  Reader peaks(numbers("peaks"));
  for (coupling::MotionPeaks& p : s.peaks) peaks(p.speed), peaks(p.spin), peaks(p.kinetic);
  Reader sums(numbers("sums"));
  Counts sum_counts(integers("sums"));
  each_sum(
      w.system->sums(), [&](long& k) { k = sum_counts.next(); }, sums);
  if (const auto found = c.numbers.find("met"); found != c.numbers.end()) {
    Reader met(found->second);
    w.system->sums().audit.met.resize(found->second.size() / 4);
    for (coupling::Met& m : w.system->sums().audit.met) met(m.first), met(m.impulse);
  }
  s.stretches = stretches;
  w.built_energy = built_energy;
  if (const auto slid = c.numbers.find("slid"); slid != c.numbers.end()) {
    Reader ways(slid->second);
    s.blocks.slid.assign(n, 0.0);
    for (double& way : s.blocks.slid) ways(way);
  }
  if (const auto crushed = c.integers.find("crush_law"); crushed != c.integers.end()) {
    Counts values(crushed->second);
    w.system->sums().counters.crush_law = static_cast<int>(values.next());
    w.told_crushed_through = values.next() != 0;
  }
  auto& structures = w.system->environment().structures;
  if (const auto told = c.integers.find("told_unsupported"); told != c.integers.end())
    for (const std::int64_t flag : told->second) w.told_unsupported.push_back(flag != 0 ? 1 : 0);
  if (const auto steps = c.numbers.find("structure_steps");
      steps != c.numbers.end()) {  // none in those of former versions
    Reader step(steps->second);
    for (double& h : s.structure_step) step(h);
  }
  if (const auto found = c.numbers.find("struck_places"); found != c.numbers.end())
    halve_cells_at(w, found->second);
  for (std::size_t q = 0; q < structures.size(); ++q) {
    coupling::StructurePart& part = structures[q];
    if (!part.stepped()) continue;
    part.structure->restore(numbers(fmt::format("structure{}", q)));
    if (part.fixed_surface) continue;  // blocks strike its undeformed surface
    TriangleSurface skin = part.structure->skin().surface();
    const std::vector<double>& lagging = numbers(fmt::format("index{}", q));
    part.lagging_index = !lagging.empty();
    if (part.lagging_index) {
      Reader index(lagging);
      for (Vec3& x : skin.vertices) index(x);
    }
    part.index = coupling::moving_index(skin);
  }
  if (w.paper) {
    w.paper->history.restore(numbers("paper"));
    Reader d(numbers("paper_sums"));
    Counts k(integers("paper_sums"));
    PaperScheme& p = *w.paper;
    for (double* x : {&p.time, &p.friction_work, &p.algorithmic, &p.worst_penetration, &p.contact_energy,
                      &p.strain_energy, &p.kinetic})
      d(*x);
    for (long* x : {&p.steps, &p.iterations, &p.cuts, &p.unsettled, &p.contacts}) *x = k.next();
  }
}

}  // namespace talus::sim

// A checkpoint is a copy of the state as named plain arrays.
#include <fmt/format.h>

#include "core/error.hpp"
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

class Reader {
 public:
  explicit Reader(const std::vector<double>& in) : in_(in) {}
  double next() {
    if (at_ >= in_.size()) throw InputError(Problem{.key = "checkpoint", .rule = "an array is shorter than it must be", .remedy = "use an older checkpoint, or run from the start"});
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
  f(l.friction_work); f(l.damping_work); f(l.algorithmic); f(l.contact); f(l.structure_contact_work); f(l.blocks_contact_work);
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
    out(s.blocks.c[i]); out(s.blocks.v[i]); out(s.blocks.w[i]); out(s.blocks.q[i]); out(s.blocks.eps[i]); out(s.blocks.eps_rate[i]);
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
      keys.push_back(m.broken ? 1 : 0);
      memory(m.force); memory(m.shear); memory(m.normal_energy); memory(m.crushed);
    }
  }
  Writer general(c.numbers["general"]);
  general(s.time);
  each_ledger(s.ledger, [&](double x) { general(x); });
  general(w.energy_start); general(w.energy_peak);
  c.integers["general"] = {s.stretches, w.built_energy ? 1 : 0, static_cast<std::int64_t>(n)};
  for (std::size_t q = 0; q < w.system->environment().structures.size(); ++q)
    if (!w.system->environment().structures[q].fixed_surface)
      w.system->environment().structures[q].structure->save(c.numbers[fmt::format("structure{}", q)]);
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
    shape(b.mass); shape(b.volume); shape(b.second_moment);
    for (const Vec3& x : b.shape->vertices) shape(x);
  }
  if (w.paper) {
    w.paper->history.save(c.numbers["paper"]);
    const PaperScheme& p = *w.paper;
    c.numbers["paper_sums"] = {p.time, p.friction_work, p.algorithmic, p.worst_penetration, p.contact_energy, p.strain_energy, p.kinetic};
    c.integers["paper_sums"] = {p.steps, p.iterations, p.cuts, p.unsettled, p.contacts};
  }
  return c;
}

void Simulation::restore(const Checkpoint& c) {
  World& w = *world_;
  const auto numbers = [&](const std::string& key) -> const std::vector<double>& {
    const auto found = c.numbers.find(key);
    if (found == c.numbers.end())
      throw InputError(Problem{.key = "checkpoint", .value = key, .rule = "the array is missing", .remedy = "use an older checkpoint, or run from the start"});
    return found->second;
  };
  const auto integers = [&](const std::string& key) -> const std::vector<std::int64_t>& {
    const auto found = c.integers.find(key);
    if (found == c.integers.end())
      throw InputError(Problem{.key = "checkpoint", .value = key, .rule = "the array is missing", .remedy = "use an older checkpoint, or run from the start"});
    return found->second;
  };
  // Fragments first: they are blocks of the state.
  const auto& counts = integers("fragments");
  Reader shape(numbers("fragments"));
  std::size_t at = 0;
  for (const std::string& name : c.fragment_names) {
    const std::int64_t vertices = counts.at(at), triangles = counts.at(at + 1);
    dda::Model::Block b;
    b.name = name;
    b.material = static_cast<int>(counts.at(at + 2));
    b.structure = static_cast<int>(counts.at(at + 3));
    at += 4;
    std::vector<std::array<int, 3>> t(static_cast<std::size_t>(triangles));
    for (auto& tri : t)
      for (int& v : tri) v = static_cast<int>(counts.at(at++));
    shape(b.mass); shape(b.volume); shape(b.second_moment);
    std::vector<Vec3> v(static_cast<std::size_t>(vertices));
    for (Vec3& x : v) shape(x);
    b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
    b.shape = std::make_shared<const Polyhedron>(make_polyhedron(std::move(v), t));
    w.header.blocks.push_back({b.name, b.mass, b.volume, false, true, *b.shape});
    w.system->add_block(b, Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  }
  coupling::SystemState& s = w.system->state();
  const std::size_t n = s.blocks.c.size();
  const auto& general_integers = integers("general");
  if (static_cast<std::size_t>(general_integers.at(2)) != n)
    throw InputError(Problem{.key = "checkpoint", .value = fmt::format("{} blocks", general_integers.at(2)), .rule = fmt::format("the scene has {} blocks", n), .remedy = "resume with the scene that was run"});
  Reader in(numbers("blocks"));
  for (std::size_t i = 0; i < n; ++i) {
    in(s.blocks.c[i]); in(s.blocks.v[i]); in(s.blocks.w[i]); in(s.blocks.q[i]); in(s.blocks.eps[i]); in(s.blocks.eps_rate[i]);
    in(s.step[i]);
  }
  Reader memory(numbers("contacts"));
  const auto& keys = integers("contact_key");
  std::size_t key = 0;
  for (std::size_t i = 0; i < n; ++i) {
    s.asleep[i] = static_cast<char>(integers("asleep").at(i));
    s.contacts[i].assign(static_cast<std::size_t>(integers("contact_count").at(i)), {});
    for (coupling::ContactMemory& m : s.contacts[i]) {
      m.partner = static_cast<std::uint64_t>(keys.at(key++));
      m.feature = static_cast<std::uint64_t>(keys.at(key++));
      m.broken = keys.at(key++) != 0;
      memory(m.force); memory(m.shear); memory(m.normal_energy); memory(m.crushed);
    }
  }
  Reader general(numbers("general"));
  general(s.time);
  each_ledger(s.ledger, [&](double& x) { general(x); });
  general(w.energy_start); general(w.energy_peak);
  s.stretches = general_integers.at(0);
  w.built_energy = general_integers.at(1) != 0;
  auto& structures = w.system->environment().structures;
  for (std::size_t q = 0; q < structures.size(); ++q)
    if (!structures[q].fixed_surface) {
      structures[q].structure->restore(numbers(fmt::format("structure{}", q)));
      structures[q].index = std::make_unique<contact::SurfaceIndex>(structures[q].structure->surface());
    }
  if (w.paper) {
    w.paper->history.restore(numbers("paper"));
    const auto& d = numbers("paper_sums");
    const auto& k = integers("paper_sums");
    PaperScheme& p = *w.paper;
    p.time = d.at(0); p.friction_work = d.at(1); p.algorithmic = d.at(2); p.worst_penetration = d.at(3);
    p.contact_energy = d.at(4); p.strain_energy = d.at(5); p.kinetic = d.at(6);
    p.steps = k.at(0); p.iterations = k.at(1); p.cuts = k.at(2); p.unsettled = k.at(3); p.contacts = k.at(4);
  }
}

}  // namespace talus::sim

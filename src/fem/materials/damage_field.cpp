#include "fem/materials/damage_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>

#include "core/error.hpp"
#include "fem/materials/material_cdpm2.hpp"

namespace talus::fem {
namespace {

using material::Cdpm2;
using material::ConcreteDamage;
using material::DamageCell;

/// The history of a cell under a law, and how its points are read.
template <class Law>
struct History;

template <>
struct History<ConcreteDamage> {
  using Cell = DamageCell;
  static const Cell& in(const Cell& c) { return c; }
  static Cell& in(Cell& c) { return c; }
  static ElasticLimits limits(const ConcreteDamage& law) {
    // tau_t^2 = (1 + nu) sum p^2 - nu (sum p)^2 is convex in the positive principal values p: largest at a
    // corner of [0, sigma_1]^3. tau_c of the negative part is at most that of min(tr, 0) and the whole
    // deviator.
    const material::Concrete& c = law.parameters().concrete;
    const double corners = std::max({1.0, 2 * (1 - c.poisson), 3 * (1 - 2 * c.poisson)});
    const double exact = 1 - 1e-9, root2 = std::sqrt(2.0),
                 k = root2 * (c.biaxial_ratio - 1) / (2 * c.biaxial_ratio - 1);
    return {law.elastic_bound(), exact * c.f_t / std::sqrt(corners),
            exact * ConcreteDamage::elastic_limit * c.f_cm * (root2 - k) / 3, k};
  }
  static double tension(const Cell& c, int q) { return c.d_t[q]; }
  static double compression(const Cell& c, int q) { return c.d_c[q]; }
  static double band(const ConcreteDamage& law, const Cell& c, int q) {
    return law.crack_length(c.f_t[q], c.b_t[q]);
  }
  static constexpr bool crushes = true;
  /// What is crushed goes along with a change of strain that is no motion.
  static void carry(Cell& c, int q, const double (&change)[6]) {
    const double volume = change[0] + change[1] + change[2];
    c.compaction[q] -= volume;
    for (int k = 0; k < 6; ++k) c.flow[k][q] += change[k] - (k < 3 ? volume / 3 : 0.0);
  }
};

template <>
struct History<Cdpm2> {
  struct Cell {
    Cdpm2::State point[8];
  };
  static const Cdpm2::State* in(const Cell& c) { return c.point; }
  static Cdpm2::State* in(Cell& c) { return c.point; }
  static ElasticLimits limits(const Cdpm2& law) { return {law.elastic_bound()}; }
  static constexpr bool crushes = false;  // plastic strains take it
  static double tension(const Cell& c, int q) { return c.point[q].w_t; }
  static double compression(const Cell& c, int q) { return c.point[q].w_c; }
  static double band(const Cdpm2&, const Cell& c, int q) { return c.point[q].size; }
};

constexpr double path_increment =
    0.25;  // of the strain and the peak strain, for the law to be integrated within a per cent

/// Has the memory sent for while there is other work: a cell's history and geometry are some 5 kB that
/// nothing else needs.
template <class T>
void fetch(const T& object, bool to_write) {
  const char* const start = reinterpret_cast<const char*>(&object);
  for (std::size_t at = 0; at < sizeof(T); at += 64)
    to_write ? __builtin_prefetch(start + at, 1) : __builtin_prefetch(start + at, 0);
}

double mean_of(const double (&x)[8]) {
  return 0.125 * (((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7])));
}

struct Answer {
  alignas(64) double stress[6][8], energy[8], dissipation[8];
};

/// mean += share times the stress of one increment, share * way, whose work is what the law says it stored
/// and dissipated: the mean of both ends and the least change of it along the increment [gonzalez1996].
void add_mean_stress(const Answer& before, const Answer& after, const double (&way)[6][8], int q,
                     double share, double (&mean)[6][8]) {
  double work = 0, square = 1e-300;
  for (int k = 0; k < 6; ++k) {
    work += 0.5 * (before.stress[k][q] + after.stress[k][q]) * way[k][q];
    square += (k < 3 ? 1 : 0.5) * way[k][q] * way[k][q];
  }
  const double rest = (after.energy[q] - before.energy[q] + after.dissipation[q]) / share - work;
  for (int k = 0; k < 6; ++k)
    mean[k][q] += share * (0.5 * (before.stress[k][q] + after.stress[k][q]) +
                           rest / square * (k < 3 ? 1 : 0.5) * way[k][q]);
}

template <class Law>
class FieldOf final : public DamageField {
  using H = History<Law>;
  using Cell = typename H::Cell;
  static constexpr std::size_t cell_width = sizeof(Cell) / sizeof(double);
  static_assert(sizeof(Cell) % sizeof(double) == 0);

 public:
  FieldOf(const HexMesh& mesh, const Law& law, bool finite)
      : DamageField(mesh, finite),
        law_(law),
        peak_strain_(law.parameters().concrete.f_t / law.parameters().concrete.young) {}

  ElasticLimits elastic_limits() const override { return H::limits(law_); }

  bool try_cell(int cell, const Motion& motion, double* f) override {
    const LawGeometry g = law_geometry(*mesh_, cell, law_.parameters().concrete.poisson);
    const Cell none{};
    Cell next{};
    Evaluation e;
    const LawResult result = evaluate(g, motion, none, next, e);
    if (!result.grew) return false;
    slot_[cell] = static_cast<int>(cells_.size());
    cells_.push_back(cell);
    joined_.push_back(evaluation_);
    geometry_.push_back(g);
    old_.push_back(none);
    next_.push_back(next);
    result_.push_back(result);
    points_.add_forces(g, e.at, e.answer.stress, finite_, f);
    return true;
  }

  void add_forces(const Motion& motion, double* f) override {
    Evaluation e;
    ++evaluation_;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (i + 1 < cells_.size())
        fetch(geometry_[i + 1], false), fetch(old_[i + 1], false), fetch(next_[i + 1], true);
      take_cracks(i);
      result_[i] = evaluate(geometry_[i], motion, old_[i], next_[i], e);
      points_.add_forces(geometry_[i], e.at, e.answer.stress, finite_, f);
    }
  }

  void add_force_of(int cell, const double* u, double* f) const override {
    const int i = slot_[cell];
    Cell next{};
    Evaluation e;
    take_cracks(static_cast<std::size_t>(i));
    evaluate(geometry_[i], {.u = u}, old_[i], next, e);
    points_.add_forces(geometry_[i], e.at, e.answer.stress, finite_, f);
  }

  void accept() override {
    if (accepted_ == evaluation_) return;  // nothing new; what was next is older now
    old_.swap(next_);
    accepted_ = evaluation_;
  }

  std::vector<int> spent(const Spent& when, const std::vector<char>& kept) const override {
    std::vector<int> list;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (!own(cells_[i])) continue;
      const LawResult& r = result_[i];
      const bool holds = !kept.empty() && kept[cells_[i]];
      bool empty = !holds && (r.volume - 1) * std::cbrt(geometry_[i].volume) > when.opening;
      for (int q = 0; q < 8 && empty; ++q)
        empty = at_cap(H::tension(next_[i], q)) && at_cap(H::compression(next_[i], q));
      if (empty || r.least_volume < when.flat || (!holds && r.largest_strain > when.torn))
        list.push_back(cells_[i]);
    }
    return list;
  }

  bool cracked_through(int cell) const override { return at_cap(tension_least(cell)); }

  double tension(int cell) const override {
    return over_points(
        cell, [](const Cell& c, int q) { return H::tension(c, q); },
        [](double a, double b) { return std::max(a, b); });
  }
  double tension_least(int cell) const override {
    return over_points(
        cell, [](const Cell& c, int q) { return H::tension(c, q); },
        [](double a, double b) { return std::min(a, b); });
  }
  double compression(int cell) const override {
    return over_points(
        cell, [](const Cell& c, int q) { return H::compression(c, q); },
        [](double a, double b) { return std::max(a, b); });
  }

  double crack_width(int cell, const double* u) const override {
    if (tension(cell) == 0) return 0;
    const int i = slot_[cell];
    take_cracks(static_cast<std::size_t>(i));
    const LawGeometry& g = geometry_[i];
    PointStrains at;
    points_.strains(g, u, finite_, at);
    double stress[6][8], energy[8], dissipation[8];
    Cell next = old_[i];
    law_.stress8(&at.strain[0][0], nullptr, g.frame, H::in(old_[i]), H::in(next), &stress[0][0], energy,
                 dissipation);
    material::Sym strain{}, mean{};
    double band = 0;
    for (int q = 0; q < 8; ++q) {
      band = std::max(band, H::band(law_, old_[i], q));
      for (int k = 0; k < 6; ++k) strain[k] += 0.125 * at.strain[k][q], mean[k] += 0.125 * stress[k][q];
    }
    const material::Concrete& c = law_.parameters().concrete;
    return material::crack_width(band, strain, mean, c.young, c.poisson);
  }

  std::size_t memory_consumption() const override {
    return (slot_.capacity() + cells_.capacity()) * sizeof(int) + joined_.capacity() * sizeof(long) +
           geometry_.size() * sizeof(LawGeometry) + (old_.size() + next_.size()) * sizeof(Cell) +
           result_.capacity() * sizeof(LawResult);
  }

 protected:
  std::size_t width() const override { return cell_width; }
  const double* numbers(std::size_t i) const override { return reinterpret_cast<const double*>(&old_[i]); }

  void append(int cell, long joined, const double* numbers) override {
    Cell d;
    std::memcpy(static_cast<void*>(&d), numbers, sizeof d);
    slot_[cell] = static_cast<int>(cells_.size());
    cells_.push_back(cell);
    joined_.push_back(joined);
    geometry_.push_back(law_geometry(*mesh_, cell, law_.parameters().concrete.poisson));
    old_.push_back(d);
    next_.push_back(d);
    result_.emplace_back();
  }

  void remove_if(const std::function<bool(int)>& gone) override {
    // Keep the order of joining: sums over the cells stay in one order.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const int cell = cells_[i];
      slot_[cell] = gone(cell) ? -1 : static_cast<int>(kept);
      if (slot_[cell] < 0) continue;
      if (kept != i)
        cells_[kept] = cell, joined_[kept] = joined_[i], geometry_[kept] = geometry_[i], old_[kept] = old_[i],
        next_[kept] = next_[i], result_[kept] = result_[i];
      ++kept;
    }
    cells_.resize(kept), joined_.resize(kept), geometry_.resize(kept), old_.resize(kept), next_.resize(kept),
        result_.resize(kept);
  }

 private:
  /// Working space of one cell.
  struct Evaluation {
    PointStrains at;
    Answer answer;
  };

  /// The strain rates, found when the law asks for them.
  struct RatesOf final : material::StrainRates {
    const FieldOf& field;
    const LawGeometry& g;
    const PointStrains& at;
    const double* v;
    bool found = false;
    alignas(64) double rate[6][8];
    RatesOf(const FieldOf& f, const LawGeometry& geometry, const PointStrains& strains,
            const double* velocities)
        : field(f), g(geometry), at(strains), v(velocities) {}
    const double* at_points() override {
      if (!found) field.points_.rates(g, at, v, field.finite_, rate);
      found = true;
      return &rate[0][0];
    }
  };

  LawResult evaluate(const LawGeometry& g, const Motion& motion, const Cell& old, Cell& next,
                     Evaluation& e) const {
    points_.strains(g, motion.u, finite_, e.at);
    RatesOf rates_there(*this, g, e.at, motion.v);
    material::StrainRates* const rates = motion.v && motion.rate_effect ? &rates_there : nullptr;
    Answer& a = e.answer;
    LawResult result;
    result.grew = law_.stress8(&e.at.strain[0][0], rates, g.frame, H::in(old), H::in(next), &a.stress[0][0],
                               a.energy, a.dissipation);
    result.largest_strain = e.at.largest;
    find_volume(e.at, result);
    if (result.grew && motion.v && motion.step > 0 &&
        points_.largest_way(g, motion.v, motion.step) > path_increment * peak_strain_) {
      alignas(64) double before[6][8], way[6][8];
      points_.before(g, e.at, motion.v, motion.step, finite_, before, way);
      if (path_share(before, way) < 1) follow(g, before, way, rates, old, next, a);
    }
    if constexpr (H::crushes)
      if (result.grew) carry_crushed(g, motion.u, e.at, next);
    result.energy = g.volume * mean_of(a.energy);
    result.dissipation = g.volume * mean_of(a.dissipation);
    return result;
  }

  /// A crack that grows takes assumed lateral strains away at once, without any motion: what crushed concrete
  /// stores would change by no work.
  void carry_crushed(const LawGeometry& g, const double* u, const PointStrains& before, Cell& next) const {
    LawGeometry cracked = g;
    bool grew = false, any_crushed = false;
    for (int q = 0; q < 8; ++q) {
      cracked.assumed.lateral[q] = 1 - H::tension(next, q);
      grew = grew || cracked.assumed.lateral[q] != g.assumed.lateral[q];
      any_crushed = any_crushed || H::compression(next, q) > 0;
    }
    if (!grew || !any_crushed) return;
    PointStrains after;
    points_.strains(cracked, u, finite_, after);
    for (int q = 0; q < 8; ++q) {
      if (!(H::compression(next, q) > 0)) continue;
      double change[6];
      for (int k = 0; k < 6; ++k) change[k] = after.strain[k][q] - before.strain[k][q];
      H::carry(next, q, change);
    }
  }

  bool at_cap(double damage) const { return damage >= Law::cap * (1 - 1e-12); }

  /// det F over the points; while strains are small 1 and the trace of the strain will do.
  static void find_volume(const PointStrains& at, LawResult& result) {
    constexpr double small = 0.05;
    result.volume = result.least_volume = 1 + at.dilation;
    if (at.largest < small) return;
    result.volume = 0, result.least_volume = std::numeric_limits<double>::infinity();
    for (int q = 0; q < 8; ++q) {
      Mat3 f = Mat3::Identity();
      for (int k = 0; k < 9; ++k) f(k / 3, k % 3) += at.displacement_gradient[k][q];
      const double j = f.determinant();
      result.volume += j / 8, result.least_volume = std::min(result.least_volume, j);
    }
  }

  /// Lateral strains by the accepted damage.
  void take_cracks(std::size_t i) const {
    for (int q = 0; q < 8; ++q) geometry_[i].assumed.lateral[q] = 1 - H::tension(old_[i], q);
  }

  double path_share(const PointTensors& strain, const PointTensors& way) const {
    return points_.path_share(strain, way, peak_strain_, path_increment);
  }

  /// The law along the straight path `way` from the strain before; the stress as in damage_field.hpp, the
  /// dissipation of the whole path.
  void follow(const LawGeometry& g, const PointTensors& before, const PointTensors& way,
              material::StrainRates* rates, const Cell& old, Cell& next, Answer& out) const {
    alignas(64) double strain[6][8], missed[6][8], lost[8] = {};
    std::memcpy(strain, before, sizeof strain);
    Cell state = old;
    Answer last;
    law_.stress8(&strain[0][0], rates, g.frame, H::in(old), H::in(state), &last.stress[0][0], last.energy,
                 last.dissipation);
    for (int k = 0; k < 6; ++k)
      for (int q = 0; q < 8; ++q) missed[k][q] = -0.5 * last.stress[k][q];
    for (double gone = 0; gone < 1;) {
      const double wanted = path_share(strain, way), share = std::min(wanted, 1 - gone);
      gone = wanted < 1 - gone ? gone + share : 1;
      for (int k = 0; k < 6; ++k)
        for (int q = 0; q < 8; ++q) strain[k][q] = before[k][q] + gone * way[k][q];
      law_.stress8(&strain[0][0], rates, g.frame, H::in(state), H::in(state), &out.stress[0][0], out.energy,
                   out.dissipation);
      for (int q = 0; q < 8; ++q) {
        lost[q] += out.dissipation[q];
        add_mean_stress(last, out, way, q, share, missed);
      }
      last = out;
    }
    for (int q = 0; q < 8; ++q) out.dissipation[q] = lost[q];
    for (int k = 0; k < 6; ++k)
      for (int q = 0; q < 8; ++q) out.stress[k][q] += missed[k][q] - 0.5 * last.stress[k][q];
    next = state;
  }

  template <class Read, class Pick>
  double over_points(int cell, Read read, Pick pick) const {
    if (slot_[cell] < 0) return 0;
    const Cell& c = old_[slot_[cell]];
    double value = read(c, 0);
    for (int q = 1; q < 8; ++q) value = pick(value, read(c, q));
    return value;
  }

  Law law_;
  const LawPoints& points_ = law_points();
  double peak_strain_;
  std::deque<Cell> old_, next_;
};

template <class Law>
std::unique_ptr<DamageField> field_of(const HexMesh& mesh, const material::Concrete& concrete,
                                      bool rate_effect, bool finite, const material::CellSize& largest_cell,
                                      const char* formula, const std::string& key) {
  typename Law::Parameters p;
  p.concrete = concrete;
  p.rate_effect = rate_effect;
  if constexpr (requires { p.aggregate; }) p.aggregate = concrete.aggregate;
  const Law law(p);
  material::check_cell_size(law.largest_cell(), formula, largest_cell, key);
  return std::make_unique<FieldOf<Law>>(mesh, law, finite);
}

}  // namespace

void DamageField::restrict_to(Partition& partition) {
  partition_ = &partition;
  remove_if([&](int cell) { return !partition.local_cells()[cell]; });
}

std::vector<int> DamageField::drop_unaccepted() {
  const std::vector<int> gone(cells_.begin() + static_cast<std::ptrdiff_t>(accepted_count()), cells_.end());
  if (!gone.empty()) remove_if([&](int cell) { return joined_[slot_[cell]] > accepted_; });
  return gone;
}

std::size_t DamageField::save_size() const { return 2 + accepted_count() * (2 + width()); }

void DamageField::save(std::vector<double>& state, bool here) const {
  const std::size_t count = accepted_count();
  const auto write = [&](std::vector<double>& to, std::size_t i, bool joined) {
    const int cell = partition_ != nullptr ? partition_->whole_cell(cells_[i]) : cells_[i];
    if (joined) to.push_back(static_cast<double>(joined_[i]));
    to.push_back(static_cast<double>(cell));
    to.insert(to.end(), numbers(i), numbers(i) + width());
  };
  if (here || partition_ == nullptr) {
    state.push_back(static_cast<double>(count));
    if (here) state.push_back(static_cast<double>(accepted_));
    for (std::size_t i = 0; i < count; ++i) write(state, i, here);
    return;
  }
  std::vector<double> records;
  records.reserve(save_size());
  for (std::size_t i = 0; i < count; ++i)
    if (own(cells_[i])) write(records, i, true);
  records = partition_->collect_at_first(records);
  const std::size_t length = 2 + width();  // when it joined, cell, history
  std::vector<const double*> order;
  for (std::size_t at = 0; at < records.size(); at += length) order.push_back(&records[at]);
  std::sort(order.begin(), order.end(),
            [](const double* a, const double* b) { return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1]; });
  state.reserve(state.size() + 1 + records.size());
  state.push_back(static_cast<double>(order.size()));
  for (const double* record : order) state.insert(state.end(), record + 1, record + length);
}

void DamageField::restore(StateReader& state, bool here) {
  remove_if([](int) { return true; });
  const std::size_t count = state.count();
  const long accepted = static_cast<long>(here ? state.next() : static_cast<double>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const long joined = static_cast<long>(here ? state.next() : static_cast<double>(i));
    const double* const record = state.take(1 + width());
    if (const int cell = this->here(static_cast<int>(record[0])); cell >= 0) append(cell, joined, record + 1);
  }
  evaluation_ = accepted_ = accepted;
}

void DamageField::take_over(const DamageField& before, const std::vector<int>& same) {
  remove_if([](int) { return true; });
  for (std::size_t i = 0; i < before.accepted_count(); ++i)
    append(same[static_cast<std::size_t>(before.cells_[i])], before.joined_[i], before.numbers(i));
  evaluation_ = accepted_ = before.accepted_;
}

double DamageField::stored() const {
  double sum = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (own(cells_[i])) sum += result_[i].energy;
  return sum;
}
double DamageField::dissipation() const {
  double sum = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (own(cells_[i])) sum += result_[i].dissipation;
  return sum;
}

std::unique_ptr<DamageField> make_damage_field(const std::string& law, const HexMesh& mesh,
                                               const material::Concrete& concrete, bool rate_effect,
                                               bool finite, const material::CellSize& largest_cell,
                                               const std::string& key) {
  if (law == "concrete-cdpm2")
    return field_of<Cdpm2>(mesh, concrete, rate_effect, finite, largest_cell, "E G_F / f_t^2", key);
  return field_of<ConcreteDamage>(mesh, concrete, rate_effect, finite, largest_cell, "2 E G_F / f_t^2", key);
}

}  // namespace talus::fem

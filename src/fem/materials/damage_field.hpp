/// The cells in which concrete may damage: strains at eight points, the law, forces, erosion.
///
///   eps_q of the Green-Lagrange strains E as assumed_strain.hpp says, as in the elastic kernel;
///         each point stands for an eighth of the volume
///   f_a = sum_q F_q S_q grad N_a,   S: the transpose of that, of the stresses (law_points.hpp)
///
/// A cell enters when its law is first evaluated to grow; before, it is elastic and keeps no history. States
/// are evaluated from the last accepted ones into the next; accept() makes them the accepted ones, so that a
/// rejected step leaves no trace.
///
/// A cell may strain by many times its peak strain within one sub-step. The work of nodal forces is the
/// trapezoid between the steps, which then has little to do with the area under the stress. Where damage
/// grows fast the law is followed along the straight path from the strain before, and the force carries,
/// beside the stress at the end, what the trapezoid of the ends has missed of the mean:
///   F = sigma_1 + (<sigma> - (sigma_0 + sigma_1) / 2)
/// At a steady rate forces then do exactly the work that the law stores and dissipates; for a linear law, and
/// to second order in the step, it is sigma_1.
///
/// The laws: material::ConcreteDamage ("concrete") and material::Cdpm2 ("concrete-cdpm2").
#pragma once
#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fem/discretisation/partition.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/kernels/kernel.hpp"
#include "fem/kernels/law_points.hpp"
#include "fem/state_reader.hpp"

namespace talus::fem {

/// What the cells of a field are evaluated at, nodes x 4. Without velocities, or with a last step of 0,
/// nothing is known of the way there.
struct Motion {
  const double* u = nullptr;  // [m]
  const double* v = nullptr;  // over the last step [m/s]
  double step = 0;            // the last one [s]
  bool rate_effect = false;   // the law sees the strain rate
};

/// What one evaluation of a cell says.
struct LawResult {
  double energy = 0, dissipation = 0;   // [J]
  double largest_strain = 0;            // Frobenius norm, a bound on the principal values
  double volume = 1, least_volume = 1;  // det F, mean and least over the points
  bool grew = false;
};

class DamageField {
 public:
  virtual ~DamageField() = default;

  /// Keeps from now on only the histories of local cells; sums and lists are those of own cells, saved states
  /// number cells in the whole mesh. The partition must outlive the field.
  void restrict_to(Partition& partition);

  /// Within these no point of a cell without history can start to damage.
  virtual ElasticLimits elastic_limits() const = 0;
  bool has(int cell) const { return slot_[cell] >= 0; }
  const std::vector<int>& cells() const { return cells_; }

  /// Evaluates a cell that has no history; if damage would start, it joins with its force added to f, and
  /// true is returned.
  virtual bool try_cell(int cell, const Motion& motion, double* f) = 0;
  /// Adds the forces of all cells that were in before; results are kept for accept().
  virtual void add_forces(const Motion& motion, double* f) = 0;
  /// Adds the force of a cell with history at u, from the accepted states, to the nodes x 4; nothing is kept.
  virtual void add_force_of(int cell, const double* u, double* f) const = 0;
  virtual void accept() = 0;
  /// Forgets the cells that joined since accept(), and returns them: an evaluation starts from accepted
  /// histories alone, so that its bits do not depend on how often the state has been asked for its forces
  /// before.
  std::vector<int> drop_unaccepted();
  /// When a cell has nothing left to carry, or is no solid any more.
  struct Spent {
    double flat;     // least det F of a solid
    double torn;     // largest strain (Frobenius norm)
    double opening;  // by volume, (det F - 1) V^(1/3), of a cell that is at the cap at all points both in
                     // tension and in compression [m]
  };
  /// Own cells to erode by the last evaluation, in any order; `kept` cells (hosts of bars that hold) only
  /// where they are flat.
  virtual std::vector<int> spent(const Spent& when, const std::vector<char>& kept) const = 0;
  /// Whether all points of a cell are at the cap in tension, accepted states.
  virtual bool cracked_through(int cell) const = 0;
  void remove(int cell) {
    if (has(cell)) remove_if([cell](int c) { return c == cell; });
  }

  double stored() const;       // of the last evaluation, own cells [J]
  double dissipation() const;  // of the last evaluation, since the last accepted states, own cells [J]
  const LawResult& result(int cell) const { return result_[slot_[cell]]; }  // of the last evaluation
  /// Damage over the points of a cell, accepted states; zero without history.
  virtual double tension(int cell) const = 0;  // largest
  virtual double tension_least(int cell) const = 0;
  virtual double compression(int cell) const = 0;  // largest
  /// Crack band width times the largest principal value of the cell's mean inelastic strain at u; zero
  /// without damage in tension [m].
  virtual double crack_width(int cell, const double* u) const = 0;

  /// Accepted histories; a cell that joined since then is left out: it joins again, with the same bits in the
  /// forces. `here`: all that is held here, and when it joined, for this process alone; else those of all
  /// ranks, on the first, in the order in which cells joined.
  void save(std::vector<double>& state, bool here) const;
  std::size_t save_size() const;  // numbers that save() appends of what is held here, at most
  void restore(StateReader& state, bool here);
  /// The accepted histories of a field on another mesh, of the cells that are `same[cell]` of this one; all
  /// on one process.
  void take_over(const DamageField& before, const std::vector<int>& same);
  virtual std::size_t memory_consumption() const = 0;  // [bytes]

 protected:
  virtual std::size_t width() const = 0;  // numbers of one history
  virtual const double* numbers(std::size_t i) const = 0;
  virtual void append(int cell, long joined, const double* numbers) = 0;  // an accepted history
  /// -1: not computed here.
  int here(int whole) const {
    if (partition_ == nullptr) return whole;
    const int cell = partition_->cell_here(whole);
    return cell >= 0 && partition_->local_cells()[cell] ? cell : -1;
  }
  virtual void remove_if(const std::function<bool(int)>& gone) = 0;
  std::size_t accepted_count() const {
    return static_cast<std::size_t>(std::upper_bound(joined_.begin(), joined_.end(), accepted_) -
                                    joined_.begin());
  }
  bool own(int cell) const { return partition_ == nullptr || partition_->owns_cell(cell); }
  DamageField(const HexMesh& mesh, bool finite)
      : mesh_(&mesh), finite_(finite), slot_(mesh.hexes.size(), -1) {}

  const HexMesh* mesh_;
  bool finite_;
  std::vector<int> slot_;               // per cell, -1: no history
  std::vector<int> cells_;              // in the order of joining
  std::vector<long> joined_;            // at which evaluation; in one and the same, cells are ascending
  long evaluation_ = 0, accepted_ = 0;  // the present one; the last whose states were accepted
  Partition* partition_ = nullptr;      // null: all cells are here
  // Of some kB a cell: in a deque what joins moves nothing and leaves no room unused. With the lateral
  // strains that the accepted damage leaves:
  mutable std::deque<LawGeometry> geometry_;
  std::vector<LawResult> result_;
};

/// The field of a structure's law. `finite`: Green-Lagrange strains. Throws InputError if a cell
/// (largest_cell: the longest edge and the longest diagonal in the mesh [m]) would snap back; `key` stands in
/// the message.
std::unique_ptr<DamageField> make_damage_field(const std::string& law, const HexMesh& mesh,
                                               const material::Concrete& concrete, bool rate_effect,
                                               bool finite, const material::CellSize& largest_cell,
                                               const std::string& key);

}  // namespace talus::fem

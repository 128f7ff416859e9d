/// The reinforcement of a structure: bars from file and by rule, their state, and their forces on the nodes.
#pragma once
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/discretisation/partition.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/rebar/rebar_dowel.hpp"
#include "fem/rebar/rebar_slip.hpp"
#include "fem/setup.hpp"
#include "fem/state_reader.hpp"

namespace talus::fem {

class Bars {
 public:
  /// Reads and cuts the bars of the specification; `warn` is told of bars that end short of a support. Throws
  /// InputError for bars outside the concrete.
  Bars(const StructureSpec& spec, const HexMesh& mesh, const Supports& supports,
       std::vector<rebar::Member> members, const std::function<void(const std::string&)>& warn);
  Bars(const Bars&) = delete;  // the bond points into the bars
  Bars& operator=(const Bars&) = delete;

  /// f += internal forces at displacement u; h: time since the accepted states [s]. The new states wait for
  /// accept().
  void add_forces(const double* u, double h, const std::vector<char>& live, double* f);
  void accept();
  /// Puts dowels where cracks have come to cross bars by the last evaluation of the concrete, at displacement
  /// u.
  void see_cracks(const DamageField& damage, const double* u, const std::vector<char>& live);
  /// To be called once cells have gone or come back, before the next forces.
  void cells_changed() { carrying_stale_ = true; }
  /// Of several ranks each keeps from now on the segments in its local cells, by the numbers of cells and
  /// nodes in its part of the mesh, `mesh`; sums are those of own cells. With bond slip a bar is one piece:
  /// whoever has a segment of it computes its slips from the strains of all, and counts its bond if the first
  /// segment is its own. All ranks call together, with add_forces() and what is said to ask the others.
  /// `around`: of surroundings().
  std::shared_ptr<const rebar::Surroundings> surroundings(const Partition& partition,
                                                          const HexMesh& whole) const;
  void divide(Partition& partition, const HexMesh& mesh, std::shared_ptr<const rebar::Surroundings> around);
  void mark_nodes(std::vector<char>& touched) const;
  void add_mass(double density, std::vector<double>& mass) const;

  double stored() const { return sums_.energy + bond_.energy + dowel_sums_.energy; }
  double dissipation() const { return sums_.dissipation + bond_.dissipation + dowel_sums_.dissipation; }
  /// What the segments in these cells store by the last evaluation, this rank's part [J].
  double stored_in(const std::vector<int>& cells) const;
  /// Segments that the last evaluation breaks, in local cells.
  double breaking() const { return sums_.breaking; }
  /// To be called once any rank's have broken and are accepted: asks the others which.
  void find_broken();
  bool slips() const { return slip_ != nullptr; }
  std::size_t segments() const { return bars_.segments().size(); }  ///< on this rank
  std::size_t segments_in_all() const { return segments_in_all_; }
  std::size_t count() const { return bars_.bars().size(); }
  int host(std::size_t segment) const { return bars_.segments()[segment].cell; }  ///< -1: not here
  double steel_volume() const { return steel_volume_; }
  std::size_t memory_consumption() const;  ///< [bytes]
  /// Axial stiffness of every segment, unstrained, between the nodes of its host, turned with the frames of
  /// the cells where these are given.
  std::vector<Spring> springs(const std::vector<Mat3>* frames = nullptr) const;
  const std::vector<rebar::Bar>& list() const { return bars_.bars(); }
  /// Segments hosted by the given cells, ascending.
  std::vector<int> segments_in(const std::vector<int>& cells) const;
  /// f += forces of these segments at u (in live cells), from the accepted states; nothing is kept.
  void add_forces_of(const std::vector<int>& segments, const double* u, const std::vector<char>& live,
                     double* f) const;
  /// Number of bars that have yielded, and that are broken, among these segments; asks the others.
  struct Counts {
    int yielded = 0, broken = 0;
  };
  Counts count(const std::vector<int>& segments) const;
  /// Calls with the number of every pair of cells that an unbroken bar holds together, the same on all ranks,
  /// and those of the two that are in this rank's part; -1: it is not.
  void ties(const std::function<void(int, int, int)>& visit) const;
  /// Of each of so many cells, whether an unbroken bar holds it to another.
  const std::vector<char>& tied(std::size_t cells) const;
  void shape(const Structure::TakePart& take) const;  ///< of the whole; asks the others
  void values(const double* u, const Structure::TakePart& take) const;
  /// `here`: what this rank holds; else the whole, on the first rank, for any number of them.
  void save(std::vector<double>& state, bool here) const;
  void restore(StateReader& state, bool here);

 private:
  bool own(std::size_t segment) const {
    return partition_ == nullptr || (host(segment) >= 0 && partition_->owns_cell(host(segment)));
  }
  bool starts(int number) const { return std::binary_search(first_.begin(), first_.end(), number); }
  int number(std::size_t segment) const {
    return partition_ == nullptr ? static_cast<int>(segment) : number_[segment];
  }
  void place(const HexMesh& mesh, std::shared_ptr<const rebar::Surroundings> around);
  void share_strains(const std::vector<char>& live);
  std::size_t state_width() const { return 6 + (slip_ ? rebar::SlipField::record_width : 0); }
  rebar::EmbeddedBars bars_;
  std::vector<int> node_;  // the nodes of hosts, ascending
  std::vector<material::Steel::State> old_,
      next_;                  // accepted; by the last evaluation, apart from them only at changed_
  std::vector<int> changed_;  // segments whose state the last evaluation changes
  std::vector<double> old_strain_, next_strain_;
  double slip_strain(std::size_t segment) const { return slip_ ? slip_->strain()[segment] : 0.0; }
  bool evaluated_ = false;                        // since the last accept()
  mutable std::vector<std::array<int, 3>> ties_;  // what ties() says
  mutable std::vector<char> tied_;  // of each cell, whether it is in one of them; empty: to be found
  mutable bool ties_stale_ = true;
  rebar::EmbeddedBars::Sums sums_;
  std::unique_ptr<rebar::SlipField> slip_;  // null: perfect bond
  rebar::SlipField::Sums bond_;
  std::unique_ptr<rebar::DowelField> dowels_;  // null: bars carry no shear
  rebar::DowelField::Sums dowel_sums_;         // of this rank's own cells
  double steel_stress(std::size_t segment, const material::Steel::State& state, double strain) const;
  std::vector<double> host_;
  double f_cm_ = 0, dowel_strength_ = 0, dowel_opening_ = 0;  // [Pa]; [Pa], 0: no dowels; [m]
  double steel_volume_ = 0;
  std::size_t segments_in_all_ = 0;
  std::vector<int> first_;   // of the whole, the first segment of each bar; ascending
  std::vector<int> broken_;  // segments, of all ranks by their numbers in the whole, ascending
  // Several ranks
  Partition* partition_ = nullptr;  // null: all segments here
  std::vector<int> number_;         // of each segment here, in the whole; ascending
  std::vector<int> heard_;  // of the whole, segments of which some rank asks for the strain; ascending
  void find_carrying(const std::vector<char>& live);
  std::vector<int> carrying_;  // segments in live cells: those that are computed. Of a broken viaduct few
  bool carrying_stale_ = true;
};

}  // namespace talus::fem

/// The reinforcement of a structure: bars from file and by rule, their state, and their forces on the nodes.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/rebar/bar_division.hpp"
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

  /// The bars on the whole mesh, their segments in this rank's part of it.
  const rebar::EmbeddedBars& embedded() const { return bars_; }
  const BarDivision& division() const { return division_; }
  const BarTies& ties() const { return ties_; }

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

  double stored() const { return sums_.energy; }  ///< by the last evaluation [J]
  double dissipation() const { return sums_.dissipation; }
  /// What the segments in these cells store by the last evaluation, this rank's part [J].
  double stored_in(const std::vector<int>& cells) const;
  /// Segments that the last evaluation breaks, in local cells.
  double breaking() const { return sums_.breaking; }
  /// To be called once any rank's have broken and are accepted: asks the others which.
  void find_broken() { ties_.find_broken(states_.old); }
  bool slips() const { return slip_ != nullptr; }
  std::size_t memory_consumption() const;  ///< [bytes]
  /// f += forces of these segments at u (in live cells), from the accepted states; nothing is kept.
  void add_forces_of(const std::vector<int>& segments, const double* u, const std::vector<char>& live,
                     double* f) const;
  /// Number of bars that have yielded, and that are broken, among these segments; asks the others.
  struct Counts {
    int yielded = 0, broken = 0;
  };
  Counts count(const std::vector<int>& segments) const;
  /// Of the whole; asks the others.
  void values(const double* u, const Structure::TakePart& take) const;
  /// `here`: what this rank holds; else the whole, on the first rank, for any number of them.
  void save(std::vector<double>& state, bool here) const;
  void restore(StateReader& state, bool here);
  bool yielded() const;  ///< any of the segments here
  /// The states of the same bars in larger cells, each segment those of the one that it is a part of; dowels
  /// stand in cells that are the same. With perfect bond, on one process.
  void take_over(const Bars& before);

 private:
  int host(std::size_t segment) const { return bars_.segments()[segment].cell; }  // -1: not here
  void place(const HexMesh& mesh, std::shared_ptr<const rebar::Surroundings> around);
  void share_strains(const std::vector<char>& live);
  void find_carrying(const std::vector<char>& live);
  std::size_t state_width() const { return 6 + (slip_ ? rebar::SlipField::record_width : 0); }

  rebar::EmbeddedBars bars_;
  BarDivision division_;
  BarTies ties_{bars_, division_};
  /// Of every segment: accepted, and by the last evaluation, apart from the accepted ones only at `changed`.
  struct States {
    std::vector<material::Steel::State> old, next;
    std::vector<double> old_strain, next_strain;
    std::vector<int> changed;
    bool evaluated = false;  // since the last accept()
    void back_to_accepted() { next = old, next_strain = old_strain, changed.clear(); }
  };
  States states_;
  std::unique_ptr<rebar::SlipField> slip_;     // null: perfect bond
  std::unique_ptr<rebar::DowelField> dowels_;  // null: bars carry no shear
  struct Sums {
    double energy = 0, dissipation = 0, breaking = 0;
  };
  Sums sums_;  // of the last evaluation
  std::vector<double> host_;
  struct Bond {
    double f_cm = 0, dowel_strength = 0, dowel_opening = 0;
  };  // [Pa], 0: perfect; [Pa], 0: no dowels; [m]
  Bond law_;
  std::vector<int> heard_;     // of the whole, segments of which some rank asks for the strain; ascending
  std::vector<int> carrying_;  // segments in live cells: those that are computed. Of a broken viaduct few
  bool carrying_stale_ = true;
};

/// Axial stiffness of every segment, unstrained, between the nodes of its host, turned with the frames of the
/// cells where these are given.
std::vector<Spring> springs_of(const rebar::EmbeddedBars& bars, const std::vector<Mat3>* frames = nullptr);

}  // namespace talus::fem

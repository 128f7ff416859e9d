/// One sub-step of the 1988 scheme: Eq. (9) set up at its start, the open-close iteration, and what is kept
/// of it.
///
///   (2 M / h^2 + K) D = 2 M Ddot_0 / h + F,   Ddot = 2 D / h - Ddot_0
///   Eqs. (5) to (8)
///
/// h: length of the sub-step [s]. Tries at it change nothing of the state; commit() does.
#pragma once
#include <vector>

#include "dda/shi1988.hpp"
#include "dda/shi1988_contacts.hpp"
#include "dda/shi1988_system.hpp"

namespace talus::dda::shi1988 {

/// Everything that is derived at the start of a sub-step and used by the tries at it.
class SubStep {
 public:
  SubStep(const Surroundings& s, const Shi1988Settings& settings, State& state, Shi1988State& history,
          Shi1988Report& report);

  /// Margin of the contact search: twice the largest displacement that the velocities foretell, from where
  /// bonds have been drawn to.
  double margin(double h) const;
  /// Widest gap that a bond holds [m].
  double drawn() const;
  /// Lists the contacts with gaps up to `margin` [m] and finds the islands that they join.
  void find_contacts(double margin);
  /// The open-close iteration. True if it settled within the cap.
  bool iterate(double h);
  /// Largest displacement of any vertex, bounded by the block's radius.
  double largest_displacement() const;
  /// A block that the step would turn inside out, -1 if none.
  int inverted() const;
  /// Takes the last try over into state, history and report.
  void commit(double h);

 private:
  /// Of the springs that hold a block's fixed points [N/m].
  double fixed_point_stiffness(const Model::Block& b) const;
  /// Matrices without contact, Eqs. (5) to (8).
  void prepare(double h);
  /// Eq. (9) of one island with its contacts as they are.
  void solve(int island, double h);
  /// Energies of the contact springs and the work they did, each from force and displacement.
  void book_contacts(double h);
  /// Of the springs at the fixed points of block i [J].
  double fixed_energy_at_start(int i) const;
  /// Books what the springs of the fixed points lost; returns their energy at the end of the step.
  double book_fixed_points(int i);

  Surroundings s_;
  const Shi1988Settings& settings_;
  State& state_;
  Shi1988State& history_;
  Shi1988Report& report_;
  int n_;
  std::vector<Mat12> M_, base_;
  std::vector<Vec12> v0_, base_force_, D_;
  ContactList contacts_;
  BlockSystem system_;
  std::vector<std::vector<std::size_t>> island_contacts_;
};

}  // namespace talus::dda::shi1988

/// Factors of condensed steps, and the compliance of nodes by them:
///
///   A = (1 + alpha h/2) M + h^2 theta^2 K = scale (K + shift M),   W = J A^-1 J^T,   theta = 1/2 + delta
///
/// K is the stiffness of the cells that are left, turned with them, and of cracked ones the most that they
/// may have: nothing is stiffer. W is made of halves of the solutions, W_ij = y_i . y_j with y_i = L^-1 P
/// e_i, A = scale P^T L L^T P: of a node of the skin y is zero but for the way from its place in the
/// elimination tree to the root, a small part of the whole.
///
/// symbol   meaning                                            unit    shape
/// h        length of the step                                 s
/// theta    weight of the velocities at the end of the step
/// delta    numerical damping, where there is any; falls with h^2
/// T        of each cell in K, T K_e T^T: its rotation, and the root of how much stiffer it may be     3 x 3
#pragma once
#include <array>
#include <memory>
#include <unordered_map>

#include "fem/members/stresses.hpp"
#include "fem/state_reader.hpp"

namespace talus::fem {

class CondensedFactors {
 public:
  CondensedFactors(StructureBody& body, const Stresses& stresses) : body_(body), stresses_(stresses) {}

  /// Whether there may be any, by what the structure is and what was asked for.
  bool possible() const;
  /// Of the undamaged structure [rad/s]; negative: it has none, or moves freely.
  double lowest_frequency() const;
  /// K follows where cells have turned or cracked.
  void follow_frames();

  /// A of a step of length h is from now on the one in use; `euler`: that of backward Euler, theta = 1.
  /// Throws NumericalFailure where it has no factor.
  void use(double h, bool euler);
  void begin_step() { ++step_; }  ///< columns that were asked for before it may be dropped
  double theta() const { return levels_.back()->theta; }
  double scale() const { return levels_.back()->scale; }
  const SymmetricMatrix& stiffness() const;  ///< K
  const std::vector<double>& mass() const {
    return mass_;
  }  ///< per free degree of freedom; 1 where none is left
  const std::vector<char>& moves() const {
    return moves_;
  }  ///< of each degree of freedom, whether it has mass
  void solve(const VecX& b, VecX& x) const {
    levels_.back()->factor.solve(b.data(), x.data());
  }  ///< by A / scale
  /// W of these nodes, 3m x 3m, zero where held [1/kg].
  MatX compliance(std::span<const int> nodes);
  /// v += A^-1 sum of these impulses.
  void push(std::span<const NodeImpulse> impulses, VecX& v);

  /// They are made again when asked for.
  void drop();
  double memory() const;  ///< [bytes]
  void save(std::vector<double>& state) const;
  void restore(StateReader& state);

 private:
  struct Column {
    std::array<HalfColumn, 3> half;  // of a node's three directions, none of one that is held or has no mass
    std::unordered_map<int, Mat3> with;  // their products with those of nodes of no lower number, of A^-1
    long used = 0;                       // number of the last step that asked for it
    std::size_t bytes() const;
  };
  /// One length of step. All of it follows from the structure and h: what is kept between steps changes no
  /// result.
  struct Level {
    double h = 0;
    CholeskyFactor factor;  // of K + shift M
    double theta = 0.5, scale = 0;
    std::unordered_map<int, Column> column;  // by node
  };
  double stiffest(int cell) const;
  Mat3 frame_of(int cell) const;
  void set_frames(std::vector<Mat3> frames);
  void assemble();
  void find_columns(std::span<const int> nodes);
  void drop_idle_columns();

  StructureBody& body_;
  const Stresses& stresses_;
  SymmetricMatrix stiffness_;           // of the cells that live; empty: the structure's own
  std::vector<std::int64_t> ordering_;  // of its factors
  std::vector<double> mass_;            // empty: all of this is to be made
  std::vector<char> moves_;
  std::vector<std::unique_ptr<Level>> levels_;  // the one in use last
  std::unique_ptr<Level>
      spent_;               // one that is no longer true, whose room and analysis the next one takes over
  long body_revision_ = 0;  // that it is made for
  long step_ = 0;
  std::vector<Mat3> frames_;             // T; empty: 1
  mutable double lowest_frequency_ = 0;  // 0: not asked for yet
};

}  // namespace talus::fem

/// H = 1 + sum J_i^T D_i J_i over the pairs of bodies that touch, and its factor.
///
/// In large problems open contacts (most of a pile's) are left out of the pattern too: it holds the pairs of
/// contacts that are closed now or were not long ago, and is found anew when another pair closes, or once it
/// has become much too large.
#pragma once
#include <cstdint>
#include <vector>

#include "contact/linear/solver_linear.hpp"
#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

class Hessian {
 public:
  BlockLU lu;
  /// Finds the pairs of bodies.
  void prepare(const System& system);
  /// Contacts whose state is open are left out (D = 0); state may be null.
  void assemble(const System& system, const Mat3* derivative, const unsigned char* state);

 private:
  void list(const System& system, const unsigned char* state);
  void assemble_column(const System& system, const Mat3* derivative, const unsigned char* state, int body);

  std::vector<int> sizes_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::pair<std::uint64_t, int>> keys_;  // of runs of contacts with the same bodies
  std::vector<int> place_;                           // of a run's pair
  std::vector<int> pair_of_, first_pair_;            // pair of bodies of every two terms of a contact
  std::vector<std::pair<int, int>> listed_;          // pairs of the pattern
  std::vector<int> in_list_;                         // place of a pair there, negative: none
  bool analysed_ = false;
  std::vector<char> closed_;  // of a pair: one of its contacts is
};

}  // namespace talus::contact::detail

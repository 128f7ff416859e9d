/// H = 1 + sum J_i^T D_i J_i over the pairs of bodies that touch, and its factor.
#pragma once
#include <cstdint>
#include <vector>

#include "contact/solver_linear.hpp"
#include "contact/solver_system.hpp"

namespace talus::contact::detail {

class Hessian {
 public:
  BlockLU lu;
  /// Finds the pairs of bodies and analyses the pattern.
  void prepare(const System& system);
  /// Contacts whose state is open are left out (D = 0); state may be null.
  void assemble(const System& system, const Mat3* derivative, const unsigned char* state);

 private:
  void assemble_column(const System& system, const Mat3* derivative, const unsigned char* state, int body);

  std::vector<int> sizes_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::pair<std::uint64_t, int>> keys_;   // of runs of contacts with the same bodies
  std::vector<int> place_;                            // of a run's pair
  std::vector<int> pair_of_, first_pair_;  // pair of bodies of every two terms of a contact
};

}  // namespace talus::contact::detail

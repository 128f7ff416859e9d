// H = 1 + sum J^T D J of a heap whose contacts open and close: its pattern follows what is closed, and its
// solutions meet the sum written out.
#include <gtest/gtest.h>

#include <random>

#include "contact/linear/solver_hessian.hpp"
#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

using detail::System;

struct Heap {
  Builder b = cubes(12, 12, 6, 0.5, 0.01);  // 720 pairs of cubes
  System system;
  detail::Hessian hessian;
  std::vector<Mat3> D;
  std::vector<unsigned char> state;

  Heap() {
    system.assemble(b.problem, true);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(0, 1);
    for (const detail::Touch& t : system.touch) {
      Mat3 d = Mat3(Vec3(any(random), any(random), any(random)).asDiagonal());
      d(1, 0) =
          0.4 *
          any(random);  // friction couples the tangential to the normal impulse, not the other way round
      D.push_back(100 / t.w * d);
    }
    hessian.prepare(system);
  }
  /// Closes the contacts of pairs whose upper block is below the floor `floor`; all, without asking for
  /// states, if it is negative.
  void close_below(int floor) {
    state.clear();
    if (floor < 0) return;
    for (const detail::Touch& t : system.touch) {
      const double z = b.centre[static_cast<std::size_t>(system.body[static_cast<std::size_t>(
                                    system.terms[static_cast<std::size_t>(t.first + t.count - 1)].body)])]
                           .z();
      state.push_back(z < floor ? detail::closed : detail::open);
    }
  }
  /// Largest entry of H x - f, H applied contact by contact.
  double error() {
    hessian.assemble(system, D.data(), state.empty() ? nullptr : state.data());
    EXPECT_TRUE(hessian.lu.factor());
    std::vector<double> f(static_cast<std::size_t>(system.n));
    for (std::size_t k = 0; k < f.size(); ++k) f[k] = std::sin(0.1 * static_cast<double>(k));
    std::vector<double> x = f;
    hessian.lu.solve(x.data());
    std::vector<double> left = x;
    for (int i = 0; i < system.contacts(); ++i)
      if (state.empty() || state[static_cast<std::size_t>(i)] != detail::open)
        system.push(system.touch[static_cast<std::size_t>(i)],
                    D[static_cast<std::size_t>(i)] *
                        system.relative(system.touch[static_cast<std::size_t>(i)], x.data()),
                    left.data());
    double worst = 0;
    for (std::size_t k = 0; k < f.size(); ++k) worst = std::max(worst, std::abs(left[k] - f[k]));
    return worst;
  }
};

TEST(Hessian, ThePatternFollowsWhatIsClosed) {
  Heap heap;
  std::vector<std::size_t> entries;
  for (const int floor : {-1, 2, 4, 3, 1, -1}) {
    heap.close_below(floor);
    EXPECT_LT(heap.error(), 1e-10) << "floor " << floor;
    entries.push_back(heap.hessian.lu.factor_entries());
  }
  EXPECT_LT(2 * entries[1], entries[0]);  // most are open
  EXPECT_GT(entries[2], entries[1]);      // others have closed
  EXPECT_LT(entries[4], entries[3]);
  EXPECT_EQ(entries[5], entries[0]);  // whatever was before
}

TEST(Hessian, AProblemDoesNotKnowTheOneBefore) {
  Heap heap;
  heap.close_below(5);  // four fifths of the pairs: few enough to go on with the pattern of all
  EXPECT_LT(heap.error(), 1e-10);
  const std::size_t before = heap.hessian.lu.factor_entries();
  heap.close_below(-1);
  EXPECT_LT(heap.error(), 1e-10);
  heap.hessian.prepare(heap.system);
  heap.close_below(5);
  EXPECT_LT(heap.error(), 1e-10);
  EXPECT_EQ(heap.hessian.lu.factor_entries(), before);
}

}  // namespace
}  // namespace talus::contact::testing

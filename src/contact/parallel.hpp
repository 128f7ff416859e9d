/// Loops over many like things on the threads of the task arena that the caller runs in; outside of any
/// arena, on all that there are.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace talus::contact {

namespace detail {
/// One copy of the code for all threads: inlined or cloned copies may fuse multiplications and additions in
/// different places, and round differently.
#if defined(__GNUC__) && !defined(__clang__)
template <class Use>
[[gnu::noipa]] void use_range(Use& use, int first, int last) {
  use(first, last);
}
#else
template <class Use>
[[gnu::noinline]] void use_range(Use& use, int first, int last) {
  use(first, last);
}
#endif

/// What the scheduler orders, told to the thread sanitizer, which does not see into its library: one side
/// hands over, the other takes.
#if defined(__SANITIZE_THREAD__)
inline void hand_over(char& token) { __tsan_release(&token); }
inline void take(char& token) { __tsan_acquire(&token); }
#else
inline void hand_over(char&) {}
inline void take(char&) {}
#endif
}  // namespace detail

/// Calls use(first, last) for ranges that cover [0, n). They hold `grain` at least where there are more than
/// one, and run in any order: what they write may not meet, and no result may depend on where they part. A
/// thread that waits for the others takes no other work meanwhile.
template <class Use>
void in_ranges(int n, int grain, Use&& use) {
  if (n <= 0) return;
  if (n < 2 * grain || tbb::this_task_arena::max_concurrency() < 2) return detail::use_range(use, 0, n);
  char begun = 0, done = 0;
  detail::hand_over(begun);
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(tbb::blocked_range<int>(0, n, grain), [&](const tbb::blocked_range<int>& r) {
      detail::take(begun);
      detail::use_range(use, r.begin(), r.end());
      detail::hand_over(done);
    });
  });
  detail::take(done);
}

}  // namespace talus::contact

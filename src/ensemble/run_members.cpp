// Members in batches, over threads and ranks.
#include <algorithm>
#include <exception>
#include <mutex>
#include <set>
#include <thread>

#include "ensemble/brief.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/precision.hpp"
#include "ensemble/store.hpp"

namespace talus::ensemble {
namespace {

constexpr long batch = 256;  // after which precision is looked at

/// Runs `todo` on threads; what each gives goes to `keep`, one at a time.
void run_on_threads(Ensemble& ensemble, const std::vector<long>& todo, const Run& run,
                    const std::function<void(const Member&)>& keep) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      while (run.stop == nullptr || run.stop->load() == 0) {
        const std::size_t k = next.fetch_add(1);
        if (k >= todo.size()) return;
        const std::optional<Member> member = ensemble.run(todo[k], run.stop);
        if (!member) return;
        const std::lock_guard lock(mutex);
        if (failure) return;
        keep(*member);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = todo.size();
    }
  };
  const auto count = std::min<std::size_t>(static_cast<std::size_t>(std::max(1, run.threads)), todo.size());
  std::vector<std::thread> threads;
  for (std::size_t k = 1; k < count; ++k) threads.emplace_back(work);
  if (count > 0) work();
  for (std::thread& t : threads) t.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

long run_members(Ensemble& ensemble, const Run& run) {
  const long asked = ensemble.design().members(), step = ensemble.settings().precision ? batch : asked;
  Briefs briefs;
  const auto read = [&] {
    briefs.clear();
    each_member(run.directory, ensemble.identity(),
                [&](Member&& m) { briefs[m.index] = brief_of(m, ensemble.lines().size()); });
  };
  run.meet();  // the directory is whole
  read();
  run.meet();  // nobody writes before all have read
  Store store(run.directory, run.rank, ensemble.identity());
  Progress progress;
  for (long from = 0; from < asked; from += step) {
    const long to = std::min(asked, from + step);
    std::vector<long> mine;
    long place = 0;
    for (long i = from; i < to; ++i)
      if (!briefs.contains(i) && place++ % run.ranks == run.rank) mine.push_back(i);
    progress.done = static_cast<long>(
        std::count_if(briefs.begin(), briefs.end(), [&](const auto& b) { return b.first < to; }));
    progress.failed = static_cast<long>(std::count_if(
        briefs.begin(), briefs.end(), [&](const auto& b) { return b.second.status == Status::failed; }));
    // Of several processes each runs its share; what the others do meanwhile is not known here.
    progress.asked = run.ranks > 1 ? progress.done + static_cast<long>(mine.size()) : asked;
    run_on_threads(ensemble, mine, run, [&](const Member& m) {
      store.add(m);
      briefs[m.index] = brief_of(m, ensemble.lines().size());
      ++progress.done;
      progress.failed += m.status == Status::failed ? 1 : 0;
      if (run.progress) run.progress(progress);
    });
    if (run.stop != nullptr && run.stop->load() != 0) return 0;
    if (run.ranks > 1) {
      run.meet();
      read();
      run.meet();
    }
    if (ensemble.settings().precision) {
      // A batch that a stop left behind, of a longer earlier run, counts only once its turn has come.
      Briefs so_far(briefs.begin(), briefs.lower_bound(to));
      if (precision_of(ensemble, so_far).reached) return to;
    }
  }
  return asked;
}

long kept_members(const Ensemble& ensemble, const std::filesystem::path& directory) {
  std::set<std::int64_t> kept;
  each_member(directory, ensemble.identity(), [&](Member&& m) {
    if (m.index < ensemble.design().members()) kept.insert(m.index);
  });
  return static_cast<long>(kept.size());
}

}  // namespace talus::ensemble

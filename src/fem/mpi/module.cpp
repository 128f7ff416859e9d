// talus::Ranks by MPI: libtalus_mpi.so, loaded only by a process that a launcher started together with
// others.
#include <mpi.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "core/ranks.hpp"

namespace {

class MpiRanks final : public talus::Ranks {
 public:
  MpiRanks() {
    int running = 0;
    MPI_Initialized(&running);
    if (!running) MPI_Init(nullptr, nullptr);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    MPI_Comm_dup(MPI_COMM_WORLD, &work_);
    MPI_Comm_dup(MPI_COMM_WORLD, &meeting_);
  }
  ~MpiRanks() override {
    int done = 0;
    MPI_Finalized(&done);
    if (!done) MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  std::vector<double> gather(std::span<const double> mine) override {
    const int own = static_cast<int>(mine.size());
    std::vector<int> count(static_cast<std::size_t>(size_));
    MPI_Allgather(&own, 1, MPI_INT, count.data(), 1, MPI_INT, work_);
    std::size_t total = 0;
    for (const int c : count) total += static_cast<std::size_t>(c);
    std::vector<double> all(total);
    gather(mine, count, all.data());
    return all;
  }

  void gather(std::span<const double> mine, std::span<const int> count, double* all) override {
    std::vector<int> start(count.size(), 0);
    for (std::size_t r = 1; r < count.size(); ++r) start[r] = start[r - 1] + count[r - 1];
    MPI_Allgatherv(mine.data(), static_cast<int>(mine.size()), MPI_DOUBLE, all, count.data(), start.data(),
                   MPI_DOUBLE, work_);
  }

  void exchange(std::span<const std::vector<double>> send, std::span<std::vector<double>> receive) override {
    requests_.clear();
    for (int r = 0; r < size_; ++r)
      if (auto& to = receive[static_cast<std::size_t>(r)]; !to.empty())
        MPI_Irecv(to.data(), static_cast<int>(to.size()), MPI_DOUBLE, r, 0, work_, &requests_.emplace_back());
    for (int r = 0; r < size_; ++r)
      if (const auto& from = send[static_cast<std::size_t>(r)]; !from.empty())
        MPI_Isend(from.data(), static_cast<int>(from.size()), MPI_DOUBLE, r, 0, work_,
                  &requests_.emplace_back());
    MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  }

  bool meet(int purpose, double seconds) override {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    mine_[0] = purpose, mine_[1] = -purpose;
    MPI_Request all_here = MPI_REQUEST_NULL;
    MPI_Iallreduce(mine_, most_, 2, MPI_INT, MPI_MAX, meeting_, &all_here);
    for (;;) {
      int done = 0;
      MPI_Test(&all_here, &done, MPI_STATUS_IGNORE);
      if (done) return most_[0] == -most_[1];
      if (std::chrono::duration<double>(Clock::now() - start).count() > seconds) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  [[noreturn]] void abort(int code) override {
    MPI_Abort(MPI_COMM_WORLD, code);
    std::_Exit(code);
  }

 private:
  int rank_ = 0, size_ = 1;
  MPI_Comm work_ = MPI_COMM_NULL, meeting_ = MPI_COMM_NULL;
  std::vector<MPI_Request> requests_;
  int mine_[2] = {0, 0}, most_[2] = {0, 0};  // of a meeting, which may go on after meet() has given up
};

}  // namespace

extern "C" __attribute__((visibility("default"))) talus::Ranks* talus_ranks() {
  static MpiRanks shared;
  return &shared;
}

/// Processes that share the work of one run (MPI). Every rank runs the same program on the same scene and
/// takes the same decisions; a structure divides its cells among them (fem/discretisation/partition.hpp), all
/// else is computed by each of them, and rank 0 alone writes.
#pragma once
#include <atomic>
#include <span>
#include <vector>

namespace talus {

/// All ranks make the same calls in the same order, each from one thread.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// The parts of all ranks one after the other, on every rank; their lengths need not be known.
  virtual std::vector<double> gather(std::span<const double> mine) = 0;
  /// The same where the lengths are known: count[r] numbers of rank r, into `all`.
  virtual void gather(std::span<const double> mine, std::span<const int> count, double* all) = 0;
  /// Sends send[r] to each rank r and fills receive[r], whose size is known; empty ones are left out.
  virtual void exchange(std::span<const std::vector<double>> send,
                        std::span<std::vector<double>> receive) = 0;
  /// True once all ranks have come for the same purpose; false if one came for another, or none within
  /// `seconds`. Does not disturb the other calls.
  virtual bool meet(int purpose, double seconds) = 0;
  /// Ends all ranks at once.
  [[noreturn]] virtual void abort(int code) = 0;
};

/// Number of processes that the launcher (mpirun, srun) says; 1 without one.
int launched_ranks();

/// From now on ranks() gives none: this process computes by itself, and only who has asked before speaks to
/// the others.
void work_alone();

/// The ranks of this run; null for a single process. The first call starts MPI. Throws InputError if its
/// module is missing.
Ranks* ranks();

/// The value of `stop` (0 if null); with several ranks the largest of theirs, so that all of them stop at the
/// same point.
int agreed(const std::atomic<int>* stop);

}  // namespace talus

/// Start and end of a run on several processes (mpirun): one voice, one exit code.
#pragma once
#include <string>

namespace talus::app {

/// With several ranks: starts MPI and silences all but rank 0. Before anything is printed.
void start_together();
/// Throws InputError for a command that cannot be divided, if there are several ranks.
void require_one_rank(const std::string& command);
/// True on rank 0 and without MPI: only there files are written.
bool writes_files();
/// Waits for the other ranks, so that nothing is read where something is about to be written.
void wait_for_all();
/// Waits for all ranks to end, prints `text` once (may be empty), and returns `code`. If `failed` and the
/// others do not come, this rank alone is in trouble: it prints and ends them all.
int end_together(const std::string& text, int code, bool failed);

}  // namespace talus::app

#include "app/together.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "app/signals.hpp"
#include "core/error.hpp"
#include "core/ranks.hpp"

namespace talus::app {
namespace {

Ranks* started = nullptr;       // null: one process, or MPI did not start
std::FILE* own_voice = stderr;  // of a rank whose stderr is closed

constexpr int go_on = 1, end = 2;  // purposes of a meeting
constexpr double wait_for_others = 5,
                 forever = 1e9;  // [s]; others that fail for the same reason arrive within the first

void print(std::FILE* to, const std::string& text) {
  std::fflush(stdout);
  std::fwrite(text.data(), 1, text.size(), to);  // that nobody can read it changes no exit code
  if (text.empty() || text.back() != '\n') std::fputc('\n', to);
  std::fflush(to);
}

}  // namespace

void start_together() {
  started = ranks();
  if (started == nullptr || started->rank() == 0) return;
  if (const int kept = dup(STDERR_FILENO); kept >= 0)
    if (std::FILE* voice = fdopen(kept, "w")) own_voice = voice;
  for (std::FILE* stream : {stdout, stderr})
    if (std::freopen("/dev/null", "w", stream) == nullptr) std::fclose(stream);
}

void require_one_rank(const std::string& command) {
  if (started == nullptr || command == "run" || command == "impact" || command == "ensemble") return;
  Problem problem;
  problem.key = "talus " + command;
  problem.rule = fmt::format("is not divided over ranks, but {} were started", started->size());
  problem.remedy = "start it without mpirun";
  throw InputError(problem);
}

bool writes_files() { return started == nullptr || started->rank() == 0; }

void wait_for_all() {
  if (started == nullptr || started->meet(go_on, forever)) return;
  // Another rank has failed, says why, and ends all.
  sleep(60);
  started->abort(1);
}

int end_together(const std::string& text, int code, bool failed) {
  if (started == nullptr) {
    if (!text.empty()) print(stderr, text);
    return code;
  }
  std::fflush(stdout);
  // mpirun sends SIGTERM to the others once one has ended with an error: they end by what they have to say.
  if (failed) on_stop(OnStop::ask);
  if (started->meet(end, failed ? wait_for_others : forever)) {
    if (!text.empty()) print(stderr, text);
    return code;
  }
  print(own_voice, text);
  started->abort(code);
  return code;
}

}  // namespace talus::app

#include "app/signals.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <ctime>
#include <optional>
#include <string_view>
#include <thread>

namespace talus::app {
namespace {

std::atomic<int> came{0};
std::atomic<OnStop> action{OnStop::end};
std::atomic<void (*)()> last_action{nullptr};

using Clock = std::chrono::steady_clock;
/// A step of a large system may last: for so long it may come to its end, which saves all up to there.
constexpr std::chrono::seconds patience{5};

[[noreturn]] void end_with(std::string_view text, int number) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
  ::_exit(128 + number);
}

/// As if nobody had waited for the signal: whoever started the program sees that it ended by it.
[[noreturn]] void end_by(int number) {
  if (const auto act = last_action.load()) act();
  std::signal(number, SIG_DFL);
  sigset_t one;
  sigemptyset(&one);
  sigaddset(&one, number);
  pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
  ::raise(number);
  ::_exit(128 + number);
}

void take(int number) {
  switch (action.load()) {
    case OnStop::end: end_by(number);
    case OnStop::end_unwritten:
      end_with("talus: interrupted before the first step; nothing was written\n", number);
    case OnStop::ask:
    case OnStop::ask_with_patience:
      if (came.load() != 0 && number == SIGINT) end_by(number);
      came.store(number);
  }
}

void watch(sigset_t signals) {
  std::optional<Clock::time_point> patient_until;
  for (;;) {
    std::timespec wait{};
    if (patient_until) {
      const auto left = std::max(Clock::duration::zero(), *patient_until - Clock::now());
      const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
      wait.tv_sec = whole.count(), wait.tv_nsec = std::chrono::nanoseconds(left - whole).count();
    }
    const int number = sigtimedwait(&signals, nullptr, patient_until ? &wait : nullptr);
    if (number > 0) {
      take(number);
      if (action.load() == OnStop::ask_with_patience && !patient_until)
        patient_until = Clock::now() + patience;
    } else if (errno == EAGAIN) {
      if (action.load() == OnStop::ask_with_patience)
        end_with("talus: the step at hand did not end in time; --resume goes on from the last checkpoint\n",
                 came.load());
      patient_until.reset();  // it came to its end meanwhile
    }
  }
}

}  // namespace

void watch_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, number);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::thread(watch, signals).detach();
}

void on_stop(OnStop what) { action.store(what); }

void before_end(void (*act)()) { last_action.store(act); }

std::atomic<int>& stop_signal() { return came; }

}  // namespace talus::app

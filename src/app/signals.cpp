#include "app/signals.hpp"

#include <csignal>

namespace talus::app {
namespace {

std::atomic<int> came{0};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void on_stop_signal(int number) {
  came.store(number);
  // `timeout` and service managers send SIGTERM twice and mean one.
  if (number == SIGINT) std::signal(number, SIG_DFL);
}

}  // namespace

std::atomic<int>& stop_signal() { return came; }

void catch_signals() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, on_stop_signal);
}

}  // namespace talus::app

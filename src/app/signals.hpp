/// Signals that end a command between two steps.
#pragma once
#include <atomic>

namespace talus::app {

/// Number of the signal that came, 0 before.
std::atomic<int>& stop_signal();
/// SIGINT, SIGTERM and SIGHUP set stop_signal() from here on; a second SIGINT ends the program at once.
void catch_signals();

}  // namespace talus::app

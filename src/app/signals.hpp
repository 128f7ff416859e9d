/// SIGINT, SIGTERM and SIGHUP: what they do to a command.
#pragma once
#include <atomic>

namespace talus::app {

enum class OnStop {
  end,               ///< the program ends, as by default
  end_unwritten,     ///< it ends at once and says that nothing was written
  ask,               ///< stop_signal() is set; the command comes to its end by itself
  ask_with_patience  ///< the same, but where it does not within 5 s the program ends as if it had been killed
};

/// Starts the thread that takes the signals, which are blocked in all others: a library that puts in handlers
/// of its own for a while never runs them (METIS does as it orders unknowns: it swallowed a SIGTERM, or an
/// error of the factorisation came of it). Call it once, before any other thread begins. Signals that are
/// ignored, as by nohup, stay so.
void watch_signals();
/// What a signal does from here on. `end` at the start.
void on_stop(OnStop action);
/// What is done before a signal ends the program by `end`: temporary files are removed. Nothing at the start.
void before_end(void (*action)());
/// Number of the signal that came while it was asked for, 0 before. A second SIGINT, from the keyboard, ends
/// the program at once; `timeout` and service managers send SIGTERM twice and mean one.
std::atomic<int>& stop_signal();

}  // namespace talus::app

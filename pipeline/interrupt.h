#ifndef HEDDLE_PIPELINE_INTERRUPT_H_
#define HEDDLE_PIPELINE_INTERRUPT_H_
// SIGINT and SIGTERM end a command within a second. A thread of its own waits for them. All other
// threads block them, so no system call is ever cut short.
//   1. A signal becomes an exception at the next safe point, where stages and renderers call
//      stop_if_interrupted().
//   2. If the program has not ended half a second later, or a second signal comes, the waiting
//      thread removes the process's temporary files and ends it. That destroys nothing: files
//      appear under their names only when they are whole.
// A signal that was ignored when the program started stays ignored (nohup, background jobs of a
// shell). Exit status: 128 + signal (130 or 143). Tested in tests/pipeline/signals_test.cpp.

#include <stdexcept>
#include <string>

namespace heddle {

class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal_number);
  int exit_status() const { return 128 + signal_; }

 private:
  int signal_;
};

/// Starts to wait for signals. Called once, before other threads are started. `kept` tells users
/// how much of the command's work a signal leaves.
void watch_for_signals(const std::string& kept);

/// Throws Interrupted if a signal has come.
void stop_if_interrupted();

/// From here on the caller ends the process and says why. Does not return if a signal is already
/// ending it.
void claim_end_of_process();

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_INTERRUPT_H_

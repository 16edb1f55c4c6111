#ifndef HEDDLE_PIPELINE_INTERRUPT_H_
#define HEDDLE_PIPELINE_INTERRUPT_H_
// SIGINT and SIGTERM as an exception at the next safe point: the handler only sets a flag, and stages ask between chunks.
// Chunks that are done stay on disk, so the same command goes on where it stopped. A second signal ends the program at
// once. Exit status: 128 + signal (130 or 143).

#include <stdexcept>

namespace heddle {

class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal_number);
  int exit_status() const { return 128 + signal_; }

 private:
  int signal_;
};

void install_interrupt_handler();

/// Has a signal come? For loops of others that stop by themselves.
bool interrupt_requested();

/// Throws Interrupted where a signal has come.
void stop_if_interrupted();

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_INTERRUPT_H_

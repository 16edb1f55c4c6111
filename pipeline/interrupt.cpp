#include "pipeline/interrupt.h"

#include <atomic>
#include <csignal>

namespace heddle {
namespace {

std::atomic<int> received_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free, "only lock-free atomics may be used in a signal handler");

extern "C" void remember_signal(int signal_number) {
  received_signal = signal_number;
}

}  // namespace

Interrupted::Interrupted(int signal_number)
    : std::runtime_error("interrupted; the same command goes on from the last finished chunk"),
      signal_(signal_number) {}

void install_interrupt_handler() {
  struct sigaction action = {};
  action.sa_handler = remember_signal;
  action.sa_flags = SA_RESETHAND;  // a second signal has its default effect
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupt_requested() {
  return received_signal != 0;
}

void stop_if_interrupted() {
  if (received_signal != 0) throw Interrupted(received_signal);
}

}  // namespace heddle

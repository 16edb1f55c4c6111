#include "pipeline/interrupt.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>

#include "formats/atomic_file.h"

namespace heddle {

namespace {

// For a safe point to come, and for temporary files to be removed: together less than a second,
// also on a busy machine.
constexpr timespec kGrace = {.tv_sec = 0, .tv_nsec = 500'000'000};
constexpr std::chrono::milliseconds kTimeToExit{250};

std::atomic<int> received_signal = 0;
std::atomic<bool> is_ending = false;  // whoever sets it ends the process
std::string message = "interrupted";

/// Writes without waiting for a reader, and without dying if the reader is gone (SIGPIPE is blocked
/// here).
void write_to_standard_error(const std::string& text) {
  pollfd standard_error = {.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
  if (::poll(&standard_error, 1, 0) != 1 || (standard_error.revents & POLLOUT) == 0) return;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
}

[[noreturn]] void end_after_signal(const sigset_t& signals) {
  int first = 0;
  while (::sigwait(&signals, &first) != 0) {
  }
  received_signal = first;
  while (::sigtimedwait(&signals, nullptr, &kGrace) < 0 && errno == EINTR) {
  }
  // Should the rest hang (a file system that is gone), one more signal has its default effect.
  ::pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  if (is_ending.exchange(true)) {
    std::this_thread::sleep_for(kTimeToExit);
  } else {
    remove_own_temporaries();
    const bool terminal = ::isatty(STDERR_FILENO) == 1;  // its last line may show progress
    write_to_standard_error((terminal ? "\nheddle: " : "heddle: ") + message + "\n");
  }
  ::_exit(128 + first);
}

}  // namespace

Interrupted::Interrupted(int signal_number) : std::runtime_error(message), signal_(signal_number) {}

void watch_for_signals(const std::string& kept) {
  message = "interrupted; " + kept;
  sigset_t signals;
  ::sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM}) {
    struct sigaction on_start = {};
    ::sigaction(number, nullptr, &on_start);
    if (on_start.sa_handler != SIG_IGN) ::sigaddset(&signals, number);
  }
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  sigset_t all;
  sigset_t own;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &own);
  std::thread([signals] { end_after_signal(signals); }).detach();
  ::pthread_sigmask(SIG_SETMASK, &own, nullptr);
}

void stop_if_interrupted() {
  if (received_signal != 0) throw Interrupted(received_signal);
}

void claim_end_of_process() {
  while (is_ending.exchange(true)) ::pause();
}

}  // namespace heddle

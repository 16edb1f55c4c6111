#ifndef HEDDLE_PIPELINE_CONSOLE_H_
#define HEDDLE_PIPELINE_CONSOLE_H_
// What the program says while it works. Messages and progress go to standard error, so that data on
// standard output stays clean. On a terminal, progress is one line that is redrawn. Otherwise it is
// a plain line per 10 % or per minute. Nothing is shown for work that ends within a second, or with
// --quiet. Tested in tests/pipeline/console_test.cpp.

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <mutex>
#include <string>

namespace heddle {

/// "4.1 s", "2 min 05 s", "1 h 07 min".
std::string duration_text(double seconds);

class Console {
 public:
  /// `messages` outlives the console; `terminal` says whether it can redraw a line.
  Console(std::ostream& messages, bool terminal, bool quiet)
      : messages_(&messages), terminal_(terminal), quiet_(quiet) {}

  /// A line of its own, also with --quiet.
  void warn(const std::string& text);
  /// A line of its own.
  void say(const std::string& text);

  bool terminal() const { return terminal_; }
  bool quiet() const { return quiet_; }

 private:
  friend class Progress;
  void redraw(const std::string& text);  // replaces the line redrawn before; "" clears it
  std::mutex mutex_;
  std::ostream* messages_;
  bool terminal_;
  bool quiet_;
  std::size_t drawn_ = 0;  // characters of the line that is being redrawn
};

/// Says how much memory a large piece of work takes, from 1 GB on. MemoryError if the machine has
/// less. `work` is the work with its size: "synth: 1.4e+07 segments".
void announce_memory(Console& console, const std::string& work, std::uint64_t bytes);

/// Progress of `total` items of work, `done` of which came from an earlier run. Safe to advance
/// from several threads.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;
  Progress(Console& console, std::string title, std::string unit, std::uint64_t total,
           std::uint64_t done = 0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::uint64_t items);

  /// "visibility 42 %  6300/15000 segments  410 segments/s  21 s left"
  std::string line(double elapsed_seconds) const;

 private:
  Console* console_;
  std::string title_;
  std::string unit_;
  std::uint64_t total_;
  std::uint64_t first_;  // done before this run
  std::uint64_t done_;
  Clock::time_point start_;
  Clock::time_point shown_;     // when the last line was written
  std::uint64_t shown_tenths_;  // tenths of the work when the last plain line was written
  std::mutex mutex_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CONSOLE_H_

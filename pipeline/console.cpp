#include "pipeline/console.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "formats/memory_need.h"

namespace heddle {
namespace {

double seconds_between(Progress::Clock::time_point from, Progress::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 59.95) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
}

void Console::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  redraw("");
  *messages_ << text << '\n' << std::flush;
}

void Console::say(const std::string& text) {
  if (!quiet_) warn(text);
}

void Console::redraw(const std::string& text) {
  if (drawn_ == 0 && text.empty()) return;
  const std::size_t padding = drawn_ > text.size() ? drawn_ - text.size() : 0;
  *messages_ << '\r' << text << std::string(padding, ' ') << '\r' << std::flush;
  drawn_ = text.size();
}

void announce_memory(Console& console, const std::string& work, std::uint64_t bytes) {
  constexpr std::uint64_t kMuch = 1'000'000'000;
  if (bytes >= kMuch) console.say(fmt::format("{}, {} of memory", work, memory_text(bytes)));
  require_memory(bytes, work);
}

Progress::Progress(Console& console, std::string title, std::string unit, std::uint64_t total,
                   std::uint64_t done)
    : console_(&console),
      title_(std::move(title)),
      unit_(std::move(unit)),
      total_(total),
      first_(done),
      done_(done),
      start_(Clock::now()),
      shown_(start_),
      shown_tenths_(total > 0 ? 10 * done / total : 0) {}

Progress::~Progress() {
  const std::lock_guard lock(console_->mutex_);
  console_->redraw("");
}

void Progress::advance(std::uint64_t items) {
  const std::lock_guard own_lock(mutex_);
  done_ += items;
  if (console_->quiet_ || total_ == 0) return;
  const Clock::time_point now = Clock::now();
  const double elapsed = seconds_between(start_, now);
  const double since_shown = seconds_between(shown_, now);
  if (elapsed < 1) return;
  const std::lock_guard lock(console_->mutex_);
  if (console_->terminal_) {
    if (since_shown < 0.25) return;
    console_->redraw(line(elapsed));
  } else {
    const std::uint64_t tenths = 10 * done_ / total_;
    const bool next_tenth = tenths > shown_tenths_ && since_shown >= 1;
    if (!next_tenth && since_shown < 60) return;
    shown_tenths_ = tenths;
    *console_->messages_ << line(elapsed) << '\n' << std::flush;
  }
  shown_ = now;
}

std::string Progress::line(double elapsed_seconds) const {
  const double rate = static_cast<double>(done_ - first_) / std::max(elapsed_seconds, 1e-9);
  const std::string rate_text =
      rate >= 10 ? fmt::format("{:.0f}", rate) : fmt::format("{:.2g}", rate);
  std::string text = fmt::format("{:<10} {:3} %  {}/{} {}  {} {}/s", title_,
                                 100 * done_ / std::max<std::uint64_t>(total_, 1), done_, total_,
                                 unit_, rate_text, unit_);
  if (rate > 0 && done_ < total_) {
    text += fmt::format("  {} left", duration_text(static_cast<double>(total_ - done_) / rate));
  }
  return text;
}

}  // namespace heddle

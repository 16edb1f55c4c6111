#include "pipeline/console.h"

#include <gtest/gtest.h>

#include <sstream>

namespace heddle {
namespace {

TEST(Console, Durations) {
  EXPECT_EQ(duration_text(0.04), "0.0 s");
  EXPECT_EQ(duration_text(59.94), "59.9 s");
  EXPECT_EQ(duration_text(59.97), "1 min 00 s");
  EXPECT_EQ(duration_text(125), "2 min 05 s");
  EXPECT_EQ(duration_text(4020), "1 h 07 min");
}

TEST(Console, QuietKeepsWarningsOnly) {
  std::ostringstream text;
  Console console(text, false, true);
  console.say("built");
  console.warn("trouble");
  EXPECT_EQ(text.str(), "trouble\n");
}

TEST(Console, RateAndRemainingTimeCountThisRunOnly) {
  std::ostringstream text;
  Console console(text, false, false);
  Progress progress(console, "visibility", "segments", 1000, 500);
  progress.advance(100);
  // 100 segments in 2 s: 50 per second, 400 left.
  EXPECT_EQ(progress.line(2.0), "visibility  60 %  600/1000 segments  50 segments/s  8.0 s left");
  EXPECT_EQ(text.str(), "") << "work of less than a second stays silent";
}

}  // namespace
}  // namespace heddle

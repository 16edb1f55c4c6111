#include "formats/json_text.h"

#include <gtest/gtest.h>

#include <string>

namespace heddle {
namespace {

std::string nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') +
         std::string(static_cast<std::size_t>(depth), ']');
}

TEST(JsonText, TheDepthIsCountedOutsideStrings) {
  EXPECT_FALSE(is_nested_too_deeply(nested(kMaxJsonDepth)));
  EXPECT_TRUE(is_nested_too_deeply(nested(kMaxJsonDepth + 1)));
  EXPECT_FALSE(is_nested_too_deeply("[\"" + nested(1000) + "\"]"));
  EXPECT_FALSE(is_nested_too_deeply(R"(["\"[[[", "\\"])"));
  // the string ends after its backslash
  EXPECT_TRUE(is_nested_too_deeply("[\"\\\\\"," + nested(1000) + "]"));
}

TEST(JsonText, BracketsThatCloseMakeRoom) {
  std::string flat = "[";
  for (int k = 0; k < 1000; ++k) flat += "[],";
  EXPECT_FALSE(is_nested_too_deeply(flat + "{}]"));
}

}  // namespace
}  // namespace heddle

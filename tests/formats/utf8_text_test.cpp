#include "formats/utf8_text.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace heddle {
namespace {

TEST(Utf8Text, TellsUtf8FromOtherBytes) {
  for (const char* text : {"", "plain", "K\xc3\xb6per", "\xe2\x82\xac", "\xf0\x9f\xa7\xb5"})
    EXPECT_TRUE(is_utf8(text)) << text;
  // Latin-1, a cut sequence, overlong forms, a surrogate, beyond the last code point.
  for (const char* text : {"K\xf6per", "\xe2\x82", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80",
                           "\xf4\x90\x80\x80", "\x80", "\xff"})
    EXPECT_FALSE(is_utf8(text));
}

TEST(Utf8Text, OtherBytesAreLatin1) {
  EXPECT_EQ(utf8_of("K\xf6per"), "K\xc3\xb6per");
  EXPECT_EQ(utf8_of("K\xc3\xb6per"), "K\xc3\xb6per");
  EXPECT_TRUE(is_utf8(utf8_of("\x80\xff\xfe")));
}

}  // namespace
}  // namespace heddle

#include "formats/utf8_text.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

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

TEST(Utf8Text, ExcerptsAreShortAndPrintable) {
  EXPECT_EQ(quoted_excerpt("a\tb"), "'a?b'");
  EXPECT_EQ(quoted_excerpt(std::string(40, 'x')), "'" + std::string(30, 'x') + "...'");
  EXPECT_EQ(quoted_excerpt("K\xf6per"), "'K\xc3\xb6per'");
  // A character of two bytes is not cut in two.
  EXPECT_EQ(quoted_excerpt(std::string(29, 'x') + "\xc3\xb6y"),
            "'" + std::string(29, 'x') + "...'");
  EXPECT_TRUE(is_utf8(quoted_excerpt(std::string(50, '\xaf'))));
}

}  // namespace
}  // namespace heddle

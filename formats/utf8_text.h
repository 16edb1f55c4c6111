#ifndef HEDDLE_FORMATS_UTF8_TEXT_H_
#define HEDDLE_FORMATS_UTF8_TEXT_H_
// Text of files that do not say how they are encoded. Tested in tests/formats/utf8_text_test.cpp.

#include <string>
#include <string_view>

namespace heddle {

/// Is it UTF-8 without overlong forms, surrogates and places beyond U+10FFFF?
bool is_utf8(std::string_view text);

/// The text as UTF-8: as it is where it is that, else read as Latin-1.
std::string utf8_of(std::string_view text);

/// The beginning of a word of a file for a message, in quotes: UTF-8, control characters as '?'.
std::string quoted_excerpt(std::string_view text);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_UTF8_TEXT_H_

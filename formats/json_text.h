#ifndef HEDDLE_FORMATS_JSON_TEXT_H_
#define HEDDLE_FORMATS_JSON_TEXT_H_
// How deep JSON may be nested. The JSON library parses any depth, but copies, compares and prints
// values by recursion: a file of 70,000 brackets overflows the stack. Every reader of JSON asks
// here first. Tested in tests/formats/json_text_test.cpp.

#include <string_view>

namespace heddle {

/// How deep objects and arrays may be nested. Our own files and requests need fewer than ten.
inline constexpr int kMaxJsonDepth = 64;

/// Is any bracket of the text nested deeper than kMaxJsonDepth? Brackets inside strings do not
/// count; the text need not be valid JSON.
bool is_nested_too_deeply(std::string_view json);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_JSON_TEXT_H_

#ifndef HEDDLE_TESTS_SUPPORT_MUTATIONS_H_
#define HEDDLE_TESTS_SUPPORT_MUTATIONS_H_
// Damaged copies of a file or a text, always the same ones: what every reader must survive.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

namespace heddle {

/// f(damaged) for prefixes, and for copies with a byte changed: a bit flipped, or one of
/// `replacements` in its place. Every step-th place is damaged.
template <class Function>
void for_each_mutation(const std::string& whole, std::size_t step, std::string_view replacements,
                       Function&& f) {
  for (std::size_t at = 0; at < whole.size(); at += step) {
    f(whole.substr(0, at));
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
    f(damaged);
    for (const char replacement : replacements) {
      damaged[at] = replacement;
      f(damaged);
    }
  }
}

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Without write_file_atomically's flush to the disk, which thousands of files would wait for.
inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_SUPPORT_MUTATIONS_H_

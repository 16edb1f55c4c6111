#ifndef HEDDLE_TESTS_FUZZ_TARGETS_H_
#define HEDDLE_TESTS_FUZZ_TARGETS_H_
// Readers of files from elsewhere, each fed with any bytes. A target returns where the reader gives
// a whole result or a FileError. All else (a crash, another exception, a result that contradicts
// itself) ends the process. tests/fuzz/fuzz.cpp drives them by libFuzzer, replay_test.cpp by the
// corpus beside it.

#include <cstddef>
#include <span>

namespace heddle::fuzz {

using Target = void (*)(std::span<const std::byte> bytes);

struct NamedTarget {
  const char* name;  // of its folder in tests/fuzz/corpus
  Target run;
};

void wif(std::span<const std::byte> bytes);
void paper(std::span<const std::byte> bytes);
void bcc(std::span<const std::byte> bytes);
void hair(std::span<const std::byte> bytes);
void obj_lines(std::span<const std::byte> bytes);

inline constexpr NamedTarget kTargets[] = {
    {"wif", wif}, {"paper", paper}, {"bcc", bcc}, {"hair", hair}, {"obj_lines", obj_lines}};

}  // namespace heddle::fuzz

#endif  // HEDDLE_TESTS_FUZZ_TARGETS_H_

// libFuzzer's entry to one target, HEDDLE_FUZZ_TARGET.

#include <cstddef>
#include <cstdint>
#include <span>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  heddle::fuzz::HEDDLE_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
  return 0;
}

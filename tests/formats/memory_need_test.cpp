#include "formats/memory_need.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <limits>

namespace heddle {
namespace {

TEST(MemoryNeed, NumbersReadAsPeopleWriteThem) {
  EXPECT_EQ(memory_text(16'750'000'000), "16.8 GB");
  EXPECT_EQ(memory_text(310'000'000), "310 MB");
  EXPECT_EQ(memory_text(4'100), "4.1 kB");
}

TEST(MemoryNeed, WhatTheMachineCannotHoldIsRefusedWithBothNumbers) {
  EXPECT_NO_THROW(require_memory(1, "a byte"));
  try {
    require_memory(std::numeric_limits<std::uint64_t>::max(), "a picture");
    FAIL();
  } catch (const MemoryError& error) {
    EXPECT_EQ(std::string(error.what()).find("a picture: needs 18446744073.7 GB of memory, "), 0U)
        << error.what();
  }
}

TEST(MemoryNeed, TheLimitOfAddressSpaceCounts) {
  const std::uint64_t before = available_memory();
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &old), 0);
  rlimit lower = old;
  lower.rlim_cur = std::uint64_t{1} << 40;  // more than any process here has mapped
  ASSERT_EQ(setrlimit(RLIMIT_AS, &lower), 0);
  EXPECT_LE(available_memory(), std::uint64_t{1} << 40);
  EXPECT_GT(available_memory(), 0U);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &old), 0);
  EXPECT_GT(before, 0U);
}

}  // namespace
}  // namespace heddle

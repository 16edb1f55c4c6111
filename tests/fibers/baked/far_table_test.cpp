#include "fibers/baked/far_table.h"

#include <gtest/gtest.h>

#include "formats/input_error.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

FarTable small_table(bool with_cones) {
  FarTable table;
  table.resolution = 2;
  table.order = 1;
  table.repeat_mm = 0.75F;
  table.light_variance = 0.01F;
  const std::size_t views = table.view_count();
  for (std::size_t v = 0; v < views; ++v) {
    table.coverage.push_back(static_cast<float>(v) / static_cast<float>(views));
    table.height.push_back(0.1F * static_cast<float>(v) - 0.2F);
  }
  for (std::size_t k = 0; k < views * table.light_count() * 3; ++k)
    table.single.push_back(half_from_float(static_cast<float>(k)));
  for (std::size_t k = 0; k < views * 4 * 3; ++k)
    table.multiple.push_back(static_cast<float>(k) - 5);
  if (with_cones) {
    table.on_cones = table.multiple;
    table.cones = table.single;
  }
  return table;
}

TEST(FarTableFormat, ComesBackAsItWasWritten) {
  const TemporaryFolder folder;
  for (const bool with_cones : {false, true}) {
    const FarTable table = small_table(with_cones);
    write_far_table(folder.path() / "far.safetensors", table, {});
    const FarTable read = read_far_table(folder.path() / "far.safetensors");
    EXPECT_EQ(read.resolution, 2);
    EXPECT_EQ(read.order, 1);
    EXPECT_FALSE(read.both_sides);
    EXPECT_EQ(read.repeat_mm, table.repeat_mm);
    EXPECT_EQ(read.light_variance, table.light_variance);
    EXPECT_EQ(read.coverage, table.coverage);
    EXPECT_EQ(read.height, table.height);
    EXPECT_EQ(read.multiple, table.multiple);
    EXPECT_EQ(read.on_cones, table.on_cones);
    EXPECT_EQ(read.has_cones(), with_cones);
    ASSERT_EQ(read.single.size(), table.single.size());
    for (std::size_t k = 0; k < read.single.size(); ++k)
      EXPECT_EQ(read.single[k].bits, table.single[k].bits);
  }
}

TEST(FarTableFormat, WhatDoesNotBelongTogetherIsRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const FarTable& table) {
    write_far_table(folder.path() / "far.safetensors", table, {});
    EXPECT_THROW(read_far_table(folder.path() / "far.safetensors"), FileError);
  };
  FarTable table = small_table(false);
  table.coverage[3] = 1.5F;
  refused(table);
  table = small_table(false);
  table.repeat_mm = 0;
  refused(table);
}

}  // namespace
}  // namespace heddle

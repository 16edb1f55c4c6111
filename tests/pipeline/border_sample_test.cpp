#include "pipeline/border_sample.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "formats/input_error.h"
#include "tests/support/fabrics.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

/// A ring on a ground.
BlockMap ring(int size) {
  BlockMap map{size, size, {}};
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const double r = std::hypot(column + 0.5 - 0.5 * size, row + 0.5 - 0.5 * size) / size;
      map.fabric.push_back(r > 0.2 && r < 0.35 ? 1 : 0);
    }
  }
  return map;
}

TEST(BorderSample, ASmallPatternIsItsOwnMap) {
  const BlockMap pattern = ring(7);
  const BorderSample sample = choose_border_sample(pattern, 49, 1);
  EXPECT_EQ(sample.map.fabric, pattern.fabric);
  EXPECT_NEAR(sample.eight_fit, 1, 1e-12);
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 7; ++column) {
      EXPECT_EQ(sample.block[static_cast<std::size_t>(7 * row + column)],
                (std::array<int, 2>{column, row}));
    }
  }
}

TEST(BorderSample, EveryBlockShowsItsWeaveAndMostTheirNeighbours) {
  const BlockMap pattern = ring(30);
  const BorderSample sample = choose_border_sample(pattern, 64, 1);
  EXPECT_LE(sample.map.columns * sample.map.rows, 64);
  EXPECT_GT(sample.four_fit, 0.97);
  EXPECT_GT(sample.eight_fit, 0.8);
  double fitting = 0;
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 30; ++column) {
      const std::array<int, 2>& block = sample.block[static_cast<std::size_t>(30 * row + column)];
      EXPECT_EQ(sample.map.at(block[0], block[1]), pattern.at(column, row));
      bool fits = true;
      for (const auto& [x, y] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
        fits = fits && sample.map.at(block[0] + x, block[1] + y) == pattern.at(column + x, row + y);
      fitting += fits ? 1.0 / 900 : 0;
    }
  }
  // The share that is told is the share that is there.
  EXPECT_NEAR(fitting, sample.four_fit, 1e-9);
}

TEST(BorderSample, TheSampleIsWovenFromItsFabrics) {
  const TemporaryFolder folder;
  const auto document = [&](const std::string& face, const std::string& spacing) {
    std::string text =
        test::small_fabric_toml("satin 5/2") + "[visibility]\n[transfer]\n[volume]\n";
    text.replace(text.find("face = \"warp\""), 13, "face = \"" + face + "\"");
    text.replace(text.find("spacing_mm = 0.3"), 16, "spacing_mm = " + spacing);
    const std::filesystem::path file = folder.path() / (face + spacing + ".toml");
    std::ofstream(file) << text;
    return read_fabric_document(file, {});
  };
  const FabricDocument warp = document("warp", "0.3");
  const FabricDocument weft = document("weft", "0.3");
  const BlockMap map{2, 1, {0, 1}};
  const FabricDocument* both[] = {&warp, &weft};
  const FabricDocument sample = woven_sample(map, both, {1, 1});
  ASSERT_EQ(sample.config.weave.ends, 10);
  ASSERT_EQ(sample.config.weave.picks, 5);
  for (int pick = 0; pick < 5; ++pick) {
    for (int end = 0; end < 10; ++end) {
      EXPECT_EQ(sample.config.weave.is_warp_up(end, pick),
                (end < 5 ? warp : weft).config.weave.is_warp_up(end, pick));
    }
  }
  // Its artifacts are its own, and depend on the map.
  EXPECT_NE(sample.cloth_text, warp.cloth_text);
  EXPECT_NE(sample.cloth_text, woven_sample({2, 1, {1, 0}}, both, {1, 1}).cloth_text);
  EXPECT_EQ(sample.cloth_text, woven_sample(map, both, {1, 1}).cloth_text);

  const FabricDocument wide = document("weft", "0.31");
  const FabricDocument* unlike[] = {&warp, &wide};
  EXPECT_THROW(woven_sample(map, unlike, {1, 1}), ConfigError);
}

}  // namespace
}  // namespace heddle

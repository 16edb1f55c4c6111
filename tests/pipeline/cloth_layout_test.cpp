#include "pipeline/cloth_layout.h"

#include <gtest/gtest.h>

#include "formats/input_error.h"
#include "tests/support/fabrics.h"

namespace heddle {
namespace {

std::string message(const ClothConfig& cloth, const FabricConfig& a, const FabricConfig& b) {
  try {
    const FabricConfig* fabrics[] = {&a, &b};
    block_layout(cloth, fabrics, "scene.toml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// Two fabrics on a picture of 3 x 2 blocks.
ClothConfig patterned() {
  ClothConfig cloth;
  cloth.blocks.emplace();
  cloth.pattern = PatternConfig{{"a", "b"}, "picture.png", 3, 2, {0, 1, 1, 1, 0, 0}, {0, 0}};
  return cloth;
}

TEST(ClothLayout, ClothWithoutBlocksHasNone) {
  const FabricConfig fabric = test::small_fabric();
  const FabricConfig* fabrics[] = {&fabric};
  EXPECT_FALSE(block_layout(ClothConfig{}, fabrics, "scene.toml"));
}

TEST(ClothLayout, BlocksAreWholeWeaveRepeats) {
  FabricConfig a = test::small_fabric("satin 5/2");
  FabricConfig b = a;
  a.repeats_x = 2;
  b.repeats_y = 3;
  const FabricConfig* fabrics[] = {&a, &b};
  const auto layout = block_layout(patterned(), fabrics, "scene.toml");
  ASSERT_TRUE(layout);
  EXPECT_NEAR(layout->width_mm, 1.5, 1e-12);
  EXPECT_NEAR(layout->height_mm, 1.5, 1e-12);
  EXPECT_EQ(layout->tile_blocks[0], (std::array<int, 2>{2, 1}));
  EXPECT_EQ(layout->tile_blocks[1], (std::array<int, 2>{1, 3}));
  EXPECT_EQ(layout->at(1, 0).exemplar, 1U);
  EXPECT_EQ(layout->at(1, 1).exemplar, 0U);
}

TEST(ClothLayout, TheCornerMovesThePicture) {
  const FabricConfig a = test::small_fabric();
  const FabricConfig* fabrics[] = {&a, &a};
  ClothConfig cloth = patterned();
  const auto still = block_layout(cloth, fabrics, "scene.toml");
  cloth.pattern->corner_blocks = {-4, 3};
  const auto moved = block_layout(cloth, fabrics, "scene.toml");
  for (int column = -5; column < 5; ++column) {
    for (int row = -5; row < 5; ++row)
      EXPECT_EQ(moved->at(column - 4, row + 3).exemplar, still->at(column, row).exemplar);
  }
}

TEST(ClothLayout, BlocksNeedAWeave) {
  const FabricConfig woven = test::small_fabric();
  FabricConfig knit = woven;
  knit.knit.emplace();
  EXPECT_EQ(message(patterned(), woven, knit),
            "scene.toml: blocks are repeats of a weave, and small is not woven");
}

TEST(ClothLayout, ScatteredBlocksAreThoseThatFit) {
  FabricConfig fabric = test::small_fabric();
  fabric.repeats_x = fabric.repeats_y = 4;
  fabric.fitting_blocks = {2, 1};
  ClothConfig cloth = patterned();
  EXPECT_EQ(message(cloth, fabric, fabric), "");
  cloth.blocks->order = BlockOrder::kScattered;
  EXPECT_EQ(
      message(cloth, fabric, fabric),
      "scene.toml: scattered blocks of 1 x 1 repeats would not fit each other: those of small "
      "that do have 2 x 1 (fitting_repeats)");
  cloth.blocks->size_repeats = {4, 2};
  EXPECT_EQ(message(cloth, fabric, fabric), "");
}

TEST(ClothLayout, UnequalBlocksAreNamedWithTheirNumbers) {
  const FabricConfig plain = test::small_fabric();
  const FabricConfig satin = test::small_fabric("satin 5/2");
  EXPECT_EQ(message(patterned(), plain, satin),
            "scene.toml: the fabrics of a pattern need blocks of one size; 1 x 1 repeats of small "
            "are 0.6 x 0.6 mm, those of small are 1.5 x 1.5 mm");
  ClothConfig cloth = patterned();
  cloth.blocks->size_repeats = {2, 1};
  EXPECT_EQ(message(cloth, plain, plain),
            "scene.toml: blocks of 2 x 1 repeats do not divide the tile of small, which has 1 x 1");
}

}  // namespace
}  // namespace heddle

#include "fibers/tracing/cloth_tiling.h"

#include <gtest/gtest.h>

#include <set>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/fabrics.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

using Tile = ClothTiling::Tile;

Tile woven_tile(int repeats) {
  FabricConfig config = test::small_fabric();
  config.repeats_x = config.repeats_y = repeats;
  return std::make_shared<const TileScene>(synthesize(config));
}

/// The tile of one exemplar cut into n x n blocks that lie as in the tile.
ClothTiling cut_tile(const Tile& tile, int n) {
  BlockLayout layout;
  layout.width_mm = static_cast<double>(tile->exemplar().width_mm) / n;
  layout.height_mm = static_cast<double>(tile->exemplar().height_mm) / n;
  layout.tile_blocks = {{n, n}};
  return {std::vector<Tile>{tile}, layout};
}

std::optional<TilingHit> intersect(const ClothTiling& tiling, const Vec3d& origin,
                                   const Vec3& direction, std::uint32_t own_exemplar = 0,
                                   std::uint32_t own_fiber = kNoFiber) {
  const BlockPlace place = tiling.place_of(origin);
  return tiling.first_hit(place, {place.offset.cast<float>(), direction},
                          [&](std::uint32_t exemplar, const Ray& ray) {
                            return tiling.tiles()[exemplar]->intersect(
                                ray, exemplar == own_exemplar ? own_fiber : kNoFiber);
                          });
}

Vec3d random_origin(RandomStream& random) {
  return {20 * random.uniform_double() - 10, 20 * random.uniform_double() - 10,
          0.3 * random.uniform_double() - 0.15};
}

TEST(ClothTiling, BlocksThatLieAsInTheTileAreTheTile) {
  const Tile tile = woven_tile(3);
  const ClothTiling whole(tile);
  for (const int n : {1, 3}) {
    const ClothTiling blocks = cut_tile(tile, n);
    int hits = 0;
    for (std::uint64_t k = 0; k < 4000; ++k) {
      RandomStream random(1, RandomStage::kTest, k, static_cast<std::uint64_t>(n));
      const Vec3d origin = random_origin(random);
      const Vec3 direction = sample_sphere(random);
      const std::uint32_t own = random.index(tile->exemplar().fiber_count());
      const auto expected = intersect(whole, origin, direction, 0, own);
      const auto found = intersect(blocks, origin, direction, 0, own);
      ASSERT_EQ(found.has_value(), expected.has_value()) << k;
      if (!found) continue;
      ++hits;
      // Rounding of coordinates by up to a tile: 1e-7 of some 2 mm.
      EXPECT_NEAR(found->hit.t, expected->hit.t, 2e-5 * (1 + expected->hit.t)) << k;
      EXPECT_EQ(found->exemplar, 0U);
    }
    EXPECT_GT(hits, 2000);
  }
}

/// Two tiles of 1 mm with one fiber along the weft each, at different heights.
struct TwoHeights {
  Tile low = std::make_shared<const TileScene>(
      test::straight_fibers(1, 1, {{0.5F, 0.1F}}, 0.05F, 4, test_cotton()));
  Tile high = std::make_shared<const TileScene>(
      test::straight_fibers(1, 1, {{0.5F, 0.4F}}, 0.05F, 4, test_cotton()));
  ClothTiling tiling = [this] {
    BlockLayout layout;
    layout.width_mm = layout.height_mm = 1;
    layout.tile_blocks = {{1, 1}, {1, 1}};
    layout.columns = 3;
    layout.rows = 2;
    layout.pattern.clear();
    for (const std::uint32_t exemplar : {0U, 1U, 1U,  //
                                         1U, 0U, 0U}) {
      layout.pattern.push_back({exemplar, BlockLayout::kByOrder, BlockLayout::kByOrder});
    }
    return ClothTiling({low, high}, layout);
  }();
};

TEST(ClothTiling, APatternSaysWhichExemplarLiesWhere) {
  const TwoHeights cloth;
  for (int column = -7; column < 8; ++column) {
    for (int row = -5; row < 5; ++row) {
      const auto hit = intersect(cloth.tiling, {column + 0.3, row + 0.5, 3}, {0, 0, -1});
      ASSERT_TRUE(hit);
      const int place_x = ((column % 3) + 3) % 3;
      const int place_y = ((row % 2) + 2) % 2;
      const bool high = place_y == 0 ? place_x != 0 : place_x == 0;
      EXPECT_EQ(hit->exemplar, high ? 1U : 0U) << column << " " << row;
      EXPECT_NEAR(hit->hit.t, 3 - (high ? 0.45 : 0.15), 1e-6);
    }
  }
}

TEST(ClothTiling, ARayAcrossABorderSeesWhatLiesThere) {
  const TwoHeights cloth;
  // Over the low block 0 at the height of the high fiber, along the weft: it meets the end of the
  // high fiber's cut where block 1 begins, from inside.
  const auto along = intersect(cloth.tiling, {0.2, 0.5, 0.4}, Vec3(1, 0.01F, 0).normalized());
  ASSERT_TRUE(along);
  EXPECT_EQ(along->exemplar, 1U);
  // At the latest the far side, 0.05 aside at a slope of 0.01, or before it a joint of segments.
  EXPECT_GE(along->hit.t, 0.8);
  EXPECT_LE(along->hit.t, 5.01);
  // Across it the ray is free.
  EXPECT_FALSE(intersect(cloth.tiling, {0.2, 0.5, 0.4}, {-0.1F, 0, 1}));
  // Downwards within the low block, it meets the low fiber as if nothing else were there.
  const auto down = intersect(cloth.tiling, {0.2, 0.5, 0.4}, {0, 0, -1});
  ASSERT_TRUE(down);
  EXPECT_EQ(down->exemplar, 0U);
}

TEST(ClothTiling, TheOwnFiberIsThatOfItsExemplar) {
  const TwoHeights cloth;
  // Fiber 0 of the low exemplar: fiber 0 of the high one is another fiber.
  EXPECT_FALSE(intersect(cloth.tiling, {0.3, 0.5, 3}, {0, 0, -1}, 0, 0));
  EXPECT_TRUE(intersect(cloth.tiling, {1.3, 0.5, 3}, {0, 0, -1}, 0, 0));
  EXPECT_FALSE(intersect(cloth.tiling, {1.3, 0.5, 3}, {0, 0, -1}, 1, 0));
}

TEST(ClothTiling, PositionsInTheTileAreThoseOfTheBlock) {
  const ClothTiling blocks = cut_tile(woven_tile(3), 3);
  const double width = blocks.layout()->width_mm;
  const double height = blocks.layout()->height_mm;
  const Vec3d at = blocks.in_tile(blocks.place_of({-0.25 * width, 4.5 * height, 0.1}));
  EXPECT_NEAR(at.x(), 2.75 * width, 1e-9);
  EXPECT_NEAR(at.y(), 1.5 * height, 1e-9);
  EXPECT_EQ(at.z(), 0.1);
}

TEST(BlockLayout, APatternMayNameBlocks) {
  BlockLayout layout;
  layout.tile_blocks = {{4, 4}};
  layout.columns = 2;
  layout.pattern = {{0, 3, 1}, {0, BlockLayout::kByOrder, BlockLayout::kByOrder}};
  const BlockLayout::Block named = layout.at(6, -3);
  EXPECT_EQ(named.column, 3);
  EXPECT_EQ(named.row, 1);
  const BlockLayout::Block aligned = layout.at(7, -3);
  EXPECT_EQ(aligned.column, 3);
  EXPECT_EQ(aligned.row, 1);
  EXPECT_EQ(layout.at(5, 2).column, 1);
}

TEST(BlockLayout, ScatteredBlocksAreAllUsedAlike) {
  BlockLayout layout;
  layout.width_mm = layout.height_mm = 1;
  layout.tile_blocks = {{2, 3}};
  layout.order = BlockOrder::kScattered;
  std::map<std::pair<int, int>, int> uses;
  for (int column = -50; column < 50; ++column) {
    for (int row = -60; row < 60; ++row) {
      const BlockLayout::Block block = layout.at(column, row);
      const BlockLayout::Block again = layout.at(column, row);
      EXPECT_EQ(block.column, again.column);
      EXPECT_EQ(block.row, again.row);
      ++uses[{block.column, block.row}];
    }
  }
  ASSERT_EQ(uses.size(), 6U);
  // 12000 draws of a sixth: 41 is one deviation.
  for (const auto& [block, count] : uses) EXPECT_NEAR(count, 2000, 5 * 41);
}

}  // namespace
}  // namespace heddle

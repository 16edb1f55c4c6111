#include "render/tile_preview.h"

#include <gtest/gtest.h>

#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

// A thick fiber along x in the middle of the tile: the picture shows it as a band, brighter where
// it faces the lamp (from the upper left), and gaps above and below.
TEST(TilePreview, ShowsWhereFibersAre) {
  const TileScene tile(test::straight_fibers(1, 1, {Vec2(0.5F, 0)}, 0.2F, 10, test::white_fiber()));
  constexpr int kPixels = 20;
  const std::vector<Rgb> picture = preview_tile(tile, 1, kPixels);
  const auto at = [&](int row) { return picture[static_cast<std::size_t>(row * kPixels + 7)][1]; };
  EXPECT_EQ(at(1), 0);
  EXPECT_EQ(at(18), 0);
  EXPECT_GT(at(7), at(12)) << "lit from above";
  EXPECT_GT(at(12), 0.1F);
}

TEST(TilePreviewLaw, CopiesOfTheTileLookAlike) {
  const TileScene tile(
      test::straight_fibers(0.5F, 0.5F, {Vec2(0.2F, 0)}, 0.1F, 7, test::white_fiber()));
  const std::vector<Rgb> picture = preview_tile(tile, 1, 16);
  for (std::size_t row = 0; row < 8; ++row) {
    for (std::size_t column = 0; column < 8; ++column) {
      const Rgb here = picture[row * 16 + column];
      EXPECT_LT((here - picture[(row + 8) * 16 + column]).abs().maxCoeff(), 1e-3F);
      EXPECT_LT((here - picture[row * 16 + column + 8]).abs().maxCoeff(), 1e-3F);
    }
  }
}

}  // namespace
}  // namespace heddle

#include "pipeline/swatch_picture.h"

#include <gtest/gtest.h>

#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

// White fibers side by side cover the picture, and show about what a white surface would: 0.8.
TEST(SwatchPicture, WhiteClothIsWhite) {
  std::vector<Vec2> places;
  for (int layer = 0; layer < 6; ++layer) {
    for (int k = 0; k < 10; ++k)
      places.emplace_back(0.1F * static_cast<float>(k) + 0.05F * static_cast<float>(layer % 2),
                          0.09F * static_cast<float>(layer));
  }
  const auto tile = std::make_shared<const TileScene>(
      test::straight_fibers(1, 1, places, 0.048F, 10, test::white_fiber()));
  const std::vector<Rgb> picture =
      trace_swatch(*tile, false, {.width_mm = 1, .pixels = 16, .spp = 16}, 1, [](double) {});
  Rgb mean = Rgb::Zero();
  for (const Rgb& color : picture) mean += color / static_cast<float>(picture.size());
  EXPECT_GT(mean.minCoeff(), 0.4F);
  EXPECT_LT(mean.maxCoeff(), 1.0F);
}

}  // namespace
}  // namespace heddle

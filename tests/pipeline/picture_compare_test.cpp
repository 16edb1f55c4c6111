#include "pipeline/picture_compare.h"

#include <gtest/gtest.h>

#include "formats/input_error.h"

namespace heddle {
namespace {

/// A picture of two pixels; a layer is a name with its dot, or empty.
void add_layer(Image& image, const std::string& layer, float first, float second) {
  for (const char* channel : {"R", "G", "B"}) {
    image.channels[layer + channel] = {ChannelType::kFloat, {first, second}, {}};
  }
}

Image picture(float first, float second) {
  Image image;
  image.width = 2;
  image.height = 1;
  add_layer(image, "", first, second);
  return image;
}

TEST(PictureCompare, OneReference) {
  const PictureComparison result = compare_images(picture(2, 5), "a", picture(1, 7), "b", "");
  // sqrt((1^2 + 2^2) / 2) / 4, mean 3.5 against 4.
  EXPECT_NEAR(result.error.relative_rmse, std::sqrt(2.5) / 4, 1e-6);
  EXPECT_NEAR(result.error.relative_difference[1], 3.5 / 4 - 1, 1e-6);
  EXPECT_FALSE(result.halves);
  EXPECT_EQ(result.difference.channels.at("G").values, (std::vector<float>{1, -2}));
  EXPECT_EQ(result.preview.size(), 6U);
}

TEST(PictureCompare, HalvesOfTheReferenceTakeItsNoiseAway) {
  // The picture is the true mean; the halves err by the same amount in opposite directions in one
  // pixel and in the same direction in none: (F - R0)(F - R1) = -1 and 0.
  Image reference = picture(4, 4);
  add_layer(reference, "half0.", 5, 4);
  add_layer(reference, "half1.", 3, 4);
  const PictureComparison result = compare_images(picture(4, 4), "a", reference, "b", "");
  EXPECT_TRUE(result.halves);
  EXPECT_NEAR(result.error.mean_square, -0.5, 1e-6);
  EXPECT_EQ(result.error.relative_rmse, 0);
}

TEST(PictureCompare, WhatCannotBeCompared) {
  Image wide = picture(1, 1);
  wide.width = 1;
  wide.height = 2;
  EXPECT_THROW(compare_images(picture(1, 1), "a", wide, "b", ""), ConfigError);
  EXPECT_THROW(compare_images(picture(1, 1), "a", picture(1, 1), "b", "single"), ConfigError);
}

}  // namespace
}  // namespace heddle

#include "render/render_output.h"

#include <gtest/gtest.h>

#include "formats/input_error.h"

namespace heddle {
namespace {

TEST(RenderOutput, LayersAndTypes) {
  FrameBuffers frame(2, 1);
  frame.beauty = {Rgb(1, 2, 3), Rgb(4, 5, 6)};
  frame.single = {Rgb(0.5F, 0, 0), Rgb(0, 0, 0)};
  frame.half0 = frame.half1 = frame.beauty;
  frame.variance = frame.single;
  frame.segment = {7, 0xffffffffU};
  frame.depth = {12.5F, 0};
  frame.fabric_position = {Vec3(1, 2, 3), Vec3(0, 0, 0)};
  const Image image = image_of(frame, {{"method", "path"}});
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.metadata.at("method"), "path");
  EXPECT_EQ(image.channels.at("G").values, (std::vector<float>{2, 5}));
  EXPECT_EQ(image.channels.at("G").type, ChannelType::kHalf);
  EXPECT_EQ(image.channels.at("single.R").values[0], 0.5F);
  EXPECT_EQ(image.channels.at("Variance.R").type, ChannelType::kFloat);
  EXPECT_EQ(image.channels.at("half1.B").values[1], 6);
  EXPECT_EQ(image.channels.at("segment").type, ChannelType::kUint);
  EXPECT_EQ(image.channels.at("segment").ids[0], 7U);
  EXPECT_EQ(image.channels.at("v").values[0], 2);
  EXPECT_EQ(image.channels.at("Z").values[0], 12.5F);
  EXPECT_FALSE(image.channels.contains("cell"));
  EXPECT_FALSE(image.channels.contains("tangent.X"));
}

TEST(RenderOutput, LayersComeBack) {
  FrameBuffers frame(1, 2);
  frame.multiple = {Rgb(1, 2, 3), Rgb(4, 5, 6)};
  const Image image = image_of(frame, {});
  EXPECT_EQ(layer_of(image, "multiple", "a.exr")[1][2], 6);
  EXPECT_THROW(layer_of(image, "half0", "a.exr"), FileError);
}

}  // namespace
}  // namespace heddle

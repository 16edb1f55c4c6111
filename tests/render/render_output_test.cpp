#include "render/render_output.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "fibers/math/random.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"

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

TEST(RenderOutputLaw, LightGroupsAndPartsAddUpInHalves) {
  FrameBuffers frame(64, 8);
  frame.keep_parts(3, true);
  frame.light_groups[0].name = "key";
  frame.light_groups[1].name = "fill";
  frame.light_groups[2].name = "rest";
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    RandomStream random(4, RandomStage::kTest, k, 0);
    const auto color = [&] {
      return Rgb(random.uniform(), 0.1F * random.uniform(), 9 * random.uniform());
    };
    if (k % 3 == 0) frame.background[k] = color();
    Rgb light = Rgb::Zero();
    for (LightGroupLayer& group : frame.light_groups) light += group.light[k] = color();
    // Multiple scattering may ring below 0.
    frame.multiple[k] = (k % 7 == 0 ? -0.01F : 0.4F) * light;
    frame.single[k] = light - frame.multiple[k];
    frame.transmitted[k] = random.uniform() * frame.single[k];
    frame.beauty[k] = frame.background[k] + light;
  }
  const Image image = image_of(frame, {});
  const auto layer = [&](const std::string& name) { return layer_of(image, name, "a.exr"); };
  const auto key = layer("C_key");
  const auto fill = layer("C_fill");
  const auto rest = layer("C_rest");
  const auto background = layer("background");
  const auto single = layer("single");
  const auto multiple = layer("multiple");
  const auto reflected = layer("reflected");
  const auto transmitted = layer("transmitted");
  const auto beauty = layer("");
  const auto half = [](float value) { return float_from_half(half_from_float(value)); };
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    for (int c = 0; c < 3; ++c) {
      ASSERT_EQ(half(key[k][c] + fill[k][c] + rest[k][c] + background[k][c]), beauty[k][c]);
      ASSERT_EQ(half(background[k][c] + single[k][c] + multiple[k][c]), beauty[k][c]);
      ASSERT_EQ(half(reflected[k][c] + transmitted[k][c]), single[k][c]);
      ASSERT_NEAR(key[k][c], frame.light_groups[0].light[k][c], 2e-3F * frame.beauty[k][c]);
      ASSERT_NEAR(beauty[k][c], frame.beauty[k][c], 1e-3F * frame.beauty[k][c]);
      ASSERT_EQ(key[k][c], half(key[k][c]));
    }
  }
}

TEST(RenderOutput, EveryChannelHasANote) {
  FrameBuffers frame(1, 1);
  frame.keep_parts(2, true);
  frame.light_groups[0].name = "a";
  frame.light_groups[1].name = "b";
  frame.half0 = frame.half1 = frame.variance = frame.albedo = frame.beauty;
  frame.samples = {1};
  frame.segment = frame.cell = {1};
  frame.fabric_position = frame.tangent = frame.position = frame.normal = {Vec3(0, 0, 0)};
  frame.depth = {1};
  frame.uv = {Vec2(0, 0)};
  frame.mattes = {{"CryptoCloth", std::vector<Cryptomatte::Ranks>(1), {}}};
  const Image image = image_of(frame, {});
  EXPECT_EQ(image.channels.size(), 67U);
  std::ifstream file(std::string(HEDDLE_SOURCE_DIR) + "/docs/layers.md");
  std::stringstream page;
  page << file.rdbuf();
  for (const auto& [name, channel] : image.channels) {
    EXPECT_NE(channel_note(name), "") << name;
    std::string layer = name.substr(0, name.find('.'));
    if (layer.starts_with("C_")) layer = "C_NAME";
    if (layer.starts_with("Crypto")) layer = layer.substr(0, layer.size() - 2);
    EXPECT_NE(page.str().find("`" + layer), std::string::npos) << layer << " in docs/layers.md";
  }
  EXPECT_EQ(channel_note("somebody.R"), "");
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

#include "precompute/visibility_settings.h"

#include <gtest/gtest.h>

#include <string>

#include "formats/input_error.h"

namespace heddle {
namespace {

VisibilitySettings read(const std::string& text, bool both_sides) {
  const TomlTable document = TomlTable::parse(text, "test.toml");
  VisibilitySettings settings = read_visibility_settings(document, both_sides);
  document.finish();
  return settings;
}

TEST(VisibilitySettings, DefaultsFollowTheSideOfTheLight) {
  const VisibilitySettings face = read("", false);
  EXPECT_EQ(face.components, 48);
  EXPECT_EQ(face.sgs.count, 48);
  EXPECT_EQ(face.sgs.axes, FibonacciSet::kHemisphere);
  EXPECT_EQ(face.sgs.sharpness, default_sg_sharpness(FibonacciSet::kHemisphere));
  EXPECT_EQ(face.sgs.weights, SgWeights::kNnls);
  EXPECT_FALSE(face.both_sides);
  const VisibilitySettings both = read("", true);
  EXPECT_EQ(both.sgs.axes, FibonacciSet::kSphere);
  EXPECT_EQ(both.sgs.sharpness, default_sg_sharpness(FibonacciSet::kSphere));
  EXPECT_TRUE(both.both_sides);
}

TEST(VisibilitySettings, ThePaperCanBeAskedFor) {
  const VisibilitySettings settings = read(
      "components = 32\npca_segments = 500\nsg_count = 24\nsg_axes = \"printed\"\nsg_sharpness = "
      "128\n"
      "sg_weights = \"voronoi\"\n",
      false);
  EXPECT_EQ(settings.components, 32);
  EXPECT_EQ(settings.pca_segments, 500);
  EXPECT_EQ(settings.sgs.count, 24);
  EXPECT_EQ(settings.sgs.axes, FibonacciSet::kPrinted);
  EXPECT_EQ(settings.sgs.sharpness, 128);
  EXPECT_EQ(settings.sgs.weights, SgWeights::kVoronoi);
}

TEST(VisibilitySettings, RejectsWhatIsOutOfRangeOrUnknown) {
  for (const char* text : {"components = 0", "components = 129", "pca_segments = 0", "sg_count = 0",
                           "sg_count = 257", "sg_sharpness = 0.5", "sg_sharpness = nan",
                           "sg_axes = \"cube\"", "sg_weights = 1", "resolution = 128"}) {
    EXPECT_THROW(read(text, false), ConfigError) << text;
  }
}

TEST(VisibilitySettings, UpperAxesNeedLightFromTheFaceOnly) {
  EXPECT_THROW(read("sg_axes = \"hemisphere\"", true), ConfigError);
  EXPECT_THROW(read("sg_axes = \"printed\"", true), ConfigError);
  EXPECT_EQ(read("sg_axes = \"sphere\"", false).sgs.axes, FibonacciSet::kSphere);
}

}  // namespace
}  // namespace heddle

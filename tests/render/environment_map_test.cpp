#include "render/environment_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "formats/image_file.h"
#include "formats/input_error.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

// Uneven, with black pixels and one that holds half of the light.
EnvironmentMap uneven(int width, int height) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  std::vector<Rgb> radiance;
  for (int k = 0; k < width * height; ++k) {
    const float scale = k % 5 == 0 ? 0.0F : 1.0F;
    const float red = random.uniform();
    const float green = random.uniform();
    radiance.emplace_back(scale * red, scale * green, scale * 0.5F);
  }
  radiance[static_cast<std::size_t>(width * height / 3)] = {40, 30, 20};
  return {width, height, radiance};
}

TEST(EnvironmentMap, ConventionIsThatOfTheHeader) {
  // 8 x 4 pixels numbered in reading order.
  std::vector<Rgb> numbered;
  for (int k = 0; k < 32; ++k) numbered.emplace_back(Rgb::Constant(static_cast<float>(k)));
  const EnvironmentMap map(8, 4, numbered);
  const auto at = [&](double x, double y, double z) {
    return static_cast<int>(map.radiance(Vec3d(x, y, z).normalized().cast<float>())[0]);
  };
  EXPECT_EQ(at(0.01, -0.001, 1) / 8, 0) << "up is the first row";
  EXPECT_EQ(at(0.01, -0.001, -1) / 8, 3);
  EXPECT_EQ(at(1, -0.1, 0.1), 8 + 4) << "+x is right and left of the middle";
  EXPECT_EQ(at(1, 0.1, 0.1), 8 + 3);
  EXPECT_EQ(at(0.1, -1, 0.1), 8 + 5) << "-y is a quarter to the right";
  EXPECT_EQ(at(0.1, 1, 0.1), 8 + 2) << "+y is a quarter to the left";
  EXPECT_EQ(at(-1, 0.1, 0.1), 8 + 0) << "-x is the seam";
  EXPECT_EQ(at(-1, -0.1, 0.1), 8 + 7);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 8; ++column) {
      EXPECT_EQ(map.radiance(map.centre(row, column).cast<float>())[0],
                static_cast<float>(8 * row + column));
    }
  }
}

TEST(EnvironmentMapLaw, SolidAnglesCoverTheSphereAndIntegralIsExact) {
  const EnvironmentMap map(7, 5, std::vector<Rgb>(35, Rgb(1, 2, 0)));
  double sum = 0;
  for (int row = 0; row < 5; ++row) sum += 7 * map.solid_angle(row);
  EXPECT_NEAR(sum, 4 * kPi, 1e-12);
  EXPECT_NEAR(map.integral()[0], 4 * kPi, 1e-12);
  EXPECT_NEAR(map.integral()[1], 8 * kPi, 1e-12);
  EXPECT_EQ(map.integral()[2], 0);
}

TEST(EnvironmentMapStatistical, SamplingIsWhatItSays) {
  // The harness bins about x with 10 x 20 cells: turned so that its pole is ours, a cell is a
  // pixel.
  const EnvironmentMap map = uneven(20, 10);
  const EnvironmentMap other = map.reduced(10, 10);
  RandomStream random(2, RandomStage::kTest, 0, 0);
  const auto turned = [](const Vec3d& w) { return Vec3d(w.z(), w.x(), w.y()); };
  const auto back = [](const Vec3d& w) { return Vec3d(w.y(), w.z(), w.x()); };
  EXPECT_TRUE(chi_square_accepts(
      "environment", [&] { return turned(map.sample(random).direction.cast<double>()); },
      [&](const Vec3d& w) { return static_cast<double>(map.pdf(back(w).cast<float>())); }, 100000,
      2));
  EXPECT_FALSE(chi_square_accepts(
      "environment, density of another map",
      [&] { return turned(map.sample(random).direction.cast<double>()); },
      [&](const Vec3d& w) { return static_cast<double>(other.pdf(back(w).cast<float>())); }, 100000,
      2));
}

TEST(EnvironmentMapLaw, WeightTimesDensityIsRadianceAndMeanWeightTheIntegral) {
  const EnvironmentMap map = uneven(20, 10);
  RandomStream random(3, RandomStage::kTest, 0, 0);
  RunningMean blue;
  for (int k = 0; k < 20000; ++k) {
    const LightSample sample = map.sample(random);
    EXPECT_NEAR(sample.direction.norm(), 1, 1e-6);
    ASSERT_GT(sample.pdf, 0);
    blue.add(static_cast<double>(sample.weight[2]));
    // rounding may step over a pixel's edge
    if (k % 20 != 0 || sample.pdf != map.pdf(sample.direction)) continue;
    const Rgb radiance = map.radiance(sample.direction);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(sample.weight[c] * sample.pdf, radiance[c], 1e-5F * radiance[c]);
  }
  EXPECT_TRUE(means_agree("mean weight", blue.mean(), blue.standard_error(), map.integral()[2], 0));
  double density = 0;
  for (int row = 0; row < 10; ++row) {
    for (int column = 0; column < 20; ++column) {
      density += static_cast<double>(map.pdf(map.centre(row, column).cast<float>())) *
                 map.solid_angle(row);
    }
  }
  EXPECT_NEAR(density, 1, 1e-6);
}

TEST(EnvironmentMap, BlackMapsAreSampledUniformly) {
  const EnvironmentMap map(4, 2, std::vector<Rgb>(8, Rgb::Zero()));
  RandomStream random(4, RandomStage::kTest, 0, 0);
  const LightSample sample = map.sample(random);
  EXPECT_NEAR(sample.pdf, 0.25F / kPif, 1e-7F);
  EXPECT_EQ(sample.weight.maxCoeff(), 0);
}

TEST(EnvironmentMapLaw, ReductionKeepsTheIntegral) {
  const EnvironmentMap map = uneven(30, 17);
  const Rgbd whole = map.integral();
  for (const auto& [width, height] : {std::pair{30, 17}, {15, 17}, {7, 5}, {29, 16}, {1, 1}}) {
    const EnvironmentMap reduced = map.reduced(width, height);
    EXPECT_LT(((reduced.integral() - whole) / whole).abs().maxCoeff(), 1e-6) << width;
  }
  EXPECT_EQ(map.reduced(30, 17).pixel(3, 4)[1], map.pixel(3, 4)[1]);
}

TEST(EnvironmentMapFormat, ReadsBothFormatsAndRefusesBadRadiance) {
  const TemporaryFolder folder;
  Image image;
  image.width = 2;
  image.height = 1;
  for (const char* name : {"R", "G", "B"}) {
    image.channels[name].type = ChannelType::kFloat;
    image.channels[name].values = {1, 0.5F};
  }
  write_exr(folder.path() / "a.exr", image);
  std::ofstream(folder.path() / "a.HDR", std::ios::binary)
      << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x80\x80\x80";
  for (const char* name : {"a.exr", "a.HDR"}) {
    const EnvironmentMap map = EnvironmentMap::read(folder.path() / name);
    EXPECT_EQ(map.width(), 2);
    EXPECT_EQ(map.pixel(0, 0)[2], 1);
    EXPECT_EQ(map.pixel(0, 1)[0], 0.5F);
  }
  for (const float bad :
       {-1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    image.channels["G"].values[1] = bad;
    write_exr(folder.path() / "b.exr", image);
    EXPECT_THROW(EnvironmentMap::read(folder.path() / "b.exr"), FileError);
  }
  image.channels.erase("G");
  write_exr(folder.path() / "c.exr", image);
  EXPECT_THROW(EnvironmentMap::read(folder.path() / "c.exr"), FileError);
  EXPECT_THROW(EnvironmentMap::read(folder.path() / "none.hdr"), FileError);
}

}  // namespace
}  // namespace heddle

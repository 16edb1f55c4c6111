#include "render/bright_sources.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/environment_sgs.h"
#include "tests/support/pictures.h"

namespace heddle {
namespace {

constexpr int kAcross = 512;

/// A smooth sky with disks of constant radiance in it.
struct Disk {
  Vec3 axis;
  double radius_deg;
  Rgb radiance;
};
EnvironmentMap sky_with(const std::vector<Disk>& disks) {
  const Light sky = test::sg_light({0, 0, 1}, 2, {4, 5, 7});
  std::vector<Rgb> radiance(kAcross * kAcross / 2);
  const EnvironmentMap grid(kAcross, kAcross / 2, radiance);
  for (int row = 0; row < kAcross / 2; ++row) {
    for (int column = 0; column < kAcross; ++column) {
      const Vec3 w = grid.centre(row, column).cast<float>();
      Rgb& pixel = radiance[static_cast<std::size_t>(kAcross * row + column)];
      pixel = light_radiance(sky, w);
      for (const Disk& disk : disks) {
        if (w.dot(disk.axis.normalized()) > std::cos(radians(disk.radius_deg)))
          pixel += disk.radiance;
      }
    }
  }
  return {kAcross, kAcross / 2, radiance};
}

Rgbd light_of(const std::vector<Light>& lights) {
  Rgbd sum = Rgbd::Zero();
  for (const Light& light : lights) sum += light.irradiance.cast<double>();
  return sum;
}

double largest_difference(const Rgbd& a, const Rgbd& b) {
  return ((a - b) / b).abs().maxCoeff();
}

const Disk kSun = {{1, -0.5F, 0.6F}, 1, {3000, 2800, 2000}};
const Disk kLamp = {{-1, 0.02F, 0.3F}, 2, {200, 300, 400}};  // across the picture's seam

TEST(BrightSourcesLaw, SourcesAndRestAddUpToTheMap) {
  const EnvironmentMap map = sky_with({kSun, kLamp});
  const SplitEnvironment split = split_bright_sources(map, 4);
  ASSERT_EQ(split.sources.size(), 2U);
  EXPECT_LT(largest_difference(light_of(split.sources) + split.rest.integral(), map.integral()),
            1e-6);
  for (int row = 0; row < map.height(); ++row) {
    for (int column = 0; column < map.width(); ++column)
      EXPECT_TRUE((split.rest.pixel(row, column) <= map.pixel(row, column)).all());
  }
}

TEST(BrightSourcesLaw, ADiskHasItsPlaceLightAndWidth) {
  const SplitEnvironment split = split_bright_sources(sky_with({kSun, kLamp}), 4);
  ASSERT_EQ(split.sources.size(), 2U);
  const Disk disks[] = {kSun, kLamp};
  for (std::size_t k = 0; k < 2; ++k) {
    const Disk& disk = disks[k];
    const Light& source = split.sources[k];
    // A pixel is 0.7 degrees.
    EXPECT_GT(source.axis.dot(disk.axis.normalized()), std::cos(radians(0.2)));
    const double depth = 1 - std::cos(radians(disk.radius_deg));
    EXPECT_NEAR(static_cast<double>(source.irradiance[0]) /
                    (2 * kPi * depth * static_cast<double>(disk.radiance[0])),
                1, 0.2);
    // The mean of 1 - cosine over a disk is half of the rim's.
    EXPECT_NEAR(static_cast<double>(source.sharpness) * 0.5 * depth, 1, 0.3);
  }
}

TEST(BrightSources, TakesNoMoreThanAsked) {
  const SplitEnvironment split = split_bright_sources(sky_with({kSun, kLamp}), 1);
  ASSERT_EQ(split.sources.size(), 1U);
  EXPECT_GT(split.sources[0].axis.dot(kSun.axis.normalized()), 0.999F);
}

TEST(BrightSources, LeavesWhatIsWideOrSmoothOrWeak) {
  const Disk window = {{1, 1, 0.5F}, 12, {300, 300, 300}};
  const Disk spark = {{0, 1, 0.5F}, 0.6, {3, 3, 3}};
  EXPECT_TRUE(split_bright_sources(sky_with({}), 4).sources.empty());
  EXPECT_TRUE(split_bright_sources(sky_with({window, spark}), 4).sources.empty());
  // A lamp is found beside a window that is brighter.
  EXPECT_EQ(split_bright_sources(sky_with({window, kLamp}), 4).sources.size(), 1U);
  const EnvironmentMap black(8, 4, std::vector<Rgb>(32, Rgb::Zero()));
  EXPECT_TRUE(split_bright_sources(black, 4).sources.empty());
}

TEST(BrightSourcesLaw, TheFitKeepsTheLightAndItsDirection) {
  const EnvironmentMap map = sky_with({kSun, kLamp});
  const EnvironmentSgs before = fit_environment_sgs(map, 6);
  const EnvironmentSgs after = fit_environment_sgs(map, 6, 4);
  EXPECT_EQ(before.bright_sources, 0);
  EXPECT_EQ(after.bright_sources, 2);
  ASSERT_EQ(after.lights.size(), 8U);
  EXPECT_LT(after.energy_error, 1e-3);
  EXPECT_LT(largest_difference(light_of(after.lights), map.integral()), 1e-3);
  EXPECT_LT(after.irradiance_error, 0.01);
  EXPECT_LT(after.irradiance_error, before.irradiance_error);
}

// The errors that are stated, against sums over normals and pixels.
TEST(BrightSourcesAgreement, StatedErrorsAreThose) {
  const EnvironmentMap map = sky_with({{{1, 1, 0.5F}, 20, {9, 8, 7}}}).reduced(128, 64);
  const EnvironmentSgs fit = fit_environment_sgs(map, 2);
  double error = 0;
  double all = 0;
  const EnvironmentMap normals(24, 12, std::vector<Rgb>(288, Rgb::Zero()));
  for (int r = 0; r < 12; ++r) {
    for (int c = 0; c < 24; ++c) {
      const Vec3d n = normals.centre(r, c);
      Rgbd wanted = Rgbd::Zero();
      Rgbd got = Rgbd::Zero();
      for (int row = 0; row < map.height(); ++row) {
        for (int column = 0; column < map.width(); ++column) {
          const Vec3d w = map.centre(row, column);
          const double weight = map.solid_angle(row) * std::max(0.0, n.dot(w));
          if (weight == 0) continue;
          wanted += weight * map.pixel(row, column).cast<double>();
          for (const Light& light : fit.lights)
            got += weight * light_radiance(light, w.cast<float>()).cast<double>();
        }
      }
      error += normals.solid_angle(r) * (got - wanted).square().sum();
      all += normals.solid_angle(r) * wanted.square().sum();
    }
  }
  EXPECT_NEAR(fit.irradiance_error / std::sqrt(error / all), 1, 0.05);
}

}  // namespace
}  // namespace heddle

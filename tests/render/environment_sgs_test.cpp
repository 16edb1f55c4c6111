#include "render/environment_sgs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "tests/support/pictures.h"

namespace heddle {
namespace {

EnvironmentMap map_of(const std::vector<Light>& lights, int width, int height) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(width * height), Rgb::Zero());
  const EnvironmentMap grid(width, height, radiance);
  for (int row = 0, k = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column, ++k) {
      for (const Light& light : lights) {
        radiance[static_cast<std::size_t>(k)] +=
            light_radiance(light, grid.centre(row, column).cast<float>());
      }
    }
  }
  return {width, height, radiance};
}

// The error without any blur.
double relative_error(const EnvironmentMap& map, const std::vector<Light>& lights) {
  double error = 0;
  double norm = 0;
  for (int row = 0; row < map.height(); ++row) {
    for (int column = 0; column < map.width(); ++column) {
      Rgb difference = map.pixel(row, column);
      norm += map.solid_angle(row) * static_cast<double>(difference.matrix().squaredNorm());
      for (const Light& light : lights)
        difference -= light_radiance(light, map.centre(row, column).cast<float>());
      error += map.solid_angle(row) * static_cast<double>(difference.matrix().squaredNorm());
    }
  }
  return std::sqrt(error / norm);
}

TEST(EnvironmentSgs, FindsOneGaussian) {
  const Light light = test::sg_light({1, -2, 0.5F}, 40, {3, 2, 1});
  const EnvironmentSgs fit = fit_environment_sgs(map_of({light}, 128, 64), 1);
  ASSERT_EQ(fit.lights.size(), 1U);
  EXPECT_LT(fit.relative_error, 2e-3);  // a blurred Gaussian is not quite one
  EXPECT_GT(fit.lights[0].axis.dot(light.axis), 1 - 1e-6F);
  EXPECT_NEAR(fit.lights[0].sharpness, 40, 0.8);  // pixels of 2.8 degrees add 1 % to its variance
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(fit.lights[0].irradiance[c], light.irradiance[c], 0.01 * light.irradiance[c]);
}

TEST(EnvironmentSgs, FindsSeveralOnTopOfAConstant) {
  const std::vector<Light> lights = {
      test::sg_light({0, 0, 1}, 0, {20, 20, 30}), test::sg_light({1, 0, 1}, 30, {6, 5, 4}),
      test::sg_light({-1, 1, 0.2F}, 90, {3, 3, 3}), test::sg_light({0, -1, 0}, 8, {0, 4, 8})};
  const EnvironmentSgs fit = fit_environment_sgs(map_of(lights, 256, 128), 4);
  EXPECT_LT(fit.relative_error, 5e-3);  // the constant's sharpness stays a little above 0
  EXPECT_NEAR(fit.lights[0].irradiance[2], 30, 0.3);
}

EnvironmentMap busy_map() {
  RandomStream random(7, RandomStage::kTest, 0, 0);
  std::vector<Light> lights = {test::sg_light({0, 0, 1}, 1, {5, 6, 8})};
  for (int k = 0; k < 30; ++k) {
    const Vec3 axis = sample_sphere(random);
    const float sharpness = 5 * std::exp2(3 * random.uniform());
    lights.push_back(
        test::sg_light(axis, sharpness, Rgb(random.uniform(), random.uniform(), random.uniform())));
  }
  return map_of(lights, 96, 48);
}

TEST(EnvironmentSgsLaw, MoreGaussiansNeverDoWorse) {
  const EnvironmentMap map = busy_map();
  double before = 1;
  std::vector<double> errors;
  for (const int count : {1, 2, 4, 8, 16}) {
    const EnvironmentSgs fit = fit_environment_sgs(map, count);
    EXPECT_LT(fit.relative_error, before) << count;
    // Most of this map is broader than the blur.
    EXPECT_NEAR(fit.relative_error, relative_error(map, fit.lights), 0.3 * fit.relative_error)
        << count;
    before = fit.relative_error;
    errors.push_back(before);
    for (const Light& light : fit.lights) {
      EXPECT_FALSE(light.is_directional());
      EXPECT_GE(light.irradiance.minCoeff(), 0);
      EXPECT_LE(light.sharpness, kSharpestLight);
      EXPECT_NEAR(light.axis.norm(), 1, 1e-6);
    }
  }
  EXPECT_LT(errors.back(), 0.5 * errors.front());  // half of the Gaussians that the map is made of
}

// Where least squares leaves no residual along a Gaussian, the light's total is nearly that of the
// map.
TEST(EnvironmentSgsLaw, TotalLightIsNearlyKept) {
  const EnvironmentMap map = busy_map();
  Rgbd sum = Rgbd::Zero();
  for (const Light& light : fit_environment_sgs(map, 16).lights)
    sum += light.irradiance.cast<double>();
  EXPECT_LT(((sum - map.integral()) / map.integral()).abs().maxCoeff(), 0.05);
}

TEST(EnvironmentSgs, EqualMapsGiveEqualLights) {
  const EnvironmentSgs a = fit_environment_sgs(busy_map(), 6);
  const EnvironmentSgs b = fit_environment_sgs(busy_map(), 6);
  for (std::size_t k = 0; k < a.lights.size(); ++k) {
    EXPECT_EQ(a.lights[k].axis, b.lights[k].axis);
    EXPECT_EQ(a.lights[k].sharpness, b.lights[k].sharpness);
    EXPECT_TRUE((a.lights[k].irradiance == b.lights[k].irradiance).all());
  }
}

TEST(EnvironmentSgsStability, BlackAndTinyMapsAndASun) {
  const EnvironmentSgs black =
      fit_environment_sgs(EnvironmentMap(4, 2, std::vector<Rgb>(8, Rgb::Zero())), 3);
  EXPECT_EQ(black.lights.size(), 3U);
  EXPECT_EQ(black.relative_error, 0);
  EXPECT_EQ(black.lights[0].irradiance.maxCoeff(), 0);

  const EnvironmentSgs one = fit_environment_sgs(EnvironmentMap(1, 1, {Rgb(1, 2, 3)}), 2);
  EXPECT_LT(one.relative_error, 1e-3);

  // One pixel a million times as bright as the sky, which holds 12 times its light: one Gaussian
  // each.
  std::vector<Rgb> sky(512 * 256, Rgb::Constant(1));
  sky[512 * 60 + 100] = Rgb::Constant(1e6F);
  const EnvironmentMap map(512, 256, sky);
  const EnvironmentSgs fit = fit_environment_sgs(map, 2);
  const double light_of_sun = 1e6 * map.solid_angle(60);
  const Light& sun = fit.lights[0];
  EXPECT_NEAR(sun.irradiance[0], light_of_sun, 0.01 * light_of_sun);
  EXPECT_GT(sun.axis.cast<double>().dot(map.centre(60, 100)), std::cos(0.0125))
      << "the fit's pixels are 0.0245 wide";
  EXPECT_GT(sun.sharpness, 1000);
  EXPECT_NEAR(fit.lights[1].irradiance[0], 4 * kPi, 0.05 * 4 * kPi);
}

}  // namespace
}  // namespace heddle

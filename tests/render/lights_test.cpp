#include "render/lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"
#include "render/environment_map.h"

namespace heddle {
namespace {

Light sg_light(float sharpness) {
  Light light;
  light.type = LightType::kSphericalGaussian;
  light.axis = Vec3(1, 2, 2).normalized();
  light.sharpness = sharpness;
  light.irradiance = {3, 2, 1};
  return light;
}

TEST(LightsLaw, RadianceIntegratesToTheIrradiance) {
  for (const float sharpness : {0.0F, 1.0F, 20.0F, 500.0F}) {
    const Light light = sg_light(sharpness);
    // Rotationally symmetric: over the cosine to the axis, in panels that narrow towards it.
    double integral = 0;
    for (double low = 2; low > 1e-8; low /= 2) {
      integral += integrate(gauss_legendre(16, low / 2, low), [&](double one_minus_cosine) {
        const double c = 1 - one_minus_cosine;
        const Vec3d across = light.axis.cast<double>().unitOrthogonal();
        const Vec3d direction =
            c * light.axis.cast<double>() + std::sqrt(std::max(0.0, 1 - c * c)) * across;
        return 2 * kPi * static_cast<double>(light_radiance(light, direction.cast<float>())[0]);
      });
    }
    // directions are rounded to float: 1e-7 * sharpness
    EXPECT_NEAR(integral, 3, 3e-4) << sharpness;
  }
}

TEST(Lights, ConstantLightComesFromEverywhere) {
  const Light light = sg_light(0);
  EXPECT_NEAR(light_radiance(light, -light.axis)[0], 3 / (4 * kPi), 1e-6);
}

TEST(LightsLaw, WeightTimesDensityIsRadiance) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const float sharpness : {0.0F, 5.0F, 150.0F}) {
    const Light light = sg_light(sharpness);
    for (int k = 0; k < 100; ++k) {
      const LightSample sample = sample_light(light, Vec3d::Zero(), random);
      EXPECT_NEAR(sample.pdf, light_pdf(light, sample.direction), 1e-5F * sample.pdf);
      const Rgb radiance = light_radiance(light, sample.direction);
      EXPECT_NEAR(radiance[1], sample.weight[1] * sample.pdf, 1e-5F * radiance[1]);
    }
  }
}

TEST(Lights, DirectionalLightIsFoundOnlyBySampling) {
  Light light;
  light.axis = Vec3(0, 0.6F, 0.8F);
  light.irradiance = {1, 2, 3};
  RandomStream random(1, RandomStage::kTest, 0, 0);
  const LightSample sample = sample_light(light, Vec3d::Zero(), random);
  EXPECT_EQ(sample.direction, light.axis);
  EXPECT_EQ(sample.weight[2], 3);
  EXPECT_EQ(sample.pdf, 0);
  EXPECT_EQ(light_radiance(light, light.axis)[0], 0);
}

/// A picture whose quarter about +x is bright, the rest dim.
Light environment(double turn_deg) {
  std::vector<Rgb> radiance(8 * 4, Rgb(0.1F, 0.1F, 0.1F));
  for (int row = 0; row < 4; ++row) {
    for (const int column : {3, 4})
      radiance[static_cast<std::size_t>(8 * row + column)] = Rgb(3, 2, 1);
  }
  Light light;
  light.type = LightType::kEnvironment;
  light.map = std::make_shared<const EnvironmentMap>(8, 4, radiance);
  light.axis = Vec3d(std::cos(radians(turn_deg)), std::sin(radians(turn_deg)), 0).cast<float>();
  light.irradiance = {2, 2, 4};
  light.gaussians = 6;
  return light;
}

TEST(LightsLaw, AnEnvironmentTurnsWithItsAxis) {
  EXPECT_FLOAT_EQ(light_radiance(environment(0), Vec3(1, 0, 0))[0], 6);
  EXPECT_FLOAT_EQ(light_radiance(environment(0), Vec3(0, 1, 0))[0], 0.2F);
  EXPECT_FLOAT_EQ(light_radiance(environment(90), Vec3(0, 1, 0))[2], 4);
  EXPECT_FLOAT_EQ(light_radiance(environment(90), Vec3(1, 0, 0))[2], 0.4F);
}

TEST(LightsLaw, AnEnvironmentsWeightTimesDensityIsRadiance) {
  const Light light = environment(35);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    const LightSample sample = sample_light(light, Vec3d::Zero(), random);
    EXPECT_NEAR(sample.pdf, light_pdf(light, sample.direction), 1e-4F * sample.pdf);
    const Rgb radiance = light_radiance(light, sample.direction);
    EXPECT_NEAR(radiance[1], sample.weight[1] * sample.pdf, 1e-4F * radiance[1]);
  }
}

// The Gaussians bring the environment's light in sum, each from where it was turned to, and other
// lights stay as they are.
TEST(LightsAgreement, GaussiansStandForAnEnvironment) {
  const Light other = sg_light(20);
  const std::vector<Light> scene = {other, environment(90)};
  const FittedLights fitted = fit_environments(scene);
  ASSERT_EQ(fitted.lights.size(), 7U);
  EXPECT_EQ(fitted.lights[0].sharpness, other.sharpness);
  EXPECT_GT(fitted.relative_error, 0);
  EXPECT_LT(fitted.relative_error, 0.2);
  Rgb sum = Rgb::Zero();
  Vec3 towards = Vec3::Zero();
  for (std::size_t k = 1; k < fitted.lights.size(); ++k) {
    EXPECT_EQ(fitted.lights[k].type, LightType::kSphericalGaussian);
    sum += fitted.lights[k].irradiance;
    towards += fitted.lights[k].irradiance[0] * fitted.lights[k].axis;
  }
  const Rgbd integral = scene[1].map->integral();
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(sum[c] / (integral[c] * scene[1].irradiance[c]), 1, 0.1) << c;
  EXPECT_GT(towards.normalized().y(), 0.95F);
}

}  // namespace
}  // namespace heddle

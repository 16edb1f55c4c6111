#include "render/lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"

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
        const Vec3d direction = c * light.axis.cast<double>() + std::sqrt(std::max(0.0, 1 - c * c)) * across;
        return 2 * kPi * static_cast<double>(light_radiance(light, direction.cast<float>())[0]);
      });
    }
    EXPECT_NEAR(integral, 3, 3e-4) << sharpness;  // directions are rounded to float: 1e-7 * sharpness
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
      const LightSample sample = sample_light(light, random);
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
  const LightSample sample = sample_light(light, random);
  EXPECT_EQ(sample.direction, light.axis);
  EXPECT_EQ(sample.weight[2], 3);
  EXPECT_EQ(sample.pdf, 0);
  EXPECT_EQ(light_radiance(light, light.axis)[0], 0);
}

}  // namespace
}  // namespace heddle

#include "render/stand_in/stand_in.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/fibonacci_axes.h"
#include "tests/render/stand_in/two_texels.h"

namespace heddle {
namespace {

Rgbd integral(const StandIn& stand_in, const StandInTexel& texel, const Vec3d& wo) {
  constexpr int kDirections = 20000;
  Rgbd sum = Rgbd::Zero();
  for (const Vec3d& wi : fibonacci_axes(FibonacciSet::kSphere, kDirections))
    sum += stand_in.radiance(texel, wi, wo) * 4 * kPi / kDirections;
  return sum;
}

Vec3d direction(double theta_degrees, double azimuth_degrees) {
  const double theta = radians(theta_degrees);
  const double azimuth = radians(azimuth_degrees);
  return {std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth),
          std::cos(theta)};
}

// A white sheet under a white sky is white: what a layer takes from those below, it sends back
// itself. With the isotropic gloss that the layers reckon with.
TEST(StandInLaw, AWhiteSheetSendsOnAllLight) {
  FlatMaps maps = test::two_texels();
  maps.albedo.assign(2, Rgb::Ones());
  StandInParameters parameters;
  parameters.alpha_along = parameters.alpha_across = 0.5;
  parameters.reflectance = 1.0 / 9;
  parameters.subsurface = 0.4;
  for (const double sheen : {0.0, 0.5}) {
    parameters.sheen = sheen;
    const StandIn stand_in(maps, parameters);
    for (const double theta : {0.0, 40.0, 65.0}) {
      const Rgbd sum = integral(stand_in, stand_in.texel(0), direction(theta, 20));
      // The tables of the layers have steps of 1/32 in the cosine.
      EXPECT_NEAR(sum[0], 1, 0.01) << sheen << " " << theta;
    }
  }
}

TEST(StandInLaw, GlossAndSheenAreReciprocal) {
  const FlatMaps maps = test::two_texels();
  StandInParameters parameters;
  parameters.sheen = 0;  // the layers below are not reciprocal, as in MaterialX
  const StandIn stand_in(maps, parameters);
  const StandInTexel texel = stand_in.texel(1);
  const Vec3d a = direction(50, 30);
  const Vec3d b = direction(20, 200);
  const StandInLayers there = stand_in.layers(texel, a, b);
  const StandInLayers back = stand_in.layers(texel, b, a);
  EXPECT_GT(there.specular, 0);
  EXPECT_NEAR(there.specular / a.z(), back.specular / b.z(), 1e-9);
}

// Light from fibers spreads across them.
TEST(StandIn, TheHighlightIsWideAcrossTheFibers) {
  const FlatMaps maps = test::two_texels();
  StandInParameters parameters;
  parameters.alpha_along = 0.1;
  parameters.alpha_across = 0.6;
  const StandIn stand_in(maps, parameters);
  const auto gloss = [&](std::size_t texel, double azimuth) {
    return stand_in.layers(stand_in.texel(texel), direction(50, azimuth), Vec3d::UnitZ()).specular;
  };
  EXPECT_GT(gloss(0, 90), 20 * gloss(0, 0));  // fibers along x
  EXPECT_GT(gloss(1, 0), 20 * gloss(1, 90));  // along y
}

// Under light from below only what goes through is seen, and from above nothing of it.
TEST(StandIn, LightFromBelowGoesThroughTheBase) {
  const FlatMaps maps = test::two_texels();
  StandInParameters parameters;
  parameters.subsurface = 0.25;
  parameters.subsurface_tint = Rgbd(1, 0.5, 0);
  const StandIn stand_in(maps, parameters);
  const Rgbd below = stand_in.radiance(stand_in.texel(0), direction(150, 0), direction(10, 90));
  EXPECT_GT(below[0], 0);
  EXPECT_NEAR(below[1] / below[0], 0.5 * 0.4 / 0.6, 1e-6);
  EXPECT_EQ(below[2], 0);
  parameters.subsurface = 0;
  const StandIn opaque(maps, parameters);
  EXPECT_EQ(opaque.radiance(opaque.texel(0), direction(150, 0), direction(10, 90)).maxCoeff(), 0);
}

// Lights draw the same as the sum over directions: the picture of a sheet under an even sky.
TEST(StandInAgreement, ThePictureIsTheIntegralOverTheLight) {
  const FlatMaps maps = test::two_texels();
  const StandIn stand_in(maps, {});
  Light sky;
  sky.type = LightType::kSphericalGaussian;
  sky.sharpness = 0;
  sky.irradiance = Rgb::Constant(4 * kPif);
  const std::vector<Rgb> picture = picture_from_above(stand_in, {&sky, 1}, 16384, 1);
  const Rgbd expected = integral(stand_in, stand_in.texel(0), Vec3d::UnitZ());
  // Relative deviation of one draw is about 1.5, and draws are stratified.
  EXPECT_NEAR(picture[0][0] / expected[0], 1, 0.02);
  EXPECT_NEAR(picture[0][2] / expected[2], 1, 0.02);
}

}  // namespace
}  // namespace heddle

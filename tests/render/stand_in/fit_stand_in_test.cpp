#include "render/stand_in/fit_stand_in.h"

#include <gtest/gtest.h>

#include "tests/render/stand_in/two_texels.h"

namespace heddle {
namespace {

/// What the stand-in itself sends, as if it were the fabric.
FlatResponse own_response_of(const StandIn& stand_in, int views, int lights, double turn) {
  FlatResponse response;
  response.views = cap_directions(views, 70, turn);
  response.lights = cap_directions(lights, 70, turn + 1);
  for (const Vec3& above : cap_directions(lights / 2, 70, turn + 2))
    response.lights.emplace_back(above.x(), above.y(), -above.z());
  response.radiance.resize(response.views.size() * response.lights.size());
  const std::vector<StandInTexel> texels = spread_texels(stand_in, 512);
  for (std::size_t pair = 0; pair < response.pair_count(); ++pair) {
    Rgbd sum = Rgbd::Zero();
    for (const StandInTexel& texel : texels) {
      sum += stand_in.radiance(texel, response.light(pair).cast<double>(),
                               response.view(pair).cast<double>()) /
             512;
    }
    response.radiance[pair] = {sum, sum};
  }
  return response;
}

StandInParameters some_parameters() {
  StandInParameters parameters;
  parameters.alpha_along = 0.15;
  parameters.alpha_across = 0.5;
  parameters.base_scale = Rgbd(1, 0.9, 0.8);
  parameters.subsurface = 0.3;
  parameters.reflectance = 0.08;
  parameters.specular_color = Rgbd(1, 0.8, 0.6);
  parameters.sheen = 0.3;
  parameters.sheen_color = Rgbd(0.7, 0.8, 1);
  parameters.sheen_roughness = 0.35;
  return parameters;
}

// Data that the model itself made: the fit finds the model again, and says so of pairs that it has
// not seen.
TEST(FitStandInLaw, TheModelsOwnDataGiveItsParameters) {
  const FlatMaps maps = test::two_texels();
  const StandInParameters made = some_parameters();
  const StandIn fabric(maps, made);
  const StandInParameters found = fit_stand_in(maps, own_response_of(fabric, 12, 8, 0));
  // The search ends at steps of 5 %.
  EXPECT_NEAR(found.alpha_along / made.alpha_along, 1, 0.1);
  EXPECT_NEAR(found.alpha_across / made.alpha_across, 1, 0.1);
  // Reflectance and colour nearly stand for each other: what they give at normal incidence.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(
        found.reflectance * found.specular_color[c] / (made.reflectance * made.specular_color[c]),
        1, 0.1)
        << c;
  }
  EXPECT_NEAR(found.subsurface, made.subsurface, 0.02);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.sheen * found.sheen_color[c], made.sheen * made.sheen_color[c], 0.05) << c;
    EXPECT_NEAR(found.base_scale[c], made.base_scale[c], 0.03) << c;
    EXPECT_NEAR(found.subsurface_tint[c], 1, 0.05) << c;
  }
  const StandIn stand_in(maps, found);
  const FlatResponse others = own_response_of(fabric, 7, 6, 0.5);
  for (const bool from_below : {false, true}) {
    const auto error = stand_in_error(stand_in, others, from_below);
    ASSERT_TRUE(error.has_value());
    EXPECT_LT(error->rmse, 0.03) << from_below;
    EXPECT_NEAR(error->mean, 0, 0.01) << from_below;
  }
}

TEST(FitStandInLaw, ErrorsAreThoseOfTheData) {
  const FlatMaps maps = test::two_texels();
  const StandIn stand_in(maps, some_parameters());
  FlatResponse response = own_response_of(stand_in, 4, 4, 0);
  // Texels that stand for the maps are more than those of the data: shares differ by 1/512.
  constexpr double kShares = 2e-3;
  EXPECT_NEAR(stand_in_error(stand_in, response, false)->rmse, 0, kShares);
  // Noise that the halves do not share is not counted.
  FlatResponse noisy = response;
  for (std::size_t pair = 0; pair < noisy.pair_count(); ++pair)
    noisy.radiance[pair][pair % 2] += pair % 4 < 2 ? 0.02 : -0.02;
  EXPECT_NEAR(stand_in_error(stand_in, noisy, false)->rmse, 0, kShares);
  // A fabric of twice the radiance: the stand-in lacks half of it.
  for (auto& halves : response.radiance) {
    for (Rgbd& half : halves) half *= 2;
  }
  const auto half = stand_in_error(stand_in, response, false);
  EXPECT_NEAR(half->mean, -0.5, kShares);
  EXPECT_GE(half->rmse, 0.5 - kShares);
  // Nothing comes from below: there is no relative error.
  StandInParameters opaque = some_parameters();
  opaque.subsurface = 0;
  const StandIn wall(maps, opaque);
  EXPECT_FALSE(stand_in_error(wall, own_response_of(wall, 4, 4, 0), true).has_value());
}

// A fabric without any light gives a black stand-in, not a broken one.
TEST(FitStandIn, BlackClothGivesFiniteParameters) {
  FlatMaps maps = test::two_texels();
  maps.albedo.assign(2, Rgb::Zero());
  FlatResponse response;
  response.views = cap_directions(3, 60, 0);
  response.lights = cap_directions(3, 60, 1);
  response.radiance.assign(9, {Rgbd::Zero(), Rgbd::Zero()});
  const StandInParameters found = fit_stand_in(maps, response);
  const StandIn stand_in(maps, found);
  const Rgbd value = stand_in.radiance(stand_in.texel(0), Vec3d(0.6, 0, 0.8), Vec3d::UnitZ());
  EXPECT_TRUE(value.isFinite().all());
  EXPECT_NEAR(value.maxCoeff(), 0, 1e-4);
}

}  // namespace
}  // namespace heddle

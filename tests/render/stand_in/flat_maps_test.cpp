#include "render/stand_in/flat_maps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

FlatMaps maps_of(const Exemplar& exemplar, int pixels, int spp,
                 std::span<const Light> lights = {}) {
  const TileScene scene(exemplar);
  return bake_flat_maps(scene, bcsdf_tables(exemplar.scattering), lights,
                        {.pixels = pixels, .spp = spp, .seed = 1}, [](double) {});
}

/// A closed layer of four fibers along x on a tile of 1 mm.
Exemplar closed_layer(const FiberScattering& scattering) {
  return test::straight_fibers(1, 1, {{.125F, 0}, {.375F, 0}, {.625F, 0}, {.875F, 0}}, 0.125F, 8,
                               scattering);
}

// A fiber across the seam covers the first and the last row, and what is left of its axis in the
// upper row is right of it in the lower one: the maps tile.
TEST(FlatMaps, AFiberGoesOnAcrossTheSeam) {
  const FlatMaps maps =
      maps_of(test::straight_fibers(1, 1, {{0, 0}}, 0.125F, 8, test::white_fiber()), 8, 16);
  ASSERT_EQ(maps.width, 8);
  ASSERT_EQ(maps.height, 8);
  for (std::size_t texel = 0; texel < maps.texel_count(); ++texel) {
    const std::size_t row = texel / 8;
    EXPECT_EQ(maps.opacity[texel], row == 0 || row == 7 ? 1.0F : 0.0F) << texel;
    const float tilt = maps.normal[texel].y();
    EXPECT_TRUE(row == 0 ? tilt < -0.2F : row == 7 ? tilt > 0.2F : tilt == 0) << texel;
  }
}

// Seen from above, the normals of a closed layer of cylinders lie evenly over -1 .. 1 across them:
// mean 0, variance 1/3. Along them they do not tilt.
TEST(FlatMapsLaw, NormalsOfAFlatBundle) {
  const FlatMaps maps = maps_of(closed_layer(test::white_fiber()), 1, 1024);
  ASSERT_EQ(maps.texel_count(), 1U);
  // Stratified rays err by far less than 1 / sqrt(1024).
  EXPECT_NEAR(maps.normal[0].y(), 0, 0.01);
  EXPECT_NEAR(maps.normal[0].z(), 1, 0.01);
  EXPECT_NEAR(maps.tilt_across[0], 1.0 / 3, 0.01);
  EXPECT_NEAR(maps.tilt_along[0], 0, 1e-6);
  EXPECT_NEAR(std::abs(maps.along[0].x()), 1, 1e-6);
}

// The cover of parallel fibers that do not touch: their diameters.
TEST(FlatMapsLaw, OpacityIsTheCoverOfTheFibers) {
  const Exemplar fibers =
      test::straight_fibers(1, 2, {{0.3F, 0}, {1.1F, 0.4F}}, 0.1F, 8, test::white_fiber());
  const FlatMaps maps = maps_of(fibers, 16, 64);
  EXPECT_EQ(maps.width, 8);
  EXPECT_EQ(maps.height, 16);
  EXPECT_NEAR(maps.cover(), 2 * 2 * 0.1 / 2, 0.003);
}

// White fibers send on all light, wherever it comes from. So under a sky of radiance 1 all around
// what is seen has radiance 1, and of an even sky above it shows a share, alike in all colours.
TEST(FlatMapsLaw, WhiteFibersUnderAWhiteSky) {
  Light sky;
  sky.type = LightType::kSphericalGaussian;
  sky.sharpness = 0;
  sky.irradiance = Rgb::Constant(4 * kPif);
  const FlatMaps maps = maps_of(closed_layer(test::white_fiber()), 4, 64, {&sky, 1});
  for (std::size_t texel = 0; texel < maps.texel_count(); ++texel) {
    EXPECT_NEAR(maps.picture[texel].minCoeff(), 1, 1e-3);
    EXPECT_NEAR(maps.picture[texel].maxCoeff(), 1, 1e-3);
    EXPECT_LE(maps.albedo[texel].maxCoeff(), 1.0F + 1e-3F);
    EXPECT_GT(maps.albedo[texel].minCoeff(), 0.5F);
    EXPECT_NEAR(maps.albedo[texel].minCoeff(), maps.albedo[texel].maxCoeff(), 1e-4);
  }
}

}  // namespace
}  // namespace heddle

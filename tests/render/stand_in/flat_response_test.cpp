#include "render/stand_in/flat_response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/fibonacci_axes.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

// White fibers send on all light: over the whole sphere of lights, radiance per irradiance adds up
// to 1 where cloth is closed, and to its cover where it is not.
TEST(FlatResponseLaw, LightAddsUpToTheCover) {
  const Exemplar fibers =
      test::straight_fibers(1, 1, {{.25F, 0}, {.75F, 0}}, 0.15F, 8, test::white_fiber());
  const TileScene scene(fibers);
  const std::vector<BcsdfTable> materials = {BcsdfTable(fibers.scattering[0])};
  constexpr int kLights = 128;
  std::vector<Vec3> lights;
  for (const Vec3d& axis : fibonacci_axes(FibonacciSet::kSphere, kLights))
    lights.push_back(axis.cast<float>());
  const std::vector<Vec3> views = {Vec3::UnitZ(), Vec3(std::sqrt(0.75F), 0, 0.5F)};
  const FlatResponse response =
      trace_flat_response(scene, materials, views, lights, 4096, 1, [](double) {});
  ASSERT_EQ(response.pair_count(), 2U * kLights);
  for (std::size_t v = 0; v < 2; ++v) {
    Rgbd sum = Rgbd::Zero();
    for (std::size_t l = 0; l < kLights; ++l)
      sum += response.mean(v * kLights + l) * 4 * kPi / kLights;
    // Both views run along the fibers or straight down, and see the same 0.6. What one path brings
    // back, of a few vertices, deviates by 0.65: three standard errors of 4096 rays.
    EXPECT_NEAR(sum[0], 0.6, 0.03) << v;
  }
  EXPECT_FALSE((response.radiance[0][0] == response.radiance[0][1]).all()) << "halves are two sets";
}

TEST(FlatResponse, DirectionsFillTheCap) {
  const std::vector<Vec3> directions = cap_directions(200, 60, 0.3);
  Vec3 sum = Vec3::Zero();
  for (const Vec3& direction : directions) {
    EXPECT_NEAR(direction.norm(), 1, 1e-6);
    EXPECT_GT(direction.z(), 0.5F);
    sum += direction / 200;
  }
  // The mean of directions that are even over a cap: half of 1 + cos of its edge.
  EXPECT_NEAR(sum.z(), 0.75, 1e-4);
  EXPECT_NEAR(sum.head<2>().norm(), 0, 0.01);
}

}  // namespace
}  // namespace heddle

// Coloured meshes beside cloth: how they are lit, and how light goes to and fro between both.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <memory>
#include <utility>

#include "fibers/math/sampling.h"
#include "render/path_tracer.h"
#include "render/precomputed_renderer.h"
#include "render/surface/paint.h"
#include "tests/support/fibers.h"
#include "tests/support/near_lights.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/statistics.h"
#include "tests/support/traced_world.h"

namespace heddle {
namespace {

std::shared_ptr<const Paint> paint(const Rgbd& color, std::optional<double> roughness = {},
                                   double reflectance = 0.04) {
  PaintConfig config;
  config.color = color;
  config.roughness = roughness;
  config.reflectance = Rgbd::Constant(reflectance);
  return std::make_shared<const Paint>(config);
}

ClothMesh ball(const Vec3d& centre, double radius, std::uint32_t rows = 24) {
  const std::uint32_t columns = 2 * rows;
  ClothMesh mesh;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double theta = kPi * row / rows;
      const double phi = 2 * kPi * column / columns;
      mesh.normals.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                std::cos(theta));
      mesh.positions.emplace_back(centre + radius * mesh.normals.back());
      mesh.fabric.emplace_back(0, 0);
      if (row == rows) continue;
      const std::uint32_t next = (column + 1) % columns;
      const std::uint32_t a = row * columns + column;
      const std::uint32_t b = row * columns + next;
      mesh.triangles.push_back({a, a + columns, b + columns});
      mesh.triangles.push_back({a, b + columns, b});
    }
  }
  return mesh;
}

/// A ball of radius 2 mm that touches a sheet of cloth from below, nearly.
TracedWorld ball_under_cloth(const FiberScattering& fiber, std::shared_ptr<const Paint> color,
                             std::vector<Light> lights) {
  TracedWorld world;
  const auto tile = std::make_shared<TileScene>(crossed_layers(fiber));
  std::vector<SurfaceCloth> solids;
  solids.emplace_back(std::move(color), ball({0, 0, -2.2}, 2), true);
  world.scene = std::make_unique<ClothScene>(std::vector<ClothPiece>{{tile, flat_cloth(3, 8)}},
                                             std::vector<TriangleMesh>{}, std::move(solids));
  world.materials = scene_materials(*world.scene);
  world.lights = std::move(lights);
  return world;
}

struct ColorMeans {
  RunningMean single[3];
  RunningMean total[3];
};

/// Over eye rays to a square about `target`, from `from`; rays that miss do not count.
ColorMeans measure_at(const PathTracer& tracer, const Vec3d& target, const Vec3& from, int samples,
                      std::uint64_t seed) {
  ColorMeans means;
  const Vec3 direction = -from.normalized();
  for (int k = 0; k < samples; ++k) {
    RandomStream random(seed, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
    const Vec3d place =
        target + Vec3d(random.uniform_double() - 0.5, random.uniform_double() - 0.5, 0);
    const EyeSample sample =
        tracer.trace({place - 20 * direction.cast<double>(), direction}, random);
    if (sample.alpha == 0) continue;
    for (int c = 0; c < 3; ++c) {
      means.single[c].add(static_cast<double>(sample.single[c]));
      means.total[c].add(static_cast<double>(sample.single[c] + sample.multiple[c]));
    }
  }
  return means;
}

const Vec3d kOnBall(1.9, 0, -2.2);  // seen from the side, below the cloth
const Vec3d kOnCloth(0, 0, 0);
const Vec3 kFromSide(1, 0.2F, 0.05F);
const Vec3 kFromAbove(0.3F, 0.2F, 1);

// Furnace: white fibers beside a white, glossy ball, in even light, are invisible, whichever way
// light is found. Any light lost or gained between the two would show.
TEST(SolidLaw, FurnaceOfClothAndBall) {
  const std::vector<Light> light = {
      test::sg_light({0, 0, 1}, 0, Rgb(1, 1, 1) * static_cast<float>(4 * kPi))};
  for (const std::optional<double> roughness : {std::optional<double>(), std::optional(0.4)}) {
    const TracedWorld world =
        ball_under_cloth(test::white_fiber(), paint(Rgbd::Ones(), roughness), light);
    for (const auto& [target, from] :
         {std::pair{kOnBall, kFromSide}, std::pair{kOnCloth, kFromAbove}}) {
      for (const LightEstimator estimator :
           {LightEstimator::kEscapes, LightEstimator::kShadowRays, LightEstimator::kCombined}) {
        const ColorMeans means = measure_at(world.tracer(estimator), target, from, 8000, 1);
        EXPECT_TRUE(means_agree("furnace", means.total[0].mean(), means.total[0].standard_error(),
                                1, 1.5e-3, 12));
      }
    }
  }
}

TEST(SolidStatistical, EstimatorsAgree) {
  const TracedWorld world = ball_under_cloth(test_cotton(), paint({0.8, 0.2, 0.1}, 0.3),
                                             {test::sg_light({0.9F, 0.3F, 0.4F}, 30, Rgb(3, 3, 3)),
                                              test::sphere_light({8, 3, -4}, 1, Rgb(10, 10, 10))});
  for (const auto& [target, from] :
       {std::pair{kOnBall, kFromSide}, std::pair{kOnCloth, kFromAbove}}) {
    const ColorMeans shadow =
        measure_at(world.tracer(LightEstimator::kShadowRays), target, from, 20'000, 2);
    const ColorMeans escapes =
        measure_at(world.tracer(LightEstimator::kEscapes), target, from, 100'000, 3);
    const ColorMeans both = measure_at(world.tracer(), target, from, 20'000, 4);
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(means_agree("shadow rays, escapes", shadow.total[c].mean(),
                              shadow.total[c].standard_error(), escapes.total[c].mean(),
                              escapes.total[c].standard_error(), 12));
      EXPECT_TRUE(means_agree("shadow rays, both", shadow.total[c].mean(),
                              shadow.total[c].standard_error(), both.total[c].mean(),
                              both.total[c].standard_error(), 12));
    }
  }
}

// An integrating sphere: light scattered n times is the albedo times that scattered n - 1 times.
TEST(SolidLaw, InsideAMatteSphereLightGoesRoundAndRound) {
  TracedWorld world;
  std::vector<SurfaceCloth> solids;
  solids.emplace_back(paint({0.8, 0.5, 0.2}), ball({0, 0, 0}, 100, 48), true);
  world.scene = std::make_unique<ClothScene>(std::vector<ClothPiece>{}, std::vector<TriangleMesh>{},
                                             std::move(solids));
  world.lights = {test::point_light({0, 0, 0}, Rgb(1, 1, 1))};
  RandomStream random(5, RandomStage::kTest, 0, 0);
  RunningMean single[3];
  RunningMean total[3];
  for (int k = 0; k < 20'000; ++k) {
    const EyeSample sample = world.tracer().trace({Vec3d(3, 5, 7), sample_sphere(random)}, random);
    ASSERT_EQ(sample.alpha, 1);
    for (int c = 0; c < 3; ++c) {
      single[c].add(static_cast<double>(sample.single[c]));
      total[c].add(static_cast<double>(sample.single[c] + sample.multiple[c]));
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double albedo = Rgbd(0.8, 0.5, 0.2)[c];
    const double direct = albedo / kPi * 100;  // irradiance 1 at 1 m: 100 at 100 mm
    EXPECT_NEAR(single[c].mean(), direct, 3e-3 * direct) << "facets";
    EXPECT_NEAR(total[c].mean(), direct / (1 - albedo),
                6e-3 * direct / (1 - albedo) + 4 * total[c].standard_error());
  }
}

// A red ball throws red light onto white cloth, unless paths may not leave the shell.
TEST(Solid, ColourGoesToTheClothAndLocalPathsLeaveItOut) {
  const std::vector<Light> light = {test::sg_light({0, 0, -1}, 0, Rgb(10, 10, 10))};
  const TracedWorld red = ball_under_cloth(test_cotton(), paint({0.9, 0, 0}), light);
  const TracedWorld black = ball_under_cloth(test_cotton(), paint({0, 0, 0}), light);
  const ColorMeans lit = measure_at(red.tracer(), kOnCloth, kFromAbove, 20'000, 6);
  const ColorMeans dark = measure_at(black.tracer(), kOnCloth, kFromAbove, 20'000, 6);
  EXPECT_GT(lit.total[0].mean(), dark.total[0].mean() + 6 * dark.total[0].standard_error());
  EXPECT_NEAR(lit.total[2].mean(), dark.total[2].mean(), 6 * dark.total[2].standard_error());
  const ColorMeans local =
      measure_at(red.tracer(LightEstimator::kCombined, true), kOnCloth, kFromAbove, 20'000, 6);
  const ColorMeans local_black =
      measure_at(black.tracer(LightEstimator::kCombined, true), kOnCloth, kFromAbove, 20'000, 6);
  EXPECT_EQ(local.total[0].mean(), local_black.total[0].mean());
}

// The precomputed methods light a mesh directly: what paths of one event bring.
TEST(SolidStatistical, DirectLightIsThatOfPathsOfOneEvent) {
  TracedWorld world;
  std::vector<SurfaceCloth> solids;
  solids.emplace_back(paint({0.8, 0.5, 0.2}, 0.3), ball({0, 0, 0}, 2), true);
  const TriangleMesh roof = {{{-4, -4, 3}, {0.5F, -4, 3}, {-4, 9, 3}}, {{0, 1, 2}}};
  world.scene = std::make_unique<ClothScene>(std::vector<ClothPiece>{},
                                             std::vector<TriangleMesh>{roof}, std::move(solids));
  Light sun;
  sun.axis = Vec3(0.5F, 0.2F, 1).normalized();
  world.lights = {sun, test::sg_light({0.2F, 0, 1}, 8, Rgb(1, 1, 1)),
                  test::rectangle_light({4, -4, 6}, {-1, 1, -1}, {0, 0, 1}, 3, 2, Rgb(6, 6, 6)),
                  test::point_light({0, 5, 4}, Rgb(1e-5F, 1e-5F, 1e-5F))};
  const PrecomputedRenderer renderer(*world.scene, {}, world.lights, Rgb(0, 0, 0), {});
  const Camera camera = test::camera_from({6, -9, 8}, 5, 8);
  const PixelRect all{0, 0, 8, 8};
  const FrameBuffers direct = shade_picture(renderer, camera, all, 256, test::no_progress);
  const FrameBuffers paths = trace_picture(world.tracer(LightEstimator::kCombined, false, 1),
                                           camera, all, 9, {256, {}}, test::no_progress);
  double square = 0;
  for (std::size_t k = 0; k < direct.pixel_count(); ++k) {
    const double error = static_cast<double>(direct.variance[k][1] + paths.variance[k][1]);
    const double difference = static_cast<double>(direct.beauty[k][1] - paths.beauty[k][1]);
    if (error > 0) square += difference * difference / error / 64;
  }
  // Stratified samples err by less than their spread says, so this is a weak bound beside the mean.
  EXPECT_LT(square, 1.6);
  double means[2] = {0, 0};
  for (std::size_t k = 0; k < direct.pixel_count(); ++k) {
    means[0] += static_cast<double>(direct.beauty[k][1]) / 64;
    means[1] += static_cast<double>(paths.beauty[k][1]) / 64;
  }
  EXPECT_GT(means[0], 0.05);
  EXPECT_NEAR(means[0], means[1], 5e-3 * means[1]);
}

TEST(SolidEndToEnd, SameBytesForAnyThreads) {
  const TracedWorld world =
      ball_under_cloth(test_cotton(), paint({0.8, 0.2, 0.1}, 0.3),
                       {test::sg_light({0.9F, 0.3F, 0.4F}, 30, Rgb(3, 3, 3))});
  const Camera camera = test::camera_from({9, 3, 2}, 28, 24);
  const auto picture = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return trace_picture(world.tracer(), camera, {0, 0, 24, 24}, 1, {2, {}}, test::no_progress);
  };
  const FrameBuffers one = picture(1);
  const FrameBuffers two = picture(2);
  for (std::size_t k = 0; k < one.pixel_count(); ++k)
    ASSERT_TRUE((one.beauty[k] == two.beauty[k]).all());
}

}  // namespace
}  // namespace heddle

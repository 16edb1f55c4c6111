#include "render/path_tracer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <memory>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/quadrature.h"
#include "fibers/math/spherical_gaussian.h"
#include "render/radiance_picture.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"
#include "tests/support/near_lights.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/statistics.h"
#include "tests/support/traced_world.h"

namespace heddle {
namespace {

TracedWorld make_world(Exemplar exemplar, std::vector<ClothMesh> meshes,
                       std::vector<Light> lights) {
  TracedWorld world;
  const auto tile = std::make_shared<TileScene>(std::move(exemplar));
  std::vector<ClothPiece> pieces;
  for (ClothMesh& mesh : meshes) pieces.push_back({tile, std::move(mesh)});
  world.scene = std::make_unique<ClothScene>(std::move(pieces), std::vector<TriangleMesh>{});
  world.materials = scene_materials(*world.scene);
  world.lights = std::move(lights);
  return world;
}

// A patch of a cylinder of radius 6 mm, 6 mm wide: fabric space is bent but not stretched.
ClothMesh curved_patch() {
  constexpr int kSteps = 24;
  constexpr double kRadius = 6;
  ClothMesh mesh;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = (static_cast<double>(i) / kSteps - 0.5) * 2.4;
    for (const double y : {-3.0, 3.0}) {
      mesh.normals.emplace_back(std::sin(angle), 0, std::cos(angle));
      mesh.positions.push_back(kRadius * mesh.normals.back() + Vec3d(0, y, -kRadius));
      mesh.fabric.emplace_back(kRadius * angle, y);
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const std::uint32_t v = 2 * i;
    mesh.triangles.push_back({v, v + 2, v + 3});
    mesh.triangles.push_back({v, v + 3, v + 1});
  }
  return mesh;
}

// Mean and standard error of each colour over eye rays onto the middle of the cloth; rays that miss
// do not count.
struct Means {
  RunningMean total[3];
  RunningMean single[3];
};
Means measure(const PathTracer& tracer, int samples, std::uint64_t seed) {
  Means means;
  for (int k = 0; k < samples; ++k) {
    RandomStream random(seed, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
    const Vec3d target(1.5 * random.uniform_double() - 0.75, 1.5 * random.uniform_double() - 0.75,
                       0);
    const Vec3 direction = Vec3(0.3F, 0.2F, -1).normalized();
    const PathTracer::Sample sample =
        tracer.trace({target - 20 * direction.cast<double>(), direction}, random);
    if (sample.alpha == 0) continue;
    for (int c = 0; c < 3; ++c) {
      means.total[c].add(static_cast<double>(sample.single[c] + sample.multiple[c]));
      means.single[c].add(static_cast<double>(sample.single[c]));
    }
  }
  return means;
}

// Furnace: fibers that scatter everything evenly, in light 1 from everywhere, are invisible. With
// sampling by the BCSDF every path weighs 1 whatever it hits; shadow rays and the combination judge
// the geometry of occlusion.
TEST(PathTracerLaw, Furnace) {
  const std::vector<Light> light = {
      test::sg_light({0, 0, 1}, 0, Rgb(1, 1, 1) * static_cast<float>(4 * kPi))};
  for (const bool curved : {false, true}) {
    const TracedWorld world = make_world(crossed_layers(test::white_fiber()),
                                         {curved ? curved_patch() : flat_cloth(6, 6)}, light);
    const Means escapes = measure(world.tracer(LightEstimator::kEscapes), 2000, 1);
    EXPECT_NEAR(escapes.total[0].mean(), 1, 1e-4);
    EXPECT_LT(escapes.total[0].standard_error(), 1e-4);
    for (const LightEstimator estimator :
         {LightEstimator::kShadowRays, LightEstimator::kCombined}) {
      const Means means = measure(world.tracer(estimator), 20000, 2);
      EXPECT_TRUE(means_agree(
          estimator == LightEstimator::kShadowRays ? "furnace, shadow rays" : "furnace, combined",
          means.total[0].mean(), means.total[0].standard_error(), 1, 0, 4));
    }
    EXPECT_EQ(world.scene->failed_walks(), 0U);
  }
}

// The same in cloth with hairs and in a knit, from both kinds of estimator. Rays that pass the
// cloth see the light behind it, which is as bright.
TEST(PathTracerLaw, FurnaceOfHairsAndKnits) {
  const std::vector<Light> light = {
      test::sg_light({0, 0, 1}, 0, Rgb(1, 1, 1) * static_cast<float>(4 * kPi))};
  for (const FabricConfig& config : {test::small_hairy_fabric(), test::small_knit()}) {
    Exemplar exemplar = synthesize(config);
    exemplar.scattering.assign(exemplar.scattering.size(), test::white_fiber());
    const TracedWorld world = make_world(std::move(exemplar), {curved_patch()}, light);
    const Means escapes = measure(world.tracer(LightEstimator::kEscapes), 1000, 1);
    EXPECT_NEAR(escapes.total[0].mean(), 1, 1e-4);
    const Means means = measure(world.tracer(LightEstimator::kCombined), 10000, 2);
    EXPECT_TRUE(
        means_agree("furnace", means.total[0].mean(), means.total[0].standard_error(), 1, 0, 2));
    EXPECT_EQ(world.scene->failed_walks(), 0U);
  }
}

TEST(PathTracerStatistical, EstimatorsAgreeInHairsAndKnits) {
  for (const FabricConfig& config : {test::small_hairy_fabric(), test::small_knit()}) {
    const TracedWorld world = make_world(synthesize(config), {curved_patch()},
                                         {test::sg_light({-0.4F, 0.3F, 1}, 30, Rgb(3, 3, 3))});
    const Means shadow = measure(world.tracer(LightEstimator::kShadowRays), 20000, 4);
    const Means escapes = measure(world.tracer(LightEstimator::kEscapes), 60000, 5);
    EXPECT_TRUE(means_agree("shadow rays, escapes", shadow.total[0].mean(),
                            shadow.total[0].standard_error(), escapes.total[0].mean(),
                            escapes.total[0].standard_error(), 2));
  }
}

// The same furnace seen with the roulette and the limits of a path that loses its light: breaking
// either shows.
TEST(PathTracerLaw, FurnaceSeesALostBounce) {
  const std::vector<Light> light = {
      test::sg_light({0, 0, 1}, 0, Rgb(1, 1, 1) * static_cast<float>(4 * kPi))};
  const TracedWorld world =
      make_world(crossed_layers(test::white_fiber()), {flat_cloth(6, 6)}, light);
  EXPECT_LT(measure(world.tracer(LightEstimator::kCombined, false, 10), 2000, 3).total[0].mean(),
            0.99);
}

TEST(PathTracerStatistical, EstimatorsAgreeUnderASharpGaussian) {
  const TracedWorld world = make_world(crossed_layers(test_cotton()), {curved_patch()},
                                       {test::sg_light({-0.4F, 0.3F, 1}, 150, Rgb(3, 3, 3))});
  const Means shadow = measure(world.tracer(LightEstimator::kShadowRays), 40000, 4);
  const Means escapes = measure(world.tracer(LightEstimator::kEscapes), 200000, 5);
  const Means combined = measure(world.tracer(LightEstimator::kCombined), 40000, 6);
  for (const int c : {0, 2}) {
    const auto agree = [&](const char* name, const RunningMean& a, const RunningMean& b) {
      EXPECT_TRUE(means_agree(name, a.mean(), a.standard_error(), b.mean(), b.standard_error(), 8));
    };
    agree("shadow rays, combined", shadow.total[c], combined.total[c]);
    agree("escapes, combined", escapes.total[c], combined.total[c]);
    agree("single: shadow rays, combined", shadow.single[c], combined.single[c]);
    agree("single: escapes, combined", escapes.single[c], combined.single[c]);
  }
}

TEST(PathTracerStatistical, AVerySharpGaussianIsADirectionalLight) {
  const Vec3 axis = Vec3(-0.4F, 0.3F, 1).normalized();
  const Rgb irradiance(2, 3, 4);
  const TracedWorld sharp = make_world(crossed_layers(test_cotton()), {curved_patch()},
                                       {test::sg_light(axis, 1e5F, irradiance)});
  const TracedWorld directional = make_world(crossed_layers(test_cotton()), {curved_patch()},
                                             {{LightType::kDirectional, axis, 0, irradiance}});
  const Means a = measure(sharp.tracer(LightEstimator::kCombined), 40000, 7);
  const Means b = measure(directional.tracer(LightEstimator::kCombined), 40000, 8);
  for (int c = 0; c < 3; ++c) {
    EXPECT_TRUE(means_agree("sharp against directional", a.total[c].mean(),
                            a.total[c].standard_error(), b.total[c].mean(),
                            b.total[c].standard_error(), 3));
  }
}

// Near enough that its direction and brightness change along a path, and wide enough to be met.
TEST(PathTracerStatistical, EstimatorsAgreeUnderNearLights) {
  for (const Light& light :
       {test::sphere_light({-2, 1, 4}, 1.5, Rgb(3, 3, 3)),
        test::rectangle_light({-2, 1, 4}, {0.4, -0.2, -1}, {0, 1, 0}, 4, 2, Rgb(3, 3, 3))}) {
    const TracedWorld world = make_world(crossed_layers(test_cotton()), {curved_patch()}, {light});
    const Means shadow = measure(world.tracer(LightEstimator::kShadowRays), 30000, 4);
    const Means escapes = measure(world.tracer(LightEstimator::kEscapes), 60000, 5);
    const Means combined = measure(world.tracer(LightEstimator::kCombined), 30000, 6);
    const auto agree = [&](const char* name, const RunningMean& a, const RunningMean& b) {
      EXPECT_TRUE(means_agree(name, a.mean(), a.standard_error(), b.mean(), b.standard_error(), 6));
    };
    agree("shadow rays, combined", shadow.total[0], combined.total[0]);
    agree("escapes, combined", escapes.total[0], combined.total[0]);
    agree("single: escapes, combined", escapes.single[0], combined.single[0]);
  }
}

TEST(PathTracerAgreement, FarAwayANearLightIsOneAtInfinity) {
  const Vec3d axis = Vec3d(-0.4, 0.3, 1).normalized();
  const Rgb irradiance(2, 3, 4);
  const auto tracer_mean = [&](const Light& light, std::uint64_t seed) {
    const TracedWorld world = make_world(crossed_layers(test_cotton()), {curved_patch()}, {light});
    return measure(world.tracer(LightEstimator::kCombined), 20000, seed);
  };
  // 1000 times as far as the cloth is wide: the same random numbers, nearly the same light.
  const Means directional =
      tracer_mean({LightType::kDirectional, axis.cast<float>(), 0, irradiance}, 8);
  const Means point = tracer_mean(test::point_light(6000 * axis, 36 * irradiance), 8);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(point.total[c].mean() / directional.total[c].mean(), 1, 2e-3);
  // A sphere of 2 degrees, and the Gaussian of its mean cosine.
  const Light sphere = test::sphere_light(6000 * axis, 200, irradiance);
  const SeenLight seen = seen_from(sphere, {0, 0, 0});
  const Means near = tracer_mean(sphere, 9);
  const Means gaussian =
      tracer_mean(test::sg_light(seen.axis, seen.sharpness, seen.irradiance), 10);
  for (int c = 0; c < 3; ++c) {
    EXPECT_TRUE(means_agree("sphere, Gaussian", near.total[c].mean(),
                            near.total[c].standard_error(), gaussian.total[c].mean(),
                            gaussian.total[c].standard_error(), 3));
  }
}

TEST(PathTracerLaw, AnEvenTextureIsNone) {
  Light light = test::rectangle_light({-2, 1, 4}, {0.4, -0.2, -1}, {0, 1, 0}, 4, 2, Rgb(3, 3, 3));
  const TracedWorld plain = make_world(crossed_layers(test_cotton()), {curved_patch()}, {light});
  light.texture = std::make_shared<const RadiancePicture>(
      RadiancePicture{3, 2, std::vector<Rgb>(6, Rgb(1, 1, 1))});
  const TracedWorld textured = make_world(crossed_layers(test_cotton()), {curved_patch()}, {light});
  const Means a = measure(plain.tracer(LightEstimator::kCombined), 500, 4);
  const Means b = measure(textured.tracer(LightEstimator::kCombined), 500, 4);
  EXPECT_GT(a.total[0].mean(), 0);
  EXPECT_EQ(a.total[0].mean(), b.total[0].mean());
}

// A black roof hides what is above it and not what is below.
TEST(PathTracerLaw, ShadowRaysEndAtANearLight) {
  const TriangleMesh roof = {
      {Vec3(-50, -50, 3), Vec3(50, -50, 3), Vec3(50, 50, 3), Vec3(-50, 50, 3)},
      {{0, 1, 2}, {0, 2, 3}}};
  const auto light_at = [](int which, double z) {
    if (which == 0) return test::point_light({0, 0, z}, Rgb(1, 1, 1));
    if (which == 1) return test::sphere_light({0, 0, z}, 0.5, Rgb(1, 1, 1));
    return test::rectangle_light({0, 0, z}, {0, 0, -1}, {0, 1, 0}, 2, 2, Rgb(1, 1, 1));
  };
  for (int which = 0; which < 3; ++which) {
    for (const double z : {2.0, 4.0}) {
      TracedWorld open =
          make_world(crossed_layers(test_cotton()), {flat_cloth(6, 6)}, {light_at(which, z)});
      std::vector<ClothPiece> pieces;
      pieces.push_back(
          {std::make_shared<TileScene>(crossed_layers(test_cotton())), flat_cloth(6, 6)});
      TracedWorld roofed =
          make_world(crossed_layers(test_cotton()), {flat_cloth(6, 6)}, {light_at(which, z)});
      roofed.scene =
          std::make_unique<ClothScene>(std::move(pieces), std::vector<TriangleMesh>{roof});
      // The eye is below the roof.
      const auto seen = [&](const TracedWorld& world) {
        const PathTracer tracer = world.tracer(LightEstimator::kCombined);
        double sum = 0;
        for (std::uint64_t k = 0; k < 200; ++k) {
          RandomStream random(1, RandomStage::kTest, k, 0);
          const Vec3 direction = Vec3(0.1F, 0.2F, -1).normalized();
          sum += static_cast<double>(
              tracer.trace({Vec3d(0.3, 0.2, 2.5), direction}, random).single[0]);
        }
        return sum;
      };
      EXPECT_GT(seen(open), 0);
      if (z > 3) {
        EXPECT_EQ(seen(roofed), 0) << which;
      } else {
        EXPECT_NEAR(seen(roofed) / seen(open), 1, 1e-6) << which;
      }
    }
  }
}

// One fiber alone: all its copies are the same fiber, so nothing occludes, and the radiance is an
// integral over the light.
TEST(PathTracerStatistical, SingleFiberAgainstQuadrature) {
  const FiberScattering fiber = test_cotton();
  const Light light = test::sg_light({0.3F, 0.5F, 0.8F}, 20, Rgb(1, 2, 3));
  // The swatch is turned, so that the fiber's tangent (fabric y) is a general direction of the
  // world.
  const Mat3d turn = Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()).toRotationMatrix();
  ClothMesh mesh = flat_cloth(10, 10);
  for (Vec3d& p : mesh.positions) p = turn * p;
  for (Vec3d& n : mesh.normals) n = turn * n;
  const TracedWorld world = make_world(single_fiber(fiber), {mesh}, {light});
  const Vec3d tangent = turn * Vec3d(0, 1, 0);
  const Vec3d view = turn * Vec3d(0.1, 0.4, 1).normalized();
  const Vec3 direction = (-view).cast<float>();
  const Vec3d origin = turn * Vec3d(0.5, 0.2, 0) + 5 * view;

  const Mat3d frame = frame_about(tangent.cast<float>()).cast<double>();
  const SphericalGaussian gaussian = {frame.transpose() * light.axis.cast<double>(), 20.0};
  const Vec3d wo = frame.transpose() * view;
  Rgbd expected = Rgbd::Zero();
  constexpr int kPanels = 24;
  constexpr double step = kPi / kPanels;
  for (int row = 0; row < kPanels; ++row) {
    for (int column = 0; column < 2 * kPanels; ++column) {
      const QuadratureRule thetas =
          gauss_legendre(5, row * step - kPi / 2, (row + 1) * step - kPi / 2);
      const QuadratureRule phis = gauss_legendre(5, column * step, (column + 1) * step);
      for (std::size_t i = 0; i < 5; ++i) {
        for (std::size_t j = 0; j < 5; ++j) {
          const double cosine = std::cos(thetas.nodes[i]);
          const Vec3d wi(std::sin(thetas.nodes[i]), cosine * std::cos(phis.nodes[j]),
                         cosine * std::sin(phis.nodes[j]));
          expected +=
              evaluate_bcsdf(fiber, wi, wo) * (sg_value(gaussian, wi) / sg_mass(20.0) * cosine *
                                               cosine * thetas.weights[i] * phis.weights[j]);
        }
      }
    }
  }
  expected *= light.irradiance.cast<double>();
  for (const LightEstimator estimator :
       {LightEstimator::kShadowRays, LightEstimator::kEscapes, LightEstimator::kCombined}) {
    const PathTracer tracer = world.tracer(estimator);
    RunningMean means[3];
    for (int k = 0; k < 100000; ++k) {
      RandomStream random(9, RandomStage::kTest, static_cast<std::uint64_t>(k),
                          static_cast<std::uint64_t>(estimator));
      const PathTracer::Sample sample = tracer.trace({origin, direction}, random);
      ASSERT_EQ(sample.alpha, 1);
      ASSERT_EQ(sample.multiple.maxCoeff(), 0);
      for (int c = 0; c < 3; ++c) means[c].add(static_cast<double>(sample.single[c]));
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(means_agree("single fiber", means[c].mean(), means[c].standard_error(),
                              expected[c], 0, 9));
    }
  }
}

TEST(PathTracer, LocalPathsKeepTheShadowsButNotTheLightOfOtherCloth) {
  ClothMesh wall = flat_cloth(8, 3);  // upright beside the swatch, facing it, below the eye rays
  for (std::size_t k = 0; k < wall.positions.size(); ++k) {
    const Vec3d p = wall.positions[k];
    wall.positions[k] = Vec3d(-2, p.x(), p.y() + 1.5);
    wall.normals[k] = Vec3d(1, 0, 0);
  }
  const std::vector<Light> light = {
      {LightType::kDirectional, Vec3(0.6F, 0, 0.8F), 0, Rgb(1, 1, 1)}};
  const TracedWorld with_wall =
      make_world(crossed_layers(test_cotton()), {flat_cloth(3, 3), wall}, light);
  const TracedWorld alone = make_world(crossed_layers(test_cotton()), {flat_cloth(3, 3)}, light);
  const Means full = measure(with_wall.tracer(LightEstimator::kCombined), 20000, 10);
  const Means local = measure(with_wall.tracer(LightEstimator::kCombined, true), 20000, 10);
  const Means without = measure(alone.tracer(LightEstimator::kCombined, true), 20000, 10);
  // The lit wall lights the swatch, but not in the local picture: there it could only cast a
  // shadow, and the light comes from the other side.
  EXPECT_GT(full.total[0].mean(), local.total[0].mean() + 4 * local.total[0].standard_error());
  EXPECT_EQ(local.total[0].mean(), without.total[0].mean());
}

CameraConfig small_camera() {
  CameraConfig camera;
  camera.position = {0, -3, 12};
  camera.fov = radians(30);
  camera.width = 24;
  camera.height = 16;
  return camera;
}

FrameBuffers small_picture(const PixelRect& crop, int spp, const MoreSamples& more = {},
                           int enlarged = 1) {
  const TracedWorld world =
      make_world(crossed_layers(test_cotton()), {curved_patch()},
                 {test::sg_light({-0.4F, 0.3F, 1}, 150, Rgb(3, 3, 3)),
                  {LightType::kDirectional, Vec3(0.6F, 0, 0.8F), 0, Rgb(1, 1, 1)}});
  const PathTracer tracer = world.tracer(LightEstimator::kCombined);
  CameraConfig camera = small_camera();
  camera.width *= enlarged;
  camera.height *= enlarged;
  double last = -1;
  return trace_picture(tracer, Camera(camera), crop, 5, {spp, {}, more}, [&](double share) {
    // More samples begin anew.
    EXPECT_TRUE(share >= last || more);
    last = share;
  });
}

bool same(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if ((a[k] != b[k]).any()) return false;
  }
  return true;
}

TEST(PathTracerEndToEnd, ThreadsAndCropsDoNotChangeAPixel) {
  const PixelRect all = {0, 0, 24, 16};
  FrameBuffers one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = small_picture(all, 20);
  }
  const FrameBuffers many = small_picture(all, 20);
  EXPECT_TRUE(same(one.beauty, many.beauty));
  EXPECT_TRUE(same(one.half0, many.half0));
  EXPECT_TRUE(same(one.variance, many.variance));
  const FrameBuffers crop = small_picture({5, 3, 7, 4}, 20);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 7; ++x) {
      EXPECT_TRUE((crop.beauty[static_cast<std::size_t>(y * 7 + x)] ==
                   many.beauty[static_cast<std::size_t>((y + 3) * 24 + x + 5)])
                      .all());
    }
  }
}

TEST(PathTracerEndToEnd, MoreSamplesMakeThePictureOfAll) {
  const PixelRect all = {0, 0, 24, 16};
  std::vector<int> seen;
  const FrameBuffers grown = small_picture(all, 6, [&](const FrameBuffers& frame) {
    EXPECT_TRUE(same(frame.variance, small_picture(all, frame.spp).variance));
    seen.push_back(frame.spp);
    return std::vector{seen.size() == 1 ? 10 : seen.size() == 2 ? 4 : 0};
  });
  EXPECT_EQ(seen, (std::vector<int>{6, 16, 20}));
  const FrameBuffers whole = small_picture(all, 20);
  EXPECT_EQ(grown.spp, 20);
  EXPECT_TRUE(same(grown.beauty, whole.beauty));
  EXPECT_TRUE(same(grown.half1, whole.half1));
  EXPECT_TRUE(same(grown.variance, whole.variance));
}

// Blocks of 16 x 16 pixels go on alone: here the right one of two, cut to 8 x 16.
TEST(PathTracerEndToEnd, BlocksMayHaveDifferentNumbersOfSamples) {
  const PixelRect all = {0, 0, 24, 16};
  const FrameBuffers grown = small_picture(all, 6, [&](const FrameBuffers& frame) {
    return std::vector{0, frame.spp == 6 ? 4 : 0};
  });
  const FrameBuffers six = small_picture(all, 6);
  const FrameBuffers ten = small_picture(all, 10);
  for (std::size_t k = 0; k < grown.pixel_count(); ++k) {
    const FrameBuffers& expected = k % 24 < 16 ? six : ten;
    EXPECT_EQ(grown.samples_of(k), expected.spp);
    EXPECT_TRUE((grown.beauty[k] == expected.beauty[k]).all() &&
                (grown.half1[k] == expected.half1[k]).all());
  }
}

// What a pixel stores of four samples, by hand: means of all and of every other one, and the
// variance of the mean, s^2 / n with s^2 the sample variance. Totals of green: 1, 2, 4, 9, mean 4,
// squares of their distances from it 9, 4, 0, 25: s^2 = 38 / 3.
TEST(PixelSumsLaw, MeansHalvesAndVarianceOfFourSamples) {
  const float singles[4] = {0.5F, 1, 1, 4};
  const float multiples[4] = {0.25F, 1, 2, 5};
  const float backgrounds[4] = {0.25F, 0, 1, 0};
  const float alphas[4] = {1, 0, 1, 1};
  PixelSums sums;
  for (int s = 0; s < 4; ++s) {
    // Red twice green, blue nothing.
    const Rgb color(2, 1, 0);
    sums.add({color * singles[s], color * multiples[s], color * backgrounds[s], alphas[s]}, s);
  }
  FrameBuffers frame(2, 1);
  for (std::vector<Rgb>* layer : {&frame.half0, &frame.half1, &frame.variance})
    layer->assign(2, Rgb::Zero());
  sums.store(4, 1, frame);
  const auto expect_color = [](const std::vector<Rgb>& layer, double green, double red) {
    EXPECT_NEAR(layer[1][1], green, 1e-6);
    EXPECT_NEAR(layer[1][0], red, 1e-6);
    EXPECT_EQ(layer[1][2], 0);
    EXPECT_EQ(layer[0].maxCoeff(), 0) << "another pixel's";
  };
  expect_color(frame.beauty, 4, 8);
  expect_color(frame.single, 6.5 / 4, 13.0 / 4);
  expect_color(frame.multiple, 8.25 / 4, 16.5 / 4);
  expect_color(frame.half0, 2.5, 5);
  expect_color(frame.half1, 5.5, 11);
  expect_color(frame.variance, 38.0 / 3 / 4, 4 * 38.0 / 3 / 4);
  EXPECT_FLOAT_EQ(frame.alpha[1], 0.75F);
}

// What the buffers say of themselves: the halves average to the beauty, single and multiple add up
// to it, and the two halves differ as much as the variance says (each half has twice the variance
// of the mean).
TEST(PathTracerStatistical, BuffersAreConsistent) {
  const FrameBuffers frame = small_picture({0, 0, 120, 80}, 16, {}, 5);
  EXPECT_EQ(frame.spp, 16);
  double expected = 0;
  double observed = 0;
  int lit = 0;
  for (std::size_t k = 0; k < frame.beauty.size(); ++k) {
    EXPECT_LT((0.5F * (frame.half0[k] + frame.half1[k]) - frame.beauty[k]).abs().maxCoeff(), 1e-5F);
    EXPECT_LT((frame.single[k] + frame.multiple[k] - frame.beauty[k]).abs().maxCoeff(), 1e-5F);
    if (frame.alpha[k] < 1) continue;
    ++lit;
    expected += 4 * static_cast<double>(frame.variance[k][1]);
    const double difference =
        static_cast<double>(frame.half0[k][1]) - static_cast<double>(frame.half1[k][1]);
    observed += difference * difference;
  }
  // Each term of the sum is a squared normal: relative standard deviation sqrt(2) if all variances
  // were equal; they differ, so allow twice the count's standard error times 4. The variance knows
  // nothing of what stratified eye rays gain (0.88 here), so it is a bound from above.
  std::printf("  %d pixels: squared difference of halves %.4g, expected %.4g\n", lit, observed,
              expected);
  EXPECT_GT(lit, 3000);
  EXPECT_LT(observed / expected, 1 + 4 * 2 * std::sqrt(2.0 / lit));
  EXPECT_GT(observed / expected, 0.5);
}

TEST(PathTracer, TimedPicturesAreWholePasses) {
  const TracedWorld world =
      make_world(crossed_layers(test_cotton()), {curved_patch()},
                 {{LightType::kDirectional, Vec3(0.6F, 0, 0.8F), 0, Rgb(1, 1, 1)}});
  const FrameBuffers frame =
      trace_picture(world.tracer(LightEstimator::kCombined), Camera(small_camera()), {0, 0, 24, 16},
                    1, {2, 0.05}, [](double) {});
  EXPECT_GE(frame.spp, 2);
  EXPECT_EQ(frame.spp % 2, 0);
}

TEST(PathTracerLaw, LightGroupsAreThePartsOfTheWhole) {
  std::vector<Light> lights = {test::sg_light({-0.4F, 0.3F, 1}, 30, Rgb(3, 2, 1)),
                               {LightType::kDirectional, Vec3(0.6F, 0, 0.8F), 0, Rgb(1, 1, 1)},
                               test::sg_light({0.4F, 0.3F, 1}, 5, Rgb(1, 2, 3))};
  lights[1].group = 1;
  const TracedWorld world = make_world(crossed_layers(test_cotton()), {curved_patch()}, lights);
  // What is lit by one group alone.
  TracedWorld of_group[2] = {make_world(crossed_layers(test_cotton()), {curved_patch()}, lights),
                             make_world(crossed_layers(test_cotton()), {curved_patch()}, lights)};
  of_group[0].lights[1].irradiance = Rgb::Zero();
  of_group[1].lights[0].irradiance = of_group[1].lights[2].irradiance = Rgb::Zero();
  for (const LightEstimator estimator :
       {LightEstimator::kShadowRays, LightEstimator::kEscapes, LightEstimator::kCombined}) {
    PathTracerSettings settings;
    settings.estimator = estimator;
    settings.light_groups = 2;
    const PathTracer apart(*world.scene, world.materials, world.lights, Rgb(1, 2, 3), settings);
    double lit = 0;
    for (std::uint64_t k = 0; k < 400; ++k) {
      const Camera camera(small_camera());
      const EyeRay ray = camera.ray(static_cast<double>(k % 24), static_cast<double>(k / 24));
      const auto random = [&] { return RandomStream(7, RandomStage::kTest, k, 0); };
      PathTracer::Sample groups[2];
      RandomStream draws = random();
      apart.trace(ray, draws, groups);
      for (std::size_t g = 0; g < 2; ++g) {
        RandomStream again = random();
        const PathTracer::Sample alone = of_group[g].tracer(estimator).trace(ray, again);
        EXPECT_TRUE(groups[g].single.isApprox(alone.single, 1e-5F) || alone.single.isZero(0));
        EXPECT_TRUE(groups[g].multiple.isApprox(alone.multiple, 1e-5F) || alone.multiple.isZero(0));
        EXPECT_EQ(alone.single.isZero(0), groups[g].single.isZero(0));
      }
      RandomStream again = random();
      const PathTracer::Sample whole = world.tracer(estimator).trace(ray, again);
      const PathTracer::Sample sum = sum_of_groups(groups);
      EXPECT_LE((sum.single - whole.single).abs().maxCoeff(), 1e-5F * whole.single.maxCoeff());
      EXPECT_LE((sum.multiple - whole.multiple).abs().maxCoeff(),
                1e-5F * whole.multiple.maxCoeff());
      EXPECT_EQ(sum.alpha, whole.alpha);
      EXPECT_EQ(groups[1].alpha, 0);
      EXPECT_EQ(sum.background[1], whole.alpha == 1 ? 0 : 2);
      lit += static_cast<double>(groups[1].single.sum() + groups[1].multiple.sum());
    }
    EXPECT_EQ(lit > 0, estimator != LightEstimator::kEscapes)
        << "no path meets a directional light";
  }
}

TEST(PathTracerLaw, TransmittedIsWhatFibersWithoutTtDoNotShow) {
  const TracedWorld world =
      make_world(crossed_layers(test_cotton()), {curved_patch()},
                 {test::sg_light({-0.4F, 0.3F, 1}, 30, Rgb(3, 2, 1)),
                  {LightType::kDirectional, Vec3(0.6F, 0, 0.8F), 0, Rgb(1, 1, 1)}});
  const std::vector<BcsdfTable> reflecting = without_transmission(world.materials);
  for (const LightEstimator estimator : {LightEstimator::kShadowRays, LightEstimator::kCombined}) {
    PathTracerSettings settings;
    settings.estimator = estimator;
    settings.limits.max_scatterings = 1;
    const PathTracer tracer(*world.scene, world.materials, world.lights, Rgb(0, 0, 0), settings,
                            reflecting);
    const PathTracer only_r(*world.scene, reflecting, world.lights, Rgb(0, 0, 0), settings);
    RunningMean left[3];
    RunningMean expected[3];
    for (std::uint64_t k = 0; k < 20000; ++k) {
      RandomStream place(8, RandomStage::kTest, k, 0);
      const EyeRay ray{Vec3d(place.uniform_double() - 0.5, place.uniform_double() - 0.5, 5),
                       Vec3(0.1F, 0.2F, -1).normalized()};
      RandomStream first(8, RandomStage::kTest, k, 1);
      RandomStream second(8, RandomStage::kTest, k, 1);
      const PathTracer::Sample all = tracer.trace(ray, first);
      const PathTracer::Sample r = only_r.trace(ray, second);
      for (int c = 0; c < 3; ++c) {
        const float reflected = all.single[c] - all.transmitted[c];
        if (estimator == LightEstimator::kShadowRays) {  // the same light is drawn
          EXPECT_NEAR(reflected, r.single[c], 1e-5F * (1 + all.single[c]));
        }
        EXPECT_GE(all.transmitted[c], 0);
        left[c].add(static_cast<double>(reflected));
        expected[c].add(static_cast<double>(r.single[c]));
      }
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(expected[c].mean(), 0.001);
      EXPECT_TRUE(means_agree("reflected", left[c].mean(), left[c].standard_error(),
                              expected[c].mean(), expected[c].standard_error(), 6));
    }
  }
}

TEST(PathTracer, BackgroundIsSeenOnlyByEyeRays) {
  TracedWorld world = make_world(crossed_layers(test_cotton()), {flat_cloth(2, 2)}, {});
  PathTracerSettings settings;
  const PathTracer tracer(*world.scene, world.materials, world.lights, Rgb(1, 2, 3), settings);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  const PathTracer::Sample miss = tracer.trace({Vec3d(50, 0, 5), Vec3(0, 0, -1)}, random);
  EXPECT_EQ(miss.background[2], 3);
  EXPECT_EQ(miss.alpha, 0);
  const PathTracer::Sample hit = tracer.trace({Vec3d(0.013, 0.027, 5), Vec3(0, 0, -1)}, random);
  EXPECT_EQ(hit.alpha, 1);
  EXPECT_EQ((hit.single + hit.multiple + hit.background).maxCoeff(), 0);
}

}  // namespace
}  // namespace heddle

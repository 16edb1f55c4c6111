#include "render/surface_cloth.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "fibers/math/sampling.h"
#include "render/path_tracer.h"
#include "render/precomputed_renderer.h"
#include "render/surface/surface_presets.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

using Model = std::shared_ptr<const SurfaceModel>;

Model preset(const char* name) {
  return read_surface_model(surface_preset(name));
}

/// Reflects what a function of the point and the directions says; draws from the whole hemisphere.
class FunctionModel final : public SurfaceModel {
 public:
  using Function = std::function<Rgbd(const SurfacePoint&, const Vec3d& wi, const Vec3d& wo)>;
  explicit FunctionModel(Function function) : function_(std::move(function)) {}

  Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const override {
    return wi.z() > 0 && wo.z() > 0 ? function_(point, wi, wo) : Rgbd::Zero();
  }
  Rgbd reflected_sg(const SurfacePoint&, const Vec3d&, double, const Vec3d&) const override {
    return Rgbd::Zero();
  }
  std::optional<SurfaceSample> sample(const SurfacePoint& point, const Vec3& wo,
                                      RandomStream& random) const override {
    const Vec3 wi = sample_hemisphere({0, 0, 1}, random);
    const float density = 0.5F / kPif;
    return SurfaceSample{
        wi, reflected(point, wi.cast<double>(), wo.cast<double>()).cast<float>() / density,
        density};
  }
  float pdf(const SurfacePoint&, const Vec3& wi, const Vec3&) const override {
    return wi.z() > 0 ? 0.5F / kPif : 0;
  }

 private:
  Function function_;
};

Model constant_model() {
  return std::make_shared<FunctionModel>(
      [](const auto&, const auto&, const auto&) { return Rgbd(1, 0.5, 0.25); });
}

Light directional(const Vec3& axis, const Rgb& irradiance = Rgb(1, 2, 3)) {
  return {LightType::kDirectional, axis.normalized(), 0, irradiance};
}

Light gaussian(const Vec3& axis, float sharpness, const Rgb& irradiance = Rgb(1, 2, 3)) {
  return {LightType::kSphericalGaussian, axis.normalized(), sharpness, irradiance};
}

ClothMesh lifted(ClothMesh mesh, double height) {
  for (Vec3d& position : mesh.positions) position.z() += height;
  return mesh;
}

/// Flat cloth whose fabric position is `map` times the world's.
ClothMesh mapped(const Eigen::Matrix2d& map) {
  ClothMesh mesh = flat_cloth(4, 4);
  for (Eigen::Vector2d& fabric : mesh.fabric) fabric = map * fabric;
  return mesh;
}

/// A quarter of a tube of radius 2 about the x axis, its middle on top at z = 0; u along the axis,
/// v around it.
ClothMesh arch(int steps) {
  ClothMesh mesh;
  for (int i = 0; i <= steps; ++i) {
    const double angle = (static_cast<double>(i) / steps - 0.5) * 0.5 * kPi;
    for (const double x : {-2.0, 2.0}) {
      mesh.normals.emplace_back(0, std::sin(angle), std::cos(angle));
      mesh.positions.push_back(2 * mesh.normals.back() + Vec3d(x, 0, -2));
      mesh.fabric.emplace_back(x, 2 * angle);
    }
  }
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(steps); ++i) {
    mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    mesh.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  return mesh;
}

/// Everything that both ways to render need.
struct SurfaceWorld {
  std::unique_ptr<ClothScene> scene;
  std::vector<BcsdfTable> materials;
  std::vector<Light> lights;

  PathTracer tracer(LightEstimator estimator = LightEstimator::kCombined) const {
    PathTracerSettings settings;
    settings.estimator = estimator;
    return {*scene, materials, lights, Rgb(0, 0, 0), settings};
  }
  PrecomputedRenderer renderer() const { return {*scene, {}, lights, Rgb(0, 0, 0), {}}; }
};

SurfaceWorld make_world(std::vector<ClothPiece> fibers, std::vector<TriangleMesh> black,
                        std::vector<SurfaceCloth> surfaces, std::vector<Light> lights) {
  SurfaceWorld world;
  world.scene =
      std::make_unique<ClothScene>(std::move(fibers), std::move(black), std::move(surfaces));
  world.materials = scene_materials(*world.scene);
  world.lights = std::move(lights);
  return world;
}

SurfaceWorld surface_world(const Model& model, const ClothMesh& mesh, std::vector<Light> lights) {
  return make_world({}, {}, {SurfaceCloth(model, mesh)}, std::move(lights));
}

EyeRay ray_to(const Vec3d& target, const Vec3& from) {
  const Vec3 direction = -from.normalized();
  return {target - 5 * direction.cast<double>(), direction};
}

TEST(SurfaceClothLaw, AFlatPatchUnderADirectionalLightIsTheModel) {
  for (const char* name : {"linen-plain", "silk-shot", "velvet"}) {
    const Model model = preset(name);
    const Light light = directional({0.4F, -0.3F, 1});
    const SurfaceWorld world = surface_world(model, flat_cloth(4, 4), {light});
    for (const Vec3& from : {Vec3(0.1F, 0.2F, 1), Vec3(-1, 0.5F, 0.4F)}) {
      const EyeRay ray = ray_to({0.3, -0.7, 0}, from);
      RandomStream random(1, RandomStage::kTest, 0, 0);
      const EyeSample sample = world.tracer().trace(ray, random);
      const Rgb expected =
          light.irradiance * model
                                 ->reflected({Vec2(0.3F, -0.7F), 0}, light.axis.cast<double>(),
                                             -ray.direction.cast<double>())
                                 .cast<float>();
      EXPECT_GT(expected.minCoeff(), 0);
      EXPECT_TRUE((sample.single == expected).all())
          << name << ": " << (sample.single / expected).transpose();
      EXPECT_TRUE((sample.multiple == 0).all());
      EXPECT_EQ(sample.alpha, 1);
    }
  }
}

TEST(SurfaceClothStatistical, EstimatorsAgreeWithEachOtherAndWithTheLightsIntegral) {
  // Sharp and soft light; silk has narrow lobes. 3 x 3 means against the model's own integral, and
  // against each other.
  constexpr int kSamples = 20000;
  constexpr double kCubature = 2e-3;  // of the largest channel: what the integral may be off by
  int tests = 0;
  for (const char* name : {"linen-plain", "silk-crepe-de-chine"}) {
    for (const float sharpness : {5.0F, 150.0F}) {
      const Model model = preset(name);
      const Light light = gaussian({0.5F, 0.1F, 1}, sharpness, Rgb(1, 1, 1));
      const SurfaceWorld world = surface_world(model, flat_cloth(4, 4), {light});
      const EyeRay ray = ray_to({0, 0, 0}, {-0.4F, 0.3F, 1});
      const Rgbd exact = model->reflected_sg({}, light.axis.cast<double>(), light.sharpness,
                                             -ray.direction.cast<double>());
      for (const LightEstimator estimator :
           {LightEstimator::kShadowRays, LightEstimator::kEscapes, LightEstimator::kCombined}) {
        const PathTracer tracer = world.tracer(estimator);
        RunningMean mean;
        for (int k = 0; k < kSamples; ++k) {
          RandomStream random(7, RandomStage::kTest, static_cast<std::uint64_t>(tests),
                              static_cast<std::uint64_t>(k));
          mean.add(static_cast<double>(tracer.trace(ray, random).single[1]));
        }
        EXPECT_TRUE(means_agree(name, mean.mean(),
                                std::hypot(mean.standard_error(), kCubature * exact.maxCoeff() / 3),
                                exact[1], 0, 12));
        EXPECT_LT(mean.standard_error(), 0.07 * exact[1]);
        ++tests;
      }
    }
  }
}

TEST(SurfaceCloth, EscapesAloneNeverMeetADirectionalLight) {
  const SurfaceWorld world =
      surface_world(constant_model(), flat_cloth(4, 4), {directional({0, 0, 1})});
  RandomStream random(1, RandomStage::kTest, 0, 0);
  EXPECT_TRUE(
      (world.tracer(LightEstimator::kEscapes).trace(ray_to({0, 0, 0}, {0, 0, 1}), random).single ==
       0)
          .all());
}

/// The frame and the point that a ray sees on a mesh.
SurfaceHit seen(const ClothMesh& mesh, const Vec3d& target, const Vec3& from) {
  const SurfaceCloth cloth(constant_model(), mesh);
  const ClothScene scene({}, {}, {cloth});
  const EyeRay ray = ray_to(target, from);
  const auto hit = scene.first_mesh(ray.origin, ray.direction);
  EXPECT_TRUE(hit && hit->surface);
  return hit->surface->hit(hit->triangle, hit->u, hit->v, ray.direction, 0);
}

TEST(SurfaceClothLaw, TheFrameFollowsTheUvs) {
  const Vec3d target(0.5, 0.25, 0);
  for (const double angle : {0.0, 0.5, 2.0, -2.5}) {
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
    for (const double mirror_u : {1.0, -1.0}) {
      for (const double mirror_v : {1.0, -1.0}) {
        for (const float side : {1.0F, -1.0F}) {
          const Eigen::Matrix2d map = Eigen::Vector2d(mirror_u, mirror_v).asDiagonal() * turn;
          const SurfaceHit hit = seen(mapped(map), target, {0.2F, -0.1F, side});
          // u = map.row(0) * position grows along map.row(0); v along map.row(1).
          const Vec3d x = hit.world_from_patch.col(0);
          const Vec3d y = hit.world_from_patch.col(1);
          const Vec3d z = hit.world_from_patch.col(2);
          EXPECT_LT((x - Vec3d(map(0, 0), map(0, 1), 0)).norm(), 1e-12);
          EXPECT_LT((z - Vec3d(0, 0, static_cast<double>(side))).norm(), 1e-12);
          EXPECT_LT((y - z.cross(x)).norm(), 1e-12);
          EXPECT_LT((hit.normal - z).norm(), 1e-12);
          // The pattern is not mirrored: the place runs along the frame.
          EXPECT_NEAR(hit.point.position_mm.x(), x.dot(target), 1e-6);
          EXPECT_NEAR(hit.point.position_mm.y(), y.dot(target), 1e-6);
        }
      }
    }
  }
}

TEST(SurfaceCloth, ShearedUvsLeaveTheFrameOrthonormal) {
  Eigen::Matrix2d shear;
  shear << 1, 0.7, 0, 2;
  const SurfaceHit hit = seen(mapped(shear), {0.5, 0.25, 0}, {0, 0, 1});
  EXPECT_LT((hit.world_from_patch - Mat3d::Identity()).norm(), 1e-12);  // v stays the same along x
  EXPECT_NEAR(hit.point.position_mm.x(), 0.5 + 0.7 * 0.25, 1e-6);
  EXPECT_NEAR(hit.point.position_mm.y(), 0.5, 1e-6);
}

TEST(SurfaceCloth, UvsWithoutAreaStillGiveAFrame) {
  const SurfaceHit hit = seen(mapped(Eigen::Matrix2d::Zero()), {0.5, 0.25, 0}, {0, 0, 1});
  EXPECT_LT((hit.world_from_patch.transpose() * hit.world_from_patch - Mat3d::Identity()).norm(),
            1e-6);
  EXPECT_NEAR(hit.world_from_patch.determinant(), 1, 1e-6);
}

TEST(SurfaceCloth, CurvedClothHasInterpolatedNormals) {
  // Between two vertices of 8 degrees, the frame is off the true one by what linear interpolation
  // leaves.
  for (const double y : {0.0, 0.3, -0.9}) {
    const double angle = std::asin(y / 2);
    const Vec3d target(0.3, y, 2 * std::cos(angle) - 2);
    const SurfaceHit hit = seen(arch(11), target, {0, 0, 1});
    EXPECT_LT((hit.world_from_patch.col(2) - Vec3d(0, std::sin(angle), std::cos(angle))).norm(),
              2e-3);
    EXPECT_LT((hit.world_from_patch.col(0) - Vec3d(1, 0, 0)).norm(), 1e-9);
    EXPECT_NEAR(hit.point.position_mm.y(), 2 * angle, 0.01);
  }
}

TEST(SurfaceCloth, NoBlackRimWhereNormalsTurnAwayFromTheEye) {
  // Four steps of 22.5 degrees; the last one rises 33.75 degrees to an eye 38 degrees high, its
  // rim's normal falls to it.
  const double last = radians(33.75);
  const Vec3d middle(0.1, 2 * std::cos(radians(11.25)) * std::sin(last),
                     2 * std::cos(radians(11.25)) * std::cos(last) - 2);
  const Vec3 from(0, -static_cast<float>(std::cos(radians(38))),
                  static_cast<float>(std::sin(radians(38))));
  const SurfaceWorld world = surface_world(constant_model(), arch(4), {directional(from)});
  int bent = 0;
  for (int k = -9; k < 10; ++k) {
    const EyeRay eye = ray_to(middle + 0.04 * k * Vec3d(0, std::cos(last), -std::sin(last)), from);
    const auto hit = world.scene->first_mesh(eye.origin, eye.direction);
    ASSERT_TRUE(hit);
    const SurfaceHit surface = hit->surface->hit(hit->triangle, hit->u, hit->v, eye.direction, 0);
    const double cosine = -surface.world_from_patch.col(2).dot(eye.direction.cast<double>());
    EXPECT_GT(cosine, 0.009);
    EXPECT_NEAR(surface.world_from_patch.determinant(), 1, 1e-9);
    bent += cosine < 0.0101;
    RandomStream random(1, RandomStage::kTest, 0, 0);
    EXPECT_GT(world.tracer().trace(eye, random).single[0], 0);
  }
  EXPECT_GT(bent, 4);
  EXPECT_LT(bent, 15);
}

TEST(SurfaceCloth, TheBackShowsTheModelUnderLightFromBelow) {
  const SurfaceWorld world =
      surface_world(constant_model(), flat_cloth(4, 4),
                    {directional({0, 0.2F, 1}), directional({0.1F, 0, -1}, Rgb(7, 7, 7))});
  RandomStream random(1, RandomStage::kTest, 0, 0);
  EXPECT_TRUE(
      (world.tracer().trace(ray_to({0.3, 0, 0}, {0, 0, 1}), random).single == Rgb(1, 1, 0.75F))
          .all());
  EXPECT_TRUE(
      (world.tracer().trace(ray_to({0.3, 0, 0}, {0, 0, -1}), random).single == Rgb(7, 3.5F, 1.75F))
          .all());
}

TEST(SurfaceCloth, ThePixelsFootprintAndPlaceReachTheModel) {
  const auto report = std::make_shared<FunctionModel>([](const SurfacePoint& point, const Vec3d&,
                                                         const Vec3d&) {
    return Rgbd(static_cast<double>(point.footprint_mm), static_cast<double>(point.position_mm.x()),
                static_cast<double>(point.position_mm.y()));
  });
  const SurfaceWorld world =
      surface_world(report, flat_cloth(40, 40), {directional({0, 0, 1}, Rgb(1, 1, 1))});
  const Camera camera = test::camera_from({0, 0, 60}, 6, 12);  // 0.5 mm per pixel, 60 mm away
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const double x : {1.3, 9.5}) {
    const Rgb seen_there = world.tracer().trace(camera.ray(x, 4), random).single;
    EXPECT_NEAR(seen_there[0], 0.5, 1e-5);
    EXPECT_NEAR(seen_there[1], 0.5 * (x - 6), 1e-5);
    EXPECT_NEAR(seen_there[2], 0.5 * (6 - 4), 1e-5);
  }
}

TEST(SurfaceCloth, LayersOfAPicture) {
  const Light light = directional({0.2F, 0, 1});
  const SurfaceWorld world = surface_world(constant_model(), flat_cloth(4, 4), {light});
  const FrameBuffers frame = shade_picture(world.renderer(), test::camera_from({0, 0, 60}, 8, 16),
                                           {0, 0, 16, 16}, 2, test::no_progress);
  int covered = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    EXPECT_EQ(frame.segment[k], 0xffffffffU);
    EXPECT_EQ(frame.cell[k], 0xffffffffU);
    EXPECT_EQ(frame.multiple[k].maxCoeff(), 0);
    if (frame.alpha[k] < 1) continue;
    ++covered;
    EXPECT_TRUE((frame.single[k] == Rgb(1, 1, 0.75F)).all());
    EXPECT_TRUE((frame.beauty[k] == frame.single[k]).all());
    EXPECT_NEAR(frame.depth[k], 60, 1e-4);
    EXPECT_LT((frame.tangent[k] - Vec3(1, 0, 0)).norm(), 1e-6F);
    EXPECT_NEAR(frame.fabric_position[k].x(), 0.5 * (static_cast<double>(k % 16) - 7.5), 0.25);
  }
  EXPECT_GE(covered, 36);
}

TEST(SurfaceCloth, MeshesAndSurfacesShadowASurface) {
  TriangleMesh roof{{Vec3(0, -5, 1), Vec3(5, -5, 1), Vec3(5, 5, 1), Vec3(0, 5, 1)},
                    {{0, 1, 2}, {0, 2, 3}}};
  const Light light = directional({0, 0, 1});
  const SurfaceWorld mesh =
      make_world({}, {roof}, {SurfaceCloth(constant_model(), flat_cloth(4, 4))}, {light});
  const SurfaceWorld surface =
      make_world({}, {},
                 {SurfaceCloth(constant_model(), lifted(flat_cloth(1, 1), 1)),
                  SurfaceCloth(constant_model(), flat_cloth(4, 4))},
                 {light});
  const auto lit = [](const SurfaceWorld& world, double x) {
    RandomStream random(1, RandomStage::kTest, 0, 0);
    return world.tracer().trace(ray_to({x, 0, 0}, {-1, 0, 0.3F}), random).single[0];
  };
  EXPECT_EQ(lit(mesh, -0.7), 1);
  EXPECT_EQ(lit(mesh, 0.7), 0);
  EXPECT_EQ(lit(surface, -0.7), 1);
  EXPECT_EQ(lit(surface, 0.2), 0);
}

TEST(SurfaceCloth, ARoofTakesAllOfAGaussianLight) {
  const TriangleMesh roof{{Vec3(-9e3F, -9e3F, 1), Vec3(9e3F, -9e3F, 1), Vec3(0, 9e3F, 1)},
                          {{0, 1, 2}}};
  for (const bool covered : {false, true}) {
    const SurfaceWorld world =
        make_world({}, covered ? std::vector{roof} : std::vector<TriangleMesh>{},
                   {SurfaceCloth(constant_model(), flat_cloth(4, 4))}, {gaussian({0, 0, 1}, 8)});
    for (const LightEstimator estimator :
         {LightEstimator::kShadowRays, LightEstimator::kEscapes, LightEstimator::kCombined}) {
      float sum = 0;
      for (int k = 0; k < 100; ++k) {
        RandomStream random(1, RandomStage::kTest, 0, static_cast<std::uint64_t>(k));
        sum += world.tracer(estimator).trace(ray_to({0, 0, 0}, {-1, 0, 0.3F}), random).single[0];
      }
      EXPECT_EQ(sum > 0, !covered);
    }
  }
}

TEST(SurfaceCloth, FibersShadowASurface) {
  // Fibers of radius 0.05 over x = -0.5 and 0.5. Traced fibers shade what lies under them; as a
  // solid the shell shades all.
  const auto sparse = std::make_shared<TileScene>(single_fiber(test_cotton()));
  const SurfaceWorld world = make_world({{sparse, lifted(flat_cloth(2, 2), 1)}}, {},
                                        {SurfaceCloth(constant_model(), flat_cloth(8, 8))},
                                        {directional({0, 0, 1}, Rgb(1, 1, 1))});
  const PathTracer tracer = world.tracer();
  for (int k = -35; k < 36; ++k) {
    RandomStream random(1, RandomStage::kTest, 0, 0);
    const double x = 0.02 * k + 0.005;
    const EyeSample sample = tracer.trace(ray_to({x, 0.1, 0}, {-1, 0, 0.1F}), random);
    EXPECT_EQ(sample.single[0], std::abs(std::abs(x) - 0.5) < 0.05 ? 0 : 1) << x;
  }
  RandomStream random(1, RandomStage::kTest, 0, 0);
  EXPECT_EQ(tracer.trace(ray_to({3, 3, 0}, {0, 0, 1}), random).single[0], 1);
  EXPECT_FALSE(world.scene->globally_visible({Vec3d(0.1, 0.2, 0), Vec3d(0, 0, 1)}, {0, 0, 1}));
  EXPECT_TRUE(world.scene->globally_visible({Vec3d(3, 3, 0), Vec3d(0, 0, 1)}, {0, 0, 1}));
}

TEST(SurfaceCloth, ASurfaceShadowsFibersAndTheNearerHidesTheOther) {
  const auto tile = std::make_shared<TileScene>(crossed_layers(test_cotton()));
  // The surface hangs over x > 0 of the fibers.
  ClothMesh half = lifted(flat_cloth(4, 4), 1);
  for (Vec3d& position : half.positions) position.x() += 2;
  const SurfaceWorld world =
      make_world({{tile, flat_cloth(6, 4)}}, {}, {SurfaceCloth(constant_model(), half)},
                 {directional({0, 0, 1})});
  const PathTracer tracer = world.tracer();
  const auto mean = [&](double x, const Vec3& from) {
    RunningMean total;
    for (int k = 0; k < 300; ++k) {
      RandomStream random(1, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3d target(x + 0.2 * random.uniform_double(), 0.2 * random.uniform_double(), 0);
      const EyeSample sample = tracer.trace(ray_to(target, from), random);
      total.add(static_cast<double>((sample.single + sample.multiple)[1]));
    }
    return total.mean();
  };
  const Vec3 under(-1, 0, 0.2F);
  EXPECT_GT(mean(-1, under), 0.01);
  EXPECT_EQ(mean(1.2, under), 0)
      << "straight light does not reach these fibers, and nothing else shines";
  EXPECT_EQ(mean(1.2, {0, 0, 1}), 1) << "from above: the surface (0.5 of 2), not the fibers";
}

TEST(SurfaceClothEndToEnd, SameBytesForAnyThreadsAndCrop) {
  const SurfaceWorld world = surface_world(
      preset("silk-shot"), arch(12), {directional({0.3F, 0.2F, 1}), gaussian({-0.5F, 0, 1}, 150)});
  const Camera camera = test::camera_from({0, 2, 6}, 5, 32);
  const auto pictures = [&](std::size_t threads, const PixelRect& crop) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return std::pair{shade_picture(world.renderer(), camera, crop, 3, test::no_progress),
                     trace_picture(world.tracer(), camera, crop, 1, {2, {}}, test::no_progress)};
  };
  const auto one = pictures(1, {0, 0, 32, 32});
  const auto two = pictures(2, {0, 0, 32, 32});
  const auto crop = pictures(2, {5, 9, 20, 11});
  double light = 0;
  for (const auto picture : {&std::pair<FrameBuffers, FrameBuffers>::first,
                             &std::pair<FrameBuffers, FrameBuffers>::second}) {
    for (std::size_t k = 0; k < (one.*picture).pixel_count(); ++k) {
      ASSERT_TRUE(((one.*picture).beauty[k] == (two.*picture).beauty[k]).all());
      light += static_cast<double>((one.*picture).beauty[k].sum());
    }
    for (int y = 0; y < 11; ++y) {
      for (int x = 0; x < 20; ++x) {
        ASSERT_TRUE(((one.*picture).beauty[static_cast<std::size_t>((y + 9) * 32 + x + 5)] ==
                     (crop.*picture).beauty[static_cast<std::size_t>(y * 20 + x)])
                        .all());
      }
    }
  }
  EXPECT_GT(light, 10);
}

}  // namespace
}  // namespace heddle

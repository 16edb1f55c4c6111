#include "render/surface/interactive_microcylinder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/directions.h"
#include "tests/support/pictures.h"

namespace heddle {
namespace {

// Linen and crepe de Chine of Sadeghi et al. 2013, the latter without its slope.
MicrocylinderFabric linen() {
  MicrocylinderFabric fabric;
  MicrocylinderThread thread;
  thread.share = 0.33;
  thread.scattering = {1.46, Rgbd(0.06, 0.24, 0.3), 0.3, radians(12), radians(24)};
  thread.offsets = {radians(-25), radians(25)};
  fabric.threads = {thread, thread};
  fabric.threads[1].direction = 2;
  return fabric;
}

MicrocylinderFabric flat_silk() {
  MicrocylinderFabric fabric;
  MicrocylinderThread thread;
  thread.share = 0.7;
  thread.scattering = {1.345, Rgbd(0.12, 0.11, 0.01), 0.2, radians(5), radians(10)};
  thread.offsets = {radians(-35), radians(-35), radians(35), radians(35)};
  thread.lengths = {1, 0, 1};
  fabric.threads = {thread};
  thread.direction = 2;
  thread.share = 0.2;
  thread.offsets = {0, 0};
  thread.lengths = {1};
  fabric.threads.push_back(thread);
  return fabric;
}

InteractiveSettings small_tables(bool printed = false) {
  InteractiveSettings settings;
  settings.printed = printed;
  settings.table.columns = 20;
  settings.table.rows = 10;
  return settings;
}

const InteractiveMicrocylinder& linen_model(bool printed) {
  static const InteractiveMicrocylinder ours(linen(), small_tables(false));
  static const InteractiveMicrocylinder paper(linen(), small_tables(true));
  return printed ? paper : ours;
}

// Eight at a time, in single precision, without the least terms: the values are the same to this
// bound.
TEST(InteractiveMicrocylinderAgreement, EightAtATimeAreNearTheDoubles) {
  const std::vector<Mat3> frames = {Mat3::Identity()};
  const Vec3 m = Vec3(0.6F, 0.3F, -0.4F).normalized();
  const DistanceMaps maps(frames, [m](std::uint32_t, const Vec3& w) { return w.dot(m) < 0; }, {});
  MicrocylinderFabric velvet = linen();
  velvet.threads[0].offsets = {radians(-90), radians(-50)};
  velvet.threads[1].offsets = {radians(-90), radians(90)};
  MicrocylinderFabric normal_fresnel = flat_silk();
  normal_fresnel.conventions.fresnel = ThreadConventions::Fresnel::kNormal;
  double worst = 0;
  double squares = 0;
  double norm = 0;
  int count = 0;
  for (const MicrocylinderFabric& fabric : {linen(), flat_silk(), velvet, normal_fresnel}) {
    const InteractiveMicrocylinder model(fabric, small_tables());
    for (int k = 0; k < 1500; ++k) {
      RandomStream random(6, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3d wo = test::upper_direction(random);
      std::vector<Light> lights;
      for (int n = 0; n < 1 + k % 12; ++n) {
        const float sharpness = n == 5 ? 0 : std::pow(10.0F, 5 * random.uniform() - 1);
        lights.push_back(test::sg_light(sample_sphere(random), sharpness, Rgb(1, 2, 0.5F)));
      }
      const PointVisibility visibility =
          k % 2 == 0 ? PointVisibility{} : PointVisibility{&maps, maps.coefficients(0)};
      const Rgbd fast = model.shade(Mat3d::Identity(), wo, lights, visibility);
      const Rgbd slow = model.shade_in_double(Mat3d::Identity(), wo, lights, visibility);
      const double error = (fast - slow).abs().maxCoeff() / (slow.maxCoeff() + 1e-3);
      EXPECT_LT(error, 0.06) << k << ": " << fast.transpose() << " | " << slow.transpose();
      worst = std::max(worst, error);
      squares += (fast - slow).square().sum();
      norm += slow.square().sum();
      ++count;
    }
  }
  std::printf("  %d points: relative RMS %.2g, largest %.2g\n", count, std::sqrt(squares / norm),
              worst);
  EXPECT_LT(std::sqrt(squares / norm), 1e-3);
}

// Without slopes there is nothing to sample: tangents are the model's own.
TEST(InteractiveMicrocylinderAgreement, ReflectedIsSadeghisModelWhereCurvesAreFlat) {
  const InteractiveMicrocylinder interactive(flat_silk(), small_tables());
  EXPECT_EQ(interactive.tangents().size(), 3U);
  const Microcylinder model(flat_silk());
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    const Vec3d wi = test::upper_direction(random);
    const Vec3d wo = test::upper_direction(random);
    const Rgbd expected = model.published(wi, wo);
    EXPECT_LT((interactive.reflected(wi, wo) - expected).abs().maxCoeff(),
              1e-9 * expected.maxCoeff() + 1e-12);
  }
}

double rms_error(const InteractiveMicrocylinder& model, float sharpness, int count,
                 const DistanceMaps* maps, const std::function<bool(const Vec3&)>& visible) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  double error = 0;
  double norm = 0;
  for (int k = 0; k < count; ++k) {
    const Vec3d wo = test::upper_direction(random);
    const Light light = test::sg_light(sample_hemisphere(Vec3(0, 0, 1), random), sharpness);
    if (wo.z() < 0.1) continue;
    PointVisibility visibility;
    if (maps != nullptr) visibility = {maps, maps->coefficients(0)};
    const Rgbd value = model.shade(Mat3d::Identity(), wo, {&light, 1}, visibility);
    const Rgbd reference =
        ray_traced_radiance([&](const Vec3d& i, const Vec3d& o) { return model.reflected(i, o); },
                            Mat3d::Identity(), wo, {&light, 1}, visible, 32);
    error += (value - reference).square().sum();
    norm += reference.square().sum();
  }
  return std::sqrt(error / norm);
}

// The narrower the light, the fewer approximations are left: at last those of the table.
TEST(InteractiveMicrocylinderAgreement, OpenSurfaceAgainstRayTracing) {
  const auto open = [](const Vec3&) { return true; };
  const double limits[] = {0.13, 0.06, 0.05, 0.05};
  const float sharpnesses[] = {0, 10, 100, 1000};
  for (int k = 0; k < 4; ++k) {
    const double ours = rms_error(linen_model(false), sharpnesses[k], 40, nullptr, open);
    const double printed = rms_error(linen_model(true), sharpnesses[k], 40, nullptr, open);
    std::printf("  sharpness %4.0f: relative RMS %.4f, as printed %.4f\n",
                static_cast<double>(sharpnesses[k]), ours, printed);
    EXPECT_LT(ours, limits[k]);
    EXPECT_LT(ours, printed + 0.005);
  }
}

TEST(InteractiveMicrocylinderAgreement, ShadowOfAWallAgainstRayTracing) {
  const Vec3 m = Vec3(0.6F, 0.3F, -0.4F).normalized();
  const auto visible = [m](const Vec3& w) { return w.dot(m) < 0; };
  const std::vector<Mat3> frames = {Mat3::Identity()};
  const DistanceMaps maps(frames, [&](std::uint32_t, const Vec3& w) { return visible(w); }, {});
  for (const float sharpness : {10.0F, 100.0F}) {
    const double ours = rms_error(linen_model(false), sharpness, 40, &maps, visible);
    const double printed = rms_error(linen_model(true), sharpness, 40, &maps, visible);
    const double without = rms_error(linen_model(false), sharpness, 40, nullptr, visible);
    std::printf("  sharpness %4.0f: relative RMS %.4f, as printed %.4f, without shadow %.4f\n",
                static_cast<double>(sharpness), ours, printed, without);
    EXPECT_LT(ours, 0.09);
    EXPECT_LT(ours, 0.5 * without);
    EXPECT_LT(ours, printed + 0.005);
  }
}

TEST(InteractiveMicrocylinderLaw, EditingIsTheSameAsBuildingAnew) {
  MicrocylinderFabric fabric = flat_silk();
  InteractiveMicrocylinder edited(fabric, small_tables());
  fabric.threads[0].scattering = {1.6, Rgbd(0.5, 0.1, 0.2), 0.6, radians(14), radians(30)};
  edited.set_scattering(0, fabric.threads[0].scattering);
  const InteractiveMicrocylinder fresh(fabric, small_tables());
  const std::vector<Light> lights = {test::sg_light({0.3F, 0.2F, 1}, 20),
                                     test::sg_light({-1, 0.2F, 0.5F}, 200)};
  RandomStream random(3, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 50; ++k) {
    const Vec3d wo = test::upper_direction(random);
    const Rgbd a = edited.shade(Mat3d::Identity(), wo, lights, {});
    EXPECT_TRUE((a == fresh.shade(Mat3d::Identity(), wo, lights, {})).all());
  }
}

TEST(InteractiveMicrocylinderLaw, TurnsWithTheWorldAndIsLinearInLight) {
  const InteractiveMicrocylinder& model = linen_model(false);
  const Mat3d turn = frame_about(Vec3(0.4F, -0.3F, 0.8F).normalized()).cast<double>();
  std::vector<Light> lights = {test::sg_light({0.3F, 0.2F, 1}, 20, {1, 2, 3}),
                               test::sg_light({-1, 0.2F, 0.5F}, 200)};
  RandomStream random(4, RandomStage::kTest, 0, 0);
  const Vec3d wo = test::upper_direction(random);
  const Rgbd here = model.shade(Mat3d::Identity(), wo, lights, {});
  std::vector<Light> turned = lights;
  for (Light& light : turned) light.axis = turn.cast<float>() * light.axis;
  const Rgbd there = model.shade(turn, turn * wo, turned, {});
  // Axes are floats; the lights' sharpness magnifies their rounding.
  EXPECT_LT((there - here).abs().maxCoeff(), 1e-4 * here.maxCoeff());
  const Rgbd first = model.shade(Mat3d::Identity(), wo, {lights.data(), 1}, {});
  const Rgbd second = model.shade(Mat3d::Identity(), wo, {lights.data() + 1, 1}, {});
  // A thousandth of the light may be left out, another for each sum.
  EXPECT_LT((first + second - here).abs().maxCoeff(), 2e-3 * here.maxCoeff());
  lights[0].irradiance *= 2;
  EXPECT_LT(
      (model.shade(Mat3d::Identity(), wo, {lights.data(), 1}, {}) - 2 * first).abs().maxCoeff(),
      1e-12);
}

TEST(InteractiveMicrocylinder, DirectionalLightsAreSeenOrNot) {
  const InteractiveMicrocylinder& model = linen_model(false);
  const std::vector<Mat3> frames = {Mat3::Identity()};
  const DistanceMaps maps(frames, [](std::uint32_t, const Vec3& w) { return w.x() < 0; }, {});
  const PointVisibility visibility{&maps, maps.coefficients(0)};
  Light light;
  light.irradiance = {1, 2, 3};
  const Vec3d wo = Vec3d(0.2, 0.3, 0.8).normalized();
  light.axis = Vec3(-0.5F, 0.2F, 0.7F).normalized();
  const Rgbd expected =
      light.irradiance.cast<double>() * model.reflected(light.axis.cast<double>(), wo);
  EXPECT_TRUE((model.shade(Mat3d::Identity(), wo, {&light, 1}, visibility) == expected).all());
  light.axis.x() *= -1;
  EXPECT_EQ(model.shade(Mat3d::Identity(), wo, {&light, 1}, visibility).maxCoeff(), 0);
  EXPECT_GT(model.shade(Mat3d::Identity(), wo, {&light, 1}, {}).minCoeff(), 0);
}

TEST(InteractiveMicrocylinderStability, FiniteAndNotNegativeAnywhere) {
  MicrocylinderFabric velvet = linen();
  velvet.threads[0].offsets = {radians(-90), radians(-50)};
  velvet.threads[1].offsets = {radians(-90), radians(90)};
  const std::vector<Mat3> frames = {Mat3::Identity()};
  const DistanceMaps maps(frames, [](std::uint32_t, const Vec3& w) { return w.x() < 0.1F; }, {});
  for (const bool printed : {false, true}) {
    const InteractiveMicrocylinder model(velvet, small_tables(printed));
    for (int k = 0; k < 3000; ++k) {
      RandomStream random(5, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      Vec3d wo = test::upper_direction(random);
      Vec3 axis = sample_sphere(random);
      if (k % 3 == 0) wo.z() *= 1e-6;
      if (k % 5 == 0) axis = Vec3::Unit(k % 3);
      if (k % 7 == 0) axis = wo.cast<float>();
      if (k % 11 == 0) wo = Vec3d(0, 0, 1);
      if (k % 13 == 0) axis = Vec3(0, 0, -1);
      wo.normalize();
      const float sharpness = k % 4 == 0 ? 0 : std::pow(10.0F, 8 * random.uniform() - 2);
      const Light light = test::sg_light(axis, sharpness);
      const PointVisibility visibility =
          k % 2 == 0 ? PointVisibility{} : PointVisibility{&maps, maps.coefficients(0)};
      const Rgbd value = model.shade(Mat3d::Identity(), wo, {&light, 1}, visibility);
      EXPECT_TRUE(value.isFinite().all() && value.minCoeff() >= 0)
          << k << ": " << wo.transpose() << " | " << axis.transpose() << " | " << sharpness << ": "
          << value.transpose();
    }
  }
  const Light light = test::sg_light({0, 0, 1}, 10);
  EXPECT_EQ(
      linen_model(false).shade(Mat3d::Identity(), Vec3d(0, 0.6, -0.8), {&light, 1}, {}).maxCoeff(),
      0);
}

// Where W varies over a wide light it cannot be taken out of the integral (eq. 9), least so where
// tangents stand upright.
TEST(InteractiveMicrocylinderStability, WideLightsOnUprightTangentsAreOff) {
  MicrocylinderFabric velvet;
  MicrocylinderThread thread;
  thread.share = 0.5;
  thread.scattering = {1.46, Rgbd(0.015, 0.006, 0.001), 0.1, radians(6), radians(12)};
  thread.offsets = {radians(-90), radians(-50)};
  velvet.threads = {thread};
  const InteractiveMicrocylinder model(velvet, small_tables());
  const auto open = [](const Vec3&) { return true; };
  const double wide = rms_error(model, 0, 40, nullptr, open);
  const double narrow = rms_error(model, 100, 40, nullptr, open);
  std::printf("  relative RMS: constant light %.3f, sharpness 100 %.3f\n", wide, narrow);
  EXPECT_GT(wide, 0.15);
  EXPECT_LT(narrow, 0.08);
}

// A disc of directions of equal shares: the mean of a constant is that constant, of a cosine the
// Gaussian's moment.
TEST(RayTracedRadianceLaw, IntegratesGaussians) {
  for (const float sharpness : {0.0F, 3.0F, 500.0F}) {
    const Light light = test::sg_light({0, 0, 1}, sharpness, {2, 3, 4});
    const auto all = [](const Vec3&) { return true; };
    // The share of the light above the horizon, and its cosine there.
    const double s = static_cast<double>(sharpness);
    const double above = s == 0 ? 0.5 : std::expm1(-s) / std::expm1(-2 * s);
    const Rgbd constant =
        ray_traced_radiance([](const Vec3d&, const Vec3d&) { return Rgbd(1, 1, 1); },
                            Mat3d::Identity(), Vec3d(0, 0, 1), {&light, 1}, all, 64);
    EXPECT_NEAR(constant[2], 4 * above, 4 * 0.01);
    const Rgbd cosine = ray_traced_radiance(
        [](const Vec3d& wi, const Vec3d&) { return Rgbd::Constant(wi.z()).eval(); },
        Mat3d::Identity(), Vec3d(0, 0, 1), {&light, 1}, all, 64);
    // integral over [0, 1] of c exp(s (c - 1)) s / (1 - exp(-2 s)) dc.
    const double moment = s == 0 ? 0.25 : (1 - (-std::expm1(-s)) / s) / -std::expm1(-2 * s);
    EXPECT_NEAR(cosine[0], 2 * moment, 2 * 2e-3);
  }
}

}  // namespace
}  // namespace heddle

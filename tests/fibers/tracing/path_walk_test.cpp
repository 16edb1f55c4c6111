#include "fibers/tracing/path_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/quadrature.h"
#include "fibers/tracing/tile_trace.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

struct Estimate {
  double mean = 0;
  double standard_error = 0;
};

Estimate estimate(int samples, const std::function<double(int)>& sample) {
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < samples; ++i) {
    const double v = sample(i);
    sum += v;
    squares += v * v;
  }
  const double mean = sum / samples;
  return {mean, std::sqrt(std::max(0.0, squares / samples - mean * mean) / (samples - 1))};
}

FiberScattering dyed_fiber() {
  return test::fiber_in_degrees({.3, .2, .1}, {.9, .6, .4}, 6, 12, 25);
}

// Furnace: light 1 from everywhere, a white fiber: a path that follows the BCSDF carries exactly 1,
// wherever it leaves.
TEST(PathWalkLaw, FurnaceByScatteringIsExactlyOne) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    const TileScene scene(synthesize(config));
    const TileTrace trace(scene);
    const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
    int paths = 0;
    for (int i = 0; i < 4000; ++i) {
      RandomStream random(1, RandomStage::kTest, 10, static_cast<std::uint64_t>(i));
      const Vec3 direction = sample_hemisphere(Vec3(0, 0, -1), random);
      const auto first = trace.first(Vec3(random.uniform(), random.uniform(), 1), direction);
      if (!first) continue;
      const auto escape = walk_path(trace, materials, *first, -direction, Rgb::Ones(), random,
                                    WalkLimits{}, [](auto&&...) { return true; });
      ASSERT_TRUE(escape);
      EXPECT_NEAR(escape->throughput.maxCoeff(), 1, 1e-4);
      ++paths;
    }
    EXPECT_GT(paths, 1500);
  }
}

// Each hit widens a path by the lobe that scattered it: its variance is the sum of their squared
// betas, n beta^2 after n hits on fibers that reflect only.
TEST(PathWalkLaw, VariancesOfLobesAddUp) {
  const TileScene scene(synthesize(test::small_fabric("twill 2/2")));
  const TileTrace trace(scene);
  FiberScattering reflecting = dyed_fiber();
  reflecting.color_r = Rgbd(1, 1, 1);
  reflecting.color_tt = Rgbd(0, 0, 0);
  for (const FiberScattering& fiber : {reflecting, dyed_fiber()}) {
    const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
    const double r = std::pow(fiber.beta_r, 2);
    const double tt = std::pow(fiber.beta_tt, 2);
    const bool one_lobe = fiber.color_tt.maxCoeff() == 0;
    int several = 0;
    int of_both_lobes = 0;
    for (int i = 0; i < 3000; ++i) {
      RandomStream random(1, RandomStage::kTest, 14, static_cast<std::uint64_t>(i));
      const Vec3 direction = sample_hemisphere(Vec3(0, 0, -1), random);
      const auto first = trace.first(Vec3(random.uniform(), random.uniform(), 1), direction);
      if (!first) continue;
      int visits = 0;
      const auto escape = walk_path(
          trace, materials, *first, -direction, Rgb::Ones(), random, WalkLimits{},
          [&](const auto&, const Mat3&, const Vec3&, const Rgb&, int n) { return n == ++visits; });
      if (!escape) continue;
      EXPECT_EQ(escape->scatterings, visits);
      several += escape->scatterings > 2 ? 1 : 0;
      // How many of the hits were on the TT lobe.
      const double transmitted = (escape->variance - escape->scatterings * r) / (tt - r);
      const double whole = std::round(transmitted);
      EXPECT_NEAR(transmitted, whole, 1e-4 * escape->scatterings);
      EXPECT_GE(whole, 0);
      EXPECT_LE(whole, one_lobe ? 0 : escape->scatterings);
      of_both_lobes += whole > 0 && whole < escape->scatterings ? 1 : 0;
    }
    EXPECT_GT(several, 200);
    if (!one_lobe) {
      EXPECT_GT(of_both_lobes, 200);
    }
  }
}

// The same by light sampling only: at every vertex the light is asked for in one uniform direction.
TEST(PathWalkStatistical, FurnaceByLightSamplingIsOne) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    const TileScene scene(synthesize(config));
    const TileTrace trace(scene);
    const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
    const Vec3 down = Vec3(0.3F, 0.2F, -1).normalized();
    const Estimate radiance = estimate(60000, [&](int i) {
      RandomStream random(1, RandomStage::kTest, 11, static_cast<std::uint64_t>(i));
      const auto first = trace.first(Vec3(random.uniform(), random.uniform(), 1), down);
      if (!first) return 1.0;  // the light behind
      double sum = 0;
      walk_path(trace, materials, *first, -down, Rgb::Ones(), random, WalkLimits{},
                [&](const TileTrace::Vertex& vertex, const Mat3& frame, const Vec3& wo,
                    const Rgb& throughput, int) {
                  const Vec3 wi = sample_sphere(random);
                  if (trace.escapes(vertex, wi)) {
                    const Vec3 local = frame.transpose() * wi;
                    const Rgb f = materials[0].evaluate(local, frame.transpose() * wo);
                    sum += static_cast<double>((throughput * f)[0]) *
                           std::sqrt(1 - local.x() * local.x()) * 4 * kPi;
                  }
                  return true;
                });
      return sum;
    });
    std::printf("furnace by light sampling: %.5f, %.2f standard errors from 1\n", radiance.mean,
                (radiance.mean - 1) / radiance.standard_error);
    EXPECT_LT(radiance.standard_error, 0.01);
    EXPECT_NEAR(radiance.mean, 1, 4 * radiance.standard_error);
  }
}

// Single scattering on a fiber beside parallel ones, under light 1 from everywhere, against
// quadrature: parallel fiber B hides the azimuths within asin(r / distance) of the direction to its
// axis, whatever the inclination.
TEST(PathWalkStatistical, ParallelFibersAgreeWithQuadrature) {
  const float r = 0.05F;
  const float height = 4;
  const FiberScattering fiber = dyed_fiber();
  const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
  for (bool two : {false, true}) {
    std::vector<Vec2> places = {{2.0F, 0.0F}};
    if (two) places.emplace_back(2.15F, 0.04F);
    const TileScene scene(test::straight_fibers(1, height, places, r, 4, fiber));
    const TileTrace trace(scene);
    // A view that meets fiber 0 from above and aside; the hit point is where both eye ray and
    // cylinder say.
    const Vec3 direction = Vec3(0.35F, -0.3F, -1).normalized();
    const Vec3 target(0.4F, 2.01F, 0);
    const auto first = trace.first(target - 2 * direction, direction);
    ASSERT_TRUE(first);
    ASSERT_EQ(first->fiber, 0U);
    const Vec3d wo = -direction.cast<double>();

    std::vector<std::pair<double, double>> hidden;  // azimuth intervals, atan2(z, y)
    if (two) {
      for (int copy = -40; copy <= 40; ++copy) {
        const double dy = 2.15 + copy * static_cast<double>(height) - first->position.y();
        const double dz = 0.04 - first->position.z();
        const double half = std::asin(r / std::hypot(dy, dz));
        const double centre = std::atan2(dz, dy);
        hidden.emplace_back(centre - half, centre + half);
      }
    }
    // Integral over azimuth (fine midpoint rule, steps at the edges) and inclination
    // (Gauss-Legendre).
    const QuadratureRule theta = gauss_legendre(128, -kPi / 2, kPi / 2);
    Rgbd expected = Rgbd::Zero();
    const int azimuths = 4000;
    for (int k = 0; k < azimuths; ++k) {
      const double phi = -kPi + 2 * kPi * (k + 0.5) / azimuths;
      bool open = true;
      for (const auto& [low, high] : hidden) {
        for (double turn : {-2 * kPi, 0.0, 2 * kPi})
          open = open && !(phi + turn > low && phi + turn < high);
      }
      if (!open) continue;
      for (std::size_t n = 0; n < theta.nodes.size(); ++n) {
        const double t = theta.nodes[n];
        const Vec3d wi(std::sin(t), std::cos(t) * std::cos(phi), std::cos(t) * std::sin(phi));
        expected += evaluate_bcsdf(fiber, wi, wo) *
                    (std::cos(t) * std::cos(t) * theta.weights[n] * 2 * kPi / azimuths);
      }
    }
    for (int channel = 0; channel < 3; ++channel) {
      const Estimate radiance = estimate(40000, [&](int i) {
        RandomStream random(1, RandomStage::kTest, 12, static_cast<std::uint64_t>(i));
        const Mat3 frame = frame_about(first->tangent);
        const auto sample = materials[0].sample(frame.transpose() * -direction, random);
        return trace.escapes(*first, frame * sample.wi)
                   ? static_cast<double>(sample.weight[channel])
                   : 0.0;
      });
      std::printf("%s, channel %d: %.5f against quadrature %.5f, %.2f standard errors\n",
                  two ? "parallel fibers" : "one fiber", channel, radiance.mean, expected[channel],
                  (radiance.mean - expected[channel]) / radiance.standard_error);
      // 2e-3: the azimuth rule's steps at the edges of the hidden intervals.
      EXPECT_NEAR(radiance.mean, expected[channel],
                  4 * radiance.standard_error + 2e-3 * expected[channel]);
    }
  }
}

TEST(PathWalk, EndsWhereTheVisitorSaysSo) {
  const TileScene scene(synthesize(test::small_fabric()));
  const TileTrace trace(scene);
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
  RandomStream random(1, RandomStage::kTest, 13, 0);
  const TileTrace::Vertex start = trace.at(scene.exemplar().segment_midpoint(5), 5);
  int visits = 0;
  EXPECT_FALSE(walk_path(trace, materials, start, Vec3(0, 0, 1), Rgb::Ones(), random, WalkLimits{},
                         [&](auto&&...) {
                           ++visits;
                           return false;
                         }));
  EXPECT_EQ(visits, 1);
}

}  // namespace
}  // namespace heddle

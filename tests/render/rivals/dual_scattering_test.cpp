#include "render/rivals/dual_scattering.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

/// `layers` fibers along x straight above each other, 0.1 mm apart, radius 0.02 mm; the lowest is
/// segment 0's.
Exemplar stack(const FiberScattering& scattering, int layers) {
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  exemplar.scattering = {scattering};
  for (int k = 0; k < layers; ++k) {
    add_straight_fiber(exemplar, {0, 0.5F, 0.1F * static_cast<float>(k)}, true, 0.02F);
  }
  index_segments(exemplar);
  return exemplar;
}

struct Stack {
  explicit Stack(const FiberScattering& scattering, int layers)
      : tile(stack(scattering, layers)), materials{BcsdfTable(scattering)}, dual(tile, materials) {}
  TileScene tile;
  std::vector<BcsdfTable> materials;
  DualScattering dual;
};

ShadingPoint point_with(const Vec3& wo) {
  return {0, 0, 0, {{1, 0, 0}, {1, 0, 0}}, {wo, wo}};
}

TEST(DualScattering, CountsEveryFiberOnTheWayOnce) {
  for (const int layers : {1, 2, 5}) {
    const Stack stack(test_cotton(), layers);
    const float theta = 0.4F;  // the light leans along the fibers
    const Vec3 light(std::sin(theta), 0, std::cos(theta));
    const DualScattering::Passage way = stack.dual.passage({0.1F, 0.5F, 0}, 0, light);
    const DualScattering::Averages each = stack.dual.averages(0, theta);
    EXPECT_EQ(way.fibers, layers - 1);
    const auto n = static_cast<float>(layers - 1);
    EXPECT_LT((way.transmittance - each.forward.pow(n)).abs().maxCoeff(), 1e-5);
    EXPECT_LT((way.variance - n * each.forward_variance).abs().maxCoeff(), 1e-5);
  }
}

TEST(DualScattering, FibersThatOverlapCountOnceEach) {
  // Axes 0.02 mm apart, radii 0.02 mm: the ray enters the second fiber inside the first and leaves
  // the first inside the second.
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  exemplar.scattering = {test_cotton()};
  for (const float z : {0.0F, 0.1F, 0.12F, 0.14F})
    add_straight_fiber(exemplar, {0, 0.5F, z}, true, 0.02F);
  index_segments(exemplar);
  const TileScene tile(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(test_cotton())};
  EXPECT_EQ(DualScattering(tile, materials).passage({0.1F, 0.5F, 0}, 0, {0, 0, 1}).fibers, 3);
}

TEST(DualScatteringStability, RaysThroughTheLineWhereTwoSurfacesCrossEnd) {
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  exemplar.scattering = {test_cotton()};
  add_straight_fiber(exemplar, {0, 0.5F, 0}, true, 0.02F);
  add_straight_fiber(exemplar, {0, 0.495F, 0.1F}, true, 0.02F);
  add_straight_fiber(exemplar, {0, 0.505F, 0.1F}, true, 0.02F);
  index_segments(exemplar);
  const TileScene tile(exemplar);
  const std::vector<BcsdfTable> materials = {BcsdfTable(test_cotton())};
  const DualScattering dual(tile, materials);
  const Vec3 crossing(0.3F, 0.5F, 0.1F + std::sqrt(0.02F * 0.02F - 0.005F * 0.005F));
  for (int k = 0; k < 20000; ++k) {
    RandomStream random(3, RandomStage::kTest, 0, static_cast<std::uint64_t>(k));
    const Vec3 towards = crossing + 1e-6F * Vec3(0, random.uniform() - 0.5F, 0);
    const Vec3 start =
        crossing - Vec3(0.2F * (random.uniform() - 0.5F), 0.02F * (random.uniform() - 0.5F), 0.1F);
    ASSERT_LE(dual.passage(start, 0, (towards - start).normalized()).fibers, 2) << k;
  }
}

TEST(DualScattering, UncoveredFiberScattersOnceExactly) {
  const Stack stack(test_cotton(), 1);
  const Vec3 light = Vec3(0.3F, 0.5F, 0.9F).normalized();
  const Vec3 wo = Vec3(-0.2F, -0.4F, 0.7F).normalized();
  const DualScattering::Parts parts =
      stack.dual.directional(point_with(wo), {0.1F, 0.5F, 0}, {light, light});
  const Mat3 to_fiber = frame_about(Vec3(1, 0, 0)).transpose();
  const float cosine = std::sqrt(1 - light.x() * light.x());
  EXPECT_LT((parts.single - cosine * stack.materials[0].evaluate(to_fiber * light, to_fiber * wo))
                .abs()
                .maxCoeff(),
            1e-5);
  EXPECT_GT(parts.multiple.minCoeff(), 0);  // light that comes back from the fibers behind
  // A covered one receives only what comes through.
  const Stack covered(test_cotton(), 2);
  EXPECT_EQ(
      covered.dual.directional(point_with(wo), {0.1F, 0.5F, 0}, {Vec3(0, 0, 1), Vec3(0, 0, 1)})
          .single.maxCoeff(),
      0);
}

TEST(DualScatteringLaw, HalvesAddUpToTheAlbedo) {
  const FiberScattering cotton = test_cotton();
  const Stack stack(cotton, 1);
  for (const float theta : {-1.2F, -0.5F, 0.0F, 0.9F}) {
    const DualScattering::Averages averages = stack.dual.averages(0, theta);
    const Rgbd albedo = bcsdf_albedo(cotton, theta);
    EXPECT_LT(((averages.forward + averages.backward).cast<double>() - albedo).abs().maxCoeff(),
              1e-5);
    EXPECT_GT((averages.forward - averages.backward).minCoeff(), 0);  // TT goes on
  }
}

TEST(DualScatteringAgreement, ForwardHalfIsTheIntegralOfTheBcsdf) {
  const FiberScattering cotton = test_cotton();
  const Stack stack(cotton, 1);
  const double theta_i = 0.3;
  const QuadratureRule thetas =
      gauss_legendre_panels(16, -kPi / 2, kPi / 2, {-0.9, -0.6, -0.3, 0.0, 0.3});
  const QuadratureRule azimuths = gauss_legendre(64, kPi / 2, 3 * kPi / 2);
  double sum = 0;
  for (std::size_t i = 0; i < thetas.nodes.size(); ++i) {
    for (std::size_t k = 0; k < azimuths.nodes.size(); ++k) {
      const double cosine = std::cos(thetas.nodes[i]);
      sum += thetas.weights[i] * azimuths.weights[k] * cosine * cosine *
             evaluate_bcsdf(cotton, vector_from({theta_i, 0}),
                            vector_from({thetas.nodes[i], azimuths.nodes[k]}))
                 .x();
    }
  }
  EXPECT_NEAR(stack.dual.averages(0, static_cast<float>(theta_i)).forward.x(), sum, 1e-4);
}

TEST(DualScatteringLaw, SpreadLightKeepsItsEnergy) {
  // S^G integrates to the albedo whatever the spread.
  const FiberScattering cotton = test_cotton();
  const Stack stack(cotton, 1);
  for (const float variance : {0.0F, 0.01F, 0.1F, 1.0F}) {
    for (const float theta_d : {0.0F, 0.7F}) {
      const QuadratureRule thetas =
          gauss_legendre_panels(24, -kPi / 2, kPi / 2, {-1.0, -0.7, -0.4, -0.2, 0.0, 0.2, 0.5});
      double sum = 0;
      constexpr int kAzimuths = 90;
      for (std::size_t i = 0; i < thetas.nodes.size(); ++i) {
        const double cosine = std::cos(thetas.nodes[i]);
        for (int k = 0; k < kAzimuths; ++k) {
          sum += thetas.weights[i] * 2 * kPi / kAzimuths * cosine * cosine *
                 stack.dual
                     .spread_scattering(0, theta_d, static_cast<float>(thetas.nodes[i]),
                                        static_cast<float>(2 * kPi * k / kAzimuths),
                                        Rgb::Constant(variance))
                     .x();
        }
      }
      EXPECT_NEAR(sum / bcsdf_albedo(cotton, theta_d).x(), 1, 3e-3) << variance << " " << theta_d;
    }
  }
}

TEST(DualScatteringAgreement, BackscatteringIsTheSumOfItsSeries) {
  // A path that turns back once passes i fibers on its way in and out: a_b sum of a_f^(2 i). With
  // three turns the paper's triple sum over the fibers at which it turns is a_b^3 sum over i of i
  // (i + 1) / 2 a_f^(2 i).
  DualScattering::Averages averages;
  averages.forward = Rgb(0.5F, 0.7F, 0.2F);
  averages.backward = Rgb(0.4F, 0.1F, 0.6F);
  averages.forward_variance = Rgb::Constant(0.04F);
  averages.backward_variance = Rgb::Constant(0.09F);
  Rgb sum = Rgb::Zero();
  for (int i = 1; i < 200; ++i) {
    const auto n = static_cast<float>(i);
    sum += averages.forward.pow(2 * n) *
           (averages.backward + averages.backward.cube() * n * (n + 1) / 2);
  }
  const DualScattering::Backscattering back = DualScattering::backscattering(averages);
  EXPECT_LT((back.attenuation - sum).abs().maxCoeff(), 1e-4);
  // With a_b -> 0 only single turns count: (1 + a_f^2) sqrt(2 beta_f^2 + beta_b^2).
  averages.backward = Rgb::Zero();
  EXPECT_LT((DualScattering::backscattering(averages).deviation -
             (1 + averages.forward.square()) * std::sqrt(0.17F))
                .abs()
                .maxCoeff(),
            1e-5);
}

TEST(DualScatteringStability, ExtremeFibersGiveFiniteLight) {
  for (const double color_r : {0.0, 1.0}) {
    for (const double color_tt : {0.0, 1.0}) {
      for (const double width : {0.1, 10.0, 60.0}) {
        FiberScattering fiber;
        fiber.color_r = Rgbd::Constant(color_r);
        fiber.color_tt = Rgbd::Constant(color_tt);
        fiber.beta_r = fiber.beta_tt = fiber.gamma_tt = radians(width);
        for (const int layers : {1, 4}) {
          const Stack stack(fiber, layers);
          RandomStream random(1, RandomStage::kTest, 0, 0);
          for (int k = 0; k < 50; ++k) {
            const Vec3 light = sample_sphere(random);
            const Vec3 wo = sample_sphere(random);
            const DualScattering::Parts parts =
                stack.dual.directional(point_with(wo), {0.1F, 0.5F, 0}, {light, light});
            EXPECT_TRUE(parts.single.isFinite().all() && parts.multiple.isFinite().all());
            EXPECT_GE(parts.single.minCoeff(), 0);
            EXPECT_GE(parts.multiple.minCoeff(), 0);
          }
        }
      }
    }
  }
}

TEST(DualScatteringStability, ChannelsWithoutColourGiveFiniteLight) {
  // Fresnel's fifth power takes such a channel through the smallest numbers there are, a little off
  // the plane across the fiber.
  FiberScattering fiber;
  fiber.color_r = Rgbd(0.3, 0, 0);
  fiber.color_tt = Rgbd(0.5, 0, 0);
  fiber.beta_r = radians(1.0);
  fiber.beta_tt = fiber.gamma_tt = radians(27.0);
  const Stack stack(fiber, 4);
  const Vec3 wo = Vec3(0.3F, -0.5F, 0.8F).normalized();
  for (double theta = 1e-6; theta < 1e-2; theta *= 1.02) {
    const auto t = static_cast<float>(theta);
    const Vec3 light = {std::sin(t), 0.6F * std::cos(t), 0.8F * std::cos(t)};
    const DualScattering::Parts parts =
        stack.dual.directional(point_with(wo), {0.1F, 0.5F, 0}, {light, light});
    EXPECT_TRUE(parts.single.isFinite().all() && parts.multiple.isFinite().all()) << theta;
  }
}

}  // namespace
}  // namespace heddle

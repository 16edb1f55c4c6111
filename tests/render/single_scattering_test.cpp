#include "render/single_scattering.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

/// Two segments with the same signed distance d(direction) on the map's pixels; segment 1 sees
/// nothing.
SsdfVisibility make_ssdf(const std::function<double(const Vec3d&)>& distance) {
  SsdfVisibility ssdf;
  ssdf.components = 1;
  const int n = ssdf.resolution;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const double theta = kPi * (row + 0.5) / n;
      const double phi = 2 * kPi * (column + 0.5) / n;
      ssdf.mean.push_back(static_cast<float>(distance(Vec3d(
          std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)))));
      ssdf.basis.push_back(0);
    }
  }
  ssdf.coefficients.resize(2);
  ssdf.sees_nothing = {0, 1};
  return ssdf;
}

double upper_half_space(const Vec3d& w) {
  return kPi / 2 - std::acos(std::clamp(w.z(), -1.0, 1.0));
}

/// Lobes with random weights on a few axes; segment 0 is turned by 0.7 rad about z.
SgVisibility make_lobes() {
  SgVisibility lobes;
  lobes.sharpness = 40;
  RandomStream random(5, RandomStage::kTest, 0, 0);
  for (int q = 0; q < 24; ++q) {
    lobes.axes.push_back(sample_sphere(random));
    lobes.weights.push_back(half_from_float(random.uniform() * 0.3F));
  }
  for (int q = 0; q < 24; ++q) lobes.weights.push_back(half_from_float(0));
  lobes.rotation = {half_from_float(0.7F), half_from_float(0)};
  lobes.sees_nothing = {0, 1};
  return lobes;
}

ShadingPoint random_point(RandomStream& random, std::uint32_t segment = 0) {
  const Vec3 tangent = sample_sphere(random);
  const Vec3 wo = sample_sphere(random);
  return {segment, 0, 0, {tangent, tangent}, {wo, wo}};
}

Rgbd scattered(const FiberScattering& fiber, const Vec3& tangent, const Vec3d& wi, const Vec3& wo) {
  const Mat3d frame = frame_about(tangent).cast<double>();
  const Vec3d in = frame.transpose() * wi;
  return std::sqrt(std::max(0.0, 1 - in.x() * in.x())) *
         evaluate_bcsdf(fiber, in, frame.transpose() * wo.cast<double>());
}

/// Integral over the sphere by a product rule about `axis`, finer near it.
Rgbd integrate_about(const Vec3& axis, double sharpness,
                     const std::function<Rgbd(const Vec3d&)>& f) {
  constexpr int kAzimuths = 192;
  std::vector<double> breaks;
  append_geometric_breaks(0, 0.5 / std::sqrt(sharpness + 1), kPi, breaks);
  const QuadratureRule rule = gauss_legendre_panels(16, 0, kPi, breaks);
  const Mat3d frame = frame_about(axis).cast<double>();
  Rgbd sum = Rgbd::Zero();
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double theta = rule.nodes[i];
    for (int k = 0; k < kAzimuths; ++k) {
      const double phi = 2 * kPi * (k + 0.5) / kAzimuths;
      const Vec3d w = frame * Vec3d(std::cos(theta), std::sin(theta) * std::cos(phi),
                                    std::sin(theta) * std::sin(phi));
      sum += rule.weights[i] * std::sin(theta) * 2 * kPi / kAzimuths * f(w);
    }
  }
  return sum;
}

TEST(SingleScattering, DirectionalLightIsTheBcsdfWhereTheDistanceIsPositive) {
  const FiberScattering fiber = test::broad_fiber();
  const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
  const SsdfVisibility ssdf = make_ssdf(upper_half_space);
  const SingleScattering single(&ssdf, nullptr, materials);
  int lit = 0;
  for (int i = 0; i < 300; ++i) {
    RandomStream random(1, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
    const ShadingPoint point = random_point(random);
    const Vec3 light = sample_sphere(random);
    const Rgb got = single.directional(point, {light, light});
    if (light.z() < 0) {
      EXPECT_EQ(got.maxCoeff(), 0);
      continue;
    }
    ++lit;
    const Rgbd expected =
        scattered(fiber, point.tangent.world, light.cast<double>(), point.wo.world);
    EXPECT_LT((got.cast<double>() - expected).abs().maxCoeff(), 2e-4 * (expected.maxCoeff() + 1e-3))
        << i;
    ShadingPoint dark = point;
    dark.segment = 1;
    EXPECT_EQ(single.directional(dark, {light, light}).maxCoeff(), 0);
  }
  EXPECT_GT(lit, 100);
}

// Directional light is cut where the distance is 0, not near it. The stored distance is linear in
// the polar angle, which interpolation keeps: rounding only.
TEST(SingleScatteringLaw, DirectionalLightIsCutAtTheEdgeItself) {
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::broad_fiber())};
  const SsdfVisibility ssdf = make_ssdf(upper_half_space);
  const SingleScattering single(&ssdf, nullptr, materials);
  for (int i = 0; i < 200; ++i) {
    RandomStream random(12, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
    const ShadingPoint point = random_point(random);
    const float azimuth = 2 * kPif * random.uniform();
    for (const float height : {1e-4F, 0.002F, 0.005F, 0.01F, 0.02F}) {
      const Vec3 lit(std::cos(height) * std::cos(azimuth), std::cos(height) * std::sin(azimuth),
                     std::sin(height));
      EXPECT_GT(single.directional(point, {lit, lit}).maxCoeff(), 0) << i << ' ' << height;
      const Vec3 dark(lit.x(), lit.y(), -lit.z());
      EXPECT_EQ(single.directional(point, {dark, dark}).maxCoeff(), 0) << i << ' ' << height;
    }
  }
}

TEST(SingleScattering, VisibilityIsLookedUpInFabricSpaceAndScatteringInWorldSpace) {
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::broad_fiber())};
  const SsdfVisibility ssdf = make_ssdf(upper_half_space);
  const SingleScattering single(&ssdf, nullptr, materials);
  const Vec3 up(0, 0, 1);
  const Vec3 x(1, 0, 0);
  const ShadingPoint point = {0, 0, 0, {x, Vec3(0, 1, 0)}, {up, up}};
  EXPECT_GT(single.directional(point, {Vec3(0, 0, -1), up}).minCoeff(),
            0);  // TT straight through in the world
  EXPECT_EQ(single.directional(point, {up, Vec3(0, 0, -1)}).maxCoeff(), 0);
}

TEST(SingleScatteringAgreement, SoftLightIsTheQuadratureOfLobesTimesLightTimesBcsdf) {
  const FiberScattering fiber = test::broad_fiber();
  const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
  const SgVisibility lobes = make_lobes();
  const SingleScattering single(nullptr, &lobes, materials, kLobesOnly);
  const Mat3d turn =
      Eigen::AngleAxisd(float_from_half(lobes.rotation[0]), Vec3d::UnitZ()).toRotationMatrix();
  const auto visibility = [&](const Vec3d& w) {
    double sum = 0;
    for (int q = 0; q < lobes.lobes(); ++q) {
      sum += float_from_half(lobes.weights[q]) *
             sg_value({turn * lobes.axes[q].cast<double>(), lobes.sharpness}, w) /
             sg_mass(static_cast<double>(lobes.sharpness));
    }
    return sum;
  };
  for (const float sharpness : {0.0F, 3.0F, 30.0F, 100.0F}) {
    double difference = 0;
    double total = 0;
    for (int i = 0; i < 8; ++i) {
      RandomStream random(2, RandomStage::kTest, static_cast<std::uint64_t>(sharpness),
                          static_cast<std::uint64_t>(i));
      ShadingPoint point = random_point(random);
      const Vec3 axis = sample_sphere(random);
      // World-space directions do not count in this branch.
      point.tangent.world = sample_sphere(random);
      point.wo.world = sample_sphere(random);
      const Rgb got = single.spherical_gaussian(point, {sample_sphere(random), axis}, sharpness);
      const Rgbd expected = integrate_about(axis, sharpness, [&](const Vec3d& wi) -> Rgbd {
        return visibility(wi) * sg_value({axis.cast<double>(), sharpness}, wi) /
               sg_mass(static_cast<double>(sharpness)) *
               scattered(fiber, point.tangent.fabric, wi, point.wo.fabric);
      });
      difference += (got.cast<double>() - expected).abs().sum();
      total += expected.sum();
      ShadingPoint dark = point;
      dark.segment = 1;
      EXPECT_EQ(single.spherical_gaussian(dark, {axis, axis}, sharpness).maxCoeff(), 0);
    }
    // The products have sharpness 40 and more: Gamma is within 2 % there (sg_scatter.h), the lobes
    // left out hold less.
    EXPECT_LT(difference / total, 0.02) << sharpness;
    EXPECT_GT(total, 0.01);
  }
}

FiberScattering narrow_fiber() {
  FiberScattering fiber = test::broad_fiber();
  fiber.beta_r = radians(2);
  fiber.beta_tt = radians(4);
  fiber.gamma_tt = radians(15);
  return fiber;
}

/// Mean |error| over mean value, at lights within 1.4 deviations of the edge of the upper
/// half-space, seen near their specular cones.
double error_over_an_edge(const FiberScattering& fiber, float sharpness, SgMethod gamma) {
  const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
  const SsdfVisibility ssdf = make_ssdf(upper_half_space);
  const SingleScattering single(&ssdf, nullptr, materials, kSignedDistanceOnly, gamma);
  double difference = 0;
  double total = 0;
  for (int i = 0; i < 24; ++i) {
    RandomStream random(4, RandomStage::kTest, static_cast<std::uint64_t>(sharpness),
                        static_cast<std::uint64_t>(i));
    // in deviations of the light
    const float height = (random.uniform() - 0.3F) * 2 / std::sqrt(sharpness);
    const float azimuth = 2 * kPif * random.uniform();
    const Vec3 axis = Vec3(std::cos(azimuth), std::sin(azimuth), height).normalized();
    const Vec3 tangent = sample_sphere(random);
    const double reach = std::hypot(fiber.beta_r, 1 / std::sqrt(sharpness));
    const double theta = std::clamp(
        -std::asin(static_cast<double>(axis.dot(tangent))) + (2.0 * random.uniform() - 1) * reach,
        -1.5, 1.5);
    const Vec3 wo =
        frame_about(tangent) * vector_from({theta, 2 * kPi * random.uniform()}).cast<float>();
    const ShadingPoint point = {0, 0, 0, {tangent, tangent}, {wo, wo}};
    const Rgb got = single.spherical_gaussian(point, {axis, axis}, sharpness);
    const Rgbd expected = integrate_about(axis, sharpness, [&](const Vec3d& wi) -> Rgbd {
      if (wi.z() <= 0) return Rgbd::Zero();
      return sg_value({axis.cast<double>(), sharpness}, wi) /
             sg_mass(static_cast<double>(sharpness)) * scattered(fiber, tangent, wi, wo);
    });
    difference += (got.cast<double>() - expected).abs().sum();
    total += expected.sum();
  }
  return difference / total;
}

TEST(SingleScatteringAgreement, LightOverAnEdgeIsCloseToQuadrature) {
  std::printf(
      "  sharpness: broad fiber, narrow fiber; in brackets looked up at the light's axis\n");
  for (const float sharpness : {10.0F, 30.0F, 100.0F, 300.0F, 2000.0F}) {
    const double broad = error_over_an_edge(test::broad_fiber(), sharpness, SgMethod::kDefault);
    const double narrow = error_over_an_edge(narrow_fiber(), sharpness, SgMethod::kDefault);
    const double axis_broad =
        error_over_an_edge(test::broad_fiber(), sharpness, SgMethod::kPrinted);
    const double axis_narrow = error_over_an_edge(narrow_fiber(), sharpness, SgMethod::kPrinted);
    std::printf("  %5g: %.3f (%.3f), %.3f (%.3f)\n", static_cast<double>(sharpness), broad,
                axis_broad, narrow, axis_narrow);
    // What is left is the product's shape, taken as Gaussian; a lookup at the axis errs by up to
    // .34.
    EXPECT_LT(broad, 0.06) << sharpness;
    EXPECT_LT(narrow, 0.04) << sharpness;
    EXPECT_LT(narrow, 0.5 * axis_narrow) << sharpness;
  }
}

TEST(SingleScattering, SharpLightDoesNotDependOnHowTheClothLiesInSpace) {
  // The cloth turned in the world: directions there turn, those of fabric space stay.
  const std::vector<BcsdfTable> materials = {BcsdfTable(narrow_fiber())};
  const SsdfVisibility ssdf = make_ssdf(upper_half_space);
  const SingleScattering single(&ssdf, nullptr, materials, kSignedDistanceOnly);
  float largest = 0;
  for (int i = 0; i < 100; ++i) {
    RandomStream random(11, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
    ShadingPoint point = random_point(random);
    const float azimuth = 2 * kPif * random.uniform();
    const Vec3 axis =
        Vec3(std::cos(azimuth), std::sin(azimuth), random.uniform() - 0.3F).normalized();
    const Mat3 turn = frame_about(sample_sphere(random));
    const Rgb flat = single.spherical_gaussian(point, {axis, axis}, 40);
    point.tangent.world = turn * point.tangent.fabric;
    point.wo.world = turn * point.wo.fabric;
    const Rgb turned = single.spherical_gaussian(point, {turn * axis, axis}, 40);
    EXPECT_LT((turned - flat).abs().maxCoeff(), 1e-3F * flat.maxCoeff() + 1e-4F) << i;
    largest = std::max(largest, flat.maxCoeff());
  }
  EXPECT_GT(largest, 0.1F);
}

TEST(SingleScattering, GammaIsThePrintedOneWhereAsked) {
  const FiberScattering fiber = test::broad_fiber();
  const SsdfVisibility ssdf = make_ssdf([](const Vec3d&) { return kPi; });
  const std::vector<BcsdfTable> materials = {BcsdfTable(fiber)};
  const SingleScattering printed(&ssdf, nullptr, materials, kPrintedBlend, SgMethod::kPrinted);
  RandomStream random(9, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 20; ++k) {
    const ShadingPoint point = random_point(random);
    const Vec3 axis = sample_sphere(random);
    const Mat3 to_fiber = frame_about(point.tangent.world).transpose();
    const Rgbd expected =
        sg_scatter(fiber, {(to_fiber * axis).cast<double>(), 300},
                   (to_fiber * point.wo.world).cast<double>(), SgMethod::kPrinted) /
        sg_mass(300.0);
    const Rgb value = printed.spherical_gaussian(point, {axis, axis}, 300);
    EXPECT_LT((value.cast<double>() - expected).abs().maxCoeff(),
              1e-4 * expected.maxCoeff() + 1e-6);
  }
}

TEST(SingleScattering, BlendsLinearlyBetweenTheTwoRepresentations) {
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::broad_fiber())};
  const SsdfVisibility open = make_ssdf([](const Vec3d&) { return kPi; });
  const SsdfVisibility closed = make_ssdf([](const Vec3d&) { return -kPi; });
  const SgVisibility lobes = make_lobes();
  SgVisibility dark = lobes;
  dark.sees_nothing = {1, 1};
  RandomStream random(6, RandomStage::kTest, 0, 0);
  const ShadingPoint point = random_point(random);
  const Vec3 w = lobes.axes[3];
  const DirectionPair axis = {w, w};
  for (const float sharpness : {5.0F, 10.0F, 12.5F, 19.0F, 20.0F, 1000.0F}) {
    const float share = std::clamp((sharpness - 10) / 10, 0.0F, 1.0F);
    const Rgb both =
        SingleScattering(&open, &lobes, materials).spherical_gaussian(point, axis, sharpness);
    const Rgb only_sharp =
        SingleScattering(&open, &dark, materials).spherical_gaussian(point, axis, sharpness);
    const Rgb only_soft =
        SingleScattering(&closed, &lobes, materials).spherical_gaussian(point, axis, sharpness);
    EXPECT_LT((both - only_sharp - only_soft).abs().maxCoeff(), 1e-5 * both.maxCoeff());
    EXPECT_EQ(only_sharp.maxCoeff() > 0, share > 0);
    EXPECT_EQ(only_soft.maxCoeff() > 0, share < 1);
    // Gamma / M of the open sphere, times the share.
    const Mat3 to_fiber = frame_about(point.tangent.world).transpose();
    const Rgb unoccluded =
        materials[0].sg_scatter(to_fiber * w, sharpness, to_fiber * point.wo.world) /
        sg_mass(sharpness);
    EXPECT_LT((only_sharp - share * unoccluded).abs().maxCoeff(), 1e-5 * unoccluded.maxCoeff());
  }
}

}  // namespace
}  // namespace heddle

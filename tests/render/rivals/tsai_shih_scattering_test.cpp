#include "render/rivals/tsai_shih_scattering.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "tests/render/rivals/visibility_for_tests.h"
#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

TEST(TsaiShihScattering, VisibilityIsTheMapSeenThroughGaussians) {
  const SsdfVisibility ssdf = uniform_visibility({upper_half_space, all_open});
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
  const TsaiShihScattering scattering(ssdf, true, materials, 1);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  RunningMean open;
  RunningMean ripple;  // squared
  for (int k = 0; k < 2000; ++k) {
    const Vec3 w = sample_sphere(random);
    // Fourteen degrees are four deviations and half a cell from the edge. What is left are ripples
    // of the axes' lattice, and cells of the map that count for one axis as a whole: 15 % at most
    // (measured: 14), 5 % in the mean square (4).
    if (w.z() > std::sin(0.25F)) {
      EXPECT_NEAR(scattering.visibility(0, w), 1, 0.15);
      ripple.add(std::pow(scattering.visibility(0, w) - 1, 2));
    } else if (w.z() < -std::sin(0.25F)) {
      EXPECT_NEAR(scattering.visibility(0, w), 0, 1e-3);
    }
    open.add(scattering.visibility(1, w));
  }
  std::printf("  rms ripple of an open sky: %.2f %%\n", 100 * std::sqrt(ripple.mean()));
  EXPECT_LT(std::sqrt(ripple.mean()), 0.05);
  // The mean over the sphere is what the cells' solid angles sum to.
  EXPECT_NEAR(open.mean(), 1, 3 * open.standard_error() + 1e-3);
}

TEST(TsaiShihScatteringLaw, WhiteFurnaceUnderOpenSky) {
  // The white isotropic fiber in constant light 1 / 4 pi shows 1 / 4 pi.
  const SsdfVisibility ssdf = uniform_visibility({all_open});
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::white_fiber())};
  const TsaiShihScattering scattering(ssdf, true, materials, BcsdfFactors::kAllTerms);
  const ShadingPoint point = {0, 0, 0, {{1, 0, 0}, {1, 0, 0}}, {{0, 0.6F, 0.8F}, {0, 0.6F, 0.8F}}};
  const Rgb value = scattering.spherical_gaussian(point, {{0, 0, 1}, {0, 0, 1}}, 0);
  EXPECT_NEAR(4 * kPi * value.x(), 1, 0.01);
}

TEST(TsaiShihScatteringStatistical, AllTermsUnderHalfASkyAgreeWithSampling) {
  // Against the integral of L V S cos over directions drawn from the light: the truth that Khungurn
  // 2017 compares with.
  const FiberScattering cotton = test_cotton();
  const SsdfVisibility ssdf = uniform_visibility({upper_half_space});
  const std::vector<BcsdfTable> materials = {BcsdfTable(cotton)};
  const TsaiShihScattering scattering(ssdf, false, materials, BcsdfFactors::kAllTerms);
  RandomStream random(3, RandomStage::kTest, 0, 0);
  double difference = 0;
  double total = 0;
  double noise = 0;
  for (int k = 0; k < 24; ++k) {
    const Vec3 tangent = sample_sphere(random);
    const Vec3 wo = sample_sphere(random);
    const Vec3 axis = sample_hemisphere({0, 0, 1}, random);
    const Mat3 to_fiber = frame_about(tangent).transpose();
    RunningMean truth;
    for (int n = 0; n < 4000; ++n) {
      const Vec3 w = sample_spherical_gaussian(axis, 50, random);
      const Vec3 wi = to_fiber * w;
      const float cosine = std::sqrt(std::max(0.0F, 1 - wi.x() * wi.x()));
      truth.add(w.z() > 0 ? cosine * materials[0].evaluate(wi, to_fiber * wo).x() : 0);
    }
    const ShadingPoint point = {0, 0, 0, {tangent, tangent}, {wo, wo}};
    difference +=
        std::abs(scattering.spherical_gaussian(point, {axis, axis}, 50).x() - truth.mean());
    total += truth.mean();
    noise += truth.standard_error();
  }
  std::printf("  mean |difference| %.2f %% of the mean, of which noise %.2f %%\n",
              100 * difference / total, 100 * noise / total);
  // 3 %: the edge of visibility blurred by 3.2 degrees under a light of 8.
  EXPECT_LT(difference, 0.03 * total + noise);
}

}  // namespace
}  // namespace heddle

#include "render/rivals/prt_scattering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/scattering/sg_scatter.h"
#include "tests/render/rivals/visibility_for_tests.h"
#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

constexpr int kCount = sh_count(PrtScattering::kOrder);

ShadingPoint point_with(const Vec3& tangent, const Vec3& wo) {
  return {0, 0, 0, {tangent, tangent}, {wo, wo}};
}

TEST(PrtScatteringLaw, OpenSkyHandsEveryHarmonicOn) {
  const SsdfVisibility ssdf = uniform_visibility({all_open});
  const std::vector<BcsdfTable> materials = {BcsdfTable(test_cotton())};
  const PrtScattering prt(ssdf, true, materials);
  for (int j = 0; j < kCount; ++j) {
    // 1e-3: V = 1 projected by the midpoints of the map's cells.
    EXPECT_LT(
        (prt.transferred(0, Eigen::VectorXf::Unit(kCount, j)) - Eigen::VectorXf::Unit(kCount, j))
            .cwiseAbs()
            .maxCoeff(),
        1e-3);
  }
}

TEST(PrtScattering, HalfOfTheSkyHasTheKnownMatrix) {
  // Over z > 0: Y_00 Y_00 gives 1/2, Y_00 Y_10 gives sqrt(3) / 4, Y_10 Y_10 gives 1/2; what is odd
  // in x or y nothing.
  const SsdfVisibility ssdf = uniform_visibility({upper_half_space});
  const std::vector<BcsdfTable> materials = {BcsdfTable(test_cotton())};
  const PrtScattering prt(ssdf, false, materials);
  const Eigen::VectorXf constant = prt.transferred(0, Eigen::VectorXf::Unit(kCount, 0));
  EXPECT_NEAR(constant[0], 0.5, 1e-3);
  EXPECT_NEAR(constant[2], std::sqrt(3.0) / 4, 1e-3);
  EXPECT_NEAR(constant[1], 0, 1e-3);
  EXPECT_NEAR(constant[3], 0, 1e-3);
  const Eigen::VectorXf upward = prt.transferred(0, Eigen::VectorXf::Unit(kCount, 2));
  EXPECT_NEAR(upward[0], std::sqrt(3.0) / 4, 1e-3);
  EXPECT_NEAR(upward[2], 0.5, 1e-3);
}

TEST(PrtScatteringAgreement, ConstantLightUnderOpenSkyIsExact) {
  // Constant light has one harmonic, so nothing is cut: the response is Gamma at sharpness 0.
  const FiberScattering cotton = test_cotton();
  const SsdfVisibility ssdf = uniform_visibility({all_open});
  const std::vector<BcsdfTable> materials = {BcsdfTable(cotton)};
  const PrtScattering prt(ssdf, true, materials);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 20; ++k) {
    const Vec3 tangent = sample_sphere(random);
    const Vec3 wo = sample_sphere(random);
    const Vec3d local = (frame_about(tangent).transpose() * wo).cast<double>();
    const Rgbd exact =
        sg_scatter(cotton, {Vec3d(0, 0, 1), 0}, local, SgMethod::kQuadrature) / sg_mass(0.0);
    const Rgb value = prt.spherical_gaussian(point_with(tangent, wo), {{0, 0, 1}, {0, 0, 1}}, 0);
    EXPECT_LT((value.cast<double>() - exact).abs().maxCoeff(), 3e-3 * exact.maxCoeff());
  }
}

TEST(PrtScatteringStability, LosesHighlightsAndRings) {
  // A silk fiber along x in open sky, light at 30 degrees from the normal plane. Order 5 turns the
  // highlight of 1 degree into a bump of about 30 degrees: less than a tenth of its height is left,
  // and there is light of the wrong sign.
  const SsdfVisibility ssdf = uniform_visibility({all_open});
  const std::vector<BcsdfTable> materials = {BcsdfTable(test::silk_fiber())};
  const PrtScattering prt(ssdf, true, materials);
  const auto view = [](double degrees) {
    return Vec3d(std::sin(radians(degrees)), 0, std::cos(radians(degrees))).cast<float>().eval();
  };
  const Vec3 light = view(30);
  const auto red = [&](double degrees) {
    return prt.directional(point_with({1, 0, 0}, view(degrees)), {light, light}).x();
  };
  const float exact = light.z() * materials[0].evaluate(light, view(-30)).x();
  EXPECT_LT(red(-30), 0.1F * exact);
  float lowest = 0;
  for (int degrees = -85; degrees <= 85; degrees += 5) lowest = std::min(lowest, red(degrees));
  EXPECT_LT(lowest, -0.05F * red(-30));
}

}  // namespace
}  // namespace heddle

#include "fibers/math/spherical_gaussian.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_harmonics.h"

namespace heddle {
namespace {

// Integral over the sphere of G about +z times f(cosine), by panels in 1 - cosine that resolve the
// peak.
template <typename Function>
double integrate_about_z(double sharpness, Function&& f) {
  std::vector<double> breaks;
  append_geometric_breaks(0.0, 0.5 / (1.0 + sharpness), 4.0, breaks);
  return 2.0 * kPi * integrate(gauss_legendre_panels(24, 0.0, 2.0, breaks), [&](double drop) {
           return std::exp(-sharpness * drop) * f(1.0 - drop);
         });
}

const double kSharpnesses[] = {0.0, 1e-9, 1e-3, 0.5, 10.0, 150.0, 1e4, 1e8};

TEST(SphericalGaussianAgreement, MassAgainstQuadrature) {
  for (const double sharpness : kSharpnesses) {
    const double exact = integrate_about_z(sharpness, [](double) { return 1.0; });
    EXPECT_NEAR(sg_mass(sharpness) / exact, 1.0, 1e-12) << sharpness;
  }
  EXPECT_EQ(sg_mass(0.0), 4.0 * kPi);
}

TEST(SphericalGaussianAgreement, ZonalCoefficientsAgainstQuadrature) {
  for (const double sharpness : kSharpnesses) {
    const std::vector<double> zonal = sg_zonal(10, sharpness);
    for (int l = 0; l <= 10; ++l) {
      const double exact =
          integrate_about_z(
              sharpness,
              [l](double cosine) {
                double y[sh_count(10)];
                evaluate_sh(10, Vec3d(std::sqrt(std::max(0.0, 1.0 - cosine * cosine)), 0.0, cosine),
                            y);
                return y[l * (l + 1)];
              }) /
          sg_mass(sharpness);
      EXPECT_NEAR(zonal[static_cast<std::size_t>(l)], exact, 1e-11)
          << "l " << l << ", sharpness " << sharpness;
    }
  }
}

TEST(SphericalGaussianLaw, ProductIsTheProductEverywhere) {
  RandomStream random(3, RandomStage::kTest, 0, 0);
  for (const double sharpness_a : kSharpnesses) {
    for (const double sharpness_b : {0.0, 0.3, 128.0, 1e6}) {
      const SphericalGaussian a{sample_sphere(random).cast<double>().normalized(), sharpness_a};
      const SphericalGaussian b{sample_sphere(random).cast<double>().normalized(), sharpness_b};
      const SgProduct product = sg_product(a, b);
      EXPECT_LE(product.log_scale, 0.0);
      for (int k = 0; k < 20; ++k) {
        const Vec3d w = sample_sphere(random).cast<double>().normalized();
        // Compared as exponents: the values themselves underflow.
        const double separate = -0.5 * (sharpness_a * (w - a.axis).squaredNorm() +
                                        sharpness_b * (w - b.axis).squaredNorm());
        const double together = product.log_scale - 0.5 * product.gaussian.sharpness *
                                                        (w - product.gaussian.axis).squaredNorm();
        EXPECT_NEAR(together, separate, 1e-13 * (1.0 + sharpness_a + sharpness_b));
      }
    }
  }
}

TEST(SphericalGaussianStability, OppositeEqualGaussiansGiveAConstant) {
  const SgProduct product = sg_product({Vec3d::UnitX(), 50.0}, {-Vec3d::UnitX(), 50.0});
  EXPECT_EQ(product.gaussian.sharpness, 0.0);
  EXPECT_EQ(product.log_scale, -100.0);
  EXPECT_NEAR(product.gaussian.axis.norm(), 1.0, 1e-15);
  const SgProduct nothing = sg_product({Vec3d::UnitX(), 0.0}, {Vec3d::UnitY(), 0.0});
  EXPECT_EQ(nothing.log_scale, 0.0);
}

// A uniform distribution is the limit of little sharpness; the first term of the difference is
// known: depth = 2 share - 2 sharpness share (1 - share).
TEST(SphericalGaussian, DepthOfAShareNearsTheUniformDistributionSmoothly) {
  for (const double sharpness : {0.0, 1e-300, 1e-17, 1e-15, 1e-10, 1e-7, 1e-5}) {
    for (const double share : {0.0, 0.01, 0.3, 0.9, 1.0}) {
      const double expected = 2 * share - 2 * sharpness * share * (1 - share);
      EXPECT_NEAR(sg_depth_of_share(share, sharpness), expected, 1e-15 + 4 * sharpness * sharpness)
          << sharpness << " " << share;
    }
  }
}

TEST(SphericalGaussian, DepthOfAShareAndShareWithinAreInverse) {
  for (const double sharpness : {0.0, 1e-16, 1e-12, 1e-3, 1.0, 30.0, 1e4, 1e8}) {
    EXPECT_EQ(sg_share_within(0, sharpness), 0) << sharpness;
    EXPECT_EQ(sg_share_within(2, sharpness), 1) << sharpness;
    for (const double share : {1e-6, 0.1, 0.5, 0.99}) {
      const double depth = sg_depth_of_share(share, sharpness);
      EXPECT_GT(depth, 0);
      EXPECT_LT(depth, 2);
      EXPECT_NEAR(sg_share_within(depth, sharpness) / share, 1, 1e-12) << sharpness << " " << share;
    }
  }
  // Half a turn from the axis is as far as any share goes.
  for (const double sharpness : {0.0, 1e-3, 30.0, 1e8})
    EXPECT_NEAR(sg_depth_of_share(1, sharpness), 2, 1e-3) << sharpness;
}

}  // namespace
}  // namespace heddle

#include "fibers/scattering/sg_scatter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/fibers/scattering/fibers_for_tests.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

TEST(SgScatterLaw, ConstantLightGivesTheAdjointAlbedo) {
  for (const NamedFiber& named : fibers_for_tests()) {
    for (const double theta_deg : {0.0, -40.0, 80.0, 90.0}) {
      const double theta_o = radians(theta_deg);
      const Rgbd albedo = bcsdf_sh(named.scattering, theta_o, 0)[0] * std::sqrt(4.0 * kPi);
      const SphericalGaussian light{Vec3d(0.6, 0.0, 0.8), 0.0};
      const Rgbd value =
          sg_scatter(named.scattering, light, vector_from({theta_o, 0.3}), SgMethod::kQuadrature);
      EXPECT_LT((value - albedo).abs().maxCoeff(), 1e-10) << named.name << " at " << theta_deg;
    }
  }
}

TEST(SgScatterLaw, NarrowLightGivesTheBcsdf) {
  for (const NamedFiber& named : fibers_for_tests()) {
    if (named.scattering.beta_r < radians(0.5) || named.scattering.beta_tt < radians(0.5)) continue;
    const Vec3d axis = vector_from({0.31, 2.9});
    const Vec3d wo = vector_from({-0.3, 0.0});
    const Rgbd exact = evaluate_bcsdf(named.scattering, axis, wo) * std::cos(0.31);
    for (const SgMethod method : {SgMethod::kPrinted, SgMethod::kDefault, SgMethod::kQuadrature}) {
      const Rgbd value = sg_scatter(named.scattering, {axis, 1e8}, wo, method) / sg_mass(1e8);
      // The next term is 1 / sharpness times half the curvature, at most beta^-2 = 3283; rules are
      // interpolated to 1e-5.
      EXPECT_LT((value - exact).abs().maxCoeff(), 5e-5 * exact.maxCoeff() + 1e-15) << named.name;
    }
  }
}

// Against a two-dimensional quadrature that knows nothing of the azimuth integral.
TEST(SgScatterAgreement, QuadratureAgainstBruteForce) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const NamedFiber& named : fibers_for_tests()) {
    const FiberScattering& fiber = named.scattering;
    for (const double sharpness : {0.5, 30.0, 2000.0}) {
      const Vec3d wo =
          vector_from({2.6 * (random.uniform_double() - 0.5), 6.0 * random.uniform_double()});
      const double theta_o = fiber_direction(wo).theta;
      const double phi_o = fiber_direction(wo).phi;
      const FiberDirection axis{std::clamp(-theta_o + 0.1, -1.5, 1.5),
                                phi_o + 2.0 + random.uniform_double()};
      std::vector<double> theta_breaks;
      std::vector<double> phi_breaks;
      append_geometric_breaks(-theta_o, std::min(fiber.beta_r, fiber.beta_tt), kPi, theta_breaks);
      append_geometric_breaks(axis.theta, 0.5 / std::sqrt(1.0 + sharpness), kPi, theta_breaks);
      append_geometric_breaks(axis.phi, 0.5 / std::sqrt(1.0 + sharpness), kPi, phi_breaks);
      for (const double opposite : {phi_o - kPi, phi_o + kPi}) {
        append_geometric_breaks(opposite, std::min(1.0, fiber.gamma_tt), kPi, phi_breaks);
      }
      const QuadratureRule phi_rule =
          gauss_legendre_panels(8, axis.phi - kPi, axis.phi + kPi, phi_breaks);
      const SphericalGaussian light{vector_from(axis), sharpness};
      const Rgbd exact = integrate(
          gauss_legendre_panels(10, -0.5 * kPi, 0.5 * kPi, theta_breaks), [&](double theta) {
            const Rgbd ring = integrate(phi_rule, [&](double phi) {
              const Vec3d wi = vector_from({theta, phi});
              const double strength = sg_value(light, wi);
              return strength > 1e-30 ? Rgbd(strength * evaluate_bcsdf(fiber, wi, wo))
                                      : Rgbd(Rgbd::Zero());
            });
            return Rgbd(ring * (std::cos(theta) * std::cos(theta)));
          });
      const Rgbd value = sg_scatter(fiber, light, wo, SgMethod::kQuadrature);
      EXPECT_LT((value - exact).abs().maxCoeff(), 1e-6 * exact.maxCoeff())
          << named.name << ", sharpness " << sharpness;
    }
  }
}

TEST(SgScatterAgreement, WhiteIsotropicFiber) {
  const Vec3d wo = vector_from({0.1, 0.0});
  for (const double sharpness : {0.0, 1.0, 30.0, 1e4}) {
    const SphericalGaussian light{vector_from({0.9, 0.4}), sharpness};
    std::vector<double> theta_breaks;
    append_geometric_breaks(0.9, 0.5 / std::sqrt(1.0 + sharpness), kPi, theta_breaks);
    std::vector<double> phi_breaks;
    append_geometric_breaks(0.4, 0.5 / std::sqrt(1.0 + sharpness), kPi, phi_breaks);
    const QuadratureRule phi_rule = gauss_legendre_panels(12, 0.4 - kPi, 0.4 + kPi, phi_breaks);
    const double exact = integrate(
        gauss_legendre_panels(12, -0.5 * kPi, 0.5 * kPi, theta_breaks), [&](double theta) {
          const double cosine = std::cos(theta);
          return cosine * cosine / (kPi * kPi) * integrate(phi_rule, [&](double phi) {
                   return sg_value(light, vector_from({theta, phi}));
                 });
        });
    EXPECT_NEAR(sg_scatter(test::white_fiber(), light, wo, SgMethod::kQuadrature)[0] / exact, 1.0,
                1e-10);
    EXPECT_NEAR(sg_scatter(test::white_fiber(), light, wo, SgMethod::kDefault)[0] / exact, 1.0,
                2e-3);
  }
}

struct ErrorRow {
  double printed[3];
  double three[3];
};

// Mean |error| / mean value over random lights near the specular cone, at sharpness 25, 100, 400.
ErrorRow error_row(bool is_tt, double beta_deg, double gamma_deg, double low_deg, double high_deg) {
  const double sharpnesses[] = {25.0, 100.0, 400.0};
  const FiberScattering fiber =
      test::fiber_in_degrees({.3, .3, .3}, {.7, .7, .7}, beta_deg, beta_deg, gamma_deg);
  const Lobe lobe = is_tt ? Lobe::kTt : Lobe::kR;
  ErrorRow row{};
  for (int s = 0; s < 3; ++s) {
    RandomStream random(2, RandomStage::kTest, 0, static_cast<std::uint64_t>(s));
    double total = 0.0;
    for (int k = 0; k < 100; ++k) {
      const double theta_o = radians(low_deg + (high_deg - low_deg) * random.uniform_double());
      const double spread = std::hypot(fiber.beta_r, 1.0 / std::sqrt(sharpnesses[s]));
      const double theta =
          sample_cut_gaussian(static_cast<float>(-theta_o), static_cast<float>(spread), random);
      const double turn = 2.0 * random.uniform_double() - 1.0;
      const double phi = is_tt ? kPi + fiber.gamma_tt * turn : kPi * turn;
      const SphericalGaussian light{vector_from({theta, phi}), sharpnesses[s]};
      const Vec3d wo = vector_from({theta_o, 0.0});
      const double exact = sg_scatter(fiber, light, wo, SgMethod::kQuadrature, lobe)[0];
      total += exact;
      row.printed[s] += std::abs(sg_scatter(fiber, light, wo, SgMethod::kPrinted, lobe)[0] - exact);
      row.three[s] += std::abs(sg_scatter(fiber, light, wo, SgMethod::kDefault, lobe)[0] - exact);
    }
    row.printed[s] *= 100.0 / total;
    row.three[s] *= 100.0 / total;
  }
  std::printf(
      "  %s beta %4.1f deg, theta_o %2.0f to %2.0f deg: printed %6.2f %6.2f %6.2f %%, default "
      "%6.3f %6.3f "
      "%6.3f %%\n",
      is_tt ? "TT" : "R ", beta_deg, low_deg, high_deg, row.printed[0], row.printed[1],
      row.printed[2], row.three[0], row.three[1], row.three[2]);
  return row;
}

// An independent prototype measured, with three plain Gauss-Hermite nodes, R at 75 to 85
// degrees 3.9, 1.3, 0.30 % at sharpness 25, 100, 400 and up to 60 degrees .34, .06, .01 %. The
// default must not be worse.
TEST(SgScatterStability, ErrorsOfTheFastForms) {
  std::printf("  mean |error| at sharpness 25, 100, 400\n");
  for (const double beta : {5.0, 10.0}) {
    const ErrorRow grazing = error_row(false, beta, 12.0, 75.0, 85.0);
    EXPECT_LT(grazing.three[0], 3.9);
    EXPECT_LT(grazing.three[1], 1.3);
    EXPECT_LT(grazing.three[2], 0.30);
    // The printed form is known to fail here; that it does shows that the test measures what it
    // claims.
    EXPECT_GT(grazing.printed[1], 4.0);
    const ErrorRow moderate = error_row(false, beta, 12.0, 0.0, 60.0);
    EXPECT_LT(moderate.three[0], 0.34);
    EXPECT_LT(moderate.three[1], 0.06);
    EXPECT_LT(moderate.three[2], 0.01);
    EXPECT_LT(moderate.printed[1], 3.0);
  }
  EXPECT_LT(error_row(false, 1.0, 12.0, 0.0, 85.0).three[0], 0.01);
  const ErrorRow transmitted = error_row(true, 10.0, 12.0, 80.0, 89.0);
  EXPECT_LT(transmitted.three[0], 1.0);
  EXPECT_GT(transmitted.printed[0], 10.0);
  EXPECT_LT(error_row(true, 27.0, 38.0, 0.0, 89.0).three[0], 0.5);
}

TEST(SgScatterStability, FiniteAndNotNegativeEverywhere) {
  for (const NamedFiber& named : fibers_for_tests()) {
    for (double sharpness = 1e-3; sharpness < 2e8; sharpness *= 100.0) {
      for (const double theta_deg : {-90.0, -50.0, 0.0, 89.9}) {
        for (const double light_deg : {-90.0, -89.0, -30.0, 0.0, 50.0}) {
          const Vec3d wo = vector_from({radians(theta_deg), 0.0});
          for (const double phi : {0.0, 3.0, kPi}) {
            const SphericalGaussian light{vector_from({radians(light_deg), phi}), sharpness};
            for (const SgMethod method : {SgMethod::kPrinted, SgMethod::kDefault}) {
              const Rgbd value = sg_scatter(named.scattering, light, wo, method);
              ASSERT_TRUE(value.allFinite() && value.minCoeff() >= 0.0)
                  << named.name << ", sharpness " << sharpness << ", theta_o " << theta_deg
                  << ", light " << light_deg;
            }
          }
          const SphericalGaussian light{vector_from({radians(light_deg), 3.0}), sharpness};
          const Rgbd value = sg_scatter(named.scattering, light, wo, SgMethod::kQuadrature);
          ASSERT_TRUE(value.allFinite() && value.minCoeff() >= 0.0)
              << named.name << ", sharpness " << sharpness;
        }
      }
    }
  }
}

}  // namespace
}  // namespace heddle

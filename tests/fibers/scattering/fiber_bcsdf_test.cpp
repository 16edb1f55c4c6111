#include "fibers/scattering/fiber_bcsdf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/spherical_harmonics.h"
#include "tests/fibers/scattering/fibers_for_tests.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

const double kInclinationsDeg[] = {-90, -89.9, -80, -35, 0, 12, 60, 85, 89, 89.99, 90};

// Brute-force integral over directions w of f(w) cos(theta), with panels about the lobes' centre
// (theta, phi).
template <typename Function>
auto integrate_sphere(const FiberScattering& fiber, double theta_centre, double phi_centre,
                      Function&& f) {
  std::vector<double> theta_breaks;
  std::vector<double> phi_breaks;
  for (const double beta : {fiber.beta_r, fiber.beta_tt})
    append_geometric_breaks(theta_centre, beta, kPi, theta_breaks);
  append_geometric_breaks(phi_centre, std::min(1.0, fiber.gamma_tt), kPi, phi_breaks);
  const QuadratureRule theta_rule = gauss_legendre_panels(10, -0.5 * kPi, 0.5 * kPi, theta_breaks);
  const QuadratureRule phi_rule =
      gauss_legendre_panels(10, phi_centre - kPi, phi_centre + kPi, phi_breaks);
  return integrate(theta_rule, [&](double theta) {
    auto ring = integrate(phi_rule, [&](double phi) { return f(vector_from({theta, phi})); });
    return decltype(ring)(ring * (std::cos(theta) * std::cos(theta)));
  });
}

TEST(FiberBcsdfLaw, EnergyIsSchlickPlusTransmission) {
  for (const NamedFiber& named : fibers_for_tests()) {
    const FiberScattering& fiber = named.scattering;
    for (const double theta_deg : kInclinationsDeg) {
      const double theta = radians(theta_deg);
      const Rgbd reflected =
          fiber.color_r + (1.0 - fiber.color_r) * std::pow(1.0 - std::cos(theta), 5);
      const Rgbd exact = reflected + (1.0 - reflected) * fiber.color_tt;
      EXPECT_LT((bcsdf_albedo(fiber, theta) - exact).abs().maxCoeff(), 1e-11)
          << named.name << " at " << theta_deg;
    }
  }
  EXPECT_NEAR(bcsdf_albedo(test::white_fiber(), 0.4)[1], 1.0, 1e-13);
}

TEST(FiberBcsdfLaw, EnergyOfTheEvaluatedFunction) {
  for (const NamedFiber& named : fibers_for_tests()) {
    for (const double theta_deg : {0.0, -50.0, 88.0}) {
      const double theta = radians(theta_deg);
      const Vec3d wi = vector_from({theta, 0.7});
      const Rgbd value = integrate_sphere(
          named.scattering, -theta, 0.7 + kPi,
          [&](const Vec3d& wo) { return evaluate_bcsdf(named.scattering, wi, wo); });
      EXPECT_LT((value - bcsdf_albedo(named.scattering, theta)).abs().maxCoeff(), 1e-6)
          << named.name << " at " << theta_deg;
    }
  }
}

TEST(FiberBcsdf, KnownValueOnTheSpecularCone) {
  // At theta_i = theta_o = 0 and opposite azimuths, beta small enough that the cut does not show:
  // Gn = (1 + exp(-2 beta^2)) / 2, V = 1 / (2 pi I0(k) exp(-k)), with I0(4) = 11.301921952136331.
  const double beta = radians(5.0);
  FiberScattering fiber;
  fiber.color_r = {0.2, 0.5, 0.9};
  fiber.color_tt = {0.3, 1.0, 0.0};
  fiber.beta_r = fiber.beta_tt = beta;
  fiber.gamma_tt = 0.5;
  const double m = 1.0 / (std::sqrt(2.0 * kPi) * beta * 0.5 * (1.0 + std::exp(-2.0 * beta * beta)));
  const double v = 1.0 / (2.0 * kPi * 11.301921952136331 * std::exp(-4.0));
  const Vec3d wi(0.0, 1.0, 0.0);
  const Vec3d wo(0.0, -1.0, 0.0);
  const Rgbd exact = m * (fiber.color_r / (2.0 * kPi) + (1.0 - fiber.color_r) * fiber.color_tt * v);
  const Rgbd exact_r = m * fiber.color_r / (2.0 * kPi);
  EXPECT_LT((evaluate_bcsdf(fiber, wi, wo) / exact - 1.0).abs().maxCoeff(), 1e-12);
  EXPECT_LT((evaluate_bcsdf(fiber, wi, wo, Lobe::kR) / exact_r - 1.0).abs().maxCoeff(), 1e-12);
}

TEST(FiberBcsdf, LobesLieWhereTheConventionsSay) {
  const FiberScattering fiber = fibers_for_tests()[0].scattering;
  const Vec3d wi = vector_from({0.5, 1.0});
  const auto at = [&](double theta_o, double phi_o, Lobe lobe) {
    return evaluate_bcsdf(fiber, wi, vector_from({theta_o, phi_o}), lobe)[0];
  };
  EXPECT_GT(at(-0.5, 0.3, Lobe::kR), at(-0.4, 0.3, Lobe::kR));
  EXPECT_GT(at(-0.5, 0.3, Lobe::kR), at(-0.6, 0.3, Lobe::kR));
  EXPECT_NEAR(at(-0.5, 0.3, Lobe::kR), at(-0.5, 2.9, Lobe::kR), 1e-12);
  EXPECT_GT(at(-0.5, 1.0 + kPi, Lobe::kTt), at(-0.5, 1.2 + kPi, Lobe::kTt));
  EXPECT_NEAR(at(-0.5, 0.8 + kPi, Lobe::kTt), at(-0.5, 1.2 + kPi, Lobe::kTt), 1e-12);
  EXPECT_NEAR(at(-0.3, 2.0, Lobe::kR) + at(-0.3, 2.0, Lobe::kTt), at(-0.3, 2.0, Lobe::kAll), 1e-14);
}

TEST(FiberBcsdfLaw, OnlyTheWhiteIsotropicFiberIsReciprocal) {
  const Vec3d a = vector_from({0.2, 0.0});
  const Vec3d b = vector_from({-1.3, 2.0});
  const FiberScattering wide = fibers_for_tests()[5].scattering;
  EXPECT_GT((evaluate_bcsdf(wide, a, b) / evaluate_bcsdf(wide, b, a) - 1.0).abs().minCoeff(), 0.01);
  const FiberScattering white = test::white_fiber();
  EXPECT_EQ(evaluate_bcsdf(white, a, b)[0], evaluate_bcsdf(white, b, a)[0]);
}

TEST(FiberBcsdfAgreement, HarmonicsAgainstBruteForce) {
  constexpr int kOrder = 6;
  constexpr int kCount = sh_count(kOrder);
  using Matrix = Eigen::Array<double, kCount, 3>;
  for (const NamedFiber& named : fibers_for_tests()) {
    for (const double theta_deg : {0.0, 40.0, -87.0, 90.0}) {
      const double theta_o = radians(theta_deg);
      const Vec3d wo(std::sin(theta_o), theta_deg == 90.0 ? 0.0 : std::cos(theta_o), 0.0);
      const Matrix exact = integrate_sphere(named.scattering, -theta_o, kPi, [&](const Vec3d& wi) {
        Eigen::Array<double, kCount, 1> y;
        evaluate_sh(kOrder, wi, y.data());
        const Rgbd value = evaluate_bcsdf(named.scattering, wi, wo);
        return Matrix((y.matrix() * value.matrix().transpose()).array());
      });
      const std::vector<Rgbd> row = bcsdf_sh(named.scattering, theta_o, kOrder);
      ASSERT_EQ(row.size(), static_cast<std::size_t>(kCount));
      for (int j = 0; j < kCount; ++j) {
        EXPECT_LT((row[static_cast<std::size_t>(j)] - exact.row(j).transpose()).abs().maxCoeff(),
                  2e-6)
            << named.name << " at " << theta_deg << ", j " << j;
      }
    }
  }
}

TEST(FiberBcsdfLaw, HarmonicsOddInZVanish) {
  for (const NamedFiber& named : fibers_for_tests()) {
    for (const double theta_deg : kInclinationsDeg) {
      const std::vector<Rgbd> row = bcsdf_sh(named.scattering, radians(theta_deg), 10);
      for (int l = 0; l <= 10; ++l) {
        for (int m = -l; m <= l; ++m) {
          if ((l + m) % 2 == 0) continue;
          const auto j = static_cast<std::size_t>(l * (l + 1) + m);
          EXPECT_LT(row[j].abs().maxCoeff(), 1e-13) << named.name << " " << l << " " << m;
        }
      }
    }
  }
}

TEST(FiberBcsdfLaw, WhiteIsotropicFiberScattersTheWholeFurnaceToOne) {
  for (const double theta_deg : {0.0, 45.0, 90.0}) {
    const std::vector<Rgbd> row = bcsdf_sh(test::white_fiber(), radians(theta_deg), 4);
    EXPECT_NEAR(row[0][0] * std::sqrt(4.0 * kPi), 1.0, 1e-13);
    EXPECT_NEAR(row[3][0], 0.0, 1e-14);  // cos(theta) is even in x
  }
}

TEST(FiberBcsdfStability, FiniteAndNotNegativeEverywhere) {
  for (const NamedFiber& named : fibers_for_tests()) {
    for (const double theta_i_deg : kInclinationsDeg) {
      for (const double theta_o_deg : kInclinationsDeg) {
        for (const double phi : {0.0, 1.0, kPi}) {
          const Vec3d wi = vector_from({radians(theta_i_deg), 0.0});
          const Vec3d wo = vector_from({radians(theta_o_deg), phi});
          const Rgbd value = evaluate_bcsdf(named.scattering, wi, wo);
          ASSERT_TRUE(value.allFinite() && value.minCoeff() >= 0.0)
              << named.name << " " << theta_i_deg << " " << theta_o_deg;
        }
      }
      for (const Rgbd& c : bcsdf_sh(named.scattering, radians(theta_i_deg), 5)) {
        ASSERT_TRUE(c.allFinite()) << named.name;
      }
    }
    // Exactly along the tangent there is no azimuth.
    EXPECT_TRUE(evaluate_bcsdf(named.scattering, Vec3d::UnitX(), -Vec3d::UnitX()).allFinite())
        << named.name;
  }
}

}  // namespace
}  // namespace heddle

// The fast forms of BCSDF and Gamma at the ends of all parameters' ranges: finite, not negative,
// and no more light out than in.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/scattering/bcsdf_table.h"
#include "tests/fibers/scattering/fibers_for_tests.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

std::vector<FiberScattering> extreme_fibers() {
  std::vector<FiberScattering> fibers;
  for (const double beta : {0.1, 5.0, 60.0}) {
    for (const double gamma : {0.1, 60.0}) {
      for (const double color_r : {0.0, 1.0}) {
        for (const double color_tt : {0.0, 1.0}) {
          fibers.push_back(test::fiber_in_degrees(Rgbd::Constant(color_r), Rgbd::Constant(color_tt),
                                                  beta, beta, gamma));
        }
      }
    }
  }
  return fibers;
}

TEST(ExtremeParametersStability, FiniteAndNotNegative) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const FiberScattering& fiber : extreme_fibers()) {
    const BcsdfTable table(fiber);
    for (int k = 0; k < 200; ++k) {
      const Vec3 wi = sample_sphere(random);
      // also on both lobes' peak
      const Vec3 wo = k % 4 == 0 ? Vec3(-wi.x(), -wi.y(), -wi.z()) : sample_sphere(random);
      const Rgb value = table.evaluate(wi, wo);
      EXPECT_TRUE(value.isFinite().all());
      EXPECT_GE(value.minCoeff(), 0);
      for (const float sharpness : {1e-3F, 1.0F, 1e3F, 1e8F}) {
        const Rgb response = table.sg_scatter(wi, sharpness, wo);
        EXPECT_TRUE(response.isFinite().all()) << sharpness;
        EXPECT_GE(response.minCoeff(), 0) << sharpness;
      }
    }
  }
}

TEST(ExtremeParametersStability, NoMoreLightOutThanIn) {
  // Integrated over wo, Gamma cos(theta_o) is the light's own integral of the albedo times
  // cos(theta_i): at most the light's mass. 6 %: Gamma's three nodes at a grazing axis, whose
  // errors are in sg_scatter.h.
  double worst = 0;
  for (const FiberScattering& fiber : extreme_fibers()) {
    const BcsdfTable table(fiber);
    for (const double sharpness : {1e-3, 1.0, 100.0, 1e5}) {
      for (const double theta : {0.0, 0.8, 1.4}) {
        const Vec3 axis = vector_from({theta, 0}).cast<float>();
        const double width = std::hypot(fiber.beta_r, 1 / std::sqrt(sharpness + 1));
        std::vector<double> breaks;
        append_geometric_breaks(-theta, width, kPi / 2, breaks);
        const QuadratureRule inclinations = gauss_legendre_panels(12, -kPi / 2, kPi / 2, breaks);
        std::vector<double> turns;
        append_geometric_breaks(0, std::hypot(fiber.gamma_tt, 1 / std::sqrt(sharpness + 1)), kPi,
                                turns);
        // from straight on; symmetric
        const QuadratureRule azimuths = gauss_legendre_panels(12, 0, kPi, turns);
        double out = 0;
        for (std::size_t i = 0; i < inclinations.nodes.size(); ++i) {
          const double cosine = std::cos(inclinations.nodes[i]);
          for (std::size_t k = 0; k < azimuths.nodes.size(); ++k) {
            const Vec3 wo =
                vector_from({inclinations.nodes[i], kPi - azimuths.nodes[k]}).cast<float>();
            out += 2 * inclinations.weights[i] * azimuths.weights[k] * cosine * cosine *
                   static_cast<double>(
                       table.sg_scatter(axis, static_cast<float>(sharpness), wo).maxCoeff());
          }
        }
        const double share = out / sg_mass(sharpness);
        worst = std::max(worst, share);
        EXPECT_LT(share, 1.06) << "beta " << fiber.beta_r << " gamma " << fiber.gamma_tt << " C_R "
                               << fiber.color_r.x() << " C_TT " << fiber.color_tt.x()
                               << " sharpness " << sharpness << " theta " << theta;
      }
    }
  }
  std::printf("  most light out per light in: %.4f\n", worst);
}

}  // namespace
}  // namespace heddle

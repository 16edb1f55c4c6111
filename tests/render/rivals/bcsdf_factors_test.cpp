#include "render/rivals/bcsdf_factors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/scattering/sg_scatter.h"
#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

Vec3 direction(double theta, double phi) {
  return vector_from({theta, phi}).cast<float>();
}

/// Middle of step i of the lattice.
double lattice_theta(const BcsdfFactors& factors, int i) {
  return kPi * ((i + 0.5) / factors.thetas() - 0.5);
}

TEST(BcsdfFactorsAgreement, AllTermsAreTheBcsdfOnTheLattice) {
  for (const FiberScattering& fiber : {test::silk_fiber(), test_cotton(), test::white_fiber()}) {
    const BcsdfFactors factors(fiber, BcsdfFactors::kAllTerms);
    RandomStream random(1, RandomStage::kTest, 0, 0);
    for (int k = 0; k < 200; ++k) {
      const int i = static_cast<int>(random.index(static_cast<std::uint64_t>(factors.thetas())));
      const double theta_i = lattice_theta(factors, i);
      // on the specular cone
      const double theta_o = lattice_theta(factors, factors.thetas() - 1 - i);
      const double phi = 2 * kPi * random.uniform_double();
      const Rgbd exact = std::cos(theta_i) * evaluate_bcsdf(fiber, vector_from({theta_i, 0.3}),
                                                            vector_from({theta_o, phi}));
      const Rgb value = factors.value(direction(theta_i, 0.3), direction(theta_o, phi));
      // 1e-3: asin in float near the poles, where a step of the lattice is a large part of a lobe.
      EXPECT_LT((value.cast<double>() - exact).abs().maxCoeff(), 2e-3 * exact.maxCoeff() + 1e-5)
          << theta_i << " " << phi;
    }
  }
}

TEST(BcsdfFactorsAgreement, ResponseToGaussiansIsGamma) {
  for (const FiberScattering& fiber : {test::silk_fiber(), test_cotton()}) {
    const BcsdfFactors factors(fiber, BcsdfFactors::kAllTerms);
    RandomStream random(2, RandomStage::kTest, 0, 0);
    for (const double sharpness : {0.0, 5.0, 50.0, 500.0}) {
      double difference = 0;
      double sum = 0;
      for (int k = 0; k < 40; ++k) {
        const Vec3 axis = sample_sphere(random);
        const Vec3 wo = sample_sphere(random);
        const Rgbd exact = sg_scatter(fiber, {axis.cast<double>().normalized(), sharpness},
                                      wo.cast<double>().normalized(), SgMethod::kQuadrature);
        const Rgb value = factors.response(axis, static_cast<float>(sharpness), wo);
        difference += (value.cast<double>() - exact).abs().sum();
        sum += exact.sum();
      }
      // The lattice's linear interpolation in theta_o; largest for the narrow R lobe.
      EXPECT_LT(difference, 0.02 * sum) << sharpness;
    }
  }
}

TEST(BcsdfFactorsLaw, WhatIsCutOffIsWhatTheSingularValuesSay) {
  // Eckart and Young: the squared weighted difference to the full matrix, over its squared norm, is
  // 1 less the kept share.
  const FiberScattering cotton = test_cotton();
  const BcsdfFactors full(cotton, BcsdfFactors::kAllTerms);
  double last = 0;
  for (const int terms : {1, 4, 16, 64}) {
    const BcsdfFactors cut(cotton, terms);
    EXPECT_LE(cut.terms()[0], terms);
    EXPECT_GE(cut.terms()[0], terms - 1);
    const int n = full.thetas();
    constexpr int kAzimuths = 24;
    double lost = 0;
    double whole = 0;
    for (int i = 0; i < n; ++i) {
      for (int o = 0; o < n; ++o) {
        const double theta_i = lattice_theta(full, i);
        const double theta_o = lattice_theta(full, o);
        for (int k = 0; k < kAzimuths; ++k) {
          const Vec3 wi = direction(theta_i, 2 * kPi * k / kAzimuths);
          const Vec3 wo = direction(theta_o, 0);
          const double exact = full.value(wi, wo).x();
          const double difference = cut.value(wi, wo).x() - exact;
          const double weight = std::cos(theta_i) * std::cos(theta_o);
          lost += weight * difference * difference;
          whole += weight * exact * exact;
        }
      }
    }
    EXPECT_NEAR(lost / whole, 1 - cut.energy()[0], 2e-3) << terms;
    EXPECT_GT(cut.energy()[0], last);
    last = cut.energy()[0];
  }
  EXPECT_GT(last, 0.95);
}

TEST(BcsdfFactors, IsotropicFiberHasOneTerm) {
  const BcsdfFactors factors(test::white_fiber(), 1);
  EXPECT_NEAR(factors.energy()[0], 1, 1e-5);
  EXPECT_NEAR(factors.value(direction(0.3, 1), direction(-0.8, 2)).x(), std::cos(0.3) / (kPi * kPi),
              1e-4);
}

TEST(BcsdfFactorsStability, SixteenTermsOfASpecularFiber) {
  // The R lobe of 1 degree needs hundreds of terms. By solid angles, sixteen keep a blurred picture
  // of it, a small part of its height; of the plain matrix they keep grazing directions and nothing
  // else.
  const BcsdfFactors full(test::silk_fiber(), BcsdfFactors::kAllTerms);
  const BcsdfFactors weighted(test::silk_fiber(), 16);
  const BcsdfFactors plain(test::silk_fiber(), 16, BcsdfFactors::Matrix::kPlain);
  const Vec3 wi = direction(0.4, 0);
  const Vec3 wo = direction(-0.4, 0.5);
  const float peak = full.value(wi, wo).x();
  std::printf("  share of the squared norm in 16 terms: %.3f %.3f %.3f, plain matrix %.3f\n",
              weighted.energy()[0], weighted.energy()[1], weighted.energy()[2], plain.energy()[0]);
  EXPECT_LT(weighted.energy()[0], 0.4);
  EXPECT_LT(std::abs(weighted.value(wi, wo).x()), 0.3F * peak);
  EXPECT_LT(std::abs(plain.value(wi, wo).x()), 1e-3F * peak);
}

}  // namespace
}  // namespace heddle

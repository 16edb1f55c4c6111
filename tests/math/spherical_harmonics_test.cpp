#include "fibers/math/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

TEST(SphericalHarmonics, TheFirstBandsAreTheKnownPolynomials) {
  const Vec3d w = Vec3d(0.3, -0.5, 0.7).normalized();
  std::vector<double> y(9);
  evaluate_sh(2, w, y.data());
  const double band1 = std::sqrt(3.0 / (4.0 * kPi));
  EXPECT_NEAR(y[0], std::sqrt(0.25 / kPi), 1e-15);
  EXPECT_NEAR(y[1], band1 * w.y(), 1e-15);
  EXPECT_NEAR(y[2], band1 * w.z(), 1e-15);
  EXPECT_NEAR(y[3], band1 * w.x(), 1e-15);
  const double band2 = std::sqrt(15.0 / (4.0 * kPi));
  EXPECT_NEAR(y[4], band2 * w.x() * w.y(), 1e-15);
  EXPECT_NEAR(y[5], band2 * w.y() * w.z(), 1e-15);
  EXPECT_NEAR(y[6], std::sqrt(5.0 / (16.0 * kPi)) * (3.0 * w.z() * w.z() - 1.0), 1e-15);
  EXPECT_NEAR(y[7], band2 * w.x() * w.z(), 1e-15);
  EXPECT_NEAR(y[8], 0.5 * band2 * (w.x() * w.x() - w.y() * w.y()), 1e-15);
}

TEST(SphericalHarmonicsLaw, TheyAreOrthonormal) {
  constexpr int kCount = sh_count(kMaxShOrder);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(kCount, kCount);
  Eigen::VectorXd y(kCount);
  const QuadratureRule& heights = gauss_legendre(12);
  constexpr int kAngles = 24;
  for (std::size_t h = 0; h < heights.nodes.size(); ++h) {
    const double z = heights.nodes[h];
    const double radius = std::sqrt(1.0 - z * z);
    for (int a = 0; a < kAngles; ++a) {
      const double phi = 2.0 * kPi * a / kAngles;
      evaluate_sh(kMaxShOrder, Vec3d(radius * std::cos(phi), radius * std::sin(phi), z), y.data());
      products += heights.weights[h] * 2.0 * kPi / kAngles * y * y.transpose();
    }
  }
  EXPECT_LT((products - Eigen::MatrixXd::Identity(kCount, kCount)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SphericalHarmonicsLaw, AdditionTheorem) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 20; ++k) {
    const Vec3d a = sample_sphere(random).cast<double>().normalized();
    std::vector<double> y(sh_count(kMaxShOrder));
    evaluate_sh(kMaxShOrder, a, y.data());
    for (int l = 0; l <= kMaxShOrder; ++l) {
      double sum = 0.0;
      for (int j = l * l; j < (l + 1) * (l + 1); ++j)
        sum += y[static_cast<std::size_t>(j)] * y[static_cast<std::size_t>(j)];
      EXPECT_NEAR(sum, (2.0 * l + 1.0) / (4.0 * kPi), 1e-12) << "band " << l;
    }
  }
}

TEST(SphericalHarmonicsAgreement, FloatAgainstDoubleAtEveryOrder) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (int order = 0; order <= kMaxShOrder; ++order) {
    for (int k = 0; k < 50; ++k) {
      const Vec3 w =
          k == 0 ? Vec3::UnitZ() : (k == 1 ? Vec3(-Vec3::UnitZ()) : sample_sphere(random));
      std::vector<float> single(static_cast<std::size_t>(sh_count(order)));
      std::vector<double> twice(single.size());
      evaluate_sh(order, w, single.data());
      evaluate_sh(order, Vec3d(w.cast<double>()), twice.data());
      for (std::size_t j = 0; j < single.size(); ++j)
        EXPECT_NEAR(single[j], twice[j], 5e-6) << "order " << order << ", " << j;
    }
  }
}

}  // namespace
}  // namespace heddle

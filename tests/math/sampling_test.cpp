#include "fibers/math/sampling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

constexpr int kSamples = 200000;

TEST(Sampling, FrameIsARotationThatTakesXToTheTangent) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 1000; ++k) {
    Vec3 tangent = sample_sphere(random);
    if (k < 6) tangent = (k < 3 ? 1.0F : -1.0F) * Vec3(Mat3::Identity().col(k % 3));
    if (k == 6) tangent = Vec3(1e-6F, 0.0F, -1.0F).normalized();
    const Mat3 frame = frame_about(tangent);
    EXPECT_LT((frame * frame.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-6F);
    EXPECT_NEAR(frame.determinant(), 1.0F, 1e-6F);
    EXPECT_EQ(Vec3(frame * Vec3::UnitX()), tangent);
  }
}

TEST(SamplingStatistical, SphereAndHemisphere) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  EXPECT_TRUE(chi_square_accepts(
      "sphere", [&] { return Vec3d(sample_sphere(random).cast<double>()); },
      [](const Vec3d&) { return 0.25 / kPi; }, kSamples, 2));
  const Vec3 axis = Vec3::UnitX();
  EXPECT_TRUE(chi_square_accepts(
      "hemisphere", [&] { return Vec3d(sample_hemisphere(axis, random).cast<double>()); },
      [](const Vec3d& w) { return w.x() > 0.0 ? 0.5 / kPi : 0.0; }, kSamples, 2));
}

TEST(SamplingStatistical, DiskIsUniform) {
  RandomStream random(3, RandomStage::kTest, 0, 0);
  constexpr int kSide = 16;
  std::vector<double> observed(kSide * kSide, 0.0);
  const std::vector<double> expected(kSide * kSide,
                                     static_cast<double>(kSamples) / (kSide * kSide));
  for (int k = 0; k < kSamples; ++k) {
    // Squared radius and angle are uniform for a uniform point.
    const Vec2 p = sample_disk(random);
    const double ring = std::min(0.999999, static_cast<double>(p.squaredNorm()));
    const double turn = std::min(0.999999, 0.5 + std::atan2(p.y(), p.x()) / (2.0 * kPi));
    observed[static_cast<std::size_t>(static_cast<int>(ring * kSide) * kSide +
                                      static_cast<int>(turn * kSide))] += 1.0;
  }
  EXPECT_GT(chi_square(expected, observed).p_value, kSignificance);
}

TEST(SamplingStatistical, SphericalGaussian) {
  const float sharpnesses[] = {0.0F, 1e-3F, 1.0F, 30.0F, 1e3F, 1e5F};
  RandomStream random(4, RandomStage::kTest, 0, 0);
  for (const float sharpness : sharpnesses) {
    // The window holds five deviations about an axis in the equator of the harness.
    const Vec3 axis(0.0F, 1.0F, 0.0F);
    AngleWindow window;
    if (sharpness > 10.0F) {
      const double reach = 5.0 / std::sqrt(sharpness);
      window = {-reach, reach, -reach, reach};
    }
    EXPECT_TRUE(chi_square_accepts(
        "spherical Gaussian " + std::to_string(sharpness),
        [&] { return Vec3d(sample_spherical_gaussian(axis, sharpness, random).cast<double>()); },
        [&](const Vec3d& w) {
          return sg_value({axis.cast<double>(), sharpness}, w) /
                 sg_mass(static_cast<double>(sharpness));
        },
        kSamples, 6, window));
  }
}

TEST(SamplingStatistical, SphericalGaussianMomentsUpToTheHighestSharpness) {
  RandomStream random(5, RandomStage::kTest, 0, 0);
  const Vec3 axis = Vec3(0.3F, -0.8F, 0.4F).normalized();
  for (const float sharpness : {0.0F, 1.0F, 1e4F, 1e8F}) {
    RunningMean drop;
    for (int k = 0; k < kSamples; ++k) {
      const Vec3 w = sample_spherical_gaussian(axis, sharpness, random);
      drop.add(0.5 * static_cast<double>((w - axis).squaredNorm()));
    }
    // Mean of 1 - cosine is 1 - A_1. At 1e8 rounding of float directions (6e-8 per component
    // against 1e-4) adds below 1e-6.
    const double lambda = sharpness;
    const double exact = lambda > 1e3 ? 1.0 / lambda : 1.0 - spherical_bessel_ratios(1, lambda)[1];
    EXPECT_TRUE(means_agree("1 - cosine, sharpness " + std::to_string(sharpness), drop.mean(),
                            drop.standard_error(), exact, 1e-5 * exact, 4));
  }
}

TEST(SamplingAgreement, FloatDensityOfTheSphericalGaussian) {
  RandomStream random(6, RandomStage::kTest, 0, 0);
  for (const float sharpness : {0.0F, 1.0F, 150.0F, 1e4F}) {
    for (int k = 0; k < 100; ++k) {
      const Vec3 axis = sample_sphere(random);
      const Vec3 w = sample_spherical_gaussian(axis, sharpness, random);
      const double exact = sg_value({axis.cast<double>(), sharpness}, w.cast<double>()) /
                           sg_mass(static_cast<double>(sharpness));
      EXPECT_NEAR(static_cast<double>(spherical_gaussian_pdf(axis, sharpness, w)) / exact, 1.0,
                  1e-4);
    }
  }
}

// An angle becomes a direction in the equator or on a meridian of the harness.
TEST(SamplingStatistical, VonMises) {
  const double concentrations[] = {0.0, 1e-6, 0.1, 2.24, 8.35, 500.0, 3.3e5};
  RandomStream random(7, RandomStage::kTest, 0, 0);
  for (const double concentration : concentrations) {
    const VonMisesSampler sampler(concentration);
    const double reach = concentration > 20.0 ? 5.0 / std::sqrt(concentration) : kPi;
    // Uniform height times von Mises azimuth: density 1/2 * von Mises.
    EXPECT_TRUE(chi_square_accepts(
        "von Mises " + std::to_string(concentration),
        [&] {
          const double x = 2.0 * random.uniform_double() - 1.0;
          const double phi = sampler.sample(random);
          const double radius = std::sqrt(1.0 - x * x);
          return Vec3d(x, radius * std::cos(phi), radius * std::sin(phi));
        },
        [&](const Vec3d& w) {
          const double half_sine = std::sin(0.5 * std::atan2(w.z(), w.y()));
          return 0.5 * std::exp(-2.0 * concentration * half_sine * half_sine) /
                 (2.0 * kPi * scaled_bessel_i0(concentration));
        },
        kSamples, 7, {-0.5 * kPi, 0.5 * kPi, -reach, reach}));
  }
}

TEST(SamplingStatistical, CutGaussian) {
  struct Case {
    double mean;
    double deviation_deg;
  };
  const Case cases[] = {{0.0, 60.0},      {0.5 * kPi, 60.0}, {-1.2, 27.0},
                        {0.5 * kPi, 1.0}, {0.7, 0.1},        {-0.5 * kPi, 0.1}};
  RandomStream random(8, RandomStage::kTest, 0, 0);
  for (const Case& c : cases) {
    const double deviation = radians(c.deviation_deg);
    const double mass = 0.5 * erf_difference((-0.5 * kPi - c.mean) / (std::sqrt(2.0) * deviation),
                                             (0.5 * kPi - c.mean) / (std::sqrt(2.0) * deviation));
    EXPECT_NEAR(static_cast<double>(
                    cut_gaussian_mass(static_cast<float>(c.mean), static_cast<float>(deviation))) /
                    mass,
                1.0, 1e-5);
    const AngleWindow window{std::max(-0.5 * kPi, c.mean - 5.0 * deviation),
                             std::min(0.5 * kPi, c.mean + 5.0 * deviation)};
    EXPECT_TRUE(chi_square_accepts(
        "cut Gaussian " + std::to_string(c.deviation_deg) + " deg",
        [&] {
          const double theta = sample_cut_gaussian(static_cast<float>(c.mean),
                                                   static_cast<float>(deviation), random);
          const double phi = 2.0 * kPi * random.uniform_double();
          return Vec3d(std::sin(theta), std::cos(theta) * std::cos(phi),
                       std::cos(theta) * std::sin(phi));
        },
        [&](const Vec3d& w) {
          const double cosine = std::hypot(w.y(), w.z());
          const double z = (std::atan2(w.x(), cosine) - c.mean) / deviation;
          return std::exp(-0.5 * z * z) / (std::sqrt(2.0 * kPi) * deviation * mass) /
                 (2.0 * kPi * cosine);
        },
        kSamples, 6, window));
  }
}

}  // namespace
}  // namespace heddle

#include "fibers/scattering/bcsdf_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "fibers/math/quadrature.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/scattering/sg_scatter.h"
#include "tests/fibers/scattering/fibers_for_tests.h"
#include "tests/support/fibers.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

const double kViewsDeg[] = {0.0, -30.0, 60.0, 85.0, -89.5};

Vec3 view(double theta_deg, double phi = 0.4) {
  return vector_from({radians(theta_deg), phi}).cast<float>();
}

double narrowest(const FiberScattering& fiber) {
  return fiber.isotropic_white ? 1.0 : std::min(fiber.beta_r, fiber.beta_tt);
}

TEST(BcsdfTableAgreement, ValueAgainstTheDefinition) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  double worst = 0.0;
  for (const NamedFiber& named : fibers_for_tests()) {
    const BcsdfTable table(named.scattering);
    // Float angles are good to 2e-7, which at four deviations changes a Gaussian by 4 / beta * 2e-7
    // relatively; values far below the peak are compared with 1 % of it.
    const double tolerance =
        2e-5 + 1e-6 / std::min(narrowest(named.scattering), named.scattering.gamma_tt);
    for (int k = 0; k < 2000; ++k) {
      const Vec3 wo = sample_sphere(random);
      const Vec3 wi = k % 2 == 0 ? sample_sphere(random) : table.sample(wo, random).wi;
      const Vec3d wo_exact = wo.cast<double>().normalized();
      const FiberDirection out = fiber_direction(wo_exact);
      const Rgbd exact = evaluate_bcsdf(named.scattering, wi.cast<double>().normalized(), wo_exact);
      const Rgbd value = table.evaluate(wi, wo).cast<double>();
      const double peak =
          evaluate_bcsdf(named.scattering, vector_from({-out.theta, out.phi + kPi}), wo_exact)
              .maxCoeff();
      const double error = ((value - exact).abs() / (exact + 0.01 * peak + 1e-30)).maxCoeff();
      EXPECT_LT(error, tolerance) << named.name;
      worst = std::max(worst, error / tolerance);
    }
  }
  std::printf("  worst error: %.2f of the tolerance\n", worst);
}

TEST(BcsdfTableStatistical, SamplesFollowTheDensity) {
  struct Case {
    const char* name;
    FiberScattering fiber;
    double zoom_deg;  // half height of the window about the specular cone; 0: everything
  };
  const Rgbd color_r(.3, .2, .1);
  const Rgbd color_tt(.9, .5, .1);
  const Case cases[] = {
      {"beta .1 / .1, gamma 20", test::fiber_in_degrees(color_r, color_tt, .1, .1, 20), .5},
      {"silk", fibers_for_tests()[2].scattering, 5.0},
      {"cotton", fibers_for_tests()[3].scattering, 5.0},
      {"beta 10 / 10, gamma 10", test::fiber_in_degrees(color_r, color_tt, 10, 10, 10), 0.0},
      {"beta 27 / 27, gamma 38", test::fiber_in_degrees(color_r, color_tt, 27, 27, 38), 0.0},
      {"beta 60 / 60, gamma 60", test::fiber_in_degrees(color_r, color_tt, 60, 60, 60), 0.0},
      {"white", test::white_fiber(), 0.0},
  };
  constexpr int kTests = static_cast<int>(std::size(cases) * std::size(kViewsDeg));
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (const Case& c : cases) {
    const BcsdfTable table(c.fiber);
    for (const double theta_deg : kViewsDeg) {
      const Vec3 wo = view(theta_deg);
      AngleWindow window;
      if (c.zoom_deg > 0.0) {
        window.theta_min = radians(std::max(-90.0, -theta_deg - c.zoom_deg));
        window.theta_max = radians(std::min(90.0, -theta_deg + c.zoom_deg));
      }
      char name[64];
      std::snprintf(name, sizeof name, "%s, theta_o %g", c.name, theta_deg);
      EXPECT_TRUE(chi_square_accepts(
          name, [&] { return Vec3d(table.sample(wo, random).wi.cast<double>()); },
          [&](const Vec3d& wi) { return static_cast<double>(table.pdf(wi.cast<float>(), wo)); },
          100000, kTests, window));
    }
  }
}

TEST(BcsdfTableStatistical, ADensityWrongByTwoPercentIsRejected) {
  const BcsdfTable table(test::fiber_in_degrees({.3, .2, .1}, {.9, .5, .1}, 10, 10, 10));
  RandomStream random(3, RandomStage::kTest, 0, 0);
  const Vec3 wo = view(60.0, 0.0);
  const auto sample = [&] { return Vec3d(table.sample(wo, random).wi.cast<double>()); };
  EXPECT_FALSE(chi_square_accepts(
      "2 % off by halves", sample,
      [&](const Vec3d& wi) {
        return (wi.z() > 0.0 ? 0.98 : 1.02) * static_cast<double>(table.pdf(wi.cast<float>(), wo));
      },
      1000000, 10));
}

TEST(BcsdfTableLaw, DensityIntegratesToOne) {
  for (const NamedFiber& named : fibers_for_tests()) {
    const BcsdfTable table(named.scattering);
    for (const double theta_deg : kViewsDeg) {
      const Vec3 wo = view(theta_deg, 0.0);
      std::vector<double> theta_breaks;
      std::vector<double> phi_breaks;
      for (const double beta : {named.scattering.beta_r, named.scattering.beta_tt}) {
        append_geometric_breaks(-radians(theta_deg), beta, kPi, theta_breaks);
      }
      append_geometric_breaks(0.0, std::min(1.0, named.scattering.gamma_tt), kPi, phi_breaks);
      const QuadratureRule phi_rule = gauss_legendre_panels(12, -kPi, kPi, phi_breaks);
      const QuadratureRule theta_rule =
          gauss_legendre_panels(12, -0.5 * kPi, 0.5 * kPi, theta_breaks);
      const double total = integrate(theta_rule, [&](double theta) {
        return std::cos(theta) * integrate(phi_rule, [&](double from_peak) {
                 return static_cast<double>(
                     table.pdf(vector_from({theta, kPi + from_peak}).cast<float>(), wo));
               });
      });
      // At 0.1 degrees float angles (2e-7) shift theta by 1e-4 of the deviation.
      EXPECT_NEAR(total, 1.0, 3e-4) << named.name << " at " << theta_deg;
    }
  }
}

TEST(BcsdfTableStatistical, MeanWeightIsTheAdjointAlbedoAndTheWorstIsSmall) {
  constexpr int kSamples = 100000;
  const std::vector<NamedFiber> fibers = fibers_for_tests();
  const int tests = static_cast<int>(fibers.size() * std::size(kViewsDeg));
  RandomStream random(4, RandomStage::kTest, 0, 0);
  float worst = 0.0F;
  for (const NamedFiber& named : fibers) {
    const BcsdfTable table(named.scattering);
    for (const double theta_deg : kViewsDeg) {
      RunningMean mean;
      float worst_here = 0.0F;
      for (int k = 0; k < kSamples; ++k) {
        Rgb importance(random.uniform(), random.uniform(), random.uniform());
        if (k % 4 == 0) importance[k % 3] = 0.0F;
        const BcsdfTable::Sample sample = table.sample(view(theta_deg), random, importance);
        ASSERT_TRUE(sample.weight.allFinite() && sample.weight.minCoeff() >= 0.0F &&
                    sample.pdf > 0.0F)
            << named.name;
        mean.add(static_cast<double>(sample.weight[1]));
        worst_here = std::max(worst_here, (importance * sample.weight).sum() / importance.sum());
      }
      const double albedo =
          bcsdf_sh(named.scattering, radians(theta_deg), 0)[0][1] * std::sqrt(4.0 * kPi);
      char name[64];
      std::snprintf(name, sizeof name, "%s, theta_o %g", named.name.c_str(), theta_deg);
      // The tables and float angles are good to 1e-4.
      EXPECT_TRUE(means_agree(name, mean.mean(), mean.standard_error(), albedo,
                              1e-4 * albedo + 1e-9, tests));
      std::printf("    worst weight %.3f\n", static_cast<double>(worst_here));
      worst = std::max(worst, worst_here);
    }
  }
  std::printf("  worst weight of all: %.3f\n", static_cast<double>(worst));
  EXPECT_LT(worst, 3.0F);
}

TEST(BcsdfTable, WhiteIsotropicFiberIsSampledWithWeightOne) {
  const BcsdfTable table(test::white_fiber());
  RandomStream random(5, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 wo = sample_sphere(random);
    const BcsdfTable::Sample sample = table.sample(wo, random);
    EXPECT_EQ(sample.weight.minCoeff(), 1.0F);
    EXPECT_EQ(sample.weight.maxCoeff(), 1.0F);
    const float cosine = std::hypot(sample.wi.y(), sample.wi.z());
    EXPECT_NEAR(table.evaluate(sample.wi, wo)[0] * cosine / table.pdf(sample.wi, wo), 1.0F, 1e-5F);
  }
}

TEST(BcsdfTableAgreement, SampleReportsItsOwnDensityAndWeight) {
  RandomStream random(6, RandomStage::kTest, 0, 0);
  for (const NamedFiber& named : fibers_for_tests()) {
    const BcsdfTable table(named.scattering);
    const auto tolerance = static_cast<float>(
        1e-4 + 3e-6 / std::min(narrowest(named.scattering), named.scattering.gamma_tt));
    for (int k = 0; k < 1000; ++k) {
      const Vec3 wo = sample_sphere(random);
      const BcsdfTable::Sample sample = table.sample(wo, random);
      EXPECT_NEAR(sample.wi.norm(), 1.0F, 1e-6F);
      const float cosine = std::hypot(sample.wi.y(), sample.wi.z());
      if (cosine < 1e-3F) continue;  // the density's 1 / cosine is then good to 1e-4 or less
      EXPECT_NEAR(table.pdf(sample.wi, wo) / sample.pdf, 1.0F, tolerance) << named.name;
      const Rgb weight = table.evaluate(sample.wi, wo) * (cosine / table.pdf(sample.wi, wo));
      EXPECT_LT((weight - sample.weight).abs().maxCoeff(), tolerance) << named.name;
    }
  }
}

TEST(BcsdfTableAgreement, HarmonicsAgainstTheDefinition) {
  for (const NamedFiber& named : fibers_for_tests()) {
    const BcsdfTable table(named.scattering);
    for (int k = 0; k <= 60; ++k) {
      const double theta_o = kPi * (k / 60.0 - 0.5);
      std::vector<float> row(3 * sh_count(5));
      table.sh_coefficients(static_cast<float>(theta_o), 5, row.data());
      const std::vector<Rgbd> exact = bcsdf_sh(named.scattering, theta_o, 5);
      // Rows are h = 6.1e-3 rad apart. Harmonics up to band 5 are at most sqrt(11 / 4 pi) = .94
      // with second derivatives up to 30 times that: 28 h^2 / 8 = 1.3e-4. Where an end cuts the
      // lobe, values change on its own scale: (h / beta)^2 / 8 of the changing part, which is at
      // most a tenth.
      const double beta = narrowest(named.scattering);
      const double spacing = kPi / (BcsdfTable::kRows - 1);
      const bool is_cut = 0.5 * kPi - std::abs(theta_o) < 7.0 * beta + spacing;
      const double tolerance =
          1.3e-4 + (is_cut ? std::min(0.1, 0.1 / 8.0 * spacing * spacing / (beta * beta)) : 0.0);
      for (std::size_t j = 0; j < exact.size(); ++j) {
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(row[3 * j + c], exact[j][static_cast<Eigen::Index>(c)], tolerance)
              << named.name << " " << theta_o << " " << j;
        }
      }
    }
  }
}

TEST(BcsdfTableAgreement, LightFromSphericalGaussiansAgainstDouble) {
  RandomStream random(7, RandomStage::kTest, 0, 0);
  std::vector<NamedFiber> fibers = fibers_for_tests();
  fibers.push_back({"white", test::white_fiber()});
  double worst = 0.0;
  for (const NamedFiber& named : fibers) {
    const BcsdfTable table(named.scattering);
    // The float angle between light and cone is good to 2e-7, against beta about 10 / beta of it in
    // the exponent.
    const double tolerance = 3e-5 + 3e-6 / narrowest(named.scattering);
    for (const float sharpness : {0.0F, 1e-3F, 1.0F, 7.0F, 8.5F, 48.0F, 150.0F, 1e3F, 1e5F, 1e8F}) {
      for (int k = 0; k < 100; ++k) {
        const Vec3 wo = k == 0 ? Vec3(Vec3::UnitX()) : sample_sphere(random);
        const Vec3 axis = k % 2 == 0 ? sample_sphere(random) : table.sample(wo, random).wi;
        const Rgbd value = table.sg_scatter(axis, sharpness, wo).cast<double>();
        const SphericalGaussian light{axis.cast<double>().normalized(),
                                      static_cast<double>(sharpness)};
        const Rgbd exact =
            sg_scatter(named.scattering, light, wo.cast<double>().normalized(), SgMethod::kDefault);
        ASSERT_TRUE(value.allFinite() && value.minCoeff() >= 0.0) << named.name << " " << sharpness;
        const double scale = std::max(exact.maxCoeff(), 1e-9 * sg_mass(light.sharpness));
        const double error = (value - exact).abs().maxCoeff() / scale;
        EXPECT_LT(error, tolerance) << named.name << ", sharpness " << sharpness;
        worst = std::max(worst, error / tolerance);
      }
    }
  }
  std::printf("  worst error: %.2f of the tolerance\n", worst);
}

TEST(BcsdfTableAgreement, LobesOfGammaComeFromWhereQuadratureSays) {
  FiberScattering fiber;
  fiber.color_r = Rgbd(.3, .2, .1);
  fiber.color_tt = Rgbd(.9, .5, .1);
  fiber.beta_r = radians(5);
  fiber.beta_tt = radians(9);
  fiber.gamma_tt = radians(25);
  const BcsdfTable table(fiber);
  constexpr int kThetas = 1200;
  constexpr int kPhis = 720;
  for (const float sharpness : {20.0F, 120.0F}) {
    for (const double gap_deg : {0.0, 8.0, -12.0}) {
      const FiberDirection light = {radians(25), 0.3};
      const Vec3 axis = vector_from(light).cast<float>();
      const Vec3 wo = vector_from({radians(-25 + gap_deg), light.phi + 2.6}).cast<float>();
      const auto lobes = table.sg_scatter_by_lobe(axis, sharpness, wo);
      EXPECT_LT((lobes[0].value + lobes[1].value - table.sg_scatter(axis, sharpness, wo))
                    .abs()
                    .maxCoeff(),
                1e-6F);
      for (std::size_t n = 0; n < 2; ++n) {
        double total = 0;
        double theta = 0;
        double theta2 = 0;
        double around_cos = 0;
        double around_sin = 0;
        for (int i = 0; i < kThetas; ++i) {
          for (int k = 0; k < kPhis; ++k) {
            const FiberDirection at = {kPi * ((i + 0.5) / kThetas - 0.5), 2 * kPi * k / kPhis};
            const Vec3d wi = vector_from(at);
            const double value =
                sg_value({axis.cast<double>(), sharpness}, wi) * std::cos(at.theta) *
                std::cos(at.theta) *
                evaluate_bcsdf(fiber, wi, wo.cast<double>(), n == 0 ? Lobe::kR : Lobe::kTt)[0];
            total += value;
            theta += value * (at.theta - light.theta);
            theta2 += value * (at.theta - light.theta) * (at.theta - light.theta);
            around_cos += value * std::cos(at.phi - light.phi);
            around_sin += value * std::sin(at.phi - light.phi);
          }
        }
        const double scale = kPi / kThetas * 2 * kPi / kPhis;
        const double mean = theta / total;
        const auto& lobe = lobes[n];
        // Gamma itself errs by .3 % here; deviations are 5 to 9 degrees, so a hundredth of them is
        // 1e-3.
        EXPECT_NEAR(lobe.value[0] / (total * scale), 1, 0.01)
            << sharpness << ' ' << gap_deg << ' ' << n;
        EXPECT_NEAR(lobe.theta_shift, mean, 2e-3);
        EXPECT_NEAR(lobe.turn, std::atan2(around_sin, around_cos), 2e-2);
        EXPECT_NEAR(lobe.theta_precision * (theta2 / total - mean * mean), 1, 0.1);
        // Of a von Mises distribution, 1 - mean cosine about its centre is 1 / (2 k) + 1 / (8 k^2)
        // for large k.
        const double k_azimuth = lobe.azimuth_precision;
        EXPECT_NEAR((1 - std::hypot(around_cos, around_sin) / total) /
                        (0.5 / k_azimuth + 0.125 / (k_azimuth * k_azimuth)),
                    1, 0.1);
      }
    }
  }
}

TEST(BcsdfTableAgreement, LightBlurredInInclinationAgainstQuadrature) {
  RandomStream random(9, RandomStage::kTest, 0, 0);
  std::vector<NamedFiber> fibers = fibers_for_tests();
  fibers.push_back({"white", test::white_fiber()});
  double worst = 0;
  for (const NamedFiber& named : fibers) {
    // Lobes as broad as the range of inclinations are not what this is for; a black fiber's F is
    // Schlick's fifth power alone, 1e-5 of any other's.
    if (named.name.starts_with("wide") || named.name == "black") continue;
    const BcsdfTable table(named.scattering);
    for (const double deviation : {0.02, 0.06, 0.18}) {
      for (int k = 0; k < 12; ++k) {
        const auto theta_o = static_cast<float>((random.uniform() - 0.5) * 2.0);
        const Vec3 wo(std::sin(theta_o), std::cos(theta_o), 0);
        BcsdfTable::Lanes theta_i;
        BcsdfTable::Lanes cos_turn;
        BcsdfTable::RgbLanes light;
        Rgbd exact = Rgbd::Zero();
        for (int lane = 0; lane < 8; ++lane) {
          // Near the cone, where there is light to compare.
          theta_i[lane] = std::clamp(-theta_o + (random.uniform() - 0.5F) * 0.5F, -1.1F, 1.1F);
          const double turn = 2 * kPi * (lane + static_cast<double>(random.uniform())) / 8;
          cos_turn[lane] = static_cast<float>(std::cos(turn));
          for (int c = 0; c < 3; ++c) light(lane, c) = random.uniform();
          const double low = std::max(-kPi / 2, theta_i[lane] - 7 * deviation);
          const double high = std::min(kPi / 2, theta_i[lane] + 7 * deviation);
          const QuadratureRule rule =
              gauss_legendre_panels(16, low, high, {-static_cast<double>(theta_o)});
          constexpr int kPanels = 24;  // the narrowest lobe is 0.1 degrees wide
          for (int panel = 0; panel < kPanels; ++panel) {
            const QuadratureRule part = gauss_legendre_panels(
                16, low + (high - low) * panel / kPanels,
                low + (high - low) * (panel + 1) / kPanels, {-static_cast<double>(theta_o)});
            exact += integrate(part, [&](double theta) -> Rgbd {
              const Vec3d wi(std::sin(theta), std::cos(theta) * std::cos(turn),
                             std::cos(theta) * std::sin(turn));
              const double off = (theta - theta_i[lane]) / deviation;
              const double density = std::exp(-0.5 * off * off) / (std::sqrt(2 * kPi) * deviation);
              return light.row(lane).transpose().cast<double>() *
                     evaluate_bcsdf(named.scattering, wi, wo.cast<double>()) *
                     (density * std::cos(theta));
            });
          }
        }
        const Rgbd got = table
                             .blurred_scatter(theta_i, cos_turn, theta_o,
                                              static_cast<float>(deviation * deviation), light)
                             .cast<double>();
        ASSERT_TRUE(got.allFinite()) << named.name;
        const double error = (got - exact).abs().maxCoeff() / std::max(exact.maxCoeff(), 1e-12);
        // What is taken at the mean of the product of Gaussians, cos / Gn and F, bends over the
        // product's width s <= 0.17: cos / Gn goes like 1 / cos, whose second derivative is below 8
        // / cos up to 1.1 rad: 8 s^2 / 2 = 0.12 at worst.
        EXPECT_LT(error, exact.maxCoeff() > 1e-9 ? 0.12 : 1.0)
            << named.name << ' ' << deviation << ' ' << theta_o;
        if (exact.maxCoeff() > 1e-9) worst = std::max(worst, error);
      }
    }
  }
  std::printf("  worst error: %.3f\n", worst);
}

TEST(BcsdfTableStability, FiniteAtTheEndsOfTheSphere) {
  const Vec3 ends[] = {Vec3(1.0F, 0.0F, 0.0F), Vec3(-1.0F, 0.0F, 0.0F), Vec3(1.0F, 1e-20F, 0.0F),
                       Vec3(-1.0F, 0.0F, 1e-7F), Vec3(0.0F, 0.0F, 1.0F)};
  for (const NamedFiber& named : fibers_for_tests()) {
    const BcsdfTable table(named.scattering);
    RandomStream random(8, RandomStage::kTest, 0, 0);
    for (const Vec3& wo : ends) {
      for (const Vec3& wi : ends) {
        const Rgb value = table.evaluate(wi, wo);
        ASSERT_TRUE(value.allFinite() && value.minCoeff() >= 0.0F) << named.name;
        ASSERT_TRUE(std::isfinite(table.pdf(wi, wo)) && table.pdf(wi, wo) >= 0.0F) << named.name;
        ASSERT_TRUE(table.sg_scatter(wi, 100.0F, wo).allFinite()) << named.name;
      }
      for (int k = 0; k < 1000; ++k) {
        const BcsdfTable::Sample sample = table.sample(wo, random);
        ASSERT_TRUE(sample.weight.allFinite() && std::isfinite(sample.pdf) && sample.pdf > 0.0F)
            << named.name;
      }
    }
  }
}

}  // namespace
}  // namespace heddle

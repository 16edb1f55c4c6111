#include "render/surface/woven_yarns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "formats/input_error.h"
#include "render/surface/surface_presets.h"
#include "tests/support/directions.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

YarnMaterial material(double psi_deg, double umax_deg, double kappa, double smoothing = 0.0) {
  YarnMaterial yarn;
  yarn.uniform = 0.02;
  yarn.forward = 3.0;
  yarn.twist = radians(psi_deg);
  yarn.max_inclination = radians(umax_deg);
  yarn.curvature = kappa;
  yarn.smoothing = smoothing;
  return yarn;
}

const YarnSegment kSegments[] = {
    {material(0, 40, 0), 1, 3},   {material(0, 50, -0.9), 2, 4},  {material(0, 25, 2.0, 0.4), 1, 2},
    {material(-30, 24, 0), 1, 6}, {material(30, 36, -0.5), 2, 4}, {material(20, 45, 1.0), 1, 1},
};

TEST(WovenYarnsLaw, SpineSpansItsSegment) {
  for (const double kappa : {-0.99, -0.7, -0.3, 0.0, 0.5, 4.0}) {
    for (const double umax_deg : {5.0, 30.0, 45.0, 80.0}) {
      const YarnSegment segment = {material(0, umax_deg, kappa), 1, 3};
      const double u_max = radians(umax_deg);
      const QuadratureRule rule = gauss_legendre_panels(
          20, 0.0, u_max, {0.5 * u_max, 0.9 * u_max, 0.97 * u_max, 0.99 * u_max});
      const double span =
          integrate(rule, [&](double u) { return spine_radius(segment, u, u_max) * std::cos(u); });
      EXPECT_NEAR(span, 0.5 * (3.0 - std::sin(u_max)), 1e-6) << kappa << " " << umax_deg;
    }
  }
}

TEST(WovenYarns, SpineIsTheConicThatKappaNames) {
  const double u_max = radians(45);
  const double reach = 0.5 * (3.0 - std::sin(u_max));
  const YarnSegment circle = {material(0, 45, 0), 1, 3};
  EXPECT_NEAR(spine_radius(circle, 0.0, u_max), reach / std::sin(u_max), 1e-12);
  EXPECT_NEAR(spine_radius(circle, 0.7, u_max), reach / std::sin(u_max), 1e-12);
  // kappa = -1/2 at 45 degrees: the parabola z = -y^2 / (2 p), slope y / p, so p = reach and R = p
  // / cos^3.
  const YarnSegment parabola = {material(0, 45, -0.5), 1, 3};
  EXPECT_NEAR(spine_radius(parabola, 0.3, u_max), reach / std::pow(std::cos(0.3), 3), 1e-12);
  // kappa = 1/2: an ellipse of ratio 2, y = b sin t, z = b/2 cos t, tan t = 2 tan u.
  const YarnSegment ellipse = {material(0, 45, 0.5), 1, 3};
  const double b = reach / std::sin(std::atan(2.0));
  const double t = std::atan(2.0 * std::tan(0.3));
  EXPECT_NEAR(spine_radius(ellipse, 0.3, u_max),
              std::pow(std::pow(b * std::cos(t), 2) + std::pow(0.5 * b * std::sin(t), 2), 1.5) /
                  (0.5 * b * b),
              1e-12);
  // kappa = -3/4: a hyperbola, y = b sinh t, z = -2 b cosh t, tanh t = tan u / 2.
  const YarnSegment hyperbola = {material(0, 45, -0.75), 1, 3};
  const double bh = reach / std::sinh(std::atanh(0.5));
  const double th = std::atanh(0.5 * std::tan(0.3));
  EXPECT_NEAR(
      spine_radius(hyperbola, 0.3, u_max),
      std::pow(std::pow(bh * std::cosh(th), 2) + std::pow(2.0 * bh * std::sinh(th), 2), 1.5) /
          (2.0 * bh * bh),
      1e-12);
}

/// Integral over the tube of (fiber tangent . (wi + wo) within a narrow Gaussian) * area element *
/// phase * attenuation: the model before its delta function is resolved.
double tube_integral(const YarnSegment& segment, const Vec3d& wi, const Vec3d& wo, int steps) {
  const YarnMaterial& yarn = segment.material;
  const Vec3d sum = wi + wo;
  const double a = 0.5 * segment.width;
  const double phase = yarn.uniform + std::exp(-yarn.forward * (wi.dot(wo) + 1.0)) /
                                          (2.0 * kPi * scaled_bessel_i0(yarn.forward));
  constexpr double kDeviation = 0.01;
  double total = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double u = yarn.max_inclination * (2.0 * (i + 0.5) / steps - 1.0);
    const double radius = spine_radius(segment, u, yarn.max_inclination);
    const Vec3d spine(0, std::cos(u), -std::sin(u));
    for (int j = 0; j < steps; ++j) {
      const double v = kPi * ((j + 0.5) / steps - 0.5);
      const Vec3d n(std::sin(v), std::sin(u) * std::cos(v), std::cos(u) * std::cos(v));
      // Wound about the spine: turned by the twist from the spine's tangent against the way around.
      const Vec3d around(std::cos(v), -std::sin(u) * std::sin(v), -std::cos(u) * std::sin(v));
      const Vec3d tangent = std::cos(yarn.twist) * spine - std::sin(yarn.twist) * around;
      const double x = tangent.dot(sum) / kDeviation;
      if (std::abs(x) > 8.0) continue;
      const double cos_i = n.dot(wi);
      const double cos_o = n.dot(wo);
      if (cos_i <= 0.0 || cos_o <= 0.0) continue;
      total +=
          std::exp(-0.5 * x * x) * a * (radius + a * std::cos(v)) * cos_i * cos_o / (cos_i + cos_o);
    }
  }
  const double cell = 2.0 * yarn.max_inclination / steps * kPi / steps;
  return total * cell * phase / (4.0 * kPi * kDeviation * std::sqrt(2.0 * kPi));
}

TEST(WovenYarnsAgreement, MeanOfASegmentIsTheIntegralOverItsTube) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  int compared = 0;
  for (const YarnSegment& segment : kSegments) {
    if (segment.material.smoothing > 0.0) continue;
    const Vec2d half(0.5 * segment.width, 0.5 * segment.length);
    double largest = 0.0;
    double worst = 0.0;
    for (int n = 0; n < 12; ++n) {
      const Vec3d wi = test::direction_above(0.3, random);
      const Vec3d wo = test::direction_above(0.3, random);
      // Keep off the ends of the spine, where the Gaussian of the oracle is cut in half.
      const double u = std::atan2((wi + wo).y(), (wi + wo).z());
      if (segment.material.twist == 0.0 &&
          std::abs(std::abs(u) - segment.material.max_inclination) < 0.06)
        continue;
      const double value = yarn_highlight_integral(segment, {-half, half}, wi, wo) /
                           (segment.width * segment.length);
      const double expected = tube_integral(segment, wi, wo, 900);
      largest = std::max(largest, expected);
      worst = std::max(worst, std::abs(value - expected));
      compared += expected > 0.0 ? 1 : 0;
    }
    std::printf("  psi %g: worst %.2g of %.3g\n", degrees(segment.material.twist), worst, largest);
    // The oracle's Gaussian blurs where the curve leaves the tube: first order in its deviation,
    // 0.01.
    EXPECT_LT(worst, 0.01 * largest);
  }
  EXPECT_GT(compared, 25);
}

TEST(WovenYarnsLaw, IntegralIsThatOfThePoints) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (const YarnSegment& segment : kSegments) {
    const Vec2d half(0.5 * segment.width, 0.5 * segment.length);
    double largest = 0.0;
    double worst = 0.0;
    for (int n = 0; n < 20; ++n) {
      const Vec3d wi = test::direction_above(0.2, random);
      const Vec3d wo = test::direction_above(0.2, random);
      Rectangle part = {-half, half};
      if (n % 2 == 1) part = {-0.6 * half, Vec2d(0.9 * half.x(), 0.3 * half.y())};
      constexpr int kGrid = 300;
      double sum = 0.0;
      for (int i = 0; i < kGrid; ++i) {
        for (int j = 0; j < kGrid; ++j) {
          const Vec2d cell((i + 0.5) / kGrid, (j + 0.5) / kGrid);
          sum +=
              yarn_highlight(segment, part.min + (part.max - part.min).cwiseProduct(cell), wi, wo);
        }
      }
      const double mean = sum / (kGrid * kGrid);
      const double value = yarn_highlight_integral(segment, part, wi, wo) / part.area();
      largest = std::max(largest, mean);
      worst = std::max(worst, std::abs(value - mean));
    }
    std::printf("  psi %g, u_max %g: worst %.2g of %.3g\n", degrees(segment.material.twist),
                degrees(segment.material.max_inclination), worst, largest);
    // The band's edges are steps: one row of the grid in 300, of a band that fills half of the
    // segment.
    EXPECT_GT(largest, 0.0);
    EXPECT_LT(worst, 2.0 / 300.0 * largest);
  }
}

TEST(WovenYarnsLaw, SegmentsAreReciprocal) {
  RandomStream random(3, RandomStage::kTest, 0, 0);
  for (const YarnSegment& segment : kSegments) {
    const Vec2d half(0.5 * segment.width, 0.5 * segment.length);
    for (int n = 0; n < 2000; ++n) {
      const Vec3d wi = test::direction_above(1e-3, random);
      const Vec3d wo = test::direction_above(1e-3, random);
      const double forth = yarn_highlight_integral(segment, {-half, half}, wi, wo);
      EXPECT_NEAR(yarn_highlight_integral(segment, {-half, half}, wo, wi), forth, 1e-9 * forth);
    }
  }
}

TEST(WovenYarnsLaw, WeftIsWarpTurned) {
  // A plain weave of one yarn: turned by 90 degrees, its warp becomes its weft.
  WovenYarnsParameters parameters = read_woven_yarns(surface_preset("irawan-linen-plain"));
  for (YarnMaterial& yarn : parameters.yarns) yarn = kSegments[5].material;
  for (YarnMaterial& yarn : parameters.yarns) yarn.specular.setOnes();
  const WovenYarns model(std::move(parameters));
  RandomStream random(7, RandomStage::kTest, 0, 0);
  int lit = 0;
  int differ = 0;
  for (int n = 0; n < 2000; ++n) {
    const auto turned = [](const Vec3d& w) { return Vec3d(-w.y(), w.x(), w.z()); };
    const Vec3d wi = test::direction_above(0.1, random);
    const Vec3d wo = test::direction_above(0.1, random);
    const Vec2 at(random.uniform(), random.uniform());
    const float footprint = n % 3 == 0 ? 0.0F : n % 3 == 1 ? 0.2F : 100.0F;
    const double value = model.reflected({at, footprint}, wi, wo)[0];
    const double other =
        model.reflected({Vec2(-at.y(), at.x()), footprint}, turned(wi), turned(wo))[0];
    differ += std::abs(other - value) > 1e-5 * value ? 1 : 0;
    lit += value > 0.0 ? 1 : 0;
  }
  EXPECT_GT(lit, 500);
  // Rounding may move a step of the integrand over a node of its quadrature, or a point over the
  // band's edge.
  EXPECT_LT(differ, 5);
}

const char* const kPublicPresets[] = {"irawan-denim", "irawan-shantung",  "irawan-charmeuse",
                                      "irawan-twill", "irawan-gabardine", "irawan-polyester"};

TEST(WovenYarns, PublicPresetsHaveTheirPublishedAreas) {
  const double warp[] = {5, 8, 9, 6, 12, 1};
  const double weft[] = {1, 16, 1, 2, 6, 1};
  for (std::size_t i = 0; i < std::size(kPublicPresets); ++i) {
    const WovenYarnsParameters parameters = read_woven_yarns(surface_preset(kPublicPresets[i]));
    EXPECT_NEAR(parameters.pattern.coverage(YarnSystem::kWarp), warp[i] / (warp[i] + weft[i]),
                1e-12)
        << kPublicPresets[i];
  }
  const WovenYarnsParameters charmeuse = read_woven_yarns(surface_preset("irawan-charmeuse"));
  ASSERT_EQ(charmeuse.pattern.kinds().size(), 2U);
  EXPECT_EQ(charmeuse.pattern.kinds()[0].size, Vec2d(1, 9));
  const WovenYarnsParameters shantung = read_woven_yarns(surface_preset("irawan-shantung"));
  ASSERT_EQ(shantung.pattern.kinds().size(), 2U);
  EXPECT_EQ(shantung.pattern.kinds()[0].size, Vec2d(2, 4));
  EXPECT_EQ(shantung.pattern.kinds()[1].size, Vec2d(4, 4));
}

TEST(WovenYarnsLaw, FarIsTheMeanOfNearAndOfEveryFootprint) {
  const Vec3d wi = Vec3d(0.5, 0.35, 0.5).normalized();
  const Vec3d wo = Vec3d(-0.45, -0.4, 0.6).normalized();
  for (const char* name : {"irawan-denim", "irawan-charmeuse", "irawan-silk-crepe-de-chine"}) {
    const WovenYarns model(read_woven_yarns(surface_preset(name)));
    const Vec2d repeat = model.parameters().pattern.repeat() * model.parameters().unit_mm;
    const Rgbd far = model.reflected({Vec2(0, 0), 1000.0F}, wi, wo);
    for (const double footprint : {0.0, 0.2, 1.4}) {
      const int grid = footprint == 0.0 ? 500 : 60;
      Rgbd sum = Rgbd::Zero();
      for (int i = 0; i < grid; ++i) {
        for (int j = 0; j < grid; ++j) {
          const Vec2d at = repeat.cwiseProduct(Vec2d((i + 0.5) / grid, (j + 0.5) / grid));
          sum += model.reflected(
              {at.cast<float>(), static_cast<float>(footprint * repeat.maxCoeff())}, wi, wo);
        }
      }
      EXPECT_LT((sum / (far * grid * grid) - 1.0).abs().maxCoeff(), 0.01)
          << name << " " << footprint;
    }
  }
}

TEST(WovenYarnsStability, FiniteAndNotNegativeForRandomAndGrazingPairs) {
  RandomStream random(4, RandomStage::kTest, 0, 0);
  long bad = 0;
  for (const std::string& name : surface_preset_names("irawan-2012")) {
    const std::unique_ptr<const SurfaceModel> model = read_surface_model(surface_preset(name));
    for (int n = 0; n < 20000; ++n) {
      const auto direction = [&] {
        Vec3d w = test::direction_above(0, random);
        if (n % 4 == 1) w.z() = std::pow(10.0, -300.0 * random.uniform_double());
        return Vec3d(w.normalized());
      };
      const Vec3d wo = direction();
      const Vec3d wi = n % 8 == 5 ? Vec3d(-wo.x(), -wo.y(), wo.z()) : direction();
      const SurfacePoint point = {Vec2(random.uniform(), random.uniform()), n % 3 == 0   ? 0.0F
                                                                            : n % 3 == 1 ? 100.0F
                                                                                         : 0.1F};
      const Rgbd value = model->reflected(point, wi, wo);
      bad += value.isFinite().all() && value.minCoeff() >= 0.0 ? 0 : 1;
      const float density = model->pdf(point, wi.cast<float>(), wo.cast<float>());
      bad += std::isfinite(density) && density >= 0.0F ? 0 : 1;
    }
  }
  EXPECT_EQ(bad, 0);
}

TEST(WovenYarnsStatistical, SamplesFollowTheDensityAndWeighWhatTheyShould) {
  RandomStream random(5, RandomStage::kTest, 0, 0);
  constexpr int kTests = 2 * 3;
  const SurfacePoint points[] = {{Vec2(0.1F, 0.2F), 0.0F}, {Vec2(0.1F, 0.2F), 100.0F}};
  for (int i = 0; i < 2; ++i) {
    const char* const name = i == 0 ? "irawan-denim" : "irawan-charmeuse";
    const SurfacePoint& point = points[i];
    WovenYarnsParameters parameters = read_woven_yarns(surface_preset(name));
    for (YarnMaterial& yarn : parameters.yarns) yarn.diffuse.setZero();
    const WovenYarns model(std::move(parameters));
    for (const double theta_deg : {0.0, 45.0, 80.0}) {
      const double s = std::sin(radians(theta_deg));
      const Vec3 wo = Vec3d(0.6 * s, 0.8 * s, std::cos(radians(theta_deg))).cast<float>();
      RunningMean albedo;
      EXPECT_TRUE(chi_square_accepts(
          std::string(name) + " " + std::to_string(static_cast<int>(theta_deg)),
          [&]() -> Vec3d {
            const auto drawn = model.sample(point, wo, random);
            albedo.add(drawn ? drawn->weight[0] : 0.0);
            return drawn ? drawn->wi.cast<double>() : Vec3d(0, 0, -1);
          },
          [&](const Vec3d& wi) -> double { return model.pdf(point, wi.cast<float>(), wo); }, 300000,
          kTests, {.phi_min = 0.0, .phi_max = kPi}));
      const double exact =
          4.0 * kPi * model.reflected_sg(point, Vec3d::UnitZ(), 0.0, wo.cast<double>())[0];
      EXPECT_TRUE(means_agree("albedo", albedo.mean(), albedo.standard_error(), exact, 0.01 * exact,
                              kTests));
    }
  }
}

TEST(WovenYarnsStatistical, SpecularAlbedoIsWhatThePresetSays) {
  WovenYarnsParameters parameters = read_woven_yarns(surface_preset("irawan-charmeuse"));
  ASSERT_TRUE(parameters.specular_is_albedo);
  for (YarnMaterial& yarn : parameters.yarns) {
    yarn.diffuse.setZero();
    yarn.specular = Rgbd(0.3, 0.2, 0.1);
  }
  const WovenYarns model(std::move(parameters));
  RandomStream random(6, RandomStage::kTest, 0, 0);
  RunningMean albedo;
  for (int n = 0; n < 100000; ++n) {
    const auto direction = [&] {
      const double z = std::sqrt(random.uniform_double());
      const double phi = 2.0 * kPi * random.uniform_double();
      const double r = std::sqrt(1.0 - z * z);
      return Vec3d(r * std::cos(phi), r * std::sin(phi), z);
    };
    const Vec3d wi = direction();
    albedo.add(kPi * model.reflected({Vec2(0, 0), 1000.0F}, wi, direction())[1] / wi.z());
  }
  // The lattice that sets the scale errs by less than 1 %.
  EXPECT_TRUE(means_agree("specular albedo", albedo.mean(), albedo.standard_error(), 0.2, 0.002));
}

TEST(WovenYarns, FilamentsFadeOutBySmoothStep) {
  const YarnSegment segment = {material(0, 40, 0.5, 0.4), 1, 3};
  // Light and view along one direction at inclination u: all factors but the fading are the same
  // past (1 - 0.4) u_max.
  const auto value_at = [&](double share_of_fade) {
    const double u = radians(40) * (0.6 + 0.4 * share_of_fade);
    const Vec3d w(0, std::sin(u), std::cos(u));
    return yarn_highlight(segment, {0, 0.5 * u * segment.length / radians(40) - 0.3}, w, w);
  };
  const double whole = value_at(1e-9);
  EXPECT_GT(whole, 0.0);
  EXPECT_NEAR(value_at(0.25) / whole, 1.0 - 0.15625, 1e-9);
  EXPECT_NEAR(value_at(0.5) / whole, 0.5, 1e-9);
  EXPECT_NEAR(value_at(0.999), 0.0, 1e-4 * whole);
  EXPECT_EQ(value_at(1.001), 0.0);
}

TEST(WovenYarns, SegmentsTooShortForTheirInclinationHaveNoHighlight) {
  const Vec3d w = Vec3d(0.1, 0.1, 1).normalized();
  // the weft of the public twill: 2 sin 36 degrees > 1
  YarnSegment segment = {material(0, 36, 0), 2, 1};
  EXPECT_EQ(yarn_highlight_integral(segment, {{-1, -0.5}, {1, 0.5}}, w, w), 0.0);
  EXPECT_EQ(yarn_highlight(segment, {0, 0}, w, w), 0.0);
  segment.length = 1.2;
  EXPECT_GT(yarn_highlight_integral(segment, {{-1, -0.5}, {1, 0.5}}, w, w), 0.0);
  EXPECT_GT(yarn_highlight(segment, {0, 0}, w, w), 0.0);
}

TEST(WovenYarns, ConfigErrorsHaveTheirPlace) {
  const std::string text =
      "model = \"irawan-2012\"\nunit_mm = 1\n[weave]\nnotation = \"plain\"\nend_widths = [1]\n"
      "pick_widths = [1]\n";
  const std::string yarn =
      "diffuse = [0, 0, 0]\nspecular = [1, 1, 1]\nalpha = 0\nbeta = 10\npsi_deg = 0\numax_deg = "
      "90\nkappa = -0.99\n";
  try {
    read_surface_model(
        TomlTable::parse(text + "[warp]\n" + yarn + "[weft]\n" + yarn, "velvet.toml"));
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("velvet.toml:13:"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace heddle

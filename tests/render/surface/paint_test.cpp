#include "render/surface/paint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "fibers/math/sampling.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

PaintConfig glossy(const Rgbd& color, double roughness, const Rgbd& reflectance) {
  PaintConfig config;
  config.color = color;
  config.roughness = roughness;
  config.reflectance = reflectance;
  return config;
}

PaintConfig matte(const Rgbd& color) {
  PaintConfig config;
  config.color = color;
  return config;
}

const std::vector<PaintConfig> kPaints = {
    matte({0.8, 0.3, 0.1}), glossy({0.6, 0.1, 0.1}, 0.3, Rgbd::Constant(0.04)),
    glossy({0.2, 0.5, 0.9}, 0.05, Rgbd::Constant(0.04)), glossy(Rgbd::Zero(), 0.4, {0.9, 0.7, 0.3}),
    glossy({1, 1, 1}, 1, {0.5, 0.5, 0.5})};

const Vec3 kPaintViews[] = {{.3F, -.1F, 1}, {-.2F, .9F, .2F}, {.99F, -.05F, .06F}};

/// Mean and standard error of what is reflected of even light, by the paint's own draws.
RunningMean albedo(const Paint& paint, const Vec3& wo, int channel, int draws) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  RunningMean mean;
  for (int k = 0; k < draws; ++k) {
    const auto sample = paint.sample({}, wo, random);
    mean.add(sample ? static_cast<double>(sample->weight[channel]) : 0);
  }
  return mean;
}

// Furnace: white under any gloss reflects all light, and a gloss alone never more than that.
TEST(PaintLaw, FurnaceReturnsAllLightOfWhiteAndNeverMore) {
  for (const double roughness : {0.05, 0.2, 0.5, 1.0}) {
    for (const double reflectance : {0.0, 0.04, 0.5, 1.0}) {
      const Paint white(glossy(Rgbd::Ones(), roughness, Rgbd::Constant(reflectance)));
      const Paint bare(glossy(Rgbd::Zero(), roughness, Rgbd::Constant(reflectance)));
      for (const Vec3& view : kPaintViews) {
        const Vec3 wo = view.normalized();
        const RunningMean all = albedo(white, wo, 0, 20'000);
        EXPECT_NEAR(all.mean(), 1, 1e-3 + 5 * all.standard_error())
            << roughness << " " << reflectance << " " << wo.transpose();
        const RunningMean gloss = albedo(bare, wo, 0, 20'000);
        EXPECT_LT(gloss.mean(), 1 + 1e-3 + 5 * gloss.standard_error());
        EXPECT_NEAR(gloss.mean(), bare.gloss_albedo(static_cast<double>(wo.z()))[0],
                    2e-3 + 5 * gloss.standard_error())
            << "the table";
      }
    }
  }
}

TEST(PaintLaw, Reciprocity) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (const PaintConfig& config : kPaints) {
    const Paint paint(config);
    for (int k = 0; k < 200; ++k) {
      const Vec3d a = sample_hemisphere({0, 0, 1}, random).cast<double>().normalized();
      const Vec3d b = sample_hemisphere({0, 0, 1}, random).cast<double>().normalized();
      const Rgbd there = paint.reflected({}, a, b) / a.z();
      const Rgbd back = paint.reflected({}, b, a) / b.z();
      ASSERT_LT((there - back).abs().maxCoeff(), 1e-11 * (1 + there.maxCoeff()));
    }
  }
}

TEST(PaintLaw, MatteIsLambertAndNothingShinesFromBelow) {
  const Paint paint(matte({0.8, 0.3, 0.1}));
  const Vec3d wi = Vec3d(0.3, 0.4, 0.5).normalized();
  const Vec3d wo = Vec3d(-0.9, 0.1, 0.2).normalized();
  EXPECT_LT((paint.reflected({}, wi, wo) - Rgbd(0.8, 0.3, 0.1) * wi.z() / kPi).abs().maxCoeff(),
            1e-15);
  for (const PaintConfig& config : kPaints) {
    const Paint any(config);
    EXPECT_EQ(any.reflected({}, -wi, wo).maxCoeff(), 0);
    EXPECT_EQ(any.reflected({}, wi, -wo).maxCoeff(), 0);
    EXPECT_EQ(any.pdf({}, -wi.cast<float>(), wo.cast<float>()), 0);
  }
}

// A nearly smooth gloss is a mirror with Schlick's reflectance.
TEST(PaintLaw, AThinGlossReflectsAsSchlickSays) {
  const Paint metal(glossy(Rgbd::Zero(), 0.05, {0.9, 0.6, 0.2}));
  for (const double cosine : {1.0, 0.7, 0.3}) {
    const Rgbd expected = Rgbd(0.9, 0.6, 0.2) + (1 - Rgbd(0.9, 0.6, 0.2)) * std::pow(1 - cosine, 5);
    EXPECT_LT((metal.gloss_albedo(cosine) - expected).abs().maxCoeff(), 5e-3) << cosine;
  }
}

TEST(PaintStatistical, SamplesFollowTheDensity) {
  const int tests = static_cast<int>(kPaints.size() * std::size(kPaintViews));
  for (const PaintConfig& config : kPaints) {
    const Paint paint(config);
    for (const Vec3& view : kPaintViews) {
      const Vec3 wo = view.normalized();
      RandomStream random(3, RandomStage::kTest, static_cast<std::uint64_t>(&view - kPaintViews),
                          0);
      AngleWindow window;  // the upper hemisphere; nothing drawn counts as below
      window.phi_min = 0;
      window.phi_max = kPi;
      const auto draw = [&] {
        const auto sample = paint.sample({}, wo, random);
        return sample ? Vec3d(sample->wi.cast<double>()) : Vec3d(0, 0, -1);
      };
      const auto density = [&](const Vec3d& wi) {
        return static_cast<double>(paint.pdf({}, wi.cast<float>(), wo));
      };
      // Narrow lobes, and those at grazing angles, are narrower than the test's coarse cells.
      if (config.roughness && *config.roughness < (wo.z() < 0.1F ? 0.35 : 0.2)) continue;
      EXPECT_TRUE(chi_square_accepts("roughness " + std::to_string(config.roughness.value_or(0)),
                                     draw, density, 60'000, tests, window))
          << wo.transpose();
    }
  }
}

TEST(PaintStatistical, GaussianLightsAreTheMeanOfTheirDirections) {
  const Paint paint(kPaints[1]);
  const Vec3 axis = Vec3(-0.2F, 0.3F, 1).normalized();
  const Vec3 wo = Vec3(0.3F, -0.4F, 0.8F).normalized();
  RandomStream random(4, RandomStage::kTest, 0, 0);
  RunningMean mean;
  for (int k = 0; k < 100'000; ++k) {
    const Vec3 wi = sample_spherical_gaussian(axis, 20, random);
    mean.add(paint.reflected({}, wi.cast<double>(), wo.cast<double>())[1]);
  }
  const double value = paint.reflected_sg({}, axis.cast<double>(), 20, wo.cast<double>())[1];
  EXPECT_TRUE(means_agree("paint", mean.mean(), mean.standard_error(), value, 1e-3 * value, 1));
}

}  // namespace
}  // namespace heddle

#include "render/surface/woven_cotton.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "formats/input_error.h"
#include "render/surface/surface_presets.h"
#include "tests/support/directions.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

std::string config(const std::string& more = "", double diffuse = 0.05) {
  const std::string colors =
      "diffuse = [" + std::to_string(diffuse) + ", 0.02, 0]\nspecular = [0.5, 0.7, 0.9]\n";
  return "model = \"woven-cotton\"\nunit_mm = 0.25\n[weave]\nnotation = \"twill 3/1\"\nend_widths "
         "= [1]\n"
         "pick_widths = [2]\n[warp]\n" +
         colors + "semimajor = 3\neccentricity = 0.995\nangle_deg = 95\nk = [1.5, 3.1]\n[weft]\n" +
         colors + "semimajor = 1\neccentricity = 0.9\nangle_deg = 80\nk = [3.7, 1.6]\n" + more;
}

const char* const kIrregular = "[irregularity]\nangle_deg = 8\nshift = 0.1\nsize = 0.2\n";

WovenCotton model_of(const std::string& text) {
  const TomlTable document = TomlTable::parse(text, "test.toml");
  return WovenCotton(read_woven_cotton(document));
}

const SurfacePoint kFar = {Vec2(0.3F, 0.1F), 1000.0F};

/// Mean of the values at a grid of points over `size` mm, each seen with the footprint.
Rgbd mean_over(const WovenCotton& model, const Vec2d& low, const Vec2d& size, int grid,
               float footprint, const Vec3d& wi, const Vec3d& wo) {
  Rgbd sum = Rgbd::Zero();
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      const Vec2d at = low + size.cwiseProduct(Vec2d((i + 0.5) / grid, (j + 0.5) / grid));
      sum += model.reflected({at.cast<float>(), footprint}, wi, wo);
    }
  }
  return sum / (1.0 * grid * grid);
}

TEST(WovenCottonLaw, BrdfIsTheMeanOfTheBtf) {
  const WovenCotton model = model_of(config());
  const Vec2d repeat = 0.25 * Vec2d(4, 8);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int n = 0; n < 4; ++n) {
    const Vec3d wi = test::direction_above(0.5, random);
    const Vec3d wo = test::direction_above(0.5, random);
    const Rgbd far = model.reflected(kFar, wi, wo);
    const Rgbd near = mean_over(model, {0, 0}, repeat, 1000, 0.0F, wi, wo);
    // The highlight is a step: 1e-3 of its height, which is k_s F G / (n . wo).
    const double height = highlight_reflectance(wi, wo, 1.5) * 0.9;
    EXPECT_LT((far - near).abs().maxCoeff(), 1e-3 * height);
    EXPECT_GT(far.minCoeff(), 0.0);
  }
}

TEST(WovenCottonLaw, MeanOverARepeatIsTheBrdfAtEveryFootprint) {
  const WovenCotton model = model_of(config());
  const Vec2d repeat = 0.25 * Vec2d(4, 8);
  const Vec3d wi = Vec3d(0.2, 0.1, 1).normalized();
  const Vec3d wo = Vec3d(-0.1, -0.3, 1).normalized();
  const Rgbd far = model.reflected(kFar, wi, wo);
  const Rgbd near = model.reflected({Vec2(0.05F, 0.3F), 0}, wi, wo);
  for (const float footprint : {0.1F, 0.4F, 1.3F, 2.3F, 3.7F}) {
    // Values are averages over the footprint, so piecewise smooth in the position: the midpoint
    // rule errs by (cell / footprint)^2.
    const Rgbd mean = mean_over(model, {0.01, 0.02}, repeat, 200, footprint, wi, wo);
    EXPECT_LT((mean / far - 1.0).abs().maxCoeff(), 1e-3) << footprint;
  }
  EXPECT_GT((near / far - 1.0).abs().maxCoeff(), 0.1);
  // From two repeats on it is the BRDF.
  EXPECT_EQ((model.reflected({Vec2(0.05F, 0.3F), 4.001F}, wi, wo) - far).abs().maxCoeff(), 0.0);
}

TEST(WovenCottonAgreement, FootprintIsTheMeanOverItsSquare) {
  for (const bool irregular : {false, true}) {
    const WovenCotton model = model_of(config(irregular ? kIrregular : ""));
    RandomStream random(2, RandomStage::kTest, 0, 0);
    for (const double footprint : {0.003, 0.2, 0.7, 1.9}) {
      const Vec3d wi = test::direction_above(0.7, random);
      const Vec3d wo = test::direction_above(0.7, random);
      const Vec2d at(10.0 * random.uniform_double(), 10.0 * random.uniform_double());
      const Rgbd value = model.reflected({at.cast<float>(), static_cast<float>(footprint)}, wi, wo);
      const Rgbd mean = mean_over(model, at - Vec2d::Constant(0.5 * footprint),
                                  Vec2d::Constant(footprint), 700, 0.0F, wi, wo);
      const double height = highlight_reflectance(wi, wo, 1.5) * 0.9;
      EXPECT_LT((value - mean).abs().maxCoeff(), 2e-3 * height) << footprint;
    }
  }
}

TEST(WovenCottonLaw, FootprintsEndInThePointAndTheWhole) {
  const WovenCotton model = model_of(config());
  const Vec3d wi = Vec3d(0.2, 0.1, 1).normalized();
  const Vec3d wo = Vec3d(-0.1, -0.3, 1).normalized();
  RandomStream random(3, RandomStage::kTest, 0, 0);
  int on_edge = 0;
  for (int n = 0; n < 1000; ++n) {
    const Vec2 at(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()));
    // Just above the smallest square: differs only where the ellipse's edge crosses it.
    const Rgbd point = model.reflected({at, 0}, wi, wo);
    const Rgbd square = model.reflected({at, 2e-4F}, wi, wo);
    on_edge += (point - square).abs().maxCoeff() > 1e-9 ? 1 : 0;
  }
  EXPECT_LT(on_edge, 5);
}

TEST(WovenCottonStatistical, IrregularClothShowsTheMeanOfItsVariants) {
  for (const char* per : {"segment", "yarn"}) {
    const WovenCotton model = model_of(config(std::string(kIrregular) + "per = \"" + per + "\"\n"));
    const Vec3d wi = Vec3d(0.35, 0.4, 1).normalized();
    const Vec3d wo = Vec3d(-0.1, 0.2, 1).normalized();
    const double far = model.reflected(kFar, wi, wo)[0];
    // Means over squares of half a repeat's side, far enough apart that they share no segment and
    // no yarn.
    RunningMean mean;
    for (int n = 0; n < 4000; ++n) {
      const auto along = static_cast<float>(n);
      mean.add(model.reflected({Vec2(along * 2.01F, along * 2.03F), 0.9F}, wi, wo)[0]);
    }
    EXPECT_TRUE(means_agree(per, mean.mean(), mean.standard_error(), far, 0.0, 2));
    // not the regular cloth's
    EXPECT_GT(std::abs(far / model_of(config()).reflected(kFar, wi, wo)[0] - 1.0), 1e-3);
  }
}

TEST(WovenCottonLaw, IrregularityHasMeanZero) {
  // Small deviations change the BRDF in second order only: far less than the same change of all
  // segments does.
  for (const bool of_angle : {true, false}) {
    WovenCottonParameters parameters =
        read_woven_cotton(TomlTable::parse(config("", 0.0), "test.toml"));
    const WovenCotton regular(parameters);
    WovenIrregularity irregularity;
    (of_angle ? irregularity.angle : irregularity.size) = 0.002;
    parameters.irregularity = irregularity;
    const WovenCotton irregular(parameters);
    parameters.irregularity.reset();
    for (CottonYarn& yarn : parameters.yarns) {
      yarn.angle += of_angle ? 0.002 : 0.0;
      yarn.semimajor *= of_angle ? 1.0 : 1.002;
    }
    const WovenCotton changed(parameters);
    RandomStream random(8, RandomStage::kTest, 0, 0);
    double by_irregularity = 0.0;
    double by_change = 0.0;
    for (int n = 0; n < 200; ++n) {
      const Vec3d wi = test::direction_above(0.6, random);
      const Vec3d wo = test::direction_above(0.6, random);
      const double value = regular.reflected(kFar, wi, wo)[0];
      by_irregularity += std::abs(irregular.reflected(kFar, wi, wo)[0] - value);
      by_change += std::abs(changed.reflected(kFar, wi, wo)[0] - value);
    }
    EXPECT_GT(by_irregularity, 0.0);
    std::printf("  %s: %.2g of %.2g\n", of_angle ? "angle" : "size", by_irregularity, by_change);
    EXPECT_LT(by_irregularity, 0.02 * by_change);
  }
}

TEST(WovenCotton, IrregularityIsReproducible) {
  const WovenCotton a = model_of(config(kIrregular));
  const WovenCotton b = model_of(config(kIrregular));
  const WovenCotton other = model_of(config(std::string(kIrregular) + "seed = 2\n"));
  RandomStream random(4, RandomStage::kTest, 0, 0);
  int differ = 0;
  for (int n = 0; n < 2000; ++n) {
    const SurfacePoint point = {Vec2(50.0F * random.uniform(), -50.0F * random.uniform()), 0.1F};
    const Vec3d wi = test::direction_above(0.8, random);
    const Vec3d wo = test::direction_above(0.8, random);
    EXPECT_EQ((a.reflected(point, wi, wo) - b.reflected(point, wi, wo)).abs().maxCoeff(), 0.0);
    differ += (a.reflected(point, wi, wo) - other.reflected(point, wi, wo)).abs().maxCoeff() > 0.0
                  ? 1
                  : 0;
  }
  EXPECT_GT(differ, 200);
  // Along a yarn with per = "yarn" every segment looks the same; here the first end, which starts
  // with a warp float.
  const WovenCotton yarns = model_of(config(std::string(kIrregular) + "per = \"yarn\"\n"));
  const Vec3d wi = test::direction_above(0.8, random);
  const Vec3d wo = test::direction_above(0.8, random);
  const Rgbd value = yarns.reflected({Vec2(0.125F, 0.25F), 0.2F}, wi, wo);
  for (int n = 1; n < 20; ++n) {
    const Rgbd further =
        yarns.reflected({Vec2(0.125F, 0.25F + 2.0F * static_cast<float>(n)), 0.2F}, wi, wo);
    EXPECT_LT((further - value).abs().maxCoeff(), 1e-5);  // positions are floats
  }
}

TEST(WovenCottonLaw, BtfAndBrdfAreReciprocal) {
  const WovenCotton model = model_of(config());
  RandomStream random(5, RandomStage::kTest, 0, 0);
  for (int n = 0; n < 5000; ++n) {
    const SurfacePoint point = {Vec2(random.uniform(), random.uniform()),
                                n % 2 == 0 ? 100.0F : 0.5F};
    const Vec3d wi = test::direction_above(1e-3, random);
    const Vec3d wo = test::direction_above(1e-3, random);
    const Rgbd forth = model.reflected(point, wi, wo) / wi.z();
    const Rgbd back = model.reflected(point, wo, wi) / wo.z();
    EXPECT_LT(((forth - back).abs() / (forth + 1e-12)).maxCoeff(), 1e-9);
  }
}

TEST(WovenCottonStability, FiniteAndNotNegativeForRandomAndGrazingPairs) {
  RandomStream random(6, RandomStage::kTest, 0, 0);
  long bad = 0;
  for (const std::string& name : surface_preset_names("woven-cotton")) {
    const std::unique_ptr<const SurfaceModel> model = read_surface_model(surface_preset(name));
    for (int n = 0; n < 150000; ++n) {
      // Heights down to 1e-300 above the horizon, mirror pairs and opposite pairs among them.
      const auto direction = [&] {
        Vec3d w = test::direction_above(0, random);
        if (n % 4 == 1) w.z() = std::pow(10.0, -300.0 * random.uniform_double());
        return Vec3d(w.normalized());
      };
      const Vec3d wo = direction();
      const Vec3d wi = n % 8 == 5 ? Vec3d(-wo.x(), -wo.y(), wo.z()) : direction();
      const float footprint = n % 3 == 0 ? 0.0F : 2.0F * random.uniform();
      const SurfacePoint point = {Vec2(random.uniform(), random.uniform()),
                                  n % 3 == 1 ? 100.0F : footprint};
      const Rgbd value = model->reflected(point, wi, wo);
      bad += value.isFinite().all() && value.minCoeff() >= 0.0 ? 0 : 1;
      const float density = model->pdf(point, wi.cast<float>(), wo.cast<float>());
      bad += std::isfinite(density) && density >= 0.0F ? 0 : 1;
    }
  }
  EXPECT_EQ(bad, 0);
  const WovenCotton model = model_of(config());
  const Vec3d up = Vec3d::UnitZ();
  EXPECT_EQ(model.reflected(kFar, Vec3d(0, 0.6, -0.8), up).maxCoeff(), 0.0);
  EXPECT_EQ(model.reflected(kFar, up, Vec3d(1, 0, 0)).maxCoeff(), 0.0);
  EXPECT_EQ(model.reflected_sg(kFar, up, 10.0, Vec3d(1, 0, 0)).maxCoeff(), 0.0);
}

TEST(WovenCottonAgreement, LightOfAnyWidthAgainstBruteForce) {
  const WovenCotton model = model_of(config());
  const Vec3d wo = Vec3d(0.3, -0.2, 0.9).normalized();
  for (const float footprint : {0.0F, 0.4F, 100.0F}) {
    for (const double sharpness : {0.0, 5.0, 100.0}) {
      const Vec3d axis = Vec3d(-0.2, 0.3, 0.8).normalized();
      const SurfacePoint point = {Vec2(0.15F, 0.4F), footprint};
      constexpr int kRows = 400;
      Rgbd sum = Rgbd::Zero();
      for (int i = 0; i < kRows; ++i) {
        const double theta = 0.5 * kPi * (i + 0.5) / kRows;
        for (int j = 0; j < 4 * kRows; ++j) {
          const double phi = 0.5 * kPi * (j + 0.5) / kRows;
          const Vec3d wi(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                         std::cos(theta));
          sum +=
              model.reflected(point, wi, wo) * (sg_value({axis, sharpness}, wi) * std::sin(theta));
        }
      }
      sum *= std::pow(0.5 * kPi / kRows, 2) / sg_mass(sharpness);
      const Rgbd value = model.reflected_sg(point, axis, sharpness, wo);
      std::printf("  footprint %g, sharpness %g: %.6f, brute force %.6f\n", footprint, sharpness,
                  value[0], sum[0]);
      // The quadrature stops at an estimate of 1e-3; the brute force's own error on the step is
      // below 1e-3.
      EXPECT_LT((value / sum - 1.0).abs().maxCoeff(), 2e-3);
    }
  }
}

TEST(WovenCottonStatistical, SamplesFollowTheDensityAndWeighWhatTheyShould) {
  const char* const weaves[] = {"", kIrregular};
  constexpr int kTests = 2 * 3;
  RandomStream random(7, RandomStage::kTest, 0, 0);
  for (const char* more : weaves) {
    const WovenCotton model = model_of(config(more));
    for (const double theta_deg : {0.0, 45.0, 80.0}) {
      const Vec3 wo = Vec3d(std::sin(radians(theta_deg)) * 0.6, std::sin(radians(theta_deg)) * 0.8,
                            std::cos(radians(theta_deg)))
                          .cast<float>();
      const SurfacePoint point = {Vec2(0.1F, 0.2F), 0.3F};
      RunningMean albedo;
      EXPECT_TRUE(chi_square_accepts(
          "theta_o " + std::to_string(static_cast<int>(theta_deg)),
          [&]() -> Vec3d {
            const auto drawn = model.sample(point, wo, random);
            // Draws that give nothing fall below the surface: one cell of the lower half.
            albedo.add(drawn ? drawn->weight[0] : 0.0);
            if (!drawn) return {0, 0, -1};
            EXPECT_NEAR(drawn->pdf / model.pdf(point, drawn->wi, wo), 1.0, 1e-3);
            return drawn->wi.cast<double>();
          },
          [&](const Vec3d& wi) -> double {
            // What is missing to 1 is drawn as nothing; the test's cell about -z gets it by the
            // rest it pools.
            return model.pdf(point, wi.cast<float>(), wo);
          },
          400000, kTests,
          {.theta_min = -0.5 * kPi, .theta_max = 0.5 * kPi, .phi_min = 0.0, .phi_max = kPi}));
      const double exact =
          kPi * 2.0 * model.reflected_sg(point, Vec3d::UnitZ(), 0.0, wo.cast<double>())[0] * 2.0;
      // The quadrature's own error: 1e-3, taken as a standard error.
      EXPECT_TRUE(means_agree("albedo", albedo.mean(), albedo.standard_error(), exact, 1e-3 * exact,
                              kTests));
    }
  }
}

TEST(WovenCotton, ConfigErrorsHaveTheirPlace) {
  const auto message = [](std::string text, const std::string& from,
                          const std::string& to) -> std::string {
    text.replace(text.find(from), from.size(), to);
    try {
      const TomlTable document = TomlTable::parse(text, "test.toml");
      read_surface_model(document);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message(config(), "unit_mm", "unit_mm"), "");
  EXPECT_NE(message(config(), "semimajor = 3", "semimajor = 0").find("test.toml:10:"),
            std::string::npos);
  EXPECT_NE(message(config(), "eccentricity = 0.995", "eccentricity = 1").find("test.toml:11:"),
            std::string::npos);
  EXPECT_NE(message(config(), "unit_mm", "units_mm").find("unit_mm"), std::string::npos);
  EXPECT_NE(message(config("[irregularity]\nsize = 0.6\n"), "0.6", "0.6").find("size"),
            std::string::npos);
}

}  // namespace
}  // namespace heddle

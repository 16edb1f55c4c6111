// Plans: choice among hand-made candidates, priors from hand-made tables, evidence of pilots.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/plan/choice.h"
#include "pipeline/plan/evidence.h"
#include "pipeline/plan/findings.h"
#include "pipeline/plan/prior.h"
#include "pipeline/plan/ways.h"
#include "render/pixel_sums.h"

namespace heddle {
namespace {

Candidate candidate(const std::string& name, double bias, double noise, double build,
                    double per_spp, int step = 1) {
  return {.name = name,
          .bias_square = {bias * bias, 0},
          .noise_square = {noise * noise, 0},
          .build_seconds = build,
          .setup_seconds = 0.1,
          .seconds_per_spp = per_spp,
          .spp_step = step};
}

const std::vector<Candidate> kCandidates = {candidate("path", 0, 4, 0, 0.05, 2),
                                            candidate("fast", 0.1, 1, 3, 0.01),
                                            candidate("coarse", 0.3, 1, 0.5, 0.01)};

TEST(Plan, SamplesMakeUpForWhatTheBiasLeaves) {
  const std::optional<Offer> made = offer(kCandidates[1], 0.2, 5);
  ASSERT_TRUE(made);
  // The error as promised is within the tolerance, and with two thirds of the samples it would not
  // be.
  EXPECT_LE(std::hypot(0.1, 1 / std::sqrt(made->spp)), 0.2);
  EXPECT_GT(std::hypot(0.1, 1 / std::sqrt(made->spp / 1.5)), 0.2);
  EXPECT_DOUBLE_EQ(made->expected_error, std::hypot(0.1, 1 / std::sqrt(made->spp)));
  EXPECT_DOUBLE_EQ(made->seconds_per_picture, 0.1 + 0.01 * made->spp);
  EXPECT_DOUBLE_EQ(made->seconds, 3 + 5 * made->seconds_per_picture);
}

TEST(Plan, PathsComeInPairs) {
  for (const double tolerance : {0.01, 0.03, 0.2, 1.0, 30.0}) {
    const std::optional<Offer> made = offer(kCandidates[0], tolerance, 1);
    ASSERT_TRUE(made);
    EXPECT_EQ(made->spp % 2, 0);
    EXPECT_GE(made->spp, 2);
  }
}

TEST(Plan, WhatIsNotKnownCostsSamples) {
  Candidate sure = kCandidates[1];
  Candidate unsure = sure;
  unsure.bias_square.error = unsure.bias_square.value;
  EXPECT_GT(offer(unsure, 0.2, 1)->spp, offer(sure, 0.2, 1)->spp);
  unsure = sure;
  unsure.noise_square.error = unsure.noise_square.value;
  EXPECT_GT(offer(unsure, 0.2, 1)->spp, offer(sure, 0.2, 1)->spp);
}

TEST(Plan, MoreCautionWhereItCostsLittle) {
  // A standard error has room enough beside a bias far below the tolerance, and would leave none
  // beside one near it.
  const auto samples_more = [](double bias_square) {
    Candidate unsure = kCandidates[1];
    unsure.bias_square = {bias_square, 0};
    const int sure = offer(unsure, 0.2, 1)->spp;
    unsure.bias_square.error = 0.5 * bias_square;
    return static_cast<double>(offer(unsure, 0.2, 1)->spp) / sure;
  };
  EXPECT_GT(samples_more(0.1 * 0.04), 1 + 0.9 * 0.5 * 0.1 / (0.89 - 0.1))
      << "a whole standard error, or nearly";
  EXPECT_GT(samples_more(0.6 * 0.04), 1.1);
  Candidate near = kCandidates[1];
  near.bias_square = {0.7 * 0.04, 0.3 * 0.04};
  EXPECT_TRUE(offer(near, 0.2, 1)) << "not turned away for what it may be at worst";
  near.bias_square.value = 0.9 * 0.04;
  EXPECT_FALSE(offer(near, 0.2, 1));
}

TEST(Plan, AtBestIsBelowWhatIsExpected) {
  EXPECT_LT(at_best({1, 0.5}).value, 1);
  EXPECT_EQ(at_best({1, 0}).value, 1);
  EXPECT_EQ(at_best({0.1, 5}).value, 0) << "no square is negative";
  EXPECT_EQ(at_best({1, 0.5}).error, 0) << "no caution on top";
}

TEST(Plan, PicturesGoOnUntilTheirOwnNoiseIsSmallEnough) {
  for (const Candidate& of : kCandidates) {
    const double tolerance = 0.4;
    int spp = first_samples(of, tolerance);
    EXPECT_LE(spp, offer(of, tolerance, 1)->spp);
    EXPECT_EQ(spp % of.spp_step, 0);
    EXPECT_GE(spp, 2);
    // Four times the variance that the candidate was expected to have, and not quite sure of it.
    const Estimate noise = {4 * of.noise_square.value, 0.2 * of.noise_square.value};
    for (int more = 1; more > 0; spp += more) {
      more = more_samples(of, noise, spp, tolerance);
      EXPECT_LE(more, spp + of.spp_step);
      EXPECT_EQ(more % of.spp_step, 0);
    }
    EXPECT_LE(std::sqrt(of.bias_square.value + noise.value / spp), tolerance) << of.name;
    EXPECT_GT(std::sqrt(of.bias_square.value + noise.value / (0.6 * spp)), tolerance) << of.name;
    EXPECT_EQ(more_samples(of, {0.1 * of.noise_square.value, 0}, spp, tolerance), 0);
    EXPECT_GT(more_samples(of, {noise.value, 10 * noise.value}, spp, tolerance), 0)
        << "noise hardly known";
  }
  EXPECT_EQ(more_samples(kCandidates[2], {100, 0}, 8, 0.2), 0)
      << "no number of samples helps against the bias";
  EXPECT_EQ(more_samples(kCandidates[0], {1e9, 0}, kMostSamples, 0.2), 0);
}

TEST(Plan, CheapestThatIsGoodEnough) {
  const auto name_at = [](double tolerance, int pictures) {
    return kCandidates[cheapest(kCandidates, tolerance, pictures).value()].name;
  };
  EXPECT_EQ(name_at(2, 1), "path");  // a few samples: nothing is worth building
  EXPECT_EQ(name_at(0.4, 1), "coarse");
  EXPECT_EQ(name_at(0.15, 1), "fast");
  EXPECT_EQ(name_at(0.4, 100), "fast");  // what it costs to build is shared
  EXPECT_EQ(name_at(0.09, 1), "path");   // no other is near enough
}

TEST(Plan, TighterTolerancesNeverGetCheaper) {
  for (const int pictures : {1, 10, 1000}) {
    double before = 0;
    for (double tolerance = 3; tolerance > 0.005; tolerance *= 0.93) {
      const std::optional<std::size_t> best = cheapest(kCandidates, tolerance, pictures);
      ASSERT_TRUE(best);
      const Offer made = *offer(kCandidates[*best], tolerance, pictures);
      EXPECT_GE(made.seconds, before) << tolerance;
      EXPECT_LE(made.expected_error, tolerance);
      before = made.seconds;
      for (const Candidate& other : kCandidates) {
        const std::optional<Offer> offered = offer(other, tolerance, pictures);
        EXPECT_TRUE(!offered || offered->seconds >= made.seconds) << other.name;
      }
    }
  }
}

TEST(Plan, SaysWhatIsOutOfReach) {
  const std::vector<Candidate> fast = {kCandidates[1], kCandidates[2]};
  EXPECT_FALSE(cheapest(fast, 0.1, 1));
  const double best = best_tolerance(fast);
  EXPECT_GT(best, 0.1);
  EXPECT_TRUE(cheapest(fast, 1.001 * best, 1));
  EXPECT_FALSE(cheapest(fast, 0.999 * best, 1));
  EXPECT_FALSE(cheapest(kCandidates, 1e-6, 1)) << "more samples than are ever taken";
}

TEST(Plan, EstimatesCountByWhatIsKnownOfThem) {
  const Estimate both = combined({1, 0.1}, {3, 0.2});
  EXPECT_NEAR(both.value, (1 * 4 + 3 * 1) / 5.0, 1e-12);
  EXPECT_NEAR(both.error, std::sqrt(0.01 * 0.8), 1e-12);
  EXPECT_EQ(combined({1, 0}, {3, 0.2}).value, 1);
}

TEST(Plan, PilotsRaiseAndLowerWhatTablesSay) {
  const Estimate table = {0.1, 0.05};
  // Of all pixels and without noise, a pilot knows.
  EXPECT_NEAR(weighed(table, {0.04, 1e-6}, 0).value, 0.04, 1e-6);
  EXPECT_NEAR(weighed(table, {0.3, 1e-6}, 0).value, 0.3, 1e-6);
  // All noise, it says nothing.
  EXPECT_NEAR(weighed(table, {-3, 50}, 0).value, 0.1, 1e-4);
  EXPECT_NEAR(weighed(table, {3, 50}, 0).value, 0.1, 1e-4);
  // A negative square is noise: it lowers the prior, but does not make it 0.
  EXPECT_GT(weighed(table, {-0.2, 0.02}, 0).value, 0.07);
  EXPECT_LT(weighed(table, {-0.2, 0.02}, 0).value, 0.1);
  // Of few pixels, it counts for about as much as the table, whichever of the two is the lower.
  const Estimate lowered = weighed(table, {0.05, 0.001}, 1);
  const Estimate raised = weighed({0.05, 0.025}, {0.1, 0.001}, 1);
  EXPECT_GT(lowered.value, 0.055);
  EXPECT_LT(lowered.value, 0.08);
  EXPECT_GT(raised.value, 0.07);
  EXPECT_LT(raised.value, 0.095);
  // The more it saw, the more it counts.
  EXPECT_LT(weighed(table, {0.05, 0.001}, 0.2).value, lowered.value);
}

/// A table in which every setting errs by the same everywhere; colours are even.
AccuracyTable even_table() {
  AccuracyTable table;
  table.fabric = "even";
  table.sharpness = {10, kDirectionalSharpness};
  table.footprint_mm = {0.1, 1};
  table.light_cosine = {0.5, 0.9};
  table.bent_footprint_mm = 3;
  table.bent_light_cosine = 0.7;
  table.bent_between = {0.1, 0.1};
  table.bent_enclosure_square = 0.02;
  const auto add = [&](const std::string& name, double bias_square, double change_square,
                       double noise_square, double seconds, const Rgbd& ratio = Rgbd::Ones()) {
    const Accuracy entry{bias_square, 0, noise_square, change_square, ratio};
    table.settings.push_back(
        {name, seconds, 0.25, std::vector<Accuracy>(8, entry), std::vector<Accuracy>(2, entry)});
  };
  add("path", 0, 0, 4, 1e-4);
  add("exact", 0.04, 0, 1, 1e-6, Rgbd::Constant(0.9));
  add("volume", 0.05, 0.01, 1, 2e-6);
  add(order_setting(1), 0.03, 0.02, 1, 1e-6, Rgbd::Constant(0.9));
  add(cells_setting(2), 0.09, 0.02, 1, 1e-6, Rgbd::Constant(0.8));
  return table;
}

SeenCloth seen_under(std::vector<LightShare> lights) {
  SeenCloth seen;
  seen.share = 1;
  seen.light_share = 1;
  seen.footprint_mm = 0.3;
  seen.enclosure_square = 0.01;
  seen.lights = std::move(lights);
  return seen;
}

TEST(PlanPrior, OverLightsSquaresAddUpHalfAsIfIndependent) {
  OverLights one;
  one.add(1, 0.3);
  EXPECT_NEAR(one.square(), 0.3, 1e-12);
  OverLights two;
  two.add(0.5, 0.3);
  two.add(0.5, 0.3);
  EXPECT_NEAR(two.square(), 0.5 * 0.3 + 0.5 * 0.15, 1e-12);
}

TEST(PlanPrior, OneLightErrsAsTheTableSays) {
  const AccuracyTable table = even_table();
  const SeenCloth seen = seen_under({{100, 1, 0.7}});
  const ClothPrior prior = prior_of_cloth(table, {"exact", {}}, seen, false);
  EXPECT_NEAR(prior.bias_square.value, 0.04, 1e-12);
  EXPECT_NEAR(prior.noise_ratio, 0.25, 1e-12);
  EXPECT_NEAR(prior.time_ratio, 0.01, 1e-12);
  EXPECT_EQ(prior.setup_seconds, 0.25);
}

TEST(PlanPrior, LightsShareTheirErrorsHalfway) {
  const AccuracyTable table = even_table();
  const SeenCloth seen = seen_under({{100, 0.5, 0.7}, {200, 0.5, 0.7}});
  const double square = prior_of_cloth(table, {"exact", {}}, seen, false).bias_square.value;
  EXPECT_NEAR(square, 0.75 * 0.04, 1e-12);
}

TEST(PlanPrior, ASettingThatLooksBetterCountsAsWorse) {
  const AccuracyTable table = even_table();
  const SeenCloth seen = seen_under({{100, 1, 0.7}});
  const auto square_with = [&](const std::string& setting) {
    return prior_of_cloth(table, {"exact", {{setting, "exact"}}}, seen, false).bias_square.value;
  };
  EXPECT_NEAR(square_with(order_setting(1)), 0.04 + 0.5 * 0.02, 1e-12);
  EXPECT_NEAR(square_with(cells_setting(2)), 0.09, 1e-12);
}

TEST(PlanPrior, FoldsMakeItWorseNeverBetter) {
  AccuracyTable table = even_table();
  const SeenCloth seen = seen_under({{100, 1, 0.7}});
  const auto square = [&] {
    return prior_of_cloth(table, {"exact", {}}, seen, true).bias_square.value;
  };
  EXPECT_NEAR(square(), 0.04, 1e-12);
  for (Accuracy& entry : table.settings[1].bent) entry.bias_square = 0.1;
  EXPECT_NEAR(square(), 0.1, 1e-12);
  for (Accuracy& entry : table.settings[1].bent) entry.bias_square = 0.02;
  EXPECT_NEAR(square(), 0.04, 1e-12);
}

TEST(PlanPrior, LightFromBehindIsMissing) {
  SeenCloth seen = seen_under({{100, 1, 0.7}});
  ClothPrior prior;
  seen.pixel_lights.resize(4);
  for (PixelLight& light : seen.pixel_lights) light.face.seen = 1;
  add_light_from_behind(seen, 0.5, prior);
  EXPECT_EQ(prior.bias_square.value, 0) << "no light on the back";
  for (PixelLight& light : seen.pixel_lights) light.back.across = 2;
  add_light_from_behind(seen, 0.5, prior);
  // Half of what falls on the back comes through: as much as the face shows.
  EXPECT_NEAR(prior.bias_square.value, 0.25, 1e-12);
}

/// A scene of one flat cloth of one fabric under a light of sharpness 15, between both forms of
/// visibility.
struct SmallPlan {
  SceneConfig scene;
  ViewFacts view;
  FabricTables tables;
  SmallPlan() {
    scene.cloths.resize(1);
    scene.cloths[0].fabric = "one.toml";
    view.lights.resize(1);
    view.lights[0].type = LightType::kSphericalGaussian;
    view.lights[0].sharpness = 15;
    view.cloths = {seen_under({{15, 1, 0.7}})};
    tables.fabrics.push_back({"one.toml", "one", 2, false, even_table()});
  }
};

TEST(PlanPrior, LightBetweenClothsGoesWithEnclosure) {
  SmallPlan plan;
  const Estimate one = prior_between(plan.scene, plan.view, plan.tables);
  EXPECT_GT(one.value, 0);
  plan.view.cloths[0].enclosure_square *= 3;
  EXPECT_NEAR(prior_between(plan.scene, plan.view, plan.tables).value, 3 * one.value, 1e-12);
  // On half of the picture, with all of its light: twice the square of the mean.
  plan.view.cloths[0].share = 0.5;
  EXPECT_NEAR(prior_between(plan.scene, plan.view, plan.tables).value, 6 * one.value, 1e-12);
}

TEST(PlanWays, EveryChoiceOnce) {
  SmallPlan plan;
  const std::vector<WaySettings> ways = other_ways(plan.scene, plan.view, plan.tables);
  std::set<std::string> names;
  for (const WaySettings& way : ways) names.insert(name_of(way, plan.scene));
  EXPECT_EQ(names.size(), ways.size());
  // Both forms of visibility and their blend; cells x 1, 2, 4; the order 1 below the fabric's 2;
  // voxels x 1, 0.5 of the volume.
  EXPECT_EQ(ways.size(), 3U * (3 * 2 + 2 * 3 * 2));
  EXPECT_TRUE(names.contains("volume, Gaussians, cells x 4, order 1, voxels x 0.5"));
}

TEST(PlanWays, FabricsShareTheirSettings) {
  SmallPlan plan;
  const std::size_t of_one = other_ways(plan.scene, plan.view, plan.tables).size();
  plan.tables.fabrics.push_back({"two.toml", "two", 5, false, even_table()});
  plan.scene.cloths.push_back(plan.scene.cloths[0]);
  plan.scene.cloths.back().fabric = "two.toml";
  plan.view.cloths.push_back(plan.view.cloths[0]);
  const std::vector<WaySettings> ways = other_ways(plan.scene, plan.view, plan.tables);
  EXPECT_EQ(ways.size(), of_one) << "the order 3 is not below that of both";
  for (const WaySettings& way : ways)
    EXPECT_EQ(way.variant.of("one.toml"), way.variant.of("two.toml"));
}

TEST(PlanWays, TheFarthestClothsAreTheFirstToBecomeSurfaces) {
  SmallPlan plan;
  plan.scene.cloths.resize(3, plan.scene.cloths[0]);
  plan.view.cloths.resize(3, plan.view.cloths[0]);
  for (const std::size_t k : {0U, 1U, 2U}) {
    plan.scene.cloths[k].far_surface.emplace();
    plan.view.cloths[k].footprint_mm = k == 1 ? 2 : 1 - 0.1 * static_cast<double>(k);
  }
  plan.view.cloths[2].share = 0;
  std::set<std::set<std::size_t>> sets;
  for (const WaySettings& way : other_ways(plan.scene, plan.view, plan.tables))
    sets.insert(way.variant.stand_ins);
  EXPECT_EQ(sets, (std::set<std::set<std::size_t>>{{}, {1}, {0, 1}})) << "the third is not seen";
}

TEST(PlanWays, FormsOfVisibilityAreThoseThatTheLightsTellApart) {
  SmallPlan plan;
  const auto forms_at = [&](float sharpness) {
    plan.view.lights[0].sharpness = sharpness;
    std::set<std::string> forms;
    for (const WaySettings& way : other_ways(plan.scene, plan.view, plan.tables)) {
      if (way.variant.blend == kSignedDistanceOnly) forms.insert(kDistanceSetting);
      if (way.variant.blend == kLobesOnly) forms.insert(kGaussiansSetting);
    }
    return forms;
  };
  EXPECT_EQ(forms_at(15), (std::set<std::string>{kDistanceSetting, kGaussiansSetting}));
  EXPECT_EQ(forms_at(100), std::set<std::string>{kGaussiansSetting});
  EXPECT_EQ(forms_at(3), std::set<std::string>{kDistanceSetting});
  plan.view.lights[0].type = LightType::kDirectional;
  EXPECT_TRUE(forms_at(100).empty());
}

/// A pilot of a picture of one value in blocks of 8 x 8 pixels, with noise of standard deviation
/// `noise` per sample and +-`bias` from pixel to pixel.
Pilot pilot_of(double value, double bias, double noise, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  Pilot pilot;
  pilot.spp = 8;
  for (int block = 0; block < 16; ++block) {
    FrameBuffers frame(8, 8);
    frame.spp = pilot.spp;
    frame.half0.resize(64);
    frame.half1.resize(64);
    frame.variance.resize(64);
    for (std::size_t k = 0; k < 64; ++k) {
      PixelSums sums;
      for (int s = 0; s < pilot.spp; ++s) {
        const auto sample =
            static_cast<float>(value + (k % 2 == 0 ? bias : -bias) + noise * normal(engine));
        sums.add({Rgb(sample, sample, sample), Rgb::Zero(), Rgb::Zero(), 1}, s);
      }
      sums.store(pilot.spp, k, frame);
    }
    pilot.frames.push_back(std::move(frame));
    pilot.pixels += 64;
  }
  pilot.share_of_picture = 0.5;
  pilot.seconds_per_spp = 0.1;
  return pilot;
}

TEST(PlanFindings, APilotTellsAWaysErrorAndTheNoiseAndSpeedOfItsKind) {
  const WaySettings exact{RenderMethod::kExact, {}};
  const WaySettings volume{RenderMethod::kVolume, {}};
  WaySettings surfaces{RenderMethod::kPath, {}};
  surfaces.variant.stand_ins = {0};
  Findings findings(pilot_of(2, 0, 0.2, 1));
  WayPrior prior;
  prior.bias_square = {0.01, 0.005};
  for (const WaySettings& way : {exact, volume, surfaces}) findings.add_way(way, prior, "", 1);
  const std::vector<Way>& ways = findings.ways();
  EXPECT_NEAR(ways[0].candidate.noise_square.value, 0.01, 0.001) << "relative";
  EXPECT_FALSE(findings.compared_with_these_paths(1));

  Pilot fast = pilot_of(2, 0.8, 0.02, 2);
  fast.seconds_per_spp = 0.001;
  findings.add_trial(1, fast);
  // The pilot says 0.16, the prior 0.01, and both may be wrong by a share of it.
  EXPECT_GT(ways[1].candidate.bias_square.value, 0.05);
  EXPECT_LT(ways[1].candidate.bias_square.value, 0.17);
  EXPECT_EQ(ways[2].candidate.bias_square.value, 0.01);
  for (const std::size_t of_kind : {1U, 2U}) {
    EXPECT_NEAR(ways[of_kind].candidate.noise_square.value, 0.0001, 0.00003);
    EXPECT_EQ(ways[of_kind].candidate.seconds_per_spp, 0.001);
    EXPECT_TRUE(ways[of_kind].tried);
  }
  EXPECT_FALSE(ways[3].tried);
  EXPECT_TRUE(findings.compared_with_these_paths(1));
}

TEST(PlanFindings, APilotLowersAPriorWithCaution) {
  Findings findings(pilot_of(2, 0, 0.2, 1));
  WayPrior prior;
  prior.bias_square = {0.1, 0.05};
  findings.add_way({RenderMethod::kExact, {}}, prior, "", 1);
  findings.add_trial(1, pilot_of(2, 0.2, 0.02, 2));
  EXPECT_LT(findings.ways()[1].candidate.bias_square.value, 0.09);
  EXPECT_GT(findings.ways()[1].candidate.bias_square.value, 0.01) << "what was measured";
}

TEST(PlanFindings, LightBetweenClothsCountsWhereAWayLacksIt) {
  Findings findings(pilot_of(2, 0, 0.02, 1));
  WayPrior prior;
  prior.bias_square = {0.01, 0.005};
  findings.set_light_between({0.04, 0.02});
  findings.add_way({RenderMethod::kExact, {}}, prior, "", 1);
  EXPECT_NEAR(findings.ways()[1].candidate.bias_square.value, 0.01 + 0.04, 1e-12);
  EXPECT_GT(findings.ways()[1].candidate.bias_square.error, 0.02);
  EXPECT_EQ(findings.ways()[0].candidate.bias_square.value, 0);
}

}  // namespace
}  // namespace heddle

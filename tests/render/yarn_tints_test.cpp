#include "render/yarn_tints.h"

#include <gtest/gtest.h>

#include <set>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "render/cloth_scene.h"
#include "render/path_tracer.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

using Tile = ClothTiling::Tile;

TEST(YarnTint, HasMeanOneAndTheAskedDeviation) {
  for (const double correlation : {0.0, 3.0}) {
    const YarnTintConfig config{.rms = 0.1, .correlation_yarns = correlation, .seed = 3};
    double sum = 0;
    double squares = 0;
    double neighbours = 0;
    constexpr int kYarns = 100000;
    for (std::int64_t n = -kYarns / 2; n < kYarns / 2; ++n) {
      const double value = yarn_dye(config, YarnSystem::kWarp, n) - 1;
      sum += value;
      squares += value * value;
      neighbours += value * (yarn_dye(config, YarnSystem::kWarp, n + 3) - 1);
      EXPECT_LE(std::abs(value), 0.3 + 1e-12);
    }
    // Some 10 yarns of the window are one independent draw: 0.001 is three deviations.
    EXPECT_NEAR(sum / kYarns, 0, 0.0031);
    EXPECT_NEAR(std::sqrt(squares / kYarns), 0.1, 0.003);
    // exp(-1/2) at the stated distance, or nothing.
    EXPECT_NEAR(neighbours / squares, correlation > 0 ? 0.6065 : 0, 0.03);
  }
  EXPECT_NE(yarn_dye({.rms = 0.1}, YarnSystem::kWarp, 5),
            yarn_dye({.rms = 0.1}, YarnSystem::kWeft, 5));
}

/// Yarns of a plain weave, `repeats` repeats in the tile: which yarn of the cloth lies at each
/// place that rays from above see.
std::map<std::pair<int, int>, std::set<std::int64_t>> numbers_by_place(const ClothTiling& tiling,
                                                                       double spacing) {
  const YarnTints tints(tiling, {.rms = 0.1});
  std::map<std::pair<int, int>, std::set<std::int64_t>> numbers;  // (system, place across)
  for (std::uint64_t k = 0; k < 4000; ++k) {
    RandomStream random(1, RandomStage::kTest, k, 0);
    const Vec3d from(9 * random.uniform_double() - 4.5, 9 * random.uniform_double() - 4.5, 1);
    const BlockPlace place = tiling.place_of(from);
    const auto hit = tiling.first_hit(place, {place.offset.cast<float>(), Vec3(0, 0, -1)},
                                      [&](std::uint32_t e, const Ray& ray) {
                                        return tiling.tiles()[e]->intersect(ray, kNoFiber);
                                      });
    if (!hit) continue;
    const YarnTints::Yarn yarn = tints.yarn_at(tiling, hit->exemplar, hit->hit.segment, from);
    const bool is_warp = yarn.system == YarnSystem::kWarp;
    // Yarns are narrower than their spacing, so each lies in a lane of its own.
    const double across = (is_warp ? from.x() : from.y()) / spacing;
    numbers[{is_warp ? 0 : 1, static_cast<int>(std::floor(across))}].insert(yarn.number);
  }
  return numbers;
}

TEST(YarnTints, EveryYarnOfTheClothHasItsNumber) {
  FabricConfig config = test::small_fabric();
  config.repeats_x = config.repeats_y = 3;
  const auto tile = std::make_shared<const TileScene>(synthesize(config));
  const double spacing = config.warp.spacing_mm;
  BlockLayout layout;
  layout.width_mm = layout.height_mm = 2 * spacing;
  layout.tile_blocks = {{3, 3}};
  BlockLayout scattered = layout;
  scattered.order = BlockOrder::kScattered;
  for (const ClothTiling& tiling : {ClothTiling(tile), ClothTiling(std::vector<Tile>{tile}, layout),
                                    ClothTiling(std::vector<Tile>{tile}, scattered)}) {
    std::set<std::int64_t> seen[2];
    const auto numbers = numbers_by_place(tiling, spacing);
    for (const auto& [lane, found] : numbers) {
      // One number in a lane, one higher in the next.
      ASSERT_EQ(found.size(), 1U) << lane.first << " " << lane.second;
      EXPECT_EQ(*found.begin(),
                lane.second - numbers.begin()->first.second +
                    *numbers.at({lane.first, numbers.begin()->first.second}).begin());
      seen[lane.first].insert(*found.begin());
    }
    EXPECT_EQ(seen[0].size(), 30U);  // 9 mm of 0.3 mm
    EXPECT_EQ(seen[1].size(), 30U);
  }
}

TEST(YarnTints, AFactorMultipliesSingleScatteringAndNoneChangesNothing) {
  const auto tile = std::make_shared<const TileScene>(synthesize(test::small_fabric()));
  Light sun;
  sun.type = LightType::kDirectional;
  sun.axis = Vec3(0.2F, 0.3F, 1).normalized();
  sun.irradiance = Rgb(1, 1, 1);
  const std::vector<Light> lights = {sun};
  const auto picture = [&](const std::optional<YarnTintConfig>& tint, Rgb* tint_seen) {
    const ClothScene scene({{tile, flat_cloth(8, 8), false, tint}}, {});
    const std::vector<BcsdfTable> materials = scene_materials(scene);
    const PathTracer tracer(scene, materials, lights, Rgb(0, 0, 0), {});
    std::vector<PathTracer::Sample> samples;
    for (std::uint64_t k = 0; k < 200; ++k) {
      RandomStream random(5, RandomStage::kTest, k, 0);
      const Vec3d from(6 * random.uniform_double() - 3, 6 * random.uniform_double() - 3, 5);
      samples.push_back(tracer.trace({from, Vec3(0, 0, -1)}, random));
      const auto hit = scene.first_fiber({from, Vec3(0, 0, -1)});
      tint_seen[k] = hit ? scene.tint(*hit) : Rgb::Ones();
    }
    return samples;
  };
  Rgb none[200];
  Rgb some[200];
  Rgb zero[200];
  const auto plain = picture({}, none);
  const auto tinted = picture(YarnTintConfig{.rms = 0.2}, some);
  const auto even = picture(YarnTintConfig{.rms = 0}, zero);
  int differing = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_TRUE((none[k] == 1).all());
    EXPECT_TRUE((plain[k].single == even[k].single).all());
    EXPECT_TRUE((plain[k].multiple == even[k].multiple).all());
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(tinted[k].single[c], static_cast<double>(plain[k].single[c] * some[k][c]),
                  1e-5 * (1e-3 + static_cast<double>(plain[k].single[c])));
    }
    differing += std::abs(some[k][2] - 1) > 0.02 ? 1 : 0;
  }
  EXPECT_GT(differing, 100);
}

// Twice the dye absorbs as two fibers in a row: a^d. White fibers have nothing to absorb with.
TEST(YarnTints, DyeAbsorbsAsItAddsUp) {
  const FiberScattering dyed = test_cotton();
  const Rgb a = (dyed.color_r + (1 - dyed.color_r) * dyed.color_tt).cast<float>();
  for (const bool is_white : {true, false}) {
    const auto tile =
        std::make_shared<const TileScene>(single_fiber(is_white ? test::white_fiber() : dyed));
    const ClothTiling tiling(tile);
    const YarnTintConfig config{.rms = 0.3};
    const YarnTints tints(tiling, config);
    for (int k = -50; k < 50; ++k) {
      const Vec3d place(k + 0.5, 0.2, 0);
      const Rgb tint = tints.tint_at(tiling, 0, 0, place);
      const auto number = tints.yarn_at(tiling, 0, 0, place).number;
      const double dye = yarn_dye(config, YarnSystem::kWarp, number);
      for (int c = 0; c < 3; ++c) {
        const double expected = is_white ? 1 : std::pow(static_cast<double>(a[c]), dye - 1);
        EXPECT_NEAR(tint[c], expected, 1e-5) << k;
        if (!is_white) {
          EXPECT_LE(tint[c] * a[c], 1);
        }
      }
    }
  }
}

TEST(YarnTints, ScatteringsOnTheOwnYarnAreCounted) {
  // One yarn alone: all scatterings are on it, two or more.
  const auto lone = std::make_shared<const TileScene>(crossed_layers(test_cotton()));
  const std::vector<BcsdfTable> materials = {BcsdfTable(test_cotton())};
  const Rgb all = own_yarn_scatterings(*lone, materials);
  EXPECT_GT(all.minCoeff(), 2);
  // Brighter colours scatter more often before they are gone.
  EXPECT_GT(all[0], all[2]);
  // With every fiber a yarn of its own, light comes back to it seldom.
  Exemplar apart = crossed_layers(test_cotton());
  for (std::uint32_t f = 0; f < apart.fiber_count(); ++f) apart.yarn[f] = f;
  const Rgb own = own_yarn_scatterings(TileScene(apart), materials);
  EXPECT_GE(own.minCoeff(), 1);
  EXPECT_LT(own.maxCoeff(), 1.5);
}

}  // namespace
}  // namespace heddle

#include "fibers/cloth/yarn_paths.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/fabrics.h"

namespace heddle {
namespace {

TEST(YarnPathsLaw, NoTwoYarnsOverlapAndTheTightestTouch) {
  for (const char* notation : {"plain", "twill 2/2", "twill 3/1", "satin 5/2", "satin 8/3"}) {
    const FabricConfig config = test::small_fabric(notation);
    const YarnPaths paths = lay_yarns(config);
    // A grid finer than and incommensurate with the one that solved for the crests.
    const double clearance = smallest_clearance(config, paths, 151);
    EXPECT_GE(clearance, 0) << notation;
    EXPECT_LT(clearance, 0.01 * config.yarns[0].height_mm)
        << notation << ": the crests are taller than they need to be";
  }
}

TEST(YarnPathsLaw, CrestsGoOverAndUnderAsTheWeaveSays) {
  const FabricConfig config = test::small_fabric("twill 2/2");
  const YarnPaths paths = lay_yarns(config);
  for (std::size_t end = 0; end < paths.warp.size(); ++end) {
    for (std::size_t pick = 0; pick < paths.weft.size(); ++pick) {
      const double gap = paths.warp[end].height_at(paths.weft[pick].across_mm) -
                         paths.weft[pick].height_at(paths.warp[end].across_mm);
      EXPECT_EQ(gap > 0, config.weave.is_warp_up(static_cast<int>(end), static_cast<int>(pick)));
    }
  }
}

// A yarn is at its crest where it crosses another, and half way between two crests in the middle
// between two crossings. The warp takes its share of the crimp, the weft the rest.
TEST(YarnPathsLaw, CrestsLieAtTheCrossingsAndShareTheCrimp) {
  for (const double share : {0.0, 0.3, 1.0}) {
    FabricConfig config = test::small_fabric("twill 3/1");
    config.crimp_warp = share;
    const YarnPaths paths = lay_yarns(config);
    double warp_crest = 0;
    double weft_crest = 0;
    for (const std::vector<YarnPath>* yarns : {&paths.warp, &paths.weft}) {
      const bool is_warp = yarns == &paths.warp;
      for (const YarnPath& yarn : *yarns) {
        EXPECT_EQ(yarn.is_warp, is_warp);
        const std::vector<YarnPath>& others = is_warp ? paths.weft : paths.warp;
        for (std::size_t k = 0; k < others.size(); ++k) {
          const double here = yarn.crest_mm[k % yarn.crest_mm.size()];
          const double next = yarn.crest_mm[(k + 1) % yarn.crest_mm.size()];
          const double crossing = others[k].across_mm;
          EXPECT_NEAR(yarn.height_at(crossing), here, 1e-12);
          EXPECT_NEAR(yarn.height_at(crossing + yarn.crossing_spacing_mm / 2), (here + next) / 2,
                      1e-12);
          (is_warp ? warp_crest : weft_crest) = std::abs(here);
        }
      }
    }
    EXPECT_NEAR(warp_crest, share * (warp_crest + weft_crest), 1e-12);
  }
}

// Copies of the weave ask for the same crests, but for rounding.
TEST(YarnPathsLaw, CrestsDoNotDependOnTheNumberOfRepeats) {
  FabricConfig config = test::small_fabric("satin 8/3");
  const YarnPaths one = lay_yarns(config);
  config.repeats_x = 3;
  config.repeats_y = 5;
  const YarnPaths many = lay_yarns(config);
  ASSERT_EQ(many.warp.size(), 3 * one.warp.size());
  ASSERT_EQ(many.weft.size(), 5 * one.weft.size());
  for (std::size_t end = 0; end < many.warp.size(); ++end) {
    EXPECT_NEAR(many.warp[end].length_mm(), 5 * one.warp[0].length_mm(), 1e-12);
    for (double along = 0; along < many.warp[end].length_mm(); along += 0.0437) {
      EXPECT_NEAR(many.warp[end].height_at(along), one.warp[end % one.warp.size()].height_at(along),
                  1e-12);
    }
  }
}

// Takes minutes where every crossing of the tile is looked at.
TEST(YarnPaths, TheLargestSatinIsLaidAtOnce) {
  FabricConfig config = test::small_fabric("satin 64/3");
  config.repeats_x = config.repeats_y = 64;
  EXPECT_EQ(lay_yarns(config).warp.size(), 4096U);
}

TEST(YarnPathsLaw, HeightIsPeriodicAndSmooth) {
  const YarnPaths paths = lay_yarns(test::small_fabric("satin 5/2"));
  const YarnPath& yarn = paths.warp[1];
  const double step = 1e-5;
  for (double s = -1; s < 2; s += 0.0137) {
    EXPECT_NEAR(yarn.height_at(s), yarn.height_at(s + yarn.length_mm()), 1e-12);
    // One derivative from either side; the second derivative is below crest (pi / spacing)^2.
    const double left = (yarn.height_at(s) - yarn.height_at(s - step)) / step;
    const double right = (yarn.height_at(s + step) - yarn.height_at(s)) / step;
    EXPECT_NEAR(left, right, 110 * 0.2 * step);
  }
}

TEST(YarnPaths, YarnsTooWideToPassAreRefused) {
  FabricConfig config = test::small_fabric();
  config.yarns[0].width_mm = config.warp.spacing_mm;
  config.yarns[1].width_mm = config.weft.spacing_mm;
  EXPECT_THROW(lay_yarns(config), std::invalid_argument);
}

}  // namespace
}  // namespace heddle

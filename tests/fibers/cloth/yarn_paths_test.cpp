#include "fibers/cloth/yarn_paths.h"

#include <gtest/gtest.h>

#include <regex>
#include <stdexcept>

#include "tests/support/fabrics.h"

namespace heddle {
namespace {

/// Twice: highest minus lowest place of a yarn.
double rise(const YarnPath& yarn) {
  const auto [low, high] =
      std::minmax_element(yarn.shape->height_mm.begin(), yarn.shape->height_mm.end());
  return *high - *low;
}

TEST(YarnPathsLaw, NoTwoYarnsOverlapAndTheTightestTouch) {
  for (const char* notation : {"plain", "twill 2/2", "twill 3/1", "satin 5/2", "satin 8/3"}) {
    for (const double flattening : {0.0, 0.3}) {
      FabricConfig config = test::small_fabric(notation);
      for (YarnConfig& yarn : config.yarns) yarn.contact_flattening = flattening;
      const YarnPaths paths = lay_yarns(config);
      // A grid finer than and incommensurate with the samples along the yarns.
      const double clearance = smallest_clearance(config, paths, 151);
      EXPECT_GE(clearance, 0) << notation << ", flattened by " << flattening;
      EXPECT_LT(clearance, 0.02 * config.yarns[0].height_mm) << notation << ": too far apart";
    }
  }
}

TEST(YarnPathsLaw, CrestsGoOverAndUnderAsTheWeaveSays) {
  const FabricConfig config = test::small_fabric("twill 2/2");
  const YarnPaths paths = lay_yarns(config);
  for (std::size_t end = 0; end < paths.warp.size(); ++end) {
    for (std::size_t pick = 0; pick < paths.weft.size(); ++pick) {
      const double gap = paths.warp[end].shape->height_at(paths.weft[pick].across_mm) -
                         paths.weft[pick].shape->height_at(paths.warp[end].across_mm);
      EXPECT_EQ(gap > 0, config.weave.is_warp_up(static_cast<int>(end), static_cast<int>(pick)));
    }
  }
}

// Yarns that spread take all room up to a neighbour on the same side, leave a passage beside the
// others, keep the area of their section, and still do not overlap.
TEST(YarnPathsLaw, SpreadYarnsTouchTheirNeighboursInFloats) {
  FabricConfig config = test::small_fabric("satin 5/2");
  for (YarnConfig& yarn : config.yarns) {
    yarn.height_mm = 0.1;
    yarn.spread = 1;
  }
  const YarnPaths paths = lay_yarns(config);
  EXPECT_GE(smallest_clearance(config, paths, 151), 0);
  int touching = 0;
  for (std::size_t end = 0; end < 5; ++end) {
    const YarnPath& left = paths.warp[end];
    const YarnPath& right = paths.warp[(end + 1) % 5];
    const double apart = end + 1 < 5 ? right.across_mm - left.across_mm : config.warp.spacing_mm;
    for (std::size_t pick = 0; pick < 5; ++pick) {
      const double y = paths.weft[pick].across_mm;
      const double gap = apart + right.shape->shift_at(y) - right.shape->half_width_at(y) -
                         left.shape->shift_at(y) - left.shape->half_width_at(y);
      const auto up = [&](std::size_t e) {
        return config.weave.is_warp_up(static_cast<int>(e % 5), static_cast<int>(pick));
      };
      const bool touches = up(end) == up(end + 1);
      touching += touches ? 1 : 0;
      EXPECT_NEAR(gap, touches ? 0 : 0.5 * config.yarns[1].height_mm, 1e-9) << end << ' ' << pick;
      EXPECT_NEAR(4 * left.shape->half_width_at(y) * left.shape->half_height_at(y),
                  config.yarns[0].width_mm * config.yarns[0].height_mm, 1e-6);
    }
  }
  EXPECT_EQ(touching, 15);
}

// Peirce 1937: in plain cloth the two systems' rises add up to the sum of the yarns' heights. A
// string rises against its pull, so equal systems share in the inverse ratio of their pulls.
TEST(YarnPathsLaw, SystemsShareTheCrimpOfPlainCloth) {
  for (const double share : {0.0, 0.3, 0.5, 1.0}) {
    FabricConfig config = test::small_fabric("plain");
    for (YarnConfig& yarn : config.yarns) {  // open cloth: most of a yarn runs straight
      yarn.width_mm = 0.04;
      yarn.height_mm = 0.02;
    }
    config.crimp_warp = share;
    const YarnPaths paths = lay_yarns(config);
    const double sum = rise(paths.warp[0]) + rise(paths.weft[0]);
    EXPECT_NEAR(sum, 0.04, 0.001);
    EXPECT_NEAR(rise(paths.warp[0]), share * sum, 0.01 * sum) << share;
    EXPECT_EQ(paths.warp[0].shape->crimp() > 1e-6, share > 0);
  }
}

// The warp of a satin bows over the picks of its float, and is lowest where it interlaces.
TEST(YarnPathsLaw, FloatsBowAndInterlacingsDip) {
  const FabricConfig config = test::small_fabric("satin 8/3");
  const YarnPaths paths = lay_yarns(config);
  const YarnPath& warp = paths.warp[0];
  int down = 0;
  for (std::size_t pick = 0; pick < paths.weft.size(); ++pick) {
    if (!config.weave.is_warp_up(0, static_cast<int>(pick))) down = static_cast<int>(pick);
  }
  const auto height = [&](int picks_away) {
    return warp.shape->height_at(
        paths.weft[static_cast<std::size_t>((down + picks_away) % 8)].across_mm);
  };
  for (int away = 0; away < 4; ++away) {
    EXPECT_GT(height(away + 1), height(away)) << away;
    EXPECT_NEAR(height(away), height(8 - away), 0.02 * rise(warp)) << away;
  }
  // It bends upwards nowhere but where it passes below.
  for (int away = 1; away < 8; ++away)
    EXPECT_LE(height(away - 1) + height(away + 1), 2 * height(away) + 1e-9) << away;
}

// Copies of the weave ask for the same paths, but for rounding.
TEST(YarnPathsLaw, PathsDoNotDependOnTheNumberOfRepeats) {
  FabricConfig config = test::small_fabric("satin 8/3");
  const YarnPaths one = lay_yarns(config);
  config.repeats_x = 3;
  config.repeats_y = 5;
  const YarnPaths many = lay_yarns(config);
  ASSERT_EQ(many.warp.size(), 3 * one.warp.size());
  ASSERT_EQ(many.weft.size(), 5 * one.weft.size());
  for (std::size_t end = 0; end < many.warp.size(); ++end) {
    EXPECT_NEAR(many.warp[end].length_mm, 5 * one.warp[0].length_mm, 1e-12);
    EXPECT_EQ(many.warp[end].shape->height_mm, one.warp[end % one.warp.size()].shape->height_mm);
  }
}

// A thick end among thin ones keeps its room, and the picks climb over it.
TEST(YarnPathsLaw, YarnsOfASequenceLieSideBySide) {
  FabricConfig config = test::small_fabric();
  config.repeats_x = 2;
  YarnConfig thick = config.yarns[0];
  thick.width_mm *= 2;
  thick.height_mm *= 2;
  thick.spacing_mm = 0.6;
  config.yarns.push_back(thick);
  config.warp.sequence = {0, 0, 2, 0};
  config.weft.spacing_mm = 0.5;
  const YarnPaths paths = lay_yarns(config);
  EXPECT_DOUBLE_EQ(paths.width_mm, 3 * 0.3 + 0.6);
  const double expected[] = {0.15, 0.45, 0.9, 1.35};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_DOUBLE_EQ(paths.warp[k].across_mm, expected[k]);
  EXPECT_DOUBLE_EQ(paths.warp[2].shape->half_width_at(0.3), 0.24);
  EXPECT_GE(smallest_clearance(config, paths, 151), 0);
}

TEST(YarnPaths, TheLargestSatinIsLaidAtOnce) {
  FabricConfig config = test::small_fabric("satin 64/3");
  config.repeats_x = config.repeats_y = 64;
  EXPECT_EQ(lay_yarns(config).warp.size(), 4096U);
}

TEST(YarnPathsLaw, HeightIsPeriodicAndSmooth) {
  const YarnPaths paths = lay_yarns(test::small_fabric("satin 5/2"));
  const YarnShape& yarn = *paths.warp[1].shape;
  const double step = 1e-6;
  for (double s = -1; s < 2; s += 0.0137) {
    EXPECT_NEAR(yarn.height_at(s), yarn.height_at(s + paths.warp[1].length_mm), 1e-12);
    const double left = (yarn.height_at(s) - yarn.height_at(s - step)) / step;
    const double right = (yarn.height_at(s + step) - yarn.height_at(s)) / step;
    EXPECT_NEAR(left, right, 1e-3);
  }
}

TEST(YarnPaths, YarnsThatJamAreRefusedWithWhatWouldCureIt) {
  FabricConfig config = test::small_fabric();
  for (YarnConfig& yarn : config.yarns) {
    yarn.width_mm = 0.28;
    yarn.height_mm = 0.3;
  }
  std::string message;
  try {
    lay_yarns(config);
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  std::smatch match;
  ASSERT_TRUE(std::regex_search(
      message, match, std::regex("spacing_mm ([0-9.]+) times.*height_mm ([0-9.]+) times")))
      << message;
  FabricConfig wider = config;
  wider.warp.spacing_mm = wider.weft.spacing_mm *= 1.01 * std::stod(match[1]);
  EXPECT_NO_THROW(lay_yarns(wider));
  FabricConfig thinner = config;
  for (YarnConfig& yarn : thinner.yarns) yarn.height_mm *= 0.99 * std::stod(match[2]);
  EXPECT_NO_THROW(lay_yarns(thinner));
}

TEST(YarnPaths, RepeatsTooLargeToLayAreRefused) {
  FabricConfig config = test::small_fabric();
  config.weave.ends = config.weave.picks = 513;
  config.weave.warp_up.assign(513 * 513, 1);
  EXPECT_THROW(lay_yarns(config), std::invalid_argument);
}

}  // namespace
}  // namespace heddle

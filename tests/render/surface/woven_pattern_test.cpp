#include "render/surface/woven_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/random.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

WovenPattern pattern_of(const std::string& keys) {
  return read_woven_pattern(TomlTable::parse(keys, "test.toml"));
}

const char* const kPatterns[] = {
    "notation = \"plain\"\nend_widths = [1]\npick_widths = [1]",
    "notation = \"twill 3/1\"\nend_widths = [1]\npick_widths = [2]",
    "notation = \"satin 8/3\"\nface = \"weft\"\nend_widths = [0.5]\npick_widths = [1]",
    "matrix = \"0001 0100\"\nend_widths = [1, 2]\npick_widths = [4]",
    "matrix = \"110010 011001 100110\"\nend_widths = [1, 1.5]\npick_widths = [1, 0.7, 2]",
};

TEST(WovenPattern, TwillHasThePapersWindows) {
  const WovenPattern twill = pattern_of(kPatterns[1]);
  EXPECT_EQ(twill.floats().size(), 8U);
  ASSERT_EQ(twill.kinds().size(), 2U);
  EXPECT_EQ(twill.kinds()[0].size, Vec2d(1, 6));
  EXPECT_EQ(twill.kinds()[1].size, Vec2d(1, 2));
  EXPECT_DOUBLE_EQ(twill.coverage(YarnSystem::kWarp), 0.75);
  EXPECT_DOUBLE_EQ(twill.coverage(YarnSystem::kWeft), 0.25);
}

TEST(WovenPattern, MatrixIsReadFromTheTopRowDown) {
  // Warp on top in the lower left and upper right crossing.
  const WovenPattern pattern =
      pattern_of("matrix = \"01 10\"\nend_widths = [1]\npick_widths = [1]");
  EXPECT_EQ(pattern.locate({0.5, 0.5}).segment->system, YarnSystem::kWarp);
  EXPECT_EQ(pattern.locate({1.5, 0.5}).segment->system, YarnSystem::kWeft);
  EXPECT_EQ(pattern.locate({1.5, 1.5}).segment->system, YarnSystem::kWarp);
}

TEST(WovenPattern, EveryPointLiesInTheSegmentThatHoldsIt) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const char* keys : kPatterns) {
    const WovenPattern pattern = pattern_of(keys);
    for (int n = 0; n < 2000; ++n) {
      const Vec2d position(200.0 * random.uniform_double() - 100.0,
                           200.0 * random.uniform_double() - 100.0);
      const PlacedFloat placed = pattern.locate(position);
      const Vec2d local = position - placed.corner;
      EXPECT_GE(local.minCoeff(), -1e-12);
      EXPECT_LE((local - placed.segment->size).maxCoeff(), 1e-12);
      const Vec2d next = position + pattern.repeat();
      EXPECT_EQ(pattern.locate(next).segment, placed.segment);
    }
  }
}

TEST(WovenPatternLaw, VisitedPartsTileTheRectangle) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (const char* keys : kPatterns) {
    const WovenPattern pattern = pattern_of(keys);
    for (int n = 0; n < 200; ++n) {
      const Vec2d low(40.0 * random.uniform_double() - 20.0, 40.0 * random.uniform_double() - 20.0);
      const Rectangle rectangle = {
          low, low + 12.0 * Vec2d(random.uniform_double(), random.uniform_double())};
      double area = 0.0;
      pattern.visit(rectangle, [&](const PlacedFloat& placed, const Rectangle& part) {
        area += part.area();
        // The middle of the part belongs to that very segment.
        const PlacedFloat found = pattern.locate(placed.corner + 0.5 * (part.min + part.max));
        EXPECT_EQ(found.segment, placed.segment);
        EXPECT_EQ(found.repeat_x, placed.repeat_x);
        EXPECT_EQ(found.repeat_y, placed.repeat_y);
      });
      EXPECT_NEAR(area, rectangle.area(), 1e-10);
    }
  }
}

// A large repeat is visited by the crossings of the rectangle, a small one float by float.
TEST(WovenPatternAgreement, ALargeRepeatIsVisitedAsTheSmallOneThatItRepeats) {
  const std::string widths = "\nend_widths = [1, 1.5]\npick_widths = [0.7]";
  std::string rows;
  for (int row = 0; row < 60; ++row) {
    for (int end = 0; end < 80; ++end) rows += "1001001101101100"[4 * (row % 4) + end % 4];
    rows += ' ';
  }
  const WovenPattern small = pattern_of("notation = \"twill 2/2\"" + widths);
  const WovenPattern large = pattern_of("matrix = \"" + rows + "\"" + widths);
  RandomStream random(4, RandomStage::kTest, 0, 0);
  for (int n = 0; n < 300; ++n) {
    const Vec2d corner(300.0 * random.uniform_double() - 150.0,
                       300.0 * random.uniform_double() - 150.0);
    const Vec2d size(6.0 * random.uniform_double(), 6.0 * random.uniform_double());
    // The parts in the plane and their yarns, in any order.
    const auto parts = [&](const WovenPattern& pattern) {
      std::vector<std::array<double, 5>> found;
      pattern.visit({corner, corner + size}, [&](const PlacedFloat& placed, const Rectangle& part) {
        const Vec2d min = placed.corner + part.min;
        const Vec2d max = placed.corner + part.max;
        const double system = placed.segment->system == YarnSystem::kWarp ? 1 : 0;
        if (part.area() > 1e-9) found.push_back({system, min.x(), min.y(), max.x(), max.y()});
      });
      std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
        const auto key = [](const auto& p) {
          return std::array<long, 5>{std::lround(p[0]), std::lround(1e6 * p[1]),
                                     std::lround(1e6 * p[2]), std::lround(1e6 * p[3]),
                                     std::lround(1e6 * p[4])};
        };
        return key(a) < key(b);
      });
      return found;
    };
    const auto of_small = parts(small);
    const auto of_large = parts(large);
    ASSERT_EQ(of_small.size(), of_large.size());
    for (std::size_t k = 0; k < of_small.size(); ++k) {
      for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(of_small[k][i], of_large[k][i], 1e-9);
    }
  }
}

TEST(WovenPatternLaw, PartsOfAFootprintAddUpToIt) {
  for (const char* keys : kPatterns) {
    const WovenPattern pattern = pattern_of(keys);
    for (const double footprint : {0.0, 1e-3, 0.3, 1.0, 5.0, 6.0, 10.0, 13.0, 1000.0}) {
      double share = 0.0;
      pattern.visit_footprint({0.7, -2.3}, footprint,
                              [&](const FootprintPart& part) { share += part.share; });
      EXPECT_NEAR(share, 1.0, 1e-12) << footprint;
    }
  }
}

TEST(WovenPattern, BadWeavesAreErrorsWithTheirPlace) {
  const auto message = [](const std::string& keys) -> std::string {
    try {
      pattern_of(keys);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const std::string widths = "\nend_widths = [1]\npick_widths = [1]";
  EXPECT_NE(message("notation = \"knit\"" + widths).find("test.toml:1:"), std::string::npos);
  EXPECT_NE(message("matrix = \"10 0\"" + widths).find("equal length"), std::string::npos);
  EXPECT_NE(message("matrix = \"12 21\"" + widths).find("equal length"), std::string::npos);
  EXPECT_NE(message("matrix = \"\"" + widths).find("1 to 4096 rows"), std::string::npos);
  EXPECT_NE(message("matrix = \"10 10\"" + widths).find("go under"), std::string::npos);
  EXPECT_NE(message("matrix = \"11 00\"" + widths).find("go under"), std::string::npos);
  EXPECT_NE(
      message("notation = \"plain\"\nend_widths = [1, 2, 3]\npick_widths = [1]").find("divides"),
      std::string::npos);
}

}  // namespace
}  // namespace heddle

// The fitted yarns in configs/yarns are held against the table that they come from.

#include "fibers/cloth/yarn_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "fibers/cloth/fibers_of_yarn.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

constexpr double kFiberRadiusMm = 0.01;

YarnConfig shipped_yarn(const std::string& name, const std::string& more = "") {
  const std::string text = "fiber = \"thread\"\nfrom = \"../yarns/" + name + ".toml\"\n" + more;
  const TomlTable table =
      TomlTable::parse(text, std::string(HEDDLE_SOURCE_DIR) + "/configs/fabrics/fabric.toml");
  FiberType fiber;
  fiber.name = "thread";
  fiber.radius_mm = kFiberRadiusMm;
  std::vector<FiberType> fibers = {fiber};
  YarnConfig yarn = read_yarn(table, name, fibers);
  table.finish();
  return yarn;
}

struct Published {
  const char* name;
  int plies, fibers;
  double yarn_radius, yarn_alpha, alpha, e_long, e_short;  // u
  double hairs, hair_start, loops, loop_height;            // per u and ply; u
};

// Zhao, Luan, Bala 2016, table 2; 1 u = 5 mm.
const Published kPublished[] = {
    {"cotton1", 3, 75, .0378238, .452737, .366114, .0257183, .0200419, 30.356, .02039, 19.1,
     .02457},
    {"cotton2", 3, 36, .0330434, .336314, .434724, .0247464, .0179866, 20.526, .02081, 15.395,
     .02483},
    {"polyester1", 2, 60, .0287052, .370407, .379643, .0285371, .0210996, 31.491, .02082, 34.115,
     .02700},
    {"rayon1", 2, 150, .0507064, .639347, .711474, .0531133, .0355896, 53.04, .04163, 64.48,
     .05066},
    {"rayon2", 2, 79, .0286676, .372290, .377667, .0282957, .0208841, 47.306, .01847, 36.508,
     .02624},
    {"rayon3", 2, 143, .0418471, .638390, .612881, .0441109, .0335109, 53.720, .03054, 46.046,
     .03977},
    {"rayon4", 2, 122, .0452170, .497780, .557656, .0482998, .0343245, 66.822, .03872, 63.640,
     .04412},
    {"silk1", 3, 33, .0376190, .525528, .460258, .0252735, .0216003, 24.868, .02182, 20.665,
     .02563},
    {"silk2", 3, 47, .0450518, .701703, .560199, .0305889, .0252330, 25.542, .02362, 20.644,
     .02808},
};

TEST(YarnFile, HoldThePublishedNumbers) {
  constexpr double kUnit = 5;  // mm
  for (const Published& published : kPublished) {
    const YarnConfig yarn = shipped_yarn(published.name);
    EXPECT_EQ(yarn.plies, published.plies) << published.name;
    EXPECT_EQ(yarn.fibers_per_ply, published.fibers);
    const auto near = [&](double value, double expected) {
      EXPECT_NEAR(value / expected, 1, 1e-3) << published.name << " " << expected;
    };
    near(std::abs(yarn.yarn_turns_per_mm) * kUnit * published.yarn_alpha, 1);
    near(std::abs(yarn.ply_turns_per_mm) * kUnit * published.alpha, 1);
    EXPECT_LT(yarn.yarn_turns_per_mm * yarn.ply_turns_per_mm, 0) << "plied against the singles";
    near(yarn.ply_mm->centre, kUnit * published.yarn_radius / 2);
    near(yarn.ply_mm->radial, kUnit * published.e_short);
    near(yarn.ply_mm->tangential, kUnit * published.e_long);
    near(yarn.hairs.per_mm * kUnit, published.hairs);
    near(yarn.hairs.start_mm.mean, kUnit * published.hair_start);
    near(yarn.loops.per_mm * kUnit, published.loops);
    near(yarn.loops.height_mm.mean, kUnit * published.loop_height);
  }
}

// Each is a valid periodic tile with as many hairs as asked, and its fibers go around it as often
// as its twist says.
TEST(YarnFileLaw, MakePeriodicYarns) {
  for (const Published& published : kPublished) {
    const YarnConfig yarn = shipped_yarn(published.name);
    const double length = 6;
    Exemplar exemplar;
    exemplar.width_mm = static_cast<float>(length);
    exemplar.height_mm = 4;
    exemplar.first_point = {0};
    exemplar.scattering = {test::white_fiber()};
    const CentreLine line{[&](double share) {
                            return YarnPlace{{share * length, 2, 0},
                                             {0, 1, 0},
                                             {0, 0, 1},
                                             0.5 * yarn.width_mm,
                                             0.5 * yarn.height_mm};
                          },
                          length};
    add_fibers_of_yarn(yarn, kFiberRadiusMm, line, 0.1, 1, 0, exemplar);
    EXPECT_NO_THROW(validate_exemplar(exemplar, published.name));
    index_segments(exemplar);
    int hairs = 0;
    for (const std::uint8_t is_open : exemplar.is_open) hairs += is_open;
    EXPECT_NEAR(hairs, yarn.plies * yarn.hairs.per_mm * length, yarn.plies) << published.name;
    EXPECT_NEAR(static_cast<double>(exemplar.segment_count()) / segments_of_yarn(yarn, length, 0.1),
                1, 0.05)
        << published.name;
  }
}

TEST(YarnFileLaw, ScalingKeepsShapes) {
  const YarnConfig one = shipped_yarn("rayon1");
  const YarnConfig two = shipped_yarn("rayon1", "scale = 2\n");
  EXPECT_NEAR(two.ply_mm->tangential, 2 * one.ply_mm->tangential, 1e-12);
  EXPECT_NEAR(two.width_mm - 2 * kFiberRadiusMm, 2 * (one.width_mm - 2 * kFiberRadiusMm), 1e-12);
  EXPECT_NEAR(two.yarn_turns_per_mm, one.yarn_turns_per_mm / 2, 1e-12);
  EXPECT_NEAR(two.hairs.per_mm * two.hairs.rise_mm.mean, one.hairs.per_mm * one.hairs.rise_mm.mean,
              1e-12);
  EXPECT_NEAR(two.loops.height_mm.deviation, 2 * one.loops.height_mm.deviation, 1e-12);
}

TEST(YarnFile, AWovenSectionTakesThePlaceOfTheRoundOne) {
  const YarnConfig yarn = shipped_yarn("cotton1", "width_mm = 0.45\nheight_mm = 0.3\n");
  EXPECT_EQ(yarn.width_mm, 0.45);
  EXPECT_EQ(yarn.height_mm, 0.3);
  EXPECT_NEAR(shipped_yarn("cotton1").width_mm, 0.3895 + 2 * kFiberRadiusMm, 2e-3);
}

}  // namespace
}  // namespace heddle

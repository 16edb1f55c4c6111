#include "fibers/cloth/yarn_count.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

TEST(YarnCount, ReadsTheSystemsOfTheTrade) {
  // Definitions: tex is g / 1000 m, denier g / 9000 m, Nm 1000 m / kg, Ne 840 yards / lb.
  EXPECT_DOUBLE_EQ(parse_yarn_count("20 tex").ply_tex, 20);
  EXPECT_DOUBLE_EQ(parse_yarn_count("167dtex").ply_tex, 16.7);
  EXPECT_DOUBLE_EQ(parse_yarn_count("90 den").ply_tex, 10);
  EXPECT_DOUBLE_EQ(parse_yarn_count("Nm 60").ply_tex, 1000.0 / 60);
  EXPECT_NEAR(parse_yarn_count("Ne 1").ply_tex, 453.59237 / (840 * 0.9144) * 1000, 0.02);
  EXPECT_EQ(parse_yarn_count("Ne 40").plies, 1);
  EXPECT_EQ(parse_yarn_count("Ne 40/2").plies, 2);
  EXPECT_DOUBLE_EQ(parse_yarn_count("Ne 40/2").ply_tex, parse_yarn_count("Ne 40").ply_tex);
  EXPECT_EQ(parse_yarn_count("20 tex x3").plies, 3);
}

TEST(YarnCount, RefusesWhatIsNoCount) {
  for (const char* text : {"", "40", "Ne", "Ne 0", "Ne -4", "Ne nan", "Ne inf", "Ne 40/", "Ne 40/0",
                           "Ne 40/13", "20 texx", "20 tex/2", "ne 40", "Nm 1e-9", "1e300 tex"}) {
    EXPECT_THROW(parse_yarn_count(text), std::invalid_argument) << text;
  }
}

// 4.2 micrograms per inch are 165 mtex; solid and round, at 1.52 g/cm^3, 11.8 um thick.
TEST(YarnCount, FibersHaveTheThicknessOfTheirFineness) {
  const double tex = 4.2 * kTexPerMicronaire;
  EXPECT_NEAR(tex, 0.165, 0.001);
  EXPECT_NEAR(2 * fiber_radius_mm(tex, 1.52), 0.0118, 0.0001);
  EXPECT_NEAR(fiber_tex(fiber_radius_mm(tex, 1.52), 1.52), tex, 1e-12);
  // 1.5 denier polyester: 12.4 um.
  EXPECT_NEAR(2 * fiber_radius_mm(1.5 * kTexPerDenier, 1.39), 0.0124, 0.0001);
}

// Peirce's diameter, 0.0375 sqrt(tex) mm, is cotton at 1.1 cm^3 per gram of yarn.
TEST(YarnCount, APackingOfSixTenthsGivesPeircesDiameter) {
  const double area = section_area_mm2(20, 1.52) / 0.598;
  EXPECT_NEAR(2 * std::sqrt(area / kPi), 0.0375 * std::sqrt(20.0), 0.001);
}

}  // namespace
}  // namespace heddle

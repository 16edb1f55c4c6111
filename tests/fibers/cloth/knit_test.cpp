#include "fibers/cloth/knit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "formats/input_error.h"

namespace heddle {
namespace {

// Cotton single jersey of Ne 30: 0.166 mm thick (Peirce), 14 wales and 18 courses per cm.
KnitConfig jersey() {
  KnitConfig knit;
  knit.wales_per_mm = 1.4;
  knit.courses_per_mm = 1.8;
  knit.wales = 3;
  knit.courses = 4;
  knit.sequence = {0};
  return knit;
}
constexpr double kDiameter = 0.166;

KnitConfig rib() {
  KnitConfig knit = jersey();
  knit.structure = KnitStructure::kRib1x1;
  knit.wales = 4;
  return knit;
}

// On a grid that is finer than the solver's and incommensurate with it.
TEST(KnitLaw, YarnsTouchAndDoNotOverlap) {
  for (const KnitConfig& knit : {jersey(), rib()}) {
    const LoopForm loop = solve_loop(knit, kDiameter);
    const double courses = distance_of_courses(loop, 487);
    const double within = distance_within_course(loop, kDiameter, 487);
    std::printf(
        "widening %.2f, height %.2f courses, depth %.2f diameters: courses %.3f, within %.3f "
        "diameters apart; loop of %.2f mm\n",
        loop.widening, loop.height_mm / loop.course_mm, loop.depth_mm / kDiameter,
        courses / kDiameter, within / kDiameter, loop_length(loop));
    EXPECT_GT(courses, 0.995 * kDiameter);
    EXPECT_LT(courses, 1.02 * kDiameter) << "deeper than it needs to be";
    EXPECT_GT(within, 0.98 * kDiameter);
  }
}

// Munden 1959: relaxed plain knits have 19 to 23 as courses x wales x (length of a loop)^2.
TEST(KnitLaw, LoopsTakeAsMuchYarnAsRealOnes) {
  for (const auto& [wales, courses] :
       {std::pair{1.4, 1.8}, std::pair{1.25, 1.65}, std::pair{1.3, 1.7}}) {
    KnitConfig knit = jersey();
    knit.wales_per_mm = wales;
    knit.courses_per_mm = courses;
    const double length = loop_length(solve_loop(knit, kDiameter));
    std::printf("%g x %g per mm: %.1f\n", wales, courses, wales * courses * length * length);
    EXPECT_NEAR(wales * courses * length * length, 21.5, 3) << wales;
  }
}

// Seen from the face, a jersey's legs lie over the heads and sinkers of its neighbours: at each of
// the four crossings of two courses in a wale, that which is nearer to the middle of its leg is
// above.
TEST(KnitLaw, LoopsInterlock) {
  const LoopForm loop = solve_loop(jersey(), kDiameter);
  constexpr int kSteps = 720;
  int crossings = 0;
  const Vec3d next(0, loop.course_mm, 0);
  for (int i = 0; i < kSteps; ++i) {
    const Vec3d a = loop.at(2 * kPi * i / kSteps);
    const Vec3d b = loop.at(2 * kPi * (i + 1) / kSteps);
    for (int j = -kSteps / 4; j < kSteps + kSteps / 4; ++j) {
      const Vec3d c = next + loop.at(2 * kPi * j / kSteps);
      const Vec3d d = next + loop.at(2 * kPi * (j + 1) / kSteps);
      const auto turn = [](const Vec3d& p, const Vec3d& q, const Vec3d& r) {
        return (q - p).head<2>().x() * (r - p).y() - (q - p).y() * (r - p).x();
      };
      if (turn(a, b, c) * turn(a, b, d) >= 0 || turn(c, d, a) * turn(c, d, b) >= 0) continue;
      ++crossings;
      const double from_leg_lower = std::abs(std::cos(2 * kPi * i / kSteps));
      const double from_leg_upper = std::abs(std::cos(2 * kPi * j / kSteps));
      EXPECT_EQ(a.z() > c.z(), from_leg_lower < from_leg_upper);
      EXPECT_GT(std::abs(a.z() - c.z()), 0.5 * kDiameter);
    }
  }
  EXPECT_EQ(crossings, 4);
}

TEST(KnitLaw, WalesOfARibLieOnBothSidesAndMeetSmoothly) {
  const LoopForm loop = solve_loop(rib(), kDiameter);
  EXPECT_GT(loop.at(kPi / 2).z(), 0.5 * kDiameter);
  EXPECT_LT(loop.at(2 * kPi + kPi / 2).z(), -0.5 * kDiameter);
  const double step = 1e-5;
  for (const double t : {0.0, 2 * kPi, 4 * kPi}) {
    const Vec3d before = (loop.at(t) - loop.at(t - step)) / step;
    const Vec3d after = (loop.at(t + step) - loop.at(t)) / step;
    EXPECT_NEAR((after - before).norm(), 0, 1e-3);
  }
}

TEST(KnitLaw, CoursesGoOnInTheNextTile) {
  for (const KnitConfig& knit : {jersey(), rib()}) {
    const LoopForm loop = solve_loop(knit, kDiameter);
    const CentreLine line = centre_line_of_course(loop, knit, 1, 0.16, 0.12);
    EXPECT_FALSE(line.is_open);
    EXPECT_NEAR(line.length_mm, knit.wales * loop_length(loop), 1e-6);
    const YarnPlace first = line.at(0);
    const YarnPlace last = line.at(1);
    EXPECT_NEAR(
        (last.position - first.position - Vec3d(knit.wales / knit.wales_per_mm, 0, 0)).norm(), 0,
        1e-9);
    EXPECT_NEAR((last.side - first.side).norm() + (last.up - first.up).norm(), 0, 1e-9);
  }
}

TEST(Knit, ARibOfAnOddNumberOfWalesIsRefused) {
  const auto read = [](const std::string& wales) {
    return read_knit(TomlTable::parse(
        "structure = \"rib 1x1\"\nwales_per_cm = 14\ncourses_per_cm = 18\ncourses = 4\nwales = " +
            wales + "\n",
        "fabric.toml"));
  };
  EXPECT_NEAR(read("4").width_mm(), 4 / 1.4, 1e-12);
  EXPECT_THROW(read("3"), ConfigError);
}

TEST(Knit, YarnsTooThickAreRefusedWithWhatWouldFit) {
  try {
    solve_loop(jersey(), 0.25);
    ADD_FAILURE() << "a yarn of 0.25 mm was knitted";
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    std::printf("%s\n", message.c_str());
    const std::size_t at = message.find("at most ");
    ASSERT_NE(at, std::string::npos);
    const double fits = std::stod(message.substr(at + 8));
    EXPECT_NO_THROW(solve_loop(jersey(), 0.99 * fits));
  }
}

}  // namespace
}  // namespace heddle

#include "fibers/cloth/fibers_of_yarn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "fibers/cloth/yarn_paths.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

CentreLine flat_yarn(const YarnConfig& yarn, double length_mm, bool is_warp) {
  const auto shape = std::make_shared<const YarnShape>(YarnShape{
      length_mm / 4, std::vector<double>(4, 0.0), std::vector<double>(4, 0.0),
      std::vector<double>(4, 0.5 * yarn.width_mm), std::vector<double>(4, 0.5 * yarn.height_mm)});
  return centre_line({is_warp, 0.5, length_mm, shape});
}

YarnConfig yarn_of(int plies, int fibers, double wander_deg) {
  YarnConfig yarn;
  yarn.width_mm = 0.4;
  yarn.height_mm = 0.2;
  yarn.plies = plies;
  yarn.fibers_per_ply = fibers;
  yarn.wander_rms = radians(wander_deg);
  return yarn;
}

Exemplar fibers_of(const YarnConfig& yarn, double length_mm, double segment_mm,
                   std::uint64_t seed = 1, bool is_warp = false) {
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  (is_warp ? exemplar.height_mm : exemplar.width_mm) = static_cast<float>(length_mm);
  exemplar.first_point = {0};
  exemplar.scattering = {test::white_fiber()};
  add_fibers_of_yarn(yarn, 0.005, flat_yarn(yarn, length_mm, is_warp), segment_mm, seed, 0,
                     exemplar);
  index_segments(exemplar);
  return exemplar;
}

TEST(FibersOfYarnLaw, NoFiberLeavesItsYarn) {
  for (int plies : {1, 2, 3, 5}) {
    YarnConfig yarn = yarn_of(plies, 20, 10);
    yarn.ply_turns_per_mm = 1.3;
    yarn.yarn_turns_per_mm = -0.7;
    yarn.migration = 0.5;
    const Exemplar exemplar = fibers_of(yarn, 3, 0.02);
    for (const Vec3& p : exemplar.points) {
      const double across = std::hypot((p.y() - 0.5) / (0.5 * yarn.width_mm - 0.005),
                                       p.z() / (0.5 * yarn.height_mm - 0.005));
      EXPECT_LE(across, 1 + 1e-4) << plies;
    }
  }
}

TEST(FibersOfYarnLaw, EveryFiberContinuesInTheNextTile) {
  YarnConfig yarn = yarn_of(2, 9, 6);
  yarn.ply_turns_per_mm = 0.9;
  yarn.yarn_turns_per_mm = 0.4;
  const Exemplar exemplar = fibers_of(yarn, 2.5, 0.03);
  ASSERT_EQ(exemplar.fiber_count(), 18U);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "fibers"));
}

// A twist of whole turns: a helix of radius R and N turns over length L climbs at atan(2 pi R N /
// L).
TEST(FibersOfYarnLaw, TwistGivesTheAngleOfAHelix) {
  YarnConfig yarn = yarn_of(1, 400, 0);
  yarn.width_mm = yarn.height_mm = 0.4;
  yarn.ply_turns_per_mm = 2;
  const Exemplar exemplar = fibers_of(yarn, 2, 0.005);
  ASSERT_EQ(snap_twist(yarn, 2).ply_turns, 4);
  for (std::uint32_t s = 0; s < exemplar.segment_count(); s += 97) {
    const Vec3 m = exemplar.segment_midpoint(s);
    const double radius = std::hypot(m.y() - 0.5, m.z());
    const double expected = std::atan(2 * kPi * radius * 2);
    EXPECT_NEAR(std::acos(exemplar.segment_tangent(s).x()), expected, 0.01) << radius;
  }
}

// Z twist is that of a right-handed screw: going around an axis, a fiber moves on along it as the
// thumb of a right hand does, so that (place beside the axis x tangent) . axis > 0 for every piece,
// whichever way the axis is followed. A ply without turns of its own is turned by its yarn alone;
// its axis is the yarn's.
TEST(FibersOfYarnLaw, PositiveTwistIsZ) {
  for (const bool is_warp : {false, true}) {
    const int along = is_warp ? 1 : 0;
    for (const double turns : {1.5, -1.5}) {
      for (const bool of_the_ply : {false, true}) {
        YarnConfig yarn = yarn_of(of_the_ply ? 1 : 3, 12, 0);
        (of_the_ply ? yarn.ply_turns_per_mm : yarn.yarn_turns_per_mm) = turns;
        const Exemplar exemplar = fibers_of(yarn, 2, 0.01, 1, is_warp);
        ASSERT_GT(exemplar.segment_count(), 1000U);
        for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
          Vec3 beside = exemplar.segment_midpoint(s);
          beside[1 - along] -= 0.5F;
          beside[along] = 0;
          const float hand = beside.cross(exemplar.segment_tangent(s))[along];
          ASSERT_GT(hand * static_cast<float>(turns), 0)
              << s << (is_warp ? ", warp" : ", weft") << (of_the_ply ? ", ply" : ", yarn");
        }
      }
    }
  }
}

// Fibers turn about the axis of their own ply, which is their mean over whole turns: as often as
// the twist says, the innermost too.
TEST(FibersOfYarnLaw, FibersTurnAboutTheirPly) {
  YarnConfig yarn = yarn_of(2, 40, 0);
  yarn.width_mm = yarn.height_mm = 0.4;
  yarn.ply_turns_per_mm = 2;
  const Exemplar exemplar = fibers_of(yarn, 2, 0.005);
  const std::uint32_t per_fiber = exemplar.first_point[1] - 1;
  for (std::uint32_t fiber = 0; fiber < 80; ++fiber) {
    // The ply's axis: the mean of its fibers, here over one turn of each.
    Vec3 axis = Vec3::Zero();
    for (std::uint32_t f = fiber / 40 * 40; f < fiber / 40 * 40 + 40; ++f) {
      for (std::uint32_t k = 0; k < per_fiber; ++k)
        axis += exemplar.points[exemplar.first_point[f] + k] / static_cast<float>(40 * per_fiber);
    }
    double turned = 0;
    for (std::uint32_t k = 0; k < per_fiber; ++k) {
      const Vec3 from = exemplar.points[exemplar.first_point[fiber] + k] - axis;
      const Vec3 to = exemplar.points[exemplar.first_point[fiber] + k + 1] - axis;
      turned += std::atan2(static_cast<double>(from.y() * to.z() - from.z() * to.y()),
                           static_cast<double>(from.y() * to.y() + from.z() * to.z()));
    }
    EXPECT_NEAR(turned / (2 * kPi), 4, 1e-3) << fiber;
  }
}

// Migration of depth m moves a fiber between its own distance from the ply's axis and 1 - m of it,
// once per turn of the ply.
TEST(FibersOfYarnLaw, MigrationIsAsDeepAsAsked) {
  for (const double depth : {0.2, 0.5}) {
    YarnConfig yarn = yarn_of(1, 30, 0);
    yarn.width_mm = yarn.height_mm = 0.4;
    yarn.ply_turns_per_mm = 1.5;
    yarn.migration = depth;
    const Exemplar exemplar = fibers_of(yarn, 2, 0.005);
    for (std::uint32_t fiber = 0; fiber < exemplar.fiber_count(); ++fiber) {
      const std::uint32_t first = exemplar.first_point[fiber];
      const std::uint32_t last = exemplar.first_point[fiber + 1] - 1;
      double nearest = 1;
      double farthest = 0;
      int turning_points = 0;
      double before = -1;
      bool rises = false;
      for (std::uint32_t p = first; p < last; ++p) {
        const double distance = std::hypot(exemplar.points[p].y() - 0.5, exemplar.points[p].z());
        nearest = std::min(nearest, distance);
        farthest = std::max(farthest, distance);
        const bool rises_now = distance > before;
        if (p > first + 1 && rises_now != rises) ++turning_points;
        rises = rises_now;
        before = distance;
      }
      // 130 points per turn: the extremes lie within half a step of a point.
      EXPECT_NEAR(nearest / farthest, 1 - depth, 1e-3) << fiber;
      // Three turns of the ply, two turning points each; one of them may lie at the seam.
      EXPECT_NEAR(turning_points, 6, 1) << fiber;
    }
  }
}

// Plies are circles that touch each other and the yarn's edge: of n in a unit disc, the radius is
// s / (1 + s), s = sin(pi / n), and the centre lies 1 less that from the axis. Two are stretched to
// semi-axes of 1/2 and sqrt(1/2). One fills the yarn.
TEST(FibersOfYarnLaw, PliesFillTheirPlaceInTheYarn) {
  struct Shape {
    int plies;
    double centre, radial, tangential;
  };
  const double three = std::sqrt(0.75) / (1 + std::sqrt(0.75));
  for (const Shape& shape :
       {Shape{1, 0, 1, 1}, {2, 0.5, 0.5, std::sqrt(0.5)}, {3, 1 - three, three, three}}) {
    constexpr int kFibers = 400;
    const YarnConfig yarn = yarn_of(shape.plies, kFibers, 0);
    const Exemplar exemplar = fibers_of(yarn, 2, 0.5);
    for (int ply = 0; ply < shape.plies; ++ply) {
      // In the yarn's unit disc; fibers run straight.
      std::vector<Vec2> places;
      Vec2 mean = Vec2::Zero();
      for (int f = ply * kFibers; f < (ply + 1) * kFibers; ++f) {
        const Vec3& p = exemplar.points[exemplar.first_point[static_cast<std::size_t>(f)]];
        places.emplace_back((p.y() - 0.5F) / (0.2F - 0.005F), p.z() / (0.1F - 0.005F));
        mean += places.back() / static_cast<float>(kFibers);
      }
      EXPECT_NEAR(mean.norm(), shape.centre, 0.01) << shape.plies;
      const Vec2 towards = shape.centre > 0 ? Vec2(mean.normalized()) : Vec2(1, 0);
      float radial = 0;
      float tangential = 0;
      for (const Vec2& place : places) {
        const Vec2 offset = place - mean;
        radial = std::max(radial, std::abs(offset.dot(towards)));
        tangential =
            std::max(tangential, std::abs(towards.x() * offset.y() - towards.y() * offset.x()));
      }
      // The outermost of 400 lie a hundredth within the edge, give or take their jitter.
      EXPECT_NEAR(radial / shape.radial, 0.99, 0.02) << shape.plies;
      EXPECT_NEAR(tangential / shape.tangential, 0.99, 0.02) << shape.plies;
    }
  }
}

// Slopes are sums of modes with the stated rms; the few fibers that meet the yarn's edge are held
// back there, which can only lower it.
TEST(FibersOfYarnStatistical, WanderHasTheStatedRmsAngle) {
  for (double asked : {1.0, 3.0, 6.0}) {
    YarnConfig yarn = yarn_of(1, 300, asked);
    yarn.width_mm = yarn.height_mm = 2;  // little edge
    const Exemplar exemplar = fibers_of(yarn, 4, 0.01);
    double sum = 0;
    for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
      const Vec3 t = exemplar.segment_tangent(s);
      const double slope = std::hypot(t.y(), t.z()) / t.x();
      sum += slope * slope;
    }
    const double measured =
        degrees(std::atan(std::sqrt(sum / static_cast<double>(exemplar.segment_count()))));
    EXPECT_NEAR(measured, asked, 0.05 * asked);
  }
}

// A round yarn of one ply along x; places are read relative to its axis.
YarnConfig round_yarn(int fibers) {
  YarnConfig yarn = yarn_of(1, fibers, 0);
  yarn.width_mm = yarn.height_mm = 0.4;
  return yarn;
}

double distance_from_axis(const Vec3& point) {
  return std::hypot(point.y() - 0.5, static_cast<double>(point.z()));
}

// Kolmogorov and Smirnov: with n fibers, the largest difference of the shares exceeds 1.63 /
// sqrt(n) by chance once in a hundred. Fibers in a pattern lie more evenly than by chance.
TEST(FibersOfYarnStatistical, FibersLieInTheirPlyAsTheDensitySays) {
  for (const RadialDensity density : {RadialDensity{0, 0}, {0, 0.2}, {0.34, 0.42}, {0, 2}}) {
    YarnConfig yarn = round_yarn(2000);
    yarn.density = density;
    const Exemplar exemplar = fibers_of(yarn, 2, 0.5);
    std::vector<double> radii;
    std::array<int, 8> sectors{};
    for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
      const Vec3& point = exemplar.points[exemplar.first_point[f]];
      radii.push_back(distance_from_axis(point) / 0.195);
      const double azimuth = std::atan2(point.z(), point.y() - 0.5F);
      ++sectors[static_cast<std::size_t>(std::min(7.0, 8 * (azimuth / (2 * kPi) + 0.5)))];
    }
    std::sort(radii.begin(), radii.end());
    const RadialPlaces places(density);
    double worst = 0;
    for (std::size_t k = 0; k < radii.size(); ++k) {
      const double share = (static_cast<double>(k) + 0.5) / static_cast<double>(radii.size());
      worst = std::max(worst, std::abs(places.share(radii[k]) - share));
    }
    std::printf("beta %g: largest difference of shares %.4f\n", density.beta, worst);
    EXPECT_LT(worst, 1.63 / std::sqrt(2000.0)) << density.beta;
    double chi_square = 0;
    for (const int count : sectors) chi_square += std::pow(count - 250, 2) / 250.0;
    EXPECT_GT(chi_square_tail(chi_square, 7), 0.01) << density.beta;
  }
}

TEST(FibersOfYarnLaw, MigrationHasItsOwnPeriod) {
  YarnConfig yarn = round_yarn(20);
  yarn.ply_turns_per_mm = 1.5;
  yarn.migration = 0.3;
  yarn.migration_per_turn = 1.9;
  const Exemplar exemplar = fibers_of(yarn, 4, 0.005);
  for (std::uint32_t fiber = 0; fiber < exemplar.fiber_count(); ++fiber) {
    const std::uint32_t first = exemplar.first_point[fiber];
    const std::uint32_t count = exemplar.first_point[fiber + 1] - 1 - first;
    int rises = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const auto at = [&](std::uint32_t i) {
        return distance_from_axis(exemplar.points[first + i % count]);
      };
      if (at(k + 1) > at(k) && at(k + 2) <= at(k + 1)) ++rises;
    }
    EXPECT_EQ(rises, 11) << fiber;  // 1.9 x 1.5 x 4 = 11.4
  }
}

// The ellipses of plies are those asked for, their short axis towards the yarn's.
TEST(FibersOfYarnLaw, PliesHaveTheirOwnEllipses) {
  constexpr int kFibers = 400;
  YarnConfig yarn = yarn_of(3, kFibers, 0);
  yarn.ply_mm = PlyShape{0.09, 0.1, 0.13};
  yarn.width_mm = yarn.height_mm = 2 * (reach_of(*yarn.ply_mm) + 0.005);
  const Exemplar exemplar = fibers_of(yarn, 2, 0.5);
  for (std::size_t ply = 0; ply < 3; ++ply) {
    std::vector<Vec2> places;
    Vec2 mean = Vec2::Zero();
    for (std::size_t f = ply * kFibers; f < (ply + 1) * kFibers; ++f) {
      const Vec3& p = exemplar.points[exemplar.first_point[f]];
      places.emplace_back(p.y() - 0.5F, p.z());
      mean += places.back() / static_cast<float>(kFibers);
    }
    EXPECT_NEAR(mean.norm(), 0.09, 0.002);
    const Vec2 towards = mean.normalized();
    float radial = 0;
    float tangential = 0;
    for (const Vec2& place : places) {
      radial = std::max(radial, std::abs((place - mean).dot(towards)));
      tangential =
          std::max(tangential, std::abs(towards.x() * place.y() - towards.y() * place.x()));
    }
    EXPECT_NEAR(radial, 0.1, 0.003);
    EXPECT_NEAR(tangential, 0.13, 0.004);
  }
}

// A hair's arc starts at its distance from the ply's axis and goes on to either side by its rise:
// both follow from where its polyline starts and ends.
TEST(FibersOfYarnStatistical, HairsAreAsManyAndAsLongAsAsked) {
  YarnConfig yarn = round_yarn(3);
  yarn.hairs = {30, {0.2, 0.01}, {0.1, 0.02}, {0.05, 0.1}, {0.3, 0.2}};
  const Exemplar exemplar = fibers_of(yarn, 40, 0.02);
  RunningMean rise, start, along, around, along_square;
  int hairs = 0;
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    if (exemplar.is_open[f] == 0) continue;
    ++hairs;
    const Vec3& first = exemplar.points[exemplar.first_point[f]];
    const Vec3& last = exemplar.points[exemplar.first_point[f + 1] - 1];
    rise.add(0.5 * (distance_from_axis(last) - distance_from_axis(first)));
    start.add(0.5 * (distance_from_axis(last) + distance_from_axis(first)));
    along.add(0.5 * (last.x() - first.x()));
    along_square.add(std::pow(0.5 * (last.x() - first.x()) - 0.05, 2));
    const double angle =
        std::atan2(last.z(), last.y() - 0.5F) - std::atan2(first.z(), first.y() - 0.5F);
    around.add(0.5 * std::remainder(angle, 2 * kPi));
  }
  EXPECT_NEAR(hairs, 1200, 1);
  const auto agrees = [](const char* name, const RunningMean& mean, double expected) {
    EXPECT_TRUE(means_agree(name, mean.mean(), mean.standard_error(), expected, 0, 5));
  };
  agrees("start of hairs, mm", start, 0.2);
  agrees("rise of hairs, mm", rise, 0.1);
  agrees("length of hairs along the ply, mm", along, 0.05);
  agrees("its variance, mm2", along_square, 0.01);
  agrees("turn of hairs, radians", around, 0.3);
}

TEST(FibersOfYarnStatistical, LoopsAreAsManyAndAsHighAsAsked) {
  YarnConfig yarn = round_yarn(60);
  yarn.ply_turns_per_mm = 1;
  yarn.migration = 0.2;
  yarn.loops = {8, {0.3, 0.01}};
  const Exemplar exemplar = fibers_of(yarn, 40, 0.01);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "loops"));
  ASSERT_EQ(exemplar.fiber_count(), 60U);
  RunningMean heights;
  RunningMean squares;
  int loops = 0;
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    EXPECT_EQ(exemplar.is_open[f], 0);
    const std::uint32_t first = exemplar.first_point[f];
    const std::uint32_t count = exemplar.first_point[f + 1] - 1 - first;
    const auto at = [&](std::uint32_t k) {
      return distance_from_axis(exemplar.points[first + k % count]);
    };
    for (std::uint32_t k = 0; k < count; ++k) {
      if (at(k + 1) < 0.24 || at(k + 1) < at(k) || at(k + 1) <= at(k + 2)) continue;
      ++loops;
      heights.add(at(k + 1));
      squares.add(std::pow(at(k + 1) - 0.3, 2));
    }
  }
  EXPECT_NEAR(loops, 320, 1);
  EXPECT_TRUE(
      means_agree("height of loops, mm", heights.mean(), heights.standard_error(), 0.3, 0, 2));
  EXPECT_TRUE(
      means_agree("its variance, mm2", squares.mean(), squares.standard_error(), 1e-4, 0, 2));
}

TEST(FibersOfYarn, LoopsThatHaveNoRoomAreRefused) {
  YarnConfig yarn = round_yarn(4);
  yarn.loops = {10, {0.3, 0.01}};
  EXPECT_THROW(fibers_of(yarn, 4, 0.1), std::invalid_argument);
}

// A flattened section flattens the round yarn; flyaways keep their distance from its edge.
TEST(FibersOfYarnLaw, OnlyFlyawaysLeaveAFlattenedYarn) {
  YarnConfig yarn = yarn_of(2, 40, 0);
  yarn.ply_mm = PlyShape{0.08, 0.09, 0.11};
  yarn.ply_turns_per_mm = 1;
  yarn.yarn_turns_per_mm = -1;
  yarn.hairs = {20, {0.1, 0}, {0.2, 0}, {0, 0.1}, {0, 0.2}};
  const Exemplar exemplar = fibers_of(yarn, 3, 0.02);
  double highest = 0;
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p) {
      const Vec3& point = exemplar.points[p];
      const double across = std::hypot((point.y() - 0.5) / 0.195, point.z() / 0.095);
      if (exemplar.is_open[f] == 0) {
        EXPECT_LE(across, 1 + 1e-4);
      }
      highest = std::max(highest, std::abs(static_cast<double>(point.z())));
    }
  }
  // The highest of 120 ends 0.3 + 0.08 from the yarn's axis, 0.21 beyond the round yarn's edge.
  EXPECT_LE(highest, 0.095 + 0.21 + 1e-4);
  EXPECT_GT(highest, 0.095 + 0.19);
}

// A place of thickness 1.5 is so much thicker, and has 1.5^2 times as many fibers in its middle.
TEST(FibersOfYarnLaw, ThickPlacesAreThickerAndAsDense) {
  YarnConfig yarn = yarn_of(2, 40, 0);
  yarn.slubs = {{0.25, {2, 0}, {1.5, 0}}};
  const Exemplar exemplar = fibers_of(yarn, 4, 0.02);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "slubs"));
  ASSERT_EQ(exemplar.fiber_count(), 80U + 100U);
  double centre = 0;
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    if (exemplar.is_open[f] == 0) continue;
    const Vec3& first = exemplar.points[exemplar.first_point[f]];
    const Vec3& last = exemplar.points[exemplar.first_point[f + 1] - 1];
    centre = 0.5 * (first.x() + last.x());
    EXPECT_LT(last.x() - first.x(), 2);
  }
  double thick = 0;
  double thin = 0;
  for (const Vec3& point : exemplar.points) {
    const double from_centre = std::abs(std::remainder(point.x() - centre, 4.0));
    const double across = std::hypot((point.y() - 0.5) / 0.195, point.z() / 0.095);
    if (from_centre < 0.05) thick = std::max(thick, across);
    if (from_centre > 1.01) thin = std::max(thin, across);
  }
  EXPECT_NEAR(thick, 1.5, 0.01);
  EXPECT_NEAR(thin, 1, 0.01);
}

TEST(FibersOfYarnLaw, NepsAreBallsAtTheYarnsEdge) {
  YarnConfig yarn = round_yarn(5);
  yarn.neps = {0.5, {0.2, 0}, 12};
  const Exemplar exemplar = fibers_of(yarn, 4, 0.02);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "neps"));
  ASSERT_EQ(exemplar.fiber_count(), 5U + 24U);
  for (std::size_t f = 5; f < exemplar.fiber_count(); ++f) {
    Vec3 low = exemplar.points[exemplar.first_point[f]];
    Vec3 high = low;
    for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p) {
      low = low.cwiseMin(exemplar.points[p]);
      high = high.cwiseMax(exemplar.points[p]);
      EXPECT_NEAR(distance_from_axis(exemplar.points[p]), 0.195, 0.0955);
    }
    EXPECT_GT((high - low).norm(), 0.03);
    EXPECT_LT((high - low).maxCoeff(), 0.2);
  }
}

// An open yarn ends at both of its ends, and so do all of its fibers.
TEST(FibersOfYarnLaw, FibersOfAnOpenYarnStayOnIt) {
  YarnConfig yarn = round_yarn(6);
  yarn.hairs = {5, {0.1, 0.01}, {0.1, 0.02}, {0, 1}, {0, 0.2}};
  yarn.slubs = {{1, {2, 0}, {1.2, 0}}};
  Exemplar exemplar = fibers_of(yarn, 3, 0.02);
  const std::size_t regular = 6;
  exemplar.points.clear();
  exemplar.first_point = {0};
  exemplar.radius_mm.clear();
  exemplar.material.clear();
  exemplar.yarn.clear();
  exemplar.is_open.clear();
  CentreLine line = flat_yarn(yarn, 3, false);
  line.is_open = true;
  add_fibers_of_yarn(yarn, 0.005, line, 0.02, 1, 0, exemplar);
  ASSERT_GT(exemplar.fiber_count(), regular + 10);
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) EXPECT_EQ(exemplar.is_open[f], 1);
  for (const Vec3& point : exemplar.points) {
    EXPECT_GE(point.x(), -1e-5F);
    EXPECT_LE(point.x(), 3 + 1e-5F);
  }
}

TEST(FibersOfYarnLaw, SameSeedSameFibersOtherSeedOtherFibers) {
  const YarnConfig yarn = yarn_of(2, 5, 4);
  const Exemplar a = fibers_of(yarn, 2, 0.05, 1);
  const Exemplar b = fibers_of(yarn, 2, 0.05, 1);
  const Exemplar c = fibers_of(yarn, 2, 0.05, 2);
  EXPECT_EQ(a.points, b.points);
  EXPECT_NE(a.points, c.points);
}

}  // namespace
}  // namespace heddle

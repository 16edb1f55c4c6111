#include "fibers/cloth/fibers_of_yarn.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/cloth/yarn_paths.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

CentreLine flat_yarn(const YarnConfig& yarn, double length_mm, bool is_warp) {
  const auto shape = std::make_shared<const YarnShape>(YarnShape{
      length_mm / 4, std::vector<double>(4, 0.0), std::vector<double>(4, 0.5 * yarn.width_mm),
      std::vector<double>(4, 0.5 * yarn.height_mm)});
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

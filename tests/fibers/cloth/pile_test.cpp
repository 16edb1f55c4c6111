#include "fibers/cloth/pile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/vector.h"
#include "tests/support/fabrics.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

// A ground of 3 x 3 mm.
Exemplar ground() {
  FabricConfig config = test::small_fabric();
  config.repeats_x = config.repeats_y = 5;
  return synthesize(config);
}

PileConfig velvet() {
  PileConfig pile;
  pile.per_mm2 = 60;
  pile.length_mm = {1, 0.05};
  pile.lean = radians(20);
  pile.lean_azimuth = kHalfPi;
  pile.spread = radians(6);
  return pile;
}

Exemplar with_pile(const PileConfig& pile) {
  Exemplar exemplar = ground();
  add_pile(pile, 0.008, 0.05, 1, 1000, exemplar);
  index_segments(exemplar);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "pile"));
  return exemplar;
}

TEST(PileStatistical, FibersAreAsManyAndLeanAsAsked) {
  const Exemplar exemplar = with_pile(velvet());
  const std::size_t before = ground().fiber_count();
  EXPECT_NEAR(static_cast<double>(exemplar.fiber_count() - before), 60 * 9, 1);
  RunningMean length, along_x, along_y;
  for (std::size_t f = before; f < exemplar.fiber_count(); ++f) {
    ASSERT_EQ(exemplar.is_open[f], 1);
    const Vec3d whole = (exemplar.points[exemplar.first_point[f + 1] - 1] -
                         exemplar.points[exemplar.first_point[f]])
                            .cast<double>();
    length.add(whole.norm());
    along_x.add(std::atan2(whole.x(), whole.z()));
    along_y.add(std::atan2(whole.y(), std::hypot(whole.x(), whole.z())));
  }
  const auto agrees = [](const char* name, const RunningMean& mean, double expected) {
    EXPECT_TRUE(means_agree(name, mean.mean(), mean.standard_error(), expected, 0, 3));
  };
  agrees("length of pile, mm", length, 1);
  agrees("lean along the weft", along_x, 0);
  agrees("lean along the warp", along_y, radians(20));
}

TEST(PileLaw, NoFiberRisesAboveWhereItIsShorn) {
  PileConfig pile = velvet();
  pile.height_mm = 0.5;
  const Exemplar exemplar = with_pile(pile);
  const Exemplar below = ground();
  float top = 0;
  for (const Vec3& point : below.points) top = std::max(top, point.z());
  int shorn = 0;
  for (std::size_t f = below.fiber_count(); f < exemplar.fiber_count(); ++f) {
    const float end = exemplar.points[exemplar.first_point[f + 1] - 1].z();
    EXPECT_LE(end, top + 0.5F + 1e-5F);
    if (end > top + 0.5F - 1e-4F) ++shorn;
  }
  EXPECT_GT(shorn, 400);
}

TEST(PileLaw, RibsLeaveGaps) {
  PileConfig pile = velvet();
  pile.lean = pile.spread = 0;
  pile.height_mm = 0.5;
  pile.ribs = 3;
  pile.rib_gap_share = 0.4;
  const Exemplar exemplar = with_pile(pile);
  const double rib = exemplar.width_mm / 3.0;
  double highest_middle = 0;
  double highest_flank = 0;
  for (std::size_t f = ground().fiber_count(); f < exemplar.fiber_count(); ++f) {
    const Vec3& root = exemplar.points[exemplar.first_point[f]];
    const Vec3& end = exemplar.points[exemplar.first_point[f + 1] - 1];
    const double from_middle = std::abs(root.x() / rib - std::floor(root.x() / rib) - 0.5);
    EXPECT_LE(from_middle, 0.3 + 1e-6);
    double& highest = from_middle < 0.1 ? highest_middle : highest_flank;
    if (from_middle < 0.1 || from_middle > 0.25)
      highest = std::max(highest, static_cast<double>(end.z()));
  }
  EXPECT_GT(highest_middle - highest_flank, 0.1);
}

// Bent by more than a right angle, fibers lie down and never enter the ground again.
TEST(PileLaw, BentFibersLieOnTheGround) {
  PileConfig pile = velvet();
  pile.bend = radians(120);
  pile.curl = radians(20);
  const Exemplar exemplar = with_pile(pile);
  for (std::size_t f = ground().fiber_count(); f < exemplar.fiber_count(); ++f) {
    const float root = exemplar.points[exemplar.first_point[f]].z();
    for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p)
      EXPECT_GE(exemplar.points[p].z(), root - 1e-6F);
  }
}

TEST(PileLaw, RootsAreInTheGroundsYarns) {
  const Exemplar exemplar = with_pile(velvet());
  const Exemplar below = ground();
  for (std::size_t f = below.fiber_count(); f < exemplar.fiber_count(); f += 50) {
    const Vec3& root = exemplar.points[exemplar.first_point[f]];
    float nearest = 1;
    for (const Vec3& point : below.points) {
      Vec3 apart = point - root;
      apart.x() -= below.width_mm * std::round(apart.x() / below.width_mm);
      apart.y() -= below.height_mm * std::round(apart.y() / below.height_mm);
      nearest = std::min(nearest, apart.norm());
    }
    EXPECT_LT(nearest, 1e-5F);
  }
}

}  // namespace
}  // namespace heddle
